//! The back-end on the processor, with the compliance kept in 64 or 32 bits.

use std::ops::Range;
use std::sync::Arc;

use rayon::ThreadPool;
use rayon::prelude::*;

use crate::error::Error;
use crate::layout::{Layout, check_length};
use crate::multiply::{ComplianceMultiply, Scalar, check, check_displacement, check_rows};
use crate::scaling::power_of_two_below;
use kernels::{Product, SETS, Vectors};
use pages::Pages;

mod kernels;
mod pages;

/// Bytes of compliance to read from which threads are used. Measured on 2 cores that share the bandwidth of their
/// memory: 7 MB take a quarter longer with two threads, which must be woken, 13 MB less time than with one.
const THREADS_FROM: usize = 8 << 20;

/// A number in which the compliance can be kept.
pub trait Stored: bytemuck::Pod + Send + Sync + sealed::Sealed {
    /// Name of the back-end that keeps it.
    const NAME: &'static str;

    /// Is the matrix brought near 1 before it is kept?
    const IS_SCALED: bool;

    /// Rounded to nearest.
    fn from_f64(value: f64) -> Self;

    /// Exact.
    fn to_f64(self) -> f64;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Stored for f64 {
    const NAME: &'static str = "cpu, 64-bit compliance";
    const IS_SCALED: bool = false;

    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

impl Stored for f32 {
    const NAME: &'static str = "cpu, 32-bit compliance";
    const IS_SCALED: bool = true;

    fn from_f64(value: f64) -> Self {
        value as f32
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// The multiply on the processor, on one core unless [`with_threads`](Self::with_threads) asks for more.
///
/// The sum is formed in 64 bits. With 32-bit storage each number of C is rounded once, so
///
/// ```text
/// |u − u₆₄| ≤ 2⁻²⁴ Σ_j |C_ij| |f_j|  +  2⁻¹⁵⁰ max|C| Σ_j |f_j|
/// ```
/// beside the rounding of the sum itself. The second term is for numbers that are denormal after the
/// matrix has been brought near 1 by a power of two; that scaling makes the bound hold in any unit.
#[derive(Debug)]
pub struct Cpu<T> {
    layout: Layout,
    columns: Pages<T>,
    /// Power of two; stored number times this is the compliance in m/N.
    unit: f64,
    vectors: Vectors,
    /// Where more than one thread shares the rows.
    pool: Option<Arc<ThreadPool>>,
    /// Of the last call of `begin`.
    asked_columns: Vec<u32>,
    asked_forces: Vec<f64>,
    is_asked: bool,
}

impl<T: Stored> Cpu<T> {
    /// Copies a compliance given as blocks in stretches of rows (see [`Layout`]), m/N.
    ///
    /// # Errors
    /// Where a length is wrong, a number is not finite, or the system has not the memory.
    pub fn new(layout: Layout, blocks: &[&[f64]]) -> Result<Self, Error> {
        layout.check_blocks(blocks)?;
        let unit = if T::IS_SCALED {
            let numbers = blocks.iter().copied().flatten();
            power_of_two_below(numbers.fold(0.0, |m: f64, x| m.max(x.abs())))
        } else {
            1.0
        };
        let mut columns = Pages::new(layout.n_scalars())?;
        layout.columns_from_blocks(blocks, columns.as_mut_slice(), |x| T::from_f64(x / unit))?;
        Ok(Self {
            layout,
            columns,
            unit,
            vectors: Vectors::of_this_processor(),
            pool: None,
            asked_columns: Vec::with_capacity(layout.n_candidates()),
            asked_forces: Vec::with_capacity(3 * layout.n_candidates()),
            is_asked: false,
        })
    }

    /// Shares the rows between `n_threads` threads of its own where that is faster. The bits stay the same.
    ///
    /// One thread, the default, is the caller's, and the calls then do not allocate.
    ///
    /// # Errors
    /// Where the system gives no threads.
    pub fn with_threads(mut self, n_threads: usize) -> Result<Self, Error> {
        self.pool = if n_threads > 1 {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(n_threads)
                .thread_name(|k| format!("multiply {k}"))
                .build();
            let pool = pool.map_err(|error| Error::NoThreads {
                n_threads,
                reason: error.to_string(),
            })?;
            Some(Arc::new(pool))
        } else {
            None
        };
        Ok(self)
    }
}

impl<T: Stored> ComplianceMultiply for Cpu<T> {
    fn name(&self) -> &str {
        T::NAME
    }

    fn bytes(&self) -> u64 {
        size_of_val(self.columns.as_slice()) as u64
    }

    fn layout(&self) -> Layout {
        self.layout
    }

    fn multiply_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        check_displacement(self.layout, displacement)?;
        self.multiply_range(columns, forces, 0..self.layout.n_rows(), displacement);
        Ok(())
    }

    fn multiply_rows_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        n_first: usize,
        rows: &[u32],
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        check_displacement(self.layout, displacement)?;
        check_rows(self.layout, n_first, rows)?;
        self.multiply_range(columns, forces, 0..n_first, displacement);
        // Rows that follow each other are one stretch.
        for run in rows.chunk_by(|a, b| a + 1 == *b) {
            let first = run[0] as usize;
            self.multiply_range(columns, forces, first..first + run.len(), displacement);
        }
        Ok(())
    }

    fn multiply_batch_into(
        &mut self,
        n_sets: usize,
        columns: &[u32],
        forces: &[f64],
        displacements: &mut [f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, n_sets)?;
        let n = self.layout.displacement_len();
        check_length("displacements", displacements.len(), n_sets * n)?;
        let n_threads = self.pool.as_ref().map_or(1, |p| p.current_num_threads());
        let share = n_sets.div_ceil(n_threads).clamp(1, SETS);
        let per_set = 3 * columns.len();
        let some_sets = |(k, displacements): (usize, &mut [f64])| {
            let begin = k * share * per_set;
            let end = begin + displacements.len() / n * per_set;
            let product = self.product(columns, &forces[begin..end]);
            if displacements.len() == n {
                product.stretch_into(self.vectors, 0, displacements);
            } else {
                product.sets_into(self.vectors, displacements);
            }
        };
        match &self.pool {
            Some(pool) if n_sets > 1 => pool.install(|| {
                let sets = displacements.par_chunks_mut(share * n);
                sets.enumerate().for_each(some_sets);
            }),
            _ => displacements
                .chunks_mut(share * n)
                .enumerate()
                .for_each(some_sets),
        }
        Ok(())
    }

    fn begin(&mut self, columns: &[u32], forces: &[f64]) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        self.asked_columns.clear();
        self.asked_columns.extend_from_slice(columns);
        self.asked_forces.clear();
        self.asked_forces.extend_from_slice(forces);
        self.is_asked = true;
        Ok(())
    }

    fn newest_into(&mut self, displacement: &mut [f64]) -> Result<bool, Error> {
        check_displacement(self.layout, displacement)?;
        if !std::mem::take(&mut self.is_asked) {
            return Ok(false);
        }
        let rows = 0..self.layout.n_rows();
        self.multiply_range(&self.asked_columns, &self.asked_forces, rows, displacement);
        Ok(true)
    }
}

impl<T: Stored> Cpu<T> {
    /// Displacement of a stretch of rows.
    fn multiply_range(
        &self,
        columns: &[u32],
        forces: &[f64],
        rows: Range<usize>,
        displacement: &mut [f64],
    ) {
        let product = self.product(columns, forces);
        let first = 3 * rows.start;
        let displacement = &mut displacement[first..3 * rows.end];
        match &self.pool {
            Some(pool)
                if 3 * columns.len() * displacement.len() * size_of::<T>() >= THREADS_FROM =>
            {
                let share = displacement.len().div_ceil(pool.current_num_threads());
                pool.install(|| {
                    let shares = displacement.par_chunks_mut(share).enumerate();
                    shares.for_each(|(k, u)| {
                        product.stretch_into(self.vectors, first + k * share, u);
                    });
                });
            }
            _ => product.stretch_into(self.vectors, first, displacement),
        }
    }

    fn product<'a>(&'a self, columns: &'a [u32], forces: &'a [f64]) -> Product<'a, T> {
        Product {
            layout: self.layout,
            compliance: self.columns.as_slice(),
            unit: self.unit,
            columns,
            forces,
        }
    }
}

/// A multiply on the processor with the compliance kept as asked.
///
/// # Errors
/// Where the length is wrong or a number is not finite.
pub fn on_cpu(
    layout: Layout,
    blocks: &[&[f64]],
    scalar: Scalar,
) -> Result<Box<dyn ComplianceMultiply>, Error> {
    on_cpu_with_threads(layout, blocks, scalar, 1)
}

/// As [`on_cpu`], with the rows shared between threads; see [`Cpu::with_threads`].
///
/// # Errors
/// As [`on_cpu`], and where the system gives no threads.
pub fn on_cpu_with_threads(
    layout: Layout,
    blocks: &[&[f64]],
    scalar: Scalar,
    n_threads: usize,
) -> Result<Box<dyn ComplianceMultiply>, Error> {
    Ok(match scalar {
        Scalar::F32 => Box::new(Cpu::<f32>::new(layout, blocks)?.with_threads(n_threads)?),
        Scalar::F64 => Box::new(Cpu::<f64>::new(layout, blocks)?.with_threads(n_threads)?),
    })
}

#[cfg(test)]
mod tests;

//! The compliance as it is kept while a part is touched: what the step reads lies apart from what only the drawn
//! shape reads, in memory of its own or mapped from the cache file, in 64 or 32 bits.

mod mapped;

use std::sync::Arc;

use bytemuck::cast_slice;
use fem::Compliance;
use glam::{DMat3, DVec3, Mat3};

pub use mapped::Mapped;

/// 64-bit numbers, in memory of their own or in a mapped file.
#[derive(Debug)]
pub enum Source {
    /// In memory of their own.
    Owned(Vec<f64>),
    /// In a mapped file: pages are read when they are asked for, and are shared with other processes.
    Mapped(Mapped),
    /// Of another.
    Shared(Arc<Source>),
}

impl std::ops::Deref for Source {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        match self {
            Self::Owned(numbers) => numbers,
            Self::Mapped(numbers) => numbers.as_slice(),
            Self::Shared(numbers) => numbers,
        }
    }
}

/// 3x3 blocks of a compliance, column-major inside, m/N.
#[derive(Debug)]
pub enum Blocks {
    /// As they were computed.
    F64(Source),
    /// Rounded once, half the memory: `values` times `unit` is the compliance. The power of two brings the largest
    /// number near 1, so that units do not matter.
    F32 {
        /// 9 for each block.
        values: Vec<f32>,
        /// m/N.
        unit: f64,
    },
}

impl Blocks {
    /// The numbers rounded to 32 bits: each is wrong by 6e-8 of itself, or by 1e-38 of the largest.
    pub fn rounded(numbers: &[f64]) -> Self {
        let largest = numbers.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // The exponent's bits alone are the power of two below.
        let unit = if largest.is_normal() {
            f64::from_bits(largest.to_bits() & (0x7ff << 52))
        } else {
            1.0
        };
        Self::F32 {
            values: numbers.iter().map(|x| (x / unit) as f32).collect(),
            unit,
        }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        match self {
            Self::F64(numbers) => numbers.len() / 9,
            Self::F32 { values, .. } => values.len() / 9,
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory, mapped or owned.
    pub fn bytes(&self) -> usize {
        match self {
            Self::F64(numbers) => size_of_val::<[f64]>(numbers),
            Self::F32 { values, .. } => size_of_val::<[f32]>(values),
        }
    }

    /// Block `k`.
    #[inline]
    pub fn get(&self, k: usize) -> DMat3 {
        match self {
            Self::F64(numbers) => cast_slice::<f64, DMat3>(numbers)[k],
            Self::F32 { values, unit } => {
                let block: &Mat3 = &cast_slice(values)[k];
                block.as_dmat3() * *unit
            }
        }
    }

    /// Σ B_kᵀ f over the given blocks, counted from `first`, and vectors.
    #[inline]
    pub fn sum_transposed(
        &self,
        first: usize,
        terms: impl Iterator<Item = (usize, DVec3)>,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        match self {
            Self::F64(numbers) => {
                let blocks = &cast_slice::<f64, DMat3>(numbers)[first..];
                for (k, f) in terms {
                    sum += blocks[k].mul_transpose_vec3(f);
                }
                sum
            }
            Self::F32 { values, unit } => {
                let blocks = &cast_slice::<f32, Mat3>(values)[first..];
                for (k, f) in terms {
                    sum += blocks[k].as_dmat3().mul_transpose_vec3(f);
                }
                *unit * sum
            }
        }
    }
}

/// The whole compliance of a prepared part: every candidate's column.
#[derive(Debug)]
pub struct StoredCompliance {
    n_candidates: usize,
    n_rows: usize,
    /// Block of candidates i and j at `j n_candidates + i`: what the step reads.
    contact: Arc<Source>,
    /// Block of row `n_candidates + i` and candidate j at `j (n_rows - n_candidates) + i`: drawn only.
    drawn: Source,
}

impl StoredCompliance {
    /// Takes the two sections apart.
    pub fn new(built: Compliance) -> Self {
        let (n_candidates, n_rows) = (built.candidates.len(), built.rows.len());
        if n_candidates == n_rows {
            return Self::of_sections(
                n_candidates,
                n_rows,
                Source::Owned(built.blocks),
                Source::Owned(Vec::new()),
            );
        }
        let (contact, drawn) = sections(&built);
        let owned = |columns: &mut dyn Iterator<Item = &[f64]>| {
            Source::Owned(columns.flatten().copied().collect())
        };
        Self::of_sections(
            n_candidates,
            n_rows,
            owned(&mut contact.into_iter()),
            owned(&mut drawn.into_iter()),
        )
    }

    /// # Panics
    /// If the sections have not the sizes of the numbers of candidates and rows (a programmer's mistake).
    pub(crate) fn of_sections(
        n_candidates: usize,
        n_rows: usize,
        contact: Source,
        drawn: Source,
    ) -> Self {
        assert_eq!(contact.len(), 9 * n_candidates * n_candidates);
        assert_eq!(drawn.len(), 9 * n_candidates * (n_rows - n_candidates));
        Self {
            n_candidates,
            n_rows,
            contact: Arc::new(contact),
            drawn,
        }
    }

    /// Nodes that can touch.
    pub fn n_candidates(&self) -> usize {
        self.n_candidates
    }

    /// C of row `i` and candidate `j`, column-major.
    pub fn block(&self, i: usize, j: usize) -> &[f64] {
        match i.checked_sub(self.n_candidates) {
            None => &self.contact[9 * (j * self.n_candidates + i)..][..9],
            Some(i) => &self.drawn[9 * (j * (self.n_rows - self.n_candidates) + i)..][..9],
        }
    }

    /// The rows of the candidates, which the step reads.
    pub fn contact(&self) -> &Arc<Source> {
        &self.contact
    }

    /// Stretches of rows, one after the other: candidates, then those that are only drawn.
    pub fn stretches(&self) -> [&[f64]; 2] {
        [&self.contact, &self.drawn]
    }

    /// Memory of both sections, mapped or owned.
    pub fn bytes(&self) -> usize {
        self.stretches().map(size_of_val::<[f64]>).iter().sum()
    }
}

/// The columns of a built compliance: rows of the candidates, and the others.
pub(crate) fn sections(built: &Compliance) -> (Vec<&[f64]>, Vec<&[f64]>) {
    let of_candidates = 9 * built.candidates.len();
    let columns = built.blocks.chunks_exact((9 * built.rows.len()).max(1));
    columns.map(|column| column.split_at(of_candidates)).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Compliance {
        Compliance {
            candidates: vec![3, 7],
            rows: vec![3, 7, 9],
            blocks: (0..54).map(|x| f64::from(x) - 20.3).collect(),
        }
    }

    #[test]
    fn blocks_are_those_of_the_whole() {
        for rows in [3, 2] {
            let mut built = sample();
            built.rows.truncate(rows);
            built.blocks.truncate(18 * rows);
            let stored = StoredCompliance::new(built.clone());
            for j in 0..2 {
                for i in 0..rows {
                    assert_eq!(stored.block(i, j), built.block(i, j));
                }
            }
            assert_eq!(stored.bytes(), 8 * 18 * rows);
        }
    }

    #[test]
    fn rounded_blocks_are_right_to_seven_digits_in_any_units() {
        let exact = sample().blocks;
        let force = DVec3::new(0.3, -2.0, 1.7);
        let terms = || [(0, force), (2, -force)].into_iter();
        let blocks = Blocks::F64(Source::Owned(exact.clone()));
        let rounded = Blocks::rounded(&exact);
        assert_eq!((rounded.len(), rounded.bytes()), (6, blocks.bytes() / 2));
        let largest = exact.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for k in 0..6 {
            let difference = rounded.get(k) - blocks.get(k);
            assert!(difference.abs_diff_eq(DMat3::ZERO, 6e-8 * largest));
            assert_eq!(blocks.get(k).to_cols_array(), exact[9 * k..][..9]);
        }
        for first in 0..4 {
            let exact =
                blocks.get(first).transpose() * force - blocks.get(first + 2).transpose() * force;
            let (wide, narrow) = (
                blocks.sum_transposed(first, terms()),
                rounded.sum_transposed(first, terms()),
            );
            assert!((wide - exact).length() < 1e-13 * largest);
            assert!((narrow - exact).length() < 1e-6 * largest);
        }
        // The same bits in units that differ by a power of two, and far from what 32 bits hold.
        let scale = 2_f64.powi(-200);
        let scaled: Vec<f64> = exact.iter().map(|x| scale * x).collect();
        let small = Blocks::rounded(&scaled);
        for k in 0..6 {
            assert_eq!(small.get(k), rounded.get(k) * scale);
        }
        assert!(Blocks::rounded(&[]).is_empty());
    }
}

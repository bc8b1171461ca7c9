//! Surface compliance: displacement of surface nodes per force on the nodes that can touch.
//!
//! `C = (K⁻¹)_ss` column by column, which is static condensation for nodes that carry no force
//! (Duriez et al. 2004, section 3.1).

use faer::{Mat, MatMut, Side};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::Error;
use crate::assembly::Stiffness;
use crate::factor::FactoredStiffness;
use crate::progress::Progress;

/// Right-hand sides solved at a time: larger panels cost more memory and are not faster.
const PANEL: usize = 96;

/// Displacement of `rows` per unit force on `candidates`, m/N.
#[derive(Clone, Debug, PartialEq)]
pub struct Compliance {
    /// Nodes that can touch.
    pub candidates: Vec<u32>,
    /// Nodes whose displacement is wanted; the candidates come first, in the same order.
    pub rows: Vec<u32>,
    /// 3x3 blocks: C of row i and candidate j at `9 (j n_rows + i)`, column-major inside.
    pub blocks: Vec<f64>,
}

/// What was found about a compliance after its build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComplianceChecks {
    /// Largest |C_ij - C_jiᵀ| over the largest entry.
    pub symmetry_rel: f64,
    /// Largest |K x - e| of sampled columns, for unit forces e.
    pub residual_rel: f64,
    /// Smallest over largest pivot of the Cholesky factor of a sampled block: positive.
    pub smallest_pivot_rel: f64,
}

impl Compliance {
    /// Solves for all columns, in panels, in parallel.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::TooLarge`].
    ///
    /// # Panics
    /// If `rows` does not begin with `candidates` (a programmer's mistake).
    pub fn build(
        factor: &FactoredStiffness,
        candidates: &[u32],
        rows: &[u32],
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        assert!(
            rows.starts_with(candidates),
            "the candidates are the first rows"
        );
        let n_rows = rows.len();
        let len = 9 * n_rows * candidates.len();
        let mut blocks = Vec::new();
        blocks
            .try_reserve_exact(len)
            .map_err(|_| Error::TooLarge(format!("{} bytes of compliance", 8 * len)))?;
        blocks.resize(len, 0.0);
        let done = AtomicUsize::new(0);
        let per_panel = PANEL / 3;
        let row_places: Vec<[Option<usize>; 3]> = rows
            .iter()
            .map(|&node| std::array::from_fn(|c| factor.free_of(3 * node as usize + c)))
            .collect();
        blocks
            .par_chunks_mut((9 * n_rows * per_panel).max(1))
            .zip(candidates.par_chunks(per_panel))
            .try_for_each(|(blocks, nodes)| {
                if progress.is_cancelled() {
                    return Err(Error::Cancelled);
                }
                let n = factor.n_free();
                let width = 3 * nodes.len();
                let mut panel = vec![0.0; n * width];
                for (j, &node) in nodes.iter().enumerate() {
                    for c in 0..3 {
                        if let Some(free) = factor.free_of(3 * node as usize + c) {
                            panel[(3 * j + c) * n + free] = 1.0;
                        }
                    }
                }
                let mut memory = factor.solve_memory(width);
                factor.solve_in_place(
                    MatMut::from_column_major_slice_mut(&mut panel, n, width),
                    &mut memory,
                );
                for (j, column) in blocks.chunks_exact_mut(9 * n_rows).enumerate() {
                    for (block, places) in column.chunks_exact_mut(9).zip(&row_places) {
                        for c in 0..3 {
                            let x = &panel[(3 * j + c) * n..][..n];
                            for (r, place) in places.iter().enumerate() {
                                block[3 * c + r] = place.map_or(0.0, |p| x[p]);
                            }
                        }
                    }
                }
                let total = done.fetch_add(nodes.len(), Ordering::Relaxed) + nodes.len();
                progress.advance("compliance columns", total, candidates.len());
                Ok(())
            })?;
        Ok(Self {
            candidates: candidates.to_vec(),
            rows: rows.to_vec(),
            blocks,
        })
    }

    /// C of row `i` and candidate `j`, column-major.
    pub fn block(&self, i: usize, j: usize) -> &[f64] {
        &self.blocks[9 * (j * self.rows.len() + i)..][..9]
    }

    /// Checks symmetry, positive definiteness and the residual of sampled columns.
    ///
    /// # Errors
    /// [`Error::CheckFailed`] if a number is beyond what double precision leaves of a part that
    /// can be simulated at all: residual 1e-6, symmetry 1e-6.
    pub fn check(
        &self,
        stiffness: &Stiffness,
        factor: &FactoredStiffness,
    ) -> Result<ComplianceChecks, Error> {
        const LIMIT: f64 = 1e-6;
        let checks = ComplianceChecks {
            symmetry_rel: self.asymmetry(),
            residual_rel: self.residual(stiffness, factor),
            smallest_pivot_rel: self.smallest_pivot()?,
        };
        for (what, value) in [
            ("asymmetry", checks.symmetry_rel),
            ("residual", checks.residual_rel),
        ] {
            if value.is_nan() || value > LIMIT {
                return Err(Error::CheckFailed {
                    what,
                    value,
                    limit: LIMIT,
                });
            }
        }
        Ok(checks)
    }

    fn asymmetry(&self) -> f64 {
        let n = self.candidates.len();
        let largest = self
            .blocks
            .par_iter()
            .map(|v| v.abs())
            .reduce(|| 0.0, f64::max);
        let worst = (0..n)
            .into_par_iter()
            .map(|j| {
                let mut worst = 0.0f64;
                for i in 0..=j {
                    let (a, b) = (self.block(i, j), self.block(j, i));
                    for c in 0..3 {
                        for r in 0..3 {
                            worst = worst.max((a[3 * c + r] - b[3 * r + c]).abs());
                        }
                    }
                }
                worst
            })
            .reduce(|| 0.0, f64::max);
        if largest == 0.0 { 0.0 } else { worst / largest }
    }

    /// Up to 8 columns, spread over the candidates, solved again and put into K.
    fn residual(&self, stiffness: &Stiffness, factor: &FactoredStiffness) -> f64 {
        let step = self.candidates.len().div_ceil(8).max(1);
        let mut worst = 0.0f64;
        for (k, &node) in self.candidates.iter().enumerate().step_by(step) {
            let dof = 3 * node as usize + k % 3;
            let mut force = vec![0.0; factor.n_dofs()];
            force[dof] = 1.0;
            let u = factor.solve(&force);
            let back = stiffness.multiply(&u);
            for i in (0..factor.n_dofs()).filter(|&i| factor.free_of(i).is_some()) {
                worst = worst.max((back[i] - force[i]).abs());
            }
        }
        worst
    }

    /// Cholesky of the block of up to 64 candidates.
    fn smallest_pivot(&self) -> Result<f64, Error> {
        let step = self.candidates.len().div_ceil(64).max(1);
        let sample: Vec<usize> = (0..self.candidates.len()).step_by(step).collect();
        let entry =
            |r: usize, c: usize| self.block(sample[r / 3], sample[c / 3])[3 * (c % 3) + r % 3];
        // A candidate that is held in one direction has no compliance there.
        let dofs: Vec<usize> = (0..3 * sample.len())
            .filter(|&d| entry(d, d) != 0.0)
            .collect();
        let n = dofs.len();
        let matrix = Mat::from_fn(n, n, |r, c| entry(dofs[r], dofs[c]));
        let llt = matrix.llt(Side::Lower).map_err(|_| Error::CheckFailed {
            what: "smallest pivot (positive definiteness)",
            value: 0.0,
            limit: 0.0,
        })?;
        let l = llt.L();
        let pivots = (0..n).map(|i| l[(i, i)] * l[(i, i)]);
        let (low, high) = pivots.fold((f64::INFINITY, 0.0f64), |(a, b), p| (a.min(p), b.max(p)));
        Ok(if high > 0.0 { low / high } else { 1.0 })
    }
}

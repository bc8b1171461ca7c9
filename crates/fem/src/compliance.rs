//! Surface compliance: displacement of surface nodes per force on the nodes that can touch.
//!
//! `C = (K⁻¹)_ss` column by column, which is static condensation for nodes that carry no force
//! (Duriez et al. 2004, section 3.1).

use faer::{Mat, Side};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::Error;
use crate::assembly::Stiffness;
use crate::columns::{Panel, SupernodeTree};
use crate::factor::FactoredStiffness;
use crate::ordered::HELD;
use crate::progress::Progress;

/// Nodes solved for at a time, three right-hand sides each: larger panels cost more memory and are
/// not faster.
const PER_PANEL: usize = 32;

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
    /// Solves for all columns, in panels, in parallel: the same bits for any number of threads.
    ///
    /// Of two entries that are equal by symmetry one is solved for and copied to the other, unless
    /// both are in one panel.
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
        // Asked for first, then taken as zeroes that the panels touch in parallel.
        Vec::<f64>::new()
            .try_reserve_exact(len)
            .map_err(|_| Error::TooLarge(format!("{} bytes of compliance", 8 * len)))?;
        let mut blocks = vec![0.0; len];
        if factor.n_free() == 0 {
            // Nothing moves, and there is no supernode.
            return Ok(Self {
                candidates: candidates.to_vec(),
                rows: rows.to_vec(),
                blocks,
            });
        }
        let plan = Plan::new(factor, candidates, rows);
        let mut columns: Vec<_> = blocks
            .chunks_exact_mut((9 * n_rows).max(1))
            .map(Some)
            .collect();
        let mut columns: Vec<(u32, &mut [f64])> = plan
            .sequence
            .iter()
            .filter_map(|&j| Some((j, columns[j as usize].take()?)))
            .collect();
        let done = AtomicUsize::new(0);
        columns
            .par_chunks_mut(PER_PANEL)
            .enumerate()
            .try_for_each_init(
                || Panel::new(&plan.tree, 3 * PER_PANEL),
                |panel, (panel_idx, columns)| {
                    if progress.is_cancelled() {
                        return Err(Error::Cancelled);
                    }
                    plan.solve(panel_idx, columns, panel);
                    let total = done.fetch_add(columns.len(), Ordering::Relaxed) + columns.len();
                    progress.advance("compliance columns", total, candidates.len());
                    Ok(())
                },
            )?;
        mirror(&mut blocks, 9 * n_rows, &plan.panel_of);
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

    /// Checks symmetry and positive definiteness, and solves sampled columns again, each by itself:
    /// their residual, and whether they are what is kept (what was copied by symmetry is symmetric
    /// even if it is wrong).
    ///
    /// # Errors
    /// [`Error::CheckFailed`] if a number is beyond what double precision leaves of a part that
    /// can be simulated at all: 1e-6 each.
    pub fn check(
        &self,
        stiffness: &Stiffness,
        factor: &FactoredStiffness,
    ) -> Result<ComplianceChecks, Error> {
        const LIMIT: f64 = 1e-6;
        let (residual_rel, difference_rel) = self.solve_again(stiffness, factor);
        let checks = ComplianceChecks {
            symmetry_rel: self.asymmetry(),
            residual_rel,
            smallest_pivot_rel: self.smallest_pivot()?,
        };
        for (what, value) in [
            ("asymmetry", checks.symmetry_rel),
            ("residual", checks.residual_rel),
            ("difference to columns solved again", difference_rel),
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

    /// Up to 8 columns, spread over the candidates, solved again: what is left when they are put
    /// into K, and their difference to what is kept, over the largest entry.
    fn solve_again(&self, stiffness: &Stiffness, factor: &FactoredStiffness) -> (f64, f64) {
        let step = self.candidates.len().div_ceil(8).max(1);
        let (mut worst, mut largest, mut difference) = (0.0f64, 0.0f64, 0.0f64);
        for (j, &node) in self.candidates.iter().enumerate().step_by(step) {
            let component = j % 3;
            let dof = 3 * node as usize + component;
            let mut force = vec![0.0; factor.n_dofs()];
            force[dof] = 1.0;
            let u = factor.solve(&force);
            let back = stiffness.multiply(&u);
            for i in (0..factor.n_dofs()).filter(|&i| factor.free_of(i).is_some()) {
                worst = worst.max((back[i] - force[i]).abs());
            }
            for (i, &row) in self.rows.iter().enumerate() {
                let kept = &self.block(i, j)[3 * component..][..3];
                for (kept, u) in kept.iter().zip(&u[3 * row as usize..]) {
                    largest = largest.max(u.abs());
                    difference = difference.max((kept - u).abs());
                }
            }
        }
        let difference_rel = if difference == 0.0 {
            0.0
        } else {
            difference / largest
        };
        (worst, difference_rel)
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

/// Which columns are solved together, and where their rows are.
struct Plan<'a> {
    factor: &'a FactoredStiffness,
    tree: SupernodeTree,
    /// Candidates in the order of elimination.
    sequence: Vec<u32>,
    /// Panel of each candidate.
    panel_of: Vec<u32>,
    /// Positions of the components of each row, [`HELD`] if held.
    places: Vec<[u32; 3]>,
}

impl<'a> Plan<'a> {
    fn new(factor: &'a FactoredStiffness, candidates: &[u32], rows: &[u32]) -> Self {
        let place = |dof: usize| factor.position_of(dof).map_or(HELD, |p| p as u32);
        let places: Vec<[u32; 3]> = rows
            .iter()
            .map(|&node| std::array::from_fn(|c| place(3 * node as usize + c)))
            .collect();
        let mut sequence: Vec<u32> = (0..candidates.len() as u32).collect();
        sequence.sort_by_key(|&j| places[j as usize].iter().min());
        let mut panel_of = vec![0; candidates.len()];
        for (k, &j) in sequence.iter().enumerate() {
            panel_of[j as usize] = (k / PER_PANEL) as u32;
        }
        Self {
            factor,
            tree: SupernodeTree::new(factor.supernodes()),
            sequence,
            panel_of,
            places,
        }
    }

    /// Solves for the columns of a panel, at the rows of this and later panels and those that are
    /// no candidates.
    fn solve(&self, panel_idx: usize, columns: &mut [(u32, &mut [f64])], panel: &mut Panel) {
        let llt = self.factor.supernodes();
        let is_solved = |row: usize| {
            self.panel_of
                .get(row)
                .is_none_or(|&p| p as usize >= panel_idx)
        };
        let supernodes_of = |row: usize| {
            let free = self.places[row].into_iter().filter(|&p| p != HELD);
            free.map(|p| self.tree.of_position(p as usize))
        };
        let mut is_on_the_way = vec![false; self.tree.n_supernodes()];
        for &(j, _) in &*columns {
            supernodes_of(j as usize).for_each(|s| is_on_the_way[s] = true);
        }
        self.tree.close_upwards(&mut is_on_the_way);
        let mut is_wanted = vec![false; self.tree.n_supernodes()];
        for row in (0..self.places.len()).filter(|&row| is_solved(row)) {
            supernodes_of(row).for_each(|s| is_wanted[s] = true);
        }
        self.tree.close_upwards(&mut is_wanted);

        // What is on the way is wanted: the panel's own rows are.
        for s in (0..is_wanted.len()).filter(|&s| is_wanted[s]) {
            panel.clear(llt, s);
        }
        let width = panel.width();
        for (k, (j, _)) in columns.iter().enumerate() {
            for (c, place) in self.places[*j as usize].into_iter().enumerate() {
                if place != HELD {
                    panel.x[place as usize * width + 3 * k + c] = self.factor.scale();
                }
            }
        }
        for s in (0..is_on_the_way.len()).filter(|&s| is_on_the_way[s]) {
            panel.forward(llt, s);
        }
        for s in (0..is_wanted.len()).rev().filter(|&s| is_wanted[s]) {
            panel.backward(llt, s);
        }
        for row in (0..self.places.len()).filter(|&row| is_solved(row)) {
            for (r, place) in self.places[row].into_iter().enumerate() {
                if place == HELD {
                    continue;
                }
                let x = &panel.x[place as usize * width..][..width];
                for ((_, column), x) in columns.iter_mut().zip(x.chunks_exact(3)) {
                    for c in 0..3 {
                        column[9 * row + 3 * c + r] = x[c];
                    }
                }
            }
        }
    }
}

/// Columns that are mirrored at a time.
const TILE: usize = 16;

/// Copies what was solved for to where symmetry has the same: row i of column j, for a candidate i
/// in an earlier panel than j, is row j of column i, transposed.
fn mirror(columns: &mut [f64], stride: usize, panel_of: &[u32]) {
    mirror_within(columns, 0, stride, panel_of);
}

fn mirror_within(columns: &mut [f64], first: usize, stride: usize, panel_of: &[u32]) {
    let n = columns.len() / stride.max(1);
    if n < 2 {
        return;
    }
    let half = n / 2;
    let (left, right) = columns.split_at_mut(half * stride);
    mirror_between(left, right, [first, first + half], stride, panel_of);
    rayon::join(
        || mirror_within(left, first, stride, panel_of),
        || mirror_within(right, first + half, stride, panel_of),
    );
}

fn mirror_between(
    left: &mut [f64],
    right: &mut [f64],
    first: [usize; 2],
    stride: usize,
    panel_of: &[u32],
) {
    let (n_left, n_right) = (left.len() / stride, right.len() / stride);
    if n_left.max(n_right) > TILE {
        let (a, b) = (n_left / 2, n_right / 2);
        let (left_a, left_b) = left.split_at_mut(a * stride);
        let (right_a, right_b) = right.split_at_mut(b * stride);
        let [l, r] = first;
        let (la, lb, ra, rb) = (l, l + a, r, r + b);
        rayon::join(
            || mirror_between(left_a, right_a, [la, ra], stride, panel_of),
            || mirror_between(left_b, right_b, [lb, rb], stride, panel_of),
        );
        rayon::join(
            || mirror_between(left_a, right_b, [la, rb], stride, panel_of),
            || mirror_between(left_b, right_a, [lb, ra], stride, panel_of),
        );
        return;
    }
    for (j, column_j) in left.chunks_exact_mut(stride).enumerate() {
        for (i, column_i) in right.chunks_exact_mut(stride).enumerate() {
            let (j, i) = (first[0] + j, first[1] + i);
            let (in_j, in_i) = (&mut column_j[9 * i..][..9], &mut column_i[9 * j..][..9]);
            match panel_of[i].cmp(&panel_of[j]) {
                std::cmp::Ordering::Less => transpose_into(in_i, in_j),
                std::cmp::Ordering::Greater => transpose_into(in_j, in_i),
                std::cmp::Ordering::Equal => {}
            }
        }
    }
}

fn transpose_into(from: &[f64], to: &mut [f64]) {
    for c in 0..3 {
        for r in 0..3 {
            to[3 * c + r] = from[3 * r + c];
        }
    }
}

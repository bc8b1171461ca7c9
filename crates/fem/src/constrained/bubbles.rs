//! Constrained compliance for any set of free nodes, from data made once.
//!
//! In the basis `u = T u_1 + Σ_j e_j b_j` a node that follows is freed by letting its bubble `b_j`
//! move. With C_1 the inverse of Tᵀ K T, all bubbles at zero, and K_1j = Tᵀ K e_j:
//!
//! ```text
//! G⁰_st = T_s C_1 T_tᵀ             R_sj = B_sj - T_s C_1 K_1j          B_sj = 1 if s is j, else 0
//! Σ_jk  = K_jk - K_j1 C_1 K_1k     G_st(F) = G⁰_st + R_sF Σ_FF⁻¹ R_tFᵀ
//! ```
//!
//! Freeing nodes costs one Cholesky factor of Σ_FF and no new inverse of the part.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatMut, Side};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::{SparseRows, reduce, rows_of};
use crate::Error;
use crate::assembly::Stiffness;
use crate::compliance::Compliance;
use crate::factor::FactoredStiffness;
use crate::hierarchy::Constraints;
use crate::progress::Progress;
use crate::supports::Supports;

/// Nodes solved at a time, three right-hand sides each.
const PANEL: usize = 32;

/// Compliance with all of some nodes following, and what freeing any of them adds.
#[derive(Clone, Debug, PartialEq)]
pub struct BubbleCompliance {
    /// Nodes that can touch.
    pub candidates: Vec<u32>,
    /// Nodes whose displacement is wanted; the candidates come first, in the same order.
    pub rows: Vec<u32>,
    /// Nodes that may ever be freed.
    pub bubbles: Vec<u32>,
    /// G⁰, m/N. 3x3 blocks: of row s and candidate t at `9 (t n_rows + s)`, column-major inside.
    pub coarse: Vec<f64>,
    /// R, without unit: displacement of rows per unit of a bubble with the rest in equilibrium. 3x3
    /// blocks: of row s and bubble j at `9 (j n_rows + s)`, column-major inside. Zero for held
    /// components.
    pub coupling: Vec<f64>,
    /// Σ, N/m: symmetric to the last bit, column-major, 3 n_bubbles x 3 n_bubbles. For a held
    /// component 1 on the diagonal and zero beside.
    pub sigma: Vec<f64>,
}

impl BubbleCompliance {
    /// Factors Tᵀ K T and solves for candidates and bubbles, in panels, in parallel.
    ///
    /// `constraints`: what follows as long as no bubble is free; all interface nodes, or fewer if
    /// some are always free. To be made with the same supports.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`], [`Error::TooLarge`], [`Error::Cancelled`].
    ///
    /// # Panics
    /// If `rows` does not begin with `candidates`, a bubble is not a node that follows, or is there
    /// twice, or stiffness and constraints are of different meshes (a programmer's mistake).
    pub fn build(
        stiffness: &Stiffness,
        supports: &Supports,
        constraints: &Constraints,
        candidates: &[u32],
        rows: &[u32],
        bubbles: &[u32],
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        assert!(
            rows.starts_with(candidates),
            "the candidates are the first rows"
        );
        let n_dofs = stiffness.n_dofs();
        assert_eq!(
            n_dofs,
            constraints.n_dofs(),
            "stiffness and constraints of one mesh"
        );
        let mut bubble_of_node = vec![None; n_dofs / 3];
        for (j, &node) in bubbles.iter().enumerate() {
            assert!(
                constraints.of_node(node).is_some(),
                "bubble {node} does not follow"
            );
            let earlier = bubble_of_node[node as usize].replace(j);
            assert!(earlier.is_none(), "bubble {node} is there twice");
        }
        let (n_c, n_r, n_b) = (candidates.len(), rows.len(), bubbles.len());
        let mut coarse = zeros(9 * n_r * n_c)?;
        let mut coupling = zeros(9 * n_r * n_b)?;
        let mut sigma = zeros(9 * n_b * n_b)?;

        progress.advance("constrain the stiffness", 0, 1);
        let follow = rows_of(constraints);
        let factor = FactoredStiffness::new(&reduce(stiffness, &follow)?, supports, progress)?;
        let in_free = |entries: &[(u32, f64)]| -> Vec<(u32, f64)> {
            let free = |&(dof, w): &(u32, f64)| Some((factor.free_of(dof as usize)? as u32, w));
            entries.iter().filter_map(free).collect()
        };
        let of_candidates = components(candidates, |dof| in_free(follow.row(dof)));
        let of_rows = components(rows, |dof| in_free(follow.row(dof)));
        let of_bubbles = components(bubbles, |dof| {
            if supports.is_fixed(dof) {
                return Vec::new();
            }
            let column = stiffness.column(dof);
            let spread =
                column.flat_map(|(i, k)| follow.row(i).iter().map(move |&(m, w)| (m, w * k)));
            sum_sorted(in_free(&spread.collect::<Vec<_>>()))
        });

        // G⁰: columns of C_1 Tᵀ, seen at the rows.
        let outputs = coarse.chunks_exact_mut((9 * n_r).max(1)).collect();
        let fill = |_: usize, x: [&[f64]; 3], block: &mut &mut [f64]| {
            for (s, block) in block.chunks_exact_mut(9).enumerate() {
                for c in 0..3 {
                    for r in 0..3 {
                        block[3 * c + r] = product(of_rows.row(3 * s + r), x[c]);
                    }
                }
            }
        };
        solve_panels(
            &factor,
            &of_candidates,
            outputs,
            fill,
            "coarse compliance",
            progress,
        )?;

        // R and Σ: columns of C_1 K_1j, seen at the rows and by the bubbles.
        let coupling_of = PerNode::new(&mut coupling, 9 * n_r, n_b);
        let sigma_of = sigma.chunks_exact_mut((9 * n_b).max(1));
        let outputs = coupling_of.zip(sigma_of).collect();
        let fill = |j: usize, x: [&[f64]; 3], (coupling, sigma): &mut (&mut [f64], &mut [f64])| {
            let node = bubbles[j];
            for (s, block) in coupling.chunks_exact_mut(9).enumerate() {
                for c in 0..3 {
                    let is_held = supports.is_fixed(3 * node as usize + c);
                    for r in 0..3 {
                        let unit = rows[s] == node && r == c && !is_held;
                        block[3 * c + r] =
                            f64::from(u8::from(unit)) - product(of_rows.row(3 * s + r), x[c]);
                    }
                }
            }
            for (c, column) in sigma.chunks_exact_mut(3 * n_b).enumerate() {
                let (dof, at) = (3 * node as usize + c, 3 * j + c);
                if supports.is_fixed(dof) {
                    column[at] = 1.0;
                    continue;
                }
                for (i, k) in stiffness.column(dof) {
                    if let (Some(b), false) = (bubble_of_node[i / 3], supports.is_fixed(i)) {
                        column[3 * b + i % 3] = k;
                    }
                }
                for (row, entry) in column.iter_mut().enumerate().take(at + 1) {
                    *entry -= product(of_bubbles.row(row), x[c]);
                }
            }
        };
        solve_panels(
            &factor,
            &of_bubbles,
            outputs,
            fill,
            "bubble stiffness",
            progress,
        )?;
        mirror(&mut sigma, 3 * n_b);
        Ok(Self {
            candidates: candidates.to_vec(),
            rows: rows.to_vec(),
            bubbles: bubbles.to_vec(),
            coarse,
            coupling,
            sigma,
        })
    }

    /// Memory of the three matrices.
    pub fn bytes(n_candidates: usize, n_rows: usize, n_bubbles: usize) -> f64 {
        let (c, r, b) = (n_candidates as f64, n_rows as f64, n_bubbles as f64);
        72.0 * (r * c + r * b + b * b)
    }

    /// G(F): displacement of the rows per force on candidates with these nodes free, in the layout of
    /// [`Compliance`]. Allocates; the slow, plain form of what a step does.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`].
    ///
    /// # Panics
    /// If a free node is not one of the bubbles (a programmer's mistake).
    pub fn compliance(&self, free_interface: &[u32]) -> Result<Compliance, Error> {
        let (n_c, n_r, n_b) = (self.candidates.len(), self.rows.len(), self.bubbles.len());
        let mut dofs = Vec::with_capacity(3 * free_interface.len());
        for node in free_interface {
            let j = self.bubbles.iter().position(|b| b == node);
            let Some(j) = j else {
                panic!("node {node} is not a bubble")
            };
            dofs.extend([3 * j, 3 * j + 1, 3 * j + 2]);
        }
        let sigma = Mat::from_fn(dofs.len(), dofs.len(), |i, j| {
            self.sigma[dofs[j] * 3 * n_b + dofs[i]]
        });
        // R_sFᵀ: one column for each component of a row; the candidates are the first.
        let coupling = Mat::from_fn(dofs.len(), 3 * n_r, |i, s| {
            let (bubble, c) = (dofs[i] / 3, dofs[i] % 3);
            self.coupling[9 * (bubble * n_r + s / 3) + 3 * c + s % 3]
        });
        let mut blocks = self.coarse.clone();
        if !dofs.is_empty() {
            let factor = sigma.llt(Side::Lower).map_err(|error| {
                let faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } =
                    error;
                Error::NotPositiveDefinite { pivot: index }
            })?;
            let of_candidates = factor.solve(coupling.subcols(0, 3 * n_c));
            let added = coupling.transpose() * of_candidates;
            for (at, entry) in blocks.iter_mut().enumerate() {
                let (block, inside) = (at / 9, at % 9);
                *entry += added[(
                    3 * (block % n_r) + inside % 3,
                    3 * (block / n_r) + inside / 3,
                )];
            }
        }
        Ok(Compliance {
            candidates: self.candidates.clone(),
            rows: self.rows.clone(),
            blocks,
        })
    }
}

fn zeros(len: usize) -> Result<Vec<f64>, Error> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(len)
        .map_err(|_| Error::TooLarge(format!("{} bytes of constrained compliance", 8 * len)))?;
    values.resize(len, 0.0);
    Ok(values)
}

/// A row for each component of each node.
fn components(nodes: &[u32], row: impl Fn(usize) -> Vec<(u32, f64)>) -> SparseRows {
    let mut rows = SparseRows::new();
    for &node in nodes {
        for c in 0..3 {
            rows.push(row(3 * node as usize + c));
        }
    }
    rows
}

/// Adds values of the same place, in the order in which they come.
fn sum_sorted(mut entries: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    entries.sort_by_key(|(place, _)| *place);
    entries
        .chunk_by(|a, b| a.0 == b.0)
        .map(|parts| (parts[0].0, parts.iter().map(|(_, v)| v).sum()))
        .collect()
}

fn product(row: &[(u32, f64)], x: &[f64]) -> f64 {
    row.iter().map(|&(k, w)| w * x[k as usize]).sum()
}

/// Slices of `len` for each of `n` nodes, empty ones too.
struct PerNode<'a> {
    rest: &'a mut [f64],
    len: usize,
    left: usize,
}

impl<'a> PerNode<'a> {
    fn new(values: &'a mut [f64], len: usize, n: usize) -> Self {
        Self {
            rest: values,
            len,
            left: n,
        }
    }
}

impl<'a> Iterator for PerNode<'a> {
    type Item = &'a mut [f64];

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        let (first, rest) = std::mem::take(&mut self.rest).split_at_mut(self.len);
        self.rest = rest;
        Some(first)
    }
}

/// Solves for the three right-hand sides of each node and hands the solutions to `fill` with the
/// node's place in the list and its output.
fn solve_panels<O: Send>(
    factor: &FactoredStiffness,
    right_hand_sides: &SparseRows,
    mut outputs: Vec<O>,
    fill: impl Fn(usize, [&[f64]; 3], &mut O) + Sync,
    stage: &str,
    progress: &dyn Progress,
) -> Result<(), Error> {
    let (n, total) = (factor.n_free(), outputs.len());
    let done = AtomicUsize::new(0);
    outputs
        .par_chunks_mut(PANEL)
        .enumerate()
        .try_for_each(|(panel_idx, outputs)| {
            if progress.is_cancelled() {
                return Err(Error::Cancelled);
            }
            let first = PANEL * panel_idx;
            let width = 3 * outputs.len();
            let mut panel = vec![0.0; n * width];
            for column in 0..width {
                for &(k, w) in right_hand_sides.row(3 * first + column) {
                    panel[column * n + k as usize] = w;
                }
            }
            let mut memory = factor.solve_memory(width);
            factor.solve_in_place(
                MatMut::from_column_major_slice_mut(&mut panel, n, width),
                &mut memory,
            );
            for (i, output) in outputs.iter_mut().enumerate() {
                let x = std::array::from_fn(|c| &panel[(3 * i + c) * n..][..n]);
                fill(first + i, x, output);
            }
            let now = done.fetch_add(outputs.len(), Ordering::Relaxed) + outputs.len();
            progress.advance(stage, now, total);
            Ok(())
        })
}

/// Copies the upper triangle of a column-major matrix to the lower one.
fn mirror(matrix: &mut [f64], n: usize) {
    for column in 0..n {
        for row in 0..column {
            matrix[row * n + column] = matrix[column * n + row];
        }
    }
}

//! Stiffness of a part whose interface nodes follow their principal nodes.
//!
//! ```text
//! u = T û       K̂ = Tᵀ K T       Ĉ = T K̂⁻¹ Tᵀ
//! ```
//!
//! û are the degrees of freedom that do not follow. The part is stiffer than the full one always:
//! C - Ĉ is positive semi-definite, and a force drops in a step when a node is freed.
//! [`ConstrainedStiffness`] assembles and factors K̂ for one set of free nodes.

use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use rayon::prelude::*;

use crate::Error;
use crate::assembly::Stiffness;
use crate::factor::FactoredStiffness;
use crate::hierarchy::Constraints;
use crate::progress::Progress;
use crate::supports::Supports;

/// K̂ = Tᵀ K T, factored.
#[derive(Debug)]
pub struct ConstrainedStiffness {
    constraints: Constraints,
    rows: SparseRows,
    factor: FactoredStiffness,
}

impl ConstrainedStiffness {
    /// Assembles K̂ and factors it. The constraints are to be made with the same supports.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`], [`Error::TooLarge`], [`Error::Cancelled`].
    ///
    /// # Panics
    /// If stiffness and constraints are of different meshes (a programmer's mistake).
    pub fn new(
        stiffness: &Stiffness,
        supports: &Supports,
        constraints: &Constraints,
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        assert_eq!(
            stiffness.n_dofs(),
            constraints.n_dofs(),
            "stiffness and constraints of one mesh"
        );
        progress.advance("constrain the stiffness", 0, 1);
        let rows = rows_of(constraints);
        let reduced = reduce(stiffness, &rows)?;
        if progress.is_cancelled() {
            return Err(Error::Cancelled);
        }
        let factor = FactoredStiffness::new(&reduced, supports, progress)?;
        Ok(Self {
            constraints: constraints.clone(),
            rows,
            factor,
        })
    }

    /// Number of degrees of freedom that neither follow nor are held.
    pub fn n_free(&self) -> usize {
        self.factor.n_free()
    }

    /// Ĉ f: displacement of all degrees of freedom under forces on all of them (ignored where
    /// held; on a node that follows they act on the nodes it follows), m and N.
    pub fn solve(&self, force: &[f64]) -> Vec<f64> {
        let mut u = self.factor.solve(&self.gather(force));
        self.constraints.apply(&mut u);
        u
    }

    /// As [`Self::solve`] for several forces, one after the other in `forces`, in parallel.
    pub fn solve_many(&self, forces: &[f64]) -> Vec<f64> {
        let n = self.constraints.n_dofs().max(1);
        let gathered: Vec<f64> = forces
            .chunks_exact(n)
            .flat_map(|f| self.gather(f))
            .collect();
        let mut u = self.factor.solve_many(&gathered);
        for u in u.chunks_exact_mut(n) {
            self.constraints.apply(u);
        }
        u
    }

    /// Tᵀ f.
    fn gather(&self, force: &[f64]) -> Vec<f64> {
        let mut gathered = vec![0.0; force.len()];
        for (dof, f) in force.iter().enumerate() {
            for &(k, w) in self.rows.row(dof) {
                gathered[k as usize] += w * f;
            }
        }
        gathered
    }
}

/// Rows of a sparse matrix: column and value.
#[derive(Clone, Debug)]
struct SparseRows {
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl SparseRows {
    fn new() -> Self {
        Self {
            starts: vec![0],
            entries: Vec::new(),
        }
    }

    fn push(&mut self, row: impl IntoIterator<Item = (u32, f64)>) {
        self.entries.extend(row);
        self.starts.push(self.entries.len());
    }

    fn row(&self, i: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[i]..self.starts[i + 1]]
    }

    fn n_rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns become rows, of which there are `n`.
    fn transposed(&self, n: usize) -> Self {
        let mut starts = vec![0; n + 1];
        for &(k, _) in &self.entries {
            starts[k as usize + 1] += 1;
        }
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0.0); self.entries.len()];
        for i in 0..self.n_rows() {
            for &(k, w) in self.row(i) {
                entries[next[k as usize]] = (i as u32, w);
                next[k as usize] += 1;
            }
        }
        Self { starts, entries }
    }
}

/// T by rows: a degree of freedom that does not follow, or is held, is itself.
fn rows_of(constraints: &Constraints) -> SparseRows {
    let mut rows = SparseRows::new();
    for node in 0..constraints.n_dofs() / 3 {
        let constraint = constraints.of_node(node as u32);
        for c in 0..3 {
            match constraint {
                Some(constraint) if !constraint.held[c] => rows.push(
                    constraint
                        .weights
                        .iter()
                        .map(|&(k, w)| (3 * k + c as u32, w)),
                ),
                _ => rows.push([(3 * node as u32 + c as u32, 1.0)]),
            }
        }
    }
    rows
}

/// Tᵀ K T, of the size of K; the columns of degrees of freedom that follow are empty, as those of
/// nodes of no element.
fn reduce(stiffness: &Stiffness, rows: &SparseRows) -> Result<Stiffness, Error> {
    let n = stiffness.n_dofs();
    let followers = rows.transposed(n);
    // Column by column, each summed in the same order whatever the number of threads.
    let columns: Vec<Vec<(u32, f64)>> = (0..n)
        .into_par_iter()
        .map_init(
            || (vec![0.0; n], vec![false; n]),
            |(sum, is_in), column| {
                let mut found: Vec<u32> = Vec::new();
                for &(j, w_j) in followers.row(column) {
                    for (i, k) in stiffness.column(j as usize) {
                        for &(row, w_i) in rows.row(i) {
                            if !is_in[row as usize] {
                                is_in[row as usize] = true;
                                found.push(row);
                            }
                            sum[row as usize] += w_i * k * w_j;
                        }
                    }
                }
                found.sort_unstable();
                let take = |row: u32| {
                    is_in[row as usize] = false;
                    (row, std::mem::take(&mut sum[row as usize]))
                };
                found.into_iter().map(take).collect()
            },
        )
        .collect();
    let n_entries: usize = columns.iter().map(Vec::len).sum();
    if n_entries > u32::MAX as usize {
        return Err(Error::TooLarge(format!(
            "{n_entries} entries of the constrained stiffness"
        )));
    }
    let mut starts = vec![0u32];
    let (mut row_idx, mut values) = (Vec::with_capacity(n_entries), Vec::with_capacity(n_entries));
    for column in columns {
        for (row, value) in column {
            row_idx.push(row);
            values.push(value);
        }
        starts.push(row_idx.len() as u32);
    }
    let symbolic = SymbolicSparseColMat::new_checked(n, n, starts, None, row_idx);
    Ok(Stiffness {
        matrix: SparseColMat::new(symbolic, values),
    })
}

//! L D Lᵀ of the active rows of a symmetric M, grown row by row.

use super::pivoting::{Factor, Singular};
use super::{Problem, dense};

/// `M_FF + E = L D Lᵀ` with E = 1e-12 diag(M), rows in the order in which they became active.
///
/// Growing row by row keeps the leading part when rows at the end change. No square roots: rows and columns
/// scaled by powers of two give the same bits.
pub(super) struct Ldl<'a> {
    /// Column-major, leading dimension m: L below the diagonal, D on it; then m of work.
    memory: &'a mut [f64],
    ld: usize,
    n: usize,
}

impl<'a> Ldl<'a> {
    pub(super) fn new(memory: &'a mut [f64]) -> Self {
        Self {
            memory,
            ld: 0,
            n: 0,
        }
    }

    fn push(&mut self, problem: &Problem, rows: &[u32]) -> Result<(), Singular> {
        /// Of M_ii: a pivot below minus this is no round-off, so M is indefinite.
        const INDEFINITE: f64 = 1e-8;
        let (ld, n) = (self.ld, self.n);
        let (factor, work) = self.memory.split_at_mut(ld * ld);
        let row = rows[n] as usize;
        let column = problem.column(row);
        for (work, &other) in work.iter_mut().zip(&rows[..n]) {
            *work = column[other as usize];
        }
        // The new row of L D, then of L, and what remains on the diagonal.
        dense::solve_unit_lower(factor, ld, n, work);
        let diagonal = column[row];
        let mut removed = 0.0;
        for (p, &x) in work[..n].iter().enumerate() {
            let l = x / factor[p * ld + p];
            factor[p * ld + n] = l;
            removed += l * x;
        }
        let regularisation = Self::REGULARISATION * diagonal;
        let pivot = (diagonal - removed) + regularisation;
        if pivot.is_nan() || pivot <= -INDEFINITE * diagonal {
            return Err(Singular);
        }
        // A row that depends on the others leaves round-off of either sign.
        factor[n * ld + n] = pivot.max(regularisation);
        self.n += 1;
        Ok(())
    }
}

impl Factor for Ldl<'_> {
    /// 1e-12: a thousand times the round-off of a factorisation of a few hundred rows, so that rank-deficient
    /// active sets stay solvable; small enough that one proximal step removes it up to condition 1e8.
    const REGULARISATION: f64 = 1e-12;

    fn update(&mut self, problem: &Problem, rows: &[u32], keep: usize) -> Result<(), Singular> {
        self.n = if self.ld == problem.m() {
            self.n.min(keep)
        } else {
            0
        };
        self.ld = problem.m();
        while self.n < rows.len() {
            self.push(problem, rows)?;
        }
        Ok(())
    }

    fn solve(&mut self, x: &mut [f64]) {
        let (ld, n) = (self.ld, self.n);
        dense::solve_unit_lower(self.memory, ld, n, x);
        for p in (0..n).rev() {
            let column = &self.memory[p * ld..p * ld + n];
            x[p] = x[p] / column[p] - dense::dot(&column[p + 1..], &x[p + 1..n]);
        }
    }
}

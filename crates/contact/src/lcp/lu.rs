//! L U of the active rows of an unsymmetric M, with row exchanges.

use super::pivoting::{Factor, Singular};
use super::{Problem, dense};

/// `P M_FF = L U`, made anew for each active set.
pub(super) struct Lu<'a> {
    /// Column-major n x n: L below, U on and above the diagonal; then n row numbers, n of work.
    memory: &'a mut [f64],
    n: usize,
}

impl<'a> Lu<'a> {
    pub(super) fn new(memory: &'a mut [f64]) -> Self {
        Self { memory, n: 0 }
    }
}

impl Factor for Lu<'_> {
    const REGULARISATION: f64 = 0.0;

    fn update(&mut self, problem: &Problem, rows: &[u32], _keep: usize) -> Result<(), Singular> {
        let n = rows.len();
        self.n = n;
        let (factor, exchanges) = self.memory.split_at_mut(n * n);
        if n == 0 {
            return Ok(());
        }
        for (target, &j) in factor.chunks_exact_mut(n).zip(rows) {
            let column = problem.column(j as usize);
            for (target, &i) in target.iter_mut().zip(rows) {
                *target = column[i as usize];
            }
        }
        for k in 0..n {
            let (left, right) = factor.split_at_mut((k + 1) * n);
            let column = &mut left[k * n..];
            let mut pivot = k;
            for i in k + 1..n {
                if column[i].abs() > column[pivot].abs() {
                    pivot = i;
                }
            }
            // An exact zero only: the certificate judges what a small pivot does.
            if column[pivot] == 0.0 || !column[pivot].is_finite() {
                return Err(Singular);
            }
            exchanges[k] = pivot as f64;
            column.swap(k, pivot);
            let pivot_value = column[k];
            for l in &mut column[k + 1..] {
                *l /= pivot_value;
            }
            for other in right.chunks_exact_mut(n) {
                other.swap(k, pivot);
                let u = other[k];
                dense::add_scaled(&mut other[k + 1..], -u, &column[k + 1..]);
            }
            for earlier in 0..k {
                left.swap(earlier * n + k, earlier * n + pivot);
            }
        }
        Ok(())
    }

    fn solve(&mut self, x: &mut [f64]) {
        let n = self.n;
        let (factor, exchanges) = self.memory.split_at(n * n);
        for (k, &pivot) in exchanges[..n].iter().enumerate() {
            x.swap(k, pivot as usize);
        }
        dense::solve_unit_lower(factor, n, n, x);
        for k in (0..n).rev() {
            let column = &factor[k * n..k * n + n];
            x[k] /= column[k];
            let x_k = x[k];
            dense::add_scaled(&mut x[..k], -x_k, &column[..k]);
        }
    }
}

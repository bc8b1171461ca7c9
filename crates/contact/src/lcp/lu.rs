//! L U of the active rows of an unsymmetric M, with row exchanges.

use super::pivoting::{Factor, Singular};
use super::{Problem, Scalar, dense};

/// `P M_FF = L U`, made anew for each active set.
pub(super) struct Lu<'a, T> {
    /// Column-major n x n: L below, U on and above the diagonal; then n row numbers.
    memory: &'a mut [T],
    rows: &'a mut Vec<u32>,
}

impl<'a, T: Scalar> Lu<'a, T> {
    /// `rows`: room for all rows of the problem.
    pub(super) fn new(memory: &'a mut [T], rows: &'a mut Vec<u32>) -> Self {
        rows.clear();
        Self { memory, rows }
    }
}

impl<T: Scalar> Factor<T> for Lu<'_, T> {
    fn regularisation(&self) -> f64 {
        0.0
    }

    fn rows(&self) -> &[u32] {
        self.rows
    }

    fn update(&mut self, problem: &Problem<T>, is_active: &[bool]) -> Result<(), Singular> {
        self.rows.clear();
        let active = is_active.iter().enumerate().filter(|(_, is)| **is);
        self.rows.extend(active.map(|(row, _)| row as u32));
        let n = self.rows.len();
        let (factor, exchanges) = self.memory.split_at_mut(n * n);
        if n == 0 {
            return Ok(());
        }
        for (target, &j) in factor.chunks_exact_mut(n).zip(&*self.rows) {
            let column = problem.column(j as usize);
            for (target, &i) in target.iter_mut().zip(&*self.rows) {
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
            if column[pivot] == T::zero() || !column[pivot].is_finite() {
                return Err(Singular);
            }
            exchanges[k] = T::of(pivot as f64);
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

    fn solve(&mut self, x: &mut [T]) {
        let n = self.rows.len();
        let (factor, exchanges) = self.memory.split_at(n * n);
        for (k, pivot) in exchanges[..n].iter().enumerate() {
            x.swap(k, pivot.wide() as usize);
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

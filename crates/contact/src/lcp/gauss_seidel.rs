//! Projected Gauss-Seidel: the slow method that always has an answer to show.

use super::{Problem, Settings, certificate, dense};

/// Sweeps over the rows, each to its own solution, from z ≥ 0 and w = q + M z; both are kept up to date.
///
/// Converges for symmetric positive semi-definite M with a solution. Rows without a positive diagonal are left.
/// Returns the number of sweeps.
pub(super) fn sweep(problem: &Problem, settings: &Settings, z: &mut [f64], w: &mut [f64]) -> usize {
    /// A certificate costs little beside this many sweeps.
    const SWEEPS_PER_CHECK: usize = 10;
    for n_sweeps in 0..settings.max_sweeps {
        if n_sweeps % SWEEPS_PER_CHECK == 0 {
            // Gaps from scratch: the updates below gather round-off.
            dense::gaps_into(problem, z, w);
            let residual = certificate::of(problem, z, w).natural_residual;
            if residual <= settings.tolerance || settings.is_over() {
                return n_sweeps;
            }
        }
        for row in 0..problem.m() {
            let diagonal = problem.diagonal(row);
            if diagonal > 0.0 {
                let target = (z[row] - w[row] / diagonal).max(0.0);
                let change = target - z[row];
                if change != 0.0 {
                    z[row] = target;
                    dense::add_scaled(w, change, problem.column(row));
                }
            }
        }
    }
    dense::gaps_into(problem, z, w);
    settings.max_sweeps
}

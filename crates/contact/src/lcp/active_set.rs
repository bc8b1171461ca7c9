//! Single pivots on a symmetric matrix: the active-set method of non-negative least squares.
//!
//! Minimises ½ zᵀ M z + qᵀ z over z ≥ 0. Each step adds the row that overlaps most and walks
//! towards the solution of the active rows, dropping rows whose force would change sign on the way.
//! The energy falls with every step, so no active set comes back: it cannot cycle. A step appends one row to the
//! factor or takes one out, O(m²) operations.
//!
//! Source: Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23.

use super::dense;
use super::ldl::Ldl;
use super::pivoting::{End, Outcome, Work};

/// Runs until no row is wrong. `held`: scratch of m. Leaves z ≥ 0.
pub(super) fn solve(
    work: &mut Work,
    factor: &mut Ldl,
    held: &mut [f64],
    max_pivots: usize,
) -> Outcome {
    let m = work.problem.m();
    let mut outcome = Outcome {
        end: End::Complementary,
        rounds: 0,
        pivots: 0,
    };
    let mut refused = None;
    held.fill(0.0);
    work.basis.start_empty(m);
    work.z.fill(0.0);
    work.w.copy_from_slice(work.problem.q());
    if factor.update(work.problem, work.basis.flags()).is_err() {
        outcome.end = End::Singular;
        return outcome;
    }
    loop {
        let Some(entering) = most_overlapping_row(work, factor, refused) else {
            return outcome;
        };
        work.basis.exchange(entering);
        outcome.pivots += 1;
        let mut is_first = true;
        // Each turn of this loop drops a row, the last one none.
        loop {
            if outcome.pivots >= max_pivots || work.settings.is_over() {
                outcome.end = End::Budget;
                work.z.copy_from_slice(held);
                return outcome;
            }
            if work.solve_active(factor).is_err() {
                outcome.end = End::Singular;
                return outcome;
            }
            // A new force that pulls contradicts its overlap: the overlap was round-off.
            if is_first && work.z[entering] <= 0.0 {
                work.basis.exchange(entering);
                work.z.copy_from_slice(held);
                dense::gaps_into(work.problem, work.z, work.w);
                refused = Some(entering);
                break;
            }
            is_first = false;
            let Some((leaving, step)) = first_to_leave(work, factor, held) else {
                held.copy_from_slice(work.z);
                refused = None;
                break;
            };
            for (held, &z) in held.iter_mut().zip(work.z.iter()) {
                *held += step * (z - *held);
            }
            held[leaving] = 0.0;
            for (row, held) in held.iter_mut().enumerate() {
                if work.basis.is_active(row) && *held <= 0.0 {
                    *held = 0.0;
                    work.basis.exchange(row);
                    outcome.pivots += 1;
                }
            }
        }
    }
}

fn most_overlapping_row(work: &Work, factor: &Ldl, refused: Option<usize>) -> Option<usize> {
    let mut limits = work.limits();
    work.forces_limit(&mut limits, factor);
    let mut most = (0.0, None);
    for row in 0..work.problem.m() {
        if !work.basis.is_active(row) && work.may_be_active(row) && refused != Some(row) {
            let excess = work.excess(&limits, row);
            if excess > most.0 {
                most = (excess, Some(row));
            }
        }
    }
    most.1
}

/// The active row whose force reaches zero first on the way from `held` to z, and the part of the way.
fn first_to_leave(work: &Work, factor: &Ldl, held: &[f64]) -> Option<(usize, f64)> {
    let mut first: Option<(usize, f64)> = None;
    for &row in factor.rows() {
        let row = row as usize;
        if work.z[row] <= 0.0 {
            let way = (held[row] - work.z[row]).max(f64::MIN_POSITIVE);
            let step = held[row] / way;
            if first.is_none_or(|(_, least)| step < least) {
                first = Some((row, step));
            }
        }
    }
    first
}

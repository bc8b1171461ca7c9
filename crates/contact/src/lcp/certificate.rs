//! How well z fits M and q, computed from these three alone.

use super::{Problem, dense};
use crate::error::Error;

/// A natural residual that needs no further step: a few hundred roundings.
pub(crate) const GOAL: f64 = 5e-14;

/// How well an answer fits the problem as given. All four numbers are 0 or round-off for a solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Certificate {
    /// `max_i |min(z_i / max|z|, w_i / max|q|)|`, no unit: one number for all conditions.
    pub natural_residual: f64,
    /// Smallest z, N; below 0 a contact pulls.
    pub min_z: f64,
    /// Smallest w, m; below 0 the bodies overlap.
    pub min_w: f64,
    /// `max_i |w_i z_i| / (max|q| max|z|)`, no unit.
    pub complementarity: f64,
}

/// The certificate of forces `z` for `w = q + M z`, made from nothing but the data: for checking any solver.
///
/// # Errors
/// [`Error::Length`] if z does not have m entries.
pub fn check(problem: &Problem, z: &[f64]) -> Result<Certificate, Error> {
    if z.len() != problem.m() {
        return Err(Error::Length {
            what: "z",
            expected: problem.m(),
            actual: z.len(),
        });
    }
    let mut judge = Judge::new(problem, z);
    for (i, z_i) in z.iter().enumerate() {
        let products = z.iter().enumerate();
        let products = products.map(|(j, z)| problem.column(j)[i] * z);
        judge.row(*z_i, problem.q()[i] + products.sum::<f64>());
    }
    Ok(judge.certificate)
}

/// As [`check`] where w = q + M z is already there.
pub(super) fn of(problem: &Problem, z: &[f64], w: &[f64]) -> Certificate {
    let mut judge = Judge::new(problem, z);
    for (z, w) in z.iter().zip(w) {
        judge.row(*z, *w);
    }
    judge.certificate
}

struct Judge {
    per_z: f64,
    per_q: f64,
    certificate: Certificate,
}

impl Judge {
    fn new(problem: &Problem, z: &[f64]) -> Self {
        // Where all is zero the ratio is zero as well, so any positive size serves.
        let per_size = |values: &[f64]| {
            let max = dense::max_abs(values);
            if max > 0.0 {
                1.0 / max.max(f64::MIN_POSITIVE)
            } else {
                1.0
            }
        };
        let start = if problem.m() == 0 { 0.0 } else { f64::INFINITY };
        Self {
            per_z: per_size(z),
            per_q: per_size(problem.q()),
            certificate: Certificate {
                min_z: start,
                min_w: start,
                ..Certificate::default()
            },
        }
    }

    fn row(&mut self, z: f64, w: f64) {
        let c = &mut self.certificate;
        let (z_scaled, w_scaled) = (z * self.per_z, w * self.per_q);
        // A NaN must not look like a solution.
        let residual = if (z + w).is_nan() {
            f64::INFINITY
        } else {
            z_scaled.min(w_scaled).abs()
        };
        c.natural_residual = c.natural_residual.max(residual);
        c.min_z = c.min_z.min(z);
        c.min_w = c.min_w.min(w);
        c.complementarity = c.complementarity.max((z_scaled * w_scaled).abs());
    }
}

/// Of the sum of absolute terms in a proof that there is no solution: a thousand times above the regularisation,
/// which bends y.
const PROOF: f64 = 1e-9;

/// Forces beyond this times those that close the largest gap alone are none: M is known to less.
const LARGEST_FORCES: f64 = 1e6;

/// Whether y proves that no z ≥ 0 gives w ≥ 0: y ≥ 0, Mᵀ y ≤ 0, qᵀ y < 0. Source: Farkas' lemma.
///
/// Signs are judged to [`PROOF`] of the sum of absolute terms. What is left of Mᵀ y above zero lets forces of a sum of
/// -qᵀ y / max (Mᵀ y) do it; only where they are beyond [`LARGEST_FORCES`] is it a proof.
pub(super) fn proves_no_solution(problem: &Problem, y: &[f64]) -> bool {
    let weigh = |values: &[f64]| {
        values
            .iter()
            .zip(y)
            .fold((0.0, 0.0), |(sum, size): (f64, f64), (v, y)| {
                let term = v * y;
                (sum + term, size + term.abs())
            })
    };
    let (sum, size) = weigh(problem.q());
    if !sum.is_finite() || sum >= -PROOF * size || y.iter().any(|&y| y < 0.0) {
        return false;
    }
    let mut left = 0.0_f64;
    let is_proof = (0..problem.m()).all(|j| {
        let (sum, size) = weigh(problem.column(j));
        left = left.max(sum);
        sum <= PROOF * size
    });
    let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
    let gap = largest(&mut problem.q().iter().copied());
    let compliance = largest(&mut (0..problem.m()).map(|j| problem.diagonal(j)));
    // Also where no row gives way by itself.
    is_proof && -sum * compliance >= LARGEST_FORCES * gap * left
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop")]
    use super::*;

    #[test]
    fn certificate_of_wrong_answers_says_what_is_wrong() {
        // M = I, q = (-1, 2): z = (1, 0), w = (0, 2).
        let problem = Problem::new(&[1.0, 0.0, 0.0, 1.0], &[-1.0, 2.0]).unwrap();
        let right = check(&problem, &[1.0, 0.0]).unwrap();
        assert_eq!(right.natural_residual, 0.0);
        assert_eq!((right.min_z, right.min_w), (0.0, 0.0));
        let overlap = check(&problem, &[0.5, 0.0]).unwrap();
        assert_eq!(overlap.natural_residual, 0.25);
        assert_eq!(overlap.min_w, -0.5);
        let pull = check(&problem, &[1.0, -0.5]).unwrap();
        assert_eq!(pull.min_z, -0.5);
        assert_eq!(pull.natural_residual, 0.5);
        let both = check(&problem, &[3.0, 0.0]).unwrap();
        assert_eq!(both.natural_residual, 1.0);
        assert!(both.complementarity > 0.5);
        let nan = check(&problem, &[f64::NAN, 0.0]).unwrap();
        assert_eq!(nan.natural_residual, f64::INFINITY);
    }

    #[test]
    fn farkas_vector_is_accepted_only_if_it_proves() {
        let m = [1.0, -1.0, -1.0, 1.0];
        let infeasible = Problem::new(&m, &[-1.0, -1.0]).unwrap();
        assert!(proves_no_solution(&infeasible, &[1.0, 1.0]));
        assert!(!proves_no_solution(&infeasible, &[1.0, 0.5]));
        assert!(!proves_no_solution(&infeasible, &[-1.0, -1.0]));
        assert!(!proves_no_solution(&infeasible, &[0.0, 0.0]));
        let feasible = Problem::new(&m, &[-1.0, 1.0]).unwrap();
        assert!(!proves_no_solution(&feasible, &[1.0, 1.0]));
    }
}

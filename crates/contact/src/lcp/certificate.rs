//! How well z fits M and q, computed from these three alone.

use super::{Problem, dense};
use crate::error::Error;

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
    for i in 0..problem.m() {
        let products = (0..problem.m()).map(|j| problem.column(j)[i] * z[j]);
        judge.row(z[i], problem.q()[i] + products.sum::<f64>());
    }
    Ok(judge.certificate)
}

/// As [`check`] where w = q + M z is already there.
pub(super) fn of(problem: &Problem, z: &[f64], w: &[f64]) -> Certificate {
    let mut judge = Judge::new(problem, z);
    for (&z, &w) in z.iter().zip(w) {
        judge.row(z, w);
    }
    judge.certificate
}

struct Judge {
    z_size: f64,
    q_size: f64,
    certificate: Certificate,
}

impl Judge {
    fn new(problem: &Problem, z: &[f64]) -> Self {
        // Where all is zero the ratio is zero as well, so any positive size serves.
        let size = |values: &[f64]| {
            let max = dense::max_abs(values);
            if max > 0.0 { max } else { 1.0 }
        };
        let start = if problem.m() == 0 { 0.0 } else { f64::INFINITY };
        Self {
            z_size: size(z),
            q_size: size(problem.q()),
            certificate: Certificate {
                min_z: start,
                min_w: start,
                ..Certificate::default()
            },
        }
    }

    fn row(&mut self, z: f64, w: f64) {
        let c = &mut self.certificate;
        let (z_scaled, w_scaled) = (z / self.z_size, w / self.q_size);
        let residual = z_scaled.min(w_scaled).abs();
        // A NaN must not look like a solution.
        if residual > c.natural_residual || residual.is_nan() || (z + w).is_nan() {
            c.natural_residual = if (z + w).is_nan() {
                f64::INFINITY
            } else {
                residual
            };
        }
        c.min_z = c.min_z.min(z);
        c.min_w = c.min_w.min(w);
        c.complementarity = c.complementarity.max((z_scaled * w_scaled).abs());
    }
}

/// Whether y proves that no z ≥ 0 gives w ≥ 0: y ≥ 0, Mᵀ y ≤ 0, qᵀ y < 0. Source: Farkas' lemma.
pub(super) fn proves_no_solution(problem: &Problem, y: &[f64]) -> bool {
    /// Of the sum of absolute terms: a thousand times above the regularisation of 1e-12, which bends y.
    const TOLERANCE: f64 = 1e-9;
    let weigh = |values: &[f64]| {
        values
            .iter()
            .zip(y)
            .fold((0.0, 0.0), |(sum, size): (f64, f64), (&v, &y)| {
                (sum + v * y, size + (v * y).abs())
            })
    };
    let (sum, size) = weigh(problem.q());
    if !sum.is_finite() || sum >= -TOLERANCE * size || y.iter().any(|&y| y < 0.0) {
        return false;
    }
    (0..problem.m()).all(|j| {
        let (sum, size) = weigh(problem.column(j));
        sum <= TOLERANCE * size
    })
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

//! How well forces fit the conditions of Signorini and Coulomb, from the data alone.

use super::{Problem, cone};
use crate::error::Error;

/// How well an answer fits the problem as given. For a solution all numbers but the gaps are 0 or round-off.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Certificate {
    /// Largest over the contacts of `|λ - P(λ - ũ)|`, forces by the largest force and ũ by the largest |q|, no unit:
    /// one number for all conditions. Without friction it is that of [`crate::lcp::Certificate`].
    pub natural_residual: f64,
    /// Smallest normal force, N; below 0 a contact pulls.
    pub min_normal_force: f64,
    /// Smallest gap, m; below 0 the bodies overlap.
    pub min_gap: f64,
    /// Largest |λ_t| - μ λ_n, N; above 0 a force is outside its cone.
    pub max_cone_excess: f64,
    /// Largest λ_tᵀ u_t, J; above 0 friction drives instead of braking.
    pub max_friction_work: f64,
}

/// The certificate of `forces`, made from nothing but the data: for checking any solver.
///
/// # Errors
/// [`Error::Length`] unless there are three forces per contact.
pub fn check(problem: &Problem, forces: &[f64]) -> Result<Certificate, Error> {
    problem.check_length("the forces", forces.len())?;
    let n_rows = problem.q().len();
    let mut judge = Judge::new(problem, forces);
    for contact in 0..problem.n_contacts() {
        let row = 3 * contact;
        let mut u = [0.0; 3];
        for (axis, u) in u.iter_mut().enumerate() {
            let products = (0..n_rows).map(|j| problem.column(j)[row + axis] * forces[j]);
            *u = problem.q()[row + axis] + products.sum::<f64>();
        }
        let force = [forces[row], forces[row + 1], forces[row + 2]];
        judge.contact(problem.friction_coefficients()[contact], force, u);
    }
    Ok(judge.certificate)
}

/// As [`check`] where u = q + W λ is already there.
pub(super) fn of(problem: &Problem, forces: &[f64], u: &[f64]) -> Certificate {
    let mut judge = Judge::new(problem, forces);
    let triples = forces.as_chunks::<3>().0.iter().zip(u.as_chunks::<3>().0);
    for ((force, u), mu) in triples.zip(problem.friction_coefficients()) {
        judge.contact(*mu, *force, *u);
    }
    judge.certificate
}

/// The natural residual alone, where u = q + W λ is already there.
pub(super) fn natural_residual(problem: &Problem, per_q: f64, forces: &[f64], u: &[f64]) -> f64 {
    let per = [per_size(forces), per_q];
    let triples = forces.as_chunks::<3>().0.iter().zip(u.as_chunks::<3>().0);
    let each = triples
        .zip(problem.friction_coefficients())
        .map(|((force, u), mu)| residual_of(per, *mu, force, u));
    each.fold(0.0, f64::max)
}

/// 1 / the largest size, 1 if all are 0.
pub(super) fn per_size(values: &[f64]) -> f64 {
    let max = max_abs(values);
    if max > 0.0 {
        1.0 / max.max(f64::MIN_POSITIVE)
    } else {
        1.0
    }
}

/// In lanes, so that it is vectorised.
pub(super) fn max_abs(values: &[f64]) -> f64 {
    let larger = |max: f64, x: f64| {
        let x = x.abs();
        if x > max { x } else { max }
    };
    let mut lanes = [0.0; 4];
    let (chunks, rest) = values.as_chunks::<4>();
    for chunk in chunks {
        for (lane, &x) in lanes.iter_mut().zip(chunk) {
            *lane = larger(*lane, x);
        }
    }
    lanes.iter().chain(rest).fold(0.0, |max, &x| larger(max, x))
}

/// |λ - P(λ - ũ)| of one contact; `per`: what forces and gaps are multiplied by first.
fn residual_of(per: [f64; 2], mu: f64, force: &[f64; 3], u: &[f64; 3]) -> f64 {
    let scaled = force.map(|f| f * per[0]);
    let mut raised = u.map(|u| u * per[1]);
    raised[0] += mu * cone::tangential(&raised);
    let trial = [0, 1, 2].map(|k| scaled[k] - raised[k]);
    let nearest = cone::project(&trial, mu);
    let distances = [0, 1, 2].map(|k| (scaled[k] - nearest[k]).abs());
    // A NaN must not look like a solution.
    if distances.iter().any(|d| d.is_nan()) {
        f64::INFINITY
    } else {
        distances.iter().fold(0.0, |max: f64, d| max.max(*d))
    }
}

struct Judge {
    per_force: f64,
    per_q: f64,
    certificate: Certificate,
}

impl Judge {
    fn new(problem: &Problem, forces: &[f64]) -> Self {
        let start = if problem.n_contacts() == 0 {
            0.0
        } else {
            f64::INFINITY
        };
        Self {
            per_force: per_size(forces),
            per_q: per_size(problem.q()),
            certificate: Certificate {
                min_normal_force: start,
                min_gap: start,
                max_cone_excess: -start,
                max_friction_work: -start,
                ..Certificate::default()
            },
        }
    }

    fn contact(&mut self, mu: f64, force: [f64; 3], u: [f64; 3]) {
        let residual = residual_of([self.per_force, self.per_q], mu, &force, &u);
        let c = &mut self.certificate;
        c.natural_residual = c.natural_residual.max(residual);
        c.min_normal_force = c.min_normal_force.min(force[0]);
        c.min_gap = c.min_gap.min(u[0]);
        c.max_cone_excess = c
            .max_cone_excess
            .max(cone::tangential(&force) - mu * force[0]);
        c.max_friction_work = c.max_friction_work.max(force[1] * u[1] + force[2] * u[2]);
    }
}

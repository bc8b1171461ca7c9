//! The order of things: frictionless answer, sweeps, Newton steps, the best of all.

use std::time::Instant;

use super::local::Local;
use super::{Certificate, Problem, Scratch, Settings, Solution, State, Status, certificate, cone};
use crate::error::Error;
use crate::lcp;

/// Sweeps between two tries of Newton's method. The first few find out who sticks.
const SWEEPS_PER_TRY: usize = 5;

pub(super) fn run(
    problem: &Problem,
    settings: &Settings,
    scratch: &mut Scratch,
    is_warm: bool,
    forces: &mut [f64],
    slip: &mut [f64],
) -> Result<Solution, Error> {
    let n = problem.n_contacts();
    if n > scratch.capacity {
        return Err(Error::Capacity {
            rows: n,
            capacity: scratch.capacity,
        });
    }
    problem.check_length("the forces", forces.len())?;
    problem.check_length("the slips", slip.len())?;
    if is_warm && let Some(index) = forces.iter().position(|x| !x.is_finite()) {
        return Err(Error::NotFinite {
            what: "force to start from",
            index,
        });
    }
    scratch.states.clear();
    scratch.states.resize(n, State::Open);
    scratch.directions.clear();
    scratch.directions.resize(n, [0.0; 2]);
    let mut run = Run {
        problem,
        settings,
        forces,
        u: slip,
        sweeps: 0,
        newton_steps: 0,
    };
    let has_friction = problem.friction_coefficients().iter().any(|mu| *mu > 0.0);
    if !is_warm || !has_friction {
        run.start_without_friction(scratch)?;
    } else {
        for (force, mu) in run
            .forces
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .zip(problem.friction_coefficients())
        {
            *force = cone::project(force, *mu);
        }
    }
    run.update_gaps();
    let certificate = if has_friction {
        run.solve(scratch)
    } else {
        run.find_states(scratch);
        certificate::of(problem, run.forces, run.u)
    };
    let status = if certificate.natural_residual <= settings.tolerance {
        Status::Solved
    } else {
        Status::Budget
    };
    Ok(Solution {
        status,
        certificate,
        sweeps: run.sweeps,
        newton_steps: run.newton_steps,
    })
}

struct Run<'a> {
    problem: &'a Problem<'a>,
    settings: &'a Settings,
    forces: &'a mut [f64],
    /// q + W λ.
    u: &'a mut [f64],
    sweeps: usize,
    newton_steps: usize,
}

impl Run<'_> {
    /// Normal forces from the complementarity problem of the normal rows, no tangential ones.
    fn start_without_friction(&mut self, scratch: &mut Scratch) -> Result<(), Error> {
        let problem = self.problem;
        let n = problem.n_contacts();
        let matrix = &mut scratch.normal_matrix[..n * n];
        for (j, target) in matrix.chunks_exact_mut(n.max(1)).enumerate() {
            let column = problem.column(3 * j);
            for (target, source) in target.iter_mut().zip(column.iter().step_by(3)) {
                *target = *source;
            }
        }
        let q = &mut scratch.normal_q[..n];
        for (target, source) in q.iter_mut().zip(problem.q().iter().step_by(3)) {
            *target = *source;
        }
        let z = &mut scratch.normal_force[..n];
        lcp::solve(
            &lcp::Problem::trusted_symmetric(matrix, q)?,
            &lcp::Settings {
                deadline: self.settings.deadline,
                ..lcp::Settings::default()
            },
            &mut scratch.lcp,
            lcp::Start::Cold,
            z,
            &mut scratch.normal_gap[..n],
        )?;
        self.forces.fill(0.0);
        for (force, z) in self.forces.iter_mut().step_by(3).zip(z) {
            *force = *z;
        }
        Ok(())
    }

    fn solve(&mut self, scratch: &mut Scratch) -> Certificate {
        let mut best = certificate::of(self.problem, self.forces, self.u);
        let n_rows = self.forces.len();
        scratch.best[..n_rows].copy_from_slice(self.forces);
        while self.sweeps < self.settings.max_sweeps
            && best.natural_residual > lcp::GOAL
            && !self.is_over()
        {
            for _ in 0..SWEEPS_PER_TRY.min(self.settings.max_sweeps - self.sweeps) {
                self.sweep(scratch);
            }
            // From scratch: the updates of the sweeps gather round-off.
            self.update_gaps();
            let swept = certificate::of(self.problem, self.forces, self.u);
            if swept.natural_residual < best.natural_residual {
                best = swept;
                scratch.best[..n_rows].copy_from_slice(self.forces);
            }
            scratch.swept[..n_rows].copy_from_slice(self.forces);
            let refined = self.newton(scratch, swept);
            if refined.natural_residual < best.natural_residual {
                best = refined;
                scratch.best[..n_rows].copy_from_slice(self.forces);
            } else if best.natural_residual <= self.settings.tolerance {
                // Good enough, and nothing makes it better.
                break;
            }
            if refined.natural_residual >= swept.natural_residual {
                self.forces.copy_from_slice(&scratch.swept[..n_rows]);
                self.update_gaps();
            }
        }
        self.forces.copy_from_slice(&scratch.best[..n_rows]);
        self.update_gaps();
        self.find_states(scratch);
        best
    }

    /// Every contact once, the others standing still.
    fn sweep(&mut self, scratch: &mut Scratch) {
        let problem = self.problem;
        for contact in 0..problem.n_contacts() {
            let first = 3 * contact;
            let columns = [0, 1, 2].map(|axis| problem.column(first + axis));
            let old = [0, 1, 2].map(|axis| self.forces[first + axis]);
            let w = [0, 1, 2].map(|row| [0, 1, 2].map(|axis: usize| columns[axis][first + row]));
            let b = [0, 1, 2].map(|row: usize| {
                self.u[first + row] - w[row][0] * old[0] - w[row][1] * old[1] - w[row][2] * old[2]
            });
            if w[0][0] <= 0.0 {
                // A point that no force moves never carries any.
                continue;
            }
            let local = Local {
                w,
                b,
                friction_coefficient: problem.friction_coefficients()[contact],
            };
            let answer = local.solve(scratch.directions[contact]);
            scratch.states[contact] = answer.state;
            scratch.directions[contact] = answer.direction;
            for axis in 0..3 {
                let change = answer.force[axis] - old[axis];
                if change != 0.0 {
                    self.forces[first + axis] = answer.force[axis];
                    for (u, &w) in self.u.iter_mut().zip(columns[axis]) {
                        *u += change * w;
                    }
                }
            }
        }
        self.sweeps += 1;
    }

    /// Newton steps from the forces as they are, whose certificate is `start`, while they gain. Leaves the last forces.
    fn newton(&mut self, scratch: &mut Scratch, start: Certificate) -> Certificate {
        /// A step may lose before it gains: the states change under it.
        const MAX_LOSSES: usize = 2;
        let mut last = start;
        let mut losses = 0;
        while self.newton_steps < self.settings.max_newton_steps
            && last.natural_residual > lcp::GOAL
            && losses <= MAX_LOSSES
            && !self.is_over()
        {
            self.newton_steps += 1;
            for (contact, state) in scratch.states.iter().enumerate() {
                if *state == State::Open {
                    self.forces[3 * contact..3 * contact + 3].fill(0.0);
                }
            }
            self.update_gaps();
            if !scratch
                .newton
                .step(self.problem, &scratch.states, self.u, self.forces)
            {
                break;
            }
            self.update_gaps();
            let next = certificate::of(self.problem, self.forces, self.u);
            if next.natural_residual >= last.natural_residual {
                losses += 1;
            }
            last = next;
            self.find_states(scratch);
        }
        last
    }

    /// What each contact does, from the projection of its forces.
    fn find_states(&self, scratch: &mut Scratch) {
        let problem = self.problem;
        for (contact, state) in scratch.states.iter_mut().enumerate() {
            let first = 3 * contact;
            let mu = problem.friction_coefficients()[contact];
            let diagonal = |axis: usize| problem.column(first + axis)[first + axis];
            let per = |compliance: f64| {
                if compliance > 0.0 {
                    1.0 / compliance
                } else {
                    0.0
                }
            };
            let along = per(0.5 * (diagonal(1) + diagonal(2)));
            let rho = [per(diagonal(0)), along, along];
            let trial = [0, 1, 2].map(|k| self.forces[first + k] - rho[k] * self.u[first + k]);
            *state = if trial[0] <= 0.0 {
                State::Open
            } else if cone::tangential(&trial) <= mu * trial[0] {
                State::Stick
            } else {
                State::Slip
            };
        }
    }

    fn update_gaps(&mut self) {
        lcp::gaps_into(self.problem.rows(), self.forces, self.u);
    }

    fn is_over(&self) -> bool {
        let deadline = self.settings.deadline;
        deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

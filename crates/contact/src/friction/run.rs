//! The order of things: frictionless answer, sweeps, Newton steps, the best of all.

use std::time::Instant;

use super::local::Local;
use super::{Problem, Scratch, Settings, Solution, Status, certificate, cone};
use crate::error::Error;
use crate::lcp;

/// Sweeps before Newton's method is tried again, and then as many again as there were.
const SWEEPS_BEFORE_TRY: usize = 10;

/// Natural residual at which no step more is taken, no unit: 1e-12 is promised, and the next step would cost more than it
/// gives. Newton's last step usually ends far below.
pub(super) const GOAL: f64 = 10.0 * lcp::GOAL;

/// Natural residual at which nothing slower than Newton's method is tried: round-off of large or uneven problems.
const ENOUGH: f64 = 1e-11;

/// Operations of all factorisations by pivoting at most: some tenths of a second, 200 for 80 contacts that stick.
const MOST_WORK: f64 = 1e9;

/// Newton steps in a row that may lose: the states change under them.
const MAX_LOSSES: usize = 4;

/// Steps with the factor of an earlier step, which cost a third, if so few reach the goal.
const MAX_KEPT: i32 = 3;

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
    let mut run = Run::new(problem, settings, forces, slip, MOST_WORK);
    run.reset(scratch);
    let has_friction = problem.friction_coefficients().iter().any(|mu| *mu > 0.0);
    if !is_warm || !has_friction {
        run.start_without_friction(scratch)?;
    } else {
        run.start_warm(scratch);
    }
    run.update_gaps();
    if has_friction {
        run.solve(scratch, is_warm)?;
    } else {
        scratch.contacts.find(problem, run.u, run.forces);
    }
    let certificate = certificate::of(problem, run.forces, run.u);
    let status = if certificate.natural_residual <= settings.tolerance {
        Status::Solved
    } else {
        Status::Budget
    };
    Ok(Solution {
        status,
        certificate,
        sweeps: run.sweeps,
        newton_steps: run.newton_steps + run.pivots,
    })
}

pub(super) struct Run<'a> {
    pub(super) problem: &'a Problem<'a>,
    settings: &'a Settings,
    pub(super) forces: &'a mut [f64],
    /// q + W λ.
    pub(super) u: &'a mut [f64],
    /// 1 / the largest |q|.
    pub(super) per_q: f64,
    sweeps: usize,
    newton_steps: usize,
    /// Factorisations besides.
    pub(super) pivots: usize,
    /// Their operations, and how many there may be.
    pub(super) work: f64,
    pub(super) most_work: f64,
}

impl<'a> Run<'a> {
    /// From `forces` as they are; `slip` is written.
    pub(super) fn new(
        problem: &'a Problem<'a>,
        settings: &'a Settings,
        forces: &'a mut [f64],
        slip: &'a mut [f64],
        most_work: f64,
    ) -> Self {
        Self {
            problem,
            settings,
            forces,
            u: slip,
            per_q: certificate::per_size(problem.q()),
            sweeps: 0,
            newton_steps: 0,
            pivots: 0,
            work: 0.0,
            most_work,
        }
    }
}

impl Run<'_> {
    /// All contacts open, and nothing known of the matrix.
    pub(super) fn reset(&self, scratch: &mut Scratch) {
        scratch.contacts.reset(self.problem, 1.0 / self.per_q);
        scratch.newton.is_regularised = false;
    }

    /// The given forces, inside their cones, and the states they tell.
    fn start_warm(&mut self, scratch: &mut Scratch) {
        let problem = self.problem;
        let triples = self.forces.as_chunks_mut::<3>().0;
        for (contact, (force, mu)) in triples
            .iter_mut()
            .zip(problem.friction_coefficients())
            .enumerate()
        {
            *force = if scratch.contacts.can_close(contact) {
                cone::project(force, *mu)
            } else {
                [0.0; 3]
            };
        }
        scratch.contacts.read(problem, self.forces);
    }

    /// Normal forces from the complementarity problem of the normal rows, no tangential ones.
    fn start_without_friction(&mut self, scratch: &mut Scratch) -> Result<(), Error> {
        self.forces.fill(0.0);
        self.u.copy_from_slice(self.problem.q());
        self.find_normal_forces(scratch)
    }

    /// The normal forces that close the gaps while the tangential ones stay, from `u` as it is; leaves `u` behind.
    /// Tangential forces that would be outside their cone then are cut down to it.
    fn find_normal_forces(&mut self, scratch: &mut Scratch) -> Result<(), Error> {
        let problem = self.problem;
        let n = problem.n_contacts();
        let matrix = &mut scratch.normal_matrix[..n * n];
        let q = &mut scratch.normal_q[..n];
        for (target, source) in q.iter_mut().zip(self.u.iter().step_by(3)) {
            *target = *source;
        }
        for (j, target) in matrix.chunks_exact_mut(n.max(1)).enumerate() {
            let column = problem.column(3 * j);
            let force = self.forces[3 * j];
            for ((target, source), q) in
                target.iter_mut().zip(column.iter().step_by(3)).zip(&mut *q)
            {
                *target = *source;
                *q -= force * source;
            }
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
        let triples = self.forces.as_chunks_mut::<3>().0.iter_mut();
        for ((force, z), mu) in triples.zip(z).zip(problem.friction_coefficients()) {
            force[0] = *z;
            let (drag, most) = (cone::tangential(force), mu * *z);
            if drag > most {
                *force = [*z, force[1] * most / drag, force[2] * most / drag];
            }
        }
        Ok(())
    }

    /// Newton's method first; where it does not end, sweeps and Newton's method in turns. Leaves the best forces.
    fn solve(&mut self, scratch: &mut Scratch, is_warm: bool) -> Result<(), Error> {
        let n_rows = self.forces.len();
        let mut best = Best::none();
        best.see(self, &mut scratch.best);
        scratch.start[..n_rows].copy_from_slice(self.forces);
        self.newton(scratch, &mut best);
        if is_warm && best.residual > GOAL && !self.is_over() {
            // Too far from the forces given: as if there were none.
            self.start_without_friction(scratch)?;
            self.update_gaps();
            scratch.start[..n_rows].copy_from_slice(self.forces);
            self.newton(scratch, &mut best);
        }
        if best.residual > ENOUGH && self.settings.max_newton_steps > 0 {
            self.forces.copy_from_slice(&scratch.start[..n_rows]);
            self.update_gaps();
            self.pivot(scratch, &mut best);
        }
        let mut next_try = SWEEPS_BEFORE_TRY;
        while self.sweeps < self.settings.max_sweeps && best.residual > ENOUGH && !self.is_over() {
            self.forces.copy_from_slice(&scratch.start[..n_rows]);
            self.update_gaps();
            while self.sweeps < next_try.min(self.settings.max_sweeps) {
                self.sweep(scratch);
            }
            next_try *= 2;
            // From scratch: the updates of the sweeps gather round-off.
            self.update_gaps();
            best.see(self, &mut scratch.best);
            scratch.start[..n_rows].copy_from_slice(self.forces);
            if self.settings.max_newton_steps > 0 {
                self.settle(scratch);
                self.newton_one_by_one(scratch, &mut best);
            }
            if self.settings.max_newton_steps > 0 && best.residual > ENOUGH && !self.is_over() {
                self.forces.copy_from_slice(&scratch.start[..n_rows]);
                self.update_gaps();
                self.pivot(scratch, &mut best);
            }
        }
        self.take(&best, scratch);
        Ok(())
    }

    /// Leaves the best forces.
    pub(super) fn take(&mut self, best: &Best, scratch: &mut Scratch) {
        if !best.is_current {
            let n_rows = self.forces.len();
            self.forces.copy_from_slice(&scratch.best[..n_rows]);
            self.update_gaps();
            scratch.contacts.find(self.problem, self.u, self.forces);
        }
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
            if !scratch.contacts.can_close(contact) {
                // A point that no force moves never carries any.
                continue;
            }
            let local = Local {
                w,
                b,
                friction_coefficient: problem.friction_coefficients()[contact],
            };
            let answer = local.solve(scratch.contacts.directions[contact]);
            scratch.contacts.states[contact] = answer.state;
            scratch.contacts.directions[contact] = answer.direction;
            self.forces[first..first + 3].copy_from_slice(&answer.force);
            self.add_columns(
                contact,
                [0, 1, 2].map(|axis| answer.force[axis] - old[axis]),
            );
        }
        self.sweeps += 1;
    }

    /// Newton steps from the forces as they are, while they gain.
    fn newton(&mut self, scratch: &mut Scratch, best: &mut Best) {
        self.settle(scratch);
        let mut last = best.see(self, &mut scratch.best);
        let mut losses = 0;
        let mut is_kept = false;
        while last > GOAL && losses <= MAX_LOSSES && !self.is_over() {
            if !is_kept {
                if self.newton_steps >= self.settings.max_newton_steps {
                    return;
                }
                self.newton_steps += 1;
                let contacts = &scratch.contacts;
                let newton = &mut scratch.newton;
                if !newton.factorise(self.problem, contacts, self.u, self.forces) {
                    return;
                }
            }
            if !scratch.newton.solve(&scratch.contacts, self.u) {
                return;
            }
            scratch.newton.add_to(self.forces);
            self.update_gaps();
            let is_new = self.settle(scratch);
            let lowest = best.residual;
            let next = best.see(self, &mut scratch.best);
            losses = if next < lowest { 0 } else { losses + 1 };
            // A step that squares the error by a factor r leaves a factor that gains about as much again.
            let gain = next / last;
            let expected = if is_kept { gain } else { 2.0 * gain };
            is_kept = !is_new && expected < 1.0 && next * expected.powi(MAX_KEPT) <= GOAL;
            last = next;
        }
    }

    /// States from the forces, forces as the states want them. True if a state changed.
    pub(super) fn settle(&mut self, scratch: &mut Scratch) -> bool {
        let contacts = &mut scratch.contacts;
        let is_new = contacts.settle(self.problem, self.u, self.forces);
        if 2 * contacts.moved().len() > contacts.states.len() {
            self.update_gaps();
        } else {
            for &(contact, change) in contacts.moved() {
                self.add_columns(contact as usize, change);
            }
        }
        is_new
    }

    /// u += W times a change of one contact's force.
    fn add_columns(&mut self, contact: usize, change: [f64; 3]) {
        if change == [0.0; 3] {
            return;
        }
        let columns = [0, 1, 2].map(|axis| self.problem.column(3 * contact + axis));
        let lines = columns[0].iter().zip(columns[1]).zip(columns[2]);
        for (u, ((x, y), z)) in self.u.iter_mut().zip(lines) {
            *u += change[0] * x + (change[1] * y + change[2] * z);
        }
    }

    pub(super) fn update_gaps(&mut self) {
        lcp::gaps_into(self.problem.rows(), self.forces, self.u);
    }

    pub(super) fn is_over(&self) -> bool {
        let deadline = self.settings.deadline;
        deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// The lowest natural residual seen; its forces are kept.
pub(super) struct Best {
    pub(super) residual: f64,
    /// Whether the forces at hand are the best.
    is_current: bool,
}

impl Best {
    pub(super) fn none() -> Self {
        Self {
            residual: f64::INFINITY,
            is_current: false,
        }
    }

    /// Natural residual of the forces at hand.
    pub(super) fn see(&mut self, run: &Run, kept: &mut [f64]) -> f64 {
        let residual = certificate::natural_residual(run.problem, run.per_q, run.forces, run.u);
        self.is_current = residual < self.residual || self.residual.is_infinite();
        if self.is_current {
            self.residual = residual;
            kept[..run.forces.len()].copy_from_slice(run.forces);
        }
        residual
    }
}

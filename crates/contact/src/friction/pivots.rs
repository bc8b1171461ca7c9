//! Who is open, sticks and slips, by principal pivoting, where Newton's method goes round in circles.
//!
//! With slip directions d held, forces on the cone are λ_n (1, -μ d), and the problem is one of linear complementarity: for
//! given states one linear system. As long as the number of contacts that contradict their state falls, all of them change it
//! at once; otherwise the last of them alone (Murty's rule), which ends for small friction, where the matrix has positive
//! principal minors. From there Newton's method finds directions and forces together. Sources: Júdice and Pires 1994, Murty 1988.

use super::contacts::Contacts;
use super::newton;
use super::run::{Best, GOAL, Run};
use super::{Scratch, State, cone};

/// Of the largest force and the largest |q|: what contradicts a state by less is round-off.
const ROUND_OFF: f64 = 1e-12;

/// Times that all contacts change at once without being fewer.
const MOST_TRIES: usize = 3;

/// Times that slip directions are set anew.
const MOST_TURNS: usize = 6;

/// Newton steps in which states hardly change, and how many there are between two changes: a contact that contradicts its
/// state may do so because directions are not found yet.
const MOST_STEPS: usize = 60;
const STEPS_BETWEEN: usize = 8;

impl Run<'_> {
    /// From `forces` as they are: states and forces that agree with one another while directions of slip are held, then Newton
    /// steps in which hardly a state changes; and again with the directions found.
    pub(super) fn pivot(&mut self, scratch: &mut Scratch, best: &mut Best) {
        self.settle(scratch);
        self.pivot_from_states(scratch, best);
    }

    /// Likewise from states as they are, whatever the forces.
    pub(super) fn pivot_from_states(&mut self, scratch: &mut Scratch, best: &mut Best) {
        for _ in 0..MOST_TURNS {
            scratch.newton.is_straight = true;
            let is_complementary = self.pivot_straight(scratch);
            scratch.newton.is_straight = false;
            if !is_complementary {
                return;
            }
            self.newton_one_by_one(scratch, best);
            if best.residual <= GOAL || self.is_spent() {
                return;
            }
            self.turn(&mut scratch.contacts);
        }
    }

    /// With directions held. Whether no contact contradicts its state.
    fn pivot_straight(&mut self, scratch: &mut Scratch) -> bool {
        let n = self.problem.n_contacts();
        let (mut fewest, mut tries) = (usize::MAX, MOST_TRIES);
        for _ in 0..4 * n + 40 {
            if self.is_spent() || !self.solve_states(scratch) {
                return false;
            }
            let (count, last) = self.contradictions(&mut scratch.contacts, Change::None);
            let Some(last) = last else {
                return true;
            };
            if count < fewest {
                (fewest, tries) = (count, MOST_TRIES);
            } else {
                tries = tries.saturating_sub(1);
            }
            let change = if tries > 0 {
                Change::All
            } else {
                Change::One(last)
            };
            self.contradictions(&mut scratch.contacts, change);
        }
        false
    }

    /// Forces that keep closed gaps closed and sticking contacts at rest.
    fn solve_states(&mut self, scratch: &mut Scratch) -> bool {
        let Scratch {
            contacts, newton, ..
        } = scratch;
        put_on_lines(self.problem.friction_coefficients(), contacts, self.forces);
        self.update_gaps();
        self.count(contacts);
        let is_empty = contacts.states.iter().all(|state| *state == State::Open);
        if is_empty {
            return true;
        }
        if !newton.factorise(self.problem, contacts, self.u, self.forces)
            || !newton.solve(contacts, self.u)
        {
            return false;
        }
        newton.add_straight_to(self.forces);
        self.update_gaps();
        true
    }

    /// Newton steps from forces that agree with their states.
    pub(super) fn newton_one_by_one(&mut self, scratch: &mut Scratch, best: &mut Best) {
        let mut since_change = 0;
        for _ in 0..MOST_STEPS {
            let Scratch {
                contacts, newton, ..
            } = scratch;
            self.count(contacts);
            if !newton.factorise(self.problem, contacts, self.u, self.forces)
                || !newton.solve(contacts, self.u)
            {
                return;
            }
            newton.add_to(self.forces);
            self.update_gaps();
            contacts.follow(self.forces);
            let residual = best.see(self, &mut scratch.best);
            if residual <= GOAL || self.is_spent() {
                return;
            }
            since_change += 1;
            if since_change < STEPS_BETWEEN {
                continue;
            }
            let (_, last) = self.contradictions(&mut scratch.contacts, Change::None);
            if let Some(last) = last {
                since_change = 0;
                self.contradictions(&mut scratch.contacts, Change::One(last));
                let contacts = &scratch.contacts;
                put_on_lines(self.problem.friction_coefficients(), contacts, self.forces);
                self.update_gaps();
            }
        }
    }

    /// One factorisation for contacts in these states.
    fn count(&mut self, contacts: &Contacts) {
        let rows = contacts.states.iter().map(|state| match state {
            State::Open => 0.0,
            State::Stick => 3.0,
            State::Slip => 2.0,
        });
        self.pivots += 1;
        self.work += rows.sum::<f64>().powi(3) / 3.0;
    }

    fn is_spent(&self) -> bool {
        self.work > self.most_work || self.is_over()
    }

    /// Contacts that contradict their state, and the last of them; changes those asked for.
    fn contradictions(&self, contacts: &mut Contacts, change: Change) -> (usize, Option<usize>) {
        let largest = |values: &[f64]| values.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        let no_force = ROUND_OFF * largest(self.forces);
        let no_motion = ROUND_OFF / self.per_q;
        let (mut count, mut last) = (0, None);
        for contact in 0..self.problem.n_contacts() {
            let at = 3 * contact;
            let force = [self.forces[at], self.forces[at + 1], self.forces[at + 2]];
            let u = [self.u[at], self.u[at + 1], self.u[at + 2]];
            let mu = self.problem.friction_coefficients()[contact];
            let next = next_state(contacts, contact, mu, &force, &u, (no_force, no_motion));
            let Some((state, direction)) = next else {
                continue;
            };
            count += 1;
            last = Some(contact);
            if change == Change::All || change == Change::One(contact) {
                contacts.states[contact] = state;
                contacts.directions[contact] = direction;
            }
        }
        (count, last)
    }

    /// Directions of slipping contacts as they slip.
    fn turn(&self, contacts: &mut Contacts) {
        for contact in 0..self.problem.n_contacts() {
            let at = 3 * contact;
            let slip = [self.u[at + 1], self.u[at + 2]];
            let length = slip[0].hypot(slip[1]);
            if contacts.states[contact] == State::Slip && length > ROUND_OFF / self.per_q {
                contacts.directions[contact] = slip.map(|s| s / length);
            }
        }
    }
}

/// Which contacts change their state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    None,
    One(usize),
    All,
}

/// Forces of slipping contacts along (1, -μ d), of open ones zero.
fn put_on_lines(coefficients: &[f64], contacts: &Contacts, forces: &mut [f64]) {
    let triples = forces.as_chunks_mut::<3>().0.iter_mut();
    for (contact, (force, mu)) in triples.zip(coefficients).enumerate() {
        match contacts.states[contact] {
            State::Open => *force = [0.0; 3],
            State::Stick => {}
            State::Slip => {
                let [d, e] = contacts.directions[contact].map(|d| -mu * force[0] * d);
                *force = [force[0], d, e];
            }
        }
    }
}

/// The state that a contact's force and motion ask for instead of the one it is in, with the direction of its slip.
fn next_state(
    contacts: &Contacts,
    contact: usize,
    mu: f64,
    force: &[f64; 3],
    u: &[f64; 3],
    (no_force, no_motion): (f64, f64),
) -> Option<(State, [f64; 2])> {
    let old = contacts.directions[contact];
    let unit = |x: f64, y: f64| {
        let length = x.hypot(y);
        (length > 0.0).then(|| [x / length, y / length])
    };
    match contacts.states[contact] {
        State::Open if u[0] < -no_motion && contacts.can_close(contact) => {
            let along = unit(u[1], u[2]);
            Some((State::Slip, along.unwrap_or(old)))
        }
        State::Open => None,
        State::Stick | State::Slip if force[0] < -no_force => Some((State::Open, old)),
        State::Stick if cone::tangential(force) > mu * force[0] + no_force => {
            let against = unit(-force[1], -force[2]);
            Some((State::Slip, against.unwrap_or(old)))
        }
        State::Stick => None,
        State::Slip if old[0] * u[1] + old[1] * u[2] < -no_motion => {
            if contacts.can_stick(contact) {
                Some((State::Stick, old))
            } else {
                Some((State::Slip, old.map(|d| -d)))
            }
        }
        State::Slip => None,
    }
}

impl newton::Scratch {
    /// Adds the step to `forces`; those of slipping contacts stay on their lines, whatever their sign.
    fn add_straight_to(&self, forces: &mut [f64]) {
        self.add_unknowns_to(forces);
        for (row, drag, step) in self.normal_steps() {
            forces[row] += step;
            forces[row + 1] += drag[0] * step;
            forces[row + 2] += drag[1] * step;
        }
    }
}

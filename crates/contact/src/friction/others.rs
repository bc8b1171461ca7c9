//! Whether other forces solve a problem too, as they may where friction is large. Not for the haptic step.
//!
//! For that friction must close a gap against the normal force that opens it, or nearly so. How far it is from that is told by
//!
//! ```text
//! max over y of   Σ μ_j y_j |(W_tn y)_j| / yᵀ W_nn y
//! ```
//!
//! y being normal forces, and friction along what pulls in most. For one contact it is μ |w_tn| / w_nn, and from 1 on
//! a point that stands clear is held as well, if it is dragged far enough. Where the number is large, forces are looked for from
//! other states of the contacts than those of the answer at hand. What is found is an answer with its certificate, and so a
//! proof; that nothing is found proves nothing.

use super::run::{Best, Run};
use super::{Problem, Scratch, Settings, State, certificate};
use crate::error::Error;

/// Of friction that pulls in as much as normal forces push out: below, others are not looked for. The smallest number with
/// other answers was 0.8 in wedges and in the shipped scenes with up to ten times their friction, 1.2 in random problems.
const JAMS: f64 = 0.5;

/// States to start from. In a wedge with two contacts closed out of 28 about one in twenty ends at another answer.
const STARTS: u64 = 128;
const LAST_START: u64 = STARTS - 1;

/// Operations of all factorisations at most: a tenth of a second, about.
const MOST_WORK: f64 = 2e8;

/// Of the largest |q|: motions that differ by more are others. Forces alone may differ where W is singular.
const DIFFERS: f64 = 1e-6;

/// Natural residual of an answer.
const SOLVED: f64 = 1e-10;

/// Whether friction is so large that forces other than these, of an answer, may solve `problem` too: n² operations. False where it
/// is not an answer.
///
/// # Errors
/// [`Error::Length`] unless there are three forces per contact.
pub fn may_have_others(problem: &Problem, forces: &[f64]) -> Result<bool, Error> {
    problem.check_length("the forces", forces.len())?;
    let is_large = jamming(problem, forces) >= JAMS;
    Ok(is_large && certificate::check(problem, forces)?.natural_residual <= SOLVED)
}

/// Forces that solve `problem` as well as `forces` do, and leave other gaps or slips; each once, none where none was found.
///
/// Allocates; takes up to some tenths of a second where [`may_have_others`], or else n² operations. Equal input gives equal bits.
///
/// # Errors
/// [`Error::Length`] unless there are three forces per contact.
pub fn others(problem: &Problem, forces: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
    if !may_have_others(problem, forces)? {
        return Ok(Vec::new());
    }
    let mut look = Look::new(problem, forces);
    for start in 0..STARTS {
        if look.work > MOST_WORK {
            break;
        }
        look.set_out(start);
        look.settle();
    }
    Ok(look.found.into_iter().map(|answer| answer.forces).collect())
}

/// How much friction at its worst closes of what normal forces open: of each contact alone, of all alike, and of those at hand.
fn jamming(problem: &Problem, forces: &[f64]) -> f64 {
    let n = problem.n_contacts();
    let mu = problem.friction_coefficients();
    let own = (0..n).map(|contact| {
        let row = 3 * contact;
        let column = &problem.column(row)[row..row + 3];
        mu[contact] * column[1].hypot(column[2]) / column[0]
    });
    let together = |y: &dyn Fn(usize) -> f64| {
        let mut motion = vec![0.0; 3 * n];
        for contact in 0..n {
            add(&mut motion, problem.column(3 * contact), y(contact));
        }
        let (mut closed, mut opened) = (0.0, 0.0);
        for (contact, motion) in motion.chunks_exact(3).enumerate() {
            closed += mu[contact] * y(contact) * motion[1].hypot(motion[2]);
            opened += y(contact) * motion[0];
        }
        closed / opened
    };
    let as_pressed = together(&|contact| forces[3 * contact]);
    let all = own.chain([together(&|_| 1.0), as_pressed]);
    // Points that nothing moves are no number.
    all.filter(|x| x.is_finite()).fold(0.0, f64::max)
}

/// Direction of slip in which friction closes the contact's gap.
fn pulling_in(problem: &Problem, contact: usize) -> [f64; 2] {
    let row = 3 * contact;
    let column = problem.column(row);
    let along = [column[row + 1], column[row + 2]];
    let length = along[0].hypot(along[1]);
    if length > 0.0 {
        along.map(|x| x / length)
    } else {
        [1.0, 0.0]
    }
}

fn add(motion: &mut [f64], column: &[f64], force: f64) {
    if force != 0.0 {
        for (motion, column) in motion.iter_mut().zip(column) {
            *motion += force * column;
        }
    }
}

/// Forces with what they leave, u = q + W λ.
struct Answer {
    forces: Vec<f64>,
    u: Vec<f64>,
}

struct Look<'a> {
    problem: &'a Problem<'a>,
    settings: Settings,
    scratch: Scratch,
    states: Vec<State>,
    directions: Vec<[f64; 2]>,
    own: Answer,
    forces: Vec<f64>,
    u: Vec<f64>,
    work: f64,
    draw: Draw,
    found: Vec<Answer>,
}

impl<'a> Look<'a> {
    fn new(problem: &'a Problem<'a>, forces: &[f64]) -> Self {
        let mut u = problem.q().to_vec();
        for (j, force) in forces.iter().enumerate() {
            add(&mut u, problem.column(j), *force);
        }
        let mut own = forces.to_vec();
        let mut scratch = Scratch::new(problem.n_contacts());
        let settings = Settings::default();
        Run::new(problem, &settings, &mut own, &mut u.clone(), 0.0).reset(&mut scratch);
        scratch.contacts.read(problem, forces);
        Self {
            problem,
            settings,
            states: scratch.contacts.states.clone(),
            directions: scratch.contacts.directions.clone(),
            scratch,
            own: Answer {
                forces: forces.to_vec(),
                u,
            },
            forces: vec![0.0; forces.len()],
            u: problem.q().to_vec(),
            work: 0.0,
            draw: Draw(0x9e37_79b9_7f4a_7c15),
            found: Vec::new(),
        }
    }

    /// States to start from: no force, all that carry force sticking; two drawn contacts that stick or slip as pulls them in, alone
    /// or with half of those that carry force; and at last all sticking, which is dear.
    fn set_out(&mut self, start: u64) {
        let contacts = &mut self.scratch.contacts;
        contacts.reset(self.problem, certificate::max_abs(self.problem.q()));
        contacts.directions.copy_from_slice(&self.directions);
        let own = self.states.iter().zip(&mut contacts.states);
        let closed = own.filter(|(own, _)| **own != State::Open);
        match start {
            0 => {}
            1 => closed.for_each(|(_, state)| *state = State::Stick),
            LAST_START => contacts.states.fill(State::Stick),
            _ => {
                if start.is_multiple_of(2) {
                    closed
                        .filter(|_| self.draw.below(2) == 0)
                        .for_each(|(own, state)| *state = *own);
                }
                for _ in 0..2 {
                    let drawn = self.draw.below(self.states.len());
                    contacts.states[drawn] = State::Stick;
                    if self.draw.below(2) == 0 {
                        contacts.states[drawn] = State::Slip;
                        contacts.directions[drawn] = pulling_in(self.problem, drawn);
                    }
                }
            }
        }
        for contact in 0..self.states.len() {
            if !contacts.can_close(contact) {
                contacts.states[contact] = State::Open;
            } else if contacts.states[contact] == State::Stick && !contacts.can_stick(contact) {
                contacts.states[contact] = State::Slip;
            }
        }
    }

    /// From the states to an answer, which is kept if it is another.
    fn settle(&mut self) {
        self.forces.fill(0.0);
        self.u.copy_from_slice(self.problem.q());
        let left = MOST_WORK - self.work;
        let mut run = Run::new(
            self.problem,
            &self.settings,
            &mut self.forces,
            &mut self.u,
            left,
        );
        self.scratch.newton.is_regularised = false;
        let mut best = Best::none();
        run.pivot_from_states(&mut self.scratch, &mut best);
        if best.residual.is_infinite() {
            // No force, for one, takes no Newton step.
            best.see(&run, &mut self.scratch.best);
        }
        run.take(&best, &mut self.scratch);
        self.work += run.work;
        let least = DIFFERS * certificate::max_abs(self.problem.q());
        let u = &self.u;
        let is_other = |answer: &Answer| {
            let motions = answer.u.iter().zip(u);
            motions.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) > least
        };
        if best.residual <= SOLVED && is_other(&self.own) && self.found.iter().all(is_other) {
            self.found.push(Answer {
                forces: self.forces.clone(),
                u: self.u.clone(),
            });
        }
    }
}

/// Numbers that look drawn, the same each time (Marsaglia's xorshift).
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        // The upper bits are the better ones.
        ((self.0 >> 33) % n.max(1) as u64) as usize
    }
}

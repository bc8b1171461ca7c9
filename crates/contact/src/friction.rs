//! Coulomb friction: normal and tangential forces of all contacts at once, with the exact disk.
//!
//! Contact i has a normal and two tangents, and in that order three rows in
//!
//! ```text
//! u = q + W λ
//! ```
//!
//! u_n is the gap (m), u_t the slip in this step (m), λ the force on the part (N), W the Delassus operator over
//! normals and tangents (m/N). Three things must hold (Signorini, Coulomb):
//!
//! ```text
//! u_n ≥ 0,  λ_n ≥ 0,  u_n λ_n = 0        no overlap, no pull
//! |λ_t| ≤ μ λ_n                           the force is inside the cone
//! u_t = -s λ_t,  s ≥ 0,  s (μ λ_n - |λ_t|) = 0   where the point slips, the force opposes it in full
//! ```
//!
//! With ũ = u + μ |u_t| n this is one line, λ ∈ K, ũ ∈ K*, λᵀ ũ = 0 (de Saxcé), and one number says how far
//! λ is from it: the natural residual |λ - P(λ - ũ)| of the [`Certificate`], P the projection on the cone K.
//!
//! # Method
//!
//! Newton's method on all closed contacts together, from the forces of the step before or from the frictionless answer.
//! Each step opens, closes, holds or releases contacts as forces and gaps then tell (semi-smooth), and a sticking contact has
//! three unknowns, a slipping one two. While no contact changes what it does, the factor of the step before serves again.
//! Where that does not end: principal pivoting with slip directions held, then Newton steps that change a state only once
//! directions stand; and that again after sweeps over the contacts, each solved exactly for its three forces while the
//! others stand still (non-smooth Gauss-Seidel). The best forces seen are given. With all coefficients zero the answer is that of [`crate::lcp`] and nothing else is computed.
//!
//! For one contact there are three cases: open; stick, if the force that stops all motion is inside the cone; else slip,
//! where the direction of slip is a root of a trigonometric polynomial of degree two, found to round-off.
//!
//! W may be singular. Contacts given twice share their force: where a pivot has no digits, 1e-9 of the diagonal is added, and
//! the next steps take away what that changed. A contact that no force moves along some direction of its tangent plane carries no
//! force along it, and sticks if it does not move along it either. One that no force moves at all is without force; if it
//! overlaps there is no solution, and the certificate says so.
//!
//! The answer is unique for small coefficients. For large ones there may be several, as when a part wedges, and one of them is
//! given: [`others`] looks for more. Where there is none, the best seen is given and [`Status::Budget`] says so.
//!
//! ```
//! use contact::friction::{Problem, Scratch, Settings, State, Status, solve};
//!
//! # fn main() -> Result<(), contact::Error> {
//! // A spring of 1000 N/m in each direction, 1 mm into a wall that slides 5 mm along it, friction coefficient 0.5.
//! let matrix = [1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3];
//! let problem = Problem::new(&matrix, &[-1e-3, 5e-3, 0.0], &[0.5])?;
//! let mut scratch = Scratch::new(1);
//! let (mut forces, mut slip) = ([0.0; 3], [0.0; 3]);
//! let solution = solve(&problem, &Settings::default(), &mut scratch, false, &mut forces, &mut slip)?;
//! assert_eq!(solution.status, Status::Solved);
//! assert_eq!(scratch.states(), [State::Slip]);
//! // 1 N holds the gap closed, half a newton drags against the slip, the rest of the way is slip.
//! assert!((forces[0] - 1.0_f64).abs() < 1e-12 && (forces[1] + 0.5_f64).abs() < 1e-12);
//! assert!((slip[1] - 4.5e-3_f64).abs() < 1e-15);
//! # Ok(())
//! # }
//! ```
//!
//! Sources: Jean (1999), CMAME 177, for the sweeps; de Saxcé and Feng (1998), Math. Comput. Model. 28; Alart and
//! Curnier (1991), CMAME 92, for Newton's method; Bonnefon and Daviet (2011), INRIA RR-7528, for the degree of
//! the slip equation.

mod certificate;
mod coefficients;
mod cone;
mod contacts;
mod local;
mod newton;
mod others;
mod pivots;
mod problem;
mod run;

use std::time::Instant;

pub use certificate::{Certificate, check};
pub use coefficients::Coefficients;
pub use others::{may_have_others, others};
pub use problem::Problem;

use crate::error::Error;
use crate::lcp;

/// Budgets and tolerances of [`solve`].
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The natural residual ([`Certificate::natural_residual`]) up to which an answer counts as solved, no unit.
    /// 1e-8; Newton's method usually ends far below.
    pub tolerance: f64,
    /// Sweeps over the contacts, each about 9 n² operations for n contacts. 200.
    pub max_sweeps: usize,
    /// Newton steps before pivots, each a factorisation of the closed contacts' rows: 1 to 3 warm, 2 to 5 cold. 40; 0 leaves the
    /// sweeps alone. Pivots are bounded by the number of contacts.
    pub max_newton_steps: usize,
    /// When to stop, whatever the other budgets say. None: no clock is read, and equal input gives equal bits.
    pub deadline: Option<Instant>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            // A slip direction has half the digits where slip is about to start.
            tolerance: 1e-8,
            max_sweeps: 200,
            max_newton_steps: 40,
            deadline: None,
        }
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The forces solve the problem; the certificate says how well.
    Solved,
    /// The budget ended, or there is no solution. The forces are the best seen, the certificate says how good.
    Budget,
}

/// What a contact does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum State {
    /// No force.
    #[default]
    Open,
    /// Closed, the force inside the cone.
    Stick,
    /// Closed, the force on the cone.
    Slip,
}

/// What [`solve`] says about the forces it wrote.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// How it ended.
    pub status: Status,
    /// How well the forces fit the problem as given.
    pub certificate: Certificate,
    /// Sweeps over the contacts.
    pub sweeps: usize,
    /// Newton steps taken.
    pub newton_steps: usize,
}

/// Memory of the solver, for up to `capacity` contacts: about 15 capacity² numbers, touched as far as a problem needs them.
#[derive(Debug, Clone)]
pub struct Scratch {
    capacity: usize,
    lcp: lcp::Scratch,
    normal_matrix: Vec<f64>,
    normal_q: Vec<f64>,
    normal_force: Vec<f64>,
    normal_gap: Vec<f64>,
    contacts: contacts::Contacts,
    best: Vec<f64>,
    start: Vec<f64>,
    newton: newton::Scratch,
}

impl Scratch {
    /// Memory for problems of up to `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            lcp: lcp::Scratch::new(capacity),
            normal_matrix: vec![0.0; capacity * capacity],
            normal_q: vec![0.0; capacity],
            normal_force: vec![0.0; capacity],
            normal_gap: vec![0.0; capacity],
            contacts: contacts::Contacts::new(capacity),
            best: vec![0.0; 3 * capacity],
            start: vec![0.0; 3 * capacity],
            newton: newton::Scratch::new(capacity),
        }
    }

    /// Numbers that are reserved, about.
    pub fn n_numbers(&self) -> usize {
        15 * self.capacity * self.capacity
    }

    /// Largest number of contacts.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// What each contact does in the answer of the last solve.
    pub fn states(&self) -> &[State] {
        &self.contacts.states
    }
}

/// Solves `problem`; writes the forces (three per contact: normal, tangents; N) and the gaps and slips they leave,
/// u = q + W λ (m).
///
/// `is_warm`: start from what stands in `forces` instead of from the frictionless answer.
/// Does not allocate, lock or log.
///
/// # Errors
/// [`Error::Capacity`], or [`Error::Length`] if `forces` or `slip` do not have three entries per contact, or
/// [`Error::NotFinite`] if a force to start from is not finite.
pub fn solve(
    problem: &Problem,
    settings: &Settings,
    scratch: &mut Scratch,
    is_warm: bool,
    forces: &mut [f64],
    slip: &mut [f64],
) -> Result<Solution, Error> {
    run::run(problem, settings, scratch, is_warm, forces, slip)
}

//! Linear complementarity: given M and q, find w and z with
//!
//! ```text
//! w = q + M z,   w ≥ 0,   z ≥ 0,   wᵀ z = 0
//! ```
//!
//! # The problem
//!
//! Two bodies may touch at m places. Before any contact force acts the gap at place i is q_i; where it is
//! negative the bodies overlap. A force z_j that pushes at place j opens the gaps by column j of M. Three
//! things must hold when all forces have settled (Signorini): no gap is negative (w ≥ 0), no force pulls
//! (z ≥ 0), and a force acts only where the gap is closed (w_i z_i = 0). That is the linear complementarity
//! problem, LCP. For contact, `q` and `w` are gaps (m), `M` the Delassus operator (m/N), `z` the normal forces (N).
//!
//! One place shows all of it. A spring of 1000 N/m stands 2 mm into a wall: M = 1e-3 m/N, q = -2e-3 m.
//!
//! ```
//! use contact::lcp::{Problem, Scratch, Settings, Start, Status, solve};
//!
//! # fn main() -> Result<(), contact::Error> {
//! let problem = Problem::symmetric(&[1e-3], &[-2e-3])?;
//! let mut scratch = Scratch::new(1);
//! let (mut z, mut w) = ([0.0_f64], [0.0]);
//! let solution = solve(&problem, &Settings::default(), &mut scratch, Start::Cold, &mut z, &mut w)?;
//! assert_eq!(solution.status, Status::Solved);
//! assert!((z[0] - 2.0).abs() < 1e-12, "2 N close the gap");
//! assert_eq!(w[0], 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! With m places there are 2^m ways to say which of them carry force, the *active* ones. If the active set is
//! known the forces follow from one linear system, `M_FF z_F = -q_F`. All exact methods are ways to find the
//! active set without trying all of them.
//!
//! # What an answer is worth
//!
//! Whatever the method, the answer carries a [`Certificate`], made from M, q and z alone; [`check`] makes it for
//! the answer of any solver. A problem may have no solution (a tool wedged between rigid walls). That is a
//! [`Status`] of its own and never a number.
//!
//! If M is symmetric positive definite, z is unique. If it is semidefinite (more contacts than the part has ways to
//! give), w and M z are unique, and the solver returns one of the many z. Then M_FF has no inverse, and
//! E = 1e-12 diag(M) is added while the active set is sought. What that changes is known row by row: an
//! answer of the changed problem misses the true one by w_i of 1e-12 M_ii z_i. Proximal steps on the true M
//! then take it away again: z ← answer for q - E z. Where M_FF keeps its digits nothing is added at all.
//!
//! # Methods
//!
//! | method | for which M | ends | cost |
//! | --- | --- | --- | --- |
//! | [`BlockPivoting`] | positive definite | always, by Murty's rule; 1 to 5 rounds on contact problems | one factorisation, then O(k m²) for k exchanged rows |
//! | [`ActiveSet`] | positive semidefinite | always: its energy falls | O(m²) a pivot |
//! | [`GaussSeidel`] | positive semidefinite | in the limit | O(m²) a sweep |
//!
//! All are for symmetric M, as that of frictionless contact is, and refuse another. Coulomb friction makes the problem
//! unsymmetric where the cone is cut into a polygon; [`crate::friction`] solves it on the cone itself.
//!
//! *Block principal pivoting* guesses an active set, solves for its forces, and then moves every active
//! row with a pulling force out and every other row with a closed gap in, all at once. Contact
//! problems are done after a few rounds. If the number of wrong rows stops falling only the last wrong row moves
//! (Murty's rule). That ends on every matrix whose principal minors are positive, but perhaps after 2^m rounds: hence
//! the budgets of [`Settings`]. *Active-set* pivoting moves one row at a time, downhill in energy, so that it cannot
//! cycle even on singular M. *Projected Gauss-Seidel* sets each row right in turn and starts over; it is never exact,
//! but always has something to show.
//!
//! [`Automatic`], which is what [`solve`] runs, is a chain of them: block pivoting from a warm start; if its budget ends,
//! single pivots; if all that fails, Gauss-Seidel and the best answer seen, flagged [`Status::Budget`] unless it is a
//! solution, or [`Status::Indefinite`] where M is not what it should be. Nothing allocates after [`Scratch::new`], and
//! equal input gives equal bits (unless a deadline is set).
//!
//! # From step to step
//!
//! In a haptic loop the problem of this millisecond is nearly that of the last. [`Start::Rows`] hands over the rows that
//! carried force, whatever happened to M. Where M itself stays, and only q changes, [`Start::Kept`] goes on
//! from the factor that is there: k exchanged rows cost O(k m²).
//!
//! ```
//! use contact::lcp::{Problem, Scratch, Settings, Start, solve};
//!
//! # fn main() -> Result<(), contact::Error> {
//! // Two springs that lean on one another.
//! let matrix = [2e-3, 1e-3, 1e-3, 2e-3];
//! let (mut z, mut w) = ([0.0_f64; 2], [0.0; 2]);
//! let mut scratch = Scratch::new(2);
//! let settings = Settings::default();
//! for step in 0..10 {
//!     let depth = 1e-4 * f64::from(step);
//!     let q = [-depth, 3e-4 - depth];
//!     let problem = Problem::symmetric(&matrix, &q)?;
//!     let start = if step == 0 { Start::Cold } else { Start::Kept };
//!     let solution = solve(&problem, &settings, &mut scratch, start, &mut z, &mut w)?;
//!     assert!(solution.certificate.natural_residual <= 1e-10);
//!     assert!(z[0] * w[0] == 0.0 || w[0].abs() < 1e-18);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Sources: Cottle, Pang, Stone, The Linear Complementarity Problem (1992); Murty (1974) for the rule of
//! the last row; Júdice and Pires (1994) for block pivoting; Lawson and Hanson (1974) for the active set;
//! Rockafellar (1976) for proximal steps; Gill, Golub, Murray and Saunders (1974) for factors
//! that change by a row.

mod active_set;
mod certificate;
mod dense;
mod gauss_seidel;
mod ldl;
mod pivoting;
mod problem;
mod run;
mod scaling;
mod solver;

use std::time::Instant;

pub(crate) use certificate::GOAL;
pub use certificate::{Certificate, check};
pub(crate) use dense::gaps_into;
pub use problem::Problem;
pub use solver::{ActiveSet, Automatic, BlockPivoting, GaussSeidel, Solver};

use crate::error::Error;
use pivoting::Basis;

/// Budgets and tolerances of a solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The natural residual ([`Certificate::natural_residual`]) up to which an answer counts as solved, no unit.
    /// 1e-10: a ten-billionth of the largest gap and force, far below what a device resolves. Round-off
    /// leaves about 1e-15 (1e-12 on very bad matrices).
    pub tolerance: f64,
    /// Changes of the active set in block principal pivoting. Contact problems need 0 to 3 from a warm start,
    /// 1 to 5 from none. 30 leaves room for the Murty steps.
    pub max_rounds: usize,
    /// Single pivots of the active-set method after that, each about m² operations. 5000 is enough
    /// for several hundred rows; lower it where time is short.
    pub max_pivots: usize,
    /// Gauss-Seidel sweeps after that, each about m times the rows that change. 500.
    pub max_sweeps: usize,
    /// When to stop, whatever the other budgets say; looked at between two rounds, pivots or ten sweeps.
    /// None: no clock is read, and equal input gives equal bits.
    pub deadline: Option<Instant>,
}

impl Settings {
    fn is_over(&self) -> bool {
        self.deadline
            .is_some_and(|deadline| Instant::now() >= deadline)
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-10,
            max_rounds: 30,
            max_pivots: 5000,
            max_sweeps: 500,
            deadline: None,
        }
    }
}

/// Where the search for the active rows starts. Any start gives the same answer where it is unique.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Start<'a> {
    /// From the gaps: the rows deeper than half the deepest.
    #[default]
    Cold,
    /// From these rows, one flag each: those with z > 0 in the step before, carried across by candidate.
    Rows(&'a [bool]),
    /// From rows and factor of the last solve with this scratch. M must be what it was then; if it is not, the certificate
    /// finds out and the solve starts again, cold. For another m the same as [`Start::Cold`].
    Kept,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// `z` and `w` solve the problem; the certificate says how well.
    Solved,
    /// Proved: no z ≥ 0 gives w ≥ 0. `z` is 0 and `w` is q.
    ///
    /// The proof is a y ≥ 0 with Mᵀ y ≤ 0 and qᵀ y < 0 (to 1e-9 of the terms summed), because then
    /// yᵀ w < 0 for every z ≥ 0.
    NoSolution,
    /// M is not positive semi-definite, by more than round-off, and no solution was found. `z` is the best answer seen.
    Indefinite,
    /// The budget ended. `z` is the best answer seen, its certificate says how good.
    Budget,
}

/// Which method gave the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Nothing to solve: no row, or no row closed.
    Open,
    /// Block principal pivoting.
    BlockPivoting,
    /// Single pivots of the active-set method.
    ActiveSet,
    /// Projected Gauss-Seidel.
    GaussSeidel,
}

/// What a solve says about the z and w it wrote.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// How it ended.
    pub status: Status,
    /// Which method gave the answer.
    pub method: Method,
    /// How well z and w fit the problem as given.
    pub certificate: Certificate,
    /// Active sets tried in block pivoting: 1 if the start was right, 0 if nothing was closed.
    pub rounds: usize,
    /// Rows exchanged, over all methods.
    pub pivots: usize,
    /// Gauss-Seidel sweeps.
    pub sweeps: usize,
}

/// Memory of the solvers, for up to `capacity` rows: 8 capacity² bytes and a little.
#[derive(Debug, Clone)]
pub struct Scratch {
    capacity: usize,
    /// The factor.
    dense: Vec<f64>,
    ldl: ldl::LdlState,
    basis: Basis,
    /// Scaled size of each row, sqrt(M_ii).
    scale: Vec<f64>,
    unit: f64,
    center: Vec<f64>,
    best_z: Vec<f64>,
    trial: Vec<f64>,
}

impl Scratch {
    /// Memory for problems of up to `capacity` rows.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            dense: vec![0.0; ldl::memory_len(capacity)],
            ldl: ldl::LdlState::new(capacity),
            basis: Basis::new(capacity),
            scale: vec![0.0; capacity],
            unit: 1.0,
            center: vec![0.0; capacity],
            best_z: vec![0.0; capacity],
            trial: vec![0.0; capacity],
        }
    }

    /// Largest number of rows.
    pub fn capacity(&self) -> usize {
        self.capacity
    }
}

/// Solves `problem` by [`Automatic`], writes `z` and `w` = q + M z.
///
/// Does not allocate, lock or log.
///
/// # Errors
/// [`Error::NotSymmetric`]; [`Error::Capacity`]; [`Error::Length`] if the start, `z` or `w` do not have m entries.
pub fn solve(
    problem: &Problem,
    settings: &Settings,
    scratch: &mut Scratch,
    start: Start,
    z: &mut [f64],
    w: &mut [f64],
) -> Result<Solution, Error> {
    Automatic.solve(problem, settings, scratch, start, z, w)
}

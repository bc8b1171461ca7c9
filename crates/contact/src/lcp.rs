//! Linear complementarity: given M and q, find w and z with
//!
//! ```text
//! w = q + M z,   w ≥ 0,   z ≥ 0,   wᵀ z = 0
//! ```
//!
//! For contact, `q` holds the gaps without contact force (m), `M` the Delassus operator (m/N),
//! `z` the normal forces (N) and `w` the gaps (m).
//!
//! Way of a symmetric positive semi-definite problem: block principal pivoting from a warm start on
//! M + E, E = 1e-12 diag(M); if its budget ends, single pivots that cannot cycle; then E is removed
//! again by proximal steps on the true M, which leave round-off; if all that fails, projected
//! Gauss-Seidel. Any other M: block pivoting while the diagonal is positive, then Lemke's method with
//! the lexicographic rule.
//! Each answer carries a [`Certificate`] made from the data as given.
//!
//! Source: Cottle, Pang, Stone, The Linear Complementarity Problem (1992); Júdice and Pires (1994) for
//! block pivoting; Rockafellar (1976) for proximal steps.

mod active_set;
mod certificate;
mod dense;
mod gauss_seidel;
mod ldl;
mod lemke;
mod lu;
mod pivoting;
mod problem;
mod run;
mod scaling;

pub use certificate::{Certificate, check};
pub use problem::Problem;

use crate::error::Error;
use pivoting::Basis;
use run::Run;

/// Budgets and tolerances of [`solve`]. There is no clock in here: equal input gives equal bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The natural residual ([`Certificate::natural_residual`]) up to which an answer counts as solved, no unit.
    /// 1e-10: a ten-billionth of the largest gap and force, far below what a device resolves. Round-off
    /// leaves about 1e-15 (1e-12 on very bad matrices).
    pub tolerance: f64,
    /// Changes of the active set in block principal pivoting, each one factorisation of the active rows. Contact
    /// problems need 0 to 3 from a warm start, 2 to 6 from none. 30 leaves room for the Murty steps.
    pub max_rounds: usize,
    /// Single pivots after that (active set or Lemke), each about m² operations. 5000 is enough
    /// for several hundred rows; lower it where time is short.
    pub max_pivots: usize,
    /// Gauss-Seidel sweeps after that, each about m times the rows that change. 500.
    pub max_sweeps: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-10,
            max_rounds: 30,
            max_pivots: 5000,
            max_sweeps: 500,
        }
    }
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
    /// Lemke's method ended on a ray and no proof of the above was found. `z` is the best answer seen.
    Ray,
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
    /// Lemke's method.
    Lemke,
    /// Projected Gauss-Seidel.
    GaussSeidel,
}

/// What [`solve`] says about the z and w it wrote.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// How it ended.
    pub status: Status,
    /// Which method gave the answer.
    pub method: Method,
    /// How well z and w fit the problem as given.
    pub certificate: Certificate,
    /// Active sets tried in block pivoting: 1 if the warm start was right, 0 if nothing was closed.
    pub rounds: usize,
    /// Rows exchanged, over all methods.
    pub pivots: usize,
    /// Gauss-Seidel sweeps.
    pub sweeps: usize,
}

/// Memory of the solver, for up to `capacity` rows: 8 capacity² bytes and a little.
#[derive(Debug, Clone)]
pub struct Scratch {
    capacity: usize,
    /// Factor or tableau, whichever is at work.
    dense: Vec<f64>,
    basis: Basis,
    /// Scaled size of each row, sqrt(M_ii).
    scale: Vec<f64>,
    unit: f64,
    center: Vec<f64>,
    best_z: Vec<f64>,
    trial: Vec<f64>,
    integers: Vec<u32>,
}

impl Scratch {
    /// Memory for problems of up to `capacity` rows.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            dense: vec![0.0; lemke::tableau_len(capacity)],
            basis: Basis::new(capacity),
            scale: vec![0.0; capacity],
            unit: 1.0,
            center: vec![0.0; capacity],
            best_z: vec![0.0; capacity],
            trial: vec![0.0; capacity + 1],
            integers: vec![0; lemke::n_integers(capacity)],
        }
    }

    /// Largest number of rows.
    pub fn capacity(&self) -> usize {
        self.capacity
    }
}

/// Solves `problem`, writes `z` and `w` = q + M z.
///
/// `warm`: rows expected to carry force (z > 0 of the step before, carried across by candidate).
/// Any warm start gives the same answer where it is unique; a good one saves rounds.
/// Does not allocate, lock, log or read a clock.
///
/// # Errors
/// [`Error::Capacity`], or [`Error::Length`] if `warm`, `z` or `w` do not have m entries.
pub fn solve(
    problem: &Problem,
    settings: &Settings,
    scratch: &mut Scratch,
    warm: Option<&[bool]>,
    z: &mut [f64],
    w: &mut [f64],
) -> Result<Solution, Error> {
    let m = problem.m();
    if m > scratch.capacity {
        return Err(Error::Capacity {
            rows: m,
            capacity: scratch.capacity,
        });
    }
    let lengths = [
        ("z", z.len()),
        ("w", w.len()),
        ("the warm start", warm.map_or(m, <[bool]>::len)),
    ];
    for (what, actual) in lengths {
        if actual != m {
            return Err(Error::Length {
                what,
                expected: m,
                actual,
            });
        }
    }
    let mut run = Run {
        problem,
        settings,
        rounds: 0,
        pivots: 0,
        sweeps: 0,
    };
    let (status, method) = run.solve(scratch, warm, z, w);
    let certificate = certificate::of(problem, z, w);
    Ok(Solution {
        status,
        method,
        certificate,
        rounds: run.rounds,
        pivots: run.pivots,
        sweeps: run.sweeps,
    })
}

//! Block principal pivoting: guess which rows carry force, solve, exchange all wrong rows at once.
//!
//! Exchanging all is fast but may cycle; after [`PATIENCE`] rounds without progress only the last wrong row is
//! exchanged (Murty's rule), which cannot cycle on a matrix with positive principal minors.
//!
//! Source: Júdice and Pires (1994), Computers & Operations Research 21; Kim and Park (2011), SIAM J. Sci. Comput. 33.

use super::ldl::{Ldl, Singular};
use super::{Problem, Settings, Start, dense};

/// Rounds that may exchange all wrong rows without lowering their number. 3 as in the source.
const PATIENCE: usize = 3;

/// What counts as a wrong sign, of the largest value: above the round-off of well-conditioned rows, far below the
/// default tolerance of an answer.
const WRONG: f64 = 1e-13;

/// A cold start takes the rows deeper than this share of the deepest. ½ is where the contact of a smooth body ends
/// (Hertz: a² = R d, while the bodies overlap up to 2 R d); blunter ones end deeper, a cone at 0.36.
const COLD_START_DEPTH: f64 = 0.5;

/// The active rows.
#[derive(Debug, Clone)]
pub(super) struct Basis {
    is_active: Vec<bool>,
    wrong: Vec<u32>,
    x: Vec<f64>,
}

impl Basis {
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            is_active: Vec::with_capacity(capacity),
            wrong: Vec::with_capacity(capacity),
            x: vec![0.0; capacity],
        }
    }

    /// The rows of the warm start; without one the deep rows. `scale`: size of each row.
    pub(super) fn start(&mut self, problem: &Problem, start: Start, scale: &[f64]) {
        let has_diagonal = |row: usize| problem.diagonal(row) > 0.0;
        match start {
            Start::Cold => {
                let depth = |row: usize| problem.q()[row] / scale[row];
                let deepest = (0..problem.m()).map(depth).fold(0.0, f64::min);
                let limit = COLD_START_DEPTH * deepest;
                self.start_from(problem.m(), |row| depth(row) < limit && has_diagonal(row));
            }
            Start::Rows(rows) => self.start_from(problem.m(), |i| rows[i] && has_diagonal(i)),
            // The rows are those of the last solve.
            Start::Kept => {}
        }
    }

    /// The rows with force.
    pub(super) fn start_from_forces(&mut self, z: &[f64]) {
        self.start_from(z.len(), |i| z[i] > 0.0);
    }

    /// No rows.
    pub(super) fn start_empty(&mut self, m: usize) {
        self.start_from(m, |_| false);
    }

    fn start_from(&mut self, m: usize, is_active: impl Fn(usize) -> bool) {
        self.is_active.clear();
        self.is_active.extend((0..m).map(is_active));
    }

    /// Of each row, whether it is active.
    pub(super) fn flags(&self) -> &[bool] {
        &self.is_active
    }

    pub(super) fn is_active(&self, row: usize) -> bool {
        self.is_active[row]
    }

    /// Takes a row in, or out.
    pub(super) fn exchange(&mut self, row: usize) {
        self.is_active[row] = !self.is_active[row];
    }
}

/// How pivoting ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// No row is wrong.
    Complementary,
    /// The budget ended first.
    Budget,
    /// A block could not be factorised: M is indefinite.
    Singular,
}

/// End and cost of a run of pivots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outcome {
    pub(super) end: End,
    /// Changes of the active set.
    pub(super) rounds: usize,
    /// Rows exchanged.
    pub(super) pivots: usize,
}

/// The problem `w = q - E center + (M + E) z` and its state.
pub(super) struct Work<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) settings: &'a Settings,
    pub(super) scale: &'a [f64],
    /// Power of two: scale² unit = diag(M).
    pub(super) unit: f64,
    /// Forces from which a solve starts; None: zero.
    pub(super) center: Option<&'a [f64]>,
    pub(super) basis: &'a mut Basis,
    pub(super) z: &'a mut [f64],
    pub(super) w: &'a mut [f64],
}

impl Work<'_> {
    /// Pivots until no row is wrong. Leaves z (active rows as solved, others 0) and w = q + M z.
    pub(super) fn block_pivoting(&mut self, factor: &mut Ldl, max_rounds: usize) -> Outcome {
        let mut outcome = Outcome {
            end: End::Complementary,
            rounds: 0,
            pivots: 0,
        };
        let mut fewest = usize::MAX;
        let mut patience = PATIENCE;
        let mut limits = self.limits();
        loop {
            if self.solve_active(factor).is_err() {
                outcome.end = End::Singular;
                return outcome;
            }
            self.forces_limit(&mut limits, factor);
            self.find_wrong(&limits);
            let n_wrong = self.basis.wrong.len();
            if n_wrong == 0 {
                return outcome;
            }
            if outcome.rounds == max_rounds || self.settings.is_over() {
                outcome.end = End::Budget;
                return outcome;
            }
            let mut n_exchanged = n_wrong;
            if n_wrong < fewest {
                fewest = n_wrong;
                patience = PATIENCE;
            } else if patience > 0 {
                patience -= 1;
            } else {
                n_exchanged = 1;
            }
            for position in n_wrong - n_exchanged..n_wrong {
                let row = self.basis.wrong[position];
                self.basis.exchange(row as usize);
            }
            outcome.pivots += n_exchanged;
            outcome.rounds += 1;
        }
    }

    /// z of the active rows from their zero gaps, then all gaps.
    pub(super) fn solve_active(&mut self, factor: &mut Ldl) -> Result<(), Singular> {
        let basis = &mut *self.basis;
        factor.update(self.problem, &basis.is_active)?;
        let x = &mut basis.x[..factor.rows().len()];
        // Forces of the active rows start from the centre; what is missing follows from the gaps left.
        let gaps = if let Some(center) = self.center {
            for ((z, &center), &is_active) in self.z.iter_mut().zip(center).zip(&basis.is_active) {
                *z = if is_active { center } else { 0.0 };
            }
            dense::gaps_into(self.problem, self.z, self.w);
            &*self.w
        } else {
            self.z.fill(0.0);
            self.problem.q()
        };
        for (x, &row) in x.iter_mut().zip(factor.rows()) {
            *x = -gaps[row as usize];
        }
        factor.solve(x);
        for (x, &row) in x.iter().zip(factor.rows()) {
            self.z[row as usize] += *x;
        }
        dense::gaps_into(self.problem, self.z, self.w);
        Ok(())
    }

    /// From where on a force or a gap is wrong, but for what depends on the forces.
    pub(super) fn limits(&self) -> Limits {
        let mut limits = Limits::default();
        for (&q, &scale) in self.problem.q().iter().zip(self.scale) {
            let q = q.abs();
            limits.w = limits.w.max(q);
            limits.w_scaled = limits.w_scaled.max(q / scale);
        }
        limits.w *= WRONG;
        limits.w_scaled *= WRONG;
        limits
    }

    /// The rest of [`Work::limits`], for the forces as they are.
    pub(super) fn forces_limit(&self, limits: &mut Limits, factor: &Ldl) {
        let (mut z_max, mut z_sum) = (0.0_f64, 0.0);
        for &row in factor.rows() {
            let z = (self.z[row as usize] * self.scale[row as usize]).abs();
            z_sum += z;
            z_max = z_max.max(z);
        }
        limits.regularisation = factor.regularisation();
        limits.z = WRONG * z_max;
        // w_i is a sum of terms up to sqrt(M_ii M_jj) z_j.
        limits.w_round_off = 8.0 * f64::EPSILON * z_sum * self.unit;
    }

    fn find_wrong(&mut self, limits: &Limits) {
        let mut wrong = std::mem::take(&mut self.basis.wrong);
        wrong.clear();
        for row in 0..self.problem.m() {
            if self.excess(limits, row) > 0.0 && self.may_be_active(row) {
                wrong.push(row as u32);
            }
        }
        self.basis.wrong = wrong;
    }

    /// By how much a row is wrong, scaled; not positive for a right one.
    pub(super) fn excess(&self, limits: &Limits, row: usize) -> f64 {
        let scale = self.scale[row];
        if self.basis.is_active[row] {
            return -self.z[row] * scale - limits.z;
        }
        let mut gap = self.w[row];
        if let Some(center) = self.center {
            gap -= limits.regularisation * self.problem.diagonal(row) * center[row];
        }
        if gap > 0.0 {
            // Right, and no division.
            return -gap;
        }
        let allowed = limits.w_scaled.min(limits.w / scale);
        -gap / scale - allowed - limits.w_round_off
    }

    /// Rows without stiffness of their own never carry force.
    pub(super) fn may_be_active(&self, row: usize) -> bool {
        self.problem.diagonal(row) > 0.0
    }
}

/// Tolerances of one state, see [`Work::limits`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Limits {
    regularisation: f64,
    z: f64,
    w: f64,
    w_scaled: f64,
    w_round_off: f64,
}

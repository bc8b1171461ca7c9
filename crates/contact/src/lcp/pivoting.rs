//! Block principal pivoting: guess which rows carry force, solve, exchange all wrong rows at once.
//!
//! Exchanging all is fast but may cycle; after [`PATIENCE`] rounds without progress only the last wrong row is
//! exchanged (Murty's rule), which cannot cycle on a matrix with positive principal minors.
//!
//! Source: Júdice and Pires (1994), Computers & Operations Research 21; Kim and Park (2011), SIAM J. Sci. Comput. 33.

use super::{Problem, dense};

/// Rounds that may exchange all wrong rows without lowering their number. 3 as in the source.
const PATIENCE: usize = 3;

/// What counts as wrong, of the largest value, no unit: above the round-off of well-conditioned rows, a thousand
/// times below the default tolerance of an answer.
const WRONG: f64 = 1e-13;

/// The active block has no inverse, or M is not what the method needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Singular;

/// A factorisation of M over the active rows.
pub(super) trait Factor {
    /// E / diag(M), added before factorising.
    const REGULARISATION: f64;

    /// Factorises the block of `rows`; the first `keep` are those of the last call.
    fn update(&mut self, problem: &Problem, rows: &[u32], keep: usize) -> Result<(), Singular>;

    /// x ← (M_FF + E)⁻¹ x.
    fn solve(&mut self, x: &mut [f64]);
}

/// The active rows, in the order in which they entered.
#[derive(Debug, Clone)]
pub(super) struct Basis {
    is_active: Vec<bool>,
    rows: Vec<u32>,
    /// Leading rows that have not changed since the last factorisation.
    keep: usize,
    x: Vec<f64>,
}

impl Basis {
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            is_active: Vec::with_capacity(capacity),
            rows: Vec::with_capacity(capacity),
            keep: 0,
            x: vec![0.0; capacity],
        }
    }

    /// The rows of the warm start; without one the closed rows.
    pub(super) fn start(&mut self, problem: &Problem, warm: Option<&[bool]>) {
        match warm {
            Some(warm) => self.start_from(problem.m(), |i| warm[i] && problem.diagonal(i) > 0.0),
            None => self.start_from(problem.m(), |i| {
                problem.q()[i] < 0.0 && problem.diagonal(i) > 0.0
            }),
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
        // Nothing of an earlier problem may show in the order of rows.
        self.rows.clear();
        self.keep = 0;
        self.collect();
    }

    pub(super) fn is_active(&self, row: usize) -> bool {
        self.is_active[row]
    }

    pub(super) fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Exchanges one row; [`Basis::collect`] must follow before the next factorisation.
    pub(super) fn exchange(&mut self, row: usize) {
        self.is_active[row] = !self.is_active[row];
    }

    /// Rows that stayed keep their order, new ones follow, so that the factorisation of the leading ones serves again.
    pub(super) fn collect(&mut self) {
        let is_active = &self.is_active;
        let unchanged = self.rows.iter().take_while(|&&row| is_active[row as usize]);
        self.keep = self.keep.min(unchanged.count());
        self.rows.retain(|&row| is_active[row as usize]);
        // Mark what is there already, by clearing and restoring its flag.
        for &row in &self.rows {
            self.is_active[row as usize] = false;
        }
        let n_kept = self.rows.len();
        for row in 0..self.is_active.len() {
            if self.is_active[row] {
                self.rows.push(row as u32);
            }
        }
        for &row in &self.rows[..n_kept] {
            self.is_active[row as usize] = true;
        }
    }
}

/// How pivoting ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// No row is wrong.
    Complementary,
    /// The budget ended first.
    Budget,
    /// A block could not be factorised.
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
    pub(super) scale: &'a [f64],
    /// Power of two: scale² unit = diag(M).
    pub(super) unit: f64,
    pub(super) center: &'a [f64],
    pub(super) basis: &'a mut Basis,
    pub(super) z: &'a mut [f64],
    pub(super) w: &'a mut [f64],
}

impl Work<'_> {
    /// Pivots until no row is wrong. Leaves z (active rows as solved, others 0) and w = q + M z.
    pub(super) fn block_pivoting(
        &mut self,
        factor: &mut impl Factor,
        max_rounds: usize,
    ) -> Outcome {
        let mut outcome = Outcome {
            end: End::Complementary,
            rounds: 0,
            pivots: 0,
        };
        let mut fewest = usize::MAX;
        let mut patience = PATIENCE;
        loop {
            if self.solve_active(factor).is_err() {
                outcome.end = End::Singular;
                return outcome;
            }
            let limits = self.limits(factor);
            let is_wrong = |work: &Self, row| work.excess(&limits, row) > 0.0;
            let m = self.problem.m();
            let n_wrong = (0..m).filter(|&row| is_wrong(self, row)).count();
            if n_wrong == 0 {
                return outcome;
            }
            if outcome.rounds == max_rounds {
                outcome.end = End::Budget;
                return outcome;
            }
            let mut one_only = false;
            if n_wrong < fewest {
                fewest = n_wrong;
                patience = PATIENCE;
            } else if patience > 0 {
                patience -= 1;
            } else {
                one_only = true;
            }
            for row in (0..m).rev() {
                // An exchange does not change what is wrong with the other rows: z and w stay.
                if is_wrong(self, row) && self.may_be_active(row) {
                    self.basis.exchange(row);
                    outcome.pivots += 1;
                    if one_only {
                        break;
                    }
                }
            }
            self.basis.collect();
            outcome.rounds += 1;
        }
    }

    /// z of the active rows from their zero gaps, then all gaps.
    pub(super) fn solve_active(&mut self, factor: &mut impl Factor) -> Result<(), Singular> {
        let basis = &mut *self.basis;
        factor.update(self.problem, &basis.rows, basis.keep)?;
        basis.keep = basis.rows.len();
        // Forces of the active rows start from the centre; what is missing follows from the gaps left.
        for row in 0..self.problem.m() {
            self.z[row] = if basis.is_active[row] {
                self.center[row]
            } else {
                0.0
            };
        }
        dense::gaps_into(self.problem, self.z, self.w);
        let x = &mut basis.x[..basis.rows.len()];
        for (x, &row) in x.iter_mut().zip(&basis.rows) {
            *x = -self.w[row as usize];
        }
        factor.solve(x);
        for (x, &row) in x.iter().zip(&basis.rows) {
            self.z[row as usize] += x;
        }
        dense::gaps_into(self.problem, self.z, self.w);
        Ok(())
    }

    /// From where on a force or a gap is wrong, for the forces as they are.
    pub(super) fn limits<F: Factor>(&self, _factor: &F) -> Limits {
        let mut limits = Limits {
            regularisation: F::REGULARISATION,
            ..Limits::default()
        };
        let mut z_sum = 0.0;
        for (row, &scale) in self.scale.iter().enumerate() {
            let z = (self.z[row] * scale).abs();
            z_sum += z;
            limits.z = limits.z.max(z);
            limits.w_scaled = limits.w_scaled.max((self.problem.q()[row] / scale).abs());
            limits.w = limits.w.max(self.problem.q()[row].abs());
        }
        limits.z *= WRONG;
        limits.w_scaled *= WRONG;
        limits.w *= WRONG;
        // w_i is a sum of terms up to sqrt(M_ii M_jj) z_j.
        limits.w_round_off = 8.0 * f64::EPSILON * z_sum * self.unit;
        limits
    }

    /// By how much a row is wrong, scaled; not positive for a right one.
    pub(super) fn excess(&self, limits: &Limits, row: usize) -> f64 {
        let scale = self.scale[row];
        if self.basis.is_active[row] {
            -self.z[row] * scale - limits.z
        } else {
            let regularisation = limits.regularisation * self.problem.diagonal(row);
            let gap = self.w[row] - regularisation * self.center[row];
            -gap / scale - limits.w_scaled.min(limits.w / scale) - limits.w_round_off
        }
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

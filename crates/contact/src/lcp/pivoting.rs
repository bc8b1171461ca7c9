//! Block principal pivoting: guess which rows carry force, solve, exchange all wrong rows at once.
//!
//! Exchanging all is fast but may cycle; after [`PATIENCE`] rounds without progress only the last wrong row is
//! exchanged (Murty's rule), which cannot cycle on a matrix with positive principal minors.
//!
//! Source: Júdice and Pires (1994), Computers & Operations Research 21; Kim and Park (2011), SIAM J. Sci. Comput. 33.

use super::{Problem, Scalar, Settings, Start, dense};

/// Rounds that may exchange all wrong rows without lowering their number. 3 as in the source.
const PATIENCE: usize = 3;

/// A cold start takes the rows deeper than this share of the deepest. ½ is where the contact of a smooth body ends
/// (Hertz: a² = R d, while the bodies overlap up to 2 R d); blunter ones end deeper, a cone at 0.36.
const COLD_START_DEPTH: f64 = 0.5;

/// The active block has no inverse, or M is not what the method needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Singular;

/// A factorisation of M over the active rows.
pub(super) trait Factor<T: Scalar> {
    /// E / diag(M), added before factorising.
    fn regularisation(&self) -> f64;

    /// The rows of the factor, in its order.
    fn rows(&self) -> &[u32];

    /// Makes it the factor of the active rows.
    fn update(&mut self, problem: &Problem<T>, is_active: &[bool]) -> Result<(), Singular>;

    /// x ← (M_FF + E)⁻¹ x, in the order of [`Factor::rows`].
    fn solve(&mut self, x: &mut [T]);
}

/// The active rows.
#[derive(Debug, Clone)]
pub(super) struct Basis<T> {
    is_active: Vec<bool>,
    wrong: Vec<u32>,
    x: Vec<T>,
}

impl<T: Scalar> Basis<T> {
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            is_active: Vec::with_capacity(capacity),
            wrong: Vec::with_capacity(capacity),
            x: vec![T::zero(); capacity],
        }
    }

    /// The rows of the warm start; without one the deep rows. `scale`: size of each row.
    pub(super) fn start(&mut self, problem: &Problem<T>, start: Start, scale: &[T]) {
        let has_diagonal = |row: usize| problem.diagonal(row) > T::zero();
        match start {
            Start::Cold => {
                let depth = |row: usize| problem.q()[row] / scale[row];
                let deepest = (0..problem.m())
                    .map(depth)
                    .fold(T::zero(), num_traits::Float::min);
                let limit = T::of(COLD_START_DEPTH) * deepest;
                self.start_from(problem.m(), |row| depth(row) < limit && has_diagonal(row));
            }
            Start::Rows(rows) => self.start_from(problem.m(), |i| rows[i] && has_diagonal(i)),
            // The rows are those of the last solve.
            Start::Kept => {}
        }
    }

    /// The rows with force.
    pub(super) fn start_from_forces(&mut self, z: &[T]) {
        self.start_from(z.len(), |i| z[i] > T::zero());
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
pub(super) struct Work<'a, T> {
    pub(super) problem: &'a Problem<'a, T>,
    pub(super) settings: &'a Settings,
    pub(super) scale: &'a [T],
    /// Power of two: scale² unit = diag(M).
    pub(super) unit: T,
    /// Forces from which a solve starts; None: zero.
    pub(super) center: Option<&'a [T]>,
    pub(super) basis: &'a mut Basis<T>,
    pub(super) z: &'a mut [T],
    pub(super) w: &'a mut [T],
}

impl<T: Scalar> Work<'_, T> {
    /// Pivots until no row is wrong. Leaves z (active rows as solved, others 0) and w = q + M z.
    pub(super) fn block_pivoting(
        &mut self,
        factor: &mut impl Factor<T>,
        max_rounds: usize,
    ) -> Outcome {
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
    pub(super) fn solve_active(&mut self, factor: &mut impl Factor<T>) -> Result<(), Singular> {
        let basis = &mut *self.basis;
        factor.update(self.problem, &basis.is_active)?;
        let x = &mut basis.x[..factor.rows().len()];
        // Forces of the active rows start from the centre; what is missing follows from the gaps left.
        let gaps = if let Some(center) = self.center {
            for ((z, &center), &is_active) in self.z.iter_mut().zip(center).zip(&basis.is_active) {
                *z = if is_active { center } else { T::zero() };
            }
            dense::gaps_into(self.problem, self.z, self.w);
            &*self.w
        } else {
            self.z.fill(T::zero());
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
    pub(super) fn limits(&self) -> Limits<T> {
        let mut limits = Limits::default();
        for (&q, &scale) in self.problem.q().iter().zip(self.scale) {
            let q = num_traits::Float::abs(q);
            limits.w = num_traits::Float::max(limits.w, q);
            limits.w_scaled = num_traits::Float::max(limits.w_scaled, q / scale);
        }
        limits.w *= T::of(T::WRONG);
        limits.w_scaled *= T::of(T::WRONG);
        limits
    }

    /// The rest of [`Work::limits`], for the forces as they are.
    pub(super) fn forces_limit(&self, limits: &mut Limits<T>, factor: &impl Factor<T>) {
        let (mut z_max, mut z_sum) = (T::zero(), T::zero());
        for &row in factor.rows() {
            let z = num_traits::Float::abs(self.z[row as usize] * self.scale[row as usize]);
            z_sum += z;
            z_max = num_traits::Float::max(z_max, z);
        }
        limits.regularisation = T::of(factor.regularisation());
        limits.z = T::of(T::WRONG) * z_max;
        // w_i is a sum of terms up to sqrt(M_ii M_jj) z_j.
        limits.w_round_off = T::of(8.0) * T::epsilon() * z_sum * self.unit;
    }

    fn find_wrong(&mut self, limits: &Limits<T>) {
        let mut wrong = std::mem::take(&mut self.basis.wrong);
        wrong.clear();
        for row in 0..self.problem.m() {
            if self.excess(limits, row) > T::zero() && self.may_be_active(row) {
                wrong.push(row as u32);
            }
        }
        self.basis.wrong = wrong;
    }

    /// By how much a row is wrong, scaled; not positive for a right one.
    pub(super) fn excess(&self, limits: &Limits<T>, row: usize) -> T {
        let scale = self.scale[row];
        if self.basis.is_active[row] {
            return -self.z[row] * scale - limits.z;
        }
        let mut gap = self.w[row];
        if let Some(center) = self.center {
            gap -= limits.regularisation * self.problem.diagonal(row) * center[row];
        }
        if gap > T::zero() {
            // Right, and no division.
            return -gap;
        }
        let allowed = num_traits::Float::min(limits.w_scaled, limits.w / scale);
        -gap / scale - allowed - limits.w_round_off
    }

    /// Rows without stiffness of their own never carry force.
    pub(super) fn may_be_active(&self, row: usize) -> bool {
        self.problem.diagonal(row) > T::zero()
    }
}

/// Tolerances of one state, see [`Work::limits`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits<T> {
    regularisation: T,
    z: T,
    w: T,
    w_scaled: T,
    w_round_off: T,
}

impl<T: Scalar> Default for Limits<T> {
    fn default() -> Self {
        Self {
            regularisation: T::zero(),
            z: T::zero(),
            w: T::zero(),
            w_scaled: T::zero(),
            w_round_off: T::zero(),
        }
    }
}

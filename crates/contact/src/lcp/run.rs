//! Which method is asked when, and what becomes of its answer.

use super::certificate::{self, proves_no_solution};
use super::ldl::Ldl;
use super::lu::Lu;
use super::{
    Method, Problem, Scratch, Settings, Status, active_set, dense, gauss_seidel, lemke, pivoting,
    scaling,
};

/// One solve: the problem and the counters.
pub(super) struct Run<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) settings: &'a Settings,
    pub(super) rounds: usize,
    pub(super) pivots: usize,
    pub(super) sweeps: usize,
}

impl Run<'_> {
    /// Writes z and w; the scratch is large enough.
    pub(super) fn solve(
        &mut self,
        scratch: &mut Scratch,
        warm: Option<&[bool]>,
        z: &mut [f64],
        w: &mut [f64],
    ) -> (Status, Method) {
        let problem = self.problem;
        z.fill(0.0);
        w.copy_from_slice(problem.q());
        if problem.q().iter().all(|&q| q >= 0.0) {
            return (Status::Solved, Method::Open);
        }
        // A closed row that no force opens is the simplest proof that there is no solution.
        if let Some(row) = self.closed_row_without_help() {
            scratch.trial[..problem.m()].fill(0.0);
            scratch.trial[row] = 1.0;
            if proves_no_solution(problem, &scratch.trial[..problem.m()]) {
                return (Status::NoSolution, Method::Open);
            }
        }
        let diagonal = scaling::row_scale_into(problem, &mut scratch.scale);
        scratch.unit = diagonal.unit;
        if problem.is_symmetric()
            && diagonal.is_semidefinite_diagonal
            && let Some(outcome) = self.semidefinite(scratch, warm, z, w)
        {
            return outcome;
        }
        self.general(scratch, warm, diagonal.is_positive_diagonal, z, w)
    }

    fn closed_row_without_help(&self) -> Option<usize> {
        let problem = self.problem;
        (0..problem.m()).find(|&i| {
            problem.q()[i] < 0.0
                && problem.diagonal(i) <= 0.0
                && (0..problem.m()).all(|j| problem.column(j)[i] <= 0.0)
        })
    }

    /// Symmetric M with a diagonal that may be semi-definite. None: it is indefinite after all.
    fn semidefinite(
        &mut self,
        scratch: &mut Scratch,
        warm: Option<&[bool]>,
        z: &mut [f64],
        w: &mut [f64],
    ) -> Option<(Status, Method)> {
        /// Proximal steps. The first removes the regularisation where M is well conditioned, two or three do
        /// on singular M; more are needed only close to infeasibility.
        const MAX_PROXIMAL_STEPS: usize = 12;
        /// Round-off: nothing left to gain.
        const GOAL: f64 = 2e-15;

        let problem = self.problem;
        let m = problem.m();
        let mut method = Method::BlockPivoting;
        let mut best = f64::INFINITY;
        scratch.best_z[..m].fill(0.0);
        scratch.center[..m].fill(0.0);
        scratch.basis.start(problem, warm);
        let mut factor = Ldl::new(&mut scratch.dense);
        self.rounds += 1;
        for _ in 0..=MAX_PROXIMAL_STEPS {
            let mut work = pivoting::Work {
                problem,
                scale: &scratch.scale[..m],
                unit: scratch.unit,
                center: &scratch.center[..m],
                basis: &mut scratch.basis,
                z,
                w,
            };
            let rounds_left = (self.settings.max_rounds + 1).saturating_sub(self.rounds);
            let mut outcome = work.block_pivoting(&mut factor, rounds_left);
            self.rounds += outcome.rounds;
            self.pivots += outcome.pivots;
            if outcome.end == pivoting::End::Budget {
                let pivots_left = self.settings.max_pivots.saturating_sub(self.pivots);
                let held = &mut scratch.trial[..m];
                outcome = active_set::solve(&mut work, &mut factor, held, pivots_left);
                self.pivots += outcome.pivots;
                method = Method::ActiveSet;
            }
            if outcome.end == pivoting::End::Singular {
                return None;
            }
            // The true gaps, of forces that are not negative.
            for z in z.iter_mut() {
                *z = z.max(0.0);
            }
            dense::gaps_into(problem, z, w);
            let residual = certificate::of(problem, z, w).natural_residual;
            let gained = residual < 0.5 * best;
            if residual < best {
                best = residual;
                scratch.best_z[..m].copy_from_slice(z);
            }
            if best <= GOAL || outcome.end == pivoting::End::Budget || !gained {
                break;
            }
            scratch.center[..m].copy_from_slice(z);
        }
        if best > self.settings.tolerance {
            // Forces that run away point along the proof that there is no solution.
            let steps = z.iter().zip(&scratch.center).map(|(z, center)| z - center);
            for (trial, step) in scratch.trial.iter_mut().zip(steps) {
                *trial = step.max(0.0);
            }
            if proves_no_solution(problem, &scratch.trial[..m]) || proves_no_solution(problem, z) {
                return Some((self.no_solution(z, w), method));
            }
        }
        z.copy_from_slice(&scratch.best_z[..m]);
        dense::gaps_into(problem, z, w);
        if best <= self.settings.tolerance {
            return Some((Status::Solved, method));
        }
        Some(self.gauss_seidel(scratch, best, z, w))
    }

    /// The last resort: sweeps from the best forces so far, then one direct solve on the rows they found.
    fn gauss_seidel(
        &mut self,
        scratch: &mut Scratch,
        best: f64,
        z: &mut [f64],
        w: &mut [f64],
    ) -> (Status, Method) {
        let problem = self.problem;
        let m = problem.m();
        let tolerance = self.settings.tolerance;
        self.sweeps += gauss_seidel::sweep(problem, self.settings.max_sweeps, tolerance, z, w);
        let mut residual = certificate::of(problem, z, w).natural_residual;
        scratch.trial[..m].copy_from_slice(z);
        scratch.center[..m].fill(0.0);
        scratch.basis.start_from_forces(z);
        for _ in 0..3 {
            let mut work = pivoting::Work {
                problem,
                scale: &scratch.scale[..m],
                unit: scratch.unit,
                center: &scratch.center[..m],
                basis: &mut scratch.basis,
                z,
                w,
            };
            work.block_pivoting(&mut Ldl::new(&mut scratch.dense), 1);
            for z in z.iter_mut() {
                *z = z.max(0.0);
            }
            dense::gaps_into(problem, z, w);
            let direct = certificate::of(problem, z, w).natural_residual;
            if direct >= residual {
                break;
            }
            residual = direct;
            scratch.trial[..m].copy_from_slice(z);
            scratch.center[..m].copy_from_slice(z);
            scratch.basis.start_from_forces(z);
        }
        let source = if best <= residual {
            &scratch.best_z
        } else {
            &scratch.trial
        };
        z.copy_from_slice(&source[..m]);
        dense::gaps_into(problem, z, w);
        let status = if best.min(residual) <= tolerance {
            Status::Solved
        } else {
            Status::Budget
        };
        (status, Method::GaussSeidel)
    }

    /// Any M: block pivoting if the diagonal is positive, then Lemke.
    fn general(
        &mut self,
        scratch: &mut Scratch,
        warm: Option<&[bool]>,
        is_positive_diagonal: bool,
        z: &mut [f64],
        w: &mut [f64],
    ) -> (Status, Method) {
        /// Times m: Lemke's method needs 1 to 3 times m, ten times that is a path of the exponential kind.
        const PIVOTS_BEFORE_NEW_START: usize = 20;

        let problem = self.problem;
        let m = problem.m();
        let tolerance = self.settings.tolerance;
        let mut best = f64::INFINITY;
        scratch.best_z[..m].fill(0.0);
        if is_positive_diagonal {
            scratch.basis.start(problem, warm);
            self.rounds += 1;
            let rounds_left = (self.settings.max_rounds + 1).saturating_sub(self.rounds);
            best = self.polish(scratch, rounds_left, z, w);
            if best <= tolerance {
                return (Status::Solved, Method::BlockPivoting);
            }
        }
        let pivots_left = self.settings.max_pivots.saturating_sub(self.pivots);
        let first_try = pivots_left.min(PIVOTS_BEFORE_NEW_START * m);
        let mut run_lemke = |start, max_pivots| {
            let outcome = lemke::solve(
                problem,
                start,
                max_pivots,
                &mut scratch.dense,
                &mut scratch.integers,
                &mut scratch.trial,
                z,
            );
            self.pivots += outcome.pivots;
            outcome.end
        };
        let mut end = run_lemke(lemke::Start::Even, first_try);
        if end == lemke::End::Budget {
            end = run_lemke(lemke::Start::Spread, pivots_left - first_try);
        }
        if end == lemke::End::Ray && proves_no_solution(problem, z) {
            return (self.no_solution(z, w), Method::Lemke);
        }
        if end == lemke::End::Complementary {
            // Lemke's own numbers first: its basis may be too ill-conditioned to be solved again.
            dense::gaps_into(problem, z, w);
            let residual = certificate::of(problem, z, w).natural_residual;
            if residual < best {
                best = residual;
                scratch.best_z[..m].copy_from_slice(z);
            }
            scratch.basis.start_from_forces(z);
            best = best.min(self.polish(scratch, 1, z, w));
        }
        z.copy_from_slice(&scratch.best_z[..m]);
        dense::gaps_into(problem, z, w);
        let status = match end {
            _ if best <= tolerance => Status::Solved,
            lemke::End::Ray => Status::Ray,
            _ => Status::Budget,
        };
        (status, Method::Lemke)
    }

    /// Block pivoting by LU from the basis as it stands, refined. Keeps an improvement in `best_z`.
    fn polish(
        &mut self,
        scratch: &mut Scratch,
        max_rounds: usize,
        z: &mut [f64],
        w: &mut [f64],
    ) -> f64 {
        let problem = self.problem;
        let m = problem.m();
        dense::gaps_into(problem, &scratch.best_z[..m], w);
        let mut best = certificate::of(problem, &scratch.best_z[..m], w).natural_residual;
        scratch.center[..m].fill(0.0);
        for step in 0..3 {
            let mut work = pivoting::Work {
                problem,
                scale: &scratch.scale[..m],
                unit: scratch.unit,
                center: &scratch.center[..m],
                basis: &mut scratch.basis,
                z,
                w,
            };
            let rounds = if step == 0 { max_rounds } else { 1 };
            let outcome = work.block_pivoting(&mut Lu::new(&mut scratch.dense), rounds);
            self.rounds += outcome.rounds;
            self.pivots += outcome.pivots;
            if outcome.end == pivoting::End::Singular {
                break;
            }
            for z in z.iter_mut() {
                *z = z.max(0.0);
            }
            dense::gaps_into(problem, z, w);
            let residual = certificate::of(problem, z, w).natural_residual;
            if residual >= best {
                break;
            }
            best = residual;
            scratch.best_z[..m].copy_from_slice(z);
            scratch.center[..m].copy_from_slice(z);
        }
        best
    }

    fn no_solution(&self, z: &mut [f64], w: &mut [f64]) -> Status {
        z.fill(0.0);
        w.copy_from_slice(self.problem.q());
        Status::NoSolution
    }
}

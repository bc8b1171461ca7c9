//! Which method is asked when, and what becomes of its answer.

use super::certificate::{self, proves_no_solution};
use super::ldl::Ldl;
use super::lu::Lu;
use super::pivoting::Work;
use super::{
    Certificate, Method, Problem, Scalar, Scratch, Settings, Solution, Start, Status, active_set,
    dense, gauss_seidel, lemke, pivoting, scaling,
};
use crate::error::Error;

/// Everything a solve is asked with, but where it starts and where it writes.
pub struct Request<'a, T: Scalar> {
    pub(super) problem: &'a Problem<'a, T>,
    pub(super) settings: &'a Settings,
    pub(super) scratch: &'a mut Scratch<T>,
    /// Which method alone; None: the chain that fits the problem.
    pub(super) only: Option<Method>,
}

/// Checks what the types cannot, and solves.
pub(super) fn solve<T: Scalar>(
    request: &mut Request<T>,
    start: Start,
    z: &mut [T],
    w: &mut [T],
) -> Result<Solution, Error> {
    let problem = request.problem;
    let m = problem.m();
    if m > request.scratch.capacity {
        return Err(Error::Capacity {
            rows: m,
            capacity: request.scratch.capacity,
        });
    }
    let n_start = match start {
        Start::Rows(rows) => rows.len(),
        Start::Cold | Start::Kept => m,
    };
    let lengths = [("z", z.len()), ("w", w.len()), ("the warm start", n_start)];
    for (what, actual) in lengths {
        if actual != m {
            return Err(Error::Length {
                what,
                expected: m,
                actual,
            });
        }
    }
    if matches!(request.only, Some(Method::ActiveSet | Method::GaussSeidel)) {
        problem.require_symmetric()?;
    }
    let mut run = Run {
        problem,
        settings: request.settings,
        rounds: 0,
        pivots: 0,
        sweeps: 0,
        certificate: None,
    };
    let (status, method) = run.solve(request.scratch, request.only, start, z, w);
    let certificate = run
        .certificate
        .unwrap_or_else(|| certificate::of(problem, z, w));
    Ok(Solution {
        status,
        method,
        certificate,
        rounds: run.rounds,
        pivots: run.pivots,
        sweeps: run.sweeps,
    })
}

/// One solve: the problem and the counters.
struct Run<'a, T: Scalar> {
    problem: &'a Problem<'a, T>,
    settings: &'a Settings,
    rounds: usize,
    pivots: usize,
    sweeps: usize,
    /// That of z and w, where it is known already.
    certificate: Option<Certificate>,
}

/// The best forces so far and how good they are.
struct Best<'a, T> {
    z: &'a mut [T],
    residual: f64,
}

impl<'a, T: Scalar> Best<'a, T> {
    /// No force, as good as nothing.
    fn none(z: &'a mut [T]) -> Self {
        z.fill(T::zero());
        Self {
            z,
            residual: f64::INFINITY,
        }
    }

    /// Whether z is better than all before; keeps it then.
    fn offer(&mut self, z: &[T], residual: f64) -> bool {
        let is_better = residual < self.residual;
        if is_better {
            self.residual = residual;
            self.z.copy_from_slice(z);
        }
        is_better
    }

    /// Writes the best forces and their gaps.
    fn give(&self, problem: &Problem<T>, z: &mut [T], w: &mut [T]) {
        z.copy_from_slice(self.z);
        dense::gaps_into(problem, z, w);
    }
}

impl<T: Scalar> Run<'_, T> {
    /// Writes z and w; the scratch is large enough.
    fn solve(
        &mut self,
        scratch: &mut Scratch<T>,
        only: Option<Method>,
        start: Start,
        z: &mut [T],
        w: &mut [T],
    ) -> (Status, Method) {
        let problem = self.problem;
        z.fill(T::zero());
        w.copy_from_slice(problem.q());
        if problem.q().iter().all(|&q| q >= T::zero()) {
            return (Status::Solved, Method::Open);
        }
        // A closed row that no force opens is the simplest proof that there is no solution.
        if let Some(row) = self.closed_row_without_help() {
            let proof = &mut scratch.trial[..problem.m()];
            proof.fill(T::zero());
            proof[row] = T::one();
            if proves_no_solution(problem, proof) {
                return (Status::NoSolution, Method::Open);
            }
        }
        let diagonal = scaling::row_scale_into(problem, &mut scratch.scale);
        scratch.unit = diagonal.unit;
        match only {
            Some(Method::Lemke) => return self.lemke(scratch, f64::INFINITY, z, w),
            Some(Method::GaussSeidel) => return self.gauss_seidel(scratch, z, w),
            _ => {}
        }
        if problem.is_symmetric()
            && diagonal.is_semidefinite_diagonal
            && let Some(outcome) = self.semidefinite(scratch, only, start, z, w)
        {
            return outcome;
        }
        if only == Some(Method::ActiveSet) {
            // Indefinite: not a problem for this method.
            z.fill(T::zero());
            w.copy_from_slice(problem.q());
            return (Status::Budget, Method::ActiveSet);
        }
        self.general(scratch, only, start, diagonal.is_positive_diagonal, z, w)
    }

    fn closed_row_without_help(&self) -> Option<usize> {
        let problem = self.problem;
        (0..problem.m()).find(|&i| {
            problem.q()[i] < T::zero()
                && problem.diagonal(i) <= T::zero()
                && (0..problem.m()).all(|j| problem.column(j)[i] <= T::zero())
        })
    }

    /// Symmetric M with a diagonal that may be semi-definite. None: it is indefinite after all.
    fn semidefinite(
        &mut self,
        scratch: &mut Scratch<T>,
        only: Option<Method>,
        start: Start,
        z: &mut [T],
        w: &mut [T],
    ) -> Option<(Status, Method)> {
        /// Proximal steps. The first removes the regularisation where M is well conditioned, two or three do
        /// on singular M; more are needed only close to infeasibility.
        const MAX_PROXIMAL_STEPS: usize = 12;

        let problem = self.problem;
        let m = problem.m();
        let may_keep = matches!(start, Start::Kept) && scratch.ldl.holds(m);
        let start = match start {
            Start::Kept if !may_keep => Start::Cold,
            start => start,
        };
        let mut method = Method::BlockPivoting;
        let mut best = Best::none(&mut scratch.best_z[..m]);
        let mut is_best_current = false;
        let mut last_certificate = Certificate::default();
        let mut is_first_step = true;
        scratch.basis.start(problem, start, &scratch.scale);
        let mut factor = if may_keep {
            Ldl::kept(&mut scratch.dense, &mut scratch.ldl, m)
        } else {
            Ldl::new(&mut scratch.dense, &mut scratch.ldl, m)
        };
        self.rounds += 1;
        for _ in 0..=MAX_PROXIMAL_STEPS {
            let mut work = Work {
                problem,
                settings: self.settings,
                scale: &scratch.scale[..m],
                unit: scratch.unit,
                center: (!is_first_step).then_some(&scratch.center[..m]),
                basis: &mut scratch.basis,
                z,
                w,
            };
            is_first_step = false;
            let rounds_left = (self.settings.max_rounds + 1).saturating_sub(self.rounds);
            let mut outcome = pivoting::Outcome {
                end: pivoting::End::Budget,
                rounds: 0,
                pivots: 0,
            };
            if only != Some(Method::ActiveSet) {
                outcome = work.block_pivoting(&mut factor, rounds_left);
            }
            self.rounds += outcome.rounds;
            self.pivots += outcome.pivots;
            if outcome.end == pivoting::End::Budget && only != Some(Method::BlockPivoting) {
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
            if clamp(z) {
                dense::gaps_into(problem, z, w);
            }
            let certificate = certificate::of(problem, z, w);
            let residual = certificate.natural_residual;
            let gained = residual < 0.5 * best.residual;
            is_best_current = best.offer(z, residual);
            last_certificate = certificate;
            if best.residual <= T::GOAL || outcome.end == pivoting::End::Budget || !gained {
                break;
            }
            scratch.center[..m].copy_from_slice(z);
        }
        if best.residual <= self.settings.tolerance {
            if is_best_current {
                self.certificate = Some(last_certificate);
            } else {
                best.give(problem, z, w);
            }
            return Some((Status::Solved, method));
        }
        if may_keep {
            // M is not what it was said to be, or the problem is hard: from the rows found, with their own factor.
            scratch.ldl.forget();
            return self.semidefinite(scratch, only, Start::Cold, z, w);
        }
        // Forces that run away point along the proof that there is no solution.
        let steps = z.iter().zip(&scratch.center);
        for (trial, (&z, &center)) in scratch.trial.iter_mut().zip(steps) {
            *trial = num_traits::Float::max(z - center, T::zero());
        }
        if proves_no_solution(problem, &scratch.trial[..m]) || proves_no_solution(problem, z) {
            return Some((self.no_solution(z, w), method));
        }
        best.give(problem, z, w);
        match only {
            None => Some(self.sweep_and_solve(scratch, z, w)),
            Some(_) => Some((Status::Budget, method)),
        }
    }

    /// Gauss-Seidel alone.
    fn gauss_seidel(
        &mut self,
        scratch: &mut Scratch<T>,
        z: &mut [T],
        w: &mut [T],
    ) -> (Status, Method) {
        let problem = self.problem;
        scratch.best_z[..problem.m()].fill(T::zero());
        self.sweeps += gauss_seidel::sweep(problem, self.settings, z, w);
        let residual = certificate::of(problem, z, w).natural_residual;
        if residual <= self.settings.tolerance {
            (Status::Solved, Method::GaussSeidel)
        } else {
            (Status::Budget, Method::GaussSeidel)
        }
    }

    /// The last resort: sweeps from the best forces so far, z, then one direct solve on the rows they found.
    fn sweep_and_solve(
        &mut self,
        scratch: &mut Scratch<T>,
        z: &mut [T],
        w: &mut [T],
    ) -> (Status, Method) {
        let problem = self.problem;
        let m = problem.m();
        let mut best = Best::none(&mut scratch.best_z[..m]);
        best.offer(z, certificate::of(problem, z, w).natural_residual);
        self.sweeps += gauss_seidel::sweep(problem, self.settings, z, w);
        best.offer(z, certificate::of(problem, z, w).natural_residual);
        scratch.basis.start_from_forces(z);
        for step in 0..3 {
            let mut work = Work {
                problem,
                settings: self.settings,
                scale: &scratch.scale[..m],
                unit: scratch.unit,
                center: (step > 0).then_some(&scratch.center[..m]),
                basis: &mut scratch.basis,
                z,
                w,
            };
            let mut factor = Ldl::new(&mut scratch.dense, &mut scratch.ldl, m);
            if work.block_pivoting(&mut factor, 1).end == pivoting::End::Singular {
                break;
            }
            clamp(z);
            dense::gaps_into(problem, z, w);
            if !best.offer(z, certificate::of(problem, z, w).natural_residual) {
                break;
            }
            scratch.center[..m].copy_from_slice(z);
            scratch.basis.start_from_forces(z);
        }
        best.give(problem, z, w);
        let status = if best.residual <= self.settings.tolerance {
            Status::Solved
        } else {
            Status::Budget
        };
        (status, Method::GaussSeidel)
    }

    /// Any M: block pivoting if the diagonal is positive, then Lemke.
    fn general(
        &mut self,
        scratch: &mut Scratch<T>,
        only: Option<Method>,
        start: Start,
        is_positive_diagonal: bool,
        z: &mut [T],
        w: &mut [T],
    ) -> (Status, Method) {
        let problem = self.problem;
        let m = problem.m();
        let start = match start {
            Start::Kept => Start::Cold,
            start => start,
        };
        let mut best = f64::INFINITY;
        scratch.best_z[..m].fill(T::zero());
        if is_positive_diagonal {
            scratch.basis.start(problem, start, &scratch.scale);
            self.rounds += 1;
            let rounds_left = (self.settings.max_rounds + 1).saturating_sub(self.rounds);
            best = self.polish(scratch, f64::INFINITY, rounds_left, z, w);
            if best <= self.settings.tolerance {
                z.copy_from_slice(&scratch.best_z[..m]);
                dense::gaps_into(problem, z, w);
                return (Status::Solved, Method::BlockPivoting);
            }
        }
        if only.is_some() {
            z.copy_from_slice(&scratch.best_z[..m]);
            dense::gaps_into(problem, z, w);
            return (Status::Budget, Method::BlockPivoting);
        }
        self.lemke(scratch, best, z, w)
    }

    /// Lemke's method; `best`: residual of the forces in `best_z`.
    fn lemke(
        &mut self,
        scratch: &mut Scratch<T>,
        best: f64,
        z: &mut [T],
        w: &mut [T],
    ) -> (Status, Method) {
        /// Times m: Lemke's method needs 1 to 3 times m, ten times that is a path of the exponential kind.
        const PIVOTS_BEFORE_NEW_START: usize = 20;

        let problem = self.problem;
        let m = problem.m();
        let mut best = best;
        if best == f64::INFINITY {
            scratch.best_z[..m].fill(T::zero());
        }
        scratch.ldl.forget();
        let pivots_left = self.settings.max_pivots.saturating_sub(self.pivots);
        let first_try = pivots_left.min(PIVOTS_BEFORE_NEW_START * m);
        let mut run_lemke = |weights, max_pivots| {
            let memory = lemke::Memory {
                tableau: &mut scratch.dense[..],
                integers: &mut scratch.integers[..],
                scale: &mut scratch.trial[..],
            };
            let settings = self.settings;
            let outcome = lemke::solve(problem, weights, max_pivots, settings, memory, z);
            self.pivots += outcome.pivots;
            outcome.end
        };
        let mut end = run_lemke(lemke::Weights::Even, first_try);
        if end == lemke::End::Budget {
            end = run_lemke(lemke::Weights::Spread, pivots_left - first_try);
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
            best = self.polish(scratch, best, 1, z, w);
        }
        z.copy_from_slice(&scratch.best_z[..m]);
        dense::gaps_into(problem, z, w);
        let status = match end {
            _ if best <= self.settings.tolerance => Status::Solved,
            lemke::End::Ray => Status::Ray,
            _ => Status::Budget,
        };
        (status, Method::Lemke)
    }

    /// Block pivoting by LU from the basis as it stands, refined. `best`: residual of the forces in `best_z`,
    /// which an improvement replaces. Returns the residual of the better ones.
    fn polish(
        &mut self,
        scratch: &mut Scratch<T>,
        best: f64,
        max_rounds: usize,
        z: &mut [T],
        w: &mut [T],
    ) -> f64 {
        let problem = self.problem;
        let m = problem.m();
        let mut best = best;
        scratch.ldl.forget();
        for step in 0..3 {
            let mut work = Work {
                problem,
                settings: self.settings,
                scale: &scratch.scale[..m],
                unit: scratch.unit,
                center: (step > 0).then_some(&scratch.center[..m]),
                basis: &mut scratch.basis,
                z,
                w,
            };
            let rounds = if step == 0 { max_rounds } else { 0 };
            let mut factor = Lu::new(&mut scratch.dense, &mut scratch.lu_rows);
            let outcome = work.block_pivoting(&mut factor, rounds);
            self.rounds += outcome.rounds;
            self.pivots += outcome.pivots;
            if outcome.end == pivoting::End::Singular {
                break;
            }
            if clamp(z) {
                dense::gaps_into(problem, z, w);
            }
            let residual = certificate::of(problem, z, w).natural_residual;
            if residual >= best {
                break;
            }
            best = residual;
            scratch.best_z[..m].copy_from_slice(z);
            if best <= T::GOAL {
                break;
            }
            scratch.center[..m].copy_from_slice(z);
        }
        best
    }

    fn no_solution(&self, z: &mut [T], w: &mut [T]) -> Status {
        z.fill(T::zero());
        w.copy_from_slice(self.problem.q());
        Status::NoSolution
    }
}

/// Sets negative forces to zero; whether there were any. NaN becomes zero as well.
fn clamp<T: Scalar>(z: &mut [T]) -> bool {
    let mut has_changed = false;
    for z in z {
        if *z < T::zero() || z.is_nan() {
            *z = T::zero();
            has_changed = true;
        }
    }
    has_changed
}

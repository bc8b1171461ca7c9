//! Which method is asked when, and what becomes of its answer.

use super::certificate::{self, proves_no_solution};
use super::ldl::Ldl;
use super::pivoting::{End, Work};
use super::{
    Certificate, Method, Problem, Scratch, Settings, Solution, Start, Status, active_set, dense,
    gauss_seidel, scaling,
};
use crate::error::Error;

/// Everything a solve is asked with, but where it starts and where it writes.
pub(super) struct Request<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) settings: &'a Settings,
    pub(super) scratch: &'a mut Scratch,
    /// Which method alone; None: the chain that fits the problem.
    pub(super) only: Option<Method>,
}

/// Checks what the types cannot, and solves.
pub(super) fn solve(
    request: &mut Request,
    start: Start,
    z: &mut [f64],
    w: &mut [f64],
) -> Result<Solution, Error> {
    let problem = request.problem;
    problem.require_symmetric()?;
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
struct Run<'a> {
    problem: &'a Problem<'a>,
    settings: &'a Settings,
    rounds: usize,
    pivots: usize,
    sweeps: usize,
    /// That of z and w, where it is known already.
    certificate: Option<Certificate>,
}

/// The best forces so far and how good they are.
struct Best<'a> {
    z: &'a mut [f64],
    residual: f64,
}

impl<'a> Best<'a> {
    /// No force, as good as nothing.
    fn none(z: &'a mut [f64]) -> Self {
        z.fill(0.0);
        Self {
            z,
            residual: f64::INFINITY,
        }
    }

    /// Whether z is better than all before; keeps it then.
    fn offer(&mut self, z: &[f64], residual: f64) -> bool {
        let is_better = residual < self.residual;
        if is_better {
            self.residual = residual;
            self.z.copy_from_slice(z);
        }
        is_better
    }

    /// Writes the best forces and their gaps.
    fn give(&self, problem: &Problem, z: &mut [f64], w: &mut [f64]) {
        z.copy_from_slice(self.z);
        dense::gaps_into(problem, z, w);
    }
}

impl Run<'_> {
    /// Writes z and w; the scratch is large enough.
    fn solve(
        &mut self,
        scratch: &mut Scratch,
        only: Option<Method>,
        start: Start,
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
            let proof = &mut scratch.trial[..problem.m()];
            proof.fill(0.0);
            proof[row] = 1.0;
            if proves_no_solution(problem, proof) {
                return (Status::NoSolution, Method::Open);
            }
        }
        let diagonal = scaling::row_scale_into(problem, &mut scratch.scale);
        scratch.unit = diagonal.unit;
        if only == Some(Method::GaussSeidel) {
            return self.gauss_seidel(scratch, z, w);
        }
        if diagonal.may_be_semidefinite
            && let Some(outcome) = self.semidefinite(scratch, only, start, z, w)
        {
            return outcome;
        }
        // No method is made for it, but sweeps from the best answer so far may end at a solution.
        match only {
            None => match self.sweep_and_solve(scratch, z, w) {
                (Status::Budget, method) => (Status::Indefinite, method),
                outcome => outcome,
            },
            Some(method) => (Status::Indefinite, method),
        }
    }

    fn closed_row_without_help(&self) -> Option<usize> {
        let problem = self.problem;
        (0..problem.m()).find(|&i| {
            problem.q()[i] < 0.0
                && problem.diagonal(i) <= 0.0
                && (0..problem.m()).all(|j| problem.column(j)[i] <= 0.0)
        })
    }

    /// M with a diagonal that may be semi-definite. None: it is indefinite after all, z is the best so far.
    fn semidefinite(
        &mut self,
        scratch: &mut Scratch,
        only: Option<Method>,
        start: Start,
        z: &mut [f64],
        w: &mut [f64],
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
        // Of z, where it is the best.
        let mut certificate_of_best = None;
        let (mut is_first_step, mut is_indefinite) = (true, false);
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
            let held = &mut scratch.trial[..m];
            let (end, by) = self.pivot(&mut work, &mut factor, held, only);
            if by == Method::ActiveSet {
                method = by;
            }
            if end == End::Singular {
                (is_indefinite, certificate_of_best) = (true, None);
                break;
            }
            // The true gaps, of forces that are not negative.
            if clamp(z) {
                dense::gaps_into(problem, z, w);
            }
            let certificate = certificate::of(problem, z, w);
            let residual = certificate.natural_residual;
            let gained = residual < 0.5 * best.residual;
            certificate_of_best = best.offer(z, residual).then_some(certificate);
            if best.residual <= certificate::GOAL || end == End::Budget || !gained {
                break;
            }
            scratch.center[..m].copy_from_slice(z);
        }
        if best.residual <= self.settings.tolerance {
            if certificate_of_best.is_none() {
                best.give(problem, z, w);
            }
            self.certificate = certificate_of_best;
            return Some((Status::Solved, method));
        }
        if may_keep {
            // M is not what it was said to be, or the problem is hard: from the rows found, with their own factor.
            scratch.ldl.forget();
            return self.semidefinite(scratch, only, Start::Cold, z, w);
        }
        if is_indefinite {
            best.give(problem, z, w);
            return None;
        }
        Some(self.unsolved(scratch, only, method, z, w))
    }

    /// The proof that there is no solution, along which forces run away; without one the best forces seen.
    fn unsolved(
        &mut self,
        scratch: &mut Scratch,
        only: Option<Method>,
        method: Method,
        z: &mut [f64],
        w: &mut [f64],
    ) -> (Status, Method) {
        let problem = self.problem;
        let m = problem.m();
        let steps = z.iter().zip(&scratch.center);
        for (trial, (&z, &center)) in scratch.trial.iter_mut().zip(steps) {
            *trial = (z - center).max(0.0);
        }
        if proves_no_solution(problem, &scratch.trial[..m]) || proves_no_solution(problem, z) {
            z.fill(0.0);
            w.copy_from_slice(problem.q());
            return (Status::NoSolution, method);
        }
        z.copy_from_slice(&scratch.best_z[..m]);
        dense::gaps_into(problem, z, w);
        if only.is_some() {
            return (Status::Budget, method);
        }
        if method == Method::BlockPivoting {
            // Blocks may end where round-off hides what is wrong.
            let only = Some(Method::ActiveSet);
            if let Some((Status::Solved, method)) =
                self.semidefinite(scratch, only, Start::Cold, z, w)
            {
                return (Status::Solved, method);
            }
        }
        self.sweep_and_solve(scratch, z, w)
    }

    /// Block pivoting, then single pivots where it did not end well; how and by which method it ended.
    /// `held`: scratch of m.
    ///
    /// Blocks take rows that depend on one another, whose pivots may be round-off of round-off: only single pivots,
    /// which take no such row of a semi-definite M, can say that M is indefinite.
    fn pivot(
        &mut self,
        work: &mut Work,
        factor: &mut Ldl,
        held: &mut [f64],
        only: Option<Method>,
    ) -> (End, Method) {
        if only != Some(Method::ActiveSet) {
            let rounds_left = (self.settings.max_rounds + 1).saturating_sub(self.rounds);
            let outcome = work.block_pivoting(factor, rounds_left);
            self.rounds += outcome.rounds;
            self.pivots += outcome.pivots;
            if outcome.end == End::Complementary || only.is_some() {
                return (outcome.end, Method::BlockPivoting);
            }
            factor.restart(work.problem.m());
        }
        let pivots_left = self.settings.max_pivots.saturating_sub(self.pivots);
        let outcome = active_set::solve(work, factor, held, pivots_left);
        self.pivots += outcome.pivots;
        (outcome.end, Method::ActiveSet)
    }

    /// Gauss-Seidel alone.
    fn gauss_seidel(
        &mut self,
        scratch: &mut Scratch,
        z: &mut [f64],
        w: &mut [f64],
    ) -> (Status, Method) {
        let problem = self.problem;
        scratch.best_z[..problem.m()].fill(0.0);
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
        scratch: &mut Scratch,
        z: &mut [f64],
        w: &mut [f64],
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
            if work.block_pivoting(&mut factor, 1).end == End::Singular {
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
}

/// Sets negative forces to zero; whether there were any. NaN becomes zero as well.
fn clamp(z: &mut [f64]) -> bool {
    let mut has_changed = false;
    for z in z {
        if *z < 0.0 || z.is_nan() {
            *z = 0.0;
            has_changed = true;
        }
    }
    has_changed
}

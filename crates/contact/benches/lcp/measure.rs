//! Times of methods and peers on one problem.

use std::time::Instant;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT};
use contact::lcp::{
    ActiveSet, Automatic, GaussSeidel, Problem, Scratch, Settings, Solution, Solver, Start,
};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Mat, Par, Spec};

/// Each time is the median of as many runs as fit into this, s; of 5 at least.
const BUDGET_S: f64 = 0.1;

/// What is known about one problem; times in µs.
pub(crate) struct Row {
    pub(crate) m: usize,
    pub(crate) n_active: usize,
    pub(crate) all_rows: f64,
    pub(crate) active_rows: f64,
    pub(crate) cold: f64,
    pub(crate) cold_solution: Solution,
    /// From the rows of the answer itself: what is left when nothing changed.
    pub(crate) warm: f64,
    pub(crate) active_set: f64,
    pub(crate) active_set_pivots: usize,
    pub(crate) gauss_seidel: Option<(f64, usize)>,
    pub(crate) clarabel: Option<f64>,
}

pub(crate) fn row(matrix: &[f64], q: &[f64]) -> Row {
    /// Rows up to which the slow ones are asked.
    const SLOW: usize = 500;
    let m = q.len();
    let settings = Settings {
        max_sweeps: 200_000,
        ..Settings::default()
    };
    let mut scratch = Scratch::new(m);
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    let mut run = |solver: &dyn Solver, start: Start, z: &mut [f64]| -> Solution {
        // The check of the data is part of the time.
        let problem = Problem::trusted_symmetric(matrix, q).unwrap();
        let solution = solver.solve(&problem, &settings, &mut scratch, start, z, &mut w);
        solution.unwrap()
    };
    let mut timed = |solver: &dyn Solver, start: Start| {
        let solution = run(solver, start, &mut z);
        let time = median_us(|| {
            run(solver, start, &mut z);
        });
        (time, solution, z.clone())
    };
    let (cold, cold_solution, forces) = timed(&Automatic, Start::Cold);
    let is_active: Vec<bool> = forces.iter().map(|z| *z > 0.0).collect();
    let (warm, ..) = timed(&Automatic, Start::Rows(&is_active));
    let (active_set, by_pivots, _) = timed(&ActiveSet, Start::Cold);
    let gauss_seidel = (m < SLOW).then(|| timed(&GaussSeidel, Start::Cold));
    let active: Vec<usize> = (0..m).filter(|i| is_active[*i]).collect();
    let all: Vec<usize> = (0..m).collect();
    Row {
        m,
        n_active: active.len(),
        all_rows: cholesky_us(matrix, m, &all),
        active_rows: cholesky_us(matrix, m, &active),
        cold,
        cold_solution,
        warm,
        active_set,
        active_set_pivots: by_pivots.pivots,
        gauss_seidel: gauss_seidel.map(|(time, solution, _)| (time, solution.sweeps)),
        clarabel: (m < SLOW).then(|| clarabel_us(matrix, q)),
    }
}

/// Means over a sequence; times in µs.
pub(crate) struct SequenceRow {
    pub(crate) name: String,
    pub(crate) m: usize,
    pub(crate) n_active: f64,
    pub(crate) all_rows: f64,
    pub(crate) active_rows: f64,
    pub(crate) cold: Means,
    pub(crate) warm: Means,
    pub(crate) kept: Means,
}

pub(crate) struct Means {
    pub(crate) time: f64,
    pub(crate) rounds: f64,
    pub(crate) pivots: f64,
}

pub(crate) fn sequence(name: &str, matrix: &[f64], steps: &[Vec<f64>]) -> SequenceRow {
    let m = steps[0].len();
    let settings = Settings::default();
    let mut scratch = Scratch::new(m);
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    let mut rows = vec![false; m];
    // 0: cold, 1: from the rows of the step before, 2: from its factor as well.
    let mut walk = |way: usize| {
        let (mut rounds, mut pivots, mut times) = (0, 0, vec![]);
        let (mut n_active, mut floor) = (0, 0.0);
        for pass in 0..20 {
            rows.fill(false);
            for (step, q) in steps.iter().enumerate() {
                let begun = Instant::now();
                let problem = Problem::trusted_symmetric(matrix, q).unwrap();
                let start = match way {
                    0 => Start::Cold,
                    _ if step == 0 => Start::Cold,
                    1 => Start::Rows(&rows),
                    _ => Start::Kept,
                };
                let solution = solve(&problem, &settings, &mut scratch, start, &mut z, &mut w);
                if step > 0 {
                    times.push(1e6 * begun.elapsed().as_secs_f64());
                }
                for (row, z) in rows.iter_mut().zip(&z) {
                    *row = *z > 0.0;
                }
                if pass == 0 && step > 0 {
                    rounds += solution.rounds;
                    pivots += solution.pivots;
                    let active: Vec<usize> = (0..m).filter(|i| rows[*i]).collect();
                    n_active += active.len();
                    if way == 0 && step % 10 == 0 {
                        floor += cholesky_us(matrix, m, &active) / 2.0;
                    }
                }
            }
        }
        let n = (steps.len() - 1) as f64;
        let means = Means {
            time: median(&mut times),
            rounds: rounds as f64 / n,
            pivots: pivots as f64 / n,
        };
        (means, n_active as f64 / n, floor)
    };
    let (cold, n_active, active_rows) = walk(0);
    let (warm, ..) = walk(1);
    let (kept, ..) = walk(2);
    let all: Vec<usize> = (0..m).collect();
    SequenceRow {
        name: name.to_owned(),
        m,
        n_active,
        all_rows: cholesky_us(matrix, m, &all),
        active_rows,
        cold,
        warm,
        kept,
    }
}

fn solve(
    problem: &Problem,
    settings: &Settings,
    scratch: &mut Scratch,
    start: Start,
    z: &mut [f64],
    w: &mut [f64],
) -> Solution {
    contact::lcp::solve(problem, settings, scratch, start, z, w).unwrap()
}

/// One dense Cholesky factorisation of these rows, by faer, on one thread, in memory that is there already.
///
/// Where that memory happens to lie changes the time of middle sizes by a factor of three: the fastest of five places.
fn cholesky_us(matrix: &[f64], m: usize, rows: &[usize]) -> f64 {
    let n = rows.len();
    let mut places = Vec::new();
    let times = (0..5).map(|_| {
        let block = Mat::from_fn(n, n, |r, c| matrix[rows[c] * m + rows[r]]);
        let mut factor = block.clone();
        let need = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default());
        let mut memory = MemBuffer::new(need);
        let time = median_us(|| {
            factor.copy_from(&block);
            let (factor, stack) = (factor.as_mut(), MemStack::new(&mut memory));
            let regularisation = llt::factor::LltRegularization::default();
            llt::factor::cholesky_in_place(
                factor,
                regularisation,
                Par::Seq,
                stack,
                Spec::default(),
            )
            .unwrap();
        });
        // Kept, so that the next one lies elsewhere.
        places.push((block, factor));
        time
    });
    times.fold(f64::INFINITY, f64::min)
}

/// min ½ zᵀ M z + qᵀ z over z ≥ 0 at Clarabel's default accuracy, from its set-up on.
fn clarabel_us(matrix: &[f64], q: &[f64]) -> f64 {
    let m = q.len();
    let (mut starts, mut rows, mut values) = (vec![0], vec![], vec![]);
    for j in 0..m {
        rows.extend(0..=j);
        values.extend_from_slice(&matrix[j * m..=j * m + j]);
        starts.push(rows.len());
    }
    let energy = CscMatrix::new(m, m, starts, rows, values);
    let mut bounds = CscMatrix::identity(m);
    bounds.nzval.fill(-1.0);
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .build()
        .unwrap();
    median_us(|| {
        let (zero, cone) = (vec![0.0; m], [NonnegativeConeT(m)]);
        let mut solver =
            DefaultSolver::new(&energy, q, &bounds, &zero, &cone, settings.clone()).unwrap();
        solver.solve();
        std::hint::black_box(&solver.solution.x);
    })
}

fn median_us(mut run: impl FnMut()) -> f64 {
    run();
    let begun = Instant::now();
    let mut times = Vec::new();
    while times.len() < 5 || begun.elapsed().as_secs_f64() < BUDGET_S {
        let begun = Instant::now();
        run();
        times.push(1e6 * begun.elapsed().as_secs_f64());
    }
    median(&mut times)
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

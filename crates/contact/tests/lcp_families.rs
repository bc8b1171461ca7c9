//! Hard families of problems, each by every method that is made for it, and against an independent QP solver.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/lemke.rs"]
mod lemke;
#[path = "support/numbers.rs"]
mod numbers;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};
use contact::lcp::{
    ActiveSet, Automatic, BlockPivoting, GaussSeidel, Problem, Scratch, Settings, Solution, Solver,
    Start, Status, check, solve,
};
use lemke::lemke;
use numbers::{Numbers, distance, max_abs};

impl Numbers {
    fn take(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }

    /// A Aᵀ of rank at most `rank`, exactly symmetric.
    fn gram(&mut self, m: usize, rank: usize) -> Vec<f64> {
        let a = self.take(m * rank);
        symmetric(m, |i, j| {
            (0..rank)
                .map(|k| a[i * rank + k] * a[j * rank + k])
                .sum::<f64>()
                / m as f64
        })
    }

    fn definite(&mut self, m: usize) -> Vec<f64> {
        let mut matrix = self.gram(m, m);
        for i in 0..m {
            matrix[i * m + i] += 0.05;
        }
        matrix
    }
}

fn symmetric(m: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let mut matrix = vec![0.0; m * m];
    for i in 0..m {
        for j in 0..=i {
            (matrix[j * m + i], matrix[i * m + j]) = (entry(i, j), entry(i, j));
        }
    }
    matrix
}

fn product(matrix: &[f64], z: &[f64]) -> Vec<f64> {
    let m = z.len();
    (0..m)
        .map(|i| (0..m).map(|j| matrix[j * m + i] * z[j]).sum())
        .collect()
}

struct Answer {
    solution: Solution,
    z: Vec<f64>,
    w: Vec<f64>,
}

fn run(solver: &dyn Solver, matrix: &[f64], q: &[f64], settings: &Settings) -> Answer {
    let problem = Problem::new(matrix, q).unwrap();
    let mut scratch = Scratch::new(q.len());
    let (mut z, mut w) = (q.to_vec(), q.to_vec());
    let solution = solver
        .solve(
            &problem,
            settings,
            &mut scratch,
            Start::Cold,
            &mut z,
            &mut w,
        )
        .unwrap();
    Answer { solution, z, w }
}

/// Solved by `solver`, by its own word and by the independent check.
fn solved(solver: &dyn Solver, matrix: &[f64], q: &[f64], case: &str) -> Answer {
    let answer = run(solver, matrix, q, &Settings::default());
    let certificate = check(&Problem::new(matrix, q).unwrap(), &answer.z).unwrap();
    let case = format!(
        "{case}, {}: {:?}, {certificate:?}",
        solver.name(),
        answer.solution
    );
    assert_eq!(answer.solution.status, Status::Solved, "{case}");
    assert!(certificate.natural_residual <= 1e-10, "{case}");
    assert!(answer.z.iter().all(|z| *z >= 0.0), "{case}");
    answer
}

/// All exact methods and the oracle give the same gaps; `max_z_error` compares the forces too.
fn all_agree(matrix: &[f64], q: &[f64], max_z_error: Option<f64>, case: &str) -> Answer {
    let first = solved(&Automatic, matrix, q, case);
    let others: [&dyn Solver; 2] = [&BlockPivoting, &ActiveSet];
    let others = others.map(|solver| (solver.name(), solved(solver, matrix, q, case).z));
    let oracle = [("the oracle", lemke(matrix, q).unwrap())];
    for (name, z) in others.into_iter().chain(oracle) {
        let certificate = check(&Problem::new(matrix, q).unwrap(), &z).unwrap();
        assert!(
            certificate.natural_residual <= 1e-10,
            "{case}, {name}: {certificate:?}"
        );
        let w: Vec<f64> = product(matrix, &z)
            .iter()
            .zip(q)
            .map(|(p, q)| p + q)
            .collect();
        let w_error = distance(&first.w, &w) / max_abs(q).max(f64::MIN_POSITIVE);
        assert!(w_error <= 1e-9, "{case}, {name}: gaps {w_error:e}");
        if let Some(max) = max_z_error {
            let size = max_abs(&first.z).max(f64::MIN_POSITIVE);
            let z_error = distance(&first.z, &z) / size;
            assert!(z_error <= max, "{case}, {name}: forces {z_error:e}");
        }
    }
    first
}

/// min ½ zᵀ M z + qᵀ z over z ≥ 0 by an interior-point method that shares nothing with ours.
fn clarabel(matrix: &[f64], q: &[f64]) -> Vec<f64> {
    let m = q.len();
    let columns = |lower: bool| {
        let (mut starts, mut rows, mut values) = (vec![0], vec![], vec![]);
        for j in 0..m {
            for i in 0..=j {
                if lower || i == j {
                    rows.push(i);
                    values.push(if lower { matrix[j * m + i] } else { -1.0 });
                }
            }
            starts.push(rows.len());
        }
        CscMatrix::new(m, m, starts, rows, values)
    };
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .build()
        .unwrap();
    let mut solver = DefaultSolver::new(
        &columns(true),
        q,
        &columns(false),
        &vec![0.0; m],
        &[NonnegativeConeT(m)],
        settings,
    )
    .unwrap();
    solver.solve();
    assert_eq!(solver.solution.status, SolverStatus::Solved);
    solver.solution.x
}

#[test]
fn positive_definite_agrees_with_an_interior_point_method() {
    let mut numbers = Numbers(1);
    for m in [1, 2, 5, 12, 30, 60] {
        for _ in 0..5 {
            let matrix = numbers.definite(m);
            let q = numbers.take(m);
            let ours = all_agree(&matrix, &q, Some(1e-9), "definite");
            let theirs: Vec<f64> = clarabel(&matrix, &q).iter().map(|z| z.max(0.0)).collect();
            let energy = |z: &[f64]| -> f64 {
                let pushed = product(&matrix, z);
                (0..m).map(|i| z[i] * (0.5 * pushed[i] + q[i])).sum()
            };
            let above = energy(&theirs) - energy(&ours.z);
            let scale = energy(&theirs).abs() + 1.0;
            assert!(above >= -1e-12 * scale, "ours is not the least: {above:e}");
            assert!(above <= 1e-6 * scale, "{m} rows: {above:e} of {scale:e}");
            // ½ λ_min |Δz|² is at most what an energy is above the least one.
            let apart = distance(&ours.z, &theirs);
            assert!(0.5 * 0.05 * apart * apart <= above + 1e-14 * scale);
        }
    }
}

#[test]
fn rows_of_all_scales_are_solved() {
    let mut numbers = Numbers(2);
    for m in [3, 12, 40] {
        for _ in 0..5 {
            let matrix = numbers.definite(m);
            let q = numbers.take(m);
            let plain = solved(&Automatic, &matrix, &q, "before scaling");
            // Rows from 1e-9 to 1e3: another unit in each row.
            let unit: Vec<f64> = (0..m)
                .map(|_| 10_f64.powf(6.0 * numbers.next() - 3.0))
                .collect();
            let scaled = symmetric(m, |i, j| unit[i] * matrix[j * m + i] * unit[j]);
            let scaled_q: Vec<f64> = q.iter().zip(&unit).map(|(q, u)| q * u).collect();
            let answer = solved(&Automatic, &scaled, &scaled_q, "scaled");
            let back: Vec<f64> = answer.z.iter().zip(&unit).map(|(z, u)| z * u).collect();
            let error = distance(&back, &plain.z) / max_abs(&plain.z).max(1e-6);
            assert!(error < 1e-9, "{m} rows: {error:e}");
        }
    }
}

#[test]
fn semidefinite_rows_repeated_and_dependent_are_solved_by_every_method() {
    let mut numbers = Numbers(3);
    for m in [2, 10, 30] {
        for rank in [1, 3, m / 2 + 1] {
            let matrix = numbers.gram(m, rank);
            let load = numbers.take(m);
            // In the range of M, so that there is a solution.
            let q = product(&matrix, &load);
            let case = format!("rank {rank} of {m}");
            all_agree(&matrix, &q, None, &case);
            let twice = symmetric(2 * m, |i, j| matrix[(j % m) * m + i % m]);
            let q_twice: Vec<f64> = (0..2 * m).map(|i| q[i % m]).collect();
            let repeated = all_agree(&twice, &q_twice, None, &format!("{case}, each twice"));
            assert!(distance(&repeated.w[..m], &repeated.w[m..]) <= 1e-9 * max_abs(&q));
        }
    }
}

#[test]
fn nearly_parallel_normals_and_hilbert_matrices_are_solved() {
    for angle in [1e-2, 1e-4, 1e-6, 1e-8, 0.0] {
        for m in [2, 8, 25] {
            // Normals in a fan around z, a compliance with a stiff and two soft directions.
            let normal = |i: usize| {
                let (a, b) = (angle * i as f64, angle * (i * i % 7) as f64);
                let length = (1.0 + a * a + b * b).sqrt();
                [a / length, b / length, 1.0 / length]
            };
            let matrix = symmetric(m, |i, j| {
                let (a, b) = (normal(i), normal(j));
                3e-4 * a[0] * b[0] + 2e-4 * a[1] * b[1] + 1e-6 * a[2] * b[2]
            });
            let push = [2e-5, -1e-5, 1e-4];
            let q: Vec<f64> = (0..m)
                .map(|i| -(0..3).map(|k| normal(i)[k] * push[k]).sum::<f64>())
                .collect();
            all_agree(&matrix, &q, None, &format!("{m} normals within {angle:e}"));
        }
    }
    for m in 2..=12 {
        let hilbert = symmetric(m, |i, j| 1.0 / (i + j + 1) as f64);
        let alternating: Vec<f64> = (0..m)
            .map(|i| if i % 2 == 0 { -1.0 } else { 0.5 })
            .collect();
        solved(&Automatic, &hilbert, &alternating, &format!("Hilbert {m}"));
        solved(&ActiveSet, &hilbert, &alternating, &format!("Hilbert {m}"));
    }
}

#[test]
fn gaps_that_just_touch_need_no_force_and_stay_closed() {
    let mut numbers = Numbers(4);
    for m in [1, 6, 20] {
        let matrix = numbers.definite(m);
        // z > 0 in the first third; the others closed without force, half of them, or open.
        let z: Vec<f64> = (0..m)
            .map(|i| {
                if i % 3 == 0 {
                    1.0 + numbers.next().abs()
                } else {
                    0.0
                }
            })
            .collect();
        let w: Vec<f64> = (0..m).map(|i| if i % 3 == 2 { 1.0 } else { 0.0 }).collect();
        let q: Vec<f64> = product(&matrix, &z)
            .iter()
            .zip(&w)
            .map(|(p, w)| w - p)
            .collect();
        let answer = all_agree(&matrix, &q, Some(1e-9), "just touching");
        assert!(distance(&answer.z, &z) < 1e-10 * max_abs(&z));
        let all_zero = solved(&Automatic, &matrix, &vec![0.0; m], "zero gaps");
        assert!(all_zero.z.iter().all(|z| *z == 0.0));
    }
}

#[test]
fn kept_factor_gives_the_answers_of_a_cold_start() {
    let mut numbers = Numbers(7);
    for (m, rank) in [(1, 1), (10, 10), (40, 40), (40, 9), (90, 90)] {
        let matrix = if rank == m {
            numbers.definite(m)
        } else {
            numbers.gram(m, rank)
        };
        let mut load = numbers.take(m);
        let settings = Settings::default();
        let mut scratch = Scratch::new(m);
        let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
        for step in 0..30 {
            for load in &mut load {
                *load += 0.05 * numbers.next();
            }
            let q = product(&matrix, &load);
            let problem = Problem::symmetric(&matrix, &q).unwrap();
            let solution = solve(
                &problem,
                &settings,
                &mut scratch,
                Start::Kept,
                &mut z,
                &mut w,
            )
            .unwrap();
            assert_eq!(
                solution.status,
                Status::Solved,
                "step {step} of rank {rank} of {m}"
            );
            let cold = solved(&Automatic, &matrix, &q, "cold");
            let allowed = 1e-9 * max_abs(&q);
            assert!(
                distance(&w, &cold.w) <= allowed,
                "step {step} of rank {rank} of {m}"
            );
        }
    }
}

#[test]
fn kept_factor_of_another_matrix_is_found_out() {
    let mut numbers = Numbers(8);
    for m in [5, 30] {
        let mut scratch = Scratch::new(m);
        let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
        for _ in 0..10 {
            let (matrix, q) = (numbers.definite(m), numbers.take(m));
            let problem = Problem::symmetric(&matrix, &q).unwrap();
            let settings = Settings::default();
            let solution = solve(
                &problem,
                &settings,
                &mut scratch,
                Start::Kept,
                &mut z,
                &mut w,
            )
            .unwrap();
            assert_eq!(solution.status, Status::Solved);
            let cold = solved(&Automatic, &matrix, &q, "cold");
            assert!(distance(&z, &cold.z) <= 1e-9 * max_abs(&cold.z));
        }
    }
}

/// A row appended to the factor of a stiffer, singular matrix leaves a negative pivot: that does not make M indefinite.
#[test]
fn kept_factor_of_a_singular_matrix_does_not_make_the_next_one_indefinite() {
    let singular = [0.1, 0.1, 0.0, 0.1, 0.1, 0.0, 0.0, 0.0, 0.1];
    let definite = [2.0, 0.5, 0.9, 0.5, 2.0, 0.9, 0.9, 0.9, 1.0];
    let mut scratch = Scratch::new(3);
    let (mut z, mut w) = ([0.0; 3], [0.0; 3]);
    for (matrix, q) in [
        (singular, [-1.0, -1.0, 1.0]),
        (definite, [-1.0, -1.0, -20.0]),
    ] {
        let problem = Problem::symmetric(&matrix, &q).unwrap();
        let (settings, start) = (Settings::default(), Start::Kept);
        let solution = solve(&problem, &settings, &mut scratch, start, &mut z, &mut w).unwrap();
        assert_eq!(solution.status, Status::Solved);
        assert!(solution.certificate.natural_residual <= 1e-10);
        assert_eq!(solution.sweeps, 0, "{solution:?}");
    }
}

#[test]
fn gauss_seidel_converges_and_a_spent_budget_is_flagged() {
    let mut numbers = Numbers(10);
    let (matrix, q) = (numbers.definite(15), numbers.take(15));
    let generous = Settings {
        max_sweeps: 100_000,
        ..Settings::default()
    };
    let swept = run(&GaussSeidel, &matrix, &q, &generous);
    assert_eq!(swept.solution.status, Status::Solved);
    let direct = solved(&Automatic, &matrix, &q, "direct");
    assert!(distance(&swept.z, &direct.z) <= 1e-7 * max_abs(&direct.z));
    let tight = Settings {
        max_sweeps: 1,
        max_rounds: 0,
        max_pivots: 1,
        ..Settings::default()
    };
    let solvers: [&dyn Solver; 3] = [&GaussSeidel, &ActiveSet, &BlockPivoting];
    for solver in solvers {
        let spent = run(solver, &matrix, &q, &tight);
        assert_eq!(spent.solution.status, Status::Budget, "{}", solver.name());
        assert!(spent.solution.certificate.natural_residual > 1e-10);
        assert!(spent.z.iter().all(|z| z.is_finite() && *z >= 0.0));
    }
}

/// 2^m - 1 pivots for the rule of the last row. Source: Murty (1988), chapter 6.
fn murty(m: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; m * m];
    for j in 0..m {
        matrix[j * m + j] = 1.0;
        for i in j + 1..m {
            matrix[j * m + i] = 2.0;
        }
    }
    matrix
}

/// Murty's matrix times its transpose: symmetric and as bad. Source: Fathi (1979).
fn fathi(m: usize) -> Vec<f64> {
    let l = murty(m);
    symmetric(m, |i, j| (0..m).map(|k| l[k * m + i] * l[k * m + j]).sum())
}

#[test]
fn worst_cases_hit_a_small_budget_and_are_flagged() {
    let mut numbers = Numbers(11);
    let settings = Settings {
        max_rounds: 4,
        max_pivots: 4,
        max_sweeps: 4,
        ..Settings::default()
    };
    let mut n_flagged = 0;
    for m in [10, 20, 40] {
        // The second is singular: its proximal steps need rounds, too.
        for matrix in [fathi(m), numbers.gram(m, m / 2)] {
            for _ in 0..5 {
                let q = product(&matrix, &numbers.take(m));
                let answer = run(&Automatic, &matrix, &q, &settings);
                let certificate = check(&Problem::new(&matrix, &q).unwrap(), &answer.z).unwrap();
                let is_solved = certificate.natural_residual <= 1e-10;
                assert_eq!(answer.solution.status == Status::Solved, is_solved);
                assert!(answer.z.iter().all(|z| z.is_finite() && *z >= 0.0));
                assert!(answer.w.iter().all(|w| w.is_finite()));
                // Work stays within the budget: a round moves at most all rows, what the sweeps found gets one more.
                let (rounds, pivots) = (answer.solution.rounds, answer.solution.pivots);
                assert!(rounds <= settings.max_rounds + 2, "{rounds} rounds");
                assert!(
                    pivots <= rounds * m + settings.max_pivots,
                    "{pivots} pivots"
                );
                assert!(answer.solution.sweeps <= settings.max_sweeps);
                n_flagged += usize::from(!is_solved);
            }
        }
    }
    assert!(n_flagged >= 10, "{n_flagged} of 30");
}

/// As a compliance that is kept in 32 bits: its rounding may take a singular M below semi-definite.
#[test]
fn singular_matrix_spoilt_by_rounding_is_flagged_and_solved_with_a_little_give() {
    let mut numbers = Numbers(12);
    let mut n_flagged = 0;
    for m in [4, 12, 30] {
        for rank in [1, 2, m / 2, m - 1] {
            for _ in 0..5 {
                let exact = numbers.gram(m, rank);
                let q = product(&exact, &numbers.take(m));
                let mut matrix: Vec<f64> = exact.iter().map(|x| f64::from(*x as f32)).collect();
                let answer = run(&Automatic, &matrix, &q, &Settings::default());
                assert!(answer.z.iter().chain(&answer.w).all(|x| x.is_finite()));
                match answer.solution.status {
                    Status::Solved => continue,
                    Status::Indefinite => n_flagged += 1,
                    // Of the rounded matrix that may be true.
                    status => assert_eq!(status, Status::NoSolution, "rank {rank} of {m}"),
                }
                for i in 0..m {
                    matrix[i * m + i] *= 1.001;
                }
                solved(&Automatic, &matrix, &q, "with a little give");
            }
        }
    }
    assert!(n_flagged >= 10, "{n_flagged} of 60");
}

#[test]
fn indefinite_matrix_is_flagged_by_every_pivoting_method() {
    // Forces that push each other on: the sweeps run away.
    for push in [2.0, 1e3] {
        let matrix = [1.0, -push, -push, 1.0];
        let solvers: [&dyn Solver; 3] = [&Automatic, &BlockPivoting, &ActiveSet];
        for solver in solvers {
            let answer = run(solver, &matrix, &[-1.0, -1.0], &Settings::default());
            let name = solver.name();
            assert_eq!(answer.solution.status, Status::Indefinite, "{name}");
            assert!(answer.z.iter().all(|z| z.is_finite() && *z >= 0.0));
        }
    }
}

#[test]
fn deadline_in_the_past_ends_every_method_at_once_with_a_flag() {
    let m = 24;
    let fathi = fathi(m);
    let q: Vec<f64> = (0..m)
        .map(|i| if i % 2 == 0 { -1.0 } else { -0.3 })
        .collect();
    let settings = Settings {
        deadline: Some(std::time::Instant::now()),
        ..Settings::default()
    };
    let solvers: [&dyn Solver; 4] = [&Automatic, &BlockPivoting, &ActiveSet, &GaussSeidel];
    for solver in solvers {
        let answer = run(solver, &fathi, &q, &settings);
        // The first guess, or the chain's last resort, one direct solve, may still hit.
        let is_solved = answer.solution.certificate.natural_residual <= 1e-10;
        let is_chain = solver.name() == "automatic";
        assert!(is_chain || solver.name() == "block pivoting" || !is_solved);
        assert_eq!(answer.solution.status == Status::Solved, is_solved);
        assert!(answer.solution.pivots <= m && answer.solution.sweeps == 0);
        assert!(answer.z.iter().chain(&answer.w).all(|x| x.is_finite()));
    }
}

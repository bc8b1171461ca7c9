//! Random problems against slow independent answers, relations between problems, and each guard once.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/lemke.rs"]
mod lemke;

use contact::Error;
use contact::lcp::{
    GaussSeidel, Method, Problem, Scratch, Settings, Solution, Solver, Start, Status, check, solve,
};
use lemke::lemke;
use proptest::prelude::*;

struct Answer {
    solution: Solution,
    z: Vec<f64>,
    w: Vec<f64>,
}

fn answer(matrix: &[f64], q: &[f64], settings: &Settings, warm: Option<&[bool]>) -> Answer {
    let problem = Problem::new(matrix, q).unwrap();
    let m = q.len();
    // A dirty, larger scratch: nothing of an earlier problem may show.
    let mut scratch = Scratch::new(m + 3);
    let (mut z, mut w) = (vec![f64::NAN; m], vec![f64::NAN; m]);
    let junk_q = vec![-1.0; m + 3];
    let junk: Vec<f64> = (0..(m + 3) * (m + 3))
        .map(|k| if k % (m + 4) == 0 { 3.0 } else { 0.1 })
        .collect();
    let junk = Problem::new(&junk, &junk_q).unwrap();
    let (mut junk_z, mut junk_w) = (vec![0.0; m + 3], vec![0.0; m + 3]);
    solve(
        &junk,
        settings,
        &mut scratch,
        Start::Cold,
        &mut junk_z,
        &mut junk_w,
    )
    .unwrap();
    let start = warm.map_or(Start::Cold, Start::Rows);
    let solution = solve(&problem, settings, &mut scratch, start, &mut z, &mut w).unwrap();
    // The solver's own certificate and the public check agree, whatever the outcome.
    let independent = check(&problem, &z).unwrap();
    let difference = independent.natural_residual - solution.certificate.natural_residual;
    // Two orders of summation of m terms.
    let terms = m as f64 * max_abs(matrix) * max_abs(&z) / max_abs(q).max(f64::MIN_POSITIVE);
    assert!(
        difference.abs() <= 4.0 * f64::EPSILON * (1.0 + terms),
        "{solution:?} but {independent:?}"
    );
    Answer { solution, z, w }
}

fn cold(matrix: &[f64], q: &[f64]) -> Answer {
    answer(matrix, q, &Settings::default(), None)
}

/// A Aᵀ, exactly symmetric, of rank at most `rank`.
fn gram(m: usize, rank: usize, numbers: &[f64]) -> Vec<f64> {
    let a = |i: usize, k: usize| numbers[(i * rank + k) % numbers.len()];
    let mut matrix = vec![0.0; m * m];
    for i in 0..m {
        for j in 0..=i {
            let entry = (0..rank).map(|k| a(i, k) * a(j, k)).sum();
            matrix[i * m + j] = entry;
            matrix[j * m + i] = entry;
        }
    }
    matrix
}

fn add_to_diagonal(matrix: &mut [f64], m: usize, value: f64) {
    for i in 0..m {
        matrix[i * m + i] += value;
    }
}

/// Solves A x = b by Gauss's elimination with exchanges; None if singular.
fn eliminate(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        if a[pivot][k].abs() < 1e-13 {
            return None;
        }
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            let pivot_row = a[k].clone();
            for (entry, pivot) in a[i].iter_mut().zip(&pivot_row).skip(k) {
                *entry -= factor * pivot;
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            b[k] -= a[k][j] * b[j];
        }
        b[k] /= a[k][k];
    }
    Some(b)
}

/// Tries all 2^m active sets; the one whose forces and gaps are least negative.
fn exhaustive(matrix: &[f64], q: &[f64]) -> Option<Vec<f64>> {
    let m = q.len();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for set in 0..1_u32 << m {
        let rows: Vec<usize> = (0..m).filter(|i| set >> i & 1 == 1).collect();
        let block = rows
            .iter()
            .map(|&i| rows.iter().map(|&j| matrix[j * m + i]).collect())
            .collect();
        let Some(forces) = eliminate(block, rows.iter().map(|&i| -q[i]).collect()) else {
            continue;
        };
        let mut z = vec![0.0; m];
        for (&row, &force) in rows.iter().zip(&forces) {
            z[row] = force;
        }
        let worst = (0..m).map(|i| {
            let w = q[i] + (0..m).map(|j| matrix[j * m + i] * z[j]).sum::<f64>();
            if set >> i & 1 == 1 { z[i] } else { w }
        });
        let worst = worst.fold(f64::INFINITY, f64::min);
        if best.as_ref().is_none_or(|(value, _)| worst > *value) {
            best = Some((worst, z));
        }
    }
    best.filter(|(worst, _)| *worst > -1e-9).map(|(_, z)| z)
}

fn max_abs(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max: f64, x| max.max(x.abs()))
}

/// `n` numbers from -1 to 1 out of one seed, so that a failure prints the seed and not the numbers.
fn numbers(n: usize) -> impl Strategy<Value = Numbers> + use<> {
    any::<u64>().prop_map(move |seed| {
        let mut state = seed;
        let values = std::iter::repeat_with(|| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        });
        Numbers {
            seed,
            values: values.skip(3).take(n).collect(),
        }
    })
}

struct Numbers {
    seed: u64,
    values: Vec<f64>,
}

impl std::fmt::Debug for Numbers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "seed {}", self.seed)
    }
}

impl std::ops::Deref for Numbers {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        &self.values
    }
}

/// The three ways through the symmetric solver.
fn ways() -> [Settings; 2] {
    [
        Settings::default(),
        Settings {
            max_rounds: 0,
            ..Settings::default()
        },
    ]
}

proptest! {
    // Failures are mended and get a test of their own, not a file of seeds.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The answer is unique, so every method and every warm start must find it.
    #[test]
    fn positive_definite_has_the_answer_of_exhaustive_search(
        m in 1..=12_usize,
        entries in numbers(168),
        q in numbers(12),
        warm in prop::collection::vec(any::<bool>(), 12),
    ) {
        let mut matrix = gram(m, m + 2, &entries);
        add_to_diagonal(&mut matrix, m, 0.05);
        let (q, warm) = (&q[..m], &warm[..m]);
        let expected = exhaustive(&matrix, q).unwrap();
        for settings in ways() {
            for warm in [None, Some(warm)] {
                let answer = answer(&matrix, q, &settings, warm);
                prop_assert_eq!(answer.solution.status, Status::Solved);
                prop_assert!(answer.solution.certificate.natural_residual < 1e-13);
                for (z, expected) in answer.z.iter().zip(&expected) {
                    prop_assert!((z - expected).abs() < 1e-9 * max_abs(&expected_or_one(&answer.z)));
                }
            }
        }
    }

    /// Singular M with q in its range: w is unique, z is not; q out of its range may have no solution, then
    /// exhaustive search finds none either.
    #[test]
    fn semidefinite_has_the_gaps_of_exhaustive_search(
        m in 2..=8_usize,
        rank in 1..=3_usize,
        entries in numbers(40),
        load in numbers(8),
        is_in_range in any::<bool>(),
    ) {
        let matrix = gram(m, rank, &entries);
        let q: Vec<f64> = if is_in_range {
            (0..m).map(|i| (0..m).map(|j| matrix[j * m + i] * load[j]).sum()).collect()
        } else {
            load[..m].to_vec()
        };
        for settings in ways() {
            let answer = answer(&matrix, &q, &settings, None);
            match exhaustive(&matrix, &q) {
                Some(z) => {
                    // Problems that are nearly without solution are not asked.
                    if max_abs(&z) < 1e4 {
                        prop_assert_eq!(answer.solution.status, Status::Solved, "{:?}", answer.solution);
                        for i in 0..m {
                            let w = q[i] + (0..m).map(|j| matrix[j * m + i] * z[j]).sum::<f64>();
                            prop_assert!((answer.w[i] - w).abs() < 1e-8);
                        }
                    }
                }
                None => prop_assert!(answer.solution.status != Status::Solved || max_abs(&answer.z) > 1e4),
            }
        }
    }

    /// The oracle of other tests. Positive definite but unsymmetric: unique as well.
    #[test]
    fn lemke_has_the_answer_of_exhaustive_search_for_unsymmetric_problems(
        m in 1..=8_usize,
        entries in numbers(120),
        skew in numbers(64),
        q in numbers(8),
    ) {
        let mut matrix = gram(m, m + 2, &entries);
        add_to_diagonal(&mut matrix, m, 0.05);
        for i in 0..m {
            for j in 0..i {
                matrix[i * m + j] += skew[i * 8 + j];
                matrix[j * m + i] -= skew[i * 8 + j];
            }
        }
        let q = &q[..m];
        let expected = exhaustive(&matrix, q).unwrap();
        let found = lemke(&matrix, q).unwrap();
        let problem = Problem::new(&matrix, q).unwrap();
        prop_assert!(check(&problem, &found).unwrap().natural_residual < 1e-12);
        for (z, expected) in found.iter().zip(&expected) {
            prop_assert!((z - expected).abs() < 1e-9 * max_abs(&expected_or_one(&found)));
        }
    }

    /// Larger random problems: solved by the certificate, gaps unique however started, also with repeated rows.
    #[test]
    fn large_problems_are_solved_to_round_off(
        m in 20..=60_usize,
        rank in 5..=80_usize,
        entries in numbers(997),
        load in numbers(60),
        warm in prop::collection::vec(any::<bool>(), 60),
    ) {
        let matrix = gram(m, rank, &entries);
        let q: Vec<f64> =
            (0..m).map(|i| (0..m).map(|j| matrix[j * m + i] * load[j]).sum()).collect();
        let first = cold(&matrix, &q);
        let second = answer(&matrix, &q, &Settings::default(), Some(&warm[..m]));
        // Sums of forces that are large beside the gaps leave their round-off in them.
        let forces = max_abs(&first.z).max(max_abs(&second.z));
        let scale = (max_abs(&matrix) * forces / max_abs(&q)).max(1.0);
        for answer in [&first, &second] {
            prop_assert_eq!(answer.solution.status, Status::Solved, "{:?}", answer.solution);
            prop_assert!(
                answer.solution.certificate.natural_residual < 1e-11 * scale,
                "{:?}, forces {scale:e} times the gaps", answer.solution
            );
        }
        for (a, b) in first.w.iter().zip(&second.w) {
            prop_assert!((a - b).abs() < 1e-9 * scale * max_abs(&q), "{a} and {b}, forces {scale:e} times the gaps");
        }
    }

    /// Other units by powers of two: same bits.
    #[test]
    fn units_by_powers_of_two_give_the_same_bits(
        m in 1..=30_usize,
        rank in 3..=40_usize,
        entries in numbers(499),
        q in numbers(30),
        compliance_exponent in -60..60_i32,
        gap_exponent in -60..60_i32,
    ) {
        let mut matrix = gram(m, rank, &entries);
        add_to_diagonal(&mut matrix, m, 1e-3);
        let q = &q[..m];
        let (compliance, gap) = (2.0_f64.powi(compliance_exponent), 2.0_f64.powi(gap_exponent));
        let scaled_matrix: Vec<f64> = matrix.iter().map(|x| x * compliance).collect();
        let scaled_q: Vec<f64> = q.iter().map(|x| x * gap).collect();
        let here = cold(&matrix, q);
        let there = cold(&scaled_matrix, &scaled_q);
        prop_assert_eq!(here.solution.rounds, there.solution.rounds);
        for i in 0..m {
            prop_assert_eq!((here.z[i] / compliance * gap).to_bits(), there.z[i].to_bits());
            prop_assert_eq!((here.w[i] * gap).to_bits(), there.w[i].to_bits());
        }
    }
}

fn expected_or_one(z: &[f64]) -> [f64; 2] {
    [1.0, max_abs(z)]
}

/// 2 below the diagonal: 2^m - 1 pivots for the least-index rule. Source: Murty (1988), chapter 6.
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

/// Murty's matrix times its transpose: symmetric positive definite and as bad. Source: Fathi (1979).
fn fathi(m: usize) -> Vec<f64> {
    let l = murty(m);
    let mut matrix = vec![0.0; m * m];
    for i in 0..m {
        for j in 0..m {
            matrix[j * m + i] = (0..m).map(|k| l[k * m + i] * l[k * m + j]).sum();
        }
    }
    matrix
}

#[test]
fn exponential_problems_of_any_order_stay_within_the_budget() {
    for m in [10, 30, 60, 100] {
        for reversed in [false, true] {
            let mut matrix = fathi(m);
            if reversed {
                matrix.reverse();
            }
            let answer = cold(&matrix, &vec![-1.0; m]);
            let case = format!("fathi {m} {reversed}: {:?}", answer.solution);
            assert_eq!(answer.solution.status, Status::Solved, "{case}");
            assert!(
                answer.solution.certificate.natural_residual < 1e-10,
                "{case}"
            );
        }
    }
}

#[test]
fn small_budget_degrades_and_says_so() {
    let m = 40;
    let numbers: Vec<f64> = (0..1600).map(|k| ((k * k) as f64 * 1.7).sin()).collect();
    let mut matrix = gram(m, m, &numbers);
    add_to_diagonal(&mut matrix, m, 1e-3);
    let q: Vec<f64> = (0..m).map(|i| (i as f64 * 2.3).sin()).collect();
    let settings = Settings {
        max_rounds: 1,
        max_pivots: 0,
        max_sweeps: 2,
        ..Settings::default()
    };
    let answer = answer(&matrix, &q, &settings, None);
    assert_eq!(answer.solution.status, Status::Budget);
    assert_eq!(answer.solution.method, Method::GaussSeidel);
    assert_eq!(answer.solution.sweeps, 2);
    assert!(answer.solution.certificate.natural_residual > 1e-10);
    assert!(answer.z.iter().all(|z| z.is_finite() && *z >= 0.0));
}

#[test]
fn gauss_seidel_alone_converges_on_contact_like_problems() {
    let m = 25;
    // Compliance falls off with distance, as that of an elastic part.
    let matrix: Vec<f64> = (0..m * m)
        .map(|k| (-((k / m) as f64 - (k % m) as f64).abs() / 3.0).exp())
        .collect();
    let q: Vec<f64> = (0..m)
        .map(|i| 0.01 * ((i as f64 - 12.0).powi(2) - 30.0))
        .collect();
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    let problem = Problem::symmetric(&matrix, &q).unwrap();
    let mut scratch = Scratch::new(m);
    let settings = Settings::default();
    let solution = GaussSeidel
        .solve(
            &problem,
            &settings,
            &mut scratch,
            Start::Cold,
            &mut z,
            &mut w,
        )
        .unwrap();
    assert_eq!(
        (solution.status, solution.method),
        (Status::Solved, Method::GaussSeidel)
    );
    let direct = cold(&matrix, &q);
    for (a, b) in z.iter().zip(&direct.z) {
        assert!((a - b).abs() < 1e-9 * max_abs(&direct.z));
    }
}

#[test]
fn same_row_with_different_gaps_is_carried_by_the_deepest() {
    let answer = cold(&[1.0; 9], &[-1.0, -3.0, -2.0]);
    assert_eq!(answer.solution.status, Status::Solved);
    assert!((answer.z[1] - 3.0).abs() < 1e-12);
    assert_eq!((answer.z[0], answer.z[2]), (0.0, 0.0));
    assert!((answer.w[0] - 2.0).abs() < 1e-12);
}

#[test]
fn problems_without_solution_are_proved_to_have_none() {
    let cases: [(&[f64], &[f64]); 5] = [
        // w_1 + w_2 = -2.
        (&[1.0, -1.0, -1.0, 1.0], &[-1.0, -1.0]),
        // The same with a difference that forces could move about.
        (&[1.0, -1.0, -1.0, 1.0], &[3.0, -4.0]),
        // A closed row that no force opens.
        (&[1.0, 0.0, 0.0, 0.0], &[-1.0, -1.0]),
        (&[0.0], &[-1e-9]),
        (&[-1.0, 0.0, 0.0, -1.0], &[-1.0, -1.0]),
    ];
    for (matrix, q) in cases {
        let answer = cold(matrix, q);
        assert_eq!(
            answer.solution.status,
            Status::NoSolution,
            "{matrix:?} {q:?}"
        );
        assert!(answer.z.iter().all(|&z| z == 0.0));
        assert_eq!(answer.w, q);
    }
    // A wedge: three normals that close round the tool, all pressed, with no compliance along what they share.
    let normals = [
        (1.0, 0.0),
        (-0.5, 0.75_f64.sqrt()),
        (-0.5, -(0.75_f64.sqrt())),
    ];
    let mut matrix = vec![0.0; 9];
    for (i, a) in normals.iter().enumerate() {
        for (j, b) in normals.iter().enumerate() {
            matrix[j * 3 + i] = a.0 * b.0 + a.1 * b.1;
        }
    }
    assert_eq!(
        cold(&matrix, &[-1e-4; 3]).solution.status,
        Status::NoSolution
    );
    assert_eq!(
        cold(&matrix, &[-1e-4, -1e-4, 3e-4]).solution.status,
        Status::Solved
    );
}

#[test]
fn indefinite_problem_with_a_solution_is_solved_by_sweeps() {
    // Strictly copositive, eigenvalues 3 and -1: what the sweeps find is a solution.
    let answer = cold(&[1.0, 2.0, 2.0, 1.0], &[-1.0, -1.0]);
    assert_eq!(answer.solution.status, Status::Solved);
    assert!(answer.solution.certificate.natural_residual < 1e-14);
}

#[test]
fn empty_and_open_problems_cost_nothing() {
    let none = cold(&[], &[]);
    assert_eq!(
        (none.solution.status, none.solution.method),
        (Status::Solved, Method::Open)
    );
    assert_eq!(none.solution.certificate.natural_residual, 0.0);
    let open = cold(&[1.0, 0.0, 0.0, 1.0], &[0.0, 2.0]);
    assert_eq!(open.w, [0.0, 2.0]);
    assert_eq!(open.solution.rounds, 0);
}

#[test]
fn forces_beyond_the_range_of_numbers_are_not_given_out() {
    let matrix = [1e-300, 0.0, 0.0, 1.0];
    let answer = cold(&matrix, &[-1e300, -1.0]);
    assert_eq!(answer.solution.status, Status::Budget);
    assert!(answer.z.iter().chain(&answer.w).all(|x| x.is_finite()));
}

#[test]
fn wrong_input_is_an_error_with_the_numbers() {
    let length = Problem::new(&[1.0, 2.0], &[1.0]).unwrap_err();
    assert!(matches!(
        length,
        Error::Length {
            expected: 1,
            actual: 2,
            ..
        }
    ));
    let nan = Problem::new(&[1.0, 0.0, f64::NAN, 1.0], &[1.0, 1.0]).unwrap_err();
    assert!(matches!(nan, Error::NotFinite { index: 2, .. }));
    let infinite = Problem::symmetric(&[1.0], &[f64::NEG_INFINITY]).unwrap_err();
    assert!(matches!(infinite, Error::NotFinite { index: 0, .. }));
    let problem = Problem::new(&[1.0, 0.0, 0.0, 1.0], &[-1.0, 1.0]).unwrap();
    let settings = Settings::default();
    let mut pair = ([0.0; 2], [0.0; 2]);
    let mut small = Scratch::new(1);
    let capacity = solve(
        &problem,
        &settings,
        &mut small,
        Start::Cold,
        &mut pair.0,
        &mut pair.1,
    );
    assert_eq!(
        capacity.unwrap_err(),
        Error::Capacity {
            rows: 2,
            capacity: 1
        }
    );
    let mut scratch = Scratch::new(2);
    let warm = solve(
        &problem,
        &settings,
        &mut scratch,
        Start::Rows(&[true]),
        &mut pair.0,
        &mut pair.1,
    );
    assert!(matches!(
        warm.unwrap_err(),
        Error::Length {
            expected: 2,
            actual: 1,
            ..
        }
    ));
    assert!(
        solve(
            &problem,
            &settings,
            &mut scratch,
            Start::Cold,
            &mut [0.0],
            &mut pair.1
        )
        .is_err()
    );
    assert!(check(&problem, &[0.0]).is_err());
}

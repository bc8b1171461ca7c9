//! Friction where matrices are singular, coefficients large, or the answer of the step before is at hand; and against
//! answers of other programs.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/elastic.rs"]
mod elastic;
#[path = "support/numbers.rs"]
mod numbers;

use std::path::Path as FilePath;

use contact::friction::{Problem, Scratch, Settings, Solution, State, Status, check, solve};
use elastic::{Path, Set};
use numbers::{Numbers, distance, max_abs};
use proptest::prelude::*;

/// W, q and one coefficient per contact.
#[derive(Debug, Clone)]
struct Case {
    w: Vec<f64>,
    q: Vec<f64>,
    mu: Vec<f64>,
}

struct Answer {
    solution: Solution,
    forces: Vec<f64>,
    slip: Vec<f64>,
    states: Vec<State>,
}

impl Case {
    fn n(&self) -> usize {
        self.mu.len()
    }

    fn solve_from(&self, start: Option<&[f64]>) -> Answer {
        let problem = Problem::new(&self.w, &self.q, &self.mu).unwrap();
        let mut scratch = Scratch::new(self.n());
        let mut forces = start.map_or(vec![f64::NAN; self.q.len()], <[f64]>::to_vec);
        let mut slip = vec![f64::NAN; self.q.len()];
        let solution = solve(
            &problem,
            &Settings::default(),
            &mut scratch,
            start.is_some(),
            &mut forces,
            &mut slip,
        )
        .unwrap();
        assert!(forces.iter().chain(&slip).all(|x| x.is_finite()));
        let residual = solution.certificate.natural_residual;
        assert_eq!(solution.status == Status::Solved, residual <= 1e-8);
        Answer {
            solution,
            forces,
            slip,
            states: scratch.states().to_vec(),
        }
    }

    /// Cold, and to what is promised; the number is made anew by the public check.
    fn solved(&self) -> Answer {
        let answer = self.solve_from(None);
        self.assert_solved(&answer);
        answer
    }

    fn assert_solved(&self, answer: &Answer) {
        let problem = Problem::new(&self.w, &self.q, &self.mu).unwrap();
        let residual = check(&problem, &answer.forces).unwrap().natural_residual;
        assert!(residual <= 1e-12, "{residual:e}: {:?}", answer.solution);
    }

    /// Every contact given twice.
    fn twice(&self) -> Self {
        let n = self.q.len();
        let mut w = vec![0.0; 4 * n * n];
        for i in 0..2 * n {
            for j in 0..2 * n {
                w[j * 2 * n + i] = self.w[(j % n) * n + i % n];
            }
        }
        Self {
            w,
            q: [&self.q[..], &self.q].concat(),
            mu: [&self.mu[..], &self.mu].concat(),
        }
    }

    /// Contacts of `held` cannot move along the direction with this angle in their tangent plane.
    fn held(mut self, held: &[(usize, f64)]) -> Self {
        let n = self.q.len();
        for &(contact, angle) in held {
            let (sin, cos) = angle.sin_cos();
            let first = 3 * contact + 1;
            let without = |a: &mut [f64], step: usize, offset: usize| {
                let along = cos * a[offset] + sin * a[offset + step];
                a[offset] -= along * cos;
                a[offset + step] -= along * sin;
            };
            for k in 0..n {
                without(&mut self.w, 1, k * n + first);
            }
            for k in 0..n {
                without(&mut self.w, n, first * n + k);
            }
            without(&mut self.q, 1, first);
        }
        for i in 0..n {
            for j in 0..i {
                self.w[i * n + j] = self.w[j * n + i];
            }
        }
        self
    }

    fn read(name: &str) -> (Self, Vec<f64>, Vec<f64>) {
        let folder = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/friction");
        let array = |file: &str| {
            let bytes = std::fs::read(folder.join(name).join(file)).unwrap();
            npyz::NpyFile::new(&bytes[..])
                .unwrap()
                .into_vec::<f64>()
                .unwrap()
        };
        // Symmetric: rows or columns first is the same.
        let (w, q) = (array("matrix.npy"), array("q.npy"));
        let mu = vec![0.3; q.len() / 3];
        (Self { w, q, mu }, array("forces.npy"), array("slip.npy"))
    }
}

/// Normal and tangents coupled by `weight`; condition about 100.
fn random(numbers: &mut Numbers, n: usize, mu: f64, weight: f64) -> Case {
    let rows = 3 * n;
    let a: Vec<f64> = (0..rows * (rows + 3)).map(|_| numbers.next()).collect();
    let mut w = vec![0.0; rows * rows];
    for i in 0..rows {
        for j in 0..=i {
            let row = |i: usize| a[i * (rows + 3)..(i + 1) * (rows + 3)].iter();
            let dot: f64 = row(i).zip(row(j)).map(|(a, b)| a * b).sum();
            let is_cross = (i % 3 == 0) != (j % 3 == 0);
            let own = if i == j { 0.1 } else { 0.0 };
            let entry = dot / rows as f64 * if is_cross { weight } else { 1.0 } + own;
            (w[i * rows + j], w[j * rows + i]) = (entry, entry);
        }
    }
    let q = (0..rows)
        .map(|k| numbers.next() - if k % 3 == 0 { 0.4 } else { 0.0 })
        .collect();
    let mu = (0..n).map(|_| mu * (1.0 + 0.1 * numbers.next())).collect();
    Case { w, q, mu }
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Random,
    Coupled,
    HalfSpace,
    Beam,
}

fn case(kind: Kind, seed: u64, n: usize, mu: f64, n_held: usize, is_twice: bool) -> Case {
    let mut numbers = Numbers(seed);
    let mut case = random(&mut numbers, n, mu, 0.2);
    match kind {
        Kind::Random => {}
        Kind::Coupled => case = random(&mut numbers, n, mu, 1.0),
        Kind::HalfSpace => case.w = Set::half_space(n).matrix,
        Kind::Beam => case.w = Set::beam(n).matrix,
    }
    let held: Vec<(usize, f64)> = (0..n_held.min(n))
        .map(|i| (i, 3.0 * numbers.next()))
        .collect();
    let case = case.held(&held);
    if is_twice { case.twice() } else { case }
}

fn kind() -> impl Strategy<Value = Kind> {
    prop_oneof![
        Just(Kind::Random),
        Just(Kind::Coupled),
        Just(Kind::HalfSpace),
        Just(Kind::Beam)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_problems_with_ordinary_friction_are_all_solved(
        kind in kind(), seed in any::<u64>(), n in 1_usize..14, mu in 0.0..0.5_f64,
        n_held in 0_usize..6, is_twice in any::<bool>(),
    ) {
        case(kind, seed, n, mu, n_held, is_twice).solved();
    }

    #[test]
    fn large_friction_is_solved_or_flagged(
        kind in kind(), seed in any::<u64>(), n in 1_usize..10, mu in 0.5..2.0_f64,
        n_held in 0_usize..6, is_twice in any::<bool>(),
    ) {
        // What is asked stands in `solve_from`.
        let answer = case(kind, seed, n, mu, n_held, is_twice).solve_from(None);
        prop_assert!(answer.solution.sweeps <= 200 && answer.solution.newton_steps <= 40);
    }

    #[test]
    fn warm_start_gives_the_same_gaps_slips_and_sums(
        kind in kind(), seed in any::<u64>(), n in 1_usize..14, mu in 0.05..0.4_f64, is_twice in any::<bool>(),
    ) {
        let case = case(kind, seed, n, mu, 0, is_twice);
        let cold = case.solved();
        let mut numbers = Numbers(seed ^ 1);
        let mut before = case.clone();
        for (q, other) in before.q.iter_mut().zip(&case.q) {
            *q = other + 0.02 * numbers.next();
        }
        let warm = case.solve_from(Some(&before.solved().forces));
        case.assert_solved(&warm);
        // The residual is of forces and gaps by their largest; what it leaves open grows with the condition.
        prop_assert!(distance(&warm.slip, &cold.slip) <= 1e-8 * max_abs(&case.q));
        let sum = |forces: &[f64], axis: usize| forces.iter().skip(axis).step_by(3).sum::<f64>();
        for axis in 0..3 {
            let apart = (sum(&warm.forces, axis) - sum(&cold.forces, axis)).abs();
            prop_assert!(apart <= 1e-8 * n as f64 * max_abs(&cold.forces), "{apart:e}");
        }
    }
}

#[test]
fn forces_are_those_of_other_programs_and_repeated_contacts_share_them() {
    for name in ["hard-redundant-pose4", "hard-redundant-pose9"] {
        let (case, forces, slip) = Case::read(name);
        let once = case.solved();
        // Both are good to about 1e-15 in the residual; the matrix has a condition of 500.
        assert!(distance(&once.forces, &forces) <= 1e-10 * max_abs(&forces));
        assert!(distance(&once.slip, &slip) <= 1e-11 * max_abs(&case.q));
        let pairs = case.twice().solved();
        let (first, second) = pairs.forces.split_at(forces.len());
        let sums: Vec<f64> = first.iter().zip(second).map(|(a, b)| a + b).collect();
        assert!(distance(&sums, &forces) <= 1e-9 * max_abs(&forces));
        assert!(distance(&pairs.slip[..slip.len()], &slip) <= 1e-10 * max_abs(&case.q));
    }
}

/// One contact on a plane of symmetry: it gives way along its normal and along one direction of its tangent plane.
fn on_symmetry_plane(angle: f64, along: f64, across: f64) -> Case {
    let (sin, cos) = angle.sin_cos();
    let v = [0.0, cos, sin];
    let w = (0..9)
        .map(|k| {
            let (i, j) = (k / 3, k % 3);
            v[i] * v[j] * 2e-3 + if k == 0 { 1e-3 } else { 0.0 }
        })
        .collect();
    let q = vec![
        -1e-3,
        along * cos - across * sin,
        along * sin + across * cos,
    ];
    Case {
        w,
        q,
        mu: vec![0.5],
    }
}

#[test]
fn contact_that_gives_way_in_one_direction_sticks_and_slips_in_it() {
    for angle in [0.0, 0.3, 0.5 * std::f64::consts::PI, 2.0, -1.1] {
        let (sin, cos) = f64::sin_cos(angle);
        // 1 N closes the gap; 0.4 N hold a slip of 0.8 mm, within the 0.5 N of friction.
        let stick = on_symmetry_plane(angle, 8e-4, 0.0).solved();
        assert_eq!(stick.states, [State::Stick]);
        let expected = [1.0, -0.4 * cos, -0.4 * sin];
        assert!(distance(&stick.forces, &expected) < 1e-12);
        // 2 mm are more than 0.5 N can hold: 1 mm is left.
        let slip = on_symmetry_plane(angle, 2e-3, 0.0).solved();
        assert_eq!(slip.states, [State::Slip]);
        let expected = [1.0, -0.5 * cos, -0.5 * sin];
        assert!(distance(&slip.forces, &expected) < 1e-12);
        assert!((slip.slip[1].hypot(slip.slip[2]) - 1e-3).abs() < 1e-14);
        // Motion that no force can stop drags along.
        for along in [0.0, 3e-4, 8e-4, 2e-3] {
            for across in [1e-3, 1e-5, 1e-8] {
                let dragged = on_symmetry_plane(angle, along, across).solved();
                assert_eq!(dragged.states, [State::Slip]);
            }
        }
    }
}

#[test]
fn sweeps_alone_hold_a_contact_that_gives_way_in_one_direction() {
    let case = on_symmetry_plane(0.3, 8e-4, 0.0);
    let problem = Problem::new(&case.w, &case.q, &case.mu).unwrap();
    let settings = Settings {
        max_newton_steps: 0,
        ..Settings::default()
    };
    let (mut forces, mut slip) = ([0.0; 3], [0.0; 3]);
    let mut scratch = Scratch::new(1);
    let solution = solve(
        &problem,
        &settings,
        &mut scratch,
        false,
        &mut forces,
        &mut slip,
    )
    .unwrap();
    assert!(
        solution.certificate.natural_residual < 1e-12,
        "{solution:?}"
    );
    assert_eq!(scratch.states(), [State::Stick]);
}

#[test]
fn contact_that_nothing_moves_is_without_force_and_flagged_only_if_it_overlaps() {
    let mut numbers = Numbers(11);
    for gap in [1e-3, 0.0, -0.3] {
        let mut case = random(&mut numbers, 4, 0.3, 0.2);
        let n = case.q.len();
        for axis in 3..6 {
            for k in 0..n {
                case.w[axis * n + k] = 0.0;
                case.w[k * n + axis] = 0.0;
            }
        }
        case.q[3] = gap;
        // Whatever stands there before.
        let start = vec![0.7; n];
        for answer in [case.solve_from(None), case.solve_from(Some(&start))] {
            assert_eq!(answer.forces[3..6], [0.0; 3]);
            let is_solved = answer.solution.status == Status::Solved;
            assert_eq!(is_solved, gap >= 0.0, "{:?}", answer.solution);
        }
    }
    let nothing = Case {
        w: vec![0.0; 36],
        q: vec![-1.0, 0.3, 0.0, 0.5, 0.0, 0.0],
        mu: vec![0.4; 2],
    };
    let answer = nothing.solve_from(None);
    assert_eq!(answer.forces, [0.0; 6]);
    assert_eq!(answer.solution.status, Status::Budget);
}

#[test]
fn along_a_path_warm_starts_need_newton_steps_only() {
    for (set, mu) in [
        (Set::half_space(20), 0.3),
        (Set::half_space(20), 0.1),
        (Set::beam(12), 0.3),
    ] {
        let n = set.n();
        let depth = 2e-5;
        let path = Path {
            shape: (0..n).map(|i| depth * 0.02 * (i % 7) as f64).collect(),
            depth,
            slide: 0.05 * mu * depth,
            turn: 1e-5,
        };
        let mut displacement = vec![0.0; 3 * n];
        let mut forces: Option<Vec<f64>> = None;
        let (mut n_newton, mut n_steps, mut seen) = (0, 0, [0; 3]);
        for step in 0..40 {
            let case = Case {
                w: set.matrix.clone(),
                q: path.q(&set, step, &displacement),
                mu: vec![mu; n],
            };
            let warm = case.solve_from(forces.as_deref());
            case.assert_solved(&warm);
            if step > Path::PRESS {
                assert_eq!(warm.solution.sweeps, 0, "step {step}: {:?}", warm.solution);
                n_newton += warm.solution.newton_steps;
                n_steps += 1;
            }
            for state in &warm.states {
                seen[*state as usize] += 1;
            }
            for ((u, slip), q) in displacement.iter_mut().zip(&warm.slip).zip(&case.q) {
                *u = slip - q;
            }
            forces = Some(warm.forces);
        }
        assert!(n_newton <= 3 * n_steps, "{n_newton} in {n_steps} steps");
        assert!(seen[2] > 0, "{seen:?}");
    }
}

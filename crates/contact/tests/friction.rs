//! Friction against its polyhedral cousin solved by Lemke's method, its limits, and its invariances.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/lemke.rs"]
mod lemke;
#[path = "support/numbers.rs"]
mod numbers;

use contact::Error;
use contact::friction::{Problem, Scratch, Settings, Solution, State, Status, check, solve};
use contact::lcp;
use lemke::lemke;
use numbers::{Numbers, distance, max_abs};

impl Numbers {
    /// Symmetric positive definite over n contacts of `each` rows, the first of them the normal; condition about 100.
    /// Normals and tangents are coupled as weakly as in an elastic body, where the answer is unique.
    fn delassus(&mut self, n_contacts: usize, each: usize) -> Vec<f64> {
        let n = n_contacts * each;
        let a: Vec<f64> = (0..n * (n + 3)).map(|_| self.next()).collect();
        let mut w = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let row = |i: usize| a[i * (n + 3)..(i + 1) * (n + 3)].iter();
                let dot: f64 = row(i).zip(row(j)).map(|(a, b)| a * b).sum();
                let is_cross = (i % each == 0) != (j % each == 0);
                let weight = if is_cross { 0.2 } else { 1.0 };
                let entry = weight * dot / n as f64 + if i == j { 0.1 } else { 0.0 };
                (w[i * n + j], w[j * n + i]) = (entry, entry);
            }
        }
        w
    }
}

struct Answer {
    solution: Solution,
    forces: Vec<f64>,
    slip: Vec<f64>,
    states: Vec<State>,
}

fn answer(w: &[f64], q: &[f64], mu: &[f64], settings: &Settings) -> Answer {
    let problem = Problem::new(w, q, mu).unwrap();
    // A larger scratch: nothing of its size may show.
    let mut scratch = Scratch::new(mu.len() + 2);
    let (mut forces, mut slip) = (vec![f64::NAN; q.len()], vec![f64::NAN; q.len()]);
    let solution = solve(
        &problem,
        settings,
        &mut scratch,
        false,
        &mut forces,
        &mut slip,
    )
    .unwrap();
    let independent = check(&problem, &forces).unwrap().natural_residual;
    // Two orders of summation.
    let terms = q.len() as f64 * max_abs(w) * max_abs(&forces) / max_abs(q).max(f64::MIN_POSITIVE);
    let difference = (independent - solution.certificate.natural_residual).abs();
    let allowed = 8.0 * f64::EPSILON * (1.0 + terms);
    assert!(difference <= allowed, "{solution:?} but {independent:e}");
    Answer {
        solution,
        forces,
        slip,
        states: scratch.states().to_vec(),
    }
}

fn solved(w: &[f64], q: &[f64], mu: &[f64]) -> Answer {
    let answer = answer(w, q, mu, &Settings::default());
    assert_eq!(
        answer.solution.status,
        Status::Solved,
        "{:?}",
        answer.solution
    );
    assert!(answer.solution.certificate.natural_residual < 1e-8);
    answer
}

/// Forces with the disk replaced by a polygon of `edges` corners, by Lemke's method.
///
/// Unknown per contact: normal force, `edges` tangential forces, largest slip speed.
/// Source: Stewart and Trinkle (1996), Int. J. Numer. Meth. Eng. 39.
fn polygonal(w: &[f64], q: &[f64], mu: &[f64], edges: usize) -> Option<Vec<f64>> {
    let (n, n_rows, each) = (mu.len(), q.len(), edges + 2);
    let m = n * each;
    let directions: Vec<[f64; 2]> = (0..edges)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / edges as f64;
            [angle.cos(), angle.sin()]
        })
        .collect();
    // The part of each unknown in λ, as (row, factor).
    let parts = |unknown: usize| -> Vec<(usize, f64)> {
        let (contact, inside) = (unknown / each, unknown % each);
        match inside {
            0 => vec![(3 * contact, 1.0)],
            k if k <= edges => {
                let d = directions[k - 1];
                vec![(3 * contact + 1, d[0]), (3 * contact + 2, d[1])]
            }
            _ => vec![],
        }
    };
    let mut matrix = vec![0.0; m * m];
    let mut right = vec![0.0; m];
    for i in 0..m {
        for (row, factor) in parts(i) {
            right[i] += factor * q[row];
            for j in 0..m {
                for (column, other) in parts(j) {
                    matrix[j * m + i] += factor * other * w[column * n_rows + row];
                }
            }
        }
    }
    for contact in 0..n {
        let speed = contact * each + edges + 1;
        matrix[contact * each * m + speed] = mu[contact];
        for k in 1..=edges {
            let tangential = contact * each + k;
            matrix[tangential * m + speed] = -1.0;
            matrix[speed * m + tangential] = 1.0;
        }
    }
    let z = lemke(&matrix, &right)?;
    let problem = lcp::Problem::new(&matrix, &right).unwrap();
    assert!(lcp::check(&problem, &z).unwrap().natural_residual <= 1e-10);
    let mut forces = vec![0.0; n_rows];
    for (unknown, z) in z.iter().enumerate() {
        for (row, factor) in parts(unknown) {
            forces[row] += factor * z;
        }
    }
    Some(forces)
}

#[test]
fn planar_friction_is_that_of_the_polygon_with_two_corners() {
    let mut numbers = Numbers(1);
    let mut seen = [0; 3];
    for n in [1, 2, 4, 7] {
        for _ in 0..60 {
            // The second tangent has nothing to do with the rest: the disk is an interval.
            let plane = numbers.delassus(n, 2);
            let n_rows = 3 * n;
            let mut w = vec![0.0; n_rows * n_rows];
            for i in 0..2 * n {
                for j in 0..2 * n {
                    let (row, column) = (3 * (i / 2) + i % 2, 3 * (j / 2) + j % 2);
                    w[column * n_rows + row] = plane[j * 2 * n + i];
                }
            }
            for contact in 0..n {
                let row = 3 * contact + 2;
                w[row * n_rows + row] = 0.7;
            }
            let mut q = vec![0.0; n_rows];
            for contact in 0..n {
                q[3 * contact] = numbers.next() - 0.4;
                q[3 * contact + 1] = numbers.next();
            }
            let mu: Vec<f64> = (0..n).map(|_| 0.15 + 0.15 * numbers.next()).collect();
            let expected = polygonal(&w, &q, &mu, 2).unwrap();
            let found = solved(&w, &q, &mu);
            let error = distance(&found.forces, &expected) / max_abs(&expected).max(1e-6);
            assert!(
                error < 1e-7,
                "{error:e} with {n} contacts: {:?}",
                found.solution
            );
            for state in found.states {
                seen[state as usize] += 1;
            }
        }
    }
    assert!(seen.iter().all(|n| *n > 50), "open, stick, slip: {seen:?}");
}

#[test]
fn polygon_comes_to_the_disk_with_its_edges() {
    let mut numbers = Numbers(2);
    let (mut errors, mut n_problems) = ([0.0_f64; 3], 0);
    for _ in 0..20 {
        let n = 3;
        let w = numbers.delassus(n, 3);
        let q: Vec<f64> = (0..3 * n)
            .map(|k| numbers.next() - if k % 3 == 0 { 0.7 } else { 0.0 })
            .collect();
        let mu = [0.2; 3];
        let found = solved(&w, &q, &mu);
        let polygons = [8, 16, 32].map(|edges| polygonal(&w, &q, &mu, edges));
        // Lemke's method may end on a ray here; then there is nothing to compare with.
        if let [Some(a), Some(b), Some(c)] = polygons {
            n_problems += 1;
            for (error, polygon) in errors.iter_mut().zip([a, b, c]) {
                *error = error.max(distance(&found.forces, &polygon) / max_abs(&found.forces));
            }
        }
    }
    assert!(n_problems >= 15, "{n_problems}");
    // A polygon's force points to a corner, up to π/d away from the slip.
    for (error, edges) in errors.iter().zip([8.0, 16.0, 32.0]) {
        assert!(*error < 0.2 * std::f64::consts::PI / edges, "{errors:?}");
    }
    assert!(errors[2] > 1e-6, "the polygon is no disk: {errors:?}");
}

#[test]
fn without_friction_the_answer_is_that_of_the_complementarity_problem() {
    let mut numbers = Numbers(3);
    for n in [1, 3, 8, 20] {
        let w = numbers.delassus(n, 3);
        let q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
        let (mut matrix, mut gaps) = (vec![0.0; n * n], vec![0.0; n]);
        for j in 0..n {
            gaps[j] = q[3 * j];
            for i in 0..n {
                matrix[j * n + i] = w[3 * j * 3 * n + 3 * i];
            }
        }
        let (mut z, mut after) = (vec![0.0; n], vec![0.0; n]);
        lcp::solve(
            &lcp::Problem::symmetric(&matrix, &gaps).unwrap(),
            &lcp::Settings::default(),
            &mut lcp::Scratch::new(n),
            lcp::Start::Cold,
            &mut z,
            &mut after,
        )
        .unwrap();
        let without = solved(&w, &q, &vec![0.0; n]);
        for (contact, z) in z.iter().enumerate() {
            assert_eq!(without.forces[3 * contact].to_bits(), z.to_bits());
            assert_eq!(without.forces[3 * contact + 1..3 * contact + 3], [0.0; 2]);
        }
        assert_eq!(
            (without.solution.sweeps, without.solution.newton_steps),
            (0, 0)
        );
        // The way to the limit is straight: a tenth of the friction, a tenth of the difference.
        let size = max_abs(&without.forces).max(1e-300);
        let apart =
            |mu: f64| distance(&solved(&w, &q, &vec![mu; n]).forces, &without.forces) / size;
        assert!(apart(1e-6) < 1e-4, "{:e}", apart(1e-6));
        assert!(apart(1e-7) <= 0.11 * apart(1e-6) + 1e-12);
    }
}

#[test]
fn forces_do_not_depend_on_the_choice_of_tangents() {
    let mut numbers = Numbers(4);
    for _ in 0..40 {
        let n = 4;
        let n_rows = 3 * n;
        let w = numbers.delassus(n, 3);
        let q: Vec<f64> = (0..n_rows)
            .map(|k| numbers.next() - if k % 3 == 0 { 0.5 } else { 0.0 })
            .collect();
        let mu = [0.1, 0.2, 0.05, 0.25];
        let turns: Vec<f64> = (0..n).map(|_| 3.0 * numbers.next()).collect();
        // R = diag(1, rotation) of each contact.
        let rotation = |i: usize, j: usize| -> f64 {
            if i / 3 != j / 3 {
                return 0.0;
            }
            let (sin, cos) = turns[i / 3].sin_cos();
            match (i % 3, j % 3) {
                (0, 0) => 1.0,
                (1, 1) | (2, 2) => cos,
                (1, 2) => -sin,
                (2, 1) => sin,
                _ => 0.0,
            }
        };
        let turned = |v: &[f64]| -> Vec<f64> {
            (0..n_rows)
                .map(|i| (0..n_rows).map(|j| rotation(i, j) * v[j]).sum())
                .collect()
        };
        let mut other = vec![0.0; n_rows * n_rows];
        for j in 0..n_rows {
            for i in 0..=j {
                let mut entry = 0.0;
                for k in 3 * (i / 3)..3 * (i / 3) + 3 {
                    for l in 3 * (j / 3)..3 * (j / 3) + 3 {
                        entry += rotation(i, k) * w[l * n_rows + k] * rotation(j, l);
                    }
                }
                (other[j * n_rows + i], other[i * n_rows + j]) = (entry, entry);
            }
        }
        let here = solved(&w, &q, &mu);
        let there = solved(&other, &turned(&q), &mu);
        let error = distance(&turned(&here.forces), &there.forces) / max_abs(&here.forces);
        assert!(error < 1e-7, "{error:e}");
        assert_eq!(here.states, there.states);
    }
}

#[test]
fn answer_keeps_signorini_and_coulomb_one_by_one() {
    let mut numbers = Numbers(5);
    for n in [5, 15, 40] {
        for _ in 0..5 {
            let w = numbers.delassus(n, 3);
            let q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
            let mu: Vec<f64> = (0..n).map(|_| 0.2 + 0.2 * numbers.next()).collect();
            let found = solved(&w, &q, &mu);
            let (size_f, size_u) = (max_abs(&found.forces), max_abs(&q));
            for contact in 0..n {
                let f = &found.forces[3 * contact..3 * contact + 3];
                let u = &found.slip[3 * contact..3 * contact + 3];
                assert!(f[0] >= -1e-9 * size_f && u[0] >= -1e-7 * size_u);
                assert!(f[0] * u[0] <= 1e-7 * size_f * size_u);
                let (drag, speed) = (f[1].hypot(f[2]), u[1].hypot(u[2]));
                assert!(drag <= mu[contact] * f[0] + 1e-7 * size_f);
                match found.states[contact] {
                    State::Open => assert!(drag <= 1e-9 * size_f),
                    State::Stick => assert!(speed <= 1e-6 * size_u),
                    State::Slip => {
                        assert!((drag - mu[contact] * f[0]).abs() <= 1e-6 * size_f);
                        let against = f[1] * u[1] + f[2] * u[2];
                        assert!((against + drag * speed).abs() <= 1e-6 * size_f * size_u);
                    }
                }
            }
        }
    }
}

#[test]
fn warm_start_gives_the_same_forces_in_fewer_sweeps() {
    let mut numbers = Numbers(6);
    let (mut cold, mut warm) = (0, 0);
    for _ in 0..20 {
        let n = 10;
        let w = numbers.delassus(n, 3);
        let mut q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
        let mu = vec![0.2; n];
        let before = solved(&w, &q, &mu);
        for q in &mut q {
            *q += 1e-3 * numbers.next();
        }
        let now = solved(&w, &q, &mu);
        let problem = Problem::new(&w, &q, &mu).unwrap();
        let (mut forces, mut slip) = (before.forces, vec![0.0; 3 * n]);
        let settings = Settings::default();
        let mut scratch = Scratch::new(n);
        let solution = solve(
            &problem,
            &settings,
            &mut scratch,
            true,
            &mut forces,
            &mut slip,
        )
        .unwrap();
        assert_eq!(solution.status, Status::Solved);
        assert!(distance(&forces, &now.forces) < 1e-7 * max_abs(&forces));
        cold += now.solution.sweeps + now.solution.newton_steps;
        warm += solution.sweeps + solution.newton_steps;
    }
    assert!(warm <= cold, "{warm} of {cold}");
}

#[test]
fn sweeps_alone_and_newton_find_the_same_forces() {
    let mut numbers = Numbers(7);
    for _ in 0..10 {
        let n = 6;
        let w = numbers.delassus(n, 3);
        let q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
        let mu = vec![0.15; n];
        let settings = Settings {
            max_newton_steps: 0,
            max_sweeps: 20_000,
            ..Settings::default()
        };
        let swept = answer(&w, &q, &mu, &settings);
        assert_eq!(swept.solution.status, Status::Solved);
        assert_eq!(swept.solution.newton_steps, 0);
        let found = solved(&w, &q, &mu);
        assert!(distance(&swept.forces, &found.forces) < 1e-6 * max_abs(&found.forces));
        assert!(found.solution.sweeps <= swept.solution.sweeps);
    }
}

#[test]
fn wedge_beyond_its_friction_angle_stays_finite_and_is_flagged_if_unsolved() {
    // Two walls that lean towards each other by 10 degrees press a point with little compliance along what they share.
    let (sin, cos) = 10.0_f64.to_radians().sin_cos();
    let rows = [
        [cos, 0.0, sin],
        [sin, 0.0, -cos],
        [0.0, 1.0, 0.0],
        [-cos, 0.0, sin],
        [sin, 0.0, cos],
        [0.0, 1.0, 0.0],
    ];
    for stiff in [1.0, 1e-3, 1e-9, 0.0] {
        let compliance = [1.0, 1.0, stiff];
        let mut w = vec![0.0; 36];
        for (i, a) in rows.iter().enumerate() {
            for (j, b) in rows.iter().enumerate() {
                w[j * 6 + i] = (0..3).map(|k| a[k] * compliance[k] * b[k]).sum();
            }
        }
        for mu in [0.01, 0.17, 0.18, 1.0, 5.7, 50.0] {
            for depth in [1e-6, 1e-2] {
                let q = [-depth, 0.3 * depth, 0.0, -depth, 0.1 * depth, 0.2 * depth];
                let found = answer(&w, &q, &[mu; 2], &Settings::default());
                assert!(
                    found
                        .forces
                        .iter()
                        .chain(&found.slip)
                        .all(|x| x.is_finite())
                );
                let residual = found.solution.certificate.natural_residual;
                assert_eq!(found.solution.status == Status::Solved, residual <= 1e-8);
            }
        }
    }
}

#[test]
fn units_do_not_matter() {
    let mut numbers = Numbers(8);
    let n = 5;
    let w = numbers.delassus(n, 3);
    let q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
    let mu = vec![0.2; n];
    let here = solved(&w, &q, &mu);
    for (compliance, gap) in [(1e-7, 1e-4), (1e3, 1e-9), (1e-12, 1.0)] {
        let other: Vec<f64> = w.iter().map(|x| x * compliance).collect();
        let gaps: Vec<f64> = q.iter().map(|x| x * gap).collect();
        let there = solved(&other, &gaps, &mu);
        let back: Vec<f64> = there.forces.iter().map(|f| f * compliance / gap).collect();
        assert!(distance(&back, &here.forces) < 1e-8 * max_abs(&here.forces));
    }
}

#[test]
fn spent_budget_is_flagged_and_the_best_forces_are_given() {
    let mut numbers = Numbers(10);
    let n = 20;
    let w = numbers.delassus(n, 3);
    let q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
    let settings = Settings {
        max_sweeps: 1,
        max_newton_steps: 0,
        ..Settings::default()
    };
    let found = answer(&w, &q, &vec![0.5; n], &settings);
    assert_eq!(found.solution.status, Status::Budget);
    assert_eq!(found.solution.sweeps, 1);
    assert!(found.solution.certificate.natural_residual > 1e-8);
    assert!(found.forces.iter().all(|f| f.is_finite()));
    let over = Settings {
        deadline: Some(std::time::Instant::now()),
        ..Settings::default()
    };
    let found = answer(&w, &q, &vec![0.5; n], &over);
    assert_eq!(
        (found.solution.status, found.solution.sweeps),
        (Status::Budget, 0)
    );
}

#[test]
fn empty_and_open_problems_have_no_force() {
    let none = answer(&[], &[], &[], &Settings::default());
    assert_eq!(none.solution.status, Status::Solved);
    assert_eq!(none.solution.certificate.natural_residual, 0.0);
    let identity: Vec<f64> = (0..9).map(|k| if k % 4 == 0 { 1.0 } else { 0.0 }).collect();
    let open = solved(&identity, &[0.1, 5.0, -3.0], &[0.5]);
    assert_eq!(open.forces, [0.0; 3]);
    assert_eq!(open.slip, [0.1, 5.0, -3.0]);
    assert_eq!(open.states, [State::Open]);
}

#[test]
fn wrong_input_is_an_error_with_the_numbers() {
    let identity: Vec<f64> = (0..9).map(|k| if k % 4 == 0 { 1.0 } else { 0.0 }).collect();
    let q = [-1.0, 0.0, 0.0];
    let refused = |w: &[f64], q: &[f64], mu: &[f64]| Problem::new(w, q, mu).unwrap_err();
    assert!(matches!(
        refused(&identity, &q, &[0.1, 0.2]),
        Error::Length {
            expected: 6,
            actual: 3,
            ..
        }
    ));
    assert!(matches!(
        refused(&identity[..6], &q, &[0.1]),
        Error::Length {
            expected: 9,
            actual: 6,
            ..
        }
    ));
    assert!(matches!(
        refused(&identity, &q, &[-0.1]),
        Error::NegativeFriction { contact: 0, .. }
    ));
    assert!(matches!(
        refused(&identity, &q, &[f64::NAN]),
        Error::NegativeFriction { .. }
    ));
    assert!(matches!(
        refused(&identity, &[f64::NAN, 0.0, 0.0], &[0.1]),
        Error::NotFinite { index: 0, .. }
    ));
    let mut skew = identity.clone();
    skew[1] = 0.5;
    assert!(matches!(
        refused(&skew, &q, &[0.1]),
        Error::NotSymmetric {
            row: 1,
            column: 0,
            ..
        }
    ));
    let problem = Problem::new(&identity, &q, &[0.1]).unwrap();
    let settings = Settings::default();
    let run = |capacity: usize, is_warm: bool, forces: &mut [f64], slip: &mut [f64]| {
        solve(
            &problem,
            &settings,
            &mut Scratch::new(capacity),
            is_warm,
            forces,
            slip,
        )
        .unwrap_err()
    };
    assert!(matches!(
        run(0, false, &mut [0.0; 3], &mut [0.0; 3]),
        Error::Capacity {
            rows: 1,
            capacity: 0
        }
    ));
    assert!(matches!(
        run(1, false, &mut [0.0; 2], &mut [0.0; 3]),
        Error::Length { .. }
    ));
    assert!(matches!(
        run(1, false, &mut [0.0; 3], &mut [0.0; 4]),
        Error::Length { .. }
    ));
    assert!(matches!(
        run(1, true, &mut [0.0, f64::NAN, 0.0], &mut [0.0; 3]),
        Error::NotFinite { index: 1, .. }
    ));
    assert!(check(&problem, &[0.0]).is_err());
}

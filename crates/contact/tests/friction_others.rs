//! Several answers of one problem: found where they are, and none where there is one.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/numbers.rs"]
mod numbers;

use contact::friction::{
    Problem, Scratch, Settings, Status, check, may_have_others, others, solve,
};
use numbers::{Numbers, distance, max_abs};

fn solved(problem: &Problem) -> Vec<f64> {
    let n = problem.n_contacts();
    let (mut forces, mut slip) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    let settings = Settings::default();
    let mut scratch = Scratch::new(n);
    let solution = solve(
        problem,
        &settings,
        &mut scratch,
        false,
        &mut forces,
        &mut slip,
    );
    assert_eq!(solution.unwrap().status, Status::Solved);
    forces
}

/// A point on a spring that gives way by 1 along the normal and along each tangent, and by `COUPLING` from the normal to
/// the first. It stands clear of the tool by `GAP`, and the tool drags along the first tangent by `drag`.
///
/// ```text
/// u_n = GAP + z + COUPLING t        u_t = drag + COUPLING z + t        -μ z <= t <= μ z
/// ```
/// With μ COUPLING > 1 friction closes more than the normal force opens. Open is an answer whatever the drag. Slip (t = -μ z) closes
/// the gap with z = GAP / (μ COUPLING - 1) and slips on where drag > GAP (μ - COUPLING) / (μ COUPLING - 1), and from that drag on
/// the force that holds both is inside the cone, so that stick is the third.
const COUPLING: f64 = 0.8;
const GAP: f64 = 1.0;
const FRICTION: f64 = 2.0;
const LEAST_DRAG: f64 = GAP * (FRICTION - COUPLING) / (FRICTION * COUPLING - 1.0);

fn answers(drag: f64) -> Vec<Vec<f64>> {
    let open = vec![0.0; 3];
    if drag < LEAST_DRAG {
        return vec![open];
    }
    let z = GAP / (FRICTION * COUPLING - 1.0);
    let slip = vec![z, -FRICTION * z, 0.0];
    let per = 1.0 - COUPLING * COUPLING;
    let stick = vec![
        (COUPLING * drag - GAP) / per,
        (COUPLING * GAP - drag) / per,
        0.0,
    ];
    vec![open, slip, stick]
}

/// `n` such points, each by itself.
fn points(n: usize, drag: f64) -> (Vec<f64>, Vec<f64>) {
    let rows = 3 * n;
    let mut w = vec![0.0; rows * rows];
    let mut q = vec![0.0; rows];
    for first in (0..rows).step_by(3) {
        for k in first..first + 3 {
            w[k * rows + k] = 1.0;
        }
        w[first * rows + first + 1] = COUPLING;
        w[(first + 1) * rows + first] = COUPLING;
        (q[first], q[first + 1]) = (GAP, drag);
    }
    (w, q)
}

fn assert_same_sets(found: &[Vec<f64>], expected: &[Vec<f64>]) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for answer in expected {
        let near = |other: &&Vec<f64>| distance(other, answer) < 1e-12;
        assert_eq!(found.iter().filter(near).count(), 1, "{answer:?}");
    }
}

/// From each of the three answers the other two, in any units; one answer below the drag that holds the point.
#[test]
fn a_point_that_friction_pulls_in_has_three_answers() {
    for (compliance, length) in [(1.0, 1.0), (1e-6, 1e-3), (1e9, 1e-9)] {
        let all = answers(1.5 * LEAST_DRAG);
        let (w, q) = points(1, 1.5 * LEAST_DRAG);
        let w: Vec<f64> = w.iter().map(|x| x * compliance).collect();
        let q: Vec<f64> = q.iter().map(|x| x * length).collect();
        let per = compliance / length;
        let problem = Problem::new(&w, &q, &[FRICTION]).unwrap();
        for (k, own) in all.iter().enumerate() {
            let own: Vec<f64> = own.iter().map(|x| x / per).collect();
            assert!(check(&problem, &own).unwrap().natural_residual < 1e-14);
            let found = others(&problem, &own).unwrap();
            let found: Vec<Vec<f64>> = found
                .iter()
                .map(|forces| forces.iter().map(|x| x * per).collect())
                .collect();
            let mut expected = all.clone();
            expected.remove(k);
            assert_same_sets(&found, &expected);
        }
    }
    let (w, q) = points(1, 0.9 * LEAST_DRAG);
    let problem = Problem::new(&w, &q, &[FRICTION]).unwrap();
    assert!(may_have_others(&problem, &[0.0; 3]).unwrap());
    assert!(others(&problem, &[0.0; 3]).unwrap().is_empty());
}

/// Points by themselves have every combination of their answers.
#[test]
fn two_points_have_nine_answers() {
    let one = answers(1.2 * LEAST_DRAG);
    let all: Vec<Vec<f64>> = one
        .iter()
        .flat_map(|a| one.iter().map(|b| [&a[..], b].concat()))
        .collect();
    let (w, q) = points(2, 1.2 * LEAST_DRAG);
    let problem = Problem::new(&w, &q, &[FRICTION; 2]).unwrap();
    for (k, own) in all.iter().enumerate() {
        let mut expected = all.clone();
        expected.remove(k);
        assert_same_sets(&others(&problem, own).unwrap(), &expected);
    }
}

/// Below the point's friction angle there is one answer, and far below it nothing is looked for.
#[test]
fn below_the_friction_angle_there_is_one_answer() {
    for (mu, may) in [(0.95 / COUPLING, true), (0.4 / COUPLING, false)] {
        for (gap, drag) in [(1.0, 5.0), (-1.0, 5.0), (-1.0, -0.3), (-1.0, 0.0)] {
            let (w, _) = points(1, 0.0);
            let q = [gap, drag, 0.2];
            let mu = [mu];
            let problem = Problem::new(&w, &q, &mu).unwrap();
            let own = solved(&problem);
            assert_eq!(may_have_others(&problem, &own).unwrap(), may);
            assert!(others(&problem, &own).unwrap().is_empty());
        }
    }
}

/// A contact given twice shares its force in many ways, with one motion: that is one answer. What is no answer has no others.
#[test]
fn forces_that_move_nothing_are_no_other_answer() {
    let (w, _) = points(1, 0.0);
    let q = [-1.0, 3.0, 0.2];
    let mut twice = vec![0.0; 36];
    for i in 0..6 {
        for j in 0..6 {
            twice[6 * j + i] = w[3 * (j % 3) + i % 3];
        }
    }
    let q = [q, q].concat();
    let mu = [0.9 / COUPLING; 2];
    let problem = Problem::new(&twice, &q, &mu).unwrap();
    let own = solved(&problem);
    assert!(may_have_others(&problem, &own).unwrap());
    assert!(others(&problem, &own).unwrap().is_empty());
    assert!(!may_have_others(&problem, &[1.0; 6]).unwrap());
    assert!(others(&problem, &[1.0; 5]).is_err());
}

/// A random positive definite W, normals and tangents coupled.
fn coupled(numbers: &mut Numbers, n: usize) -> Vec<f64> {
    let rows = 3 * n;
    let a: Vec<Vec<f64>> = (0..rows)
        .map(|_| (0..rows + 3).map(|_| numbers.next()).collect())
        .collect();
    let dot = |i: usize, j: usize| a[i].iter().zip(&a[j]).map(|(a, b)| a * b).sum::<f64>();
    (0..rows * rows)
        .map(|k| dot(k % rows, k / rows) / rows as f64)
        .collect()
}

/// Random sets with ordinary friction have none; with twenty times as much some have, and each is an answer, and the same each time.
#[test]
fn random_sets_have_others_with_large_friction_only() {
    let mut numbers = Numbers(3);
    let mut n_with = 0;
    for k in 0..150 {
        let n = 1 + k % 6;
        let w = coupled(&mut numbers, n);
        let q: Vec<f64> = (0..3 * n).map(|_| numbers.next()).collect();
        for mu in [0.2, 4.0] {
            let mu = vec![mu; n];
            let problem = Problem::new(&w, &q, &mu).unwrap();
            let own = solved(&problem);
            let found = others(&problem, &own).unwrap();
            assert!(found.is_empty() || mu[0] > 1.0);
            assert_eq!(found, others(&problem, &own).unwrap());
            for other in &found {
                assert!(check(&problem, other).unwrap().natural_residual < 1e-10);
                assert!(distance(other, &own) > 1e-6 * max_abs(&own));
            }
            n_with += usize::from(!found.is_empty());
        }
    }
    assert!(n_with > 0);
}

//! Unsymmetric problems, as those of friction on a polygon: the solvers refuse them, the oracle of other tests solves them.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/lemke.rs"]
mod lemke;
#[path = "support/numbers.rs"]
mod numbers;

use contact::Error;
use contact::lcp::{
    ActiveSet, Automatic, BlockPivoting, GaussSeidel, Problem, Scratch, Settings, Solver, Start,
    check,
};
use lemke::lemke;
use numbers::{Numbers, distance, max_abs};

impl Numbers {
    fn take(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// Its answer, if it has one, is a solution by the public check.
fn checked(matrix: &[f64], q: &[f64], case: &str) -> Option<Vec<f64>> {
    let z = lemke(matrix, q)?;
    let certificate = check(&Problem::new(matrix, q).unwrap(), &z).unwrap();
    assert!(
        certificate.natural_residual <= 1e-10,
        "{case}: {certificate:?}"
    );
    assert!(z.iter().all(|z| *z >= 0.0), "{case}");
    Some(z)
}

#[test]
fn unsymmetric_matrix_is_refused_by_every_method() {
    let skew = [1.0, 0.5, -0.5, 1.0];
    let q = [-1.0, -1.0];
    let problem = Problem::new(&skew, &q).unwrap();
    assert!(!problem.is_symmetric());
    let refused = Error::NotSymmetric {
        row: 1,
        column: 0,
        value: 0.5,
        mirrored: -0.5,
    };
    let (mut z, mut w) = ([0.0; 2], [0.0; 2]);
    let solvers: [&dyn Solver; 4] = [&Automatic, &BlockPivoting, &ActiveSet, &GaussSeidel];
    for solver in solvers {
        let answer = solver.solve(
            &problem,
            &Settings::default(),
            &mut Scratch::new(2),
            Start::Cold,
            &mut z,
            &mut w,
        );
        assert_eq!(answer.unwrap_err(), refused, "{}", solver.name());
    }
    assert_eq!(Problem::symmetric(&skew, &q).unwrap_err(), refused);
    // Round-off is no skewness.
    assert!(Problem::symmetric(&[1.0, 0.5, 0.5 + 1e-15, 1.0], &q).is_ok());
}

/// Positive principal minors, far from definite: a triangle with large entries, rows permuted alike.
#[test]
fn lemke_solves_matrices_with_positive_principal_minors() {
    let mut numbers = Numbers(5);
    // Not larger: the inverse of such a triangle grows with size^m.
    for (m, sizes) in [
        (1, [1.0, 10.0]),
        (4, [1.0, 10.0]),
        (12, [1.0, 4.0]),
        (40, [0.1, 0.5]),
    ] {
        for size in sizes {
            let mut order: Vec<usize> = (0..m).collect();
            order.sort_by_key(|i| (i * 7919) % 31);
            let mut matrix = vec![0.0; m * m];
            for i in 0..m {
                for j in 0..=i {
                    let entry = if i == j { 1.0 } else { size * numbers.next() };
                    matrix[order[j] * m + order[i]] = entry;
                }
            }
            let z: Vec<f64> = (0..m)
                .map(|i| (numbers.next() * (i % 2) as f64).abs())
                .collect();
            let w = z
                .iter()
                .map(|z| if *z == 0.0 { numbers.next().abs() } else { 0.0 });
            let q: Vec<f64> = w
                .enumerate()
                .map(|(i, w)| w - (0..m).map(|j| matrix[j * m + i] * z[j]).sum::<f64>())
                .collect();
            let case = format!("P-matrix of {m}, entries to {size}");
            let found = checked(&matrix, &q, &case).unwrap();
            assert!(
                distance(&found, &z) <= 1e-6 * max_abs(&z).max(1e-300),
                "{case}"
            );
        }
    }
}

/// Copositive-plus: semidefinite plus skew, or nonnegative with a positive diagonal. Lemke's method finds a solution or
/// ends on a ray, and then there is none.
#[test]
fn lemke_solves_copositive_plus_matrices_unless_there_is_no_solution() {
    let mut numbers = Numbers(6);
    let (mut n_solved, mut n_rays) = (0, 0);
    for m in [2, 5, 12, 25] {
        for kind in 0..10 {
            let matrix: Vec<f64> = if kind % 2 == 0 {
                let rank = m / 2 + 1;
                let a = numbers.take(m * rank);
                let skew = numbers.take(m * m);
                let entry = |i: usize, j: usize| -> f64 {
                    let products = (0..rank).map(|k| a[i * rank + k] * a[j * rank + k]);
                    let skew = 0.3 * (skew[i * m + j] - skew[j * m + i]);
                    products.sum::<f64>() / m as f64 + skew
                };
                (0..m * m).map(|k| entry(k % m, k / m)).collect()
            } else {
                let mut matrix: Vec<f64> = numbers.take(m * m).iter().map(|x| x.abs()).collect();
                for i in 0..m {
                    matrix[i * m + i] += 0.1;
                }
                matrix
            };
            let q = numbers.take(m);
            match checked(&matrix, &q, &format!("{m} rows, kind {kind}")) {
                Some(_) => n_solved += 1,
                // A positive diagonal and no negative entry: there is a solution.
                None => {
                    assert_eq!(kind % 2, 0, "{m} rows");
                    n_rays += 1;
                }
            }
        }
    }
    assert!(n_solved >= 20, "{n_solved} solved, {n_rays} on a ray");
}

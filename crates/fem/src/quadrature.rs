//! Quadrature on the reference tetrahedron and triangle, in barycentric coordinates.
//!
//! Weights sum to 1: multiply by the volume (for affine elements), or by |det J| / 6 at the point.

/// Which rule integrates the element matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quadrature {
    /// The lowest rule that is exact for the stiffness of a straight element: 1, 4 and 14 points
    /// for orders 1, 2 and 3. On curved elements it is an approximation that other programs share
    /// (the 4-point rule of C3D10).
    Fast,
    /// Straight elements as `Fast`, which is exact for them; every curved element by the lowest
    /// conical rule, from degree 11 to 29, that two degrees less would not have changed by 1e-6.
    /// A fixed degree does not do: 8 is enough for all but two elements of a clip with 2641, but
    /// leaves 1e-3 in the worst of the same clip with 297.
    Converged,
    /// A rule that integrates polynomials up to this degree exactly.
    Degree(u32),
}

/// A point with its weight; coordinates L_1..L_4 (tetrahedron) or L_1..L_3 (triangle).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraturePoint<const N: usize> {
    /// Barycentric coordinates, summing to 1.
    pub coordinates: [f64; N],
    /// Weight; all weights of a rule sum to 1 and are positive.
    pub weight: f64,
}

/// Rule on the tetrahedron that is exact up to `degree`, with the fewest points known here.
pub fn tetrahedron(degree: u32) -> Vec<QuadraturePoint<4>> {
    match degree {
        0 | 1 => vec![QuadraturePoint {
            coordinates: [0.25; 4],
            weight: 1.0,
        }],
        2 => four_points(),
        3..=5 => fourteen_points(),
        _ => conical_tetrahedron(degree),
    }
}

/// (1-3a, a, a, a), a = (5 - sqrt 5)/20: degree 2.
fn four_points() -> Vec<QuadraturePoint<4>> {
    let a = (5.0 - 5f64.sqrt()) / 20.0;
    (0..4)
        .map(|k| QuadraturePoint {
            coordinates: vertex_point(a, k),
            weight: 0.25,
        })
        .collect()
}

fn vertex_point(a: f64, k: usize) -> [f64; 4] {
    let mut coordinates = [a; 4];
    coordinates[k] = 1.0 - 3.0 * a;
    coordinates
}

/// 14 points, degree 5, all weights positive (Walkington 2000; Witherden and Vincent 2015).
fn fourteen_points() -> Vec<QuadraturePoint<4>> {
    let mut points = Vec::with_capacity(14);
    for (a, weight) in [
        (0.310_885_919_263_300_6, 0.112_687_925_718_015_86),
        (0.092_735_250_310_891_23, 0.073_493_043_116_361_95),
    ] {
        points.extend((0..4).map(|k| QuadraturePoint {
            coordinates: vertex_point(a, k),
            weight,
        }));
    }
    let b = 0.045_503_704_125_649_65;
    for i in 0..4 {
        for j in 0..i {
            let mut coordinates = [b; 4];
            coordinates[i] = 0.5 - b;
            coordinates[j] = 0.5 - b;
            points.push(QuadraturePoint {
                coordinates,
                weight: 0.042_546_020_777_081_466,
            });
        }
    }
    points
}

/// Product of Gauss-Jacobi rules collapsed onto the tetrahedron: n³ points, degree 2n - 1.
fn conical_tetrahedron(degree: u32) -> Vec<QuadraturePoint<4>> {
    let n = degree as usize / 2 + 1;
    let (u, v, w) = (
        gauss_jacobi(n, 2.0),
        gauss_jacobi(n, 1.0),
        gauss_jacobi(n, 0.0),
    );
    let mut points = Vec::with_capacity(n * n * n);
    for &(a, wa) in &u {
        for &(b, wb) in &v {
            for &(c, wc) in &w {
                let l1 = a;
                let l2 = b * (1.0 - a);
                let l3 = c * (1.0 - a) * (1.0 - b);
                points.push(QuadraturePoint {
                    coordinates: [1.0 - l1 - l2 - l3, l1, l2, l3],
                    weight: 6.0 * wa * wb * wc,
                });
            }
        }
    }
    points
}

/// Rule on the triangle that is exact up to `degree`: a conical product, positive weights.
pub fn triangle(degree: u32) -> Vec<QuadraturePoint<3>> {
    let n = degree as usize / 2 + 1;
    let (u, v) = (gauss_jacobi(n, 1.0), gauss_jacobi(n, 0.0));
    let mut points = Vec::with_capacity(n * n);
    for &(a, wa) in &u {
        for &(b, wb) in &v {
            let l2 = b * (1.0 - a);
            points.push(QuadraturePoint {
                coordinates: [1.0 - a - l2, a, l2],
                weight: 2.0 * wa * wb,
            });
        }
    }
    points
}

/// Nodes and weights of the integral of (1 - x)^alpha f(x) over [0, 1], exact to degree 2n - 1.
///
/// Golub and Welsch 1969: eigenvalues of the Jacobi matrix of the orthogonal polynomials.
fn gauss_jacobi(n: usize, alpha: f64) -> Vec<(f64, f64)> {
    let mut jacobi = nalgebra::DMatrix::<f64>::zeros(n, n);
    for k in 0..n {
        let kf = k as f64;
        let s = 2.0 * kf + alpha;
        // On [-1, 1] with weight (1 - t)^alpha.
        jacobi[(k, k)] = if alpha == 0.0 {
            0.0
        } else {
            -alpha * alpha / (s * (s + 2.0))
        };
        if k > 0 {
            let b = 4.0 * kf * (kf + alpha) * kf * (kf + alpha) / (s * s * (s + 1.0) * (s - 1.0));
            jacobi[(k, k - 1)] = b.sqrt();
            jacobi[(k - 1, k)] = b.sqrt();
        }
    }
    let eigen = jacobi.symmetric_eigen();
    let total = 1.0 / (alpha + 1.0);
    (0..n)
        .map(|i| {
            let first = eigen.eigenvectors[(0, i)];
            (0.5 * (eigen.eigenvalues[i] + 1.0), total * first * first)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: u32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    /// Mean of L1^a L2^b L3^c over the tetrahedron: 3! a! b! c! / (a + b + c + 3)!.
    fn worst_error(rule: &[QuadraturePoint<4>], degree: u32) -> f64 {
        let mut worst = 0.0f64;
        for a in 0..=degree {
            for b in 0..=degree - a {
                let c = degree - a - b;
                let exact =
                    6.0 * factorial(a) * factorial(b) * factorial(c) / factorial(degree + 3);
                let sum: f64 = rule
                    .iter()
                    .map(|p| {
                        let [x, y, z, _] = p.coordinates;
                        p.weight * x.powi(a as i32) * y.powi(b as i32) * z.powi(c as i32)
                    })
                    .sum();
                worst = worst.max((sum - exact).abs() / exact);
            }
        }
        worst
    }

    #[test]
    fn rules_are_exact_to_their_degree_and_not_beyond() {
        for (asked, exact_to) in [(1, 1), (2, 2), (5, 5), (7, 7), (9, 9), (11, 11)] {
            let rule = tetrahedron(asked);
            assert!(rule.iter().all(|p| p.weight > 0.0));
            for degree in 0..=exact_to {
                assert!(
                    worst_error(&rule, degree) < 1e-12,
                    "degree {degree} by rule {asked}"
                );
            }
            assert!(
                worst_error(&rule, exact_to + 1) > 1e-9,
                "rule {asked} is better than it says"
            );
        }
    }

    #[test]
    fn triangle_rules_integrate_monomials() {
        for degree in 0..=8 {
            let rule = triangle(degree);
            for a in 0..=degree {
                let b = degree - a;
                let exact = 2.0 * factorial(a) * factorial(b) / factorial(degree + 2);
                let sum: f64 = rule
                    .iter()
                    .map(|p| {
                        p.weight * p.coordinates[1].powi(a as i32) * p.coordinates[2].powi(b as i32)
                    })
                    .sum();
                assert!((sum - exact).abs() < 1e-13 * exact.max(1e-3), "{degree}");
            }
        }
    }
}

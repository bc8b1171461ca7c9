//! Whether det J of an element is positive everywhere, decided by Bernstein coefficients.
//!
//! det J of order p is a polynomial of degree m = 3 (p - 1): 3 for tet10, 6 for tet20. Written in
//! Bernstein polynomials `B_α = m! / (α_1! α_2! α_3! α_4!) L^α`, which are not negative and sum to
//! 1, it lies between its smallest and largest coefficient. So positive coefficients prove a valid
//! element. If one is not positive, the element is divided, which sharpens the bound.
//!
//! Source: Johnen, Remacle, Geuzaine 2013 (curved elements' validity by Bézier coefficients).

use std::sync::OnceLock;

use super::Mesh;
use super::refine::{DIAGONALS, children};
use crate::element::{MAX_NODES, Order};
use crate::geometry::determinant;

/// Divisions: 512 parts at most, only for elements near the limit. None that is invalid passes;
/// refused though valid are only some whose smallest det J is below 0.5 % of that of the straight
/// element (the bends of the tests).
const MAX_DEPTH: u32 = 3;

impl Mesh {
    /// Lower bound of det J in an element, m³ (6 times the volume for straight elements, where it
    /// is the value): a positive answer proves the element valid. Not finite if it overflows.
    pub fn smallest_jacobian(&self, element: usize) -> f64 {
        let x = self.element_coordinates(element);
        match self.order {
            Order::Linear => determinant(&crate::geometry::jacobian(&linear_derivatives(), &x)),
            order => {
                static BASES: [OnceLock<Bernstein>; Order::HIGHEST as usize + 1] =
                    [const { OnceLock::new() }; Order::HIGHEST as usize + 1];
                BASES[order as usize]
                    .get_or_init(|| Bernstein::new(order))
                    .lower_bound(&x)
            }
        }
    }
}

/// L_1..L_4 by themselves.
fn linear_derivatives() -> [[f64; 4]; 4] {
    std::array::from_fn(|a| std::array::from_fn(|k| f64::from(u8::from(a == k))))
}

/// What turns the nodes of an element into the Bernstein coefficients of det J.
struct Bernstein {
    n_nodes: usize,
    /// Derivatives of the shape functions by (L_2, L_3, L_4), `n_nodes` for each of the points of
    /// the lattice with m steps, which has as many points as there are coefficients.
    derivatives: Vec<[f64; 3]>,
    /// Coefficients from the values at the lattice, by rows.
    from_values: Vec<f64>,
    /// Values at the lattice of each of eight parts from the coefficients on the whole, by rows.
    values_in_part: Vec<Vec<f64>>,
}

impl Bernstein {
    fn new(order: Order) -> Self {
        let n_nodes = order.nodes_per_element();
        let degree = 3 * (order as u32 - 1);
        let powers = powers(degree);
        let lattice: Vec<[f64; 4]> = powers
            .iter()
            .map(|a| a.map(|a| f64::from(a) / f64::from(degree)))
            .collect();
        let mut derivatives = Vec::with_capacity(lattice.len() * n_nodes);
        for &l in &lattice {
            let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            order.shape(l, &mut values, &mut d);
            let by_r = |d: &[f64; 4]| [d[1] - d[0], d[2] - d[0], d[3] - d[0]];
            derivatives.extend(d[..n_nodes].iter().map(by_r));
        }
        // Polynomials at points, one row for each point.
        let polynomials = |points: &[[f64; 4]]| -> Vec<f64> {
            points
                .iter()
                .flat_map(|l| powers.iter().map(|a| bernstein(degree, a, l)))
                .collect()
        };
        let n = lattice.len();
        let vandermonde = nalgebra::DMatrix::from_row_slice(n, n, &polynomials(&lattice));
        // The lattice determines a polynomial of its degree, so this matrix is always regular.
        let inverse = vandermonde
            .lu()
            .try_inverse()
            .unwrap_or_else(|| unreachable!("the lattice is unisolvent"));
        let values_in_part = children(&DIAGONALS[0])
            .iter()
            .map(|corners| {
                let points: Vec<[f64; 4]> = lattice
                    .iter()
                    .map(|l| {
                        std::array::from_fn(|v| {
                            (0..4)
                                .map(|c| l[c] * 0.5 * f64::from(corners[c][v]))
                                .sum::<f64>()
                        })
                    })
                    .collect();
                polynomials(&points)
            })
            .collect();
        Self {
            n_nodes,
            derivatives,
            // Columns of the transposed are rows.
            from_values: inverse.transpose().as_slice().to_vec(),
            values_in_part,
        }
    }

    /// Lower bound of det J of the element with these nodes.
    fn lower_bound(&self, x: &[[f64; 3]; MAX_NODES]) -> f64 {
        let values: Vec<f64> = self
            .derivatives
            .chunks_exact(self.n_nodes)
            .map(|derivatives| {
                let mut j = [[0.0; 3]; 3];
                for (x, d) in x.iter().zip(derivatives) {
                    for i in 0..3 {
                        for k in 0..3 {
                            j[i][k] += x[i] * d[k];
                        }
                    }
                }
                determinant(&j)
            })
            .collect();
        self.bound(&values, MAX_DEPTH)
    }

    /// Lower bound of the polynomial with these values at the lattice.
    fn bound(&self, values: &[f64], depth: u32) -> f64 {
        let coefficients = multiply(&self.from_values, values);
        let lowest = coefficients.iter().copied().fold(f64::INFINITY, smaller);
        // A value that is not positive is a proof too; no division can mend it.
        let is_decided = lowest > 0.0 || lowest.is_nan() || values.iter().any(|v| *v <= 0.0);
        if is_decided || depth == 0 {
            return lowest;
        }
        self.values_in_part
            .iter()
            .map(|part| self.bound(&multiply(part, &coefficients), depth - 1))
            .fold(f64::INFINITY, smaller)
    }
}

/// Matrix by rows times vector.
fn multiply(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix
        .chunks_exact(vector.len())
        .map(|row| row.iter().zip(vector).map(|(m, v)| m * v).sum())
        .collect()
}

/// All α of four numbers with this sum.
fn powers(degree: u32) -> Vec<[u32; 4]> {
    let mut powers = Vec::new();
    for a in 0..=degree {
        for b in 0..=degree - a {
            for c in 0..=degree - a - b {
                powers.push([a, b, c, degree - a - b - c]);
            }
        }
    }
    powers
}

fn bernstein(degree: u32, powers: &[u32; 4], l: &[f64; 4]) -> f64 {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    powers
        .iter()
        .zip(l)
        .fold(factorial(degree), |product, (&a, l)| {
            product * l.powi(a as i32) / factorial(a)
        })
}

/// The smaller one; not a number if either is not, so that overflow does not pass as valid.
fn smaller(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial with a coefficient of one alone: 1 there, 0 elsewhere, on the whole; on the
    /// parts its values again.
    #[test]
    fn coefficients_are_those_of_the_polynomial() {
        for order in [Order::Quadratic, Order::Cubic] {
            let basis = Bernstein::new(order);
            let degree = 3 * (order as u32 - 1);
            let powers = powers(degree);
            let point = |a: &[u32; 4]| a.map(|a| f64::from(a) / f64::from(degree));
            for (i, chosen) in powers.iter().enumerate() {
                let values: Vec<f64> = powers
                    .iter()
                    .map(|a| bernstein(degree, chosen, &point(a)))
                    .collect();
                let coefficients = multiply(&basis.from_values, &values);
                for (j, c) in coefficients.iter().enumerate() {
                    let exact = f64::from(u8::from(i == j));
                    assert!((c - exact).abs() < 1e-13, "order {order}: {c}");
                }
                // The last part is in the octahedron: its first corner halves an edge.
                let corners = children(&DIAGONALS[0])[7];
                let inside = multiply(&basis.values_in_part[7], &coefficients);
                for (a, value) in powers.iter().zip(inside) {
                    let l: [f64; 4] = std::array::from_fn(|v| {
                        (0..4)
                            .map(|c| point(a)[c] * 0.5 * f64::from(corners[c][v]))
                            .sum()
                    });
                    assert!((value - bernstein(degree, chosen, &l)).abs() < 1e-13);
                }
            }
        }
    }
}

//! Element stiffness matrices.

use std::sync::OnceLock;

use crate::element::{MAX_NODES, Order};
use crate::geometry::{determinant, inverse};
use crate::material::Material;
use crate::quadrature::{self, Quadrature};

/// Degrees of freedom of the largest element.
const MAX_SIZE: usize = 3 * MAX_NODES;

/// Degrees tried on a curved element, each with one point more in every direction than the last:
/// 125 points at first, 3375 at most. The worst elements of a clip of 297 elements need degree 23.
const LADDER: [u32; 11] = [9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29];

/// Largest relative change (Frobenius norm) of an element matrix by two more degrees. Far below
/// the error of the elements themselves; beyond it, results of other programs would not be met.
const CONVERGED: f64 = 1e-6;

/// Distance of a mid node from its place on the straight element, over the element's extent,
/// below which the element counts as straight. Round-off of coordinates is 1e-12 or less; a
/// deviation of this size changes K_e by about as much.
const STRAIGHT: f64 = 1e-10;

/// Rules for the element matrices of a mesh, shared by all its elements.
#[derive(Debug)]
pub(crate) struct ElementRule {
    order: Order,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Fixed(Points),
    /// Exact rule for straight elements, and rules of [`LADDER`], made when first needed.
    Converged(Points, Box<[OnceLock<Points>; LADDER.len()]>),
}

/// Points of a rule: weights / 6 and derivatives of the shape functions by (L_2, L_3, L_4).
#[derive(Debug)]
struct Points {
    weights: Vec<f64>,
    /// `nodes_per_element` entries for each point.
    derivatives: Vec<[f64; 3]>,
}

impl Points {
    fn new(order: Order, degree: u32) -> Self {
        let n = order.nodes_per_element();
        let mut points = Self {
            weights: Vec::new(),
            derivatives: Vec::new(),
        };
        for p in quadrature::tetrahedron(degree) {
            let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            order.shape(p.coordinates, &mut values, &mut d);
            points.weights.push(p.weight / 6.0);
            let by_r = |d: &[f64; 4]| [d[1] - d[0], d[2] - d[0], d[3] - d[0]];
            points.derivatives.extend(d[..n].iter().map(by_r));
        }
        points
    }

    /// S = ∫ g gᵀ dV for the 3n gradient components g, upper triangle by rows, m.
    fn gradient_products(&self, x: &[[f64; 3]], s: &mut [f64]) {
        let size = 3 * x.len();
        s.fill(0.0);
        let mut g = [0.0; MAX_SIZE];
        for (weight, derivatives) in self.weights.iter().zip(self.derivatives.chunks(x.len())) {
            let mut j = [[0.0; 3]; 3];
            for (x, d) in x.iter().zip(derivatives) {
                for i in 0..3 {
                    for k in 0..3 {
                        j[i][k] += x[i] * d[k];
                    }
                }
            }
            let det = determinant(&j);
            let inv = inverse(&j, det);
            for (g, d) in g.chunks_exact_mut(3).zip(derivatives) {
                for i in 0..3 {
                    g[i] = d[0] * inv[0][i] + d[1] * inv[1][i] + d[2] * inv[2][i];
                }
            }
            let volume = det.abs() * weight;
            for (r, row) in s.chunks_exact_mut(size).enumerate() {
                let scaled = volume * g[r];
                for (entry, g) in row[r..].iter_mut().zip(&g[r..size]) {
                    *entry += scaled * g;
                }
            }
        }
    }
}

impl ElementRule {
    pub(crate) fn new(order: Order, quadrature: Quadrature) -> Self {
        let kind = match quadrature {
            Quadrature::Fast => Kind::Fixed(Points::new(order, order.stiffness_degree())),
            Quadrature::Degree(degree) => Kind::Fixed(Points::new(order, degree)),
            Quadrature::Converged => Kind::Converged(
                Points::new(order, order.stiffness_degree()),
                Box::new([const { OnceLock::new() }; LADDER.len()]),
            ),
        };
        Self { order, kind }
    }

    /// K_e = ∫ Bᵀ D B dV, N/m, by rows: 3n x 3n for n nodes.
    ///
    /// For isotropic elasticity no B is needed: with S_ab = ∫ g_a g_bᵀ dV of the gradients g,
    /// `K_ab = λ S_ab + μ S_abᵀ + μ tr(S_ab) I`.
    pub(crate) fn stiffness(&self, x: &[[f64; 3]; MAX_NODES], material: &Material, k: &mut [f64]) {
        let n = self.order.nodes_per_element();
        let size = 3 * n;
        let mut memory = vec![0.0; size * size];
        let s = memory.as_mut_slice();
        self.gradient_products(&x[..n], s);
        let (lambda, mu) = (material.lame_lambda(), material.shear_modulus());
        for a in 0..n {
            // Only the upper triangle of the block on the diagonal was summed.
            for i in 1..3 {
                for j in 0..i {
                    s[(3 * a + i) * size + 3 * a + j] = s[(3 * a + j) * size + 3 * a + i];
                }
            }
            for b in a..n {
                let at = |i: usize, j: usize| s[(3 * a + i) * size + 3 * b + j];
                let trace = mu * (at(0, 0) + at(1, 1) + at(2, 2));
                for i in 0..3 {
                    for j in 0..3 {
                        let entry =
                            lambda * at(i, j) + mu * at(j, i) + if i == j { trace } else { 0.0 };
                        k[(3 * a + i) * size + 3 * b + j] = entry;
                        k[(3 * b + j) * size + 3 * a + i] = entry;
                    }
                }
            }
        }
    }

    fn gradient_products(&self, x: &[[f64; 3]], s: &mut [f64]) {
        let (straight, ladder) = match &self.kind {
            Kind::Fixed(points) => return points.gradient_products(x, s),
            Kind::Converged(straight, ladder) => (straight, ladder),
        };
        if self.is_straight(x) {
            return straight.gradient_products(x, s);
        }
        let mut memory = vec![0.0; s.len()];
        let coarser = memory.as_mut_slice();
        for (step, (points, degree)) in ladder.iter().zip(LADDER).enumerate() {
            coarser.copy_from_slice(s);
            points
                .get_or_init(|| Points::new(self.order, degree))
                .gradient_products(x, s);
            let norm_sq = s.iter().map(|v| v * v).sum::<f64>();
            let change_sq = s.iter().zip(&*coarser).map(|(a, b)| (a - b) * (a - b));
            if step > 0 && change_sq.sum::<f64>() <= CONVERGED * CONVERGED * norm_sq {
                return;
            }
        }
    }

    /// Whether all nodes are where a straight element has them.
    fn is_straight(&self, x: &[[f64; 3]]) -> bool {
        let extent = (0..3)
            .map(|c| {
                let along = x.iter().map(|x| x[c]);
                let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                    (a.min(x), b.max(x))
                });
                high - low
            })
            .fold(0.0, f64::max);
        let nodes = self.order.node_coordinates();
        nodes.iter().zip(x).all(|(l, node)| {
            (0..3).all(|c| {
                let straight: f64 = (0..4).map(|v| l[v] * x[v][c]).sum();
                (node[c] - straight).abs() <= STRAIGHT * extent
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with slightly bent edges.
    fn curved(order: Order) -> [[f64; 3]; MAX_NODES] {
        let mut x = [[0.0; 3]; MAX_NODES];
        for (x, l) in x.iter_mut().zip(order.node_coordinates()) {
            let p = [
                1.1 * l[1] + 0.2 * l[2],
                0.9 * l[2] + 0.1 * l[3],
                1.3 * l[3] + 0.2 * l[1],
            ];
            *x = [
                p[0] + 0.05 * p[1] * p[2],
                p[1] - 0.07 * p[0] * p[2],
                p[2] + 0.04 * p[0] * p[1],
            ];
        }
        x
    }

    #[test]
    fn rigid_motions_of_a_curved_element_cost_no_force() {
        let material = Material::new(2.3e9, 0.37).unwrap();
        for order in [Order::Linear, Order::Quadratic, Order::Cubic] {
            let n = order.nodes_per_element();
            let x = curved(order);
            let mut k = vec![0.0; 9 * n * n];
            ElementRule::new(order, Quadrature::Converged).stiffness(&x, &material, &mut k);
            let scale = k.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            for motion in 0..6 {
                let u: Vec<f64> = (0..n)
                    .flat_map(|a| match motion {
                        0 => [1.0, 0.0, 0.0],
                        1 => [0.0, 1.0, 0.0],
                        2 => [0.0, 0.0, 1.0],
                        3 => [0.0, -x[a][2], x[a][1]],
                        4 => [x[a][2], 0.0, -x[a][0]],
                        _ => [-x[a][1], x[a][0], 0.0],
                    })
                    .collect();
                for row in k.chunks_exact(3 * n) {
                    let force: f64 = row.iter().zip(&u).map(|(k, u)| k * u).sum();
                    assert!(
                        force.abs() < 1e-12 * scale,
                        "{order:?} motion {motion}: {force}"
                    );
                }
            }
        }
    }

    fn matrix(order: Order, x: &[[f64; 3]; MAX_NODES], quadrature: Quadrature) -> Vec<f64> {
        let n = order.nodes_per_element();
        let mut k = vec![0.0; 9 * n * n];
        let material = Material::new(2.7e9, 0.35).unwrap();
        ElementRule::new(order, quadrature).stiffness(x, &material, &mut k);
        k
    }

    fn relative_change(k: &[f64], reference: &[f64]) -> f64 {
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        norm(&mut k.iter().zip(reference).map(|(a, b)| a - b))
            / norm(&mut reference.iter().copied())
    }

    /// A tetrahedron along an arc of 1.4 rad, as on a mesh of the paper's size.
    fn arc(order: Order) -> [[f64; 3]; MAX_NODES] {
        let mut x = [[0.0; 3]; MAX_NODES];
        for (x, l) in x.iter_mut().zip(order.node_coordinates()) {
            let (radius, angle) = (1.0 + 0.5 * l[1], 0.3 * l[1] - 1.4 * l[2]);
            *x = [radius * angle.cos(), radius * angle.sin(), -0.6 * l[3]];
        }
        x
    }

    #[test]
    fn the_converged_rule_is_converged_where_a_fixed_degree_is_not() {
        for order in [Order::Quadratic, Order::Cubic] {
            for (x, is_hard) in [(curved(order), false), (arc(order), true)] {
                let reference = matrix(order, &x, Quadrature::Degree(39));
                let converged =
                    relative_change(&matrix(order, &x, Quadrature::Converged), &reference);
                assert!(converged < 1e-6, "{order:?}: {converged:e}");
                let nine = relative_change(&matrix(order, &x, Quadrature::Degree(9)), &reference);
                assert_eq!(nine > 1e-6, is_hard, "{order:?}: {nine:e}");
            }
        }
    }

    #[test]
    fn straight_elements_need_no_more_than_the_fast_rule() {
        for order in [Order::Linear, Order::Quadratic, Order::Cubic] {
            let mut x = [[0.0; 3]; MAX_NODES];
            for (x, l) in x.iter_mut().zip(order.node_coordinates()) {
                *x = [
                    7.0 + 1.1 * l[1] + 0.2 * l[2],
                    0.9 * l[2] + 0.1 * l[3],
                    1.3 * l[3] + 0.2 * l[1],
                ];
            }
            let fast = matrix(order, &x, Quadrature::Fast);
            assert_eq!(fast, matrix(order, &x, Quadrature::Converged));
            let higher = matrix(order, &x, Quadrature::Degree(12));
            assert!(relative_change(&fast, &higher) < 1e-13, "{order:?}");
        }
    }
}

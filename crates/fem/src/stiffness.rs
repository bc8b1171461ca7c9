//! Element stiffness matrices.

use crate::element::{MAX_NODES, Order};
use crate::geometry::gradients;
use crate::material::Material;
use crate::quadrature::{self, Quadrature};

/// Shape-function derivatives at the points of a rule, shared by all elements of a mesh.
#[derive(Debug)]
pub(crate) struct ElementRule {
    order: Order,
    points: Vec<(f64, [[f64; 4]; MAX_NODES])>,
}

impl ElementRule {
    pub(crate) fn new(order: Order, quadrature: Quadrature) -> Self {
        let degree = match (quadrature, order) {
            (Quadrature::Fast, _) => order.stiffness_degree(),
            (Quadrature::Converged, Order::Linear) => 0,
            (Quadrature::Converged, Order::Quadratic) => 8,
            (Quadrature::Converged, Order::Cubic) => 12,
            (Quadrature::Degree(degree), _) => degree,
        };
        let points = quadrature::tetrahedron(degree)
            .into_iter()
            .map(|p| {
                let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
                order.shape(p.coordinates, &mut n, &mut d);
                (p.weight, d)
            })
            .collect();
        Self { order, points }
    }

    /// K_e = ∫ Bᵀ D B dV, N/m, by rows: 3n x 3n for n nodes.
    ///
    /// For isotropic elasticity the block of nodes a, b needs no B: with gradients g,
    /// `λ g_a g_bᵀ + μ g_b g_aᵀ + μ (g_a·g_b) I`.
    pub(crate) fn stiffness(&self, x: &[[f64; 3]; MAX_NODES], material: &Material, k: &mut [f64]) {
        let n = self.order.nodes_per_element();
        let size = 3 * n;
        let (lambda, mu) = (material.lame_lambda(), material.shear_modulus());
        k[..size * size].fill(0.0);
        let mut g = [[0.0; 3]; MAX_NODES];
        for (weight, derivatives) in &self.points {
            let volume = gradients(&derivatives[..n], x, &mut g).abs() * weight / 6.0;
            let (l, m) = (lambda * volume, mu * volume);
            for a in 0..n {
                for b in a..n {
                    let dot = m * (g[a][0] * g[b][0] + g[a][1] * g[b][1] + g[a][2] * g[b][2]);
                    for i in 0..3 {
                        let row = &mut k[(3 * a + i) * size + 3 * b..][..3];
                        for (j, entry) in row.iter_mut().enumerate() {
                            *entry += l * g[a][i] * g[b][j] + m * g[a][j] * g[b][i];
                        }
                        row[i] += dot;
                    }
                }
            }
        }
        for row in 0..size {
            for column in 0..row {
                k[row * size + column] = k[column * size + row];
            }
        }
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

    #[test]
    fn the_converged_rule_is_converged() {
        let material = Material::new(2.7e9, 0.35).unwrap();
        for order in [Order::Quadratic, Order::Cubic] {
            let n = order.nodes_per_element();
            let x = curved(order);
            let (mut k, mut finer) = (vec![0.0; 9 * n * n], vec![0.0; 9 * n * n]);
            ElementRule::new(order, Quadrature::Converged).stiffness(&x, &material, &mut k);
            ElementRule::new(order, Quadrature::Degree(18)).stiffness(&x, &material, &mut finer);
            let scale = k.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            let worst = k
                .iter()
                .zip(&finer)
                .fold(0.0f64, |a, (x, y)| a.max((x - y).abs()));
            assert!(worst < 1e-6 * scale, "{order:?}: {:e}", worst / scale);
        }
    }
}

//! Volumes and lengths.

use super::Mesh;
use crate::element::{MAX_NODES, Order};
use crate::geometry::{determinant, jacobian};
use crate::quadrature;

/// Edges of a tetrahedron by its vertices.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

impl Mesh {
    /// Volume of the body, m³: exact for the elements as they are, straight or curved.
    pub fn volume(&self) -> f64 {
        let rule = rule(self.order);
        (0..self.n_elements())
            .map(|e| self.integrate(e, &rule))
            .sum()
    }

    /// Volume of an element, m³; negative if it is inverted.
    pub fn element_volume(&self, element: usize) -> f64 {
        self.integrate(element, &rule(self.order))
    }

    /// Straight distances between the vertices of an element, m.
    pub fn edge_lengths(&self, element: usize) -> [f64; 6] {
        let nodes = self.element_nodes(element);
        EDGES.map(|[a, b]| {
            let (a, b) = (self.nodes[nodes[a] as usize], self.nodes[nodes[b] as usize]);
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
        })
    }

    fn integrate(&self, element: usize, rule: &[(f64, [[f64; 4]; MAX_NODES])]) -> f64 {
        let x = self.element_coordinates(element);
        let n = self.order.nodes_per_element();
        rule.iter()
            .map(|(weight, d)| weight * determinant(&jacobian(&d[..n], &x)) / 6.0)
            .sum()
    }
}

/// det J is a polynomial of degree 3 (p - 1).
fn rule(order: Order) -> Vec<(f64, [[f64; 4]; MAX_NODES])> {
    quadrature::tetrahedron(3 * (order as u32 - 1))
        .into_iter()
        .map(|p| {
            let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            order.shape(p.coordinates, &mut values, &mut d);
            (p.weight, d)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x² along one edge, an affine map elsewhere: the volume is known by hand.
    #[test]
    fn volume_of_a_curved_element_is_that_of_the_integral() {
        for order in [Order::Linear, Order::Quadratic, Order::Cubic] {
            let bend = if order == Order::Linear { 0.0 } else { 0.2 };
            let nodes: Vec<[f64; 3]> = order
                .node_coordinates()
                .iter()
                .map(|l| [2.0 * l[1] + bend * l[1] * l[1], l[2], l[3]])
                .collect();
            let n = nodes.len() as u64;
            let mesh = Mesh::new(
                order,
                nodes,
                (1..=n).collect(),
                (0..n as u32).collect(),
                vec![1],
                vec![],
            );
            // ∫ (2 + 2 b r) over the unit tetrahedron: 2/6 + 2 b/24.
            let exact = 1.0 / 3.0 + bend / 12.0;
            assert!((mesh.volume() - exact).abs() < 1e-14, "order {order}");
            assert_eq!(mesh.element_volume(0), mesh.volume());
            let lengths = mesh.edge_lengths(0);
            assert!((lengths[0] - 2.0 - bend).abs() < 1e-14);
            assert!((lengths[5] - 2f64.sqrt()).abs() < 1e-14);
        }
    }
}

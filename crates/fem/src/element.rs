//! Tetrahedra of order 1, 2 and 3: where their nodes are and what their shape functions are.
//!
//! One file for each, with its drawing, node order and functions. The order is Gmsh's; other
//! programs swap nodes 8 and 9 of tet10.

mod tet10;
mod tet20;
mod tet4;

use std::fmt;

/// Polynomial order of the elements of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Order {
    /// tet4.
    Linear = 1,
    /// tet10.
    Quadratic = 2,
    /// tet20.
    Cubic = 3,
}

/// Most nodes that an element has.
pub const MAX_NODES: usize = 20;

/// Vertices of the four faces, turned so that the normal points out of the element.
pub const FACE_VERTICES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

impl Order {
    /// From the number 1, 2 or 3.
    pub fn try_from_number(order: u8) -> Option<Self> {
        match order {
            1 => Some(Self::Linear),
            2 => Some(Self::Quadratic),
            3 => Some(Self::Cubic),
            _ => None,
        }
    }

    /// 4, 10 or 20.
    pub fn nodes_per_element(self) -> usize {
        match self {
            Self::Linear => 4,
            Self::Quadratic => 10,
            Self::Cubic => 20,
        }
    }

    /// 3, 6 or 10.
    pub fn nodes_per_face(self) -> usize {
        match self {
            Self::Linear => 3,
            Self::Quadratic => 6,
            Self::Cubic => 10,
        }
    }

    /// Degree of the stiffness integrand on a straight element: 2 (p - 1).
    pub fn stiffness_degree(self) -> u32 {
        2 * (self as u32 - 1)
    }

    /// Edges that carry mid nodes, in the order of those nodes.
    pub fn edges(self) -> &'static [[usize; 2]] {
        match self {
            Self::Linear => &[],
            Self::Quadratic => &tet10::EDGES,
            Self::Cubic => &tet20::EDGES,
        }
    }

    /// Barycentric coordinates of the nodes.
    pub fn node_coordinates(self) -> Vec<[f64; 4]> {
        match self {
            Self::Linear => vertices(),
            Self::Quadratic => tet10::nodes(),
            Self::Cubic => tet20::nodes(),
        }
    }

    /// Local nodes of face `face`, in the order of Gmsh's triangle of this order: vertices, then
    /// edge nodes along 01, 12, 20, then the centre. The normal points out of the element.
    pub fn face_nodes(self, face: usize) -> Vec<usize> {
        let vertices = FACE_VERTICES[face];
        let mut nodes = vertices.to_vec();
        for k in 0..3 {
            let (a, b) = (vertices[k], vertices[(k + 1) % 3]);
            match self {
                Self::Linear => {}
                Self::Quadratic => {
                    nodes.extend(
                        tet10::EDGES
                            .iter()
                            .position(|e| *e == [a, b] || *e == [b, a])
                            .map(|e| 4 + e),
                    );
                }
                Self::Cubic => {
                    for (e, edge) in tet20::EDGES.iter().enumerate() {
                        if *edge == [a, b] {
                            nodes.extend([4 + 2 * e, 5 + 2 * e]);
                        } else if *edge == [b, a] {
                            nodes.extend([5 + 2 * e, 4 + 2 * e]);
                        }
                    }
                }
            }
        }
        if self == Self::Cubic {
            let mut sorted = vertices;
            sorted.sort_unstable();
            nodes.extend(
                tet20::FACES
                    .iter()
                    .position(|f| *f == sorted)
                    .map(|f| 16 + f),
            );
        }
        nodes
    }

    /// Shape functions and their derivatives by L_1..L_4 (taken as independent) at a point.
    /// Writes the first `nodes_per_element` entries.
    pub fn shape(
        self,
        l: [f64; 4],
        values: &mut [f64; MAX_NODES],
        derivatives: &mut [[f64; 4]; MAX_NODES],
    ) {
        *derivatives = [[0.0; 4]; MAX_NODES];
        match self {
            Self::Linear => tet4::shape(l, values, derivatives),
            Self::Quadratic => tet10::shape(l, values, derivatives),
            Self::Cubic => tet20::shape(l, values, derivatives),
        }
    }
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", *self as u8)
    }
}

fn vertices() -> Vec<[f64; 4]> {
    (0..4).map(|v| between(&[(v, 1.0)])).collect()
}

/// The point with these weights of these vertices.
fn between(weights: &[(usize, f64)]) -> [f64; 4] {
    let mut l = [0.0; 4];
    for &(vertex, weight) in weights {
        l[vertex] = weight;
    }
    l
}

/// Shape functions of the triangle with 3, 6 or 10 nodes and their derivatives by L_1..L_3.
pub(crate) fn face_shape(
    order: Order,
    l: [f64; 3],
    values: &mut [f64; 10],
    derivatives: &mut [[f64; 3]; 10],
) {
    const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
    *derivatives = [[0.0; 3]; 10];
    for v in 0..3 {
        let x = l[v];
        (values[v], derivatives[v][v]) = match order {
            Order::Linear => (x, 1.0),
            Order::Quadratic => (x * (2.0 * x - 1.0), 4.0 * x - 1.0),
            Order::Cubic => (
                0.5 * x * (3.0 * x - 1.0) * (3.0 * x - 2.0),
                13.5 * x * x - 9.0 * x + 1.0,
            ),
        };
    }
    for (e, [a, b]) in EDGES.into_iter().enumerate() {
        match order {
            Order::Linear => {}
            Order::Quadratic => {
                values[3 + e] = 4.0 * l[a] * l[b];
                derivatives[3 + e][a] = 4.0 * l[b];
                derivatives[3 + e][b] = 4.0 * l[a];
            }
            Order::Cubic => {
                for (k, (near, far)) in [(a, b), (b, a)].into_iter().enumerate() {
                    let node = 3 + 2 * e + k;
                    values[node] = 4.5 * l[near] * l[far] * (3.0 * l[near] - 1.0);
                    derivatives[node][near] = 4.5 * l[far] * (6.0 * l[near] - 1.0);
                    derivatives[node][far] = 4.5 * l[near] * (3.0 * l[near] - 1.0);
                }
            }
        }
    }
    if order == Order::Cubic {
        values[9] = 27.0 * l[0] * l[1] * l[2];
        for k in 0..3 {
            derivatives[9][k] = 27.0 * l[(k + 1) % 3] * l[(k + 2) % 3];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDERS: [Order; 3] = [Order::Linear, Order::Quadratic, Order::Cubic];
    const POINT: [f64; 4] = [0.13, 0.22, 0.41, 0.24];

    #[test]
    fn shape_functions_are_one_at_their_node_and_sum_to_one() {
        for order in ORDERS {
            let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            let count = order.nodes_per_element();
            for (i, l) in order.node_coordinates().into_iter().enumerate() {
                order.shape(l, &mut n, &mut d);
                for (j, value) in n[..count].iter().enumerate() {
                    assert!(
                        (value - f64::from(u8::from(i == j))).abs() < 1e-14,
                        "{order:?} {i} {j}"
                    );
                }
            }
            order.shape(POINT, &mut n, &mut d);
            assert!((n[..count].iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn derivatives_are_those_of_the_functions() {
        for order in ORDERS {
            let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            order.shape(POINT, &mut n, &mut d);
            for k in 0..4 {
                let h = 1e-6;
                let (mut up, mut down, mut unused) =
                    ([0.0; MAX_NODES], [0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
                let mut l = POINT;
                l[k] += h;
                order.shape(l, &mut up, &mut unused);
                l[k] -= 2.0 * h;
                order.shape(l, &mut down, &mut unused);
                for i in 0..order.nodes_per_element() {
                    assert!(
                        (d[i][k] - (up[i] - down[i]) / (2.0 * h)).abs() < 1e-8,
                        "{order:?} {i} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn face_nodes_lie_on_the_face_where_the_triangle_has_them() {
        for order in ORDERS {
            let nodes = order.node_coordinates();
            for face in 0..4 {
                let local = order.face_nodes(face);
                assert_eq!(local.len(), order.nodes_per_face());
                for (i, &node) in local.iter().enumerate() {
                    // The triangle's shape functions at the node's place on the face are 0 and 1.
                    let l = FACE_VERTICES[face].map(|v| nodes[node][v]);
                    let (mut n, mut d) = ([0.0; 10], [[0.0; 3]; 10]);
                    face_shape(order, l, &mut n, &mut d);
                    assert!((n[i] - 1.0).abs() < 1e-14, "{order:?} face {face} node {i}");
                }
            }
        }
    }
}

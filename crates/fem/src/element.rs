//! Tetrahedra of order 1 to 5: where their nodes are and what their shape functions are.
//!
//! One file for each of the orders 1 to 3 that mesh files have, and one for any order; with its drawing, node order and functions. The order is Gmsh's; other
//! programs swap nodes 8 and 9 of tet10.

mod lagrange;
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
    /// 35 nodes; for the inside of a part, not in files.
    Quartic = 4,
    /// 56 nodes; likewise.
    Quintic = 5,
}

/// Most nodes that an element has.
pub const MAX_NODES: usize = 56;

/// Most nodes that a face has.
pub(crate) const MAX_FACE_NODES: usize = 21;

/// Vertices of the four faces, turned so that the normal points out of the element.
pub const FACE_VERTICES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

impl Order {
    /// The highest.
    pub const HIGHEST: u8 = 5;

    /// From the number, 1 to 5.
    pub fn try_from_number(order: u8) -> Option<Self> {
        match order {
            1 => Some(Self::Linear),
            2 => Some(Self::Quadratic),
            3 => Some(Self::Cubic),
            4 => Some(Self::Quartic),
            5 => Some(Self::Quintic),
            _ => None,
        }
    }

    /// 4, 10, 20, 35 or 56.
    pub fn nodes_per_element(self) -> usize {
        let n = self as usize;
        (n + 1) * (n + 2) * (n + 3) / 6
    }

    /// 3, 6, 10, 15 or 21.
    pub fn nodes_per_face(self) -> usize {
        let n = self as usize;
        (n + 1) * (n + 2) / 2
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
            Self::Cubic | Self::Quartic | Self::Quintic => &tet20::EDGES,
        }
    }

    /// Barycentric coordinates of the nodes.
    pub fn node_coordinates(self) -> Vec<[f64; 4]> {
        match self {
            Self::Linear => vertices(),
            Self::Quadratic => tet10::nodes(),
            Self::Cubic => tet20::nodes(),
            Self::Quartic | Self::Quintic => {
                let n = f64::from(self as u8);
                let places = lagrange::places(self).iter();
                places.map(|a| a.map(|a| f64::from(a) / n)).collect()
            }
        }
    }

    /// Local nodes of face `face`, in the order of Gmsh's triangle of this order: vertices, then
    /// edge nodes along 01, 12, 20, then the centre. The normal points out of the element.
    pub fn face_nodes(self, face: usize) -> Vec<usize> {
        let vertices = FACE_VERTICES[face];
        if self > Self::Cubic {
            return self.face_nodes_of_lattice(vertices);
        }
        let mut nodes = vertices.to_vec();
        for k in 0..3 {
            let (a, b) = (vertices[k], vertices[(k + 1) % 3]);
            match self {
                Self::Linear | Self::Quartic | Self::Quintic => {}
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

    /// [`Self::face_nodes`] for orders above 3: vertices, edges along 01, 12, 20, then the inside by rows.
    fn face_nodes_of_lattice(self, [a, b, c]: [usize; 3]) -> Vec<usize> {
        let n = self as u8;
        let node = |weights: [u8; 3]| {
            let mut place = [0; 4];
            for (vertex, weight) in [a, b, c].into_iter().zip(weights) {
                place[vertex] = weight;
            }
            lagrange::places(self).iter().position(|p| *p == place)
        };
        let vertices = [[n, 0, 0], [0, n, 0], [0, 0, n]].into_iter();
        let edges = (0..3).flat_map(|e| {
            (1..n).map(move |k| {
                let mut weights = [0; 3];
                (weights[e], weights[(e + 1) % 3]) = (n - k, k);
                weights
            })
        });
        let inside = (1..n).flat_map(|j| (1..n - j).map(move |k| [n - j - k, j, k]));
        vertices
            .chain(edges)
            .chain(inside)
            .filter_map(node)
            .collect()
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
            Self::Quartic | Self::Quintic => lagrange::shape(self, l, values, derivatives),
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

/// Shape functions of the triangle with [`Order::nodes_per_face`] nodes and their derivatives by L_1..L_3.
pub(crate) fn face_shape(
    order: Order,
    l: [f64; 3],
    values: &mut [f64; MAX_FACE_NODES],
    derivatives: &mut [[f64; 3]; MAX_FACE_NODES],
) {
    const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
    *derivatives = [[0.0; 3]; MAX_FACE_NODES];
    if order > Order::Cubic {
        return face_shape_of_lattice(order, l, values, derivatives);
    }
    for v in 0..3 {
        let x = l[v];
        (values[v], derivatives[v][v]) = match order {
            Order::Linear => (x, 1.0),
            Order::Quadratic => (x * (2.0 * x - 1.0), 4.0 * x - 1.0),
            Order::Cubic | Order::Quartic | Order::Quintic => (
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
            Order::Cubic | Order::Quartic | Order::Quintic => {
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

/// [`face_shape`] for orders above 3: those of the element on its first face.
fn face_shape_of_lattice(
    order: Order,
    l: [f64; 3],
    values: &mut [f64; MAX_FACE_NODES],
    derivatives: &mut [[f64; 3]; MAX_FACE_NODES],
) {
    let vertices = FACE_VERTICES[0];
    let mut on_element = [0.0; 4];
    for (vertex, l) in vertices.into_iter().zip(l) {
        on_element[vertex] = l;
    }
    let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
    order.shape(on_element, &mut n, &mut d);
    for (k, node) in order.face_nodes(0).into_iter().enumerate() {
        values[k] = n[node];
        derivatives[k] = vertices.map(|v| d[node][v]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDERS: [Order; 5] = [
        Order::Linear,
        Order::Quadratic,
        Order::Cubic,
        Order::Quartic,
        Order::Quintic,
    ];
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
                    let (mut n, mut d) = ([0.0; MAX_FACE_NODES], [[0.0; 3]; MAX_FACE_NODES]);
                    face_shape(order, l, &mut n, &mut d);
                    assert!((n[i] - 1.0).abs() < 1e-14, "{order:?} face {face} node {i}");
                }
            }
        }
    }
}

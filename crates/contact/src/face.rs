//! A face of the part where it is now: a triangle of order 1, 2 or 3 through its nodes, and the point of it that is
//! nearest to a given one.
//!
//! ```text
//!      2                 2                    2        order 1, 2 and 3: vertices, then the nodes of
//!      |\                |\                   |\       the edges 01, 12, 20, then the middle
//!      | \               5  4                 7  6
//!      |  \              |   \                |   \
//!      |   \             |    \               8  9  5
//!      0----1            0--3--1              0--3--4--1
//! ```
//! The vertices run so that (x_1 - x_0) × (x_2 - x_0) points out of the part. Local coordinates are barycentric.

use glam::DVec3;

/// Most nodes that a face has.
pub const MAX_FACE_NODES: usize = 10;

/// Polynomial order of the faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaceOrder {
    /// 3 nodes.
    Linear,
    /// 6 nodes.
    Quadratic,
    /// 10 nodes.
    Cubic,
}

impl FaceOrder {
    /// Of the order with this number of nodes on a face.
    pub fn with_nodes(n_nodes: usize) -> Option<Self> {
        [Self::Linear, Self::Quadratic, Self::Cubic]
            .into_iter()
            .find(|order| order.n_nodes() == n_nodes)
    }

    /// Nodes of a face: 3, 6 or 10.
    pub fn n_nodes(self) -> usize {
        match self {
            Self::Linear => 3,
            Self::Quadratic => 6,
            Self::Cubic => 10,
        }
    }

    /// Nodes on an edge between its vertices.
    pub fn n_on_edge(self) -> usize {
        match self {
            Self::Linear => 0,
            Self::Quadratic => 1,
            Self::Cubic => 2,
        }
    }

    /// Local coordinates of the nodes; the first [`FaceOrder::n_nodes`] entries are set.
    pub fn node_coordinates(self) -> [[f64; 3]; MAX_FACE_NODES] {
        const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
        let mut places = [[0.0; 3]; MAX_FACE_NODES];
        for v in 0..3 {
            places[v][v] = 1.0;
        }
        let n_on_edge = self.n_on_edge();
        let steps = (n_on_edge + 1) as f64;
        for (e, [a, b]) in EDGES.into_iter().enumerate() {
            for k in 0..n_on_edge {
                let share = (k + 1) as f64 / steps;
                let place = &mut places[3 + n_on_edge * e + k];
                (place[a], place[b]) = (1.0 - share, share);
            }
        }
        if self == Self::Cubic {
            places[9] = [1.0 / 3.0; 3];
        }
        places
    }

    /// Largest sum of the absolute shape functions: no point of a face moves by more than this times what any of its
    /// nodes moves. 1, 5/3 (in the middle of a face) and 2.28, rounded up.
    pub fn largest_sum(self) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Quadratic => 5.0 / 3.0,
            Self::Cubic => 2.28,
        }
    }

    /// Shape functions N_a at a point, and their derivatives by the three local coordinates taken as independent.
    /// The first [`FaceOrder::n_nodes`] entries are set, the others are 0.
    pub fn shape(self, l: [f64; 3]) -> ([f64; MAX_FACE_NODES], [[f64; 3]; MAX_FACE_NODES]) {
        const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
        let (mut values, mut by_l) = ([0.0; MAX_FACE_NODES], [[0.0; 3]; MAX_FACE_NODES]);
        for v in 0..3 {
            let x = l[v];
            (values[v], by_l[v][v]) = match self {
                Self::Linear => (x, 1.0),
                Self::Quadratic => (x * (2.0 * x - 1.0), 4.0 * x - 1.0),
                Self::Cubic => (
                    0.5 * x * (3.0 * x - 1.0) * (3.0 * x - 2.0),
                    13.5 * x * x - 9.0 * x + 1.0,
                ),
            };
        }
        for (e, [a, b]) in EDGES.into_iter().enumerate() {
            match self {
                Self::Linear => {}
                Self::Quadratic => {
                    values[3 + e] = 4.0 * l[a] * l[b];
                    by_l[3 + e][a] = 4.0 * l[b];
                    by_l[3 + e][b] = 4.0 * l[a];
                }
                Self::Cubic => {
                    for (k, (near, far)) in [(a, b), (b, a)].into_iter().enumerate() {
                        let node = 3 + 2 * e + k;
                        values[node] = 4.5 * l[near] * l[far] * (3.0 * l[near] - 1.0);
                        by_l[node][near] = 4.5 * l[far] * (6.0 * l[near] - 1.0);
                        by_l[node][far] = 4.5 * l[near] * (3.0 * l[near] - 1.0);
                    }
                }
            }
        }
        if self == Self::Cubic {
            values[9] = 27.0 * l[0] * l[1] * l[2];
            by_l[9] = [27.0 * l[1] * l[2], 27.0 * l[2] * l[0], 27.0 * l[0] * l[1]];
        }
        (values, by_l)
    }
}

/// A face by the present positions of its nodes, m.
#[derive(Debug, Clone, Copy)]
pub struct Face<'a> {
    order: FaceOrder,
    nodes: &'a [DVec3],
}

/// The point of a face that is nearest to a point p.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    /// Local coordinates, none below 0.
    pub l: [f64; 3],
    /// Shape functions N_a there; 0 beyond the face's nodes.
    pub weights: [f64; MAX_FACE_NODES],
    /// Where it is, m.
    pub position: DVec3,
    /// Unit normal there, out of the part. Not finite on a face without area.
    pub outward: DVec3,
    /// outward · (p - position), m: > 0 if p is in front of the face, outside of the part.
    pub height: f64,
    /// m, how far p lies beside the normal line: 0 unless the point is on the border of the face.
    pub aside: f64,
    /// By vertex: whether the point is on the edge opposite of it because p lies beyond the border.
    pub is_beyond: [bool; 3],
}

impl<'a> Face<'a> {
    /// # Panics
    /// Unless there are as many nodes as the order has (a programmer's mistake).
    pub fn new(order: FaceOrder, nodes: &'a [DVec3]) -> Self {
        assert_eq!(nodes.len(), order.n_nodes(), "nodes of a face");
        Self { order, nodes }
    }

    /// Position, and its derivatives along the edges 01 and 02, at a local point, m.
    pub fn at(&self, l: [f64; 3]) -> (DVec3, DVec3, DVec3) {
        let (values, by_l) = self.order.shape(l);
        let mut sums = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for ((&x, value), d) in self.nodes.iter().zip(values).zip(by_l) {
            sums.0 += value * x;
            sums.1 += (d[1] - d[0]) * x;
            sums.2 += (d[2] - d[0]) * x;
        }
        sums
    }

    /// Unit normal at a local point, out of the part. Not finite where the face has no area.
    pub fn outward(&self, l: [f64; 3]) -> DVec3 {
        let (_, along, across) = self.at(l);
        let area = along.cross(across);
        area / area.length()
    }

    /// The point nearest to `p`.
    ///
    /// Gauss-Newton from the nearest point of the triangle of the vertices: on a plane face exact after one step; on a
    /// curved one each step leaves (distance over radius of curvature) of the error, and what is left changes the
    /// height by its square only. Meant for points nearer than the radius of curvature.
    pub fn nearest(&self, p: DVec3) -> Nearest {
        /// Steps; halving the error in each would leave 1e-9 of the face.
        const MOST_STEPS: usize = 30;
        /// Of the face: a smaller step is round-off.
        const STANDSTILL: f64 = 1e-14;
        let mut l = [1.0 / 3.0; 3];
        for _ in 0..MOST_STEPS {
            let (x, along, across) = self.at(l);
            let rest = p - x;
            let (aa, ab, bb) = (
                along.length_squared(),
                along.dot(across),
                across.length_squared(),
            );
            let (ra, rb) = (along.dot(rest), across.dot(rest));
            let determinant = aa * bb - ab * ab;
            let step = [
                (bb * ra - ab * rb) / determinant,
                (aa * rb - ab * ra) / determinant,
            ];
            let length = step[0].abs().max(step[1].abs());
            // Far outside a curved face its functions mean nothing: no farther than a face's width at once, nor away.
            let shorten = if length > 1.0 { 1.0 / length } else { 1.0 };
            let far = |x: f64| x.clamp(-1.0, 2.0);
            let to = [far(l[1] + shorten * step[0]), far(l[2] + shorten * step[1])];
            let moved = (to[0] - l[1]).abs().max((to[1] - l[2]).abs());
            l = [1.0 - to[0] - to[1], to[0], to[1]];
            if moved <= STANDSTILL || !moved.is_finite() {
                break;
            }
        }
        let is_outside = l.iter().any(|l| *l < 0.0);
        if is_outside {
            l = self.nearest_of_border(p);
        }
        let (x, along, across) = self.at(l);
        let area = along.cross(across);
        let outward = area / area.length();
        let away = p - x;
        let height = outward.dot(away);
        Nearest {
            l,
            weights: self.order.shape(l).0,
            position: x,
            outward,
            height,
            aside: if is_outside {
                (away - height * outward).length()
            } else {
                0.0
            },
            is_beyond: l.map(|l| is_outside && l == 0.0),
        }
    }

    /// The nearest point of the three edges.
    fn nearest_of_border(&self, p: DVec3) -> [f64; 3] {
        const MOST_STEPS: usize = 20;
        const STANDSTILL: f64 = 1e-14;
        let mut best = ([0.0; 3], f64::INFINITY);
        for k in 0..3 {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            let mut l = [0.0; 3];
            (l[a], l[b]) = (0.5, 0.5);
            for _ in 0..MOST_STEPS {
                let (x, along, across) = self.at(l);
                let by_l = [DVec3::ZERO, along, across];
                let direction = by_l[b] - by_l[a];
                let step = direction.dot(p - x) / direction.length_squared();
                let to = (l[b] + step).clamp(0.0, 1.0);
                let moved = (to - l[b]).abs();
                (l[a], l[b]) = (1.0 - to, to);
                if moved <= STANDSTILL || !moved.is_finite() {
                    break;
                }
            }
            let length = (p - self.at(l).0).length_squared();
            if length < best.1 {
                best = (l, length);
            }
        }
        best.0
    }
}

#[cfg(test)]
mod tests;

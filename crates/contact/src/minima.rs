//! Where the part is nearest to the tool: local minima of the tool's distance along an edge of the part, and in a face.
//!
//! Contact at fixed points, of whatever number, steps from one row of them to the next; a place that moves with the tool
//! does not. Edges are searched as they are. An edge that lies along the tool has no minimum worth the name: all its nodes
//! are taken, as they are what an area of contact is pressed by. Insides of faces are searched on the *undented* surface,
//! which follows the vertices of the elements only,
//!
//! ```text
//! p(l) = Σ_a N_a(l) X_a + Σ_v l_v u_v        v the vertices, X at rest
//! ```
//! because in an area of contact the gap of the deformed face is zero everywhere and its minima jump. Gaps are then
//! measured with the full displacement at the place.

use glam::DVec3;
use glamx::DPose3;

use crate::face::{FaceOrder, MAX_FACE_NODES};
use crate::tool::Tool;

/// Nodes of an edge at most: its ends, then those between from the first end to the second.
pub const MAX_EDGE_NODES: usize = 4;

/// Minima along an edge at most: three samples see no more.
const MAX_MINIMA: usize = 3;

/// Where along an edge (0 to 1) minima are, and what of the distance is sure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeMinima {
    n: usize,
    at: [f64; MAX_MINIMA],
    /// Whether the edge lies along the tool: all its nodes are where it is nearest.
    pub is_along: bool,
    /// m, least distance of the edge from the tool: of the points that were asked for, or where it is not searched, of all.
    pub least: f64,
}

impl EdgeMinima {
    /// Places along the edge, 0 and 1 its ends.
    pub fn at(&self) -> &[f64] {
        &self.at[..self.n]
    }

    fn push(&mut self, t: f64) {
        self.at[self.n] = t;
        self.n += 1;
    }
}

/// Shape functions of the nodes of an edge (ends first) and their derivatives along it.
pub fn edge_shape(order: FaceOrder, t: f64) -> ([f64; MAX_EDGE_NODES], [f64; MAX_EDGE_NODES]) {
    let s = 1.0 - t;
    match order {
        FaceOrder::Linear => ([s, t, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0]),
        FaceOrder::Quadratic => (
            [s * (s - t), t * (t - s), 4.0 * s * t, 0.0],
            [t - 3.0 * s, 3.0 * t - s, 4.0 * (s - t), 0.0],
        ),
        FaceOrder::Cubic => {
            let end = |x: f64| 0.5 * x * (3.0 * x - 1.0) * (3.0 * x - 2.0);
            let end_slope = |x: f64| 13.5 * x * x - 9.0 * x + 1.0;
            let inner = |x: f64, y: f64| 4.5 * x * y * (3.0 * x - 1.0);
            // d/dt of x y (3x - 1) with x = s: by x times -1, by y times 1.
            let by_x = |x: f64, y: f64| 4.5 * y * (6.0 * x - 1.0);
            let by_y = |x: f64| 4.5 * x * (3.0 * x - 1.0);
            (
                [end(s), end(t), inner(s, t), inner(t, s)],
                [
                    -end_slope(s),
                    end_slope(t),
                    by_y(s) - by_x(s, t),
                    by_x(t, s) - by_y(t),
                ],
            )
        }
    }
}

/// An edge of the part.
#[derive(Debug, Clone, Copy)]
pub struct Edge<'a> {
    /// Order of the faces.
    pub order: FaceOrder,
    /// Where they are, m: the ends, then the nodes between.
    pub nodes: &'a [DVec3],
}

impl Edge<'_> {
    fn at(&self, t: f64) -> (DVec3, DVec3) {
        let (values, slopes) = edge_shape(self.order, t);
        let (mut place, mut along) = (DVec3::ZERO, DVec3::ZERO);
        for ((x, value), slope) in self.nodes.iter().zip(values).zip(slopes) {
            place += value * *x;
            along += slope * *x;
        }
        (place, along)
    }

    /// Distance, its derivative along the edge, and the tool's normal.
    fn seen(&self, tool: &Tool, pose: &DPose3, t: f64) -> (f64, f64, DVec3) {
        let (place, along) = self.at(t);
        let seen = tool.signed_distance(pose, place);
        (seen.signed_distance, seen.normal.dot(along), seen.normal)
    }

    /// The local minima. `far` (m): an edge that is farther all along is not searched; `half` (m): no point of the edge is
    /// farther than this from its middle; `flat` (m): what the distance may vary along an edge that lies along the tool.
    pub fn minima(&self, tool: &Tool, pose: &DPose3, far: f64, half: f64, flat: f64) -> EdgeMinima {
        let middle = self.seen(tool, pose, 0.5);
        let mut minima = EdgeMinima {
            n: 0,
            at: [0.0; MAX_MINIMA],
            is_along: false,
            least: middle.0 - half,
        };
        // Far away the middle is enough.
        if minima.least > far + half {
            return minima;
        }
        let [first, last] = [0.0, 1.0].map(|t| self.seen(tool, pose, t));
        let least = first.0.min(middle.0).min(last.0);
        let mut sure = least - 0.5 * half;
        if tool.is_round() {
            // Convex along a straight edge, so above the tangents at its ends and middle.
            let bend = (self.at(0.5).0 - 0.5 * (self.nodes[0] + self.nodes[1])).length();
            let halves = above_tangents(first, middle).min(above_tangents(middle, last));
            sure = sure.max(halves - 2.0 * bend);
        }
        // Also what is not a number is not near.
        let is_near = sure < far;
        if !is_near {
            minima.least = sure;
            return minima;
        }
        minima.least = least;
        let bend = (middle.1 - first.1).abs().max((last.1 - middle.1).abs());
        let tilt = (last.0 - first.0).abs();
        // h/8 of the parabola through the ends and the middle; h is twice the change of slope over half of the edge.
        minima.is_along = 2.0 * bend / 8.0 < flat && tilt < flat;
        if minima.is_along {
            return minima;
        }
        if first.1 >= 0.0 {
            minima.push(0.0);
        }
        for (left, right, from) in [(first, middle, 0.0), (middle, last, 0.5)] {
            if left.1 < 0.0 && right.1 >= 0.0 && minima.n < MAX_MINIMA {
                let (t, distance) = self.root(tool, pose, from, left.1, right.1);
                minima.least = minima.least.min(distance);
                if t <= 0.0 || t >= 1.0 {
                    minima.push(t.clamp(0.0, 1.0));
                    continue;
                }
                // A shallow minimum is none.
                let h = 2.0 * (right.1 - left.1);
                if h / 8.0 < flat {
                    minima.n = 0;
                    minima.is_along = true;
                    return minima;
                }
                minima.push(t);
            }
        }
        if last.1 < 0.0 && minima.n < MAX_MINIMA {
            minima.push(1.0);
        }
        minima
    }

    /// The zero of the slope between `from` and half an edge on: regula falsi that halves a side that stands still
    /// (Illinois), safe over the bends of meshes.
    fn root(&self, tool: &Tool, pose: &DPose3, from: f64, at_from: f64, at_to: f64) -> (f64, f64) {
        /// Of the edge, the last step of those that shorten fast: a place that is off by x has a gap that is off by x² over
        /// the tool's diameter.
        const STANDSTILL: f64 = 1e-4;
        const MOST_STEPS: usize = 20;
        let (mut a, mut f_a, mut b, mut f_b) = (from, at_from, from + 0.5, at_to);
        let mut best = (from, f64::INFINITY);
        let mut last_side = 0;
        for _ in 0..MOST_STEPS {
            let t = if f_b > f_a {
                (a * f_b - b * f_a) / (f_b - f_a)
            } else {
                0.5 * (a + b)
            };
            let t = t.clamp(a, b);
            let (distance, slope, _) = self.seen(tool, pose, t);
            let moved = (t - best.0).abs();
            best = (t, distance);
            if moved < STANDSTILL || b - a < STANDSTILL || slope == 0.0 {
                break;
            }
            if slope < 0.0 {
                (a, f_a) = (t, slope);
                f_b *= if last_side < 0 { 0.5 } else { 1.0 };
                last_side = -1;
            } else {
                (b, f_b) = (t, slope);
                f_a *= if last_side > 0 { 0.5 } else { 1.0 };
                last_side = 1;
            }
        }
        best
    }
}

/// The least distance between two points half an edge apart, as the tangents there tell of a convex one.
fn above_tangents(left: (f64, f64, DVec3), right: (f64, f64, DVec3)) -> f64 {
    let (fall, rise) = (left.1, right.1);
    if fall >= 0.0 || rise <= 0.0 {
        return left.0.min(right.0);
    }
    // Where the tangents cross, of half an edge.
    let at = ((right.0 - left.0 - 0.5 * rise) / (fall - rise)).clamp(0.0, 0.5);
    (left.0 + fall * at).min(right.0 - rise * (0.5 - at))
}

/// Whether a minimum of the distance can lie inside a face: not under a tool that is straight one way.
pub fn is_doubly_curved(tool: &Tool) -> bool {
    match tool {
        Tool::Box(_) | Tool::HalfSpace(_) | Tool::Cylinder(_) => false,
        Tool::Field(field) => is_doubly_curved(field.tool()),
        Tool::Sphere(_) | Tool::Capsule(_) | Tool::Mesh(_) => true,
    }
}

/// A face of the part as it is searched: nodes at rest, and the displacement of its vertices, m.
#[derive(Debug, Clone, Copy)]
pub struct UndentedFace<'a> {
    /// Order of the faces.
    pub order: FaceOrder,
    /// At rest.
    pub rest: &'a [DVec3],
    /// Displacement of the vertices.
    pub vertices: [DVec3; 3],
}

impl UndentedFace<'_> {
    /// Place and its derivatives by the second and third local coordinate.
    fn at(&self, l: [f64; 3]) -> (DVec3, DVec3, DVec3) {
        let (values, by_l) = self.order.shape(l);
        let [a, b, c] = self.vertices;
        let mut sums = (l[0] * a + l[1] * b + l[2] * c, b - a, c - a);
        for ((&x, value), d) in self.rest.iter().zip(values).zip(by_l) {
            sums.0 += value * x;
            sums.1 += (d[1] - d[0]) * x;
            sums.2 += (d[2] - d[0]) * x;
        }
        sums
    }

    /// m, distance of the middle.
    pub fn middle_distance(&self, tool: &Tool, pose: &DPose3) -> f64 {
        let (place, ..) = self.at([1.0 / 3.0; 3]);
        tool.signed_distance(pose, place).signed_distance
    }

    fn slope(&self, tool: &Tool, pose: &DPose3, at: [f64; 2]) -> (f64, [f64; 2]) {
        let (place, b, c) = self.at([1.0 - at[0] - at[1], at[0], at[1]]);
        let seen = tool.signed_distance(pose, place);
        (
            seen.signed_distance,
            [seen.normal.dot(b), seen.normal.dot(c)],
        )
    }

    /// The local minimum inside the face, if there is one: its local coordinates and distance (m). Newton's method from the
    /// middle, with differences of slopes; kept where the second derivative is positive definite. `flat` (m) as for edges.
    pub fn minimum(&self, tool: &Tool, pose: &DPose3, flat: f64) -> Option<([f64; 3], f64)> {
        const MOST_STEPS: usize = 12;
        const STANDSTILL: f64 = 1e-7;
        /// Of the face, over which slopes are compared: as wide as its bends are not.
        const APART: f64 = 0.02;
        let mut at = [1.0 / 3.0; 2];
        let mut kept = None;
        for _ in 0..MOST_STEPS {
            let (distance, slope) = self.slope(tool, pose, at);
            let by_b = self.slope(tool, pose, [at[0] + APART, at[1]]).1;
            let by_c = self.slope(tool, pose, [at[0], at[1] + APART]).1;
            let h_bb = (by_b[0] - slope[0]) / APART;
            let h_cc = (by_c[1] - slope[1]) / APART;
            let h_bc = 0.5 * ((by_b[1] - slope[1]) + (by_c[0] - slope[0])) / APART;
            let determinant = h_bb * h_cc - h_bc * h_bc;
            // The flatter way of the two.
            let least = determinant / (h_bb + h_cc);
            let is_bowl = h_bb > 0.0 && determinant > 0.0 && least / 8.0 >= flat;
            if !is_bowl {
                return None;
            }
            let step = [
                (h_cc * slope[0] - h_bc * slope[1]) / determinant,
                (h_bb * slope[1] - h_bc * slope[0]) / determinant,
            ];
            let shorten = (0.5 / step[0].abs().max(step[1].abs())).min(1.0);
            at = [at[0] - shorten * step[0], at[1] - shorten * step[1]];
            let l = [1.0 - at[0] - at[1], at[0], at[1]];
            // Beyond the border the edge has it.
            let is_off = !l.iter().all(|l| *l > -0.5);
            if is_off {
                return None;
            }
            kept = l.iter().all(|l| *l > 0.0).then_some((l, distance));
            if step[0].abs().max(step[1].abs()) < STANDSTILL {
                break;
            }
        }
        kept
    }

    /// The nodes' weights at a local point.
    pub fn weights(&self, l: [f64; 3]) -> [f64; MAX_FACE_NODES] {
        self.order.shape(l).0
    }
}

#[cfg(test)]
mod tests;

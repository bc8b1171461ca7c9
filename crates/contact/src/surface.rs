//! The part's faces that can touch: their nodes, neighbours, and when a point of the tool counts as being at one.
//!
//! # The rule
//! A point of the tool's edges is *at* a face if the nearest point of the face lies inside its border, and the
//! point is in front of the face by less than the near distance or behind it by no more than [`Surface::depth`]: half of
//! the height of the element behind the face, so that of a thin part the other side is never meant. Over a border at
//! which the surface goes on smoothly a point may lie in the gap that the two faces' normals leave; over other
//! borders it may not, because beyond them is the outside of the part.
//!
//! Of several faces that a point is behind, it is at the one that it was at before, else at the nearest one. What it was
//! at is the caller's memory: [`Surface::is_at`] takes how far beyond its border that face still holds the point, and
//! [`Surface::neighbour`] leads on from there.

use glam::DVec3;

use crate::contacts::{Place, Witness};
use crate::error::{Error, check_positive};
use crate::face::{Face, FaceOrder, MAX_FACE_NODES, Nearest};

/// No face.
pub const NO_FACE: u32 = u32::MAX;

/// Bend from which the border of two faces is an edge of the part, degrees. Faces of a coarse mesh of a curved surface
/// meet at less.
const SMOOTH_DEGREES: f64 = 35.0;

/// Tangent of a little more than half of the bend up to which a border is smooth, 35 degrees: how far a point between two faces' normals is aside of
/// either, for its height.
pub const SMOOTH_SLOPE: f64 = 0.36;

/// Of a face's size: a point is on the border to round-off.
const ROUND_OFF: f64 = 1e-9;

/// Faces of the part between nodes that can touch, or are held.
#[derive(Debug, Clone)]
pub struct Surface {
    order: FaceOrder,
    n_candidates: usize,
    nodes: Vec<u32>,
    held: Vec<DVec3>,
    depth: Vec<f64>,
    size: Vec<f64>,
    neighbours: Vec<[u32; 3]>,
    is_smooth: Vec<[bool; 3]>,
    /// By edge: its ends, then the nodes between.
    edges: Vec<u32>,
    /// Faces of candidate c: `faces_of[first_of[c]..first_of[c + 1]]`.
    first_of: Vec<u32>,
    faces_of: Vec<u32>,
}

/// A face as the caller gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceData {
    /// 3, 6 or 10 nodes in the sequence of [`crate::face`], the same number for all faces: a candidate by its number, the
    /// k-th held node as the number of candidates plus k.
    pub nodes: Vec<u32>,
    /// m, height of the element behind the face.
    pub height: f64,
}

impl Surface {
    /// `rest`: of the candidates; `held`: of nodes that never move; part's frame, m.
    ///
    /// # Errors
    /// [`Error::Length`] if a face has another number of nodes than the first, or one that no order has;
    /// [`Error::NoSuchNode`]; [`Error::NotPositive`] for a height or a face without area.
    pub fn new(rest: &[DVec3], held: Vec<DVec3>, faces: &[FaceData]) -> Result<Self, Error> {
        let n_nodes = faces.first().map_or(3, |face| face.nodes.len());
        let length = |actual| Error::Length {
            what: "the nodes of a face",
            expected: n_nodes,
            actual,
        };
        let order = FaceOrder::with_nodes(n_nodes).ok_or(Error::Length {
            what: "the nodes of a face",
            expected: 6,
            actual: n_nodes,
        })?;
        let mut surface = Self {
            order,
            n_candidates: rest.len(),
            nodes: Vec::with_capacity(n_nodes * faces.len()),
            held,
            depth: Vec::with_capacity(faces.len()),
            size: Vec::with_capacity(faces.len()),
            neighbours: vec![[NO_FACE; 3]; faces.len()],
            is_smooth: vec![[false; 3]; faces.len()],
            edges: Vec::new(),
            first_of: vec![0; rest.len() + 1],
            faces_of: Vec::new(),
        };
        for (face, data) in faces.iter().enumerate() {
            if data.nodes.len() != n_nodes {
                return Err(length(data.nodes.len()));
            }
            let n_known = rest.len() + surface.held.len();
            if let Some(&node) = data.nodes.iter().find(|node| **node as usize >= n_known) {
                return Err(Error::NoSuchNode {
                    face,
                    node,
                    n_nodes: n_known,
                });
            }
            check_positive("height of the element behind a face", data.height)?;
            surface.nodes.extend_from_slice(&data.nodes);
            let places = surface.rest_of(face, rest);
            let places = &places[..n_nodes];
            let distances = places
                .iter()
                .flat_map(|a| places.iter().map(move |b| (*a - *b).length()));
            let size = distances.fold(0.0, f64::max);
            let (_, along, across) = Face::new(order, places).at([1.0 / 3.0; 3]);
            check_positive("area of a face", 0.5 * along.cross(across).length())?;
            surface.size.push(size);
            surface.depth.push((0.5 * data.height).min(size));
        }
        surface.pair_borders(rest);
        surface.list_faces();
        Ok(surface)
    }

    /// Finds what is across each border, and whether the surface goes on smoothly there.
    fn pair_borders(&mut self, rest: &[DVec3]) {
        let mut sides: std::collections::BTreeMap<(u32, u32), Vec<(u32, usize)>> =
            std::collections::BTreeMap::new();
        for face in 0..self.n_faces() {
            let nodes = self.nodes_of(face);
            for k in 0..3 {
                let (a, b) = (nodes[(k + 1) % 3], nodes[(k + 2) % 3]);
                let key = (a.min(b), a.max(b));
                sides.entry(key).or_default().push((face as u32, k));
            }
        }
        for users in sides.values() {
            let (face, opposite_of) = users[0];
            self.push_edge(face as usize, opposite_of);
            // More than two do not meet on the surface of a body; then each ends there.
            let [(f, k), (g, l)] = users[..] else {
                continue;
            };
            let normal = |face: u32, k: usize| {
                let mut middle = [0.5; 3];
                middle[k] = 0.0;
                let places = self.rest_of(face as usize, rest);
                Face::new(self.order, &places[..self.order.n_nodes()]).outward(middle)
            };
            let is_smooth = normal(f, k).dot(normal(g, l)) > SMOOTH_DEGREES.to_radians().cos();
            for ((from, edge), to) in [((f, k), g), ((g, l), f)] {
                self.neighbours[from as usize][edge] = to;
                self.is_smooth[from as usize][edge] = is_smooth;
            }
        }
    }

    /// The edge of a face that is opposite of a vertex.
    fn push_edge(&mut self, face: usize, opposite_of: usize) {
        let nodes = self.nodes_of(face);
        let (from, to) = ((opposite_of + 1) % 3, (opposite_of + 2) % 3);
        let n_between = self.order.n_on_edge();
        let first = 3 + n_between * from;
        let edge: Vec<u32> = [nodes[from], nodes[to]]
            .into_iter()
            .chain(nodes[first..first + n_between].iter().copied())
            .collect();
        self.edges.extend(edge);
    }

    fn list_faces(&mut self) {
        let of_candidates = |node: &&u32| (**node as usize) < self.n_candidates;
        for node in self.nodes.iter().filter(of_candidates) {
            self.first_of[*node as usize + 1] += 1;
        }
        for c in 0..self.n_candidates {
            self.first_of[c + 1] += self.first_of[c];
        }
        let mut next = self.first_of.clone();
        self.faces_of = vec![0; self.first_of[self.n_candidates] as usize];
        let n_nodes = self.order.n_nodes();
        for (at, node) in self
            .nodes
            .iter()
            .enumerate()
            .filter(|(_, n)| of_candidates(n))
        {
            let place = &mut next[*node as usize];
            self.faces_of[*place as usize] = (at / n_nodes) as u32;
            *place += 1;
        }
    }

    fn rest_of(&self, face: usize, rest: &[DVec3]) -> [DVec3; MAX_FACE_NODES] {
        let mut places = [DVec3::ZERO; MAX_FACE_NODES];
        self.positions_into(face, |c| rest[c as usize], &mut places);
        places
    }

    /// Order of the faces.
    pub fn order(&self) -> FaceOrder {
        self.order
    }

    /// Number of faces.
    pub fn n_faces(&self) -> usize {
        self.neighbours.len()
    }

    /// Nodes of a face, as in [`FaceData::nodes`].
    pub fn nodes_of(&self, face: usize) -> &[u32] {
        let n = self.order.n_nodes();
        &self.nodes[n * face..n * (face + 1)]
    }

    /// Number of edges between the faces' vertices.
    pub fn n_edges(&self) -> usize {
        self.edges.len() / (2 + self.order.n_on_edge())
    }

    /// Nodes of an edge: its ends, then those between, from the first end to the second.
    pub fn nodes_of_edge(&self, edge: usize) -> &[u32] {
        let n = 2 + self.order.n_on_edge();
        &self.edges[n * edge..n * (edge + 1)]
    }

    /// Rest position of a held node, m; none for a candidate.
    pub fn held(&self, node: u32) -> Option<DVec3> {
        let k = (node as usize).checked_sub(self.n_candidates)?;
        self.held.get(k).copied()
    }

    /// Whether a node of a face is a candidate; held ones do not move.
    pub fn is_candidate(&self, node: u32) -> bool {
        (node as usize) < self.n_candidates
    }

    /// Faces that a candidate is a node of; none for a number beyond the candidates.
    pub fn faces_of(&self, candidate: u32) -> &[u32] {
        let c = candidate as usize;
        if c >= self.n_candidates {
            return &[];
        }
        &self.faces_of[self.first_of[c] as usize..self.first_of[c + 1] as usize]
    }

    /// Largest distance between two nodes of a face at rest, m.
    pub fn size(&self, face: usize) -> f64 {
        self.size[face]
    }

    /// How far behind a face a point may be and still be at it, m.
    pub fn depth(&self, face: usize) -> f64 {
        self.depth[face]
    }

    /// The face across the edge opposite of a face's vertex, or [`NO_FACE`].
    pub fn neighbour(&self, face: usize, opposite_of: usize) -> u32 {
        self.neighbours[face][opposite_of]
    }

    /// Whether the surface goes on without an edge across the edge opposite of a face's vertex.
    pub fn is_smooth(&self, face: usize, opposite_of: usize) -> bool {
        self.is_smooth[face][opposite_of]
    }

    /// No point farther from a face than this is at it, m, if held up to `hold` beyond its border.
    pub fn reach(&self, face: usize, near_distance: f64, hold: f64) -> f64 {
        let height = self.depth[face].max(near_distance);
        let aside = ROUND_OFF * self.size[face] + hold + SMOOTH_SLOPE * height;
        height.hypot(aside)
    }

    /// Positions of a face's nodes, m; the first entries of `places` are set.
    pub fn positions_into(
        &self,
        face: usize,
        mut position_of: impl FnMut(u32) -> DVec3,
        places: &mut [DVec3; MAX_FACE_NODES],
    ) {
        for (place, &node) in places.iter_mut().zip(self.nodes_of(face)) {
            *place = match (node as usize).checked_sub(self.n_candidates) {
                Some(held) => self.held[held],
                None => position_of(node),
            };
        }
    }

    /// The place of a face that is nearest to a point of the tool (`local`, tool's frame, m), which is its witness.
    /// `displacement_of`: of a candidate, m.
    pub fn place(
        &self,
        face: usize,
        key: u32,
        nearest: &Nearest,
        local: DVec3,
        mut displacement_of: impl FnMut(u32) -> DVec3,
    ) -> Place {
        let nodes = self.nodes_of(face).iter().copied();
        let weights = nodes
            .zip(nearest.weights)
            .filter(|share| self.is_candidate(share.0));
        let mut place = Place::new(key, nearest.position, weights);
        place.rest -= place.displacement(&mut displacement_of);
        place.seen_by(Witness::Point {
            local,
            normal: -nearest.outward,
        })
    }

    /// Whether a point lies within the border of a face, or, if the face is to hold it, no more than `hold` (m) beyond.
    pub fn is_at(&self, face: usize, nearest: &Nearest, hold: f64) -> bool {
        let is_smooth = (0..3).all(|k| !nearest.is_beyond[k] || self.is_smooth[face][k]);
        let slope = if is_smooth { SMOOTH_SLOPE } else { 0.0 };
        let room = ROUND_OFF * self.size[face] + hold + slope * nearest.height.abs();
        nearest.height.is_finite() && nearest.aside <= room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a unit square in z = 0 and one that hangs down from its edge x = 1.
    fn corner() -> Surface {
        let rest = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::Y,
            DVec3::new(1.0, 0.5, -1.0),
        ];
        let face = |nodes: [u32; 3]| FaceData {
            nodes: nodes.to_vec(),
            height: 0.5,
        };
        Surface::new(
            &rest[..4],
            vec![rest[4]],
            &[face([0, 1, 2]), face([0, 2, 3]), face([2, 1, 4])],
        )
        .unwrap()
    }

    #[test]
    fn neighbours_smooth_borders_and_faces_of_nodes() {
        let surface = corner();
        assert_eq!(surface.neighbours[0], [2, 1, NO_FACE]);
        assert_eq!(surface.is_smooth[0], [false, true, false]);
        assert_eq!(surface.neighbours[2][2], 0);
        assert_eq!(surface.faces_of(2), [0, 1, 2]);
        assert_eq!(surface.faces_of(3), [1]);
        assert!(surface.is_candidate(3) && !surface.is_candidate(4));
        assert_eq!((surface.depth(0), surface.size(0)), (0.25, 2f64.sqrt()));
    }

    #[test]
    fn over_smooth_borders_a_point_is_at_a_face_in_the_gap_over_sharp_ones_not() {
        let surface = corner();
        let at = |face: usize, p: DVec3, hold: f64| {
            let mut places = [DVec3::ZERO; MAX_FACE_NODES];
            let rest = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
            surface.positions_into(face, |c| rest[c as usize], &mut places);
            let nearest = Face::new(FaceOrder::Linear, &places[..3]).nearest(p);
            surface.is_at(face, &nearest, hold)
        };
        assert!(at(0, DVec3::new(0.7, 0.3, -0.1), 0.0));
        // Beyond the diagonal: as far as the slope goes.
        assert!(at(0, DVec3::new(0.49, 0.51, -0.1), 0.0));
        assert!(!at(0, DVec3::new(0.4, 0.6, -0.1), 0.0));
        assert!(at(1, DVec3::new(0.4, 0.6, -0.1), 0.0));
        // Beyond the sharp edge, whatever the height, and the open one.
        assert!(!at(0, DVec3::new(1.001, 0.5, -0.1), 0.0));
        assert!(!at(0, DVec3::new(0.5, -0.001, 0.1), 0.0));
        assert!(at(0, DVec3::new(1.001, 0.5, -0.1), 0.002));
        assert!(!at(0, DVec3::new(f64::NAN, 0.5, -0.1), 0.002));
    }

    #[test]
    fn bad_faces_are_refused() {
        let rest = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let build = |nodes: &[u32], height: f64| {
            let nodes = nodes.to_vec();
            Surface::new(&rest, Vec::new(), &[FaceData { nodes, height }])
        };
        assert!(build(&[0, 1, 2], 1.0).is_ok());
        assert!(matches!(build(&[0, 1], 1.0), Err(Error::Length { .. })));
        assert!(matches!(
            build(&[0, 1, 3], 1.0),
            Err(Error::NoSuchNode { node: 3, .. })
        ));
        assert!(matches!(
            build(&[0, 1, 1], 1.0),
            Err(Error::NotPositive { .. })
        ));
        assert!(matches!(
            build(&[0, 1, 2], 0.0),
            Err(Error::NotPositive { .. })
        ));
    }
}

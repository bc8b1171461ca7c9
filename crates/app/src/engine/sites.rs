//! Places that move with the tool: the minima of its distance along the edges of the contact surface and inside its faces
//! ([`contact::minima`]), each edge and face with an appointment.
//!
//! An edge whose least distance is d beyond the near distance cannot come near before tool and nodes have moved by d over
//! the largest sum of its shape functions. The watch adds up how far they have moved, by cluster of nodes; what a node's
//! own force does to it is added here.

use std::sync::Arc;

use contact::Place;
use contact::face::MAX_FACE_NODES;
use contact::minima::{self, Edge, MAX_EDGE_NODES, UndentedFace};
use contact::surface::Surface;
use contact::tool::Tool;
use glam::DVec3;

use super::ContactPart;
use super::appointments::Appointments;
use super::clusters::Clusters;
use super::near::Look;
use super::watch::Watch;

/// Places along an edge that have keys of their own.
const KEYS_OF_EDGE: usize = 2;

/// Of what a searched edge has left to the near distance, what is waited for: it is searched in a few points only. The
/// distance from a round tool is convex along a straight edge, so that nothing is missed there but by the edge's bend.
const TRUST: f64 = 0.5;
const TRUST_ROUND: f64 = 0.9;

/// Edges and faces that can touch.
#[derive(Debug)]
pub(super) struct Sites {
    surface: Arc<Surface>,
    n_candidates: usize,
    /// m, what the distance may vary along an edge that lies along the tool.
    flat: f64,
    /// By edge: half of its length at rest, m, no less than any point is from the middle.
    halves: Vec<f64>,
    /// By edge, and by face behind them: stride in which it was found near. What is held is not sought again.
    near_in: Vec<u64>,
    stride: u64,
    edges: Appointments,
    /// Where minima can lie inside faces.
    faces: Option<Appointments>,
    /// Largest sum of the shape functions.
    sum: f64,
}

impl Sites {
    /// `rest`: of all nodes of the surface, m. `flat`: m. `has_faces`: whether minima inside faces are sought.
    pub(super) fn new(
        surface: Arc<Surface>,
        rest: &[DVec3],
        clusters: &Clusters,
        flat: f64,
        has_faces: bool,
    ) -> Self {
        let n_candidates = rest.len();
        let place = |node: &u32| rest[*node as usize];
        let halves = (0..surface.n_edges()).map(|e| {
            let nodes: Vec<DVec3> = surface.nodes_of_edge(e).iter().map(place).collect();
            let at = |t: f64| -> DVec3 {
                let (values, _) = minima::edge_shape(surface.order(), t);
                nodes.iter().zip(values).map(|(x, value)| value * *x).sum()
            };
            let middle = at(0.5);
            let samples = (0..=16).map(|k| (at(f64::from(k) / 16.0) - middle).length());
            1.01 * samples.fold(0.0, f64::max)
        });
        let halves = halves.collect();
        let of_edges = (0..surface.n_edges()).map(|e| surface.nodes_of_edge(e));
        let edges = Appointments::new(of_edges, n_candidates, clusters);
        let of_faces = (0..surface.n_faces()).map(|f| surface.nodes_of(f));
        let faces = has_faces.then(|| Appointments::new(of_faces, n_candidates, clusters));
        Self {
            n_candidates,
            flat,
            near_in: vec![0; surface.n_edges() + surface.n_faces()],
            stride: 0,
            halves,
            edges,
            faces,
            sum: surface.order().largest_sum(),
            surface,
        }
    }

    /// Keys that places can have: candidates first.
    pub(super) fn n_keys(surface: &Surface, n_candidates: usize) -> usize {
        n_candidates + KEYS_OF_EDGE * surface.n_edges() + surface.n_faces()
    }

    /// m, the size of the largest face: nodes that carry force are within it.
    pub(super) fn largest_face(&self) -> f64 {
        let sizes = (0..self.surface.n_faces()).map(|face| self.surface.size(face));
        sizes.fold(0.0, f64::max)
    }

    /// Holds the places that are nearer than the near distance of the look, which may be more than that of the
    /// appointments, `near_distance` (m).
    pub(super) fn look_further(&mut self, watch: &Watch, near_distance: f64, look: &mut Look<'_>) {
        let beyond = (look.near_distance - near_distance).max(0.0);
        let this = &*self;
        this.edges.within(watch.sums(), beyond, |edge| {
            if look.places.room() > 0 {
                this.look_at_edge(edge, look);
            }
        });
        if let Some(faces) = &this.faces {
            faces.within(watch.sums(), beyond, |face| {
                if look.places.room() > 0 {
                    this.look_at_face(face, look);
                }
            });
        }
    }

    /// A stride begins: nothing is held.
    pub(super) fn begin_stride(&mut self) {
        self.stride += 1;
    }

    pub(super) fn reset(&mut self) {
        self.edges.begin();
        if let Some(faces) = &mut self.faces {
            faces.begin();
        }
    }

    /// Looks at the edges and faces that may have come near.
    pub(super) fn look(&mut self, watch: &Watch, look: &mut Look<'_>) {
        let mut edges = std::mem::take(&mut self.edges);
        edges.take_in(watch, look.part);
        let mut near_in = std::mem::take(&mut self.near_in);
        let stride = self.stride;
        edges.visit(watch.sums(), |edge, moved| {
            let near_in = &mut near_in[edge];
            if *near_in == stride {
                return moved;
            }
            let way = self.look_at_edge(edge, look);
            if way.is_none() {
                *near_in = stride;
            }
            moved + way.unwrap_or(0.0) / self.sum
        });
        self.edges = edges;
        if let Some(mut faces) = self.faces.take() {
            faces.take_in(watch, look.part);
            let near_in = &mut near_in[self.surface.n_edges()..];
            faces.visit(watch.sums(), |face, moved| {
                let near_in = &mut near_in[face];
                if *near_in == stride {
                    return moved;
                }
                let way = self.look_at_face(face, look);
                if way.is_none() {
                    *near_in = stride;
                }
                moved + way.unwrap_or(0.0) / self.sum
            });
            self.faces = Some(faces);
        }
        self.near_in = near_in;
    }

    /// Holds the places of an edge that are near; how far tool and part must move before it can be (m), `None`
    /// while it is.
    fn look_at_edge(&self, index: usize, look: &mut Look<'_>) -> Option<f64> {
        let nodes = self.surface.nodes_of_edge(index);
        let key = (self.n_candidates + KEYS_OF_EDGE * index) as u32;
        let mut now = [DVec3::ZERO; MAX_EDGE_NODES];
        for (now, node) in now.iter_mut().zip(nodes) {
            *now = look.forces.position(look.part, *node);
        }
        let now = &now[..nodes.len()];
        let edge = Edge {
            order: self.surface.order(),
            nodes: now,
        };
        // What the part has moved the edge's nodes apart by is added to its length.
        let rest = look.part.rest_positions();
        let apart_at_rest = (rest[nodes[0] as usize] - rest[nodes[1] as usize]).length();
        let stretch = ((now[0] - now[1]).length() / apart_at_rest).max(1.0);
        let half = stretch * self.halves[index];
        let reach = look.near_distance;
        let found = edge.minima(look.tool, look.tool_pose, reach, half, self.flat);
        let mut is_near = false;
        if found.is_along {
            for &node in nodes {
                is_near |= self.offer_node(node, look);
            }
        } else if found.at().is_empty() {
            return Some((found.least - reach).max(0.0));
        }
        for (k, &t) in found.at().iter().enumerate() {
            is_near |= self.offer_along(nodes, key, k, t, look);
        }
        (!is_near).then(|| (trust(look.tool) * (found.least - reach)).max(0.0))
    }

    /// Offers a place along an edge, or the node that it is at; whether it is near.
    fn offer_along(
        &self,
        nodes: &[u32],
        key: u32,
        which: usize,
        t: f64,
        look: &mut Look<'_>,
    ) -> bool {
        if t == 0.0 || t == 1.0 {
            return self.offer_node(nodes[t as usize], look);
        }
        let (values, _) = minima::edge_shape(self.surface.order(), t);
        let key = key + which.min(KEYS_OF_EDGE - 1) as u32;
        if look.places.has(key) {
            return true;
        }
        let gap = look.offer(place(key, nodes, &values, look.part));
        gap.is_some_and(|gap| gap < look.near_distance)
    }

    fn offer_node(&self, node: u32, look: &mut Look<'_>) -> bool {
        if look.places.has(node) {
            return true;
        }
        let gap = look.offer(Place::node(node, look.part.rest_positions()[node as usize]));
        gap.is_some_and(|gap| gap < look.near_distance)
    }

    /// As [`Self::look_at_edge`], for the minimum inside a face.
    fn look_at_face(&self, face: usize, look: &mut Look<'_>) -> Option<f64> {
        let nodes = self.surface.nodes_of(face);
        let key = (self.n_candidates + KEYS_OF_EDGE * self.surface.n_edges() + face) as u32;
        if look.places.has(key) {
            return None;
        }
        let mut rest = [DVec3::ZERO; MAX_FACE_NODES];
        for (rest, node) in rest.iter_mut().zip(nodes) {
            *rest = look.part.rest_positions()[*node as usize];
        }
        let vertices = [nodes[0], nodes[1], nodes[2]];
        let undented = UndentedFace {
            order: self.surface.order(),
            rest: &rest[..nodes.len()],
            vertices: vertices.map(|node| look.forces.displacement(look.part, node)),
        };
        let size = self.surface.size(face);
        let middle = undented.middle_distance(look.tool, look.tool_pose);
        let beyond = middle - size - look.near_distance;
        if beyond > 0.0 {
            return Some(beyond);
        }
        let Some((l, distance)) = undented.minimum(look.tool, look.tool_pose, self.flat) else {
            // What is nearest lies on its border.
            return Some(0.0);
        };
        let place = place(key, nodes, &undented.weights(l), look.part);
        let is_near = look
            .offer(place)
            .is_some_and(|gap| gap < look.near_distance);
        (!is_near).then(|| (trust(look.tool) * (distance - look.near_distance)).max(0.0))
    }
}

fn trust(tool: &Tool) -> f64 {
    if tool.is_round() { TRUST_ROUND } else { TRUST }
}

/// The place of these weights.
fn place(key: u32, nodes: &[u32], weights: &[f64], part: &ContactPart) -> Place {
    let shares = nodes.iter().copied().zip(weights.iter().copied());
    let rest = part.rest_positions();
    let rest = shares
        .clone()
        .map(|(node, w)| w * rest[node as usize])
        .sum();
    Place::new(key, rest, shares)
}

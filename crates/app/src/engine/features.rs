//! Corners and edges of the tool that come between the nodes of the part: contacts by the shape functions of the part's
//! faces. Only built where the tool has such features.
//!
//! The rule when a point of the tool is at a face is that of [`contact::surface`]. Faces have appointments: a face whose
//! nearest feature is d beyond its reach, or in front of it, cannot be reached before the sum of motions has grown by d over
//! the largest sum of its shape functions, by which alone its points can move more than its nodes. A point that had a contact
//! keeps one to the end of the step, and the face that it was at before takes precedence over others that it is behind.

mod find;
mod memory;

use std::sync::Arc;

use contact::surface::Surface;
use contact::tool::Features;
use contact::{Contact, Place};

use super::appointments::Appointments;
use super::clusters::Clusters;
use memory::Memory;

/// All that the step needs for the tool's features.
#[derive(Debug)]
pub(super) struct ToolFeatures {
    surface: Arc<Surface>,
    features: Features,
    near_distance: f64,
    appointments: Appointments,
    memory: Memory,
    /// Of this pass; its capacity is that of the places.
    found: Vec<Found>,
    /// Number of the first of them among the places of the pass.
    first_place: u32,
    first_key: u32,
}

/// A point of the tool at a face.
#[derive(Debug, Clone, Copy)]
struct Found {
    feature: u32,
    face: u32,
    /// m; > 0 apart.
    gap: f64,
    place: Place,
    contact: Contact,
}

impl ToolFeatures {
    /// `first_key`: keys from there on are those of the features. `max_near`: places of a pass at most.
    pub(super) fn new(
        surface: Arc<Surface>,
        features: Features,
        clusters: &Clusters,
        near_distance: f64,
        (n_candidates, first_key): (usize, usize),
        max_near: usize,
    ) -> Self {
        let of_faces = (0..surface.n_faces()).map(|face| surface.nodes_of(face));
        Self {
            appointments: Appointments::new(of_faces, n_candidates, clusters),
            memory: Memory::new(features.points().len()),
            found: Vec::with_capacity(max_near),
            first_place: 0,
            near_distance,
            surface,
            features,
            first_key: first_key as u32,
        }
    }

    /// m: a motion of the tool in one go that no point passes the depth of a face with.
    pub(super) fn max_stride(surface: &Surface) -> f64 {
        let depths = (0..surface.n_faces()).map(|face| surface.depth(face));
        0.5 * depths.fold(f64::INFINITY, f64::min)
    }

    /// m, the size of the largest face: nodes that a point of the tool can lean on are within it.
    pub(super) fn largest_face(&self) -> f64 {
        let sizes = (0..self.surface.n_faces()).map(|face| self.surface.size(face));
        sizes.fold(0.0, f64::max)
    }

    /// Forgets all contact.
    pub(super) fn reset(&mut self) {
        self.appointments.begin();
        self.found.clear();
        self.memory.reset();
    }

    /// A stride begins: only features whose contacts carry force have had one. `carried_at`: places that carry force, by
    /// their number in the last pass.
    pub(super) fn begin_stride(&mut self, carried_at: &[u32]) {
        let own = carried_at
            .iter()
            .filter_map(|place| place.checked_sub(self.first_place));
        let found = own.filter_map(|k| self.found.get(k as usize));
        self.memory.begin_stride(found);
    }
}

#[cfg(test)]
mod tests;

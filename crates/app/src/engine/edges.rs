//! Corners and edges of the tool that come between the nodes of the part: rows of the contact problem by the shape
//! functions of the part's faces. Only built where the tool has such features.
//!
//! The rule when a point of the tool is at a face is that of [`contact::surface`]. Faces have appointments as nodes have
//! (`watch`): a face whose nearest feature is d beyond its reach, or in front of it, cannot be reached before the sum of
//! motions has grown by d over the largest sum of its shape functions, by which alone its points can move more than its
//! nodes; faces with nodes that carry force are always looked at. A point that had a row keeps one to the end of the step, and
//! the face that it was at before takes precedence over others that it is behind.

mod appointments;
mod find;
mod memory;

use contact::delassus::{CouplingCompliance, delassus_block_into};
use contact::face_row::{FaceRow, face_rows_into};
use contact::plane::Plane;
use contact::surface::Surface;
use contact::tool::Features;
use glam::DVec3;
use glamx::DPose3;

use super::ActiveContact;
use super::clusters::Clusters;
use super::held::Held;
use super::pairs::Pairs;
use super::part::{ContactPart, Deformed};
use super::scratch::Known;
use appointments::Appointments;
use memory::Memory;

/// All that the step needs for the tool's features.
#[derive(Debug)]
pub(super) struct Edges {
    surface: Surface,
    features: Features,
    near_distance: f64,
    appointments: Appointments,
    memory: Memory,
    /// Rows of this pass; its capacity is that of the planes.
    rows: Vec<FaceRow>,
    /// Candidates of the rows and of the planes, each once, those of the rows first.
    involved: Vec<u32>,
    n_of_rows: usize,
    /// By candidate: pass in which it was involved last.
    involved_in: Vec<u64>,
    /// By candidate of the rows: its displacement before the pass, m.
    before: Vec<DVec3>,
    /// By candidate: what W is made with.
    unit_displacement: Vec<DVec3>,
    /// By candidate: its place among the contacts, or more than there are.
    place_of: Vec<u32>,
    /// Candidates that carried force when the faces were looked at last.
    active_then: Vec<u32>,
    /// m, how deep a point of an imposed tool is in a face that cannot give way either.
    rigid_depth: f64,
}

/// The tool in a pass.
pub(super) struct Body<'a> {
    pub(super) pose: DPose3,
    pub(super) held: &'a Held,
    /// m, point of the tool's rows.
    pub(super) reference: DVec3,
}

/// Displacements as they are known, and the part to ask for others.
pub(super) struct Positions<'a> {
    pub(super) deformed: Deformed<'a>,
    pub(super) known: &'a mut Known,
}

impl Positions<'_> {
    fn displacement(&mut self, candidate: u32) -> DVec3 {
        let i = candidate as usize;
        self.known.get(i).unwrap_or_else(|| {
            let displacement = self.deformed.displacement(i);
            self.known.set(i, displacement);
            displacement
        })
    }

    fn at(&mut self, candidate: u32) -> DVec3 {
        self.deformed.part.rest_positions()[candidate as usize] + self.displacement(candidate)
    }
}

impl Edges {
    pub(super) fn new(
        surface: Surface,
        features: Features,
        clusters: &Clusters,
        near_distance: f64,
        n_candidates: usize,
        max_rows: usize,
    ) -> Self {
        Self {
            appointments: Appointments::new(&surface, clusters),
            memory: Memory::new(features.points().len(), max_rows),
            rows: Vec::with_capacity(max_rows),
            involved: Vec::with_capacity(n_candidates),
            n_of_rows: 0,
            involved_in: vec![0; n_candidates],
            before: vec![DVec3::ZERO; n_candidates],
            unit_displacement: vec![DVec3::ZERO; n_candidates],
            place_of: vec![u32::MAX; n_candidates],
            active_then: Vec::with_capacity(n_candidates),
            near_distance,
            surface,
            features,
            rigid_depth: 0.0,
        }
    }

    /// m, how deep an imposed tool is in faces that cannot give way, in the last pass.
    pub(super) fn rigid_depth(&self) -> f64 {
        self.rigid_depth
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
        self.appointments.begin(0);
        self.active_then.clear();
        self.rows.clear();
        self.memory.reset();
    }

    pub(super) fn begin_stride(&mut self) {
        self.memory.begin_stride();
    }

    pub(super) fn rows(&self) -> &[FaceRow] {
        &self.rows
    }

    /// Rows that carry force.
    pub(super) fn n_carried(&self) -> usize {
        self.memory.n_carried()
    }

    pub(super) fn is_carried(&self, row: &FaceRow) -> bool {
        self.memory.is_carried(row.feature)
    }

    /// Lists the candidates of rows and planes, and keeps where those of the rows are.
    fn list_involved(&mut self, positions: &mut Positions<'_>, planes: &[Plane]) {
        let pass = self.memory.pass();
        self.involved.clear();
        for row in &self.rows {
            for &(candidate, _) in row.shares() {
                let involved_in = &mut self.involved_in[candidate as usize];
                if *involved_in != pass {
                    *involved_in = pass;
                    self.involved.push(candidate);
                    self.before[candidate as usize] = positions.displacement(candidate);
                }
            }
        }
        self.n_of_rows = self.involved.len();
        // Also where no point is at a face: the operator of the planes alone is made of the blocks of these.
        for plane in planes {
            let involved_in = &mut self.involved_in[plane.candidate as usize];
            if *involved_in != pass {
                *involved_in = pass;
                self.involved.push(plane.candidate);
            }
        }
    }

    /// Writes the gaps that remain at zero contact force. `deviation`: of the tool from its target.
    pub(super) fn gaps_into(&self, reference: DVec3, deviation: &[f64; 6], q: &mut [f64]) {
        for (q, row) in q.iter_mut().zip(&self.rows) {
            let tool_row = row.tool_row(reference);
            let along: f64 = tool_row.iter().zip(deviation).map(|(h, e)| h * e).sum();
            let u = row.displacement(|node| self.before[node as usize]);
            *q = row.gap - row.normal.dot(u) + along;
        }
    }

    /// Writes the whole operator, planes first.
    pub(super) fn delassus_into(
        &mut self,
        pairs: &mut Pairs,
        part: &ContactPart,
        planes: &[Plane],
        coupling: Option<CouplingCompliance<'_>>,
        w: &mut [f64],
    ) -> Result<(), contact::Error> {
        let m = planes.len() + self.rows.len();
        let (rows, involved) = (&self.rows, &self.involved[..self.n_of_rows]);
        let unit = &mut self.unit_displacement;
        if pairs.ensure(self.involved.iter().copied(), part) {
            delassus_block_into(&*pairs, planes, coupling, m, w)?;
            face_rows_into(&*pairs, planes, rows, coupling, involved, unit, w)
        } else {
            delassus_block_into(part, planes, coupling, m, w)?;
            face_rows_into(part, planes, rows, coupling, involved, unit, w)
        }
    }

    /// Adds the forces of the rows to the contacts, each candidate once; those of planes are there.
    pub(super) fn adopt_forces(
        &mut self,
        normal_forces: &[f64],
        active: &mut Vec<ActiveContact>,
        was_active: &mut [bool],
    ) {
        self.memory.forget_carried();
        for (place, contact) in active.iter().enumerate() {
            self.place_of[contact.candidate as usize] = place as u32;
        }
        for (row, &force) in self.rows.iter().zip(normal_forces) {
            let is_carried = force > 0.0;
            if !is_carried {
                continue;
            }
            self.memory.carry(row.feature, row.face);
            for &(candidate, share) in row.shares() {
                let place = self.place_of[candidate as usize] as usize;
                let (normal_force, on_part) = (share * force, share * force * row.normal);
                match active.get_mut(place).filter(|c| c.candidate == candidate) {
                    Some(contact) => {
                        contact.normal_force += normal_force;
                        contact.force_on_part += on_part;
                    }
                    None => {
                        self.place_of[candidate as usize] = active.len() as u32;
                        was_active[candidate as usize] = true;
                        active.push(ActiveContact {
                            candidate,
                            normal_force,
                            force_on_part: on_part,
                        });
                    }
                }
            }
        }
    }

    /// Force (N) and torque (N m about `reference`) of the rows on the tool.
    pub(super) fn wrench_on_tool(&self, normal_forces: &[f64], reference: DVec3) -> (DVec3, DVec3) {
        let wrenches = self.rows.iter().zip(normal_forces);
        wrenches.fold((DVec3::ZERO, DVec3::ZERO), |sum, (row, &normal_force)| {
            let (force, torque) = row.wrench_on_tool(normal_force, reference);
            (sum.0 + force, sum.1 + torque)
        })
    }

    /// Largest change of displacement of the rows' nodes since the pass began, m.
    pub(super) fn largest_change(&self, positions: &mut Positions<'_>) -> f64 {
        let nodes = self.involved[..self.n_of_rows].iter();
        nodes
            .map(|&c| (positions.displacement(c) - self.before[c as usize]).length())
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests;

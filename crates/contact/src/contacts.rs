//! Contacts as data: a place of the part, and the tool's surface there, linearised.
//!
//! A [`Place`] is a material point of the part: the weights with which nodes move it. A node is a place of one share of
//! weight 1; a point on an edge or a face has its shape functions. A [`Contact`] is what the tool is to a place now: a
//! gap, a normal and a point, from which come the contact's rows,
//!
//! ```text
//! H_d = Σ_a w_a nᵀ at the nodes a      h = [n, r × n]      gap(u, ξ) = gap + n · Σ_a w_a Δu_a - h · Δξ
//! ```
//! A normal force f_n puts w_a f_n n on node a and -f_n h on the tool. Sources: Duriez et al. 2004, Fig. 3 (one plane for
//! each near node, here with unit normals); for the shares of a contact, the collision stencils of ipc-toolkit.

use glam::{DMat3, DVec3};
use glamx::DPose3;

use crate::delassus::ComplianceBlocks;
use crate::face::MAX_FACE_NODES;
use crate::tool::Tool;

/// How the gap of a place is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Witness {
    /// To the tool's surface, along its normal.
    Surface,
    /// Along the outward normal of a face of the part, to a point of the tool (a corner, a point of an edge), tool's
    /// frame, m.
    Point {
        /// Of the tool.
        local: DVec3,
        /// Unit, minus the face's outward normal, part's frame.
        normal: DVec3,
    },
}

/// A material point of the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// What it is from step to step: a number that the caller gives.
    pub key: u32,
    /// At rest, part's frame, m.
    pub rest: DVec3,
    /// How its gap is measured.
    pub witness: Witness,
    n_shares: usize,
    shares: [(u32, f64); MAX_FACE_NODES],
}

impl Place {
    /// A candidate node, under its own number.
    pub fn node(candidate: u32, rest: DVec3) -> Self {
        Self::new(candidate, rest, [(candidate, 1.0)])
    }

    /// A point by its shares of candidates, [`MAX_FACE_NODES`] at most; those of weight 0 are left out.
    pub fn new(key: u32, rest: DVec3, weights: impl IntoIterator<Item = (u32, f64)>) -> Self {
        let mut place = Self {
            key,
            rest,
            witness: Witness::Surface,
            n_shares: 0,
            shares: [(0, 0.0); MAX_FACE_NODES],
        };
        for share in weights.into_iter().filter(|share| share.1 != 0.0) {
            place.shares[place.n_shares] = share;
            place.n_shares += 1;
        }
        place
    }

    /// The same with another way to measure the gap.
    pub fn seen_by(self, witness: Witness) -> Self {
        Self { witness, ..self }
    }

    /// Candidates and their weights; held nodes have none.
    #[inline]
    pub fn shares(&self) -> &[(u32, f64)] {
        &self.shares[..self.n_shares]
    }

    /// The node that the place is, if it is one.
    #[inline]
    pub fn as_node(&self) -> Option<u32> {
        match self.shares() {
            [(node, weight)] if *weight == 1.0 => Some(*node),
            _ => None,
        }
    }

    /// Displacement by that of the nodes, m.
    #[inline]
    pub fn displacement(&self, mut of_node: impl FnMut(u32) -> DVec3) -> DVec3 {
        let shares = self.shares().iter();
        shares.map(|(node, weight)| *weight * of_node(*node)).sum()
    }

    /// Compliance between two places, Σ_ab w_a w_b C_ab: displacement of this one per unit force at the other, m/N.
    #[inline]
    pub fn block(&self, other: &Self, compliance: &impl ComplianceBlocks) -> DMat3 {
        let mut sum = DMat3::ZERO;
        for &(a, w_a) in self.shares() {
            for &(b, w_b) in other.shares() {
                sum += compliance.block(a as usize, b as usize) * (w_a * w_b);
            }
        }
        sum
    }

    /// The tool seen from the place, which is number `place` of the caller's and is at `position` now (part's frame, m).
    #[inline]
    pub fn contact(&self, place: u32, tool: &Tool, pose: &DPose3, position: DVec3) -> Contact {
        match self.witness {
            Witness::Surface => {
                let seen = tool.signed_distance(pose, position);
                Contact {
                    place,
                    gap: seen.signed_distance,
                    normal: seen.normal,
                    point: position,
                }
            }
            Witness::Point { local, normal } => {
                let point = pose.transform_point(local);
                Contact {
                    place,
                    gap: normal.dot(position - point),
                    normal,
                    point,
                }
            }
        }
    }
}

/// The tool's surface at one place, linearised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Number of the place in the caller's list.
    pub place: u32,
    /// m; > 0 apart.
    pub gap: f64,
    /// Unit, outward from the tool, towards the part; part's frame.
    pub normal: DVec3,
    /// Where the tool is touched, part's frame, m.
    pub point: DVec3,
}

impl Contact {
    /// The tool's contact Jacobian h = [n, r x n] with r from `reference` to the point (m): the gap falls by
    /// h · (translation, rotation) of the tool, and `-h f_n` is the wrench (force N, torque N m about `reference`) on the tool.
    #[inline]
    pub fn tool_row(&self, reference: DVec3) -> [f64; 6] {
        self.tool_row_along(self.normal, reference)
    }

    /// The same along any unit direction d: [d, r × d].
    #[inline]
    pub fn tool_row_along(&self, direction: DVec3, reference: DVec3) -> [f64; 6] {
        let [x, y, z] = direction.to_array();
        let [tx, ty, tz] = (self.point - reference).cross(direction).to_array();
        [x, y, z, tx, ty, tz]
    }

    /// Whether all its numbers are finite and the normal has unit length.
    pub fn is_sound(&self) -> bool {
        /// Round-off of a rotated unit vector is 1e-15; a pose quaternion that is off by more is no rotation.
        const TOLERANCE: f64 = 1e-6;
        // A product that is not finite says so for all its factors.
        let check = self.gap * self.point.length();
        check.is_finite() && (self.normal.length_squared() - 1.0).abs() < TOLERANCE
    }
}

/// Force (N) and torque (N m about `reference`) that contacts with these forces on the part (N) exert on the tool, part's
/// frame: `-Σ [f, r × f]`, which for normal forces is `-Σ f_n h`.
pub fn wrench_on_tool(
    contacts: &[Contact],
    forces_on_part: &[DVec3],
    reference: DVec3,
) -> (DVec3, DVec3) {
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (contact, &on_part) in contacts.iter().zip(forces_on_part) {
        let force_on_tool = -on_part;
        force += force_on_tool;
        torque += (contact.point - reference).cross(force_on_tool);
    }
    (force, torque)
}

#[cfg(test)]
mod tests;

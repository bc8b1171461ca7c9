//! A point of the tool's edges against a face of the part: one row of the contact problem by the face's shape functions.
//!
//! ```text
//! gap = n · (x_face(l) - p)        x_face(l) = Σ_a N_a(l) x_a
//! H_d = Σ_a N_a nᵀ at the face's nodes a,      h = [n, r × n], r from the reference to p
//! ```
//! n is minus the face's outward normal: outward from the tool, towards the part. A normal force f_n puts N_a f_n n on
//! node a; at the vertices of quadratic and cubic faces N_a may be negative, and the sum over the nodes is f_n n.

use glam::DVec3;

use crate::delassus::{ComplianceBlocks, CouplingCompliance, twist_per_force};
use crate::error::Error;
use crate::face::{MAX_FACE_NODES, Nearest};
use crate::plane::Plane;
use crate::surface::Surface;

/// A point of the tool near a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceRow {
    /// The tool's point: its place in the caller's list.
    pub feature: u32,
    /// The face.
    pub face: u32,
    /// m; > 0 apart.
    pub gap: f64,
    /// Unit, outward from the tool, towards the part; part's frame.
    pub normal: DVec3,
    /// Position of the tool's point, part's frame, m.
    pub point: DVec3,
    n_shares: usize,
    shares: [(u32, f64); MAX_FACE_NODES],
}

impl FaceRow {
    /// Of a tool's point and the point of a face that is nearest to it. Held nodes get no share.
    pub fn new(
        surface: &Surface,
        face: u32,
        feature: u32,
        point: DVec3,
        nearest: &Nearest,
    ) -> Self {
        let mut row = Self {
            feature,
            face,
            gap: nearest.height,
            normal: -nearest.outward,
            point,
            n_shares: 0,
            shares: [(0, 0.0); MAX_FACE_NODES],
        };
        let nodes = surface.nodes_of(face as usize).iter();
        for (&node, weight) in nodes.zip(nearest.weights) {
            if surface.is_candidate(node) && weight != 0.0 {
                row.shares[row.n_shares] = (node, weight);
                row.n_shares += 1;
            }
        }
        row
    }

    /// Candidates and their shape functions N_a.
    pub fn shares(&self) -> &[(u32, f64)] {
        &self.shares[..self.n_shares]
    }

    /// As [`Plane::tool_row`], at the tool's point.
    pub fn tool_row(&self, reference: DVec3) -> [f64; 6] {
        self.as_plane().tool_row(reference)
    }

    /// Displacement of the face's point by that of its nodes, m.
    pub fn displacement(&self, of_node: impl Fn(u32) -> DVec3) -> DVec3 {
        let shares = self.shares().iter();
        shares.map(|(node, weight)| *weight * of_node(*node)).sum()
    }

    /// Where the tool is concerned a row is like that of a node at the point.
    fn as_plane(&self) -> Plane {
        Plane {
            candidate: u32::MAX,
            gap: self.gap,
            normal: self.normal,
            point: self.point,
        }
    }

    /// Force (N) and torque (N m about `reference`) on the tool of a normal force f_n (N): `-f_n h`.
    pub fn wrench_on_tool(&self, normal_force: f64, reference: DVec3) -> (DVec3, DVec3) {
        let force = -normal_force * self.normal;
        (force, (self.point - reference).cross(force))
    }
}

/// Adds the rows of faces to a Delassus operator of which the rows of nodes are there.
///
/// ```text
/// W_ij = Σ_ab N_a N_b n_iᵀ C_ab n_j + h_iᵀ K_c⁻¹ h_j
/// ```
/// `w`: column-major, m x m with m the number of planes and rows, planes first; their own block was written by
/// [`crate::delassus::delassus_block_into`]. `involved`: the candidates of all rows, each once. `displacement`: scratch,
/// one entry for each candidate of the part. Does not allocate. Cost: for each row, 9 multiply-adds for each pair of one
/// of its nodes and an involved candidate or plane.
///
/// # Errors
/// [`Error::Length`] unless `w` has m² entries.
pub fn face_rows_into(
    compliance: &impl ComplianceBlocks,
    planes: &[Plane],
    rows: &[FaceRow],
    coupling: Option<CouplingCompliance>,
    involved: &[u32],
    displacement: &mut [DVec3],
    w: &mut [f64],
) -> Result<(), Error> {
    let (n, m) = (planes.len(), planes.len() + rows.len());
    if w.len() != m * m {
        return Err(Error::Length {
            what: "the Delassus operator",
            expected: m * m,
            actual: w.len(),
        });
    }
    for (k, row) in rows.iter().enumerate() {
        let j = n + k;
        let twist = coupling.map(|coupling| twist_per_force(&coupling, &row.as_plane()));
        // How far the tool's surface at a point yields to a unit force in row j.
        let of_tool = |point: DVec3| match (&coupling, twist) {
            (Some(coupling), Some((translation, rotation))) => {
                translation + rotation.cross(point - coupling.reference)
            }
            _ => DVec3::ZERO,
        };
        // How far a candidate moves.
        let of_part = |candidate: u32| {
            let moved = row.shares().iter().map(|&(node, weight)| {
                compliance.block(candidate as usize, node as usize) * (weight * row.normal)
            });
            moved.sum::<DVec3>()
        };
        for &candidate in involved {
            displacement[candidate as usize] = of_part(candidate);
        }
        for (i, plane) in planes.iter().enumerate() {
            let moved = of_part(plane.candidate) + of_tool(plane.point);
            let entry = plane.normal.dot(moved);
            w[j * m + i] = entry;
            w[i * m + j] = entry;
        }
        for (l, other) in rows[..=k].iter().enumerate() {
            let of_face = other.displacement(|node| displacement[node as usize]);
            let entry = other.normal.dot(of_face + of_tool(other.point));
            w[j * m + n + l] = entry;
            w[(n + l) * m + j] = entry;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;

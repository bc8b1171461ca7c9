//! What does not give way at all, under a tool whose pose is imposed: no force can settle such a contact, so it is told
//! and left out.
//!
//! With a coupling the tool itself gives way, and a held node is a contact like any other.

use contact::delassus::ComplianceBlocks;
use contact::face_row::FaceRow;
use contact::plane::Plane;
use glam::DVec3;

use super::ContactPart;
use super::held::Held;

/// Of a block's norm, the compliance along a normal below which it is none: what round-off leaves in a direction that is
/// held.
const NO_COMPLIANCE: f64 = 1e-12;

/// Takes out the planes along whose normals the part cannot give way; how deep the tool is in the deepest of them, m.
pub(super) fn leave_out_planes(
    planes: &mut Vec<Plane>,
    part: &ContactPart,
    held: &Held,
    reference: DVec3,
) -> f64 {
    let mut deepest = 0.0_f64;
    planes.retain(|plane| {
        let candidate = plane.candidate as usize;
        let block = part.block(candidate, candidate);
        let own = plane.normal.dot(block * plane.normal);
        let gives_way = own > NO_COMPLIANCE * part.largest_block(plane.candidate)
            || held.yields_along(&plane.tool_row(reference));
        if !gives_way {
            deepest = deepest.max(-plane.gap);
        }
        gives_way
    });
    deepest
}

/// As [`leave_out_planes`], for points of the tool at faces.
pub(super) fn leave_out_rows(
    rows: &mut Vec<FaceRow>,
    part: &ContactPart,
    held: &Held,
    reference: DVec3,
) -> f64 {
    let mut deepest = 0.0_f64;
    rows.retain(|row| {
        let largest = row.shares().iter().map(|s| part.largest_block(s.0));
        let largest = largest.fold(0.0, f64::max);
        let moved_by = |node: u32| {
            let forces = row.shares().iter();
            let moved = forces.map(|(other, weight)| {
                part.block(node as usize, *other as usize) * (*weight * row.normal)
            });
            moved.sum::<DVec3>()
        };
        let gives_way = row.normal.dot(row.displacement(moved_by)) > NO_COMPLIANCE * largest
            || held.yields_along(&row.tool_row(reference));
        if !gives_way {
            deepest = deepest.max(-row.gap);
        }
        gives_way
    });
    deepest
}

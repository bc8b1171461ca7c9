//! Flat rigid body without an end.

use glam::DVec3;

use super::ContactPoint;

/// Everything with local z ≤ 0; its outward normal is local +z.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfSpace;

impl HalfSpace {
    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        ContactPoint {
            signed_distance: point.z,
            normal: DVec3::Z,
        }
    }

    /// A square of half side `extent` in the plane.
    pub(super) fn tessellate(&self, extent: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let vertices = corners.map(|(x, y)| DVec3::new(x * extent, y * extent, 0.0));
        (vertices.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
    }
}

//! Closed triangle mesh, from a file or from arrays.
//!
//! Distance by a bounding-volume tree, sign by the angle-weighted pseudo-normals of faces, edges and vertices.
//!
//! Source: Bærentzen and Aanæs, Signed distance computation using the angle weighted pseudonormal (2005).

mod file;
mod nesting;
mod topology;
mod weld;

use std::path::Path;

use glam::{DMat3, DVec3};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TriMeshFlags, TrianglePointLocation};

use super::{ContactPoint, unit_or};
use crate::error::{Coordinates, Error, check_positive};

/// Closed, outward oriented triangle mesh.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Shifted to its centre and scaled by a power of two to size 1 to 2: parry's tolerances are absolute.
    unit_mesh: TriMesh,
    center: DVec3,
    unit: f64,
    half_extents: DVec3,
    repair: MeshRepair,
}

/// What was changed in a mesh before use. Say it to the user.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeshRepair {
    /// Vertices at the same place that became one (an STL file has three per triangle).
    pub n_merged_vertices: usize,
    /// Vertices that differed from another one by round-off and became one with it, because the surface is closed only
    /// so: seams that a modelling program computed twice.
    pub n_welded_vertices: usize,
    /// m: the farthest that one of them was moved along an axis.
    pub weld_distance: f64,
    /// Triangles left out because two of their vertices are the same.
    pub n_removed_triangles: usize,
    /// Triangles turned round to agree with their neighbours.
    pub n_turned_triangles: usize,
    /// Pieces of surface that faced inward as a whole and were turned inside out.
    pub n_inverted_pieces: usize,
}

impl Mesh {
    /// From vertices (tool's frame, m) and triangles (from 0). Winding is corrected, see [`Mesh::repair`].
    ///
    /// # Errors
    /// A mesh that is empty, not finite, open, not manifold, not orientable, or without volume, each by name
    /// and place.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, Error> {
        Self::of_closed(topology::close(vertices, triangles, Coordinates::Metres)?)
    }

    fn of_closed(closed: topology::Closed) -> Result<Self, Error> {
        let (mut min, mut max) = (closed.vertices[0], closed.vertices[0]);
        for &vertex in &closed.vertices {
            min = min.min(vertex);
            max = max.max(vertex);
        }
        let center = 0.5 * (min + max);
        let half_extents = 0.5 * (max - min);
        let unit = half_extents.max_element().log2().floor().exp2();
        let unit_vertices = closed
            .vertices
            .iter()
            .map(|v| (*v - center) / unit)
            .collect();
        let unit_mesh =
            TriMesh::with_flags(unit_vertices, closed.triangles, TriMeshFlags::ORIENTED)
                .map_err(|_| Error::MeshEmpty)?;
        Ok(Self {
            unit_mesh,
            center,
            unit,
            half_extents,
            repair: closed.repair,
        })
    }

    /// From an `.stl` (text or binary) or `.obj` file; `metres_per_unit` is 0.001 for a file in mm.
    ///
    /// Text keeps its digits; binary STL stores f32, 1e-7 of the size. All solids of a file are read.
    ///
    /// # Errors
    /// [`Error::MeshFile`], [`Error::MeshFormat`], [`Error::NotPositive`], and those of [`Mesh::new`] with places
    /// in the file's coordinates.
    pub fn read(path: &Path, metres_per_unit: f64) -> Result<Self, Error> {
        check_positive("metres per mesh unit", metres_per_unit)?;
        let (vertices, triangles) = file::read(path)?;
        let mut closed = topology::close(&vertices, &triangles, Coordinates::OfFile)?;
        for vertex in &mut closed.vertices {
            *vertex *= metres_per_unit;
        }
        closed.repair.weld_distance *= metres_per_unit;
        Self::of_closed(closed)
    }

    /// What was changed on the way in.
    pub fn repair(&self) -> MeshRepair {
        self.repair
    }

    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        /// Of the mesh's size: nearer points have lost the direction to the surface in round-off (1e-16), so
        /// that the surface's own normal is the better one.
        const ON_SURFACE: f64 = 1e-10;
        let point = (point - self.center) / self.unit;
        let (nearest, (triangle, location)) = self
            .unit_mesh
            .project_local_point_and_get_location(point, false);
        let outward = self.pseudo_normal(triangle, location);
        let away = point - nearest.point;
        let length = away.length();
        let sign = if away.dot(outward) < 0.0 { -1.0 } else { 1.0 };
        let is_face = matches!(
            location,
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid
        );
        let normal = if is_face || length < ON_SURFACE {
            outward
        } else {
            unit_or(away * sign, length, outward)
        };
        ContactPoint {
            signed_distance: sign * length * self.unit,
            normal,
        }
    }

    fn pseudo_normal(&self, triangle: u32, location: TrianglePointLocation) -> DVec3 {
        let face = self.unit_mesh.triangle(triangle).scaled_normal();
        let pseudo_normals = self.unit_mesh.pseudo_normals();
        let outward = match (location, pseudo_normals) {
            (TrianglePointLocation::OnEdge(edge, _), Some(normals)) => {
                normals.edges_pseudo_normal[triangle as usize][edge as usize]
            }
            (TrianglePointLocation::OnVertex(corner), Some(normals)) => {
                let vertex = self.unit_mesh.indices()[triangle as usize][corner as usize];
                normals.vertices_pseudo_normal[vertex as usize]
            }
            _ => face,
        };
        // Two faces folded onto each other have no common normal: that of one will do.
        let outward = if outward == DVec3::ZERO {
            face
        } else {
            outward
        };
        unit_or(outward, outward.length(), DVec3::X)
    }

    pub(super) fn center_and_half_extents(&self, rotation: &DMat3) -> (DVec3, DVec3) {
        (self.center, rotation.abs() * self.half_extents)
    }

    pub(super) fn characteristic_size(&self) -> f64 {
        self.half_extents.min_element()
    }

    pub(super) fn tessellate(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let vertices = self.unit_mesh.vertices().iter();
        let vertices = vertices.map(|v| *v * self.unit + self.center).collect();
        (vertices, self.unit_mesh.indices().to_vec())
    }
}

#[cfg(test)]
mod tests;

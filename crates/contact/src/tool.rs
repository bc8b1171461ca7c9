//! Rigid tools: exact signed distance and outward normal of a shape; of a [`DistanceField`] within its bound.
//!
//! Every shape answers in its own frame, `signed_distance_local`; [`Tool`] brings a point of the part's frame there and
//! the normal back. On the medial axis, where the nearest surface point is not unique, one of the nearest is taken
//! by a fixed rule, so that normals are always finite and of unit length.

mod box_shape;
mod capsule;
mod cylinder;
pub mod features;
mod field;
mod half_space;
mod mesh;
mod sphere;
mod tessellation;

use std::sync::Arc;

use glam::{DMat3, DVec3};
use glamx::DPose3;

pub use box_shape::BoxShape;
pub use capsule::Capsule;
pub use cylinder::Cylinder;
pub use features::Features;
pub use field::DistanceField;
pub use half_space::HalfSpace;
pub use mesh::{Mesh, MeshRepair};
pub use sphere::Sphere;

/// Signed distance of a point to a tool, and where the tool's surface faces there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// m; > 0 outside the tool, < 0 inside.
    pub signed_distance: f64,
    /// Unit normal, outward from the tool: the gradient of the signed distance.
    pub normal: DVec3,
}

/// A rigid shape. The enum is ours: adding a shape is one file in `tool/` and one line per function here.
#[derive(Debug, Clone)]
pub enum Tool {
    /// Ball round the origin.
    Sphere(Sphere),
    /// Round bar along local z, finite or infinite.
    Cylinder(Cylinder),
    /// Brick round the origin.
    Box(BoxShape),
    /// Round bar along local z with half spheres as ends.
    Capsule(Capsule),
    /// Everything below the local plane z = 0.
    HalfSpace(HalfSpace),
    /// Closed triangle mesh.
    Mesh(Arc<Mesh>),
    /// Any bounded tool, interpolated from distances computed before.
    Field(Arc<DistanceField>),
}

impl Tool {
    /// Whether its surface has no facets, and no edges but those of a cylinder's ends.
    pub fn is_round(&self) -> bool {
        match self {
            Self::Sphere(_) | Self::Cylinder(_) | Self::Capsule(_) | Self::HalfSpace(_) => true,
            Self::Box(_) | Self::Mesh(_) | Self::Field(_) => false,
        }
    }

    /// Signed distance and outward normal at `point` of the part's frame.
    ///
    /// `pose_part_tool`: the tool's pose in the part's frame. Result in the part's frame. Does not allocate.
    pub fn signed_distance(&self, pose_part_tool: &DPose3, point: DVec3) -> ContactPoint {
        let local = pose_part_tool.inverse_transform_point(point);
        let contact = self.signed_distance_local(local);
        ContactPoint {
            normal: pose_part_tool.transform_vector(contact.normal),
            ..contact
        }
    }

    /// As [`Tool::signed_distance`] with point and result in the tool's frame.
    pub fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        match self {
            Self::Sphere(shape) => shape.signed_distance_local(point),
            Self::Cylinder(shape) => shape.signed_distance_local(point),
            Self::Box(shape) => shape.signed_distance_local(point),
            Self::Capsule(shape) => shape.signed_distance_local(point),
            Self::HalfSpace(shape) => shape.signed_distance_local(point),
            Self::Mesh(shape) => shape.signed_distance_local(point),
            Self::Field(field) => field.signed_distance_local(point),
        }
    }

    /// Least and largest corner of a box round the tool, part's frame, m. None for a half-space. Entries are infinite
    /// where an infinite cylinder is.
    pub fn aabb(&self, pose_part_tool: &DPose3) -> Option<(DVec3, DVec3)> {
        let rotation = DMat3::from_quat(pose_part_tool.rotation);
        let (center, half) = match self {
            Self::Sphere(shape) => (DVec3::ZERO, shape.half_extents()),
            Self::Cylinder(shape) => (DVec3::ZERO, shape.half_extents(rotation.z_axis)),
            Self::Box(shape) => (DVec3::ZERO, shape.half_extents(&rotation)),
            Self::Capsule(shape) => (DVec3::ZERO, shape.half_extents(rotation.z_axis)),
            Self::HalfSpace(_) => return None,
            Self::Mesh(shape) => shape.center_and_half_extents(&rotation),
            Self::Field(field) => return field.tool().aabb(pose_part_tool),
        };
        let center = pose_part_tool.transform_point(center);
        Some((center - half, center + half))
    }

    /// How much a signed distance may be wrong, m: nothing but for a [`DistanceField`].
    pub fn error_bound(&self) -> f64 {
        match self {
            Self::Field(field) => field.error_bound(),
            _ => 0.0,
        }
    }

    /// Size of the smallest feature that a motion must not step over, m: radius or smallest half extent. Infinite for
    /// a half-space; for a mesh half its smallest extent.
    pub fn characteristic_size(&self) -> f64 {
        match self {
            Self::Sphere(shape) => shape.radius(),
            Self::Cylinder(shape) => shape.characteristic_size(),
            Self::Box(shape) => shape.half_extents_local().min_element(),
            Self::Capsule(shape) => shape.radius(),
            Self::HalfSpace(_) => f64::INFINITY,
            Self::Mesh(shape) => shape.characteristic_size(),
            Self::Field(field) => field.tool().characteristic_size(),
        }
    }

    /// Vertices (tool's frame, m) and triangles (wound so that they face outward) for drawing.
    ///
    /// `extent`: half length at which an infinite cylinder is cut, half side of the square for a half-space, m.
    pub fn tessellate(&self, extent: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        match self {
            Self::Sphere(shape) => shape.tessellate(),
            Self::Cylinder(shape) => shape.tessellate(extent),
            Self::Box(shape) => shape.tessellate(),
            Self::Capsule(shape) => shape.tessellate(),
            Self::HalfSpace(shape) => shape.tessellate(extent),
            Self::Mesh(shape) => shape.tessellate(),
            Self::Field(field) => field.tool().tessellate(extent),
        }
    }
}

/// `vector / length`, or `fallback` where there is no direction.
fn unit_or(vector: DVec3, length: f64, fallback: DVec3) -> DVec3 {
    /// m: the squares of shorter vectors fall below the smallest numbers and the length is wrong.
    const SHORTEST: f64 = 1e-150;
    if length >= SHORTEST {
        vector / length
    } else {
        fallback
    }
}

#[cfg(test)]
mod tests;

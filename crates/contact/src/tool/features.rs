//! Corners and sharp edges of a tool as points in its frame: what can come between the nodes of a part and is then
//! seen by none of them.
//!
//! Edges are sampled. Round tools have none, and neither has a mesh where its triangles meet at less than
//! [`SHARP_DEGREES`]: over such a bend a face of the part cannot be entered much deeper than its nodes notice.

mod of_mesh;

use std::f64::consts::TAU;

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, TraversalAction};

use super::Tool;
use crate::error::{Error, check_positive};

/// Bend of a tool's surface from which an edge or corner counts as sharp.
pub const SHARP_DEGREES: f64 = 20.0;

/// Points of a tool at most; beyond it edges are sampled more coarsely. 24 bytes each, and as much again for the tree.
pub const MOST_POINTS: usize = 200_000;

/// Corners, and points on sharp edges, tool's frame.
#[derive(Clone)]
pub struct Features {
    points: Vec<DVec3>,
    tree: Bvh,
    spacing: f64,
}

impl std::fmt::Debug for Features {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Features")
            .field("n_points", &self.points.len())
            .field("spacing", &self.spacing)
            .finish_non_exhaustive()
    }
}

/// A sharp line of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Curve {
    Corner(DVec3),
    /// Its ends are corners of their own.
    Edge(DVec3, DVec3),
    /// Circle about local z.
    Rim {
        radius: f64,
        z: f64,
    },
}

impl Curve {
    fn length(self) -> f64 {
        match self {
            Self::Corner(_) => 0.0,
            Self::Edge(a, b) => (b - a).length(),
            Self::Rim { radius, .. } => TAU * radius,
        }
    }

    fn sample(self, spacing: f64, points: &mut Vec<DVec3>) {
        let n = (self.length() / spacing).ceil().max(1.0) as usize;
        match self {
            Self::Corner(at) => points.push(at),
            Self::Edge(a, b) => {
                points.extend((1..n).map(|k| a.lerp(b, k as f64 / n as f64)));
            }
            Self::Rim { radius, z } => {
                // As fine as the circle itself wants it, too.
                let n = n.max(super::tessellation::SEGMENTS);
                points.extend((0..n).map(|k| {
                    let angle = TAU * k as f64 / n as f64;
                    DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
                }));
            }
        }
    }
}

impl Features {
    /// Of a tool, with points on its edges no farther from one another than `spacing` (m); None where the tool has
    /// neither corners nor sharp edges. Of a distance field those of the tool inside.
    ///
    /// More than [`MOST_POINTS`] are not made: [`Features::spacing`] is larger then.
    ///
    /// # Errors
    /// [`Error::NotPositive`].
    pub fn new(tool: &Tool, spacing: f64) -> Result<Option<Self>, Error> {
        check_positive("spacing of points on tool edges", spacing)?;
        let curves = curves_of(tool);
        if curves.is_empty() {
            return Ok(None);
        }
        let length: f64 = curves.iter().map(|curve| curve.length()).sum();
        let spacing = spacing.max(length / MOST_POINTS as f64);
        let mut points = Vec::new();
        for curve in curves {
            curve.sample(spacing, &mut points);
        }
        let leaves: Vec<Aabb> = points.iter().map(|&p| Aabb::new(p, p)).collect();
        Ok(Some(Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves),
            points,
            spacing,
        }))
    }

    /// Whether a tool has corners or sharp edges.
    pub fn has_some(tool: &Tool) -> bool {
        !curves_of(tool).is_empty()
    }

    /// Tool's frame, m. A point is named by its place in this list.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Largest distance of neighbours on an edge, m.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Calls `found` for every point in the box from `min` to `max` (tool's frame, m), bounds included. Does not
    /// allocate.
    pub fn inside_box(&self, min: DVec3, max: DVec3, mut found: impl FnMut(u32)) {
        self.tree.traverse(|node| {
            let overlaps = node.mins().cmple(max).all() && node.maxs().cmpge(min).all();
            if !overlaps {
                return TraversalAction::Prune;
            }
            if let Some(point) = node.leaf_data() {
                found(point);
            }
            TraversalAction::Continue
        });
    }

    /// Distance of `point` (tool's frame, m) from the nearest feature, or something less, down to a third of it: the
    /// tree is not followed into boxes that are far away for their size. Does not allocate.
    pub fn distance_bound(&self, point: DVec3) -> f64 {
        let mut least = f64::INFINITY;
        self.tree.traverse(|node| {
            let (min, max) = (node.mins(), node.maxs());
            let to_box = (min - point).max(point - max).max(DVec3::ZERO).length();
            if to_box >= least {
                return TraversalAction::Prune;
            }
            if node.is_leaf() || 0.5 * (max - min).length() < to_box {
                least = to_box;
                return TraversalAction::Prune;
            }
            TraversalAction::Continue
        });
        least
    }
}

fn curves_of(tool: &Tool) -> Vec<Curve> {
    match tool {
        Tool::Sphere(_) | Tool::Capsule(_) | Tool::HalfSpace(_) => Vec::new(),
        Tool::Cylinder(shape) => shape.half_length().map_or_else(Vec::new, |half_length| {
            let radius = shape.radius();
            [-half_length, half_length]
                .map(|z| Curve::Rim { radius, z })
                .to_vec()
        }),
        Tool::Box(shape) => of_mesh::sharp_curves(&shape.tessellate()),
        Tool::Mesh(shape) => of_mesh::sharp_curves(&shape.tessellate()),
        Tool::Field(field) => curves_of(field.tool()),
    }
}

#[cfg(test)]
mod tests;

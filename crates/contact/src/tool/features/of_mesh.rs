//! Which edges and corners of a closed triangle surface are sharp.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Curve, SHARP_DEGREES};

/// A triangle at an edge: its unit normal, and its vertex that is not on the edge.
type Side = (DVec3, DVec3);

/// Edges at which the surface bends outward by more than [`SHARP_DEGREES`], their ends, and tips: vertices round which
/// the surface leaves its mean normal by more than that though no edge does. Hollow edges cannot touch first.
pub(super) fn sharp_curves((vertices, triangles): &(Vec<DVec3>, Vec<[u32; 3]>)) -> Vec<Curve> {
    let sharp = SHARP_DEGREES.to_radians().cos();
    let mut sides: BTreeMap<(u32, u32), [Option<Side>; 2]> = BTreeMap::new();
    let mut around: Vec<Vec<DVec3>> = vec![Vec::new(); vertices.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|v| vertices[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let opposite = vertices[corners[(k + 2) % 3] as usize];
            let both = sides.entry((from.min(to), from.max(to))).or_default();
            let free = both.iter_mut().find(|side| side.is_none());
            if let Some(free) = free {
                *free = Some((normal, opposite));
            }
            around[from as usize].push(normal);
        }
    }
    let mut is_corner = vec![false; vertices.len()];
    let mut is_convex_at = vec![false; vertices.len()];
    let mut curves = Vec::new();
    for (&(a, b), both) in &sides {
        let [Some((normal, _)), Some((other_normal, opposite))] = both else {
            continue;
        };
        let (start, end) = (vertices[a as usize], vertices[b as usize]);
        let is_convex = normal.dot(*opposite - start) < 0.0;
        if !is_convex {
            continue;
        }
        let is_sharp = normal.dot(*other_normal) < sharp;
        if is_sharp {
            curves.push(Curve::Edge(start, end));
        }
        for vertex in [a, b] {
            is_convex_at[vertex as usize] = true;
            is_corner[vertex as usize] |= is_sharp;
        }
    }
    for (vertex, normals) in around.iter().enumerate() {
        let mean = normals.iter().sum::<DVec3>().normalize_or_zero();
        let is_tip = is_convex_at[vertex] && normals.iter().any(|n| n.dot(mean) < sharp);
        if is_corner[vertex] || is_tip {
            curves.push(Curve::Corner(vertices[vertex]));
        }
    }
    curves
}

//! Cuts a polygon into triangles without leaving it and without losing a corner.
//!
//! Ears are not enough: clipping them drops corners that lie on a straight line, which the neighbour's edge ends in,
//! and leaves slivers. So concave polygons become a constrained Delaunay triangulation in their best plane.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use spade::handles::{FixedFaceHandle, FixedVertexHandle, PossiblyOuterTag};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// Why a polygon has no triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    NoArea,
    Crosses,
}

/// Triangles of the polygon with these corners, facing as it does. Convex ones are fanned out from the first corner.
pub(super) fn cut(vertices: &[DVec3], corners: &[u32]) -> Result<Vec<[u32; 3]>, Fault> {
    let place = |corner: &u32| vertices[*corner as usize];
    let mut corners = corners.to_vec();
    corners.dedup_by(|a, b| place(a) == place(b));
    while corners.len() > 1 && corners.first().map(place) == corners.last().map(place) {
        corners.pop();
    }
    match corners[..] {
        [] | [_] | [_, _] => return Ok(Vec::new()),
        [a, b, c] => return Ok(vec![[a, b, c]]),
        _ => {}
    }
    let flat = flatten(&corners.iter().map(place).collect::<Vec<_>>()).ok_or(Fault::NoArea)?;
    if is_convex(&flat) {
        let fan = corners[1..]
            .windows(2)
            .map(|pair| [corners[0], pair[0], pair[1]]);
        return Ok(fan.collect());
    }
    delaunay(&corners, &flat)
}

/// The corners in the plane that fits best, its normal upward, their size about 1.
fn flatten(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    /// Of the size squared: a smaller area is round-off.
    const NO_AREA: f64 = 1e-14;
    let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let size = corners
        .iter()
        .map(|corner| (*corner - center).abs().max_element())
        .fold(0.0, f64::max);
    let around = corners.iter().cycle().skip(1);
    let doubled_area: DVec3 = corners
        .iter()
        .zip(around)
        .map(|(a, b)| ((*a - center) / size).cross((*b - center) / size))
        .sum();
    if doubled_area.is_nan() || doubled_area.length() < NO_AREA {
        return None;
    }
    let normal = doubled_area.normalize();
    let (u, v) = normal.any_orthonormal_pair();
    let flat = corners.iter().map(|corner| {
        let from_center = (*corner - center) / size;
        DVec2::new(from_center.dot(u), from_center.dot(v))
    });
    Some(flat.collect())
}

/// Whether every corner turns left by a definite angle and all of them once round.
fn is_convex(flat: &[DVec2]) -> bool {
    /// Sine of the least turn: below it the corner may as well lie on a straight line.
    const STRAIGHT: f64 = 1e-9;
    let n = flat.len();
    let mut turned = 0.0;
    for k in 0..n {
        let before = (flat[(k + 1) % n] - flat[k]).normalize_or_zero();
        let after = (flat[(k + 2) % n] - flat[(k + 1) % n]).normalize_or_zero();
        let sine = before.perp_dot(after);
        if sine < STRAIGHT {
            return false;
        }
        turned += sine.atan2(before.dot(after));
    }
    turned < 1.5 * std::f64::consts::TAU
}

type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;
type Edge = (FixedVertexHandle, FixedVertexHandle);

fn delaunay(corners: &[u32], flat: &[DVec2]) -> Result<Vec<[u32; 3]>, Fault> {
    let mut plane = Plane::new();
    let mut corner_of: BTreeMap<FixedVertexHandle, u32> = BTreeMap::new();
    let mut handles = Vec::with_capacity(flat.len());
    for (&corner, place) in corners.iter().zip(flat) {
        // The library refuses numbers below 1e-43.
        let [x, y] = place
            .to_array()
            .map(|x| if x.abs() < 1e-40 { 0.0 } else { x });
        let handle = plane.insert(Point2::new(x, y)).map_err(|_| Fault::NoArea)?;
        corner_of.entry(handle).or_insert(corner);
        handles.push(handle);
    }
    // A bridge to a hole is walked on both ways: it parts nothing.
    let mut parts: BTreeMap<Edge, bool> = BTreeMap::new();
    for (k, &from) in handles.iter().enumerate() {
        let to = handles[(k + 1) % handles.len()];
        if from == to {
            continue;
        }
        let parts = parts.entry((from.min(to), from.max(to))).or_insert(false);
        *parts = !*parts;
        if !plane.can_add_constraint(from, to) {
            return Err(Fault::Crosses);
        }
        plane.add_constraint(from, to);
    }
    let inside = inner_faces(&plane, &parts);
    let triangles: Vec<[u32; 3]> = plane
        .inner_faces()
        .filter(|face| inside.contains(&face.adjacent_edge().face().fix()))
        .map(|face| face.vertices().map(|vertex| corner_of[&vertex.fix()]))
        .collect();
    // Any polygon of n corners that keeps off itself has n - 2, also with bridges.
    if triangles.len() + 2 == corners.len() {
        Ok(triangles)
    } else {
        Err(Fault::Crosses)
    }
}

/// Faces that are reached from outside over an odd number of edges that part.
fn inner_faces(
    plane: &Plane,
    parts: &BTreeMap<Edge, bool>,
) -> BTreeSet<FixedFaceHandle<PossiblyOuterTag>> {
    let mut around: BTreeMap<FixedFaceHandle<PossiblyOuterTag>, Vec<_>> = BTreeMap::new();
    for edge in plane.directed_edges() {
        let (from, to) = (edge.from().fix(), edge.to().fix());
        let is_part = parts.get(&(from.min(to), from.max(to)));
        let is_parting = is_part.copied().unwrap_or(edge.is_constraint_edge());
        let sides = around.entry(edge.face().fix()).or_default();
        sides.push((edge.rev().face().fix(), is_parting));
    }
    let outer = plane.outer_face().fix();
    let mut seen = BTreeSet::from([outer]);
    let mut inside = BTreeSet::new();
    let mut waiting = vec![outer];
    while let Some(face) = waiting.pop() {
        for &(other, is_parting) in around.get(&face).into_iter().flatten() {
            if seen.insert(other) {
                if inside.contains(&face) != is_parting {
                    inside.insert(other);
                }
                waiting.push(other);
            }
        }
    }
    inside
}

#[cfg(test)]
mod tests;

use std::sync::Arc;

use super::*;
use crate::tool::{BoxShape, Capsule, Cylinder, HalfSpace, Mesh, Sphere};

fn brick() -> Tool {
    Tool::Box(BoxShape::new(DVec3::new(0.3, 0.5, 0.2)).unwrap())
}

fn as_mesh(tool: &Tool) -> Tool {
    let (vertices, triangles) = tool.tessellate(1.0);
    Tool::Mesh(Arc::new(Mesh::new(&vertices, &triangles).unwrap()))
}

fn n_points(tool: &Tool, spacing: f64) -> usize {
    Features::new(tool, spacing)
        .unwrap()
        .map_or(0, |features| features.points().len())
}

#[test]
fn a_box_has_corners_and_edges_and_no_diagonals() {
    // 4 (0.6 + 1.0 + 0.4) = 8 of edges; at 0.1: 4 (5 + 9 + 3) points between 8 corners.
    assert_eq!(n_points(&brick(), 0.1), 8 + 4 * (5 + 9 + 3));
    let features = Features::new(&brick(), 0.1).unwrap().unwrap();
    for &point in features.points() {
        let on_faces = (point.abs() - DVec3::new(0.3, 0.5, 0.2)).abs();
        let n = on_faces.to_array().iter().filter(|x| **x < 1e-12).count();
        assert!(n >= 2, "{point} is on no edge");
    }
    assert_eq!(n_points(&as_mesh(&brick()), 0.1), 8 + 4 * (5 + 9 + 3));
}

#[test]
fn round_tools_have_none() {
    let smooth = [
        Tool::Sphere(Sphere::new(0.4).unwrap()),
        Tool::Cylinder(Cylinder::new(0.3, None).unwrap()),
        Tool::Capsule(Capsule::new(0.2, 0.4).unwrap()),
        Tool::HalfSpace(HalfSpace),
    ];
    for tool in &smooth {
        assert!(Features::new(tool, 0.1).unwrap().is_none(), "{tool:?}");
    }
    // 48 sides bend by 7.5 degrees.
    assert!(Features::new(&as_mesh(&smooth[0]), 0.1).unwrap().is_none());
    assert!(Features::new(&as_mesh(&smooth[2]), 0.1).unwrap().is_none());
}

#[test]
fn a_cylinder_has_its_rims() {
    let tool = Tool::Cylinder(Cylinder::new(0.3, Some(0.5)).unwrap());
    let features = Features::new(&tool, 0.01).unwrap().unwrap();
    for point in features.points() {
        assert!((point.x.hypot(point.y) - 0.3).abs() < 1e-12 && point.z.abs() == 0.5);
    }
    assert_eq!(features.points().len(), 2 * 189);
    assert_eq!(n_points(&as_mesh(&tool), 1.0), 2 * 48);
}

#[test]
fn a_tip_of_many_sides_is_a_corner_though_no_edge_is_sharp() {
    // A cone of 24 sides and 45 degrees: neighbours bend by 10.6 degrees, the tip by 45.
    let ring = |k: usize| {
        let angle = TAU * k as f64 / 24.0;
        DVec3::new(angle.cos(), angle.sin(), 0.0)
    };
    let mut vertices: Vec<DVec3> = (0..24).map(ring).collect();
    vertices.extend([DVec3::Z, DVec3::ZERO]);
    let next = |k: u32| (k + 1) % 24;
    let triangles: Vec<[u32; 3]> = (0..24)
        .flat_map(|k| [[k, next(k), 24], [next(k), k, 25]])
        .collect();
    let tool = Tool::Mesh(Arc::new(Mesh::new(&vertices, &triangles).unwrap()));
    let features = Features::new(&tool, 10.0).unwrap().unwrap();
    assert_eq!(features.points().len(), 24 + 1);
    assert!(
        features
            .points()
            .iter()
            .any(|p| (*p - DVec3::Z).length() < 1e-12)
    );
}

#[test]
fn a_hollow_edge_is_none() {
    // An L: the inner corner's edge bends inward.
    let outline = [
        (0.0, 0.0),
        (2.0, 0.0),
        (2.0, 1.0),
        (1.0, 1.0),
        (1.0, 2.0),
        (0.0, 2.0),
    ];
    let mut vertices = Vec::new();
    for z in [0.0, 1.0] {
        vertices.extend(outline.map(|(x, y)| DVec3::new(x, y, z)));
    }
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for k in 0..6 {
        let (a, b) = (k, (k + 1) % 6);
        triangles.extend([[a, b, b + 6], [a, b + 6, a + 6]]);
    }
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]] {
        triangles.extend([[a, c, b], [a + 6, b + 6, c + 6]]);
    }
    let tool = Tool::Mesh(Arc::new(Mesh::new(&vertices, &triangles).unwrap()));
    let features = Features::new(&tool, 0.26).unwrap().unwrap();
    let inner = DVec3::new(1.0, 1.0, 0.5);
    let near = |p: DVec3| features.points().iter().any(|x| (*x - p).length() < 1e-9);
    assert!(near(DVec3::new(0.0, 0.0, 0.5)) && !near(inner));
}

#[test]
fn queries_are_those_of_brute_force() {
    let features = Features::new(&brick(), 0.03).unwrap().unwrap();
    for k in 0..200 {
        let t = f64::from(k);
        let place = |a: f64| DVec3::new((a * t).sin(), (1.3 * a * t).cos(), (0.7 * a * t).sin());
        let (a, b) = (place(1.1), place(2.9));
        let (min, max) = (a.min(b), a.max(b));
        let mut found = Vec::new();
        features.inside_box(min, max, |point| found.push(point));
        found.sort_unstable();
        let all = features.points().iter().enumerate();
        let expected: Vec<u32> = all
            .filter(|(_, p)| p.cmpge(min).all() && p.cmple(max).all())
            .map(|(k, _)| k as u32)
            .collect();
        assert_eq!(found, expected);
        let distances = features.points().iter().map(|p| (*p - a).length());
        let exact = distances.fold(f64::INFINITY, f64::min);
        let bound = features.distance_bound(a);
        assert!(
            bound <= exact + 1e-12 && bound >= exact / 3.0 - 1e-12,
            "{bound} {exact}"
        );
    }
}

#[test]
fn bad_spacing_is_refused_and_too_many_points_are_not_made() {
    assert!(Features::new(&brick(), 0.0).is_err());
    assert!(Features::new(&brick(), f64::NAN).is_err());
    let features = Features::new(&brick(), 1e-9).unwrap().unwrap();
    assert!(features.points().len() <= MOST_POINTS + 8 && features.spacing() > 1e-9);
}

//! The same questions to every shape.

use glam::{DQuat, DVec3};
use glamx::DPose3;
use proptest::prelude::*;

use super::*;
use crate::error::Error;

fn finite_tools() -> Vec<Tool> {
    let brick = Tool::Box(BoxShape::new(DVec3::new(0.3, 0.5, 0.2)).unwrap());
    let (vertices, triangles) = brick.tessellate(1.0);
    let ball = Tool::Sphere(Sphere::new(0.4).unwrap());
    let (ball_vertices, ball_triangles) = ball.tessellate(1.0);
    vec![
        ball,
        Tool::Cylinder(Cylinder::new(0.3, Some(0.5)).unwrap()),
        brick,
        Tool::Capsule(Capsule::new(0.2, 0.4).unwrap()),
        Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into()),
        Tool::Mesh(Mesh::new(&ball_vertices, &ball_triangles).unwrap().into()),
    ]
}

fn tools() -> Vec<Tool> {
    let mut tools = finite_tools();
    tools.push(Tool::Cylinder(Cylinder::new(0.3, None).unwrap()));
    tools.push(Tool::HalfSpace(HalfSpace));
    tools
}

fn poses() -> Vec<DPose3> {
    vec![
        DPose3::IDENTITY,
        DPose3::from_parts(
            DVec3::new(0.2, -0.1, 0.3),
            DQuat::from_scaled_axis(DVec3::new(0.3, 1.2, -0.7)),
        ),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-1.0..1.0_f64).prop_map(DVec3::from_array)
}

proptest! {
    /// The normal is the gradient of the distance. Central differences of step h err by h² times the curvature's change;
    /// points within h of the medial axis or an edge's fan, where the gradient jumps or bends, show it by one-sided
    /// differences that disagree, and are passed over.
    #[test]
    fn gradient_of_the_distance_is_the_normal(p in point()) {
        let h = 1e-6;
        for tool in tools() {
            for pose in poses() {
                let at = |p| tool.signed_distance(&pose, p).signed_distance;
                let contact = tool.signed_distance(&pose, p);
                prop_assert!((contact.normal.length() - 1.0).abs() < 1e-12);
                for axis in DVec3::AXES {
                    let (ahead, here, behind) = (at(p + h * axis), at(p), at(p - h * axis));
                    let (right, left) = ((ahead - here) / h, (here - behind) / h);
                    if (right - left).abs() < 1e-4 {
                        let slope = (ahead - behind) / (2.0 * h);
                        prop_assert!(
                            (slope - contact.normal.dot(axis)).abs() < 1e-4,
                            "{tool:?} at {p}: slope {slope}, normal {}", contact.normal
                        );
                    }
                }
            }
        }
    }

    /// A step along the normal changes the distance by the step, outside at any length: the distance is exact.
    #[test]
    fn distance_grows_with_the_way_along_the_normal(p in point(), step in 0.0..2.0_f64) {
        for tool in tools() {
            for pose in poses() {
                let contact = tool.signed_distance(&pose, p);
                if contact.signed_distance > 1e-9 {
                    let on_surface = p - contact.signed_distance * contact.normal;
                    let at_surface = tool.signed_distance(&pose, on_surface).signed_distance;
                    prop_assert!(at_surface.abs() < 1e-12, "{tool:?} at {p}: {at_surface}");
                    let further = tool.signed_distance(&pose, p + step * contact.normal);
                    let expected = contact.signed_distance + step;
                    prop_assert!((further.signed_distance - expected).abs() < 1e-12);
                }
            }
        }
    }

    /// Moving tool and point together changes nothing but the normal's direction.
    #[test]
    fn pose_moves_the_answer_with_the_tool(p in point(), turn in point(), shift in point()) {
        let pose = DPose3::from_parts(shift, DQuat::from_scaled_axis(3.0 * turn));
        for tool in tools() {
            let local = tool.signed_distance_local(p);
            let moved = tool.signed_distance(&pose, pose.transform_point(p));
            prop_assert!((local.signed_distance - moved.signed_distance).abs() < 1e-12);
            let normal = pose.transform_vector(local.normal);
            // Near the medial axis round-off chooses the side.
            if local.signed_distance > -0.05 {
                prop_assert!((normal - moved.normal).length() < 1e-9, "{tool:?} at {p}");
            }
        }
    }

    /// Every point inside the tool lies in its box, and the box is tight: each face is touched.
    #[test]
    fn aabb_contains_the_tool_and_touches_it(p in point(), turn in point()) {
        let pose = DPose3::from_parts(p, DQuat::from_scaled_axis(3.0 * turn));
        for tool in finite_tools() {
            let (min, max) = tool.aabb(&pose).unwrap();
            let (vertices, _) = tool.tessellate(1.0);
            let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for vertex in vertices {
                low = low.min(pose.transform_point(vertex));
                high = high.max(pose.transform_point(vertex));
            }
            let round_off = DVec3::splat(1e-12);
            prop_assert!((min - round_off).cmple(low).all() && (max + round_off).cmpge(high).all());
            // Drawn circles are polygons: up to 0.5 % short. The box of a turned mesh is that of its own box.
            if !matches!(tool, Tool::Mesh(_)) {
                let slack = DVec3::splat(0.005);
                prop_assert!((low - min).cmple(slack).all() && (max - high).cmple(slack).all());
            }
        }
    }
}

#[test]
fn signs_and_values_at_known_points() {
    let distance = |tool: &Tool, x: f64, y: f64, z: f64| {
        tool.signed_distance_local(DVec3::new(x, y, z))
            .signed_distance
    };
    let sphere = Tool::Sphere(Sphere::new(2.0).unwrap());
    assert_eq!(distance(&sphere, 0.0, 3.0, 4.0), 3.0);
    assert_eq!(distance(&sphere, 0.0, 0.0, 0.0), -2.0);
    let cylinder = Tool::Cylinder(Cylinder::new(1.0, Some(2.0)).unwrap());
    assert_eq!(distance(&cylinder, 0.0, 4.0, 6.0), 5.0);
    assert_eq!(distance(&cylinder, 0.0, 0.0, 1.5), -0.5);
    assert_eq!(distance(&cylinder, 0.75, 0.0, 0.0), -0.25);
    let infinite = Tool::Cylinder(Cylinder::new(1.0, None).unwrap());
    assert_eq!(distance(&infinite, 0.0, 4.0, 1e9), 3.0);
    let brick = Tool::Box(BoxShape::new(DVec3::new(1.0, 2.0, 3.0)).unwrap());
    assert_eq!(distance(&brick, 4.0, 6.0, 0.0), 5.0);
    assert_eq!(distance(&brick, 0.0, -1.5, 2.75), -0.25);
    let capsule = Tool::Capsule(Capsule::new(1.0, 2.0).unwrap());
    assert_eq!(distance(&capsule, 0.0, 3.0, 6.0), 4.0);
    assert_eq!(distance(&capsule, 0.5, 0.0, -1.0), -0.5);
    let half_space = Tool::HalfSpace(HalfSpace);
    assert_eq!(distance(&half_space, 5.0, 5.0, -0.25), -0.25);
}

/// Centres, axes, middle planes, faces, edges and corners: finite distance, unit normal.
#[test]
fn degenerate_points_give_finite_unit_normals() {
    let values = [
        0.0, -0.0, 0.2, -0.2, 0.3, 0.4, 0.5, -0.5, 0.6, 5e-324, 1e-160, -1e-160, 1e6,
    ];
    for tool in tools() {
        for x in values {
            for y in values {
                for z in values {
                    let p = DVec3::new(x, y, z);
                    for pose in poses() {
                        let contact = tool.signed_distance(&pose, p);
                        assert!(contact.signed_distance.is_finite(), "{tool:?} at {p}");
                        let length = contact.normal.length();
                        assert!(
                            (length - 1.0).abs() < 1e-12,
                            "{tool:?} at {p}: {}",
                            contact.normal
                        );
                    }
                }
            }
        }
    }
}

/// On the surface the normal faces outward: a step along it leaves the tool, a step against it enters.
#[test]
fn surface_points_have_outward_normals() {
    for tool in tools() {
        let (vertices, triangles) = tool.tessellate(0.7);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| vertices[v as usize]);
            for (p, is_face) in [
                (a, false),
                (0.5 * (a + b), false),
                ((a + b + c) / 3.0, true),
            ] {
                let contact = tool.signed_distance_local(p);
                let on_surface = p - contact.signed_distance * contact.normal;
                let contact = tool.signed_distance_local(on_surface);
                assert!(contact.signed_distance.abs() < 1e-12);
                let step = |s: f64| {
                    let p = on_surface + s * contact.normal;
                    tool.signed_distance_local(p).signed_distance
                };
                assert!((step(0.01) - 0.01).abs() < 1e-9, "{tool:?} at {p}");
                // At an edge the way against one face's normal stays in the other face.
                let limit = if is_face { -0.001 } else { 1e-12 };
                assert!(step(-0.01) < limit, "{tool:?} at {p}: {}", step(-0.01));
            }
        }
    }
}

/// Drawn surfaces are closed (each edge used once in either direction), face outward and enclose the right volume.
#[test]
fn tessellations_are_closed_and_face_outward() {
    use std::f64::consts::PI;
    let capsule = PI * 0.04 * 0.8 + 4.0 / 3.0 * PI * 0.008;
    let volumes = [4.0 / 3.0 * PI * 0.064, PI * 0.09, 0.24, capsule];
    for (tool, volume) in finite_tools().iter().zip(volumes) {
        let (vertices, triangles) = tool.tessellate(1.0);
        let mut edges = std::collections::BTreeSet::new();
        let mut sum = 0.0;
        for t in &triangles {
            for k in 0..3 {
                assert!(edges.insert((t[k], t[(k + 1) % 3])));
            }
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            sum += a.dot(b.cross(c)) / 6.0;
        }
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
        assert!(
            (sum / volume - 1.0).abs() < 0.01,
            "{tool:?}: {sum} and {volume}"
        );
    }
    let (vertices, _) = Tool::Cylinder(Cylinder::new(0.3, None).unwrap()).tessellate(2.5);
    assert!(vertices.iter().all(|v| v.z.abs() == 2.5));
}

#[test]
fn infinite_tools_say_so() {
    let [straight, turned] = [poses()[0], poses()[1]];
    assert_eq!(Tool::HalfSpace(HalfSpace).aabb(&straight), None);
    let cylinder = Tool::Cylinder(Cylinder::new(0.3, None).unwrap());
    let (min, max) = cylinder.aabb(&straight).unwrap();
    assert_eq!((min.z, max.z), (f64::NEG_INFINITY, f64::INFINITY));
    assert_eq!((min.x, max.y), (-0.3, 0.3));
    let (min, max) = cylinder.aabb(&turned).unwrap();
    assert!(!min.is_nan() && !max.is_nan());
    assert_eq!(
        Tool::HalfSpace(HalfSpace).characteristic_size(),
        f64::INFINITY
    );
    assert_eq!(cylinder.characteristic_size(), 0.3);
}

#[test]
fn sizes_must_be_positive_and_finite() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Sphere::new(bad), Err(Error::NotPositive { .. })));
        assert!(Cylinder::new(bad, None).is_err());
        assert!(Cylinder::new(1.0, Some(bad)).is_err());
        assert!(Capsule::new(bad, 1.0).is_err());
        assert!(Capsule::new(1.0, bad).is_err());
        assert!(BoxShape::new(DVec3::new(1.0, bad, 1.0)).is_err());
    }
    let text = Sphere::new(-1.0).unwrap_err().to_string();
    assert_eq!(text, "sphere radius is -1, it must be finite and above 0");
}

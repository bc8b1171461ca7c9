use super::*;
use crate::tool::{Cylinder, HalfSpace, Sphere};

fn tube(radius: f64) -> Tool {
    Tool::Cylinder(Cylinder::new(radius, None).unwrap())
}

/// Along x, with its middle node a little lower.
const ARC: [DVec3; 3] = [
    DVec3::new(-1.0, 0.0, 0.0),
    DVec3::new(1.0, 0.0, 0.0),
    DVec3::new(0.0, 0.0, -0.02),
];

fn edge(nodes: &[DVec3]) -> Edge<'_> {
    let order = match nodes.len() {
        2 => FaceOrder::Linear,
        3 => FaceOrder::Quadratic,
        _ => FaceOrder::Cubic,
    };
    Edge { order, nodes }
}

#[test]
fn shapes_of_edges_are_those_of_faces_along_their_border() {
    for (order, nodes) in [
        (FaceOrder::Linear, &[0, 1][..]),
        (FaceOrder::Quadratic, &[0, 1, 3]),
        (FaceOrder::Cubic, &[0, 1, 3, 4]),
    ] {
        for t in [0.0, 0.17, 0.5, 0.83, 1.0] {
            let (of_face, by_l) = order.shape([1.0 - t, t, 0.0]);
            let (values, slopes) = edge_shape(order, t);
            for (k, node) in nodes.iter().enumerate() {
                assert!((values[k] - of_face[*node]).abs() < 1e-14);
                let slope = by_l[*node][1] - by_l[*node][0];
                assert!((slopes[k] - slope).abs() < 1e-13, "{order:?} {t} {k}");
            }
        }
    }
}

/// A tube across an arc touches it where its axis is above, whatever the ends did.
#[test]
fn a_minimum_across_the_tool_is_found_to_round_off() {
    let tool = tube(3.0);
    // The axis along y.
    let turn = glam::DQuat::from_rotation_arc(DVec3::Z, DVec3::Y);
    for x in [-0.7, -0.2, 0.0, 0.31, 0.9] {
        let pose = DPose3::from_parts(DVec3::new(x, 0.0, 3.0), turn);
        let mut arc = ARC;
        arc[0].z += 0.01;
        arc[1].z -= 0.03;
        let edge = edge(&arc);
        let minima = edge.minima(&tool, &pose, 1.0, 1.0, 1e-4);
        let [t] = minima.at() else {
            panic!("{minima:?}");
        };
        let (_, slope, _) = edge.seen(&tool, &pose, *t);
        assert!(slope.abs() < 1e-6, "{x}: {slope}");
        let least = (0..=1000)
            .map(|k| edge.seen(&tool, &pose, f64::from(k) / 1000.0).0)
            .fold(f64::INFINITY, f64::min);
        assert!(minima.least <= least + 1e-12);
    }
}

#[test]
fn ends_are_minima_where_the_distance_falls_towards_them_and_far_edges_have_none() {
    let tool = Tool::Sphere(Sphere::new(1.0).unwrap());
    let pose = DPose3::from_translation(DVec3::new(4.0, 0.0, 1.0));
    let at = |far: f64| edge(&ARC).minima(&tool, &pose, far, 1.0, 1e-4);
    assert_eq!(at(10.0).at(), [1.0]);
    assert_eq!(at(0.1).at(), [0.0; 0]);
    assert!(at(0.1).least > 2.0);
    // A tool in a valley between two ends: both are nearest.
    let pose = DPose3::from_translation(DVec3::new(0.0, 0.0, -50.0));
    let big = Tool::Sphere(Sphere::new(49.0).unwrap());
    let flat = [ARC[0], ARC[1]].map(|x| x - DVec3::new(0.0, 0.0, 0.1));
    let minima = edge(&flat).minima(&big, &pose, 10.0, 1.0, 1e-9);
    assert_eq!(minima.at().len(), 1);
}

#[test]
fn an_edge_along_the_tool_has_no_minimum_of_its_own() {
    let along = DPose3::from_parts(
        DVec3::new(0.0, 0.0, 3.0),
        glam::DQuat::from_rotation_arc(DVec3::Z, DVec3::X),
    );
    let straight = [ARC[0], ARC[1], DVec3::ZERO];
    let minima = edge(&straight).minima(&tube(3.0), &along, 1.0, 1.0, 1e-3);
    assert!(minima.is_along && minima.at().is_empty());
    let plane = Tool::HalfSpace(HalfSpace);
    let minima = edge(&straight).minima(&plane, &DPose3::IDENTITY, 1.0, 1.0, 1e-3);
    assert!(minima.is_along && minima.at().is_empty());
}

#[test]
fn a_ball_over_a_face_is_nearest_inside_it_and_a_tube_nowhere() {
    let rest = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        DVec3::new(0.5, 0.0, 0.01),
        DVec3::new(0.5, 0.5, 0.02),
        DVec3::new(0.0, 0.5, 0.01),
    ];
    let face = UndentedFace {
        order: FaceOrder::Quadratic,
        rest: &rest,
        vertices: [DVec3::ZERO, DVec3::new(0.0, 0.0, 0.05), DVec3::ZERO],
    };
    let ball = Tool::Sphere(Sphere::new(2.0).unwrap());
    let pose = DPose3::from_translation(DVec3::new(0.3, 0.25, 2.1));
    let (l, distance) = face.minimum(&ball, &pose, 1e-4).unwrap();
    let (_, slope) = face.slope(&ball, &pose, [l[1], l[2]]);
    assert!(slope[0].abs() + slope[1].abs() < 1e-6, "{slope:?}");
    assert!(distance < face.middle_distance(&ball, &pose));
    // Beside the face the edge has it.
    let aside = DPose3::from_translation(DVec3::new(-0.4, 0.25, 2.1));
    assert_eq!(face.minimum(&ball, &aside, 1e-4), None);
    let turn = glam::DQuat::from_rotation_arc(DVec3::Z, DVec3::X);
    let over = DPose3::from_parts(DVec3::new(0.0, 0.3, 2.1), turn);
    let flat = UndentedFace {
        vertices: [DVec3::ZERO; 3],
        rest: &rest.map(|x| DVec3::new(x.x, x.y, 0.0)),
        ..face
    };
    assert_eq!(flat.minimum(&tube(2.0), &over, 1e-4), None);
}

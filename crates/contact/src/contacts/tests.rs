use glam::DQuat;

use super::*;
use crate::face::Face;
use crate::surface::{FaceData, Surface};
use crate::tool::Sphere;

fn ball() -> (Tool, DPose3) {
    let pose = DPose3::from_parts(
        DVec3::new(0.3, -0.2, 0.1),
        DQuat::from_scaled_axis(DVec3::new(0.1, 0.2, -0.3)),
    );
    (Tool::Sphere(Sphere::new(2.0).unwrap()), pose)
}

/// A curved quadratic face; node 5 is held, so candidates are 0 to 4.
fn nodes() -> [DVec3; 6] {
    [
        DVec3::new(0.0, 0.0, 0.1),
        DVec3::new(1.0, 0.1, 0.0),
        DVec3::new(0.1, 0.9, 0.0),
        DVec3::new(0.5, 0.0, 0.12),
        DVec3::new(0.6, 0.5, 0.05),
        DVec3::new(0.0, 0.45, 0.12),
    ]
}

fn surface(n_held: usize) -> Surface {
    let places = nodes();
    let (rest, held) = places.split_at(6 - n_held);
    let data = FaceData {
        nodes: (0..6).collect(),
        height: 1.0,
    };
    Surface::new(rest, held.to_vec(), &[data]).unwrap()
}

/// A point of a tool that does not turn, at a face.
fn at_face(surface: &Surface, nodes: &[DVec3; 6], p: DVec3) -> (Place, Contact) {
    let nearest = Face::new(surface.order(), nodes).nearest(p);
    let place = surface.place(0, 7, &nearest, p, |_| DVec3::ZERO);
    let (tool, _) = ball();
    let contact = place.contact(0, &tool, &DPose3::IDENTITY, nearest.position);
    (place, contact)
}

#[test]
fn a_node_of_one_share_predicts_gaps_to_second_order() {
    let (tool, pose) = ball();
    let node = DVec3::new(1.5, 1.2, 0.9);
    let place = Place::node(5, node);
    assert_eq!(place.as_node(), Some(5));
    assert_eq!(Place::new(5, node, [(5, 0.5)]).as_node(), None);
    let contact = place.contact(3, &tool, &pose, node);
    assert!(contact.place == 3 && contact.is_sound());
    let error = |step: f64| {
        let moved = step * DVec3::new(0.3, -1.0, 0.7);
        let exact = tool.signed_distance(&pose, node + moved).signed_distance;
        (contact.gap + contact.normal.dot(moved) - exact).abs()
    };
    // Halving the step quarters the error: the plane is the tangent.
    let ratio = error(1e-3) / error(5e-4);
    assert!((ratio - 4.0).abs() < 0.05, "{ratio}");
    let nowhere = place.contact(0, &tool, &pose, DVec3::NAN);
    assert!(!nowhere.is_sound());
}

#[test]
fn the_tools_row_is_the_rate_of_the_gap_under_its_motion() {
    let (tool, pose) = ball();
    let reference = DVec3::new(-1.0, 0.4, 2.0);
    let node = DVec3::new(1.5, 1.2, 0.9);
    let of_surface = Place::node(0, node);
    let local = pose.inverse_transform_point(DVec3::new(0.7, 0.5, 1.4));
    let normal = DVec3::new(0.6, 0.0, -0.8);
    for place in [
        of_surface,
        of_surface.seen_by(Witness::Point { local, normal }),
    ] {
        let row = place.contact(0, &tool, &pose, node).tool_row(reference);
        let step = 1e-6;
        for k in 0..6 {
            let gap_after = |step: f64| {
                let mut twist = [0.0; 6];
                twist[k] = step;
                let turn = DQuat::from_scaled_axis(DVec3::from_slice(&twist[3..]));
                let shift = DVec3::from_slice(&twist[..3]);
                let at = reference + turn * (pose.translation - reference) + shift;
                let moved = DPose3::from_parts(at, turn * pose.rotation);
                place.contact(0, &tool, &moved, node).gap
            };
            let rate = (gap_after(step) - gap_after(-step)) / (2.0 * step);
            assert!((rate + row[k]).abs() < 1e-8, "{k}: {rate} and {}", row[k]);
        }
    }
}

#[test]
fn the_gap_of_a_point_at_a_face_follows_the_nodes_by_their_shares() {
    let surface = surface(0);
    let p = DVec3::new(0.35, 0.3, 0.2);
    let (place, contact) = at_face(&surface, &nodes(), p);
    assert!(contact.gap > 0.0 && contact.normal.z < 0.0);
    let step = 1e-6;
    for axis in DVec3::AXES {
        for &(node, weight) in place.shares() {
            let gap = |sign: f64| {
                let mut moved = nodes();
                moved[node as usize] += sign * step * axis;
                at_face(&surface, &moved, p).1.gap
            };
            let rate = (gap(1.0) - gap(-1.0)) / (2.0 * step);
            assert!((rate - weight * contact.normal.dot(axis)).abs() < 1e-8);
        }
    }
}

#[test]
fn forces_on_the_nodes_are_the_force_at_the_point() {
    // A plane quadratic face: its map keeps moments.
    let flat = nodes().map(|x| DVec3::new(x.x, x.y, 0.3 * x.x - 0.2 * x.y));
    let surface = surface(0);
    let (place, contact) = at_face(&surface, &flat, DVec3::new(0.3, 0.3, 0.2));
    let force = 3.0 * contact.normal;
    let (mut sum, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    for &(node, weight) in place.shares() {
        sum += weight * force;
        moment += flat[node as usize].cross(weight * force);
    }
    assert!((sum - force).length() < 1e-14);
    // Along the normal through the tool's point.
    assert!((moment - contact.point.cross(force)).length() < 1e-14);
    let (on_tool, torque) = wrench_on_tool(&[contact], &[3.0 * contact.normal], DVec3::ZERO);
    assert!((on_tool + sum).length() < 1e-14 && (torque + moment).length() < 1e-14);
    assert!(place.shares().iter().any(|(_, weight)| *weight < 0.0));
}

#[test]
fn held_nodes_have_no_share_and_blocks_are_weighted_sums() {
    struct Blocks;
    impl ComplianceBlocks for Blocks {
        fn block(&self, row: usize, col: usize) -> DMat3 {
            let k = (row * 7 + col * 3) as f64;
            DMat3::from_cols_array(&std::array::from_fn(|c| (k + c as f64).sin()))
        }
    }
    let surface = surface(1);
    let (a, _) = at_face(&surface, &nodes(), DVec3::new(0.3, 0.3, 0.1));
    let (b, _) = at_face(&surface, &nodes(), DVec3::new(0.6, 0.2, 0.1));
    assert!(a.shares().iter().all(|(node, _)| *node < 5));
    let force = DVec3::new(0.2, -0.4, 1.0);
    let by_nodes = a.displacement(|i| {
        let of = b
            .shares()
            .iter()
            .map(|(j, w)| Blocks.block(i as usize, *j as usize) * (*w * force));
        of.sum()
    });
    assert!((a.block(&b, &Blocks) * force - by_nodes).length() < 1e-14);
}

#[test]
fn the_wrench_on_the_tool_is_minus_the_rows_times_the_forces() {
    let contact = |x: f64| Contact {
        place: 0,
        gap: 0.0,
        normal: DVec3::new(0.6, 0.0, 0.8),
        point: DVec3::new(x, 2.0, 3.0),
    };
    let contacts = [contact(1.0), contact(-4.0)];
    let reference = DVec3::new(0.5, 0.5, 0.5);
    let forces = [2.0 * contacts[0].normal, 3.0 * contacts[1].normal];
    let (force, torque) = wrench_on_tool(&contacts, &forces, reference);
    for k in 0..3 {
        let rows = contacts.map(|p| p.tool_row(reference));
        assert_eq!(force[k], -(2.0 * rows[0][k] + 3.0 * rows[1][k]));
        let expected = -(2.0 * rows[0][k + 3] + 3.0 * rows[1][k + 3]);
        assert!((torque[k] - expected).abs() < 1e-14);
    }
}

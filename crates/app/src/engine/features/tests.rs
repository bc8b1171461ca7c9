use std::sync::Arc;

use contact::delassus::ComplianceBlocks;
use contact::lcp;
use contact::surface::FaceData;
use contact::tool::{BoxShape, Tool};
use glam::{DQuat, DVec3};
use glamx::DPose3;

use super::super::{ContactIterations, ContactPart, Engine, EngineSettings, Plan};
use super::*;

const SIDE: usize = 9;

/// A grid of nodes 1 mm apart in z = 0, on springs that pull at their neighbours, and its triangles, facing up.
fn plate() -> (Arc<ContactPart>, Surface) {
    let rest: Vec<DVec3> = (0..SIDE * SIDE)
        .map(|k| 1e-3 * DVec3::new((k % SIDE) as f64, (k / SIDE) as f64, 0.0))
        .collect();
    let n = rest.len();
    let mut blocks = vec![0.0; 9 * n * n];
    for j in 0..n {
        for i in 0..n {
            // Positive definite: the covariance of an exponential.
            let share = (-(rest[i] - rest[j]).length() / 1.5e-3).exp();
            for c in 0..3 {
                blocks[9 * (j * n + i) + 4 * c] = 1e-4 * share;
            }
        }
    }
    let mut faces = Vec::new();
    for k in 0..(SIDE - 1) * (SIDE - 1) {
        let a = (k % (SIDE - 1) + SIDE * (k / (SIDE - 1))) as u32;
        let (b, c, d) = (a + 1, a + SIDE as u32, a + SIDE as u32 + 1);
        for nodes in [vec![a, b, d], vec![a, d, c]] {
            faces.push(FaceData {
                nodes,
                height: 1e-3,
            });
        }
    }
    let surface = Surface::new(&rest, Vec::new(), &faces).unwrap();
    (Arc::new(ContactPart::new(rest, n, blocks)), surface)
}

fn settings(max_contacts: usize) -> EngineSettings {
    EngineSettings {
        contact_iterations: ContactIterations::Converged,
        displacement_tolerance: 1e-12,
        near_distance: 2e-5,
        max_contacts,
        merge_tolerance: 0.05,
        lcp: lcp::Settings::default(),
        max_stride: f64::INFINITY,
    }
}

fn brick(half: DVec3) -> Tool {
    Tool::Box(BoxShape::new(half).unwrap())
}

/// An engine with the edges of a box, and one without.
fn engines_of(tool: &Tool, edges: &Tool, max_contacts: usize) -> [Engine; 2] {
    let (part, surface) = plate();
    let features = Features::new(edges, 3e-4).unwrap().unwrap();
    let plain = Plan::new(part, tool.clone(), None, settings(max_contacts));
    let with = Plan {
        features: Some((Arc::new(surface), features)),
        ..plain.clone()
    };
    [with, plain].map(|plan| Engine::new(plan).unwrap())
}

fn engines(tool: &Tool, max_contacts: usize) -> [Engine; 2] {
    engines_of(tool, tool, max_contacts)
}

/// Lets the tool down to a pose in small steps.
fn press(engine: &mut Engine, at: DPose3, depth: f64) -> super::super::StepReport {
    let mut report = None;
    for k in 0..=20 {
        let mut pose = at;
        pose.translation.z -= depth * (f64::from(k) / 10.0 - 1.0);
        report = Some(engine.step(&pose));
    }
    report.unwrap()
}

/// Points of the box's bottom on lines of nodes that are all held back add rows that say nothing new: the operator is
/// singular, and the wrench the same.
#[test]
fn rows_that_follow_from_nodes_change_nothing() {
    let tool = brick(DVec3::new(2.5e-3, 2.5e-3, 1e-3));
    let lines = brick(DVec3::new(2e-3, 2e-3, 1e-3));
    let at = DPose3::from_translation(DVec3::new(4e-3, 4e-3, 1e-3));
    let [mut with, mut without] = engines_of(&tool, &lines, 1000);
    let depth = 1e-5;
    let reports = [press(&mut with, at, depth), press(&mut without, at, depth)];
    let [ours, plain] = reports.map(|r| r.contact_wrench_on_tool);
    assert!(
        reports[0].near > reports[1].near + 20,
        "there are no more rows"
    );
    assert!(reports.iter().all(|r| r.lcp_solved && r.converged));
    assert!(plain[2] > 0.1, "{plain:?}");
    // Positions stand still to 1e-12 m; over faces of 1 mm that is some 1e-9 in the direction of a normal.
    for c in 0..6 {
        let scale = if c < 3 { plain[2] } else { plain[2] * 1e-3 };
        let difference = (ours[c] - plain[c]).abs();
        assert!(difference < 1e-8 * scale, "{c}: {ours:?} {plain:?}");
    }
    let pressed = (ours[2] - plain[2]).abs();
    assert!(pressed < 1e-9 * plain[2], "{ours:?} {plain:?}");
}

/// Against the scalar formula: depth over the compliance at the point, made of the three nodes' by hand.
#[test]
fn a_corner_in_the_middle_of_a_face_is_felt_and_not_by_nodes_alone() {
    let half = 4e-4;
    let tool = brick(DVec3::splat(half));
    // A corner straight down.
    let turn = DQuat::from_rotation_arc(DVec3::splat(-1.0).normalize(), DVec3::NEG_Z);
    // In the face of nodes (3, 3), (4, 3) and (4, 4).
    let weights = [0.3, 0.3, 0.4];
    let nodes = [3 * SIDE + 3, 3 * SIDE + 4, 4 * SIDE + 4];
    let [mut with, mut without] = engines(&tool, 1000);
    let rest = with.part().rest_positions().to_vec();
    let p: DVec3 = nodes.iter().zip(weights).map(|(n, w)| w * rest[*n]).sum();
    let at = DPose3::from_parts(p + DVec3::Z * 3f64.sqrt() * half, turn);
    let depth = 1e-5;
    let reports = [press(&mut with, at, depth), press(&mut without, at, depth)];
    assert_eq!(reports.map(|r| r.contacts), [1, 0]);
    let mut compliance = 0.0;
    for (i, wi) in nodes.iter().zip(weights) {
        for (j, wj) in nodes.iter().zip(weights) {
            compliance += wi * wj * with.part().block(*i, *j).z_axis.z;
        }
    }
    let force = reports[0].contact_force_on_tool();
    // The face turns by its unequal nodes: some thousandths of a radian, and its normal with it.
    let expected = depth / compliance;
    assert!(
        (force.z / expected - 1.0).abs() < 1e-4,
        "{force} {expected}"
    );
    // Nodes feel its resultant and moment, and each is there once.
    let (mut sum, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    let active = with.active_contacts().to_vec();
    assert_eq!(active.len(), 3);
    for contact in &active {
        let i = contact.candidate as usize;
        let x = rest[i] + with.displacement(i);
        sum += contact.force_on_part;
        moment += (x - reports[0].tool_pose.translation).cross(contact.force_on_part);
    }
    let w = reports[0].contact_wrench_on_tool;
    assert!((sum + force).length() < 1e-12 * force.length());
    let torque = DVec3::from_slice(&w[3..]);
    assert!((moment + torque).length() < 1e-9 * force.length() * half);
    let total: f64 = active.iter().map(|c| c.normal_force).sum();
    assert!((total - force.length()).abs() < 1e-12 * total);
}

/// An edge along y between two rows of nodes: no point of it is left inside the part, and the part does not pull.
#[test]
fn a_blade_between_rows_of_nodes_does_not_pass() {
    let half = DVec3::new(3e-4, 2.2e-3, 3e-4);
    let tool = brick(half);
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
    let at = DPose3::from_parts(DVec3::new(4.45e-3, 4e-3, 2f64.sqrt() * 3e-4), turn);
    let [mut with, mut without] = engines(&tool, 1000);
    let depth = 1e-5;
    let report = press(&mut with, at, depth);
    assert_eq!(press(&mut without, at, depth).contacts, 0);
    assert!(
        report.converged && report.lcp_solved && report.contacts >= 4,
        "{report:?}"
    );
    let n_candidates = with.part().n_candidates();
    let now: Vec<DVec3> = (0..n_candidates)
        .map(|i| with.part().rest_positions()[i] + with.displacement(i))
        .collect();
    let (_, surface) = plate();
    let mut least = f64::INFINITY;
    for k in 0..=40 {
        let y = -half.y + f64::from(k) / 40.0 * 2.0 * half.y;
        let on_edge = report
            .tool_pose
            .transform_point(DVec3::new(half.x, y, -half.z));
        for face in 0..surface.n_faces() {
            let nodes = surface.nodes_of(face);
            let corners: [DVec3; 3] = std::array::from_fn(|v| now[nodes[v] as usize]);
            // Height above the triangle where it is above or below it at all.
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            let area = normal.length_squared();
            let l = [(b, c), (c, a), (a, b)]
                .map(|(s, t)| (s - on_edge).cross(t - on_edge).dot(normal) / area);
            if l.iter().all(|l| *l >= 0.0) {
                least = least.min((on_edge - a).dot(normal) / area.sqrt());
            }
        }
    }
    // Samples at 0.3 mm: between them the part may bulge by a share of the depth.
    assert!(least < 1e-9 && least > -0.02 * depth, "{least}");
    for contact in with.active_contacts() {
        assert!(contact.force_on_part.z < 0.0);
    }
}

#[test]
fn rows_beyond_the_room_are_counted_and_the_deepest_kept() {
    let tool = brick(DVec3::new(2.3e-3, 2.3e-3, 1e-3));
    let at = DPose3::from_translation(DVec3::new(4e-3, 4e-3, 1e-3));
    let [mut with, _] = engines(&tool, 3);
    let report = press(&mut with, at, 1e-5);
    let most = with.places.capacity() as u32;
    assert!(report.dropped > 0 && report.near <= most);
    assert!(report.contact_force_on_tool().z > 0.1);
}

#[test]
fn lifting_off_and_reset_leave_nothing() {
    let tool = brick(DVec3::splat(4e-4));
    let turn = DQuat::from_rotation_arc(DVec3::splat(-1.0).normalize(), DVec3::NEG_Z);
    let height = |h: f64| DPose3::from_parts(DVec3::new(3.6e-3, 3.4e-3, h), turn);
    let [mut with, _] = engines(&tool, 100);
    let touch = 3f64.sqrt() * 4e-4;
    let first = with.step(&height(touch - 1e-5));
    assert_eq!(first.contacts, 1);
    assert_eq!(with.step(&height(touch + 1e-3)).contacts, 0);
    assert!(with.active_contacts().is_empty());
    let again = with.step(&height(touch - 1e-5));
    with.reset();
    let anew = with.step(&height(touch - 1e-5));
    let bits = |r: super::super::StepReport| r.contact_wrench_on_tool.map(f64::to_bits);
    assert_eq!(bits(first), bits(anew));
    assert!((again.contact_wrench_on_tool[2] / first.contact_wrench_on_tool[2] - 1.0).abs() < 1e-6);
    // Without a part's motion beyond its depth no jump goes through it.
    let jump = with.step(&height(touch - 4e-4));
    assert!(
        jump.strides > 1 && jump.contact_force_on_tool().z > 30.0 * first.contact_force_on_tool().z
    );
}

//! Corners and edges of the tool between the nodes of a part, in whole scenes.

use contact::tool::{BoxShape, Cylinder, Tool};
use fem::{FactoredStiffness, Silent};
use glam::{DQuat, DVec3};
use glamx::DPose3;
use snapin::prepare::assemble;
use snapin::scene::ToolFeatures;
use snapin::setup;
use snapin_tests::{root, shipped, snapin};

/// N of a triangle with 6 nodes.
fn tri6([a, b, c]: [f64; 3]) -> [f64; 6] {
    [
        a * (2.0 * a - 1.0),
        b * (2.0 * b - 1.0),
        c * (2.0 * c - 1.0),
        4.0 * a * b,
        4.0 * b * c,
        4.0 * c * a,
    ]
}

/// A corner is pressed 0.2 µm into the flat arm between the nodes of one face.
///
/// Expected: depth over compliance, f = d / (c_part + c_tool), c_part from a solve of the whole part under the forces
/// N_a n on the face's nodes, c_tool that of the coupling. The force is that to the turn of the face, some d / size.
#[test]
fn a_corner_in_a_quadratic_face_is_felt_as_by_a_full_solve() {
    let (mut scene, prepared) = shipped("edge.toml");
    let mesh = &prepared.loaded.mesh;
    let place = |node: u32| DVec3::from_array(mesh.nodes[node as usize]);
    let l = [0.42, 0.25, 0.33];
    let group = mesh.group("contact").unwrap();
    // The flat of the arm behind the catch, away from its borders.
    let on_arm = |n: &u32| place(*n).y.abs() < 1e-9 && place(*n).x > 0.0145 && place(*n).x < 0.0195;
    let face = group
        .faces
        .iter()
        .find(|face| face.nodes.iter().all(on_arm))
        .unwrap();
    let weights = tri6(l);
    let p: DVec3 = face
        .nodes
        .iter()
        .zip(weights)
        .map(|(n, w)| w * place(*n))
        .sum();
    let nearest_node = face.nodes.iter().map(|n| (place(*n) - p).length());
    assert!(nearest_node.fold(f64::INFINITY, f64::min) > 1e-4);

    let stiffness = assemble(&prepared.loaded).unwrap();
    let factor = FactoredStiffness::new(&stiffness, &prepared.loaded.supports, &Silent).unwrap();
    let mut force = vec![0.0; 3 * mesh.n_nodes()];
    for (node, weight) in face.nodes.iter().zip(weights) {
        force[3 * *node as usize + 1] -= weight;
    }
    let u = factor.solve(&force);
    let part: f64 = face
        .nodes
        .iter()
        .zip(weights)
        .map(|(node, weight)| -weight * u[3 * *node as usize + 1])
        .sum();

    let half = 2e-4;
    let tool = Tool::Box(BoxShape::new(DVec3::splat(half)).unwrap());
    let depth = 2e-7;
    let turn = DQuat::from_rotation_arc(DVec3::splat(-1.0).normalize(), DVec3::NEG_Y);
    let at = |depth: f64| {
        let above = 3f64.sqrt() * half - depth;
        DPose3::from_parts(p + above * DVec3::Y, turn)
    };
    // The corner is under the tool's origin: the coupling does not turn.
    let coupling = 1.0 / scene.coupling.translational_stiffness;
    let expected = depth / (part + coupling);
    let mut felt = |choice| {
        scene.accuracy.tool_features = choice;
        let mut engine = setup::engine(&scene, &prepared, tool.clone()).unwrap();
        engine.step(&at(-1e-6));
        let report = engine.step(&at(depth));
        assert!(report.converged && report.lcp_solved);
        (report.contacts, report.contact_force_on_tool())
    };
    let (contacts, force) = felt(ToolFeatures::Auto);
    assert_eq!(contacts, 1);
    assert!(
        (force.y / expected - 1.0).abs() < 1e-3,
        "{force} and {expected} N"
    );
    assert!(force.x.hypot(force.z) < 1e-3 * force.y);
    assert_eq!(felt(ToolFeatures::Off).0, 0);
}

/// A tool without corners and edges pays for none: the engine is the same as without them.
#[test]
fn round_tools_have_an_engine_without_edges() {
    for name in ["hook.toml", "clip.toml"] {
        let (mut scene, prepared) = shipped(name);
        let (tool, _) = setup::tool(&scene).unwrap();
        let mut run = |choice| {
            scene.accuracy.tool_features = choice;
            let mut engine = setup::engine(&scene, &prepared, tool.clone()).unwrap();
            let start = scene.tool.pose_part_tool;
            let mut bits = Vec::new();
            for k in 0..150 {
                let way = scene.drive.travel * f64::from(k) / 150.0;
                let translation = start.translation + way * scene.drive.direction;
                let report = engine.step(&DPose3 {
                    translation,
                    ..start
                });
                bits.extend(report.contact_wrench_on_tool.map(f64::to_bits));
            }
            bits
        };
        assert_eq!(run(ToolFeatures::Auto), run(ToolFeatures::Off), "{name}");
    }
}

/// Without friction a corner on a ramp of 30 degrees feels a force across the ramp, turned by the slope of the bent arm
/// (3/2 of deflection over length: 4.3 degrees at the crest), that grows without a step from node to node. By nodes
/// alone it is one node after the other, each pushed by whichever side of the box is nearest.
#[test]
fn the_corner_of_the_shipped_scene_feels_the_ramp_and_not_its_nodes() {
    let (mut scene, prepared) = shipped("edge.toml");
    let (tool, _) = setup::tool(&scene).unwrap();
    let ramp = DVec3::new(30f64.to_radians().sin(), 30f64.to_radians().cos(), 0.0);
    let mut climb = |choice| {
        scene.accuracy.tool_features = choice;
        let mut engine = setup::engine(&scene, &prepared, tool.clone()).unwrap();
        let start = scene.tool.pose_part_tool;
        let (mut before, mut drop, mut angle) = (0.0_f64, 0.0_f64, 0.0_f64);
        // From the foot of the ramp at 2.2 mm to just below its crest.
        for k in 0..380 {
            let way = 1e-5 * f64::from(k);
            let translation = start.translation + way * scene.drive.direction;
            let report = engine.step(&DPose3 {
                translation,
                ..start
            });
            assert!(
                report.lcp_solved && report.converged && report.dropped == 0,
                "{choice:?} {k} {report:?}"
            );
            let force = report.contact_force_on_tool();
            if force.length() > 0.01 {
                angle = angle.max(force.angle_between(ramp).to_degrees());
            }
            drop = drop.max(before - force.length());
            before = force.length();
        }
        (before, drop, angle)
    };
    let (force, drop, angle) = climb(ToolFeatures::Auto);
    assert!(
        force > 1.0 && drop == 0.0 && angle < 5.0,
        "{force} N, {drop} N, {angle} degrees"
    );
    let (_, drop, angle) = climb(ToolFeatures::Off);
    assert!(drop > 0.5 && angle > 20.0, "{drop} N, {angle} degrees");
}

#[test]
fn features_that_are_not_there_are_an_error_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let hook = std::fs::read_to_string(root().join("scenes/hook.toml")).unwrap();
    let mesh = root().join("scenes/hook.msh").canonicalize().unwrap();
    let hook = hook.replace("\"hook.msh\"", &format!("{:?}", mesh.to_str().unwrap()));
    let with = |keys: &str| {
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, format!("{hook}\n[accuracy]\n{keys}\n")).unwrap();
        let line = hook.lines().count() + 3;
        let outcome = snapin(&["run", path.to_str().unwrap(), "--no-cache"]);
        assert_eq!(outcome.code, 2, "{} {}", outcome.out, outcome.err);
        (outcome.err, line)
    };
    let (error, line) = with("tool_features = \"on\"");
    let wanted = format!(
        "scene.toml:{line}: accuracy.tool_features is \"on\", but the tool has neither corners nor sharp edges; \
         use \"auto\" or leave the key out"
    );
    assert!(error.contains(&wanted), "{error}");
}

/// A corner, a blade across the whole width, a box with its flat side on the ramp and the rim of a cylinder go all the way
/// over the hook: each step comes to a stand, also where points slide over the catch's edge and from face to face, and the
/// force steps less than with nodes alone.
#[test]
fn sharp_tools_go_over_the_hook_and_every_step_settles() {
    let (mut scene, prepared) = shipped("edge.toml");
    let brick = |half: DVec3| Tool::Box(BoxShape::new(half).unwrap());
    let rod = Tool::Cylinder(Cylinder::new(1.5e-3, Some(2e-3)).unwrap());
    let lean = DQuat::from_rotation_y(0.3) * DQuat::from_rotation_x(0.4);
    let about_z = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
    let as_shipped = scene.tool.pose_part_tool.rotation;
    let tools = [
        (
            "corner",
            brick(DVec3::new(1.5e-3, 1.5e-3, 2e-3)),
            as_shipped,
        ),
        (
            "blade",
            brick(DVec3::new(1.5e-3, 1.5e-3, 5e-3)),
            about_z(45.0),
        ),
        (
            "flat",
            brick(DVec3::new(1.5e-3, 1.5e-3, 2e-3)),
            about_z(30.0),
        ),
        ("rim", rod, lean),
    ];
    for (name, tool, rotation) in tools {
        let mut start = DPose3 {
            rotation,
            ..scene.tool.pose_part_tool
        };
        let (lowest, _) = tool.aabb(&start).unwrap();
        start.translation.y += 2e-5 - lowest.y;
        let mut largest_step = |choice| {
            scene.accuracy.tool_features = choice;
            let mut engine = setup::engine(&scene, &prepared, tool.clone()).unwrap();
            let (mut n_contact, mut before, mut largest) = (0, DVec3::ZERO, 0.0_f64);
            for k in 0..850 {
                let way = 1e-5 * f64::from(k) * scene.drive.direction;
                let translation = start.translation + way;
                let report = engine.step(&DPose3 {
                    translation,
                    ..start
                });
                let settled = report.converged && report.lcp_solved && report.dropped == 0;
                assert!(settled, "{name} {choice:?} {k}: {report:?}");
                n_contact += u32::from(report.contacts > 0);
                let force = report.contact_force_on_tool();
                largest = largest.max((force - before).length());
                before = force;
            }
            assert!(n_contact > 300, "{name}: contact in {n_contact} steps");
            largest
        };
        let with = largest_step(ToolFeatures::Auto);
        let without = largest_step(ToolFeatures::Off);
        assert!(with < without, "{name}: {with} and {without} N");
    }
}

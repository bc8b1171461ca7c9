//! Short runs of the engine on parts that are prepared once.

use std::path::Path;
use std::sync::Arc;

use contact::tool::{BoxShape, Capsule, Cylinder, HalfSpace, Mesh, Sphere, Tool};
use device::Wrench;
use fem::Mesh as PartMesh;
use glam::{DQuat, DVec3};
use glamx::DPose3;
use snapin::engine::{ContactIterations, Engine, EngineSettings, Plan, StepReport};
use snapin::prepare::PreparedPart;
use snapin::scene::{ContactAt, Scene, StaticFriction, ToolFeatures};
use snapin::session::fast::FastSettings;
use snapin::session::slow::Stepped;
use snapin::setup;
use snapin_tests::brick::Random;

use super::{PartCase, for_each_seed, parts};

/// A prepared part in one way of keeping its compliance.
struct Ready {
    name: String,
    scene: Scene,
    prepared: PreparedPart,
    size: DVec3,
}

/// Ways of keeping the compliance, as keys of `[accuracy]`.
const WAYS: [&str; 3] = ["", "columns = \"near\"", "contact_scalar = \"f32\""];

fn ready(folder: &Path) -> Vec<Ready> {
    let mut ready = Vec::new();
    for case in parts() {
        let mesh = format!("{}.msh", case.name);
        std::fs::write(folder.join(&mesh), &case.msh).unwrap();
        for (k, way) in WAYS.iter().enumerate() {
            ready.push(prepared(folder, &case, &mesh, way, k));
        }
    }
    ready
}

fn prepared(folder: &Path, case: &PartCase, mesh: &str, way: &str, k: usize) -> Ready {
    let text = format!(
        "[part]\nmesh = \"{mesh}\"\n{}\nmaterial = {{ young_modulus = 2e8, poisson_ratio = 0.35 }}\n\n\
         [tool]\nshape = \"sphere\"\nradius = 0.005\nposition = [0.02, 0.0, 0.05]\n\n\
         [hand]\ndirection = [0.0, 0.0, -1.0]\nspeed = 0.02\ntravel = 0.01\n\n[accuracy]\n{way}\n",
        case.keys
    );
    let path = folder.join(format!("{}-{k}.toml", case.name));
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path).unwrap();
    let prepared = snapin_tests::prepared(&scene);
    Ready {
        name: format!("{} {way}", case.name),
        scene,
        prepared,
        size: DVec3::from_array(case.size),
    }
}

/// A closed wedge with a notch, as an OBJ file, and one long bar: tools with sharp edges and hollows.
fn tool_meshes(folder: &Path) -> Vec<Arc<Mesh>> {
    let prism = |outline: &[[f64; 2]], triangles: &[[usize; 3]]| {
        let n = outline.len();
        let mut text = String::new();
        for z in [-0.5, 0.5] {
            for [x, y] in outline {
                text += &format!("v {x} {y} {z}\n");
            }
        }
        for [a, b, c] in triangles {
            text += &format!("f {} {} {}\n", c + 1, b + 1, a + 1);
            text += &format!("f {} {} {}\n", a + n + 1, b + n + 1, c + n + 1);
        }
        for k in 0..n {
            let l = (k + 1) % n;
            text += &format!("f {} {} {}\n", k + 1, l + 1, l + n + 1);
            text += &format!("f {} {} {}\n", k + 1, l + n + 1, k + n + 1);
        }
        text
    };
    let notched = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [0.0, -0.2],
        [-1.0, 1.0],
    ];
    let wedge = [[-1.0, -0.3], [1.0, 0.0], [-1.0, 0.3]];
    let shapes = [
        prism(&notched, &[[0, 1, 3], [1, 2, 3], [0, 3, 4]]),
        prism(&wedge, &[[0, 1, 2]]),
    ];
    let read = |(k, text): (usize, &String)| {
        let path = folder.join(format!("tool-{k}.obj"));
        std::fs::write(&path, text).unwrap();
        Arc::new(Mesh::read(&path, 0.01).unwrap_or_else(|e| panic!("tool {k}: {e}")))
    };
    shapes.iter().enumerate().map(read).collect()
}

fn tool(random: &mut Random, meshes: &[Arc<Mesh>]) -> Tool {
    let mut size = || random.decades(2e-4, 0.05);
    let (a, b, c) = (size(), size(), size());
    match random.below(8) {
        0 => Tool::Sphere(Sphere::new(a).unwrap()),
        1 => Tool::Cylinder(Cylinder::new(a, None).unwrap()),
        2 => Tool::Cylinder(Cylinder::new(a, Some(b)).unwrap()),
        3 | 4 => Tool::Box(BoxShape::new(DVec3::new(a, b, c)).unwrap()),
        5 => Tool::Capsule(Capsule::new(a, b).unwrap()),
        6 => Tool::HalfSpace(HalfSpace),
        _ => Tool::Mesh(Arc::clone(&meshes[random.below(meshes.len())])),
    }
}

fn vector(random: &mut Random) -> DVec3 {
    DVec3::from_array(random.direction())
}

/// Where the tool goes: from outside into the part and on, along or with turns and jumps.
fn path(random: &mut Random, tool: &Tool, size: DVec3) -> Vec<DPose3> {
    let lands_at = size * DVec3::new(random.unit(), random.unit(), random.between(0.5, 1.1));
    let rotation = if random.chance(0.5) {
        let axis = random.pick(&[DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Y]);
        DQuat::from_rotation_arc(DVec3::Z, axis)
    } else {
        DQuat::from_axis_angle(vector(random), random.between(-3.0, 3.0))
    };
    // Out along a direction until the tool's surface is at the place, and a little more.
    let out = if random.chance(0.6) {
        DVec3::Z
    } else {
        vector(random)
    };
    let at = |way: f64| DPose3::from_parts(lands_at + way * out, rotation);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let is_out = tool.signed_distance(&at(middle), lands_at).signed_distance > 0.0;
        *(if is_out { &mut high } else { &mut low }) = middle;
    }
    let touch = at(high);
    let depth = random.decades(1e-6, 5e-3);
    let aside = random.pick(&[0.0, 0.5, 1.0]) * depth * vector(random);
    let turn = if random.chance(0.3) {
        random.between(-0.2, 0.2) * vector(random)
    } else {
        DVec3::ZERO
    };
    let n = 4 + random.below(12);
    let mut poses: Vec<DPose3> = (0..=n)
        .map(|k| {
            let t = k as f64 / n as f64;
            let way = depth * (2.0 * t - 1.0).min(1.0);
            DPose3::from_parts(
                touch.translation - way * out + t * aside,
                DQuat::from_scaled_axis(t * turn) * rotation,
            )
        })
        .collect();
    if random.chance(0.2) {
        let jump = 1e-2 * random.unit() * vector(random);
        let last = poses[n];
        poses.push(DPose3::from_parts(last.translation + jump, last.rotation));
        poses.push(last);
    }
    if random.chance(0.3) {
        poses.extend(poses.clone().into_iter().rev());
    }
    poses
}

fn settings(random: &mut Random, tool: &Tool, size: DVec3) -> EngineSettings {
    let size = size.length().min(tool.characteristic_size());
    EngineSettings {
        displacement_tolerance: 1e-9,
        merge_tolerance: 0.05,
        lcp: contact::lcp::Settings::default(),
        max_stride: 0.02 * size,
        near_distance: if random.chance(0.5) {
            4e-4 * size
        } else if random.chance(0.9) {
            random.decades(1e-7, 5e-4)
        } else {
            // Nearly everything is near: each step takes long.
            random.decades(5e-4, 0.02)
        },
        max_contacts: random.pick(&[1, 2, 3, 7, 30, 500]),
        contact_iterations: random.pick(&[
            ContactIterations::Converged,
            ContactIterations::Converged,
            ContactIterations::Fixed(1),
            ContactIterations::Fixed(3),
        ]),
    }
}

/// The engine of a scene, or one whose tool is moved without a coupling.
fn engine(random: &mut Random, ready: &Ready, tool: &Tool) -> Result<Engine, String> {
    let mut scene = ready.scene.clone();
    scene.accuracy.contact_at = random.pick(&[ContactAt::Nodes, ContactAt::Places]);
    scene.accuracy.tool_features = random.pick(&[ToolFeatures::Auto, ToolFeatures::Off]);
    scene.coupling.translational_stiffness = random.decades(1e2, 1e7);
    let friction = random.chance(0.4).then(|| random.decades(1e-3, 3.0));
    let mut scene = scene.with_friction(friction.is_some());
    scene.effects.friction_coefficient = friction;
    if let Some(kinetic) = friction.filter(|_| random.chance(0.3)) {
        scene.effects.static_friction = Some(StaticFriction {
            coefficient: kinetic * random.decades(1.0, 4.0),
            weakening_distance: random.decades(1e-7, 1e-2),
        });
    }
    let settings = settings(random, tool, ready.size);
    if random.chance(0.5) {
        scene.accuracy.near_distance = Some(settings.near_distance);
        scene.accuracy.max_contacts = settings.max_contacts;
        scene.accuracy.contact_iterations = match settings.contact_iterations {
            ContactIterations::Converged => snapin::scene::ContactIterations::Converged,
            ContactIterations::Fixed(n) => snapin::scene::ContactIterations::Times(n),
        };
        return setup::engine(&scene, &ready.prepared, tool.clone()).map_err(|e| e.to_string());
    }
    let part = ready.prepared.contact_part();
    let plan = Plan {
        friction: scene.effects.simulated_friction(),
        ..Plan::new(part, tool.clone(), None, settings)
    };
    let plan = setup::with_contact(&scene, &ready.prepared, plan).map_err(|e| e.to_string())?;
    Engine::new(plan).map_err(|e| e.to_string())
}

/// What no step may do, whatever it was asked for.
fn check(report: &StepReport) -> Result<(), String> {
    let numbers = report.contact_wrench_on_tool.iter();
    let mut numbers = numbers.chain(&report.coupling_wrench_on_tool);
    if !numbers.all(|x| x.is_finite()) || !report.tool_pose.translation.is_finite() {
        return Err(format!("not finite: {report:?}"));
    }
    Ok(())
}

/// A step that is solved and settled, with a row for each near node, leaves no node in the tool.
fn check_nodes(engine: &mut Engine, report: &StepReport, mesh: &PartMesh) -> Result<(), String> {
    let is_exact = report.lcp_solved
        && report.converged
        && report.dropped == 0
        && report.rigid_depth == 0.0
        && report.without_column == 0
        && report.rows == report.near
        // Between its places contact lets the part's nodes in by the dents of its faces.
        && !engine.has_moving_places()
        && engine.settings().contact_iterations == ContactIterations::Converged;
    if !is_exact {
        return Ok(());
    }
    let extent = snapin::session::part_extent(mesh);
    for candidate in 0..engine.part().n_candidates() {
        let x = engine.part().rest_positions()[candidate] + engine.displacement(candidate);
        let gap = engine
            .tool()
            .signed_distance(&report.tool_pose, x)
            .signed_distance;
        if gap < -1e-6 * extent {
            return Err(format!("node {candidate} is {gap:e} m inside: {report:?}"));
        }
    }
    Ok(())
}

fn run(random: &mut Random, ready: &Ready, meshes: &[Arc<Mesh>]) -> Result<u32, String> {
    let tool = tool(random, meshes);
    let path = path(random, &tool, ready.size);
    let mut engine = match engine(random, ready, &tool) {
        Ok(engine) => engine,
        Err(why) if why.contains("near_distance") => return Ok(0),
        Err(why) => return Err(why),
    };
    let two_rates = random.chance(0.2);
    if two_rates {
        return two_rates_run(random, &mut engine, &path);
    }
    let mut touched = 0;
    for (k, pose) in path.iter().enumerate() {
        let report = engine.step(pose);
        check(&report)?;
        check_nodes(&mut engine, &report, &ready.prepared.loaded.mesh)
            .map_err(|why| format!("step {k}: {why}"))?;
        touched += u32::from(report.contacts > 0);
        if random.chance(0.02) {
            engine.reset();
        }
    }
    Ok(touched)
}

fn two_rates_run(random: &mut Random, engine: &mut Engine, path: &[DPose3]) -> Result<u32, String> {
    let settings = FastSettings {
        period_s: 1e-3,
        force_resolution: 0.2,
        lever: 0.04,
        n_ticks: path.len(),
    };
    let every = 1 + random.below(5) as u64;
    let on_handle = |report: &StepReport| Wrench::from_array(&report.coupling_wrench_on_tool);
    let mut stepped = Stepped::new(engine, &path[0], every, settings).map_err(|e| e.to_string())?;
    let mut touched = 0;
    for (tick, target) in path.iter().enumerate() {
        let answer = stepped.tick(tick as u64, target, on_handle);
        check(&answer.report)?;
        touched += u32::from(answer.report.contacts > 0);
        if let Some(step) = stepped.work(engine, tick as u64, target) {
            check(&step.report)?;
        }
    }
    Ok(touched)
}

#[test]
fn random_tools_on_random_ways_never_panic_and_leave_no_node_inside() {
    let folder = tempfile::tempdir().unwrap();
    let ready = ready(folder.path());
    let meshes = tool_meshes(folder.path());
    let mut n_touched = 0;
    let mut n_runs = 0;
    for_each_seed(300, |_, random| {
        let ready = &ready[random.below(ready.len())];
        let touched =
            run(random, ready, &meshes).map_err(|why| format!("{}: {why}", ready.name))?;
        n_runs += 1;
        n_touched += u32::from(touched > 0);
        Ok(())
    });
    assert!(
        n_touched > n_runs / 3,
        "contact in {n_touched} of {n_runs} runs"
    );
}

//! Where the displacement multiply runs must not be felt: the same forces to the last bit, and the same shape within the
//! rounding of 32-bit numbers. On the best adapter, one in software too; where there is none, the refusal is looked at.

use std::time::Duration;

use snapin::engine::Engine;
use snapin::prepare::{PrepareOptions, PreparedPart, prepare};
use snapin::progress::Ui;
use snapin::scene::{Adaptive, FreeNodes, Multiply, MultiplyScalar, Scene};
use snapin::session::{self, Recording};
use snapin::setup;
use snapin::shape::Shape;
use snapin_tests::root;

fn prepared(scene: &Scene) -> PreparedPart {
    let mut unseen = std::io::sink();
    let ui = Ui::new(&mut unseen, false);
    let spec = setup::part_spec(scene).unwrap();
    prepare(&spec, &PrepareOptions::default(), &ui).unwrap()
}

fn held(scene: &Scene, part: &PreparedPart) -> session::Held {
    let (tool, _) = setup::tool(scene).unwrap();
    setup::held(scene, part, &tool)
}

fn engine(scene: &Scene, part: &PreparedPart) -> Engine {
    let (tool, _) = setup::tool(scene).unwrap();
    setup::engine(scene, part, tool).unwrap()
}

fn clip() -> (Scene, PreparedPart) {
    let mut scene = Scene::load(&root().join("scenes/clip.toml")).unwrap();
    scene.hand.as_mut().unwrap().hold = 0.02;
    let part = prepared(&scene);
    (scene, part)
}

/// The shape on an adapter; `None`, after a look at what is said, where there is none.
fn shape_on_gpu(part: &PreparedPart, scene: &Scene) -> Option<Shape> {
    let mut accuracy = scene.accuracy.clone();
    accuracy.multiply = Multiply::Gpu;
    match Shape::new(part, &accuracy, None) {
        Ok(shape) => {
            assert!(shape.choice().is_on_gpu, "{:?}", shape.choice());
            Some(shape)
        }
        Err(error) => {
            eprintln!("no adapter: {error}");
            assert!(
                error.to_string().contains("looked for adapters of "),
                "{error}"
            );
            None
        }
    }
}

fn shape_on_processor(part: &PreparedPart, scene: &Scene) -> Shape {
    let mut accuracy = scene.accuracy.clone();
    accuracy.multiply = Multiply::Cpu;
    Shape::new(part, &accuracy, None).unwrap()
}

fn session_with(shape: &mut Shape, scene: &Scene, part: &PreparedPart) -> Recording {
    let mut engine = engine(scene, part);
    session::run(
        &setup::session(scene, held(scene, part)).unwrap(),
        part,
        &mut engine,
        shape,
        &fem::Silent,
    )
    .unwrap()
}

/// 1e-6 of the largest displacement: rounding of 2⁻²⁴ in the compliance, in the force and in each product.
#[test]
fn a_session_on_a_gpu_has_the_same_forces_and_nearly_the_same_shape() {
    let (mut scene, part) = clip();
    let select = Adaptive::On(FreeNodes::Radius(2e-3));
    for (adaptive, scalar, bound) in [
        (Adaptive::Off, MultiplyScalar::Auto, 1e-6),
        (Adaptive::Off, MultiplyScalar::F16, 2e-3),
        (select, MultiplyScalar::F32, 1e-6),
    ] {
        scene.accuracy.adaptive = adaptive;
        scene.accuracy.scalar = scalar;
        let Some(mut on_gpu) = shape_on_gpu(&part, &scene) else {
            return;
        };
        let gpu = session_with(&mut on_gpu, &scene, &part);
        let processor = session_with(&mut shape_on_processor(&part, &scene), &scene, &part);
        assert_eq!(on_gpu.given_up(), None);
        assert_eq!(gpu.records.len(), processor.records.len());
        for (a, b) in gpu.records.iter().zip(&processor.records) {
            assert_eq!(a.wrench_on_handle, b.wrench_on_handle, "step {}", a.step);
            assert_eq!(a.travel, b.travel, "step {}", a.step);
        }
        let (a, b) = (
            gpu.max_surface_displacement,
            processor.max_surface_displacement,
        );
        assert!(b > 1e-4, "the clip bends: {b} m");
        assert!((a / b - 1.0).abs() < bound, "{a} and {b} m, {scalar:?}");
    }
}

/// The form for a loop that must not wait: the shape of an earlier update, and in the end that of the state.
#[test]
fn without_waiting_the_shape_arrives_later() {
    let (mut scene, part) = clip();
    for adaptive in [Adaptive::Off, Adaptive::On(FreeNodes::Radius(0.0))] {
        scene.accuracy.adaptive = adaptive;
        let Some(mut shape) = shape_on_gpu(&part, &scene) else {
            return;
        };
        shape.never_wait();
        let mut engine = engine(&scene, &part);
        let start = scene.tool.pose_part_tool;
        for k in 0..=50 {
            let share = 0.5 * f64::from(k) / 50.0;
            engine.step(&glamx::DPose3 {
                translation: start.translation + share * scene.drive.travel * scene.drive.direction,
                ..start
            });
        }
        assert!(engine.active_contacts().len() > 1);
        let exact = shape_on_processor(&part, &scene)
            .update(engine.active_contacts())
            .unwrap()
            .to_vec();
        let first = shape.update(engine.active_contacts()).unwrap();
        assert!(first.iter().all(|u| *u == 0.0), "nothing was asked for yet");
        let bound = 1e-6 * snapin::shape::largest(&exact);
        let has_arrived = (0..10_000).any(|_| {
            std::thread::sleep(Duration::from_millis(1));
            let u = shape.update(engine.active_contacts()).unwrap();
            u.iter().zip(&exact).all(|(a, b)| (a - b).abs() <= bound)
        });
        assert!(has_arrived, "{adaptive:?}");
    }
}

/// In real time with one rate the display is in the loop and does not wait; the forces are those of a run without a clock.
#[test]
fn a_real_time_session_on_a_gpu_has_the_same_forces() {
    let (mut scene, part) = clip();
    let hand = scene.hand.as_mut().unwrap();
    (hand.hold, hand.retract) = (0.0, false);
    scene.accuracy.rates = snapin::scene::Rates::One;
    let Some(mut shape) = shape_on_gpu(&part, &scene) else {
        return;
    };
    scene.device.real_time = true;
    let in_time = session_with(&mut shape, &scene, &part);
    scene.device.real_time = false;
    let stepped = session_with(&mut shape_on_processor(&part, &scene), &scene, &part);
    for (a, b) in in_time.records.iter().zip(&stepped.records) {
        assert_eq!(a.wrench_on_handle, b.wrench_on_handle, "step {}", a.step);
    }
    assert!(in_time.max_surface_displacement > 0.0);
}

/// Fetched columns are no whole matrix: told, not done in silence.
#[test]
fn gpu_is_refused_where_the_whole_compliance_is_not_multiplied() {
    let (mut scene, _) = clip();
    scene.accuracy.columns = snapin::scene::Columns::Near;
    let near = prepared(&scene);
    let mut accuracy = scene.accuracy.clone();
    let shape = Shape::new(&near, &accuracy, None).unwrap();
    assert_eq!(
        shape.choice().words(),
        "the processor, 64 bits: columns are fetched"
    );
    accuracy.multiply = Multiply::Gpu;
    let error = Shape::new(&near, &accuracy, None)
        .err()
        .unwrap()
        .to_string();
    assert!(
        error.contains("its columns are fetched") && error.contains("multiply = \"auto\""),
        "{error}"
    );
}

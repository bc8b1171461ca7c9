//! What the haptic step must never do: take memory from the heap, over a whole insertion.
//!
//! A file of its own, because it replaces the allocator. Nothing here is timed.

#![allow(unsafe_code, reason = "a counting allocator forwards to the system's")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use device::Wrench;
use glamx::DPose3;
use snapin::engine::StepReport;
use snapin::prepare::PreparedPart;
use snapin::scene::{Adaptive, Columns, ContactAt, FreeNodes, Multiply, Scalar, Scene};
use snapin::session::fast::FastSettings;
use snapin::session::slow::Stepped;
use snapin::setup;
use snapin::shape::Shape;
use snapin_tests::{root, shipped};

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call is forwarded unchanged to the system's allocator; only a counter is added.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// One after the other, because all threads share the counter.
#[test]
fn nothing_in_the_haptic_loop_allocates() {
    no_step_of_an_insertion_allocates();
    no_tick_of_two_rates_allocates();
}

/// All scenes, pushed in and pulled out again, a jump of the handle and a pose that is refused; the
/// clip also with friction, with 32-bit numbers, with most of its columns missing, and with its shape drawn from free nodes; and with fewer rows than contacts come near, of nodes and of the tool's edges.
fn no_step_of_an_insertion_allocates() {
    let all = (Columns::All, Scalar::F64);
    let bent = Adaptive::On(FreeNodes::Indicator(1e-3));
    for (name, adaptive, (columns, contact_scalar), rows) in [
        ("clip.toml", Adaptive::Off, all, None),
        ("clip.toml with friction", Adaptive::Off, all, None),
        ("edge.toml with friction", Adaptive::Off, all, None),
        ("clip.toml with friction", Adaptive::Off, all, Some(3)),
        (
            "clip.toml",
            Adaptive::Off,
            (Columns::All, Scalar::F32),
            None,
        ),
        (
            "clip.toml",
            Adaptive::Off,
            (Columns::Near, Scalar::F32),
            None,
        ),
        ("hook.toml", Adaptive::Off, all, None),
        ("edge.toml", Adaptive::Off, all, None),
        ("clip.toml", bent, all, None),
        ("clip.toml", Adaptive::Off, all, Some(3)),
        ("edge.toml", Adaptive::Off, all, Some(1)),
    ] {
        let file = name.trim_end_matches(" with friction");
        let scene = Scene::load(&root().join("scenes").join(file)).unwrap();
        let mut scene = scene.with_friction(file != name);
        scene.effects.friction_coefficient = Some(0.2);
        scene.accuracy.adaptive = adaptive;
        scene.accuracy.columns = columns;
        scene.accuracy.contact_scalar = contact_scalar;
        scene.accuracy.multiply = Multiply::Cpu;
        if let Some(rows) = rows {
            scene.accuracy.max_contacts = rows;
        }
        let prepared = snapin_tests::prepared(&scene);
        let (tool, _) = setup::tool(&scene).unwrap();
        let mut engine = setup::engine(&scene, &prepared, tool).unwrap();
        let mut shape = Shape::new(&prepared, &scene.accuracy, None).unwrap();
        let start = scene.tool.pose_part_tool;
        let at = |share: f64| DPose3 {
            translation: start.translation + share * scene.drive.travel * scene.drive.direction,
            ..start
        };
        let in_and_out: Vec<f64> = (0..=400)
            .chain((0..=400).rev())
            .map(|k| f64::from(k) / 400.0)
            .collect();
        let jump = [0.0, 0.3, 0.1, f64::NAN, 0.35];
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        let (mut touched, mut shared) = (0, 0);
        for &share in in_and_out.iter().chain(&jump) {
            let report = engine.step(&at(share));
            touched += u32::from(report.contacts > 0);
            shared += u32::from(report.rows < report.near);
            shape.update(engine.active_contacts()).unwrap();
        }
        let after = ALLOCATIONS.load(Ordering::Relaxed);
        assert!(touched > 100, "{name}: contact in {touched} steps only");
        assert!(
            (shared > 100) == rows.is_some(),
            "{name}: rows shared in {shared} steps"
        );
        assert_eq!(
            after - before,
            0,
            "{name} {adaptive:?} {columns:?} {rows:?}"
        );
    }
}

/// The fast loop of two rates, with the engine's work in turns: solving, hand-overs and freezing take no memory.
fn no_tick_of_two_rates_allocates() {
    let (scene, prepared) = shipped("clip.toml");
    no_tick_allocates(&scene.with_friction(false), &prepared);
    no_tick_allocates(&scene.with_friction(true), &prepared);
    let (mut scene, prepared) = shipped("clip.toml");
    scene.accuracy.contact_at = ContactAt::Places;
    no_tick_allocates(&scene, &prepared);
    let (scene, prepared) = shipped("edge.toml");
    no_tick_allocates(&scene, &prepared);
}

fn no_tick_allocates(scene: &Scene, prepared: &PreparedPart) {
    let (tool, _) = setup::tool(scene).unwrap();
    let mut engine = setup::engine(scene, prepared, tool).unwrap();
    let start = scene.tool.pose_part_tool;
    let at = |share: f64| DPose3 {
        translation: start.translation + share * scene.drive.travel * scene.drive.direction,
        ..start
    };
    let on_handle = |report: &StepReport| Wrench::from_array(&report.coupling_wrench_on_tool);
    let settings = FastSettings {
        period_s: 1e-3,
        force_resolution: 0.2,
        lever: 0.02,
        n_ticks: 2000,
    };
    let mut stepped = Stepped::new(&mut engine, &start, 4, settings).unwrap();
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    let mut touched = 0;
    for (tick, k) in (0..=700).chain((0..=700).rev()).enumerate() {
        let target = at(f64::from(k) / 700.0);
        let answer = stepped.tick(tick as u64, &target, on_handle);
        touched += u32::from(answer.report.contacts > 0);
        stepped.work(&mut engine, tick as u64, &target);
    }
    let after = ALLOCATIONS.load(Ordering::Relaxed);
    assert!(touched > 100, "contact in {touched} ticks only");
    assert_eq!(after - before, 0);
    assert!(stepped.fast().log().hand_overs.len() > 300);
}

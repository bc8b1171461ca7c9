//! What the haptic step must never do: take memory from the heap, over a whole insertion and over a live session.
//!
//! A file of its own, because it replaces the allocator. Nothing here is timed.

#![allow(unsafe_code, reason = "a counting allocator forwards to the system's")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use device::{
    AsFastAsPossible, Command, DeviceError, HandleState, HapticDevice, Limits, Mapping,
    MappingSettings, ServoSettings, Wrench,
};
use glam::DVec3;
use glamx::DPose3;
use snapin::engine::StepReport;
use snapin::prepare::PreparedPart;
use snapin::report::mcap_file;
use snapin::scene::{Adaptive, Columns, ContactAt, FreeNodes, Multiply, Scalar, Scene};
use snapin::session::fast::FastSettings;
use snapin::session::live::{self, Hands, LivePorts, LiveSpec};
use snapin::session::log::Log;
use snapin::session::rates::Rates;
use snapin::session::slow::Stepped;
use snapin::session::snapshots;
use snapin::setup;
use snapin::shape::Shape;
use snapin_tests::{root, shipped};

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// Of this thread alone: beside a session a recording is written, and that allocates.
    static OWN_ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
    OWN_ALLOCATIONS.with(|own| own.set(own.get() + 1));
}

// SAFETY: every call is forwarded unchanged to the system's allocator; only a counter is added.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
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
    no_period_of_a_live_session_allocates();
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

/// Periods of the live session.
const LIVE_PERIODS: u64 = 100_000;

/// A handle that goes in and out along a line, a way each second; it notes what the loop's thread has allocated.
struct InAndOut {
    limits: Limits,
    way: DVec3,
    reads: u64,
    before: u64,
    after: u64,
    largest: f64,
}

impl HapticDevice for InAndOut {
    fn name(&self) -> &str {
        "in and out"
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        self.reads += 1;
        let allocated = OWN_ALLOCATIONS.with(Cell::get);
        if self.reads == 1 {
            self.before = allocated;
        }
        self.after = allocated;
        let share = 0.5 - 0.5 * (std::f64::consts::TAU * time_s).cos();
        Ok(HandleState {
            time_s,
            ..HandleState::at_rest(DPose3::from_translation(share * self.way))
        })
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        self.largest = self.largest.max(command.wrench.force.length());
        Ok(())
    }

    fn stop(&mut self) {}
}

/// A hundred seconds at 1 kHz, in and out once a second, with a recording and a viewer attached; at one rate and at two.
/// What was recorded is what was felt.
fn no_period_of_a_live_session_allocates() {
    for (rates, n_periods) in [(Rates::One, LIVE_PERIODS), (Rates::Every(2), 4_000)] {
        let (scene, prepared) = shipped("clip.toml");
        let scene = scene.with_friction(false);
        let (tool, _) = setup::tool(&scene).unwrap();
        let held = setup::held(&scene, &prepared, &tool);
        let mut session = setup::live_session(&scene, held, 1e-3);
        session.rates = rates;
        let mut engine = setup::engine(&scene, &prepared, tool).unwrap();
        let chosen = live::rates(&session, &prepared, &mut engine).unwrap();
        let limits = Limits::virtuose_6d();
        let mut device = InAndOut {
            limits,
            way: session.travel * session.direction,
            reads: 0,
            before: 0,
            after: 0,
            largest: 0.0,
        };
        let spec = LiveSpec {
            mapping: Some(Mapping::new(MappingSettings::default(), held.start()).unwrap()),
            clutch: 0,
            slips: false,
            rail: None,
            largest_force: 14.0,
            stiffness: 2e4,
            n_periods: Some(n_periods),
            seconds: None,
            lever: 0.05,
            servo: ServoSettings::live(&limits).unwrap(),
            session,
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.mcap");
        let (log, samples) = Log::create(&path, &BTreeMap::new()).unwrap();
        let (viewer, mut view) = snapshots(engine.settings().max_contacts);
        let ports = LivePorts {
            at_start: None,
            viewer,
            log: Some(samples),
            trace: None,
        };
        let (stop, is_over) = (AtomicBool::new(false), AtomicBool::new(false));
        let (report, logged) = std::thread::scope(|scope| {
            let writer = scope.spawn(|| log.write(&is_over));
            let hands = Hands {
                first: &mut device,
                second: None,
            };
            let engine = &mut engine;
            // An engine beside the loop works in real time only: on a faster clock its answers are too old.
            let report = if rates == Rates::One {
                let clock = AsFastAsPossible::new(1e-3).unwrap();
                live::run_on(clock, &spec, &chosen, hands, engine, ports, &stop)
            } else {
                live::run(&spec, &chosen, hands, engine, ports, &stop)
            };
            is_over.store(true, Ordering::Release);
            (report.unwrap(), writer.join().unwrap().unwrap())
        });
        assert_eq!(report.servo.periods, n_periods);
        assert_eq!(device.after - device.before, 0, "{rates:?}");
        assert!(device.largest > 5.0, "{} N", device.largest);
        assert_eq!(logged.n_steps + report.n_unlogged, n_periods);

        let read = mcap_file::read(&std::fs::read(&path).unwrap()).unwrap();
        assert!(read.is_whole);
        assert_eq!(read.messages.len() as u64, logged.n_steps);
        let largest = read.messages.iter().filter_map(|m| m.force_n);
        let largest = largest.fold(0.0, f64::max);
        assert!(largest <= report.snap.peak_force);
        let (sample, snap) = {
            view.update();
            let snapshot = view.output_buffer();
            (snapshot.sample.unwrap(), snapshot.snap)
        };
        assert_eq!(sample.step, n_periods - 1);
        assert_eq!(snap, report.snap);
        assert!(snap.n_snaps_in > 0 && snap.n_snaps_out > 0, "{snap:?}");
    }
}

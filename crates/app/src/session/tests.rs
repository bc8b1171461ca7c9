use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use contact::lcp;
use contact::tool::{Sphere, Tool};
use device::VirtualCoupling;
use glamx::DPose3;

use super::fast::FastLoop;
use super::handover::Handed;
use super::slow::solve_and_freeze;
use super::*;
use crate::engine::{ContactIterations, ContactPart, EngineSettings, Plan};

const N_PERIODS: u64 = 400;

/// A ball of 5 mm on one node that gives way by 1 mm/N; the ball starts 10 um in.
fn engine() -> Engine {
    let block = [1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3];
    let part = ContactPart::new(vec![DVec3::ZERO], 1, block.to_vec());
    let settings = EngineSettings {
        contact_iterations: ContactIterations::Converged,
        displacement_tolerance: 1e-9,
        near_distance: 1e-5,
        max_contacts: 4,
        merge_tolerance: 0.05,
        lcp: lcp::Settings::default(),
        max_stride: 1e-4,
    };
    let tool = Tool::Sphere(Sphere::new(5e-3).unwrap());
    let coupling = VirtualCoupling::new(1e4, 10.0).unwrap();
    Engine::new(Plan::new(Arc::new(part), tool, Some(coupling), settings)).unwrap()
}

pub(super) fn spec() -> SessionSpec {
    SessionSpec {
        held: Held {
            holds: Holds::Tool,
            grip: DVec3::ZERO,
            tool_pose: DPose3::from_translation(DVec3::new(0.0, 0.0, 4.99e-3)),
        },
        clearance: Clearance {
            may_overlap: true,
            length_unit: ("m", 1.0),
        },
        direction: DVec3::NEG_Z,
        speed: 1e-3,
        travel: 1e-4,
        hold_s: 1.0,
        retract: false,
        hand: HandSettings::default(),
        model: None,
        period_s: 1e-3,
        real_time: false,
        rates: Rates::Every(1),
    }
}

/// Calls a function with the period, now and then.
struct Watched<F: Fn(usize) + Sync>(F);

impl<F: Fn(usize) + Sync> fem::Progress for Watched<F> {
    fn advance(&self, _: &str, done: usize, _: usize) {
        (self.0)(done);
    }

    fn is_cancelled(&self) -> bool {
        false
    }
}

fn run_with(
    engine: &mut Engine,
    progress: &dyn fem::Progress,
    solve: impl FnMut(u64, &DPose3, &mut Handed) + Send,
) -> (Result<fast::FastLog, Error>, Recording) {
    let spec = spec();
    let script = Script::new(&Insertion {
        start: spec.held.tool_pose,
        direction: spec.direction,
        speed: spec.speed,
        travel: spec.travel,
        hold_s: spec.hold_s,
        retract: false,
    })
    .unwrap();
    let hand = SimulatedHand::new(spec.hand, script, spec.period_s).unwrap();
    let mut device = Simulated::new(SimulatedSettings::default(), hand).unwrap();
    let settings = ServoSettings::for_limits(HapticDevice::limits(&device));
    let mut servo = Servo::new(AsFastAsPossible::new(1e-3).unwrap(), settings).unwrap();
    let rates = choose(&spec, engine);
    let mut recording = Recording::with_room(spec.direction, (N_PERIODS as usize, 4), rates);
    let mut session = Session {
        device: &mut device,
        course: Course {
            held: spec.held,
            mapped: None,
            other: None,
            saturation: None,
            rail: None,
            drive: Drive::Scripted {
                script,
                n_periods: N_PERIODS,
            },
            ports: Ports::recording(&mut recording),
        },
        at_start: None,
        progress,
    };
    let mut first = slow::empty(engine);
    solve_and_freeze(
        engine,
        0,
        &spec.held.tool_pose,
        &spec.held.tool_pose,
        &mut first,
    );
    let boxes = std::array::from_fn(|_| slow::empty(engine));
    let fast = FastSettings {
        period_s: 1e-3,
        force_resolution: 0.0,
        lever: 0.01,
        n_ticks: N_PERIODS as usize,
    };
    let fast = FastLoop::new(first, fast).unwrap();
    let log = session.beside(&mut servo, fast, boxes, solve);
    drop(session);
    recording.servo = servo.report();
    recording.device = device.events();
    (log, recording)
}

#[test]
fn an_engine_that_stalls_lets_the_wrench_fade() {
    let mut engine = engine();
    let is_over = AtomicBool::new(false);
    let progress = Watched(|period| {
        if period as u64 + DISPLAY_INTERVAL >= N_PERIODS {
            is_over.store(true, Ordering::Relaxed);
        }
    });
    // It takes a target and does not answer before the loop has nearly ended.
    let (log, recording) = run_with(&mut engine, &progress, |_, _, _| {
        while !is_over.load(Ordering::Relaxed) {
            std::thread::yield_now();
        }
    });
    let force = |k: usize| recording.records[k].wrench_on_handle.force.length();
    assert!(force(0) > 1e-3, "{}", force(0));
    assert!(force(99) > 1e-3);
    let quiet = 150..N_PERIODS as usize - 2 * DISPLAY_INTERVAL as usize;
    assert!(quiet.clone().all(|k| force(k) == 0.0));
    let log = log.unwrap();
    assert!(log.max_staleness as usize >= quiet.end - 1);
    assert!(log.faded as usize >= quiet.end - 101);
}

#[test]
fn an_engine_that_ends_is_an_error_and_the_device_is_released() {
    let mut engine = engine();
    let has_begun = AtomicBool::new(false);
    let progress = Watched(|_| {
        while !has_begun.load(Ordering::Relaxed) {
            std::thread::yield_now();
        }
    });
    let (log, recording) = run_with(&mut engine, &progress, |_, _, _| {
        has_begun.store(true, Ordering::Relaxed);
        panic!("on purpose, in a test");
    });
    assert!(matches!(log, Err(Error::EngineEnded)), "{log:?}");
    // What was rendered then went to zero, period by period.
    assert!(recording.records[0].wrench_on_handle.force.length() > 1e-3);
    assert_eq!(recording.device.fading, 0);
}

#[test]
fn an_engine_beside_the_loop_answers_the_newest_target() {
    let mut engine = engine();
    let mut last = spec().held.tool_pose;
    let mut ticks = Vec::new();
    let engine = &mut engine;
    let mut other = self::engine();
    let (log, recording) = run_with(engine, &fem::Silent, |tick, target, handed| {
        solve_and_freeze(&mut other, tick, target, &last, handed);
        last = *target;
        ticks.push(tick);
    });
    let log = log.unwrap();
    assert_eq!(recording.records.len() as u64, N_PERIODS);
    // Targets are taken in their order, and no problem is used twice or out of turn.
    assert!(ticks.is_sorted_by(|a, b| a < b));
    assert!(
        log.hand_overs
            .is_sorted_by(|a, b| a.tick - a.age < b.tick - b.age)
    );
    assert!(log.hand_overs.len() <= ticks.len());
    assert!(
        log.hand_overs
            .iter()
            .all(|h| ticks.contains(&(h.tick - h.age)))
    );
}

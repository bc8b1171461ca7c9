//! A session with a hand that nobody wrote a script for: it goes on until it is told to end.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use device::{Clock, HapticDevice, Mapping, RealTime, Servo, ServoReport, ServoSettings};
use glam::DVec3;

use super::course::{Course, Mapped};
use super::drive::{Drive, Heading};
use super::fast::FastSettings;
use super::other::Other;
pub use super::other::{SecondHand, SecondReport};
pub use super::ports::ForceOn;
use super::ports::{Ports, SnapshotInput, TracePoint};
use super::rates::{ChosenRates, TwoRates, choose};
use super::saturation::Saturation;
use super::tangent::Tangent;
use super::{Sample, Session, SessionSpec, SnapWatch, refuse_overlap};
use crate::Error;
use crate::engine::Engine;
use crate::prepare::PreparedPart;

/// Hand-overs and steps of two rates that are kept: the first minutes of a session.
const KEPT_TICKS: usize = 100_000;

/// Last part of a wait that is spun through, s: at real-time priority no more, or other threads starve at 10 kHz.
const SPIN_S: f64 = 3e-5;

/// What a live session needs beyond the engine and the device.
#[derive(Clone, Debug)]
pub struct LiveSpec {
    /// What is held and how, as for a script; the script itself is not gone.
    pub session: SessionSpec,
    /// From the device's frame to the world, at the start; `None`: the device's frame is the world.
    pub mapping: Option<Mapping>,
    /// Buttons of which each holds the clutch.
    pub clutch: u32,
    /// Whether nothing holds its handle back, so that the handle is taken back instead.
    pub slips: bool,
    /// N, largest force on the scene's own way ([`largest_force`]): a hand is given one and a half times as much, 2 N at
    /// least, and presses in vain beyond.
    pub largest_force: f64,
    /// Periods at most, where a script knows.
    pub n_periods: Option<u64>,
    /// s by the clock at most.
    pub seconds: Option<f64>,
    /// Unit, world: the axis that the held body stays on ([`crate::setup::live_rail`]).
    pub rail: Option<DVec3>,
    /// N/m, of the coupling along a way.
    pub stiffness: f64,
    /// m, divides torques to compare them with forces.
    pub lever: f64,
    /// The loop and its guard.
    pub servo: ServoSettings,
}

/// The devices.
pub struct Hands<'a> {
    /// Holds the scene's held body and keeps the loop's time.
    pub first: &'a mut dyn HapticDevice,
    /// Holds the other body.
    pub second: Option<SecondHand<'a>>,
}

/// Who listens.
pub struct LivePorts<'a> {
    /// Called on the loop's thread, just before the first period.
    pub at_start: Option<Box<dyn FnOnce() + Send + 'a>>,
    /// The newest period.
    pub viewer: SnapshotInput,
    /// Every period.
    pub log: Option<rtrb::Producer<Sample>>,
    /// Every period, as a plot needs it.
    pub trace: Option<rtrb::Producer<TracePoint>>,
}

/// What a live session leaves behind.
#[derive(Debug)]
pub struct LiveReport {
    /// Periods, misses and times of the loop, and what the guard did.
    pub servo: ServoReport,
    /// The felt curve.
    pub snap: SnapWatch,
    /// N, the most that went to the device: less than the curve where the device cannot do more.
    pub largest_rendered: f64,
    /// Whether the hand was given force at all.
    pub force: ForceOn,
    /// Periods that are not in the log because its writer was too slow.
    pub n_unlogged: u64,
    /// What two rates tell, if there were two.
    pub two_rates: Option<TwoRates>,
    /// What came of the second device, if there was one.
    pub second: Option<SecondReport>,
}

/// Whether whole steps are solved in the loop, by a rehearsal of the scene's way; also warms the engine up.
///
/// # Errors
/// A tool that overlaps the part at the start.
pub fn rates(
    spec: &SessionSpec,
    prepared: &PreparedPart,
    engine: &mut Engine,
) -> Result<ChosenRates, Error> {
    let mesh = &prepared.loaded.mesh;
    refuse_overlap(&spec.clearance, mesh, engine.tool(), &spec.held.tool_pose)?;
    Ok(choose(spec, engine))
}

/// N, largest force of the contact on the scene's way, gone in a few hundred steps.
pub fn largest_force(spec: &SessionSpec, engine: &mut Engine) -> f64 {
    const N_STEPS: u32 = 300;
    engine.reset();
    let mut largest = 0.0_f64;
    for k in 0..=N_STEPS {
        let shift = spec.travel * f64::from(k) / f64::from(N_STEPS) * spec.direction.normalize();
        let report = engine.step(&spec.held.target(&spec.held.along(shift)));
        largest = largest.max(report.contact_force_on_tool().length());
    }
    engine.reset();
    largest
}

/// Runs until `stop`, Ctrl-C or the last period, on this thread; the device is released at the end.
///
/// Nothing grows while it goes on. A device that is lost gets no force and is waited for.
///
/// # Errors
/// Settings that the loop refuses; an engine that ended on its own beside the loop.
pub fn run<'a, 'h: 'a>(
    spec: &LiveSpec,
    rates: &ChosenRates,
    hands: Hands<'h>,
    engine: &mut Engine,
    ports: LivePorts<'a>,
    stop: &'a AtomicBool,
) -> Result<LiveReport, Error> {
    let clock = RealTime::with_spin(spec.session.period_s, SPIN_S)?;
    run_on(clock, spec, rates, hands, engine, ports, stop)
}

/// The same on any clock.
///
/// # Errors
/// As [`run`].
pub fn run_on<'a, 'h: 'a, C: Clock>(
    clock: C,
    spec: &LiveSpec,
    rates: &ChosenRates,
    hands: Hands<'h>,
    engine: &mut Engine,
    ports: LivePorts<'a>,
    stop: &'a AtomicBool,
) -> Result<LiveReport, Error> {
    let fast = FastSettings {
        period_s: spec.session.period_s,
        force_resolution: hands.first.limits().force_resolution,
        lever: spec.lever,
        n_ticks: KEPT_TICKS,
    };
    let mut servo = Servo::new(clock, spec.servo)?;
    let second = hands.second.map(|hand| SecondHand {
        // Borrowed for no longer than the session.
        device: hand.device,
        ..hand
    });
    let other = second.map(|hand| Other::new(hand, spec.session.period_s));
    let mut session = Session {
        device: hands.first,
        course: Course {
            held: spec.session.held,
            mapped: spec.mapping.clone().map(|mapping| Mapped {
                mapping,
                clutch: spec.clutch,
                slips: spec.slips,
                tangent: Tangent::new(spec.stiffness),
            }),
            other: other.transpose()?,
            saturation: Some(Saturation::new(spec.largest_force, spec.stiffness)),
            rail: spec.rail,
            drive: Drive::Live {
                stop,
                n_periods: spec.n_periods,
                until: spec
                    .seconds
                    .map(|s| Instant::now() + Duration::from_secs_f64(s)),
                heading: Heading::new(),
            },
            ports: Ports {
                direction: spec.session.direction.normalize(),
                viewer: Some(ports.viewer),
                log: ports.log,
                clock_period_s: Some(spec.session.period_s),
                trace: ports.trace,
                ..Ports::default()
            },
        },
        at_start: ports.at_start,
        progress: &fem::Silent,
    };
    let outcome = match rates.every {
        None => session.one_rate(&mut servo, engine, None).map(|()| None),
        Some(_) => session.two_rates_beside(&mut servo, engine, fast).map(Some),
    };
    let second = session.course.other.as_mut().map(|other| {
        other.release();
        other.report()
    });
    let two_rates = outcome?;
    Ok(LiveReport {
        servo: servo.report(),
        snap: session.course.ports.snap,
        force: session.course.ports.force,
        largest_rendered: session.course.ports.largest_rendered,
        n_unlogged: session.course.ports.n_unlogged,
        two_rates,
        second,
    })
}

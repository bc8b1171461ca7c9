//! A session: a device's handle moves the tool or the part, the engine answers, and whoever listens is told.
//!
//! ```text
//!   drive ──> when it ends, what the hand is doing
//!   device ── handle ──> engine ── wrench ──> device         every period, on the loop's thread
//!                          │
//!                        ports ──> recording in memory, log for a file, newest snapshot for a viewer
//! ```
//! Frames: the scene's world is the part's rest frame at the start. If the handle holds the tool,
//! the part stays; if it holds the part, the tool stays, and contact is solved in the part's frame
//! all the same.

mod beside;
mod course;
mod drive;
pub mod fast;
pub mod handover;
mod held;
pub mod live;
pub mod log;
mod other;
mod overlap;
mod ports;
pub mod rates;
mod recording;
mod saturation;
pub mod slew;
pub mod slow;
mod snap;
mod tangent;
mod watch;

use std::path::Path;
use std::sync::mpsc::channel;
use std::time::Instant;

use device::driver::simulated::Model;
use device::{
    AsFastAsPossible, Clock, HandSettings, HapticDevice, Insertion, RealTime, Realtime, Script,
    Servo, ServoSettings, Simulated, SimulatedHand, SimulatedSettings,
};
use fem::Mesh;
use glam::DVec3;

use crate::Error;
use crate::engine::{Engine, StepReport};
use crate::prepare::PreparedPart;
use crate::shape::{self, Shape};
use course::{Answer, Course};
use drive::Drive;
use fast::FastSettings;
pub use held::{Gone, Held, Holds};
pub use overlap::{Clearance, refuse_overlap};
use ports::Ports;
pub use ports::{Sample, Snapshot, SnapshotInput, SnapshotOutput, TracePoint, snapshots};
use rates::{Rates, TwoRates, choose};
pub(crate) use recording::Entry;
pub use recording::{Record, Recording};
use slow::{SlowStep, Stepped};
pub use snap::{SnapPeak, SnapWatch};
pub(crate) use watch::StopOnDrop;

/// Servo periods between two evaluations of the whole surface: 60 Hz at 1 kHz.
const DISPLAY_INTERVAL: u64 = 16;

/// What a session needs beyond the engine.
#[derive(Clone, Debug)]
pub struct SessionSpec {
    /// The body that the device holds.
    pub held: Held,
    /// Whether the tool may start in the part.
    pub clearance: Clearance,
    /// Approach of the held body.
    pub direction: DVec3,
    /// m/s.
    pub speed: f64,
    /// m.
    pub travel: f64,
    /// s.
    pub hold_s: f64,
    /// Whether the hand pulls back afterwards.
    pub retract: bool,
    /// The hand.
    pub hand: HandSettings,
    /// The simulated device that it holds; `None`: the limits of a Virtuose 6D as the paper gives them, without a body.
    pub model: Option<&'static Model>,
    /// s.
    pub period_s: f64,
    /// Whether to wait for the real clock; with one rate the results are the same.
    pub real_time: bool,
    /// Whether whole steps are solved in the loop.
    pub rates: Rates,
}

/// Runs the script to its end.
///
/// # Errors
/// A script that the device cannot follow; a tool that overlaps the part at the start; an engine that ended on its
/// own beside the loop; Ctrl-C.
pub fn run(
    spec: &SessionSpec,
    prepared: &PreparedPart,
    engine: &mut Engine,
    shape: &mut Shape,
    progress: &dyn fem::Progress,
) -> Result<Recording, Error> {
    let mesh = &prepared.loaded.mesh;
    refuse_overlap(&spec.clearance, mesh, engine.tool(), &spec.held.tool_pose)?;
    let script = Script::new(&Insertion {
        start: spec.held.start(),
        direction: spec.direction,
        speed: spec.speed,
        travel: spec.travel,
        hold_s: spec.hold_s,
        retract: spec.retract,
    })?;
    let n_periods = script.periods(spec.period_s);
    let hand = SimulatedHand::new(spec.hand, script, spec.period_s)?;
    let mut device = match spec.model {
        None => Simulated::new(SimulatedSettings::default(), hand),
        Some(model) => Simulated::of_model(model, hand),
    }?;
    shape.follow(engine, spec.real_time);
    let rates = choose(spec, engine);
    let every = rates.every;
    let fast = FastSettings {
        period_s: spec.period_s,
        force_resolution: HapticDevice::limits(&device).force_resolution,
        lever: part_extent(mesh),
        n_ticks: n_periods as usize,
    };
    let settings = ServoSettings::for_limits(HapticDevice::limits(&device));
    let room = (n_periods as usize, engine.settings().max_contacts);
    let mut recording = Recording::with_room(spec.direction, room, rates);
    let mut session = Session {
        device: &mut device,
        course: Course {
            held: spec.held,
            mapped: None,
            other: None,
            saturation: None,
            rail: None,
            drive: Drive::Scripted { script, n_periods },
            ports: Ports::recording(&mut recording),
        },
        at_start: None,
        progress,
    };
    if spec.real_time {
        let mut servo = Servo::new(RealTime::new(spec.period_s)?, settings)?;
        let (viewer, view) = snapshots(engine.settings().max_contacts);
        session.course.ports.viewer = Some(viewer);
        let (granted, granted_by_system) = channel();
        session.at_start = Some(Box::new(move || {
            // Nobody listens where the session ended at once.
            let _ = granted.send(Realtime::ask());
        }));
        // The display has a thread of its own; there it may be late.
        let (seen, two) = watch::beside(view, shape, || {
            on_own_thread(|| match every {
                None => session.one_rate(&mut servo, engine, None).map(|()| None),
                Some(_) => session.two_rates_beside(&mut servo, engine, fast).map(Some),
            })
        })?;
        drop(session);
        recording.servo = servo.report();
        recording.two_rates = two;
        recording.granted = granted_by_system.try_recv().ok();
        seen.note(&mut recording);
    } else {
        let mut servo = Servo::new(AsFastAsPossible::new(spec.period_s)?, settings)?;
        let two = match every {
            None => session
                .one_rate(&mut servo, engine, Some(shape))
                .map(|()| None),
            Some(every) => session
                .stepped(&mut servo, every, engine, shape, fast)
                .map(Some),
        }?;
        drop(session);
        recording.servo = servo.report();
        recording.two_rates = two;
    }
    recording.device = device.events();
    Ok(recording)
}

/// Real-time priority is the loop's thread's alone; the rest of the program goes on as it was.
fn on_own_thread<T: Send>(work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("haptic loop".to_owned());
        let haptic = thread.spawn_scoped(scope, work).map_err(Error::io(
            Path::new("the haptic loop"),
            "start the thread of",
        ))?;
        // A fault in it is told as one of this thread.
        haptic
            .join()
            .unwrap_or_else(|fault| std::panic::resume_unwind(fault))
    })
}

/// A session that goes on.
struct Session<'a> {
    device: &'a mut dyn HapticDevice,
    course: Course<'a>,
    /// On the loop's thread, just before the first period.
    at_start: Option<Box<dyn FnOnce() + Send + 'a>>,
    progress: &'a dyn fem::Progress,
}

impl Session<'_> {
    /// The whole step in the loop. `shape`: is drawn between periods; only where no clock is waited for.
    fn one_rate<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        engine: &mut Engine,
        shape: Option<&mut Shape>,
    ) -> Result<(), Error> {
        let outcome = self.every_step(servo, engine, shape);
        servo.release(self.device);
        outcome
    }

    fn every_step<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        engine: &mut Engine,
        mut shape: Option<&mut Shape>,
    ) -> Result<(), Error> {
        self.begin();
        let mut period = 0;
        while self.course.drive.goes_on(period)? {
            let course = &mut self.course;
            let record = servo.step(self.device, |handle| {
                let handle = &course.in_world(handle);
                let begun = Instant::now();
                let report = engine.step(&course.target(handle));
                let answer = Answer {
                    report,
                    wrench_on_handle: course.wrench_on_handle(handle, &report),
                    step_ns: begun.elapsed().as_nanos() as u64,
                };
                course.tell(handle, answer, engine.active_contacts())
            })?;
            self.course.ports.over(&record);
            if let Some(shape) = &mut shape
                && period % DISPLAY_INTERVAL == 0
            {
                let multiply_ns = self.display(engine, shape)?;
                self.note_multiply(period, multiply_ns);
                self.tell_progress(period);
            }
            period += 1;
        }
        Ok(())
    }

    /// Two rates without a real clock: the engine works between two periods, and its result is due `every` later.
    fn stepped<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        every: u64,
        engine: &mut Engine,
        shape: &mut Shape,
        settings: FastSettings,
    ) -> Result<TwoRates, Error> {
        let start = self.course.held.target(&self.course.held.start());
        let mut stepped = Stepped::new(engine, &start, every, settings)?;
        let mut slow: Vec<SlowStep> = Vec::with_capacity(settings.n_ticks);
        let outcome = self.every_due(servo, &mut stepped, engine, shape, &mut slow);
        servo.release(self.device);
        outcome?;
        let two = TwoRates::new(stepped.into_fast().into_log(), slow);
        for step in &two.steps {
            if let Some(ns) = step.multiply_ns {
                self.note_multiply(step.tick, ns);
            }
        }
        Ok(two)
    }

    fn every_due<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        stepped: &mut Stepped,
        engine: &mut Engine,
        shape: &mut Shape,
        slow: &mut Vec<SlowStep>,
    ) -> Result<(), Error> {
        let mut shown = None;
        let mut period = 0;
        while self.course.drive.goes_on(period)? {
            let mut asked = None;
            let course = &mut self.course;
            let record = servo.step(self.device, |handle| {
                let handle = &course.in_world(handle);
                let target = course.target(handle);
                asked = Some(target);
                let begun = Instant::now();
                let on_handle = |report: &StepReport| course.wrench_on_handle(handle, report);
                let answer = stepped.tick(period, &target, on_handle);
                let answer = Answer::of_tick(&answer, begun);
                course.tell(handle, answer, stepped.fast().active_contacts())
            })?;
            self.course.ports.over(&record);
            let step = asked.and_then(|target| stepped.work(engine, period, &target));
            if let Some(mut step) = step {
                if is_display_due(&mut shown, period) {
                    step.multiply_ns = Some(self.display(engine, shape)?);
                    self.tell_progress(period);
                }
                slow.push(step);
            }
            period += 1;
        }
        Ok(())
    }

    fn begin(&mut self) {
        if let Some(at_start) = self.at_start.take() {
            at_start();
        }
    }

    /// What the display would do between two steps, and its time, ns.
    fn display(&mut self, engine: &Engine, shape: &mut Shape) -> Result<u64, Error> {
        let begun = Instant::now();
        let largest = shape::largest(shape.update(engine.active_contacts())?);
        let elapsed_ns = begun.elapsed().as_nanos() as u64;
        if let Some(tool_pose) = engine.tool_pose() {
            shape.look_ahead(tool_pose);
        }
        if let Some(recording) = &mut self.course.ports.recording {
            recording.see(largest);
        }
        Ok(elapsed_ns)
    }

    fn note_multiply(&mut self, period: u64, multiply_ns: u64) {
        if let Some(recording) = &mut self.course.ports.recording {
            recording.note_multiply(period, multiply_ns);
        }
    }

    fn tell_progress(&self, period: u64) {
        if let Some(total) = self.course.drive.n_periods() {
            self.progress
                .advance("insert", period as usize, total as usize);
        }
    }
}

/// Whether the display's interval is over since it was shown last; it is shown now then.
fn is_display_due(shown: &mut Option<u64>, tick: u64) -> bool {
    let is_due = shown.is_none_or(|last| tick >= last + DISPLAY_INTERVAL);
    if is_due {
        *shown = Some(tick);
    }
    is_due
}

/// m, diagonal of the part's bounding box.
pub fn part_extent(mesh: &Mesh) -> f64 {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for x in &mesh.nodes {
        for c in 0..3 {
            low[c] = low[c].min(x[c]);
            high[c] = high[c].max(x[c]);
        }
    }
    (0..3)
        .map(|c| (high[c] - low[c]).powi(2))
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests;

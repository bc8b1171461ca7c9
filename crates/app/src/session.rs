//! A headless session: a scripted hand on a simulated device pushes the tool onto the part, and
//! every step is recorded.
//!
//! Frames: the scene's world is the part's rest frame at the start. If the handle holds the tool,
//! the part stays; if it holds the part, the tool stays, and contact is solved in the part's frame
//! all the same.

mod beside;
pub mod fast;
pub mod handover;
mod held;
mod overlap;
pub mod rates;
mod recorder;
pub mod slew;
pub mod slow;

use std::ops::Range;
use std::time::Instant;

use device::{
    AsFastAsPossible, Clock, HandSettings, HapticDevice, Insertion, Phase, RealTime, Script, Servo,
    ServoReport, ServoSettings, Simulated, SimulatedEvents, SimulatedHand, SimulatedSettings,
    Wrench,
};
use fem::Mesh;
use glam::DVec3;
use glamx::DPose3;

use crate::engine::{ActiveContact, Engine, StepReport};
use crate::prepare::PreparedPart;
use crate::shape::{self, Shape};
use crate::{Error, interrupt};
use fast::FastSettings;
pub use held::{Held, Holds};
pub use overlap::{Clearance, refuse_overlap};
use rates::{ChosenRates, Rates, TwoRates, choose};
use recorder::{Recorder, Solved};
use slow::{SlowStep, Stepped};

/// Servo periods between two evaluations of the whole surface: 60 Hz at 1 kHz.
const DISPLAY_INTERVAL: u64 = 16;

/// One recorded period.
#[derive(Clone, Debug)]
pub struct Record {
    /// Number of the period.
    pub step: u64,
    /// s, of the loop's clock.
    pub time_s: f64,
    /// What the hand is doing.
    pub phase: Phase,
    /// Handle in the world.
    pub handle_pose: DPose3,
    /// m, of the held body in the simulation, along the approach direction.
    pub travel: f64,
    /// m, of its grip across that direction.
    pub sideways: f64,
    /// rad, of the held body from how it stood at the start.
    pub turn: f64,
    /// On the handle, about the handle point, world; what the engine gives, before the device's
    /// limits and resolution.
    pub wrench_on_handle: Wrench,
    /// The step.
    pub report: StepReport,
    /// ns, the whole step.
    pub step_ns: u64,
    /// ns, the surface multiply, in periods that had one.
    pub multiply_ns: Option<u64>,
    contacts: Range<usize>,
}

/// Everything a session leaves behind.
#[derive(Debug)]
pub struct Recording {
    /// By period.
    pub records: Vec<Record>,
    /// Unit vector, world.
    pub direction: DVec3,
    /// Periods, misses and times of the loop.
    pub servo: ServoReport,
    /// What the simulated hardware limited.
    pub device: SimulatedEvents,
    /// Largest displacement of a surface node, m, seen at display rate.
    pub max_surface_displacement: f64,
    /// Whether whole steps were solved in the loop, and why.
    pub rates: ChosenRates,
    /// What two rates tell, if there were two.
    pub two_rates: Option<TwoRates>,
    contacts: Vec<ActiveContact>,
}

/// What a record is made of, besides the step itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// s, of the loop's clock; 0 without one.
    pub(crate) time_s: f64,
    pub(crate) phase: Phase,
    pub(crate) handle_pose: DPose3,
    pub(crate) wrench_on_handle: Wrench,
    pub(crate) step_ns: u64,
}

impl Recording {
    /// An empty one with memory for so many records. `direction`: of any length but zero.
    pub(crate) fn with_room(direction: DVec3, n_records: usize, rates: ChosenRates) -> Self {
        Self {
            records: Vec::with_capacity(n_records),
            direction: direction.normalize(),
            servo: ServoReport::default(),
            device: SimulatedEvents::default(),
            max_surface_displacement: 0.0,
            rates,
            two_rates: None,
            contacts: Vec::with_capacity(64 * n_records),
        }
    }

    /// Adds a record. Does not allocate within the memory that was asked for.
    pub(crate) fn push(
        &mut self,
        entry: &Entry,
        held: &Held,
        report: &StepReport,
        contacts: &[ActiveContact],
    ) {
        let (body, start) = (held.pose(&report.tool_pose), held.start());
        let moved = body.translation - start.translation;
        let contacts_from = self.contacts.len();
        self.contacts.extend_from_slice(contacts);
        self.records.push(Record {
            step: self.records.len() as u64,
            time_s: entry.time_s,
            phase: entry.phase,
            handle_pose: entry.handle_pose,
            travel: moved.dot(self.direction),
            sideways: (moved - self.direction * moved.dot(self.direction)).length(),
            turn: body.rotation.angle_between(start.rotation),
            wrench_on_handle: entry.wrench_on_handle,
            report: *report,
            step_ns: entry.step_ns,
            multiply_ns: None,
            contacts: contacts_from..self.contacts.len(),
        });
    }

    /// Contacts that carried force in a record.
    pub fn contacts(&self, record: &Record) -> &[ActiveContact] {
        &self.contacts[record.contacts.clone()]
    }

    /// N, along the approach direction, positive when it resists.
    pub fn resistance(&self, record: &Record) -> f64 {
        -record.wrench_on_handle.force.dot(self.direction)
    }
}

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
    let start = spec.held.start();
    let script = Script::new(&Insertion {
        start,
        direction: spec.direction,
        speed: spec.speed,
        travel: spec.travel,
        hold_s: spec.hold_s,
        retract: spec.retract,
    })?;
    let n_periods = script.periods(spec.period_s);
    let hand = SimulatedHand::new(spec.hand, script, spec.period_s)?;
    let device = Simulated::new(SimulatedSettings::default(), hand)?;
    shape.follow(spec.real_time);
    let rates = choose(spec, engine);
    if spec.real_time && rates.every.is_none() {
        // The display is in the loop then.
        shape.never_wait();
    }
    let fast = FastSettings {
        period_s: spec.period_s,
        force_resolution: HapticDevice::limits(&device).force_resolution,
        lever: part_extent(&prepared.loaded.mesh),
        n_ticks: n_periods as usize,
    };
    let every = rates.every;
    let session = Session {
        recorder: Recorder::new(spec, script, n_periods, rates),
        device,
        n_periods,
        progress,
    };
    let settings = ServoSettings::for_limits(HapticDevice::limits(&session.device));
    match (spec.real_time, every) {
        (false, None) => {
            let servo = Servo::new(AsFastAsPossible::new(spec.period_s)?, settings)?;
            session.run_one_rate(servo, engine, shape)
        }
        (true, None) => {
            let servo = Servo::new(RealTime::new(spec.period_s)?, settings)?;
            session.run_one_rate(servo, engine, shape)
        }
        (false, Some(every)) => {
            let servo = Servo::new(AsFastAsPossible::new(spec.period_s)?, settings)?;
            session.run_stepped(servo, every, engine, shape, fast)
        }
        (true, Some(_)) => {
            let servo = Servo::new(RealTime::new(spec.period_s)?, settings)?;
            session.run_beside(servo, engine, shape, fast)
        }
    }
}

struct Session<'a> {
    recorder: Recorder<'a>,
    device: Simulated,
    n_periods: u64,
    progress: &'a dyn fem::Progress,
}

impl Session<'_> {
    /// The whole step in the loop.
    fn run_one_rate<C: Clock>(
        mut self,
        mut servo: Servo<C>,
        engine: &mut Engine,
        shape: &mut Shape,
    ) -> Result<Recording, Error> {
        for period in 0..self.n_periods {
            if interrupt::is_requested() {
                servo.release(&mut self.device);
                return Err(Error::Interrupted);
            }
            let recorder = &mut self.recorder;
            servo.step(&mut self.device, |handle| {
                let begun = Instant::now();
                let report = engine.step(&recorder.target(handle));
                let step_ns = begun.elapsed().as_nanos() as u64;
                let wrench = recorder.wrench_on_handle(handle, &report);
                let solved = Solved {
                    report,
                    wrench_on_handle: wrench,
                    step_ns,
                };
                recorder.push(handle, &solved, engine.active_contacts());
                wrench
            })?;
            if period % DISPLAY_INTERVAL == 0 {
                let multiply_ns = self.recorder.display(engine, shape)?;
                self.recorder.note_multiply(period, multiply_ns);
                self.tell_progress(period);
            }
        }
        servo.release(&mut self.device);
        Ok(self.recorder.finish(&servo.report(), &self.device))
    }

    /// Two rates without a real clock: the engine works between two periods, and its result is due `every` later.
    fn run_stepped<C: Clock>(
        mut self,
        mut servo: Servo<C>,
        every: u64,
        engine: &mut Engine,
        shape: &mut Shape,
        settings: FastSettings,
    ) -> Result<Recording, Error> {
        let start = self.recorder.start_target();
        let mut stepped = Stepped::new(engine, &start, every, settings)?;
        let mut slow: Vec<SlowStep> = Vec::with_capacity(self.n_periods as usize);
        let mut shown = None;
        for period in 0..self.n_periods {
            if interrupt::is_requested() {
                servo.release(&mut self.device);
                return Err(Error::Interrupted);
            }
            let recorder = &mut self.recorder;
            let mut asked = None;
            servo.step(&mut self.device, |handle| {
                let target = recorder.target(handle);
                asked = Some(target);
                recorder.fast_tick(handle, |on_handle| {
                    let answer = stepped.tick(period, &target, on_handle);
                    (answer, stepped.fast().active_contacts())
                })
            })?;
            let Some(mut step) = asked.and_then(|target| stepped.work(engine, period, &target))
            else {
                continue;
            };
            if is_display_due(&mut shown, period) {
                step.multiply_ns = Some(self.recorder.display(engine, shape)?);
                self.tell_progress(period);
            }
            slow.push(step);
        }
        servo.release(&mut self.device);
        let log = stepped.into_fast().into_log();
        self.recorder.two_rates(TwoRates::new(log, slow));
        Ok(self.recorder.finish(&servo.report(), &self.device))
    }

    fn tell_progress(&self, period: u64) {
        let total = self.n_periods as usize;
        self.progress.advance("insert", period as usize, total);
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

/// What the display would do between two steps: the whole surface. Its largest displacement, m, and the time, ns.
fn timed_display(engine: &mut Engine, shape: &mut Shape) -> Result<(f64, u64), Error> {
    let begun = Instant::now();
    let largest = shape::largest(shape.update(engine)?);
    let elapsed_ns = begun.elapsed().as_nanos() as u64;
    shape.look_ahead(engine);
    Ok((largest, elapsed_ns))
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

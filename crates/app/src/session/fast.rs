//! One tick of the loop where the engine runs beside it: the frozen problem solved for the newest target, what
//! hand-overs changed faded, and a stale answer faded out.

use std::time::{Duration, Instant};

use device::{DeviceError, Watchdog, Wrench};
use glamx::DPose3;

use super::handover::Handed;
use super::slew::Slew;
use crate::engine::{ActiveContact, StepReport};

/// Age of a problem's target at which its wrench begins to fade, s, and the time in which it is gone.
pub const STALE_S: f64 = 0.1;
const FADE_OUT_S: f64 = 0.05;

/// What a fast loop is made for.
#[derive(Clone, Copy, Debug)]
pub struct FastSettings {
    /// s.
    pub period_s: f64,
    /// N, smallest change that the device renders; 0: none stated.
    pub force_resolution: f64,
    /// m, divides torques to compare them with forces.
    pub lever: f64,
    /// Periods that are expected: so many hand-overs are logged without taking memory.
    pub n_ticks: usize,
}

/// One problem taking the place of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandOver {
    /// Period in which the new problem was first used.
    pub tick: u64,
    /// Age of the new problem's target then, periods.
    pub age: u64,
    /// Age that the old problem's target had reached, periods.
    pub replaced_at_age: u64,
    /// N, by how much the two differ at the target of that period (torques by the lever).
    pub difference: f64,
}

/// What a fast loop tells at its end.
#[derive(Clone, Debug, Default)]
pub struct FastLog {
    /// In order of time.
    pub hand_overs: Vec<HandOver>,
    /// Periods, the highest age of a target whose problem was used.
    pub max_staleness: u64,
    /// Periods in which a node without a row may have come into contact.
    pub beyond_margin: u64,
    /// Periods in which a stale wrench was faded.
    pub faded: u64,
}

/// One period's answer.
#[derive(Debug)]
pub struct Tick {
    /// Of the frozen problem's answer; see [`Prediction`](crate::engine::Prediction).
    pub report: StepReport,
    /// To be rendered, about the handle point, world.
    pub wrench_on_handle: Wrench,
    /// Age of the problem's target, periods.
    pub staleness: u64,
    /// The problem that is not needed any more.
    pub spent: Option<Box<Handed>>,
}

/// The state between periods.
#[derive(Debug)]
pub struct FastLoop {
    handed: Box<Handed>,
    slew: Slew,
    watchdog: Watchdog,
    period_s: f64,
    last_force: f64,
    /// Of a period, what a tick may take before it ends with the best answer found; `None`: no clock is read.
    share: Option<f64>,
    log: FastLog,
}

impl FastLoop {
    /// A loop that begins with the problem of the start.
    ///
    /// # Errors
    /// None with a period that a clock accepts.
    pub fn new(first: Box<Handed>, settings: FastSettings) -> Result<Self, DeviceError> {
        Ok(Self {
            handed: first,
            slew: Slew::new(settings.period_s, settings.force_resolution, settings.lever),
            watchdog: Watchdog::new(STALE_S, FADE_OUT_S)?,
            period_s: settings.period_s,
            last_force: 0.0,
            share: None,
            log: FastLog {
                hand_overs: Vec::with_capacity(settings.n_ticks),
                ..FastLog::default()
            },
        })
    }

    /// Where the clock is real: a tick is over in half a period, whatever answer there is then.
    #[must_use]
    pub fn in_real_time(self) -> Self {
        /// The rest is for the device, and for what the bound does not hold: gaps, and the last step of the solver.
        const SHARE: f64 = 0.5;
        Self {
            share: Some(SHARE),
            ..self
        }
    }

    /// Contacts of the last answer.
    pub fn active_contacts(&self) -> &[ActiveContact] {
        self.handed.problem.active_contacts()
    }

    /// Hand-overs, staleness and validity so far.
    pub fn log(&self) -> &FastLog {
        &self.log
    }

    /// The log, with its memory.
    pub fn into_log(self) -> FastLog {
        self.log
    }

    /// Answers a target. `arrived`: a new problem, if one came. `on_handle`: the wrench on the handle of an answer.
    ///
    /// Does not allocate, lock, log or block, and reads no clock but [in real time](Self::in_real_time).
    pub fn tick(
        &mut self,
        tick: u64,
        target: &DPose3,
        arrived: Option<Box<Handed>>,
        on_handle: impl Fn(&StepReport) -> Wrench,
    ) -> Tick {
        let deadline = self
            .share
            .map(|share| Instant::now() + Duration::from_secs_f64(share * self.period_s));
        let spent = arrived.map(|mut new| {
            new.problem.answer_by(deadline);
            self.handed.problem.answer_by(deadline);
            self.hand_over(tick, target, new, &on_handle)
        });
        self.handed.problem.answer_by(deadline);
        let staleness = self.age(tick);
        let gain = self.gain(tick);
        let prediction = self.handed.problem.solve(target);
        let predicted = on_handle(&prediction.report) * gain;
        let wrench_on_handle = predicted + self.slew.fade(self.last_force);
        self.last_force = wrench_on_handle.force.length();
        self.log.max_staleness = self.log.max_staleness.max(staleness);
        self.log.beyond_margin += u64::from(!prediction.is_within);
        self.log.faded += u64::from(gain < 1.0);
        Tick {
            report: prediction.report,
            wrench_on_handle,
            staleness,
            spent,
        }
    }

    /// Puts the new problem in the place of the old one, which is returned.
    fn hand_over(
        &mut self,
        tick: u64,
        target: &DPose3,
        new: Box<Handed>,
        on_handle: &impl Fn(&StepReport) -> Wrench,
    ) -> Box<Handed> {
        let replaced_at_age = self.age(tick);
        let old = on_handle(&self.handed.problem.solve(target).report);
        let rendered = old * self.gain(tick) + self.slew.left();
        let spent = std::mem::replace(&mut self.handed, new);
        let new = on_handle(&self.handed.problem.solve(target).report);
        self.slew.hand_over(rendered - new * self.gain(tick));
        // Never takes memory: there is room for one in each period.
        if self.log.hand_overs.len() < self.log.hand_overs.capacity() {
            self.log.hand_overs.push(HandOver {
                tick,
                age: self.age(tick),
                replaced_at_age,
                difference: self.slew.size(&(old - new)),
            });
        }
        spent
    }

    /// Periods since the target of the problem in use.
    fn age(&self, tick: u64) -> u64 {
        tick.saturating_sub(self.handed.tick)
    }

    fn gain(&self, tick: u64) -> f64 {
        self.watchdog
            .gain_at_age(self.age(tick) as f64 * self.period_s)
    }
}

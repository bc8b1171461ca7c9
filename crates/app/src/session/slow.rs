//! The engine's side of two rates: a whole step, frozen and handed over; every N periods without a real clock, or on
//! a thread of its own beside the loop.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use device::{DeviceError, Wrench};
use glamx::DPose3;

use super::fast::{FastLoop, FastSettings, Tick};
use super::handover::{EngineEnd, Handed};
use crate::engine::{Engine, StepReport};

/// Of the way of the tool since the step before, from how far around nodes get a row: a problem is used until twice as
/// many periods have gone by.
const REACH_SHARE: f64 = 2.0;

/// Of the distance at which nodes get a plane, the same at rest.
const REACH_AT_REST: f64 = 3.0;

/// Time between two looks for a new target, s; a twentieth of a period at 1 kHz.
const LOOK_S: f64 = 50e-6;

/// A whole step whose result was handed over.
#[derive(Clone, Copy, Debug)]
pub struct SlowStep {
    /// Period whose target it was solved for.
    pub tick: u64,
    /// The step.
    pub report: StepReport,
    /// ns, the step.
    pub step_ns: u64,
    /// ns, freezing it.
    pub freeze_ns: u64,
    /// Rows of the frozen problem.
    pub n_rows: u32,
    /// ns, the surface multiply, in steps that had one.
    pub multiply_ns: Option<u64>,
}

/// A whole step for a target, frozen into `handed`. `last_target`: of the step before.
pub fn solve_and_freeze(
    engine: &mut Engine,
    tick: u64,
    target: &DPose3,
    last_target: &DPose3,
    handed: &mut Handed,
) -> SlowStep {
    let begun = Instant::now();
    let report = engine.step(target);
    let stepped = begun.elapsed();
    let near = engine.settings().near_distance;
    let moved = engine.motion(last_target, target);
    let reach = (near + REACH_SHARE * moved).max(REACH_AT_REST * near);
    engine.freeze_into(&report, reach, &mut handed.problem);
    handed.tick = tick;
    SlowStep {
        tick,
        report,
        step_ns: stepped.as_nanos() as u64,
        freeze_ns: (begun.elapsed() - stepped).as_nanos() as u64,
        n_rows: handed.problem.n_rows() as u32,
        multiply_ns: None,
    }
}

/// Two rates without a real clock: the result for the target of period k is there in period k + `every`, and then
/// the next begins. Which numbers come out depends on no clock.
#[derive(Debug)]
pub struct Stepped {
    fast: FastLoop,
    every: u64,
    pending: Option<Box<Handed>>,
    spare: Option<Box<Handed>>,
    last_target: DPose3,
}

impl Stepped {
    /// `start`: the first target; nothing is felt there before its result is due.
    ///
    /// # Errors
    /// As [`FastLoop::new`].
    pub fn new(
        engine: &mut Engine,
        start: &DPose3,
        every: u64,
        settings: FastSettings,
    ) -> Result<Self, DeviceError> {
        let mut first = empty(engine);
        solve_and_freeze(engine, 0, start, start, &mut first);
        Ok(Self {
            fast: FastLoop::new(first, settings)?,
            every: every.max(1),
            pending: None,
            spare: Some(empty(engine)),
            last_target: *start,
        })
    }

    /// The loop's state.
    pub fn fast(&self) -> &FastLoop {
        &self.fast
    }

    /// The loop's state, at the end.
    pub fn into_fast(self) -> FastLoop {
        self.fast
    }

    /// One tick; takes over what is due.
    pub fn tick(
        &mut self,
        tick: u64,
        target: &DPose3,
        on_handle: impl Fn(&StepReport) -> Wrench,
    ) -> Tick {
        let is_due = tick.is_multiple_of(self.every);
        let arrived = if is_due { self.pending.take() } else { None };
        let mut answer = self.fast.tick(tick, target, arrived, on_handle);
        if answer.spent.is_some() {
            self.spare = answer.spent.take();
        }
        answer
    }

    /// The engine's work of a period, after its tick; nothing in most.
    pub fn work(&mut self, engine: &mut Engine, tick: u64, target: &DPose3) -> Option<SlowStep> {
        if !tick.is_multiple_of(self.every) {
            return None;
        }
        // Two go round: what was on its way is in use now, and what was in use is free.
        let mut handed = self.spare.take()?;
        let step = solve_and_freeze(engine, tick, target, &self.last_target, &mut handed);
        self.last_target = *target;
        self.pending = Some(handed);
        Some(step)
    }
}

/// A box for a problem.
pub fn empty(engine: &Engine) -> Box<Handed> {
    Box::new(Handed {
        tick: 0,
        problem: engine.frozen_problem(),
    })
}

/// The thread beside the loop: answers the newest target until `stop`.
pub fn work_beside(
    mut end: EngineEnd,
    stop: &AtomicBool,
    mut solve: impl FnMut(u64, &DPose3, &mut Handed),
) {
    let mut held = None;
    while !stop.load(Ordering::Relaxed) {
        held = held.or_else(|| end.take_empty());
        let asked = held.as_ref().and_then(|_| end.newest_target());
        match (asked, held.take()) {
            (Some(asked), Some(mut handed)) => {
                solve(asked.tick, &asked.target, &mut handed);
                end.hand_over(handed);
            }
            (_, nothing_to_do) => {
                held = nothing_to_do;
                std::thread::sleep(Duration::from_secs_f64(LOOK_S));
            }
        }
    }
}

//! Two rates in real time: the loop on this thread, the engine on one of its own.

use std::sync::atomic::{AtomicBool, Ordering};

use device::{Clock, Servo};
use glamx::DPose3;

use super::fast::{FastLog, FastLoop, FastSettings};
use super::handover::{Asked, Handed, N_BOXES, link};
use super::rates::TwoRates;
use super::slow::{self, solve_and_freeze, work_beside};
use super::{DISPLAY_INTERVAL, Recording, Session, is_display_due, timed_display};
use crate::engine::Engine;
use crate::shape::Shape;
use crate::{Error, interrupt};

impl Session<'_> {
    /// Two rates in real time: the engine on a thread of its own.
    pub(super) fn run_beside<C: Clock>(
        mut self,
        mut servo: Servo<C>,
        engine: &mut Engine,
        shape: &mut Shape,
        settings: FastSettings,
    ) -> Result<Recording, Error> {
        let start = self.recorder.start_target();
        let mut first = slow::empty(engine);
        solve_and_freeze(engine, 0, &start, &start, &mut first);
        let boxes = std::array::from_fn(|_| slow::empty(engine));
        let fast = FastLoop::new(first, settings)?;
        let mut slow_steps = Vec::with_capacity(self.n_periods as usize);
        let mut largest = 0.0_f64;
        let mut failed = None;
        let mut shown = None;
        let mut last_target = start;
        let solve = |tick: u64, target: &DPose3, handed: &mut Handed| {
            let mut step = solve_and_freeze(engine, tick, target, &last_target, handed);
            last_target = *target;
            if is_display_due(&mut shown, tick) {
                match timed_display(engine, shape) {
                    Ok((size, ns)) => {
                        largest = largest.max(size);
                        step.multiply_ns = Some(ns);
                    }
                    Err(error) => failed = Some(error),
                }
            }
            slow_steps.push(step);
        };
        let log = self.beside(&mut servo, fast, boxes, solve)?;
        if let Some(error) = failed {
            return Err(error);
        }
        self.recorder.see(largest);
        self.recorder.two_rates(TwoRates::new(log, slow_steps));
        Ok(self.recorder.finish(&servo.report(), &self.device))
    }

    /// The loop with `solve` on a thread beside it; the device is released however this ends.
    pub(super) fn beside<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        mut fast: FastLoop,
        boxes: [Box<Handed>; N_BOXES],
        solve: impl FnMut(u64, &DPose3, &mut Handed) + Send,
    ) -> Result<FastLog, Error> {
        let (mut loop_end, engine_end) = link(boxes, MOST_UNANSWERED);
        let stop = AtomicBool::new(false);
        let device = &mut self.device;
        std::thread::scope(|scope| {
            // Also where the loop panics: a thread that nobody stops is waited for for ever.
            let stop = StopOnDrop(&stop);
            let flag = stop.0;
            let worker = scope.spawn(move || work_beside(engine_end, flag, solve));
            let mut outcome = Ok(());
            for period in 0..self.n_periods {
                if interrupt::is_requested() {
                    outcome = Err(Error::Interrupted);
                } else if worker.is_finished() {
                    outcome = Err(Error::EngineEnded);
                }
                if outcome.is_err() {
                    break;
                }
                let recorder = &mut self.recorder;
                let stepped = servo.step(device, |handle| {
                    let target = recorder.target(handle);
                    // Where there is no room the last answer is stale and has faded.
                    let tick = period;
                    loop_end.ask(Asked { tick, target });
                    let arrived = loop_end.newest();
                    recorder.fast_tick(handle, |on_handle| {
                        let mut answer = fast.tick(period, &target, arrived, on_handle);
                        if let Some(spent) = answer.spent.take() {
                            loop_end.give_back(spent);
                        }
                        (answer, fast.active_contacts())
                    })
                });
                if let Err(error) = stepped {
                    outcome = Err(error.into());
                    break;
                }
                if period % DISPLAY_INTERVAL == 0 {
                    let total = self.n_periods as usize;
                    self.progress.advance("insert", period as usize, total);
                }
            }
            servo.release(device);
            drop(stop);
            let joined = worker.join();
            outcome?;
            joined.map_err(|_| Error::EngineEnded)
        })?;
        Ok(fast.into_log())
    }
}

/// Targets that the engine has not taken yet, for which there is room: some seconds of them at 1 kHz.
const MOST_UNANSWERED: usize = 4096;

/// Tells the thread beside the loop to end.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

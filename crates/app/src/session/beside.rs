//! Two rates in real time: the loop on this thread, the engine on one of its own.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use device::{Clock, Servo};
use glamx::DPose3;

use super::fast::{FastLog, FastLoop, FastSettings};
use super::handover::{Asked, Handed, LoopEnd, N_BOXES, link};
use super::rates::TwoRates;
use super::slow::{self, solve_and_freeze, work_beside};
use super::watch::StopOnDrop;
use super::{Answer, DISPLAY_INTERVAL, Session};
use crate::Error;
use crate::engine::{Engine, StepReport};

impl Session<'_> {
    /// Two rates in real time: the engine on a thread of its own. Of its steps as many are kept as there are ticks in
    /// the settings.
    pub(super) fn two_rates_beside<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        engine: &mut Engine,
        settings: FastSettings,
    ) -> Result<TwoRates, Error> {
        let start = self.course.held.target(&self.course.held.start());
        let mut first = slow::empty(engine);
        solve_and_freeze(engine, 0, &start, &start, &mut first);
        let boxes = std::array::from_fn(|_| slow::empty(engine));
        let fast = FastLoop::new(first, settings)?.in_real_time();
        let mut slow_steps = Vec::with_capacity(settings.n_ticks);
        let mut last_target = start;
        let solve = |tick: u64, target: &DPose3, handed: &mut Handed| {
            let step = solve_and_freeze(engine, tick, target, &last_target, handed);
            last_target = *target;
            if slow_steps.len() < slow_steps.capacity() {
                slow_steps.push(step);
            }
        };
        let log = self.beside(servo, fast, boxes, solve)?;
        Ok(TwoRates::new(log, slow_steps))
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
        std::thread::scope(|scope| {
            // Also where the loop panics: a thread that nobody stops is waited for for ever.
            let stop = StopOnDrop(&stop);
            let flag = stop.0;
            let worker = scope.spawn(move || work_beside(engine_end, flag, solve));
            let is_alive = || !worker.is_finished();
            let outcome = self.every_tick(servo, &mut fast, &mut loop_end, is_alive);
            servo.release(self.device);
            drop(stop);
            let joined = worker.join();
            outcome?;
            joined.map_err(|_| Error::EngineEnded)
        })?;
        Ok(fast.into_log())
    }

    fn every_tick<C: Clock>(
        &mut self,
        servo: &mut Servo<C>,
        fast: &mut FastLoop,
        loop_end: &mut LoopEnd,
        is_alive: impl Fn() -> bool,
    ) -> Result<(), Error> {
        self.begin();
        let mut tick = 0;
        while self.course.drive.goes_on(tick)? {
            if !is_alive() {
                return Err(Error::EngineEnded);
            }
            let course = &mut self.course;
            let record = servo.step(self.device, |handle| {
                let handle = &course.in_world(handle);
                let target = course.target(handle);
                // Where there is no room the last answer is stale and has faded.
                loop_end.ask(Asked { tick, target });
                let begun = Instant::now();
                let on_handle = |report: &StepReport| course.wrench_on_handle(handle, report);
                let mut answer = fast.tick(tick, &target, loop_end.newest(), on_handle);
                if let Some(spent) = answer.spent.take() {
                    loop_end.give_back(spent);
                }
                let answer = Answer::of_tick(&answer, begun);
                course.tell(handle, answer, fast.active_contacts())
            })?;
            self.course.ports.over(&record);
            if tick % DISPLAY_INTERVAL == 0 {
                self.tell_progress(tick);
            }
            tick += 1;
        }
        Ok(())
    }
}

/// Targets that the engine has not taken yet, for which there is room: some seconds of them at 1 kHz.
const MOST_UNANSWERED: usize = 4096;

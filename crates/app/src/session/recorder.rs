//! Frames and records: what every way of running a session shares.

use std::time::Instant;

use device::{HandleState, Script, ServoReport, Simulated, Wrench};
use glamx::DPose3;

use super::fast::Tick;
use super::rates::{ChosenRates, TwoRates};
use super::{Entry, Recording, SessionSpec, timed_display};
use crate::Error;
use crate::engine::{ActiveContact, Engine, Stage, StepReport};
use crate::shape::Shape;

/// What a period gave.
pub(super) struct Solved {
    pub(super) report: StepReport,
    pub(super) wrench_on_handle: Wrench,
    pub(super) step_ns: u64,
}

pub(super) struct Recorder<'a> {
    spec: &'a SessionSpec,
    script: Script,
    recording: Recording,
}

impl<'a> Recorder<'a> {
    /// All memory is reserved here.
    pub(super) fn new(
        spec: &'a SessionSpec,
        script: Script,
        n_periods: u64,
        rates: ChosenRates,
    ) -> Self {
        Self {
            spec,
            script,
            recording: Recording::with_room(spec.direction, n_periods as usize, rates),
        }
    }

    /// Pose of the tool that the handle asks for, in the part's frame.
    pub(super) fn target(&self, handle: &HandleState) -> DPose3 {
        self.spec.held.target(&handle.pose)
    }

    /// The same at the start.
    pub(super) fn start_target(&self) -> DPose3 {
        self.spec.held.target(&self.spec.held.start())
    }

    /// On the handle about its point, world.
    pub(super) fn wrench_on_handle(&self, handle: &HandleState, report: &StepReport) -> Wrench {
        self.spec.held.wrench_on_handle(&handle.pose, report)
    }

    /// A tick of the fast loop and its record. `solve` is given what makes a wrench on the handle of a report.
    pub(super) fn fast_tick<'c>(
        &mut self,
        handle: &HandleState,
        solve: impl FnOnce(&dyn Fn(&StepReport) -> Wrench) -> (Tick, &'c [ActiveContact]),
    ) -> Wrench {
        let begun = Instant::now();
        let held = &self.spec.held;
        let (answer, contacts) = solve(&|report| held.wrench_on_handle(&handle.pose, report));
        let step_ns = begun.elapsed().as_nanos() as u64;
        let mut report = answer.report;
        report.stage_ns[Stage::Lcp as usize] = step_ns;
        let solved = Solved {
            report,
            wrench_on_handle: answer.wrench_on_handle,
            step_ns,
        };
        self.push(handle, &solved, contacts);
        answer.wrench_on_handle
    }

    /// Adds a record.
    pub(super) fn push(
        &mut self,
        handle: &HandleState,
        solved: &Solved,
        contacts: &[ActiveContact],
    ) {
        let entry = Entry {
            time_s: handle.time_s,
            phase: self.script.phase(handle.time_s),
            handle_pose: handle.pose,
            wrench_on_handle: solved.wrench_on_handle,
            step_ns: solved.step_ns,
        };
        self.recording
            .push(&entry, &self.spec.held, &solved.report, contacts);
    }

    /// What the display would do between two steps, and its time, ns.
    pub(super) fn display(&mut self, engine: &mut Engine, shape: &mut Shape) -> Result<u64, Error> {
        let (largest, elapsed_ns) = timed_display(engine, shape)?;
        self.see(largest);
        Ok(elapsed_ns)
    }

    /// A displacement of the surface, m.
    pub(super) fn see(&mut self, largest: f64) {
        let seen = &mut self.recording.max_surface_displacement;
        *seen = seen.max(largest);
    }

    /// The surface multiply of a period took so long.
    pub(super) fn note_multiply(&mut self, period: u64, multiply_ns: u64) {
        if let Some(record) = self.recording.records.get_mut(period as usize) {
            record.multiply_ns = Some(multiply_ns);
        }
    }

    /// What two rates told.
    pub(super) fn two_rates(&mut self, two: TwoRates) {
        for step in &two.steps {
            if let Some(ns) = step.multiply_ns {
                self.note_multiply(step.tick, ns);
            }
        }
        self.recording.two_rates = Some(two);
    }

    /// The recording, at the end.
    pub(super) fn finish(mut self, servo: &ServoReport, device: &Simulated) -> Recording {
        self.recording.servo = *servo;
        self.recording.device = device.events();
        self.recording
    }
}

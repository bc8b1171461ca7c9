//! Frames and records: what every way of running a session shares.

use std::time::Instant;

use device::{HandleState, Script, ServoReport, Simulated, SimulatedEvents, Wrench};
use glam::DVec3;
use glamx::DPose3;

use super::fast::Tick;
use super::rates::{ChosenRates, TwoRates};
use super::{Holds, Record, Recording, SessionSpec, timed_display};
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
    /// Of the handle.
    start: DPose3,
    recording: Recording,
}

impl<'a> Recorder<'a> {
    /// All memory is reserved here.
    pub(super) fn new(
        spec: &'a SessionSpec,
        script: Script,
        start: DPose3,
        n_periods: u64,
        rates: ChosenRates,
    ) -> Self {
        Self {
            spec,
            script,
            start,
            recording: Recording {
                records: Vec::with_capacity(n_periods as usize),
                direction: spec.direction.normalize(),
                servo: ServoReport::default(),
                device: SimulatedEvents::default(),
                max_surface_displacement: 0.0,
                rates,
                two_rates: None,
                contacts: Vec::with_capacity(64 * n_periods as usize),
                bubbles: Vec::new(),
            },
        }
    }

    /// Pose of the tool that the handle asks for, in the part's frame.
    pub(super) fn target(&self, handle: &HandleState) -> DPose3 {
        target(self.spec, &handle.pose)
    }

    /// The same at the start.
    pub(super) fn start_target(&self) -> DPose3 {
        target(self.spec, &self.start)
    }

    /// On the handle about its point, world.
    pub(super) fn wrench_on_handle(&self, handle: &HandleState, report: &StepReport) -> Wrench {
        wrench_on_handle(self.spec, handle, report)
    }

    /// A tick of the fast loop and its record. `solve` is given what makes a wrench on the handle of a report.
    pub(super) fn fast_tick<'c>(
        &mut self,
        handle: &HandleState,
        solve: impl FnOnce(&dyn Fn(&StepReport) -> Wrench) -> (Tick, &'c [ActiveContact]),
    ) -> Wrench {
        let begun = Instant::now();
        let spec = self.spec;
        let (answer, contacts) = solve(&|report| wrench_on_handle(spec, handle, report));
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
        let held = match self.spec.holds {
            Holds::Tool => solved.report.tool_pose,
            Holds::Part => self.spec.tool_pose * solved.report.tool_pose.inverse(),
        };
        let recording = &mut self.recording;
        let contacts_from = recording.contacts.len();
        recording.contacts.extend_from_slice(contacts);
        recording.records.push(Record {
            step: recording.records.len() as u64,
            time_s: handle.time_s,
            phase: self.script.phase(handle.time_s),
            handle_pose: handle.pose,
            travel: (held.translation - self.start.translation).dot(recording.direction),
            wrench_on_handle: solved.wrench_on_handle,
            report: solved.report,
            step_ns: solved.step_ns,
            multiply_ns: None,
            contacts: contacts_from..recording.contacts.len(),
            bubbles: recording.bubbles.len()..recording.bubbles.len(),
        });
    }

    /// Adds the free interface nodes of a constrained part to the last record.
    pub(super) fn push_bubbles(&mut self, amplitudes: &[(u32, DVec3)]) {
        let recording = &mut self.recording;
        recording.bubbles.extend_from_slice(amplitudes);
        if let Some(last) = recording.records.last_mut() {
            last.bubbles.end = recording.bubbles.len();
        }
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

fn target(spec: &SessionSpec, handle: &DPose3) -> DPose3 {
    match spec.holds {
        Holds::Tool => *handle,
        Holds::Part => handle.inverse() * spec.tool_pose,
    }
}

fn wrench_on_handle(spec: &SessionSpec, handle: &HandleState, report: &StepReport) -> Wrench {
    match spec.holds {
        // The handle feels the opposite of what the coupling exerts on the tool.
        Holds::Tool => {
            let on_tool = Wrench::from_array(&report.coupling_wrench_on_tool);
            (-on_tool).about(report.tool_pose.translation, handle.pose.translation)
        }
        // The part feels the opposite of the tool, at the tool, turned into the world.
        Holds::Part => {
            let part = spec.tool_pose * report.tool_pose.inverse();
            let on_tool = Wrench::from_array(&report.contact_wrench_on_tool);
            let on_part = Wrench::new(
                part.rotation * -on_tool.force,
                part.rotation * -on_tool.torque,
            );
            on_part.about(spec.tool_pose.translation, handle.pose.translation)
        }
    }
}

//! From the handles to the tool's pose in the part's frame, and from its wrench back to the hands.

use std::time::Instant;

use device::{Command, HandleState, Mapping, Wrench};
use glam::DVec3;
use glamx::DPose3;

use super::Held;
use super::drive::Drive;
use super::fast::Tick;
use super::other::Other;
use super::ports::{Ports, Solved};
use super::saturation::Saturation;
use super::tangent::Tangent;
use crate::engine::{ActiveContact, Stage, StepReport};

/// What is moved, by whom, and who is told.
pub(super) struct Course<'a> {
    pub(super) held: Held,
    /// How the device stands in the world; `None`: its frame is the world.
    pub(super) mapped: Option<Mapped>,
    /// The device that holds the other body, if there is one.
    pub(super) other: Option<Other<'a>>,
    /// The most that the hand can ask for; `None`: whatever its script says.
    pub(super) saturation: Option<Saturation>,
    /// Unit, world: the axis that the held body stays on; the hand feels what is along it.
    pub(super) rail: Option<DVec3>,
    pub(super) drive: Drive<'a>,
    pub(super) ports: Ports<'a>,
}

/// A device whose frame is not the world.
pub(super) struct Mapped {
    pub(super) mapping: Mapping,
    /// Buttons of which each holds the clutch.
    pub(super) clutch: u32,
    /// Whether nothing holds its handle back, so that the handle is taken back instead.
    pub(super) slips: bool,
    /// How the force goes on, for a device with a loop of its own.
    pub(super) tangent: Tangent,
}

impl Course<'_> {
    /// A handle in the world, no further than it may ask for. Once a period.
    pub(super) fn in_world(&mut self, handle: &HandleState) -> HandleState {
        if let Some(other) = &mut self.other {
            other.read(handle.time_s);
        }
        let mut handle = match &mut self.mapped {
            None => *handle,
            Some(mapped) => {
                let is_clutched = handle.buttons & mapped.clutch != 0;
                mapped.mapping.to_world(handle, is_clutched)
            }
        };
        if let Some(saturation) = &self.saturation {
            handle.pose.translation -= saturation.excess();
        }
        if let Some(along) = self.rail {
            let start = self.held.start();
            let way = handle.pose.translation - start.translation;
            handle.pose = DPose3 {
                translation: start.translation + along * way.dot(along),
                ..start
            };
        }
        handle
    }

    /// Pose of the tool that a handle in the world asks for, in the part's frame.
    pub(super) fn target(&self, handle: &HandleState) -> DPose3 {
        match &self.other {
            None => self.held.target(&handle.pose),
            Some(other) => other.target(&self.held, &handle.pose),
        }
    }

    /// On the handle about its point, world.
    pub(super) fn wrench_on_handle(&self, handle: &HandleState, report: &StepReport) -> Wrench {
        let wrench = match &self.other {
            None => self.held.wrench_on_handle(&handle.pose, report),
            Some(other) => other.wrenches(&self.held, &handle.pose, report).0,
        };
        match self.rail {
            None => wrench,
            Some(along) => Wrench::new(along * wrench.force.dot(along), DVec3::ZERO),
        }
    }

    /// Tells the ports of a step, and gives the command for the device. `handle`: in the world.
    pub(super) fn tell(
        &mut self,
        handle: &HandleState,
        answer: Answer,
        contacts: &[ActiveContact],
    ) -> Command {
        let report = answer.report;
        let gone = self.held.gone(&report.tool_pose, self.ports.direction);
        let solved = Solved {
            time_s: handle.time_s,
            phase: self.drive.phase(handle.time_s, gone.travel),
            handle_pose: handle.pose,
            gone,
            report,
            wrench_on_handle: answer.wrench_on_handle,
            step_ns: answer.step_ns,
            contacts,
        };
        self.ports.solved(&self.held, &solved);
        if let Some(other) = &mut self.other {
            other.write(&self.held, &handle.pose, &report);
        }
        let on_handle = Command::from(answer.wrench_on_handle);
        if let Some(saturation) = &mut self.saturation {
            let place = handle.pose.translation + saturation.excess();
            saturation.follow(place, on_handle.wrench.force);
        }
        let Some(mapped) = &mut self.mapped else {
            return on_handle;
        };
        if let Some(saturation) = &mut self.saturation
            && mapped.slips
        {
            mapped.mapping.slip(-saturation.excess());
            saturation.forget();
        }
        let force = on_handle.wrench.force;
        let stiffness = mapped.tangent.follow(handle.pose.translation, force);
        mapped.mapping.to_device(&Command {
            stiffness,
            ..on_handle
        })
    }
}

/// What a period came to.
pub(super) struct Answer {
    pub(super) report: StepReport,
    pub(super) wrench_on_handle: Wrench,
    pub(super) step_ns: u64,
}

impl Answer {
    /// That of a frozen problem.
    pub(super) fn of_tick(tick: &Tick, begun: Instant) -> Self {
        let step_ns = begun.elapsed().as_nanos() as u64;
        let mut report = tick.report;
        report.stage_ns[Stage::Lcp as usize] = step_ns;
        Self {
            report,
            wrench_on_handle: tick.wrench_on_handle,
            step_ns,
        }
    }
}

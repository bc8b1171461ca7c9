//! A second device that holds the other body: two hands, one on each (Duriez et al. 2004, section 5).
//!
//! ```text
//! tool in the part's frame = (part in the world)⁻¹ · tool in the world
//! ```
//! Contact is solved in the part's frame as ever. Both hands feel the same force, opposite, each about its own handle.

use device::{
    Command, DeviceError, HapticDevice, Mapping, Safety, SafetyEvents, SafetySettings, Wrench,
};
use glamx::DPose3;

use super::held::{Held, Holds, at_grip};
use crate::engine::StepReport;

/// Periods in which its force goes to zero at the end, at most.
const RELEASE_PERIODS: u32 = 200;

/// What a second device needs.
pub struct SecondHand<'a> {
    /// The device.
    pub device: &'a mut dyn HapticDevice,
    /// The body that the first device does not hold.
    pub held: Held,
    /// From its frame to the world, at the start; `None`: its frame is the world.
    pub mapping: Option<Mapping>,
    /// Its guard.
    pub safety: SafetySettings,
}

/// What came of a second device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SecondReport {
    /// How often its guard stepped in.
    pub safety: SafetyEvents,
    /// Reads and writes that failed.
    pub failures: u64,
}

/// A second device in a session.
pub(super) struct Other<'a> {
    device: &'a mut dyn HapticDevice,
    held: Held,
    mapping: Option<Mapping>,
    guard: Safety,
    period_s: f64,
    /// In the world; that of the start before the first good sample.
    handle: DPose3,
    is_seen: bool,
    failures: u64,
}

impl<'a> Other<'a> {
    /// # Errors
    /// A guard's setting outside its range.
    pub(super) fn new(hand: SecondHand<'a>, period_s: f64) -> Result<Self, DeviceError> {
        Ok(Self {
            handle: hand.held.start(),
            guard: Safety::new(hand.safety)?,
            device: hand.device,
            held: hand.held,
            mapping: hand.mapping,
            period_s,
            is_seen: false,
            failures: 0,
        })
    }

    /// Once a period, before the target is asked for. Does not allocate unless the device fails.
    pub(super) fn read(&mut self, time_s: f64) {
        let read = self.device.read(time_s);
        self.failures += u64::from(read.is_err());
        let good = self
            .guard
            .accept_sample(read.as_ref().ok(), time_s, self.period_s);
        if let Some(state) = good {
            self.is_seen = true;
            self.handle = match &mut self.mapping {
                None => state.pose,
                Some(mapping) => mapping.to_world(&state, false).pose,
            };
        }
    }

    /// Once a period, after the step.
    pub(super) fn write(&mut self, first: &Held, first_handle: &DPose3, report: &StepReport) {
        if !self.is_seen {
            return;
        }
        let wrench = self.wrenches(first, first_handle, report).1;
        let command = Command::from(wrench);
        let command = match &self.mapping {
            None => command,
            Some(mapping) => mapping.to_device(&command),
        };
        let rendered = self.guard.accept(&command.into(), self.period_s);
        self.failures += u64::from(self.device.write(&rendered).is_err());
    }

    /// Pose of the tool in the part's frame that the two handles ask for.
    pub(super) fn target(&self, first: &Held, first_handle: &DPose3) -> DPose3 {
        let (tool, part) = self.bodies(first, first_handle);
        part.inverse() * tool
    }

    /// On the first handle and on this one, about their points, world.
    pub(super) fn wrenches(
        &self,
        first: &Held,
        first_handle: &DPose3,
        report: &StepReport,
    ) -> (Wrench, Wrench) {
        let (_, part) = self.bodies(first, first_handle);
        // The point that the step's wrenches are about, in the part's frame.
        let about = match first.holds {
            Holds::Tool => at_grip(&report.tool_pose, first.grip).translation,
            Holds::Part => first.grip,
        };
        let about = part * about;
        let on_tool = Wrench::from_array(&report.contact_wrench_on_tool);
        let on_tool = Wrench::new(
            part.rotation * on_tool.force,
            part.rotation * on_tool.torque,
        );
        let on_first = match first.holds {
            Holds::Tool => on_tool,
            Holds::Part => -on_tool,
        };
        (
            on_first.about(about, first_handle.translation),
            (-on_first).about(about, self.handle.translation),
        )
    }

    /// Tool and part in the world, where the handles want them.
    fn bodies(&self, first: &Held, first_handle: &DPose3) -> (DPose3, DPose3) {
        let of_first = at_grip(first_handle, -first.grip);
        let of_this = at_grip(&self.handle, -self.held.grip);
        match first.holds {
            Holds::Tool => (of_first, of_this),
            Holds::Part => (of_this, of_first),
        }
    }

    /// What came of it.
    pub(super) fn report(&self) -> SecondReport {
        SecondReport {
            safety: self.guard.events(),
            failures: self.failures,
        }
    }

    /// Lets the force go to zero, then stops the device.
    pub(super) fn release(&mut self) {
        for _ in 0..RELEASE_PERIODS {
            if self.guard.last_wrench() == Wrench::ZERO {
                break;
            }
            let weaker = self.guard.decay(self.period_s);
            if self.device.write(&weaker.into()).is_err() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_secs_f64(self.period_s));
        }
        self.device.stop();
    }
}

impl Drop for Other<'_> {
    fn drop(&mut self) {
        // Also where the loop panics.
        self.device.stop();
    }
}

#[cfg(test)]
mod tests;

//! Moving the hand from outside, without making the loop wait.

use glam::DVec3;
use glamx::DPose3;
use triple_buffer::{Input, Output, triple_buffer};

use crate::error::{DeviceError, check_setting};
use crate::haptic_device::HandPresence;
use crate::script::Target;
use crate::wrench::{rotation_from_vector, rotation_vector};

/// Time in which the hand makes up for most of a jump of its target, s: a mouse moves by leaps, a hand does not.
const SMOOTHING_S: f64 = 0.03;

/// What is wanted of the hand.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    pose: DPose3,
    hand: HandPresence,
    buttons: u32,
}

/// Moves a simulated hand; belongs to whoever shows it, on whatever thread.
#[derive(Debug)]
pub struct Guide {
    wanted: Wanted,
    box_in: Input<Wanted>,
}

impl Guide {
    /// Where the handle should go, in the device's frame (m, unit quaternion). It gets there within some 0.1 s.
    ///
    /// # Errors
    /// Where the pose is not finite or its quaternion not of unit length; the hand then stays as it was.
    pub fn set_target(&mut self, pose: DPose3) -> Result<(), DeviceError> {
        check_setting(
            "target",
            pose.rotation.length(),
            pose.translation.is_finite() && pose.rotation.is_normalized(),
            "a finite position with a unit quaternion",
        )?;
        self.wanted.pose = pose;
        self.box_in.write(self.wanted);
        Ok(())
    }

    /// The pose that was set last.
    #[must_use]
    pub fn target(&self) -> DPose3 {
        self.wanted.pose
    }

    /// What a sensor of the hand reports. [`HandPresence::Absent`] also lets go: the handle moves freely.
    pub fn set_hand(&mut self, hand: HandPresence) {
        self.wanted.hand = hand;
        self.box_in.write(self.wanted);
    }

    /// Buttons that are pressed, one bit each.
    pub fn set_buttons(&mut self, buttons: u32) {
        self.wanted.buttons = buttons;
        self.box_in.write(self.wanted);
    }
}

/// The hand's end: the smoothed target.
#[derive(Debug)]
pub(super) struct Follower {
    box_out: Output<Wanted>,
    wanted: Wanted,
    target: Target,
}

/// A guide and its follower at a pose.
pub(super) fn pair(start: DPose3) -> (Guide, Follower) {
    let wanted = Wanted {
        pose: start,
        hand: HandPresence::Unknown,
        buttons: 0,
    };
    let (box_in, box_out) = triple_buffer(&wanted);
    let follower = Follower {
        box_out,
        wanted,
        target: Target {
            pose: start,
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
        },
    };
    (Guide { wanted, box_in }, follower)
}

impl Follower {
    /// Goes a period (s) further towards what is wanted. Real-time: no allocation, no lock.
    pub(super) fn advance(&mut self, period_s: f64) {
        self.wanted = *self.box_out.read();
        let share = period_s / (SMOOTHING_S + period_s);
        let from = self.target.pose;
        let way = (self.wanted.pose.translation - from.translation) * share;
        let turn = rotation_vector(self.wanted.pose.rotation * from.rotation.inverse()) * share;
        self.target = Target {
            pose: DPose3::from_parts(
                from.translation + way,
                (rotation_from_vector(turn) * from.rotation).normalize(),
            ),
            linear_velocity: way / period_s,
            angular_velocity: turn / period_s,
        };
    }

    pub(super) fn target(&self) -> Target {
        self.target
    }

    pub(super) fn hand(&self) -> HandPresence {
        self.wanted.hand
    }

    pub(super) fn buttons(&self) -> u32 {
        self.wanted.buttons
    }
}

//! What a haptic device is to the loop: a pose to read, a wrench to render, and limits.

use glam::{DMat3, DVec3};
use glamx::DPose3;

use crate::error::{DeviceError, check_setting};
use crate::wrench::Wrench;

/// What a device reports of its handle at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandleState {
    /// Pose of the handle in the device's frame; its origin is the handle point. m, unit quaternion.
    pub pose: DPose3,
    /// Velocity of the handle point in the device's frame, m/s.
    pub linear_velocity: DVec3,
    /// Angular velocity in the axes of the device's frame, rad/s.
    pub angular_velocity: DVec3,
    /// Time of the sample on the loop's clock, s.
    pub time_s: f64,
    /// Buttons of the handle, one bit each, bit 0 first; 1 is pressed.
    pub buttons: u32,
    /// Whether a hand holds the handle.
    pub hand: HandPresence,
    /// Whether the device would render a force now.
    pub readiness: Readiness,
}

/// What a device's own sensor (deadman) says of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HandPresence {
    /// The device has no such sensor.
    #[default]
    Unknown,
    /// A hand holds the handle.
    Present,
    /// No hand holds it: no force may go to it.
    Absent,
}

/// Whether a device would render a force now, in its own words where not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Readiness {
    /// It would.
    #[default]
    Ready,
    /// Not yet: what it waits for (calibration, power).
    Waiting(&'static str),
    /// It has cut the force by itself: why. Arming begins again after this.
    Tripped(&'static str),
}

impl HandleState {
    /// At rest at a pose at time 0, no button pressed.
    #[must_use]
    pub fn at_rest(pose: DPose3) -> Self {
        Self {
            pose,
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            time_s: 0.0,
            buttons: 0,
            hand: HandPresence::Unknown,
            readiness: Readiness::Ready,
        }
    }

    /// Are pose, velocities and time all finite?
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.pose.translation.is_finite()
            && self.pose.rotation.is_finite()
            && self.linear_velocity.is_finite()
            && self.angular_velocity.is_finite()
            && self.time_s.is_finite()
    }
}

/// What a device's hardware can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Half the workspace along each axis of the device's frame, m.
    pub workspace_half_extents: DVec3,
    /// Force that can be held for ever, N.
    pub continuous_force: f64,
    /// Largest force, for a short time, N.
    pub peak_force: f64,
    /// Largest torque, N m; 0 where the device renders forces alone. No longer-term limit on torque is modelled.
    pub peak_torque: f64,
    /// Smallest change of position that is reported, m. 0: not stated, positions pass unrounded.
    pub position_resolution: f64,
    /// Smallest change of force that is rendered, N. 0: not stated, forces pass unrounded.
    pub force_resolution: f64,
    /// Smallest change of orientation that is reported, rad. 0: not stated.
    pub rotation_resolution: f64,
    /// Largest stiffness the maker says can be rendered, N/m; `None` where none is stated.
    pub max_stiffness: Option<f64>,
    /// Largest rotational stiffness, N m/rad; `None` where none is stated.
    pub max_rotational_stiffness: Option<f64>,
    /// Largest damping that the device renders without buzzing, N s/m; `None` where none is stated.
    pub max_damping: Option<f64>,
    /// The device's own viscous damping b, N s/m; `None` where it is not known.
    pub damping: Option<f64>,
    /// The device's own dry friction, N; `None` where it is not known.
    pub coulomb_friction: Option<f64>,
}

/// What a device is to render until the next command.
///
/// The wrench is the one at the handle's last pose. `stiffness` says how the force goes on from there: a device
/// whose server has a faster loop of its own renders F + J (x − x₀) in it; the others render the wrench alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// On the handle, about the handle point, in the axes of the device's frame.
    pub wrench: Wrench,
    /// J = dF/dx, N/m, row i is dF_i/dx: of a spring that resists, negative semi-definite.
    pub stiffness: DMat3,
}

impl Command {
    /// No force, wherever the handle goes.
    pub const ZERO: Self = Self {
        wrench: Wrench::ZERO,
        stiffness: DMat3::ZERO,
    };

    /// The same, weaker by a factor in [0, 1].
    #[must_use]
    pub fn faded(&self, gain: f64) -> Self {
        Self {
            wrench: self.wrench * gain,
            stiffness: self.stiffness * gain,
        }
    }

    /// Are all numbers finite?
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.wrench.is_finite() && self.stiffness.is_finite()
    }
}

impl From<Wrench> for Command {
    fn from(wrench: Wrench) -> Self {
        Self {
            wrench,
            stiffness: DMat3::ZERO,
        }
    }
}

impl Limits {
    /// The Virtuose 6D as the paper describes it.
    ///
    /// Workspace about a cube of 0.40 m side, 10 N continuous, 35 N peak in steps of 0.2 N, 3.1 N m,
    /// orientation to 3e-5 rad. The paper gives neither a resolution of position nor a largest
    /// stiffness: they are 0 (unrounded) and `None` here; set `position_resolution` to study its effect.
    ///
    /// Source: Duriez, Andriot, Kheddar 2004, section 5.1.
    #[must_use]
    pub const fn virtuose_6d() -> Self {
        Self {
            workspace_half_extents: DVec3::splat(0.20),
            continuous_force: 10.0,
            peak_force: 35.0,
            peak_torque: 3.1,
            position_resolution: 0.0,
            force_resolution: 0.2,
            rotation_resolution: 3e-5,
            max_stiffness: None,
            max_rotational_stiffness: None,
            max_damping: None,
            damping: None,
            coulomb_friction: None,
        }
    }

    /// Are these limits that a haptic device can have?
    ///
    /// What a driver was told by a library or a server is judged by this before it becomes a guard's limit. A peak
    /// force of 0 (devices for input alone) passes; so does whatever is `None`.
    ///
    /// # Errors
    /// The first limit that is not finite, negative or beyond every device, by its field's name.
    pub fn check(&self) -> Result<(), DeviceError> {
        for half_extent in self.workspace_half_extents.to_array() {
            check_setting(
                "workspace_half_extents",
                half_extent,
                half_extent > 0.0 && half_extent <= 10.0,
                "above 0 and at most 10 m",
            )?;
        }
        let (peak, continuous) = (self.peak_force, self.continuous_force);
        check_setting(
            "peak_force",
            peak,
            (0.0..=1000.0).contains(&peak),
            "from 0 to 1000 N",
        )?;
        check_setting(
            "continuous_force",
            continuous,
            continuous >= 0.0 && continuous <= peak && (continuous > 0.0 || peak == 0.0),
            "above 0 and at most the peak force (N), or 0 with it",
        )?;
        let ranges = [
            (
                "peak_torque",
                Some(self.peak_torque),
                100.0,
                "from 0 to 100 N m",
            ),
            (
                "position_resolution",
                Some(self.position_resolution),
                0.01,
                "from 0 to 0.01 m",
            ),
            (
                "force_resolution",
                Some(self.force_resolution),
                10.0,
                "from 0 to 10 N",
            ),
            (
                "rotation_resolution",
                Some(self.rotation_resolution),
                0.1,
                "from 0 to 0.1 rad",
            ),
            (
                "max_stiffness",
                self.max_stiffness,
                1e6,
                "from 0 to 1e6 N/m",
            ),
            (
                "max_rotational_stiffness",
                self.max_rotational_stiffness,
                1e5,
                "from 0 to 1e5 N m/rad",
            ),
            ("max_damping", self.max_damping, 1e4, "from 0 to 1e4 N s/m"),
            ("damping", self.damping, 1e4, "from 0 to 1e4 N s/m"),
            (
                "coulomb_friction",
                self.coulomb_friction,
                100.0,
                "from 0 to 100 N",
            ),
        ];
        for (name, value, most, allowed) in ranges {
            let value = value.unwrap_or(0.0);
            check_setting(name, value, (0.0..=most).contains(&value), allowed)?;
        }
        Ok(())
    }
}

/// A device that reports the pose of a handle and renders a wrench on it.
///
/// The loop calls [`read`](Self::read) and then [`write`](Self::write) once a period from one thread.
/// A driver promises:
/// - `read` and `write` neither allocate nor block for longer than a fraction of the period (on the way
///   without errors);
/// - should no `write` come for about 0.1 s, the rendered wrench goes to zero by itself, smoothly: the
///   loop may have died with the process;
/// - a wrench that is not finite is refused, whatever stands before the driver.
pub trait HapticDevice: Send {
    /// Name of the device for people, constant.
    fn name(&self) -> &str;

    /// What the hardware can do, constant.
    fn limits(&self) -> &Limits;

    /// The state of the handle at the loop's time `time_s` (s, never falling).
    ///
    /// # Errors
    /// Where no sample could be had; the caller goes on with the last good one.
    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError>;

    /// Renders a command on the handle, about the handle point, until the next call.
    ///
    /// # Errors
    /// Where it could not be rendered.
    fn write(&mut self, command: &Command) -> Result<(), DeviceError>;

    /// Zero force now, and none until the next `write`. Called at the end of the loop, also after a
    /// failure; must not fail.
    fn stop(&mut self);
}

#[cfg(test)]
mod tests;

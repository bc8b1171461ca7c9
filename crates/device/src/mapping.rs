//! From the handle in its device to the grip in the scene, and from the grip's wrench back to the handle.

use glam::{DMat3, DQuat, DVec3};
use glamx::DPose3;

use crate::error::{DeviceError, check_setting};
use crate::haptic_device::{Command, HandleState};
use crate::wrench::Wrench;

/// How far the square of a quaternion's length may be from 1, as for the samples of a device. Dimensionless.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Smallest and largest scale, world metres per device metre: beyond, either the hand or the part is a mistake.
const SCALES: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// Time in which the force comes back after the clutch was let go, s: long enough that the hand can meet it.
const FORCE_RETURN_S: f64 = 0.2;

/// How the device stands in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappingSettings {
    /// Axes of the device's frame in the world: `axes * v` is a device's vector in the world. Default: the same axes.
    pub axes: DQuat,
    /// World metres per device metre, from 1e-3 to 1e3. Default 1. Below 1 the hand moves more than the part, and
    /// forces on it are smaller by the same factor (see [`Mapping`]). Angles are never scaled.
    pub scale: f64,
    /// Whether the grip turns with the handle. Default: it does.
    pub rotation: Rotation,
}

impl Default for MappingSettings {
    fn default() -> Self {
        Self {
            axes: DQuat::IDENTITY,
            scale: 1.0,
            rotation: Rotation::Follow,
        }
    }
}

/// Whether the grip turns with the handle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rotation {
    /// One to one.
    #[default]
    Follow,
    /// The grip keeps the orientation of the start, and no torque goes back: for devices that sense no rotation.
    Fixed,
}

/// The mapping between a device's frame and the scene's world.
///
/// ```text
/// x_w = x_w0 + s A (x_d − x_d0)            v_w = s A v_d
/// R_w = A (R_d R_d0⁻¹) A⁻¹ R_w0            ω_w = A ω_d
/// F_d = s Aᵀ F_w        T_d = Aᵀ T_w       J_d = s² Aᵀ J_w A
/// ```
/// A: axes of the device in the world; s: scale; 0: the anchor, a pose of the handle and the pose of the grip that
/// belongs to it. The first good sample is anchored at the scene's start pose. Torques are about the handle point.
///
/// With these forces the mapping neither makes nor takes power, whatever A and s are,
///
/// ```text
/// F_d · v_d + T_d · ω_d = F_w · v_w + T_w · ω_w
/// ```
///
/// so what is passive in the world is so in the hand. It is why a scale of motion must scale the force as well.
/// With [`Rotation::Fixed`] both ω_w and T_d are zero, and it holds again.
///
/// *Clutch.* While it is pressed the grip stays where it is, at rest, and the anchor moves along with the handle;
/// no force goes to the hand then (the grip does no work, so neither may the handle). On release motion goes on
/// from that very pose, so nothing jumps and the coupling is not stretched; the force comes back within 0.2 s, and
/// during that time the left side above is that share of the right one.
///
/// Real-time: no allocation.
#[derive(Debug, Clone)]
pub struct Mapping {
    settings: MappingSettings,
    /// Pose of the grip in the world that belongs to `anchor`.
    anchored: DPose3,
    /// Pose of the handle in the device's frame; none before the first good sample.
    anchor: Option<DPose3>,
    last: HandleState,
    is_clutched: bool,
    /// Share of the force that goes to the hand, in [0, 1].
    share: f64,
}

impl Mapping {
    /// A mapping whose first good sample is the grip's pose `start` in the world.
    ///
    /// # Errors
    /// Where the scale is outside its range, or the axes or the start are not finite or not of unit length.
    pub fn new(settings: MappingSettings, start: DPose3) -> Result<Self, DeviceError> {
        check_setting(
            "scale",
            settings.scale,
            SCALES.contains(&settings.scale),
            "from 1e-3 to 1e3 (world metres per device metre)",
        )?;
        check_unit("axes", settings.axes)?;
        check_unit("start", start.rotation)?;
        let farthest = start.translation.abs().max_element();
        check_setting(
            "start",
            farthest,
            start.translation.is_finite(),
            "finite (m)",
        )?;
        let start = DPose3::from_parts(start.translation, start.rotation.normalize());
        let settings = MappingSettings {
            axes: settings.axes.normalize(),
            ..settings
        };
        Ok(Self {
            settings,
            anchored: start,
            anchor: None,
            last: HandleState::at_rest(start),
            is_clutched: false,
            share: 1.0,
        })
    }

    /// The grip in the world for the handle in the device's frame; time, buttons, hand and readiness pass through.
    ///
    /// A sample that is not finite or whose quaternion is not of unit length leaves the grip where it was, at rest.
    pub fn to_world(&mut self, handle: &HandleState, is_clutched: bool) -> HandleState {
        let off_unit = (handle.pose.rotation.length_squared() - 1.0).abs();
        let is_good = handle.is_finite() && off_unit <= UNIT_TOLERANCE;
        if is_good {
            self.meter_force(handle.time_s, is_clutched);
        }
        let device = handle.pose;
        let world = match self.anchor {
            _ if !is_good => None,
            Some(anchor) if !is_clutched => self.follow(&anchor, handle),
            _ => {
                self.anchored = self.last.pose;
                self.anchor = Some(device);
                None
            }
        };
        let (pose, linear_velocity, angular_velocity) =
            world.unwrap_or((self.last.pose, DVec3::ZERO, DVec3::ZERO));
        self.last = HandleState {
            pose,
            linear_velocity,
            angular_velocity,
            time_s: if is_good {
                handle.time_s
            } else {
                self.last.time_s
            },
            ..*handle
        };
        self.last
    }

    /// The command for the handle from the one on the grip in the world: wrench and stiffness.
    #[must_use]
    pub fn to_device(&self, on_grip: &Command) -> Command {
        if self.share == 0.0 {
            return Command::ZERO;
        }
        let MappingSettings { axes, scale, .. } = self.settings;
        let back = axes.conjugate();
        let torque = match self.settings.rotation {
            Rotation::Follow => back * on_grip.wrench.torque,
            Rotation::Fixed => DVec3::ZERO,
        };
        let matrix = DMat3::from_quat(axes);
        Command {
            wrench: Wrench::new(back * on_grip.wrench.force * scale, torque),
            stiffness: matrix.transpose() * on_grip.stiffness * matrix * (scale * scale),
        }
        .faded(self.share)
    }

    /// The settings, the axes normalised.
    #[must_use]
    pub fn settings(&self) -> &MappingSettings {
        &self.settings
    }

    /// Anchors the next good sample where the grip is now: for a device that was away and has come back elsewhere.
    pub fn recentre(&mut self) {
        self.anchored = self.last.pose;
        self.anchor = None;
    }

    /// Moves the grip in the world (m) without the handle, and stays so from the next sample on: for a device that
    /// nothing holds back, whose grip would run ahead of a tool that is held up.
    pub fn slip(&mut self, by: DVec3) {
        if by.is_finite() {
            self.anchored.translation += by;
            self.last.pose.translation += by;
        }
    }

    /// Pose and velocities of the grip; nothing where the numbers overflow.
    fn follow(&self, anchor: &DPose3, handle: &HandleState) -> Option<(DPose3, DVec3, DVec3)> {
        let MappingSettings {
            axes,
            scale,
            rotation,
        } = self.settings;
        let way = axes * (handle.pose.translation - anchor.translation) * scale;
        let turn = match rotation {
            Rotation::Follow => {
                axes * (handle.pose.rotation * anchor.rotation.conjugate()) * axes.conjugate()
            }
            Rotation::Fixed => DQuat::IDENTITY,
        };
        let spin = match rotation {
            Rotation::Follow => axes * handle.angular_velocity,
            Rotation::Fixed => DVec3::ZERO,
        };
        let pose = DPose3::from_parts(
            self.anchored.translation + way,
            (turn * self.anchored.rotation).normalize(),
        );
        let velocity = axes * handle.linear_velocity * scale;
        (pose.is_finite() && velocity.is_finite() && spin.is_finite())
            .then_some((pose, velocity, spin))
    }

    /// No force with the clutch pressed, and its return afterwards.
    fn meter_force(&mut self, time_s: f64, is_clutched: bool) {
        let elapsed_s = (time_s - self.last.time_s).max(0.0);
        self.share = match (is_clutched, self.is_clutched) {
            (true, _) => 0.0,
            (false, true) => self.share,
            (false, false) => (self.share + elapsed_s / FORCE_RETURN_S).min(1.0),
        };
        self.is_clutched = is_clutched;
    }
}

/// The quaternion must be finite and of unit length.
fn check_unit(name: &'static str, rotation: DQuat) -> Result<(), DeviceError> {
    let length = rotation.length();
    check_setting(
        name,
        length,
        (length * length - 1.0).abs() <= UNIT_TOLERANCE,
        "a quaternion of unit length",
    )
}

#[cfg(test)]
mod tests;

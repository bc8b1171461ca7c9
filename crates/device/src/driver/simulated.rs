//! A simulated six-axis device, by default with the published figures of a Virtuose 6D, held by a
//! simulated hand.
//!
//! The default has limits and sensors, and no body: the handle is the hand's. The [`Model`]s have one:
//! mass, damping, dry friction, a late force, and a velocity made of encoder steps.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_not_negative, check_positive, check_setting};
use crate::hand::SimulatedHand;
use crate::hand::body::Body;
use crate::haptic_device::{Command, HandleState, HapticDevice, Limits};
use crate::safety::Watchdog;
use crate::safety::heating::{Heating, HeatingSettings};
use crate::wrench::{Wrench, limit_length, rotation_from_vector, rotation_vector};

mod delay;
mod family;
mod models;
mod velocity;

use delay::DelayLine;
pub(crate) use family::Simulations;
pub use models::{MODELS, Model};
use velocity::VelocityFilter;

/// Longest gap between two reads that is simulated, s; a longer one is a jump of the clock and the
/// hand does not move in it.
const GAP_MAX_S: f64 = 1.0;

/// Longest delay of the force that is simulated, periods of the hand.
const DELAY_STEPS_MAX: f64 = 1e4;

/// What the simulated device is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulatedSettings {
    /// The hardware's limits. Default: [`Limits::virtuose_6d`].
    ///
    /// `position_resolution` 0 passes positions unrounded (the paper states none); a typical encoder
    /// through an arm of half a metre gives 1e-5 m.
    pub limits: Limits,
    /// Middle of the workspace in the device's frame, m; `None` is where the hand's script starts.
    pub workspace_centre: Option<DVec3>,
    /// Time constant of the window over which the mean square of the force is held to the continuous
    /// force, s. Default 60, nominal 10 to 300: the paper gives the two forces and no time; motors of
    /// this size heat within minutes. With 60 s the peak of 35 N lasts 4.6 s before it is taken back.
    pub thermal_window_s: f64,
    /// The device's body, between handle and hand; `None`: the hand alone moves. Its damping and dry
    /// friction are those of the limits, none where they are not known.
    pub body: Option<BodySettings>,
}

/// What a device's moving parts and its wire are like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySettings {
    /// Apparent mass at the handle, kg.
    pub mass: f64,
    /// Apparent moment of inertia about the handle point, kg m².
    pub inertia: f64,
    /// Viscous damping of a turn, N m s/rad.
    pub rotational_damping: f64,
    /// Time from a write to its force, s; rounded to periods of the hand.
    pub delay_s: f64,
    /// Largest time by which that is exceeded at random, s; the same at each run.
    pub jitter_s: f64,
    /// Time constant of the filter that makes a velocity of encoder steps, s.
    pub velocity_window_s: f64,
}

impl Default for SimulatedSettings {
    fn default() -> Self {
        Self {
            limits: Limits::virtuose_6d(),
            workspace_centre: None,
            thermal_window_s: 60.0,
            body: None,
        }
    }
}

/// What the simulated hardware did to the wrenches and to the handle, in periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SimulatedEvents {
    /// Writes whose force was beyond the peak force.
    pub peak_limited: u64,
    /// Writes whose force was beyond what the heat allowed.
    pub thermally_limited: u64,
    /// Writes whose torque was beyond the peak torque.
    pub torque_limited: u64,
    /// Periods in which the handle stood at the wall of the workspace.
    pub at_workspace_wall: u64,
    /// Periods in which the wrench was fading because no write came.
    pub fading: u64,
}

/// The simulated device.
///
/// A read advances the hand to the time asked for, by whole periods of the hand, under the wrench
/// rendered last; the first read returns the start. Positions and orientations are rounded to the
/// device's resolution. A write limits and rounds the force as the hardware would.
///
/// Thermal rule: S follows the square of the rendered force with the time constant of the window;
/// up to S = 0.9 F_c² the peak force is allowed, from there it falls linearly in S to F_c at S = F_c².
///
/// ```text
/// dS/dt = (F² − S)/τ
/// ```
#[derive(Debug)]
pub struct Simulated {
    name: &'static str,
    settings: SimulatedSettings,
    hand: SimulatedHand,
    workspace_centre: DVec3,
    /// Time on the loop's clock that the hand has reached; none before the first read.
    reached_s: Option<f64>,
    rendered: Wrench,
    felt: Wrench,
    heating: Heating,
    watchdog: Watchdog,
    wire: Option<Wire>,
    events: SimulatedEvents,
}

/// What a body adds to forces and sensors.
#[derive(Debug)]
struct Wire {
    delay: DelayLine,
    velocity: VelocityFilter,
}

impl Simulated {
    /// A device at rest, held by a hand.
    ///
    /// # Errors
    /// Where a limit or setting is outside its range, or the hand's script leaves the workspace.
    pub fn new(settings: SimulatedSettings, mut hand: SimulatedHand) -> Result<Self, DeviceError> {
        let limits = &settings.limits;
        for half_extent in limits.workspace_half_extents.to_array() {
            check_positive("workspace_half_extents", half_extent)?;
        }
        check_not_negative("peak_torque", limits.peak_torque)?;
        check_not_negative("position_resolution", limits.position_resolution)?;
        check_not_negative("force_resolution", limits.force_resolution)?;
        check_not_negative("rotation_resolution", limits.rotation_resolution)?;
        check_positive("thermal_window_s", settings.thermal_window_s)?;
        let heating = Heating::new(HeatingSettings {
            continuous_force: limits.continuous_force,
            peak_force: limits.peak_force,
            time_constant_s: settings.thermal_window_s,
        })?;
        let wire = match &settings.body {
            Some(body) => Some(Wire::new(body, limits, &mut hand)?),
            None => None,
        };

        let script = hand.script();
        let start = script.start().translation;
        let centre = settings.workspace_centre.unwrap_or(start);
        for point in [start, start + script.direction() * script.travel()] {
            let beyond = (point - centre).abs() - limits.workspace_half_extents;
            for (axis, beyond) in ['x', 'y', 'z'].into_iter().zip(beyond.to_array()) {
                if beyond.is_nan() || beyond > 0.0 {
                    return Err(DeviceError::LeavesWorkspace { beyond, axis });
                }
            }
        }
        Ok(Self {
            name: "simulated device",
            settings,
            hand,
            workspace_centre: centre,
            reached_s: None,
            rendered: Wrench::ZERO,
            felt: Wrench::ZERO,
            heating,
            watchdog: Watchdog::default(),
            wire,
            events: SimulatedEvents::default(),
        })
    }

    /// A device of a named model at rest, held by a hand.
    ///
    /// # Errors
    /// Where the hand's script leaves the model's workspace, or the hand is stepped too rarely for it.
    pub fn of_model(model: &Model, hand: SimulatedHand) -> Result<Self, DeviceError> {
        Ok(Self {
            name: model.name,
            ..Self::new(model.settings(), hand)?
        })
    }

    /// The hand that holds the device, with the true state of the handle.
    #[must_use]
    pub fn hand(&self) -> &SimulatedHand {
        &self.hand
    }

    /// The wrench the hardware renders since the last write, limited and rounded.
    #[must_use]
    pub fn rendered(&self) -> Wrench {
        self.rendered
    }

    /// The wrench the hand felt in the last period: the rendered one, or less when no write came.
    #[must_use]
    pub fn felt(&self) -> Wrench {
        self.felt
    }

    /// What the hardware had to limit so far.
    #[must_use]
    pub fn events(&self) -> SimulatedEvents {
        self.events
    }

    /// Advances the hand and the heat by one period.
    fn step_hand(&mut self) {
        let period_s = self.hand.period_s();
        let gain = self.watchdog.gain(self.hand.time_s());
        if gain < 1.0 && self.rendered != Wrench::ZERO {
            self.events.fading += 1;
        }
        let arrived = match &mut self.wire {
            Some(wire) => wire.delay.step(),
            None => self.rendered,
        };
        self.felt = arrived * gain;
        self.hand.step(&self.felt);
        self.heating.feed(self.felt.force, period_s);

        let half = self.settings.limits.workspace_half_extents;
        let position = self.hand.state().pose.translation;
        let inside = position.clamp(self.workspace_centre - half, self.workspace_centre + half);
        if inside != position {
            self.events.at_workspace_wall += 1;
            self.hand.stop_at(inside);
        }
        if self.wire.is_some() {
            let pose = self.encoded();
            if let Some(wire) = &mut self.wire {
                wire.velocity.step(&pose, period_s);
            }
        }
    }

    /// The pose in steps of the encoders.
    fn encoded(&self) -> DPose3 {
        let limits = &self.settings.limits;
        let pose = self.hand.state().pose;
        let position = round_to(pose.translation, limits.position_resolution);
        let rotation = if limits.rotation_resolution > 0.0 {
            let vector = rotation_vector(pose.rotation);
            rotation_from_vector(round_to(vector, limits.rotation_resolution))
        } else {
            pose.rotation
        };
        DPose3::from_parts(position, rotation)
    }

    /// The state the sensors report.
    fn sensed(&self, time_s: f64) -> HandleState {
        let mut state = self.hand.state();
        state.pose = self.encoded();
        state.time_s = time_s;
        if let Some(wire) = &self.wire {
            (state.linear_velocity, state.angular_velocity) = wire.velocity.velocities();
        }
        state
    }
}

impl Wire {
    /// The wire of a body, which the hand takes.
    fn new(
        settings: &BodySettings,
        limits: &Limits,
        hand: &mut SimulatedHand,
    ) -> Result<Self, DeviceError> {
        let damping = limits.damping.unwrap_or(0.0);
        let coulomb_friction = limits.coulomb_friction.unwrap_or(0.0);
        check_positive("mass", settings.mass)?;
        check_positive("inertia", settings.inertia)?;
        check_not_negative("rotational_damping", settings.rotational_damping)?;
        check_not_negative("damping", damping)?;
        check_not_negative("coulomb_friction", coulomb_friction)?;
        check_positive("velocity_window_s", settings.velocity_window_s)?;
        hand.take(&Body {
            mass: settings.mass,
            inertia: settings.inertia,
            damping,
            rotational_damping: settings.rotational_damping,
            coulomb_friction,
        })?;
        let period_s = hand.period_s();
        Ok(Self {
            delay: DelayLine::new(
                steps("delay_s", settings.delay_s, period_s)?,
                steps("jitter_s", settings.jitter_s, period_s)?,
            ),
            velocity: VelocityFilter::new(settings.velocity_window_s, hand.state().pose),
        })
    }
}

/// A time in whole periods.
fn steps(name: &'static str, time_s: f64, period_s: f64) -> Result<u64, DeviceError> {
    check_not_negative(name, time_s)?;
    let steps = (time_s / period_s).round();
    check_setting(
        name,
        time_s,
        steps <= DELAY_STEPS_MAX,
        "at most 10 000 periods of the hand (s)",
    )?;
    Ok(steps as u64)
}

impl HapticDevice for Simulated {
    fn name(&self) -> &str {
        self.name
    }

    fn limits(&self) -> &Limits {
        &self.settings.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        let period_s = self.hand.period_s();
        let reached_s = *self.reached_s.get_or_insert(time_s);
        let gap_s = time_s - reached_s;
        if gap_s.is_nan() || gap_s < -0.5 * period_s {
            return Err(DeviceError::TimeWentBack {
                from_s: reached_s,
                to_s: time_s,
            });
        }
        if gap_s > GAP_MAX_S.max(period_s) {
            self.reached_s = Some(time_s);
            return Err(DeviceError::TimeJump {
                from_s: reached_s,
                to_s: time_s,
            });
        }
        let steps = (gap_s / period_s).round().max(0.0);
        for _ in 0..steps as u64 {
            self.step_hand();
        }
        self.reached_s = Some(reached_s + steps * period_s);
        Ok(self.sensed(time_s))
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        let wrench_on_handle = &command.wrench;
        if !command.is_finite() {
            return Err(DeviceError::NonFiniteWrench {
                device: self.name().to_owned(),
            });
        }
        let limits = &self.settings.limits;
        let peak_force = limit_length(wrench_on_handle.force, limits.peak_force);
        let allowed = self.heating.allowed();
        let allowed_force = limit_length(peak_force, allowed);
        let torque = limit_length(wrench_on_handle.torque, limits.peak_torque);
        // To the nearest step, but never beyond the limit.
        let mut force = round_to(allowed_force, limits.force_resolution);
        // Without a resolution there is no step to go back by; a limited length may be an ulp beyond its limit.
        if limits.force_resolution > 0.0 && force.length() > allowed {
            force = (allowed_force / limits.force_resolution).trunc() * limits.force_resolution;
        }
        self.events.peak_limited += u64::from(peak_force != wrench_on_handle.force);
        self.events.thermally_limited += u64::from(allowed_force != peak_force);
        self.events.torque_limited += u64::from(torque != wrench_on_handle.torque);
        self.rendered = Wrench::new(force, torque);
        if let Some(wire) = &mut self.wire {
            wire.delay.push(self.rendered);
        }
        self.watchdog.feed(self.hand.time_s());
        Ok(())
    }

    fn stop(&mut self) {
        self.rendered = Wrench::ZERO;
        self.felt = Wrench::ZERO;
        if let Some(wire) = &mut self.wire {
            wire.delay.clear();
        }
        // The next loop may count its time from anywhere; the hand goes on where it is.
        self.reached_s = None;
    }
}

/// Each component to the nearest multiple of the resolution; unrounded where the resolution is 0.
fn round_to(v: DVec3, resolution: f64) -> DVec3 {
    if resolution > 0.0 {
        (v / resolution).round() * resolution
    } else {
        v
    }
}

#[cfg(test)]
mod tests;

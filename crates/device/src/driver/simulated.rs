//! A simulated six-axis device, by default with the published figures of a Virtuose 6D, held by a
//! simulated hand.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_not_negative, check_positive, check_setting};
use crate::hand::SimulatedHand;
use crate::haptic_device::{Command, HandleState, HapticDevice, Limits};
use crate::safety::Watchdog;
use crate::wrench::{Wrench, limit_length, rotation_from_vector, rotation_vector};

/// Longest gap between two reads that is simulated, s; a longer one is a jump of the clock and the
/// hand does not move in it.
const GAP_MAX_S: f64 = 1.0;

/// Part of the continuous limit (as mean square) from which the peak force is taken back. Dimensionless.
const THERMAL_ONSET: f64 = 0.9;

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
}

impl Default for SimulatedSettings {
    fn default() -> Self {
        Self {
            limits: Limits::virtuose_6d(),
            workspace_centre: None,
            thermal_window_s: 60.0,
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
#[derive(Debug, Clone)]
pub struct Simulated {
    settings: SimulatedSettings,
    hand: SimulatedHand,
    workspace_centre: DVec3,
    /// Time on the loop's clock that the hand has reached; none before the first read.
    reached_s: Option<f64>,
    rendered: Wrench,
    felt: Wrench,
    mean_square_force: f64,
    watchdog: Watchdog,
    events: SimulatedEvents,
}

impl Simulated {
    /// A device at rest, held by a hand.
    ///
    /// # Errors
    /// Where a limit or setting is outside its range, or the hand's script leaves the workspace.
    pub fn new(settings: SimulatedSettings, hand: SimulatedHand) -> Result<Self, DeviceError> {
        let limits = &settings.limits;
        for half_extent in limits.workspace_half_extents.to_array() {
            check_positive("workspace_half_extents", half_extent)?;
        }
        check_positive("continuous_force", limits.continuous_force)?;
        check_setting(
            "peak_force",
            limits.peak_force,
            limits.peak_force.is_finite() && limits.peak_force >= limits.continuous_force,
            "finite and at least the continuous force (N)",
        )?;
        check_not_negative("peak_torque", limits.peak_torque)?;
        check_not_negative("position_resolution", limits.position_resolution)?;
        check_not_negative("force_resolution", limits.force_resolution)?;
        check_not_negative("rotation_resolution", limits.rotation_resolution)?;
        check_positive("thermal_window_s", settings.thermal_window_s)?;

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
            settings,
            hand,
            workspace_centre: centre,
            reached_s: None,
            rendered: Wrench::ZERO,
            felt: Wrench::ZERO,
            mean_square_force: 0.0,
            watchdog: Watchdog::default(),
            events: SimulatedEvents::default(),
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
        self.felt = self.rendered * gain;
        self.hand.step(&self.felt);

        let share = period_s / (self.settings.thermal_window_s + period_s);
        self.mean_square_force +=
            (self.felt.force.length_squared() - self.mean_square_force) * share;

        let half = self.settings.limits.workspace_half_extents;
        let position = self.hand.state().pose.translation;
        let inside = position.clamp(self.workspace_centre - half, self.workspace_centre + half);
        if inside != position {
            self.events.at_workspace_wall += 1;
            self.hand.stop_at(inside);
        }
    }

    /// The force the heat allows now, N.
    fn allowed_force(&self) -> f64 {
        let limits = &self.settings.limits;
        let (peak, continuous) = (limits.peak_force, limits.continuous_force);
        let heat = self.mean_square_force / (continuous * continuous);
        let taken_back = ((heat - THERMAL_ONSET) / (1.0 - THERMAL_ONSET)).clamp(0.0, 1.0);
        peak + (continuous - peak) * taken_back
    }

    /// The state the sensors report.
    fn sensed(&self, time_s: f64) -> HandleState {
        let limits = &self.settings.limits;
        let mut state = self.hand.state();
        let position = round_to(state.pose.translation, limits.position_resolution);
        let rotation = if limits.rotation_resolution > 0.0 {
            let vector = rotation_vector(state.pose.rotation);
            rotation_from_vector(round_to(vector, limits.rotation_resolution))
        } else {
            state.pose.rotation
        };
        state.pose = DPose3::from_parts(position, rotation);
        state.time_s = time_s;
        state
    }
}

impl HapticDevice for Simulated {
    fn name(&self) -> &str {
        "simulated device"
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
        let allowed = self.allowed_force();
        let allowed_force = limit_length(peak_force, allowed);
        let torque = limit_length(wrench_on_handle.torque, limits.peak_torque);
        // To the nearest step, but never beyond the limit.
        let mut force = round_to(allowed_force, limits.force_resolution);
        if force.length() > allowed {
            force = (allowed_force / limits.force_resolution).trunc() * limits.force_resolution;
        }
        self.events.peak_limited += u64::from(peak_force != wrench_on_handle.force);
        self.events.thermally_limited += u64::from(allowed_force != peak_force);
        self.events.torque_limited += u64::from(torque != wrench_on_handle.torque);
        self.rendered = Wrench::new(force, torque);
        self.watchdog.feed(self.hand.time_s());
        Ok(())
    }

    fn stop(&mut self) {
        self.rendered = Wrench::ZERO;
        self.felt = Wrench::ZERO;
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

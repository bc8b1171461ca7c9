//! The guard between simulation and hand: limits, rates, samples that cannot be, and stalls.
//!
//! No clock is read here: time comes in as a number, so each guard can be provoked in a test.

use glam::DVec3;

use crate::error::{DeviceError, check_not_negative, check_positive};
use crate::haptic_device::{HandleState, Limits};
use crate::wrench::{Wrench, limit_length};

/// How far the square of a quaternion's length may be from 1. A device's own rounding to 16 bits gives
/// 3e-5; beyond 1e-3 the sample is rejected, below it is normalised. Dimensionless.
const UNIT_TOLERANCE: f64 = 1e-3;

/// What the guard allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetySettings {
    /// Largest force, N. A longer one is shortened in its direction.
    pub force_max: f64,
    /// Largest torque, N m. A longer one is shortened in its direction.
    pub torque_max: f64,
    /// Largest change of the force, N/s. By default the peak force within 2 ms: slower than a step,
    /// faster than any fall at a snap. Nominal: the peak force within 1 to 10 ms.
    pub force_rate_max: f64,
    /// Largest change of the torque, N m/s. By default the peak torque within 2 ms.
    pub torque_rate_max: f64,
    /// Largest speed of the handle, m/s; a sample beyond is rejected. Default 10: no hand on a device
    /// is faster.
    pub speed_max: f64,
    /// Largest angular speed of the handle, rad/s. Default 100.
    pub angular_speed_max: f64,
    /// Time in which the largest wrench goes to zero while samples or wrenches are rejected, s.
    /// Default 0.05.
    pub decay_s: f64,
    /// Age at which a wrench is stale, s. Default 0.02: twenty periods at 1 kHz.
    pub stall_timeout_s: f64,
    /// Time in which a stale wrench goes to zero, s. Default 0.05.
    pub stall_ramp_s: f64,
}

impl SafetySettings {
    /// The settings for a device with these limits.
    #[must_use]
    pub fn for_limits(limits: &Limits) -> Self {
        const RISE_S: f64 = 2e-3;
        Self {
            force_max: limits.peak_force,
            torque_max: limits.peak_torque,
            force_rate_max: limits.peak_force / RISE_S,
            torque_rate_max: limits.peak_torque / RISE_S,
            speed_max: 10.0,
            angular_speed_max: 100.0,
            decay_s: 0.05,
            stall_timeout_s: Watchdog::TIMEOUT_S,
            stall_ramp_s: Watchdog::RAMP_S,
        }
    }
}

/// How often the guard stepped in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SafetyEvents {
    /// Samples that never came: the device failed to read.
    pub samples_missing: u64,
    /// Samples with a number that is not finite.
    pub samples_non_finite: u64,
    /// Samples whose quaternion is not of unit length.
    pub samples_non_unit: u64,
    /// Samples too far from the last good one, or with too high a velocity.
    pub samples_too_fast: u64,
    /// Samples with a time before the last good one's.
    pub samples_back_in_time: u64,
    /// Wrenches from the simulation that were not finite.
    pub wrenches_non_finite: u64,
    /// Wrenches shortened to the largest force or torque.
    pub wrenches_clamped: u64,
    /// Wrenches held back by the largest rate.
    pub wrenches_rate_limited: u64,
    /// Stalls of the loop long enough to make the wrench stale.
    pub stalls: u64,
}

impl SafetyEvents {
    /// Samples rejected for any reason.
    #[must_use]
    pub fn samples_rejected(&self) -> u64 {
        self.samples_missing
            + self.samples_non_finite
            + self.samples_non_unit
            + self.samples_too_fast
            + self.samples_back_in_time
    }
}

/// The guard: keeps the last good sample and the last wrench that was let through.
///
/// While the newest sample is rejected, or the wrench is not finite, the wrench goes to zero along its
/// direction within `decay_s`; afterwards it comes back no faster than the rate allows.
#[derive(Debug, Clone)]
pub struct Safety {
    settings: SafetySettings,
    stall: Watchdog,
    last_good: Option<HandleState>,
    since_good_s: f64,
    is_sample_good: bool,
    last_wrench: Wrench,
    events: SafetyEvents,
}

impl Safety {
    /// A guard that has seen nothing and let nothing through.
    ///
    /// # Errors
    /// Where a setting is not finite or outside its range.
    pub fn new(settings: SafetySettings) -> Result<Self, DeviceError> {
        check_not_negative("force_max", settings.force_max)?;
        check_not_negative("torque_max", settings.torque_max)?;
        check_positive("force_rate_max", settings.force_rate_max)?;
        check_not_negative("torque_rate_max", settings.torque_rate_max)?;
        check_positive("speed_max", settings.speed_max)?;
        check_positive("angular_speed_max", settings.angular_speed_max)?;
        check_positive("decay_s", settings.decay_s)?;
        let stall = Watchdog::new(settings.stall_timeout_s, settings.stall_ramp_s)?;
        Ok(Self {
            settings,
            stall,
            last_good: None,
            since_good_s: 0.0,
            is_sample_good: false,
            last_wrench: Wrench::ZERO,
            events: SafetyEvents::default(),
        })
    }

    /// Judges a sample; `None` stands for a device that failed to read.
    ///
    /// Returns the sample (its quaternion normalised), or the last good pose at rest and with the time
    /// `time_s` (s), or nothing as long as there was no good one. `elapsed_s`: time since the last call.
    /// Real-time: no allocation.
    pub fn accept_sample(
        &mut self,
        sample: Option<&HandleState>,
        time_s: f64,
        elapsed_s: f64,
    ) -> Option<HandleState> {
        self.since_good_s += elapsed_s.max(0.0);
        let good = sample.and_then(|s| self.judge(s));
        self.is_sample_good = good.is_some();
        if sample.is_none() {
            self.events.samples_missing += 1;
        }
        if good.is_some() {
            self.last_good = good;
            self.since_good_s = 0.0;
            return good;
        }
        self.last_good.map(|held| HandleState {
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            time_s,
            ..held
        })
    }

    /// Judges the simulation's wrench on the handle and returns what may be rendered.
    ///
    /// `elapsed_s`: the period, which is what the rates and the decay are counted by. The result is
    /// finite and within the limits for whatever comes in. Real-time: no allocation.
    pub fn accept_wrench(&mut self, wanted: &Wrench, elapsed_s: f64) -> Wrench {
        let elapsed_s = elapsed_s.max(0.0);
        let is_finite = wanted.is_finite();
        self.events.wrenches_non_finite += u64::from(!is_finite);
        if !is_finite || !self.is_sample_good {
            return self.decay(elapsed_s);
        }
        let s = &self.settings;
        let clamped = Wrench::new(
            limit_length(wanted.force, s.force_max),
            limit_length(wanted.torque, s.torque_max),
        );
        let last = self.last_wrench;
        let limited = Wrench::new(
            approach(last.force, clamped.force, s.force_rate_max * elapsed_s),
            approach(last.torque, clamped.torque, s.torque_rate_max * elapsed_s),
        );
        self.events.wrenches_clamped += u64::from(clamped != *wanted);
        self.events.wrenches_rate_limited += u64::from(limited != clamped);
        self.last_wrench = limited;
        limited
    }

    /// Lets the last wrench go towards zero for `elapsed_s`, and returns it: exactly zero after at most
    /// `decay_s`. Real-time: no allocation.
    pub fn decay(&mut self, elapsed_s: f64) -> Wrench {
        let s = &self.settings;
        let share = elapsed_s.max(0.0) / s.decay_s;
        self.last_wrench = Wrench::new(
            approach(self.last_wrench.force, DVec3::ZERO, s.force_max * share),
            approach(self.last_wrench.torque, DVec3::ZERO, s.torque_max * share),
        );
        self.last_wrench
    }

    /// Says that the last wrench was rendered for `age_s` without a new one.
    ///
    /// Beyond the timeout the device has faded it by itself (see [`HapticDevice`](crate::HapticDevice)),
    /// so the next one rises from there. Real-time: no allocation.
    pub fn after_gap(&mut self, age_s: f64) {
        let gain = self.stall.gain_at_age(age_s);
        if gain < 1.0 {
            self.events.stalls += 1;
            self.last_wrench = self.last_wrench * gain;
        }
    }

    /// The wrench that was let through last.
    #[must_use]
    pub fn last_wrench(&self) -> Wrench {
        self.last_wrench
    }

    /// How often the guard stepped in so far.
    #[must_use]
    pub fn events(&self) -> SafetyEvents {
        self.events
    }

    /// The sample with its quaternion normalised, or nothing, with the reason counted.
    fn judge(&mut self, sample: &HandleState) -> Option<HandleState> {
        if !sample.is_finite() {
            self.events.samples_non_finite += 1;
            return None;
        }
        let off_unit = (sample.pose.rotation.length_squared() - 1.0).abs();
        // A length that overflows is not unit either.
        if off_unit.is_nan() || off_unit > UNIT_TOLERANCE {
            self.events.samples_non_unit += 1;
            return None;
        }
        let mut good = *sample;
        if off_unit > 4.0 * f64::EPSILON {
            good.pose.rotation = good.pose.rotation.normalize();
        }
        let s = &self.settings;
        let mut is_too_fast = good.linear_velocity.length() > s.speed_max
            || good.angular_velocity.length() > s.angular_speed_max;
        if let Some(last) = &self.last_good {
            if good.time_s < last.time_s {
                self.events.samples_back_in_time += 1;
                return None;
            }
            let way = (good.pose.translation - last.pose.translation).length();
            let turn = last.pose.rotation.angle_between(good.pose.rotation);
            is_too_fast |= way > s.speed_max * self.since_good_s
                || turn > s.angular_speed_max * self.since_good_s;
        }
        if is_too_fast {
            self.events.samples_too_fast += 1;
            return None;
        }
        Some(good)
    }
}

/// From `from` towards `to`, by no more than `step` in length.
fn approach(from: DVec3, to: DVec3, step: f64) -> DVec3 {
    let way = to - from;
    if way.length() <= step {
        to
    } else {
        from + limit_length(way, step)
    }
}

/// Fades what has not been renewed: full until the timeout, then smoothly to zero.
///
/// ```text
/// gain
///  1 ───────────╮
///               │╲         1 − (3x² − 2x³),  x = (age − timeout)/ramp
///  0            │ ╰──────
///            timeout  timeout + ramp        age
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watchdog {
    timeout_s: f64,
    ramp_s: f64,
    fed_s: f64,
}

impl Watchdog {
    /// Age at which a wrench is stale by default, s: twenty periods at 1 kHz.
    pub const TIMEOUT_S: f64 = 0.02;

    /// Time in which it then goes to zero by default, s.
    pub const RAMP_S: f64 = 0.05;

    /// A watchdog fed at time 0.
    ///
    /// # Errors
    /// Where a time is not finite or not above 0.
    pub fn new(timeout_s: f64, ramp_s: f64) -> Result<Self, DeviceError> {
        check_positive("stall_timeout_s", timeout_s)?;
        check_positive("stall_ramp_s", ramp_s)?;
        Ok(Self {
            timeout_s,
            ramp_s,
            fed_s: 0.0,
        })
    }

    /// That of a link: full for 20 ms, gone after 50 ms.
    #[must_use]
    pub(crate) fn for_link() -> Self {
        Self {
            timeout_s: Self::TIMEOUT_S,
            ramp_s: 0.03,
            fed_s: 0.0,
        }
    }

    /// Says that a new value came at `time_s`, s.
    pub fn feed(&mut self, time_s: f64) {
        self.fed_s = time_s;
    }

    /// Factor in [0, 1] for the value at `time_s`, s. A time before the last feeding counts as a new
    /// beginning; a time that is not a number gives 0.
    pub fn gain(&mut self, time_s: f64) -> f64 {
        if time_s < self.fed_s {
            self.fed_s = time_s;
        }
        self.gain_at_age(time_s - self.fed_s)
    }

    /// Factor in [0, 1] for a value of this age, s.
    #[must_use]
    pub fn gain_at_age(&self, age_s: f64) -> f64 {
        if age_s.is_nan() {
            return 0.0;
        }
        let x = ((age_s - self.timeout_s) / self.ramp_s).clamp(0.0, 1.0);
        1.0 - x * x * (3.0 - 2.0 * x)
    }
}

impl Default for Watchdog {
    fn default() -> Self {
        Self {
            timeout_s: Self::TIMEOUT_S,
            ramp_s: Self::RAMP_S,
            fed_s: 0.0,
        }
    }
}

#[cfg(test)]
mod tests;

//! What the device reports: samples that cannot be are not passed on.

use glam::DVec3;

use super::events::SafetyEvents;
use crate::error::{DeviceError, check_positive};
use crate::haptic_device::{HandPresence, HandleState, Readiness};

/// How far the square of a quaternion's length may be from 1. A device's own rounding to 16 bits gives
/// 3e-5; beyond 1e-3 the sample is rejected, below it is normalised. Dimensionless.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Time constant of the speed that is judged from positions, s: a link slower than the loop moves by leaps.
const SPEED_WINDOW_S: f64 = 0.02;

/// Judges samples and keeps the last good one.
#[derive(Debug, Clone)]
pub(super) struct SampleCheck {
    speed_max: f64,
    angular_speed_max: f64,
    last_good: Option<HandleState>,
    since_good_s: f64,
    is_good: bool,
    /// Of the newest sample, good or not.
    hand: HandPresence,
    readiness: Readiness,
    /// Leaky means of the ways over time, m/s and rad/s.
    mean_speed: f64,
    mean_angular_speed: f64,
}

impl SampleCheck {
    pub(super) fn new(speed_max: f64, angular_speed_max: f64) -> Result<Self, DeviceError> {
        check_positive("speed_max", speed_max)?;
        check_positive("angular_speed_max", angular_speed_max)?;
        Ok(Self {
            speed_max,
            angular_speed_max,
            last_good: None,
            since_good_s: 0.0,
            is_good: false,
            hand: HandPresence::Unknown,
            readiness: Readiness::Ready,
            mean_speed: 0.0,
            mean_angular_speed: 0.0,
        })
    }

    /// The sample, its quaternion normalised; or the last good pose at rest; or nothing as long as there was none.
    pub(super) fn pass(
        &mut self,
        sample: Option<&HandleState>,
        time_s: f64,
        elapsed_s: f64,
        events: &mut SafetyEvents,
    ) -> Option<HandleState> {
        self.since_good_s += elapsed_s.max(0.0);
        if let Some(sample) = sample {
            (self.hand, self.readiness) = (sample.hand, sample.readiness);
        }
        let good = sample.and_then(|s| self.judge(s, events));
        self.is_good = good.is_some();
        if sample.is_none() {
            events.samples_missing += 1;
        }
        if let Some(good) = &good {
            self.follow_speed(good);
            self.last_good = Some(*good);
            self.since_good_s = 0.0;
            return Some(*good);
        }
        self.last_good.map(|held| HandleState {
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            time_s,
            hand: self.hand,
            readiness: self.readiness,
            ..held
        })
    }

    /// Was the newest sample good?
    pub(super) fn is_good(&self) -> bool {
        self.is_good
    }

    /// Time since the last good sample, s; 0 where the newest is good.
    pub(super) fn silent_s(&self) -> f64 {
        self.since_good_s
    }

    /// What the newest sample says of hand and device.
    pub(super) fn condition(&self) -> (HandPresence, Readiness) {
        (self.hand, self.readiness)
    }

    /// Speed (m/s) and angular speed (rad/s) of the handle, the larger of what the device says and what its
    /// positions say: not every device tells its velocity.
    pub(super) fn speeds(&self) -> (f64, f64) {
        let told = self.last_good.map_or((0.0, 0.0), |s| {
            (s.linear_velocity.length(), s.angular_velocity.length())
        });
        (
            told.0.max(self.mean_speed),
            told.1.max(self.mean_angular_speed),
        )
    }

    fn follow_speed(&mut self, good: &HandleState) {
        let Some(last) = &self.last_good else {
            return;
        };
        let total = SPEED_WINDOW_S + self.since_good_s;
        let way = (good.pose.translation - last.pose.translation).length();
        let turn = last.pose.rotation.angle_between(good.pose.rotation);
        self.mean_speed = (self.mean_speed * SPEED_WINDOW_S + way) / total;
        self.mean_angular_speed = (self.mean_angular_speed * SPEED_WINDOW_S + turn) / total;
    }

    /// The sample with its quaternion normalised, or nothing, with the reason counted.
    fn judge(&self, sample: &HandleState, events: &mut SafetyEvents) -> Option<HandleState> {
        if !sample.is_finite() {
            events.samples_non_finite += 1;
            return None;
        }
        let off_unit = (sample.pose.rotation.length_squared() - 1.0).abs();
        // A length that overflows is not unit either.
        if off_unit.is_nan() || off_unit > UNIT_TOLERANCE {
            events.samples_non_unit += 1;
            return None;
        }
        let mut good = *sample;
        if off_unit > 4.0 * f64::EPSILON {
            good.pose.rotation = good.pose.rotation.normalize();
        }
        let mut is_too_fast = good.linear_velocity.length() > self.speed_max
            || good.angular_velocity.length() > self.angular_speed_max;
        if let Some(last) = &self.last_good {
            if good.time_s < last.time_s {
                events.samples_back_in_time += 1;
                return None;
            }
            let way = (good.pose.translation - last.pose.translation).length();
            let turn = last.pose.rotation.angle_between(good.pose.rotation);
            is_too_fast |= way > self.speed_max * self.since_good_s
                || turn > self.angular_speed_max * self.since_good_s;
        }
        if is_too_fast {
            events.samples_too_fast += 1;
            return None;
        }
        Some(good)
    }
}

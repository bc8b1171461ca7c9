//! How fast forces and torques may change: rises slowly enough for the hand, falls as fast as a snap.

use glam::DVec3;

use crate::error::{DeviceError, check_not_negative, check_positive, check_setting};
use crate::wrench::{Wrench, limit_length};

use super::events::SafetyEvents;

/// A vector that follows another no faster than its rates allow.
#[derive(Debug, Clone)]
pub(super) struct Slew {
    last: DVec3,
    /// Largest value, for the rate of the decay.
    max: f64,
    /// Per s.
    rise: f64,
    /// Towards zero, per s; `None`: as the rise.
    fall: Option<f64>,
}

impl Slew {
    fn new(max: f64, rise: f64, fall: Option<f64>) -> Self {
        Self {
            last: DVec3::ZERO,
            max,
            rise,
            fall,
        }
    }

    /// Towards `to` for `elapsed_s`.
    ///
    /// ```text
    /// last ──────────> part of `to` along last, not beyond zero ──────────> to
    ///        fall                                                 rise
    /// ```
    /// Both legs stay within the largest of the two lengths.
    fn follow(&mut self, to: DVec3, elapsed_s: f64) -> DVec3 {
        let mut from = self.last;
        if let Some(fall) = self.fall {
            let length = self.last.length();
            if length > 0.0 {
                let along = self.last / length;
                let kept = to.dot(along).clamp(0.0, length);
                let fallen = length - fall * elapsed_s;
                if fallen > kept {
                    self.last = along * fallen;
                    return self.last;
                }
                from = along * kept;
            }
        }
        self.last = approach(from, to, self.rise * elapsed_s);
        self.last
    }

    /// Towards zero for `elapsed_s`: from the largest value within `decay_s`.
    fn decay(&mut self, elapsed_s: f64, decay_s: f64) {
        self.last = approach(self.last, DVec3::ZERO, self.max * (elapsed_s / decay_s));
    }
}

/// The rates of force and torque, and the way to zero.
#[derive(Debug, Clone)]
pub(super) struct SlewLimit {
    force: Slew,
    torque: Slew,
    decay_s: f64,
}

/// Largest force or torque with the rates of its changes: N or N m, and the same per s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates {
    pub(super) max: f64,
    pub(super) rise: f64,
    pub(super) fall: Option<f64>,
}

impl SlewLimit {
    pub(super) fn new(force: Rates, torque: Rates, decay_s: f64) -> Result<Self, DeviceError> {
        check_not_negative("force_max", force.max)?;
        check_not_negative("torque_max", torque.max)?;
        check_rate("force_rate_max", force.max, force.rise)?;
        check_rate("torque_rate_max", torque.max, torque.rise)?;
        check_rate(
            "force_fall_rate_max",
            force.max,
            force.fall.unwrap_or(force.rise),
        )?;
        check_rate(
            "torque_fall_rate_max",
            torque.max,
            torque.fall.unwrap_or(torque.rise),
        )?;
        check_positive("decay_s", decay_s)?;
        Ok(Self {
            force: Slew::new(force.max, force.rise, force.fall),
            torque: Slew::new(torque.max, torque.rise, torque.fall),
            decay_s,
        })
    }

    /// Towards the wanted wrench for `elapsed_s`. Counted where it is not reached.
    pub(super) fn pass(
        &mut self,
        wanted: &Wrench,
        elapsed_s: f64,
        events: &mut SafetyEvents,
    ) -> Wrench {
        let limited = Wrench::new(
            self.force.follow(wanted.force, elapsed_s),
            self.torque.follow(wanted.torque, elapsed_s),
        );
        events.wrenches_rate_limited += u64::from(limited != *wanted);
        limited
    }

    /// Towards zero for `elapsed_s`, within the decay time.
    pub(super) fn decay(&mut self, elapsed_s: f64) -> Wrench {
        self.force.decay(elapsed_s, self.decay_s);
        self.torque.decay(elapsed_s, self.decay_s);
        self.last()
    }

    /// Shortens what is held to these lengths, N and N m.
    pub(super) fn keep_within(&mut self, force: f64, torque: f64) -> Wrench {
        self.force.last = limit_length(self.force.last, force);
        self.torque.last = limit_length(self.torque.last, torque);
        self.last()
    }

    /// Weakens what is held by a factor.
    pub(super) fn fade(&mut self, gain: f64) {
        self.force.last *= gain;
        self.torque.last *= gain;
    }

    /// What was let through last.
    pub(super) fn last(&self) -> Wrench {
        Wrench::new(self.force.last, self.torque.last)
    }
}

/// A rate must be above 0, or nothing could ever fall again; with a largest value of 0 there is nothing to fall.
fn check_rate(name: &'static str, max: f64, rate: f64) -> Result<(), DeviceError> {
    check_setting(
        name,
        rate,
        rate.is_finite() && (rate > 0.0 || (rate == 0.0 && max == 0.0)),
        "finite and above 0",
    )
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

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-3;

    /// 1 N per period up, 10 N down, from a largest force of 50 N.
    fn slew(last: DVec3) -> Slew {
        Slew {
            last,
            ..Slew::new(50.0, 1e3, Some(1e4))
        }
    }

    #[test]
    fn rise_is_slow_and_fall_is_fast() {
        let mut slew = slew(DVec3::ZERO);
        for k in 1..=20 {
            let risen = slew.follow(DVec3::X * 100.0, T);
            assert!((risen.x - f64::from(k)).abs() < 1e-12);
        }
        assert!((slew.follow(DVec3::ZERO, T).x - 10.0).abs() < 1e-12);
        assert!(slew.follow(DVec3::ZERO, T).length() < 1e-12);
    }

    #[test]
    fn fall_to_a_smaller_force_takes_one_period_where_the_rate_allows_it() {
        let mut slew = slew(DVec3::X * 20.0);
        assert_eq!(slew.follow(DVec3::X * 12.0, T), DVec3::X * 12.0);
    }

    #[test]
    fn reversal_falls_fast_to_zero_and_rises_slowly_beyond() {
        let mut slew = slew(DVec3::X * 8.0);
        assert!((slew.follow(DVec3::X * -20.0, T).x + 1.0).abs() < 1e-12);
        assert!((slew.follow(DVec3::X * -20.0, T).x + 2.0).abs() < 1e-12);
    }

    #[test]
    fn turn_of_the_force_is_a_rise_across_and_a_fall_along() {
        let mut slew = slew(DVec3::X * 8.0);
        let turned = slew.follow(DVec3::Y * 8.0, T);
        assert!((turned - DVec3::Y).length() < 1e-12, "{turned}");
    }

    #[test]
    fn path_never_leaves_the_ball_of_its_ends() {
        let mut slew = slew(DVec3::ZERO);
        let mut bits = 12345_u64;
        let mut random = || {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            (bits >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for _ in 0..20_000 {
            let to = DVec3::new(random(), random(), random()) * 60.0;
            let before = slew.last;
            let after = slew.follow(to, T);
            let largest = before.length().max(to.length());
            assert!(after.length() <= largest * (1.0 + 1e-14));
            // One leg down and one up.
            assert!((after - before).length() <= 11.0 + 1e-9);
        }
    }

    #[test]
    fn decay_ends_at_zero_exactly_within_its_time() {
        let mut slew = slew(DVec3::new(30.0, 40.0, 0.0));
        let mut last = 50.0;
        // One period more: sums of periods are not exact.
        for _ in 0..51 {
            slew.decay(T, 0.05);
            assert!(slew.last.length() < last || last == 0.0);
            last = slew.last.length();
        }
        assert_eq!(slew.last, DVec3::ZERO);
    }

    #[test]
    fn rate_of_zero_is_refused_unless_there_is_nothing_to_change() {
        let rates = |max, rise, fall| Rates { max, rise, fall };
        let name = |force, torque| match SlewLimit::new(force, torque, 0.05) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        let good = rates(1.0, 1.0, None);
        assert!(SlewLimit::new(good, rates(0.0, 0.0, Some(0.0)), 0.05).is_ok());
        assert_eq!(name(rates(1.0, 0.0, None), good), "force_rate_max");
        assert_eq!(
            name(rates(1.0, 1.0, Some(0.0)), good),
            "force_fall_rate_max"
        );
        assert_eq!(name(good, rates(1.0, f64::NAN, None)), "torque_rate_max");
        assert_eq!(
            name(good, rates(1.0, 1.0, Some(-1.0))),
            "torque_fall_rate_max"
        );
    }
}

//! The motion a simulated hand intends: approach, hold, pull out.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_not_negative, check_positive, check_setting};

/// Part of travel/speed spent on the smooth start, and again on the smooth stop. Dimensionless; with
/// 0.1 the full speed is held over 90 % of the travel. Nominal range 0.05 to 0.5.
const RAMP_FRACTION: f64 = 0.1;

/// Longest scripted motion, s (a day). Beyond it a mistaken unit is likelier than a purpose.
const DURATION_MAX_S: f64 = 86_400.0;

/// An insertion as it is written down: from a start pose straight along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Insertion {
    /// Pose of the handle before the approach, in the device's frame.
    pub start: DPose3,
    /// Direction of the approach in the device's frame; any length but zero.
    pub direction: DVec3,
    /// Speed of the approach and of the retraction, m/s, above 0.
    pub speed: f64,
    /// Length of the approach, m, 0 or above.
    pub travel: f64,
    /// Time held at the end of the approach, s, 0 or above.
    pub hold_s: f64,
    /// Does the hand pull back to the start after the hold?
    pub retract: bool,
}

/// What the hand is about at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Moving along the direction.
    Approach,
    /// Holding at the end of the travel.
    Hold,
    /// Moving back to the start.
    Retract,
    /// The script has ended; the hand rests where it is.
    Done,
}

/// Where the hand wants the handle at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Wanted pose in the device's frame.
    pub pose: DPose3,
    /// Wanted velocity of the handle point, m/s.
    pub linear_velocity: DVec3,
    /// Wanted angular velocity, rad/s.
    pub angular_velocity: DVec3,
}

/// A checked motion: target pose and velocity as a function of time.
///
/// The speed rises and falls with zero acceleration at both ends of each ramp:
///
/// ```text
/// v
/// │   ╭───────────╮
/// │  ╱             ╲          hold         (mirrored: retract)
/// └─╯───────────────╰──────────────────── t
///   ramp            ramp      ramp = 0.1 travel/speed, approach = 1.1 travel/speed
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Script {
    start: DPose3,
    direction: DVec3,
    speed: f64,
    travel: f64,
    ramp_s: f64,
    approach_s: f64,
    hold_s: f64,
    retract: bool,
}

impl Script {
    /// Checks an insertion and makes it a script.
    ///
    /// # Errors
    /// Where a number is not finite or outside its range, the direction has no length, or the motion
    /// would take longer than a day.
    pub fn new(insertion: &Insertion) -> Result<Self, DeviceError> {
        let &Insertion {
            start,
            direction,
            speed,
            travel,
            hold_s,
            retract,
        } = insertion;
        let is_pose = start.translation.is_finite() && start.rotation.is_normalized();
        check_setting(
            "start",
            start.rotation.length(),
            is_pose,
            "a finite position with a unit quaternion",
        )?;
        check_positive("speed", speed)?;
        check_not_negative("travel", travel)?;
        check_not_negative("hold_s", hold_s)?;
        let unit = direction
            .try_normalize()
            .ok_or(DeviceError::InvalidSetting {
                name: "direction",
                value: direction.length(),
                allowed: "a finite vector with a length",
            })?;
        let ramp_s = RAMP_FRACTION * travel / speed;
        let script = Self {
            start,
            direction: unit,
            speed,
            travel,
            ramp_s,
            approach_s: travel / speed + ramp_s,
            hold_s,
            retract,
        };
        let duration = script.duration_s();
        check_setting(
            "duration",
            duration,
            duration <= DURATION_MAX_S,
            "at most 86400 s: raise the speed or shorten travel and hold_s",
        )?;
        Ok(script)
    }

    /// Pose before the approach.
    #[must_use]
    pub fn start(&self) -> DPose3 {
        self.start
    }

    /// Unit direction of the approach in the device's frame.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// Length of the approach, m.
    #[must_use]
    pub fn travel(&self) -> f64 {
        self.travel
    }

    /// Time from the start to the end of the script, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let ways = if self.retract { 2.0 } else { 1.0 };
        ways * self.approach_s + self.hold_s
    }

    /// Periods of length `period_s` that cover the script, with both ends.
    #[must_use]
    pub fn periods(&self, period_s: f64) -> u64 {
        // Float to integer saturates, so a nonsensical period gives a number and no panic.
        (self.duration_s() / period_s).ceil() as u64 + 1
    }

    /// What the hand is about at time `time_s` since the start.
    #[must_use]
    pub fn phase(&self, time_s: f64) -> Phase {
        let held = self.approach_s + self.hold_s;
        if time_s < self.approach_s {
            Phase::Approach
        } else if time_s < held {
            Phase::Hold
        } else if self.retract && time_s < held + self.approach_s {
            Phase::Retract
        } else {
            Phase::Done
        }
    }

    /// Wanted travel along the direction (m) and its rate (m/s) at time `time_s` since the start.
    #[must_use]
    pub fn travel_at(&self, time_s: f64) -> (f64, f64) {
        match self.phase(time_s) {
            Phase::Approach => self.one_way(time_s),
            Phase::Hold => (self.travel, 0.0),
            Phase::Retract => {
                let (s, v) = self.one_way(time_s - self.approach_s - self.hold_s);
                (self.travel - s, -v)
            }
            Phase::Done if self.retract => (0.0, 0.0),
            Phase::Done => (self.travel, 0.0),
        }
    }

    /// Wanted pose and velocity at time `time_s` since the start. Does not allocate.
    #[must_use]
    pub fn target(&self, time_s: f64) -> Target {
        let (s, v) = self.travel_at(time_s);
        Target {
            pose: DPose3::from_parts(
                self.start.translation + self.direction * s,
                self.start.rotation,
            ),
            linear_velocity: self.direction * v,
            angular_velocity: DVec3::ZERO,
        }
    }

    /// Way and speed of one approach at its own time.
    fn one_way(&self, t: f64) -> (f64, f64) {
        if t <= 0.0 {
            (0.0, 0.0)
        } else if t < self.ramp_s {
            // v = speed (3x² − 2x³), its integral over the ramp is half the way at full speed.
            let x = t / self.ramp_s;
            let way = self.speed * self.ramp_s * x * x * x * (1.0 - 0.5 * x);
            (way, self.speed * x * x * (3.0 - 2.0 * x))
        } else if t <= self.approach_s - self.ramp_s {
            (self.speed * (t - 0.5 * self.ramp_s), self.speed)
        } else if t < self.approach_s {
            let (left, v) = self.one_way(self.approach_s - t);
            (self.travel - left, v)
        } else {
            (self.travel, 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn insertion() -> Insertion {
        Insertion {
            start: DPose3::new(DVec3::new(0.0, 0.01, 0.02), DVec3::new(0.1, 0.0, 0.0)),
            direction: DVec3::new(0.0, 0.0, -2.0),
            speed: 0.05,
            travel: 0.02,
            hold_s: 0.1,
            retract: true,
        }
    }

    #[test]
    fn script_goes_there_holds_and_comes_back() {
        let script = Script::new(&insertion()).unwrap();
        // 0.02/0.05 = 0.4 s, with the ramps 0.44 s each way.
        assert!((script.duration_s() - 0.98).abs() < 1e-12);
        assert_eq!(script.periods(0.01), 99);
        assert_eq!(script.direction(), DVec3::NEG_Z);
        assert_eq!(script.travel_at(-1.0), (0.0, 0.0));
        assert_eq!(script.travel_at(0.5), (0.02, 0.0));
        assert_eq!(script.travel_at(2.0), (0.0, 0.0));
        assert_eq!(script.phase(0.1), Phase::Approach);
        assert_eq!(script.phase(0.5), Phase::Hold);
        assert_eq!(script.phase(0.6), Phase::Retract);
        assert_eq!(script.phase(0.99), Phase::Done);
        let middle = script.target(0.22);
        assert!((middle.pose.translation - DVec3::new(0.0, 0.01, 0.01)).length() < 1e-15);
        assert!((middle.linear_velocity - DVec3::new(0.0, 0.0, -0.05)).length() < 1e-15);
    }

    #[test]
    fn script_without_retraction_stays_at_the_end() {
        let script = Script::new(&Insertion {
            retract: false,
            ..insertion()
        })
        .unwrap();
        assert_eq!(script.phase(0.6), Phase::Done);
        assert_eq!(script.travel_at(9.0), (0.02, 0.0));
    }

    #[test]
    fn script_rate_is_the_derivative_of_its_way_and_never_above_the_speed() {
        let script = Script::new(&insertion()).unwrap();
        let h = 1e-6;
        for k in 0..200 {
            let t = 0.005 * f64::from(k) + 0.0021;
            let (_, v) = script.travel_at(t);
            let slope = (script.travel_at(t + h).0 - script.travel_at(t - h).0) / (2.0 * h);
            assert!((v - slope).abs() < 1e-6, "t {t}: {v} {slope}");
            assert!(v.abs() <= 0.05);
        }
    }

    #[test]
    fn script_of_no_travel_only_holds() {
        let script = Script::new(&Insertion {
            travel: 0.0,
            ..insertion()
        })
        .unwrap();
        assert_eq!(script.duration_s(), 0.1);
        assert_eq!(script.phase(0.0), Phase::Hold);
        assert_eq!(script.travel_at(0.0), (0.0, 0.0));
    }

    #[test]
    fn script_refuses_each_bad_number_by_name() {
        let refused = |change: fn(&mut Insertion)| {
            let mut written = insertion();
            change(&mut written);
            match Script::new(&written) {
                Err(DeviceError::InvalidSetting { name, .. }) => name,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(refused(|i| i.speed = 0.0), "speed");
        assert_eq!(refused(|i| i.travel = -0.1), "travel");
        assert_eq!(refused(|i| i.hold_s = f64::NAN), "hold_s");
        assert_eq!(refused(|i| i.direction = DVec3::ZERO), "direction");
        assert_eq!(refused(|i| i.speed = 1e-9), "duration");
        assert_eq!(refused(|i| i.start.translation.x = f64::NAN), "start");
        assert_eq!(refused(|i| i.start.rotation.w = 3.0), "start");
    }
}

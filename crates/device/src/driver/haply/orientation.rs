//! Orientation of a grip that tells it some tens of times a second, made smooth.

use glam::{DQuat, DVec3};

use crate::wrench::{limit_length, rotation_from_vector, rotation_vector};

/// Time constant of the smoothing, s: about the time between two values of a grip. Less shows the steps, more is
/// felt as a tool that lags behind the hand. Nominal 0.01 to 0.05.
const FOLLOW_S: f64 = 0.025;

/// Fastest turn that is followed, rad/s: a hand does not turn faster, a grip that wakes up jumps.
const TURN_MAX: f64 = 30.0;

/// Follows an orientation, and knows its rate.
///
/// ```text
/// w = log(target · q⁻¹)/τ, no longer than TURN_MAX     q' = exp(w dt) q, dt ≪ τ
/// ```
#[derive(Debug, Clone, Default)]
pub(super) struct Follower {
    now: Option<DQuat>,
}

impl Follower {
    /// Goes towards `target` for `elapsed_s`; returns where it is and its angular velocity, rad/s, in the axes of
    /// the device's frame. The first target is taken as it is.
    pub(super) fn follow(&mut self, target: DQuat, elapsed_s: f64) -> (DQuat, DVec3) {
        let Some(now) = self.now.filter(|_| elapsed_s > 0.0) else {
            let there = self.now.unwrap_or(target);
            self.now = Some(there);
            return (there, DVec3::ZERO);
        };
        let share = 1.0 - (-elapsed_s / FOLLOW_S).exp();
        let turn = rotation_vector(target * now.conjugate()) * share;
        let turn = limit_length(turn, TURN_MAX * elapsed_s);
        let there = (rotation_from_vector(turn) * now).normalize();
        self.now = Some(there);
        (there, turn / elapsed_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 5e-4;

    #[test]
    fn first_orientation_is_taken_and_a_resting_one_stays() {
        let q = DQuat::from_rotation_z(0.7);
        let mut follower = Follower::default();
        assert_eq!(follower.follow(q, T), (q, DVec3::ZERO));
        let (there, rate) = follower.follow(q, T);
        assert!(there.angle_between(q) < 1e-12 && rate.length() < 1e-12);
        // No time has passed: nothing moves.
        let (there, rate) = follower.follow(DQuat::IDENTITY, 0.0);
        assert!(there.angle_between(q) < 1e-12 && rate == DVec3::ZERO);
    }

    #[test]
    fn steady_turn_told_at_30_hz_is_followed_smoothly() {
        // 2 rad/s about z, told every 33 ms: the follower turns at 2 rad/s on average and lags behind by its time
        // constant and half the time between two values, (25 + 16.5) ms · 2 rad/s = 0.083 rad.
        let mut follower = Follower::default();
        let mut told = DQuat::IDENTITY;
        let (mut slowest, mut fastest, mut lag) = (f64::MAX, 0.0_f64, 0.0);
        let mut samples = 0.0;
        for n in 0..4000_u32 {
            let time = f64::from(n) * T;
            if n % 66 == 0 {
                told = DQuat::from_rotation_z(2.0 * time);
            }
            let (there, rate) = follower.follow(told, T);
            if time > 0.5 {
                slowest = slowest.min(rate.z);
                fastest = fastest.max(rate.z);
                lag += there.angle_between(DQuat::from_rotation_z(2.0 * time));
                samples += 1.0;
                assert!(rate.x.abs() < 1e-9 && rate.y.abs() < 1e-9);
            }
        }
        assert!((lag / samples - 0.083).abs() < 0.005, "{}", lag / samples);
        // A difference of the told values would be 0 most of the time and 132 rad/s at each new one.
        assert!(slowest > 0.8 && fastest < 4.0, "{slowest} {fastest}");
    }

    #[test]
    fn jump_is_followed_no_faster_than_a_hand_turns() {
        let mut follower = Follower::default();
        follower.follow(DQuat::IDENTITY, T);
        let target = DQuat::from_rotation_x(3.1);
        for _ in 0..400 {
            let (_, rate) = follower.follow(target, T);
            assert!(rate.length() <= TURN_MAX * (1.0 + 1e-9));
        }
        let (there, _) = follower.follow(target, T);
        assert!(there.angle_between(target) < 0.05);
    }

    #[test]
    fn both_quaternions_of_one_rotation_are_the_same_target() {
        let q = DQuat::from_rotation_y(0.3);
        let mut follower = Follower::default();
        follower.follow(q, T);
        let (there, rate) = follower.follow(-q, T);
        assert!(rate.length() < 1e-9 && there.angle_between(q) < 1e-9);
    }
}

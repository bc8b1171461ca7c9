//! How fast the handle turns, from how it stood: what the library says of it comes in axes that are not stated.

use std::collections::VecDeque;
use std::time::Instant;

use glam::{DQuat, DVec3};

use crate::wrench::rotation_vector;

/// Time over which the turn is taken, s: over one frame alone the steps of the encoders would be most of it.
const WINDOW_S: f64 = 0.020;

/// Poses that are kept at most; the window holds 20 frames of 1 ms.
const KEPT_MAX: usize = 64;

/// The last poses, the oldest at the front.
#[derive(Debug, Default)]
pub(super) struct Turn(VecDeque<(Instant, DQuat)>);

impl Turn {
    /// Takes in how the handle stands and returns how fast it turns, rad/s, in the axes of the device.
    ///
    /// ```text
    /// w = log(q q_old⁻¹)/(t − t_old)
    /// ```
    pub(super) fn follow(&mut self, at: Instant, rotation: DQuat) -> DVec3 {
        let age_s = |old: Instant| at.saturating_duration_since(old).as_secs_f64();
        let is_old = |kept: &(Instant, DQuat)| age_s(kept.0) > WINDOW_S;
        while self.0.len() >= KEPT_MAX || self.0.front().is_some_and(is_old) {
            self.0.pop_front();
        }
        let rate = match self.0.front() {
            Some((then, old)) if age_s(*then) > 0.0 => {
                rotation_vector(rotation * old.inverse()) / age_s(*then)
            }
            _ => DVec3::ZERO,
        };
        self.0.push_back((at, rotation));
        rate
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn steady_turn_has_its_speed_about_its_axis() {
        let axis = DVec3::new(0.36, -0.48, 0.8);
        let begun = Instant::now();
        let mut turn = Turn::default();
        for i in 0..100 {
            let at = begun + Duration::from_millis(i);
            let angle = 7.0 * i as f64 * 1e-3;
            let rate = turn.follow(at, DQuat::from_axis_angle(axis, angle));
            if i > 0 {
                assert!((rate - 7.0 * axis).length() < 1e-9, "{i}: {rate}");
            }
        }
        assert!(turn.0.len() <= 21);
    }

    #[test]
    fn first_pose_after_a_gap_and_two_at_one_time_do_not_turn() {
        let begun = Instant::now();
        let mut turn = Turn::default();
        assert_eq!(turn.follow(begun, DQuat::IDENTITY), DVec3::ZERO);
        let other = DQuat::from_rotation_x(1.0);
        assert_eq!(turn.follow(begun, other), DVec3::ZERO);
        let late = begun + Duration::from_secs(1);
        assert_eq!(turn.follow(late, DQuat::IDENTITY), DVec3::ZERO);
        for _ in 0..1000 {
            turn.follow(late, other);
        }
        assert!(turn.0.len() <= KEPT_MAX);
    }
}

//! Velocity from poses: the difference over a window.

use std::collections::VecDeque;
use std::time::Instant;

use glam::DVec3;
use glamx::DPose3;

use crate::wrench::rotation_vector;

/// Length of the window, s. The step of an encoder, 0.055 mm, then shows as 3 mm/s instead of 55 mm/s over one
/// period; the velocity lags by half the window.
const WINDOW_S: f64 = 0.02;

/// Least time between two poses from which a velocity is made, s: poses that came in one piece of the stream and bear
/// no time have none between them.
const ELAPSED_MIN_S: f64 = 0.005;

/// Most poses in the window; beyond it the window is shorter.
const POSES_MAX: usize = 64;

/// A gap after which the poses before it say nothing of now, s.
const GAP_MAX_S: f64 = 0.2;

/// Poses of the last moments.
///
/// Times are those of arrival: another machine's clock need not be trusted, and arrival that is uneven by a
/// millisecond makes an error of a twentieth of the velocity, none at rest. Poses that a stall held up come at once,
/// so where the sender's clock says that more time has passed between two, it is believed.
#[derive(Debug, Clone, Default)]
pub(super) struct Window {
    poses: VecDeque<Sample>,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    at: Instant,
    /// Time on the sender's clock, s.
    sent_s: f64,
    pose: DPose3,
}

impl Window {
    /// Adds a pose that came now and was sent at a time of the sender's clock (s). One that is no pose is left out.
    pub(super) fn push(&mut self, at: Instant, sent_s: f64, pose: &DPose3) {
        let off_unit = (pose.rotation.length_squared() - 1.0).abs();
        if !pose.translation.is_finite() || off_unit.is_nan() || off_unit > 1e-3 {
            return;
        }
        let age_s = |sample: &Sample| at.duration_since(sample.at).as_secs_f64();
        if self.poses.back().is_some_and(|s| age_s(s) > GAP_MAX_S) {
            self.poses.clear();
        }
        // The last one beyond the window stays: the difference is taken over at least its length.
        while let Some(second) = self.poses.get(1)
            && (age_s(second) >= WINDOW_S || self.poses.len() >= POSES_MAX)
        {
            self.poses.pop_front();
        }
        let pose = *pose;
        self.poses.push_back(Sample { at, sent_s, pose });
    }

    /// Velocity (m/s) and angular velocity (rad/s); 0 as long as there are no two poses some time apart.
    pub(super) fn velocity(&self) -> (DVec3, DVec3) {
        let (Some(old), Some(new)) = (self.poses.front(), self.poses.back()) else {
            return (DVec3::ZERO, DVec3::ZERO);
        };
        let arrived_s = new.at.duration_since(old.at).as_secs_f64();
        let sent_s = new.sent_s - old.sent_s;
        let is_believed = sent_s > arrived_s && sent_s < GAP_MAX_S;
        let elapsed_s = if is_believed { sent_s } else { arrived_s };
        if elapsed_s < ELAPSED_MIN_S {
            return (DVec3::ZERO, DVec3::ZERO);
        }
        let way = new.pose.translation - old.pose.translation;
        let turn = rotation_vector(new.pose.rotation * old.pose.rotation.conjugate());
        (way / elapsed_s, turn / elapsed_s)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::wrench::rotation_from_vector;

    #[test]
    fn steady_motion_has_its_velocity_at_any_rate() {
        let linear = DVec3::new(0.3, -0.1, 0.05);
        let angular = DVec3::new(0.0, 2.0, -1.0);
        for period_s in [1e-4, 1e-3, 5e-3, 1.0 / 60.0, 0.05] {
            let mut window = Window::default();
            let begun = Instant::now();
            for k in 0..200 {
                let t = f64::from(k) * period_s;
                let pose = DPose3::from_parts(linear * t, rotation_from_vector(angular * t));
                window.push(begun + Duration::from_secs_f64(t), 0.0, &pose);
                assert!(window.poses.len() <= POSES_MAX);
            }
            let (v, w) = window.velocity();
            assert!((v - linear).length() < 1e-3, "{period_s}: {v}");
            assert!((w - angular).length() < 1e-2, "{period_s}: {w}");
        }
    }

    #[test]
    fn poses_that_are_none_and_gaps_leave_no_trace() {
        let begun = Instant::now();
        let at = |ms| begun + Duration::from_millis(ms);
        let x = |x| DPose3::from_translation(DVec3::new(x, 0.0, 0.0));
        let mut window = Window::default();
        assert_eq!(window.velocity(), (DVec3::ZERO, DVec3::ZERO));
        window.push(at(0), 0.0, &x(0.0));
        window.push(at(0), 0.0, &x(0.5));
        assert_eq!(window.velocity().0, DVec3::ZERO);
        let mut window = Window::default();
        window.push(at(0), 0.0, &x(0.0));
        window.push(at(10), 0.0, &x(f64::NAN));
        let mut bent = x(9.0);
        bent.rotation *= 3.0;
        window.push(at(15), 0.0, &bent);
        window.push(at(20), 0.0, &x(0.02));
        assert!((window.velocity().0.x - 1.0).abs() < 1e-9);
        window.push(at(1020), 0.0, &x(7.0));
        assert_eq!(window.velocity().0, DVec3::ZERO);
    }

    #[test]
    fn poses_held_up_by_a_stall_have_the_velocity_of_when_they_were_sent() {
        let begun = Instant::now();
        // 1 m/s at 1 kHz; what is sent from 30 to 129 ms comes at 130 ms.
        let mut window = Window::default();
        for k in 0..200 {
            let sent_s = 1e-3 * f64::from(k);
            let arrived_s = if (30..130).contains(&k) { 0.13 } else { sent_s };
            let pose = DPose3::from_translation(DVec3::new(sent_s, 0.0, 0.0));
            window.push(
                begun + Duration::from_secs_f64(arrived_s),
                5e8 + sent_s,
                &pose,
            );
            let v = window.velocity().0.x;
            assert!(v < 1.01, "{k}: {v}");
            // Of those that come at once only the last is asked for.
            let is_asked = (6..30).contains(&k) || k >= 129;
            assert!(!is_asked || v > 0.9, "{k}: {v}");
        }
        assert!((window.velocity().0.x - 1.0).abs() < 1e-3);
    }
}

//! A velocity from encoder steps, as devices make one.

use glam::DVec3;
use glamx::DPose3;

use crate::wrench::rotation_vector;

/// Differences of the encoded pose, smoothed by a filter of first order.
#[derive(Debug)]
pub(super) struct VelocityFilter {
    window_s: f64,
    last: DPose3,
    linear: DVec3,
    angular: DVec3,
}

impl VelocityFilter {
    /// At rest at a pose; time constant in s.
    pub(super) fn new(window_s: f64, pose: DPose3) -> Self {
        Self {
            window_s,
            last: pose,
            linear: DVec3::ZERO,
            angular: DVec3::ZERO,
        }
    }

    /// Goes on to the pose after a period, s.
    pub(super) fn step(&mut self, pose: &DPose3, period_s: f64) {
        let total = self.window_s + period_s;
        let way = pose.translation - self.last.translation;
        let turn = rotation_vector(pose.rotation * self.last.rotation.inverse());
        self.linear = (self.linear * self.window_s + way) / total;
        self.angular = (self.angular * self.window_s + turn) / total;
        self.last = *pose;
    }

    /// m/s and rad/s.
    pub(super) fn velocities(&self) -> (DVec3, DVec3) {
        (self.linear, self.angular)
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn steady_motion_in_steps_gives_its_velocity_with_little_noise() {
        let mut filter = VelocityFilter::new(5e-3, DPose3::IDENTITY);
        // 0.1 m/s and 2 rad/s, read in steps of 0.055 mm at 10 kHz: one difference alone is 0 or 0.55 m/s.
        for k in 1..=2000 {
            let t = f64::from(k) * 1e-4;
            let x = (0.1 * t / 5.5e-5).round() * 5.5e-5;
            let pose = DPose3::from_parts(DVec3::X * x, DQuat::from_rotation_z(2.0 * t));
            filter.step(&pose, 1e-4);
            if k > 500 {
                let (linear, angular) = filter.velocities();
                assert!((linear.x - 0.1).abs() < 0.012, "{linear}");
                assert!((angular.z - 2.0).abs() < 0.01);
            }
        }
    }
}

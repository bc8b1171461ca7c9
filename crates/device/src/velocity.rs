//! Velocity of a handle from its poses, for devices that report none or only a quantised one.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_setting};
use crate::wrench::rotation_vector;

/// Samples kept per window: they are at least a 32nd of the window apart, so any rate of samples fits.
const PER_WINDOW: usize = 32;

/// Samples in memory: a full window, the one before it, and one to spare.
const CAPACITY: usize = PER_WINDOW + 2;

/// Windows without a sample after which the estimate begins anew: what lies before says nothing of now.
const GAP_WINDOWS: f64 = 5.0;

/// Linear and angular velocity as the mean over a window of the last poses.
///
/// ```text
/// v = (x(t) − x(t − W)) / W        ω = rotvec(R(t) R(t − W)⁻¹) / W        W: window
/// ```
/// A position rounded to steps of D gives a velocity that is wrong by at most D/W: with D = 0.055 mm and W = 20 ms
/// that is 2.75 mm/s, where the difference over one period of 1 ms gives 55 mm/s. The price is a delay of W/2.
/// A steady motion comes out exactly, a spin too as long as it turns by less than π within the window.
///
/// Until the window has filled the handle counts as having been at rest before: the way is divided by the whole
/// window, so the estimate rises to its value and never starts with the noise of one period. Where samples are
/// further apart than the window, the last two are used.
///
/// Fixed memory. Real-time: no allocation.
#[derive(Debug, Clone)]
pub struct VelocityEstimator {
    window_s: f64,
    /// Ring of samples at least a 32nd of the window apart, oldest first.
    ring: [Sample; CAPACITY],
    first: usize,
    len: usize,
    /// The newest sample, in the ring or not.
    newest: Option<Sample>,
    linear: DVec3,
    angular: DVec3,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    pose: DPose3,
    time_s: f64,
}

impl VelocityEstimator {
    /// The usual window, s.
    pub const WINDOW_S: f64 = 0.02;

    /// An estimator over a window, s, that has seen nothing. Nominal 0.01 to 0.05.
    ///
    /// # Errors
    /// Where the window is outside 1e-4 to 1 s.
    pub fn new(window_s: f64) -> Result<Self, DeviceError> {
        check_setting(
            "window_s",
            window_s,
            (1e-4..=1.0).contains(&window_s),
            "from 1e-4 to 1 s",
        )?;
        Ok(Self::over(window_s))
    }

    fn over(window_s: f64) -> Self {
        let nothing = Sample {
            pose: DPose3::IDENTITY,
            time_s: 0.0,
        };
        Self {
            window_s,
            ring: [nothing; CAPACITY],
            first: 0,
            len: 0,
            newest: None,
            linear: DVec3::ZERO,
            angular: DVec3::ZERO,
        }
    }

    /// Takes a pose at its time, s, and returns the linear (m/s) and angular velocity (rad/s), both in the axes of
    /// the pose's frame.
    ///
    /// A pose whose time is not after the last one's, or which is not finite, changes nothing. A time five windows
    /// ahead or back is a gap or another clock: the estimate begins anew, at zero.
    pub fn update(&mut self, pose: &DPose3, time_s: f64) -> (DVec3, DVec3) {
        let sample = Sample {
            pose: *pose,
            time_s,
        };
        if !pose.is_finite() || !time_s.is_finite() {
            return (self.linear, self.angular);
        }
        let Some(last) = self.newest else {
            return self.restart(sample);
        };
        let step_s = time_s - last.time_s;
        if step_s.abs() > GAP_WINDOWS * self.window_s {
            return self.restart(sample);
        }
        if step_s <= 0.0 {
            return (self.linear, self.angular);
        }
        self.newest = Some(sample);
        self.forget_before(time_s - self.window_s);
        let oldest = self.ring[self.first];
        // What overflows is no motion.
        let span_s = (time_s - oldest.time_s).max(self.window_s);
        let linear = (pose.translation - oldest.pose.translation) / span_s;
        let turn = rotation_vector(pose.rotation * oldest.pose.rotation.conjugate());
        if linear.is_finite() && turn.is_finite() {
            self.linear = linear;
            self.angular = turn / span_s;
        }
        self.keep(sample);
        (self.linear, self.angular)
    }

    /// The velocity of the handle point, m/s, as last estimated.
    #[must_use]
    pub fn linear(&self) -> DVec3 {
        self.linear
    }

    /// The angular velocity, rad/s, as last estimated.
    #[must_use]
    pub fn angular(&self) -> DVec3 {
        self.angular
    }

    /// Forgets everything: the handle counts as at rest.
    pub fn reset(&mut self) {
        *self = Self::over(self.window_s);
    }

    fn restart(&mut self, sample: Sample) -> (DVec3, DVec3) {
        self.reset();
        self.newest = Some(sample);
        self.keep(sample);
        (self.linear, self.angular)
    }

    /// Drops the oldest samples as long as the one after them is before a time too, s.
    fn forget_before(&mut self, time_s: f64) {
        while self.len > 1 && self.ring[(self.first + 1) % CAPACITY].time_s <= time_s {
            self.first = (self.first + 1) % CAPACITY;
            self.len -= 1;
        }
    }

    /// Puts a sample into the ring unless the last one there is too near in time.
    fn keep(&mut self, sample: Sample) {
        let last = self.ring[(self.first + self.len.max(1) - 1) % CAPACITY];
        let spacing_s = self.window_s / PER_WINDOW as f64;
        // A little less, so that samples exactly so far apart are all kept, whatever the rounding.
        if self.len > 0 && sample.time_s - last.time_s < 0.999 * spacing_s {
            return;
        }
        if self.len == CAPACITY {
            self.first = (self.first + 1) % CAPACITY;
            self.len -= 1;
        }
        self.ring[(self.first + self.len) % CAPACITY] = sample;
        self.len += 1;
    }
}

impl Default for VelocityEstimator {
    fn default() -> Self {
        Self::over(Self::WINDOW_S)
    }
}

#[cfg(test)]
mod tests;

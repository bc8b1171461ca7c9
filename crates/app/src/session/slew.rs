//! What a new problem says otherwise than the one before is not rendered at once: the difference fades.

use device::Wrench;

/// Time in which a difference fades, s: within the 2 to 5 ms in which a hand does not tell a step from a ramp.
const FADE_S: f64 = 4e-3;

/// Time after which a difference is gone whatever the other bounds say, s.
const LONGEST_S: f64 = 20e-3;

/// Share of the present force that a tick may add to it: the smallest change that is felt is some 7 %.
const SHARE_OF_FORCE: f64 = 0.03;

/// Share of the device's resolution that a tick may add.
const SHARE_OF_RESOLUTION: f64 = 0.5;

/// A difference on its way to nothing.
///
/// ```text
/// step per tick = max(min(d T / 4 ms, 3 % |f|, half the resolution), d T / 20 ms)
/// ```
/// d: size of the difference at the last hand-over (N, torques divided by the lever), T: the period, f: the force.
#[derive(Clone, Copy, Debug)]
pub struct Slew {
    period_s: f64,
    /// N; 0: the device states none.
    resolution: f64,
    /// m, divides torques.
    lever: f64,
    left: Wrench,
    size_at_hand_over: f64,
}

impl Slew {
    /// `resolution`: smallest change of force that the device renders, N, 0 where none is stated. `lever`: divides
    /// torques to compare them with forces, m.
    pub fn new(period_s: f64, resolution: f64, lever: f64) -> Self {
        Self {
            period_s,
            resolution,
            lever,
            left: Wrench::ZERO,
            size_at_hand_over: 0.0,
        }
    }

    /// N, of a wrench: its force, or its torque over the lever.
    pub fn size(&self, wrench: &Wrench) -> f64 {
        let torque = wrench.torque.length() / self.lever;
        wrench.force.length().max(torque)
    }

    /// What has not faded yet.
    pub fn left(&self) -> Wrench {
        self.left
    }

    /// A new problem came: `difference` is what was to be rendered by the old one, with what had not faded, minus
    /// the new one's wrench, at the same target.
    pub fn hand_over(&mut self, difference: Wrench) {
        // What is not finite is stopped before the device; here it must not stay.
        self.left = if difference.is_finite() {
            difference
        } else {
            Wrench::ZERO
        };
        self.size_at_hand_over = self.size(&self.left);
    }

    /// N, the most that the next tick takes away, with `force` (N) rendered now.
    pub fn largest_step(&self, force: f64) -> f64 {
        let per_s = self.size_at_hand_over * self.period_s;
        let mut step = (per_s / FADE_S).min(SHARE_OF_FORCE * force);
        if self.resolution > 0.0 {
            step = step.min(SHARE_OF_RESOLUTION * self.resolution);
        }
        step.max(per_s / LONGEST_S)
    }

    /// Takes one tick's step away and returns what is left.
    pub fn fade(&mut self, force: f64) -> Wrench {
        let size = self.size(&self.left);
        let step = self.largest_step(force);
        self.left = if size > step {
            self.left * (1.0 - step / size)
        } else {
            Wrench::ZERO
        };
        self.left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn newtons(f: f64) -> Wrench {
        Wrench::new(DVec3::new(0.0, f, 0.0), DVec3::ZERO)
    }

    #[test]
    fn small_differences_fade_in_four_milliseconds() {
        let mut slew = Slew::new(1e-3, 0.2, 0.05);
        slew.hand_over(newtons(0.04));
        let left: Vec<f64> = (0..4).map(|_| slew.fade(10.0).force.y).collect();
        for (left, expected) in left.iter().zip([0.03, 0.02, 0.01, 0.0]) {
            assert!((left - expected).abs() < 1e-12, "{left} and {expected}");
        }
        assert_eq!(slew.fade(10.0), Wrench::ZERO);
    }

    #[test]
    fn a_tick_adds_no_more_than_half_the_resolution_or_three_percent() {
        let mut slew = Slew::new(1e-3, 0.2, 0.05);
        slew.hand_over(newtons(1.0));
        // 1 N in 4 ms would be 0.25 N; half the resolution is less, 3 % of 2 N is less still.
        assert!((slew.largest_step(10.0) - 0.1).abs() < 1e-15);
        assert!((slew.largest_step(2.0) - 0.06).abs() < 1e-15);
        // The device states no resolution: 3 % of 5 N.
        let mut fine = Slew::new(1e-3, 0.0, 0.05);
        fine.hand_over(newtons(1.0));
        assert!((fine.largest_step(5.0) - 0.15).abs() < 1e-15);
    }

    #[test]
    fn every_difference_is_gone_after_twenty_milliseconds() {
        // Large, and with no force to hide behind.
        let mut slew = Slew::new(1e-3, 0.2, 0.05);
        slew.hand_over(newtons(30.0));
        let mut last = 30.0;
        for _ in 0..20 {
            let left = slew.fade(0.0).force.y;
            assert!(last - left <= 1.5 + 1e-12);
            last = left;
        }
        assert!(last.abs() < 1e-12, "{last}");
        // A torque counts by its lever, and what is not finite does not stay.
        slew.hand_over(Wrench::new(DVec3::ZERO, DVec3::new(0.0, 0.05, 0.0)));
        assert!((slew.size(&slew.left()) - 1.0).abs() < 1e-12);
        slew.hand_over(newtons(f64::NAN));
        assert_eq!(slew.left(), Wrench::ZERO);
    }
}

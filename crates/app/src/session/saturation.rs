//! The most that a live hand can ask of the part: beyond it the spring between handle and tool gives no more.

use glam::DVec3;

/// Of the largest force of the scene's own way: every peak can be passed.
const SHARE: f64 = 1.5;

/// N, for parts that hardly resist on that way.
const LEAST: f64 = 2.0;

/// A spring whose force has an end.
///
/// ```text
/// target = handle − excess        excess ← excess + Δx + (|f| − f_max)/k along the push, never below 0
/// ```
/// f: force on the handle in the period before, Δx: the handle's way since, k: stiffness of the coupling. While there is
/// an excess the target stands still along the push, whichever way the hand goes; the last term trims it. A hand that no device can hold back (at an
/// end stop, or where the device is at its own limit) would otherwise stretch the coupling without end and drive the tool
/// through the part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Saturation {
    /// N.
    force_max: f64,
    /// N/m.
    stiffness: f64,
    /// m, world.
    excess: DVec3,
    /// m, of the handle in the period before.
    last: Option<DVec3>,
}

impl Saturation {
    /// N, the largest force that is asked for, where the scene's way has that largest force (N).
    pub(super) fn force_max(largest_force: f64) -> f64 {
        (SHARE * largest_force).max(LEAST)
    }

    /// `largest_force`: of the scene's own way, N; `stiffness`: of the coupling, N/m.
    pub(super) fn new(largest_force: f64, stiffness: f64) -> Self {
        Self {
            force_max: Self::force_max(largest_force),
            stiffness,
            excess: DVec3::ZERO,
            last: None,
        }
    }

    /// m, by how much the handle is ahead of what is asked for.
    pub(super) fn excess(&self) -> DVec3 {
        self.excess
    }

    /// Sees where the handle was (m) when the force on it (N) was computed.
    pub(super) fn follow(&mut self, handle: DVec3, force: DVec3) {
        let size = force.length();
        let over = (size - self.force_max) / self.stiffness;
        if !(over.is_finite() && handle.is_finite()) {
            return;
        }
        let moved = self
            .last
            .replace(handle)
            .map_or(DVec3::ZERO, |last| handle - last);
        let along = if over > 0.0 {
            -force / size
        } else {
            self.excess.normalize_or_zero()
        };
        if along != DVec3::ZERO {
            let trimmed = self.excess.length() + moved.dot(along) + over;
            self.excess = along * trimmed.max(0.0);
        }
    }

    /// The handle itself was taken back by the excess.
    pub(super) fn forget(&mut self) {
        let excess = std::mem::take(&mut self.excess);
        self.last = self.last.map(|last| last - excess);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of 3 kN/m behind a coupling of 20 kN/m: the force at a target.
    fn force(target: DVec3) -> DVec3 {
        let stiffness = 3e3 * 2e4 / 2.3e4;
        DVec3::new(0.0, stiffness * (-target.y).max(0.0), 0.0)
    }

    /// Goes down to a depth and up again at 50 mm/s, by 1 kHz; forces by depth.
    fn press(saturation: &mut Saturation, depth: f64) -> Vec<(f64, f64)> {
        let n = (depth / 5e-5) as i32;
        (0..=n)
            .chain((0..n).rev())
            .map(|k| {
                let handle = DVec3::new(0.0, -5e-5 * f64::from(k), 0.0);
                let felt = force(handle - saturation.excess());
                saturation.follow(handle, felt);
                (-handle.y, felt.y)
            })
            .collect()
    }

    #[test]
    fn a_hand_that_presses_on_is_given_no_more_and_comes_back_to_the_same_spring() {
        let mut saturation = Saturation::new(10.0, 2e4);
        let felt = press(&mut saturation, 0.05);
        let largest = felt.iter().map(|f| f.1).fold(0.0, f64::max);
        // A period's way beyond: 0.05 mm of 2.6 kN/m.
        assert!((15.0..15.2).contains(&largest), "{largest} N");
        for (depth, felt) in felt.iter().filter(|f| f.0 < 5e-3) {
            let free = force(DVec3::new(0.0, -depth, 0.0)).y;
            assert!(
                (felt - free).abs() < 0.2,
                "{felt} and {free} N at {depth} m"
            );
        }
        assert_eq!(saturation.excess(), DVec3::ZERO);
        // All the way back to where it would be below its end, the force is that end.
        let ended = felt.iter().filter(|f| f.0 > 6e-3);
        assert!(ended.clone().all(|f| (f.1 - 15.0).abs() < 0.3), "{felt:?}");
    }

    #[test]
    fn below_the_end_it_is_not_there() {
        let mut saturation = Saturation::new(10.0, 2e4);
        for (depth, felt) in press(&mut saturation, 5e-3) {
            assert_eq!(felt, force(DVec3::new(0.0, -depth, 0.0)).y);
        }
        saturation.follow(DVec3::ZERO, DVec3::NAN);
        assert_eq!(saturation.excess(), DVec3::ZERO);
    }
}

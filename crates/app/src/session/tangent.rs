//! How the force on the handle goes on from where the handle is: for devices whose server has a faster loop of its own.

use glam::{DMat3, DVec3};

/// m, a way that is long enough to tell a slope by: well above an encoder's step.
const WAY: f64 = 1e-4;

/// Weight of the newest slope.
const NEWEST: f64 = 0.3;

/// The stiffness along the way that the handle goes.
///
/// ```text
/// k = −ΔF·m / |Δx|,  m = Δx/|Δx|,        J = −k m mᵀ
/// ```
/// over ways of a tenth of a millimetre, smoothed. It resists or it is none: behind the peak the force falls as the
/// handle goes on, and a server that followed such a slope by itself would push the hand. Across the way nothing is
/// said, as nothing is known there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangent {
    /// N/m, no slope is steeper: that of the coupling, which is in series.
    most: f64,
    from: Option<(DVec3, DVec3)>,
    along: DVec3,
    stiffness: f64,
}

impl Tangent {
    /// `most`: stiffness of the coupling, N/m.
    pub(super) fn new(most: f64) -> Self {
        Self {
            most,
            from: None,
            along: DVec3::ZERO,
            stiffness: 0.0,
        }
    }

    /// J at a place of the handle (m) with the force on it (N). Zero out of contact.
    pub(super) fn follow(&mut self, place: DVec3, force: DVec3) -> DMat3 {
        if force == DVec3::ZERO || !(place.is_finite() && force.is_finite()) {
            *self = Self::new(self.most);
            return DMat3::ZERO;
        }
        let Some((from, was)) = self.from else {
            self.from = Some((place, force));
            return DMat3::ZERO;
        };
        let way = place - from;
        let length = way.length();
        if length >= WAY {
            let along = way / length;
            let newest = (-(force - was).dot(along) / length).clamp(0.0, self.most);
            let kept = if along.dot(self.along).abs() > 0.9 {
                self.stiffness
            } else {
                newest
            };
            self.stiffness = kept + NEWEST * (newest - kept);
            self.along = along;
            self.from = Some((place, force));
        }
        let m = self.along;
        DMat3::from_cols(m * m.x, m * m.y, m * m.z) * -self.stiffness
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_along_the_way_is_found_and_nothing_across_it() {
        let mut tangent = Tangent::new(1e4);
        let mut found = DMat3::ZERO;
        for k in 1..50 {
            let x = 2e-5 * f64::from(k);
            found = tangent.follow(DVec3::new(0.0, x, 0.0), DVec3::new(0.0, -3000.0 * x, 0.5));
        }
        let expected = DMat3::from_diagonal(DVec3::new(0.0, -3000.0, 0.0));
        assert!((found - expected).abs_diff_eq(DMat3::ZERO, 1e-6), "{found}");
    }

    #[test]
    fn a_falling_force_gives_no_stiffness_and_a_steep_one_that_of_the_coupling() {
        for (slope, expected) in [(-3000.0, 0.0), (1e6, 1e4)] {
            let mut tangent = Tangent::new(1e4);
            let mut found = DMat3::ZERO;
            for k in 1..50 {
                let x = 2e-5 * f64::from(k);
                found = tangent.follow(
                    DVec3::new(0.0, x, 0.0),
                    DVec3::new(0.0, -slope * x - 1.0, 0.0),
                );
            }
            assert!((found.y_axis.y + expected).abs() < 1e-9 * 1e4, "{found}");
        }
    }

    #[test]
    fn out_of_contact_and_without_numbers_it_begins_anew() {
        let mut tangent = Tangent::new(1e4);
        for k in 1..20 {
            let x = 2e-5 * f64::from(k);
            tangent.follow(DVec3::new(0.0, x, 0.0), DVec3::new(0.0, -3000.0 * x, 0.0));
        }
        assert_eq!(tangent.follow(DVec3::ZERO, DVec3::ZERO), DMat3::ZERO);
        assert_eq!(tangent.follow(DVec3::ZERO, DVec3::Y), DMat3::ZERO);
        assert_eq!(tangent.follow(DVec3::NAN, DVec3::Y), DMat3::ZERO);
    }
}

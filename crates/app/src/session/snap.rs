//! Whether it has snapped: the peak of the force and its fall, seen while the hand goes on.

use device::Phase;

/// Of the peak, by how much the force falls when it snaps. Less is the roughness of a mesh: contact that goes from node
/// to node steps by a tenth, that of a sharp edge by a third.
const FALL: f64 = 0.5;

/// N: below, nothing is felt (a device renders steps of some 0.2 N).
const LEAST: f64 = 0.05;

/// Of the largest force so far, a peak that is worth the name.
const SHARE: f64 = 0.3;

/// m, by how much the body has gone on while the force fell.
const ONWARD: f64 = 2e-5;

/// The felt curve so far: largest forces in and out, and snaps. Of fixed size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SnapWatch {
    /// N, largest resistance against going in.
    pub peak_force: f64,
    /// m, where.
    pub travel_at_peak: f64,
    /// N, largest resistance against pulling out.
    pub peak_retention: f64,
    /// m, where.
    pub travel_at_retention: f64,
    /// Times that it snapped in.
    pub n_snaps_in: u32,
    /// Times that it came off.
    pub n_snaps_out: u32,
    /// Peak before the last snap in.
    pub snap_in: SnapPeak,
    /// Peak before it came off the last time.
    pub snap_out: SnapPeak,
    rise: Rise,
}

/// A peak that was passed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SnapPeak {
    /// N.
    pub force: f64,
    /// m.
    pub travel: f64,
}

/// One rise of the force, in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Rise {
    /// N, with its sign.
    peak: f64,
    /// m.
    at: f64,
    /// Whether its fall was counted.
    is_over: bool,
}

impl SnapWatch {
    /// The next period. `travel` m; `resistance` N, against going in, negative against pulling out.
    pub(super) fn follow(&mut self, phase: Phase, travel: f64, resistance: f64) {
        if !(travel.is_finite() && resistance.is_finite()) {
            return;
        }
        // Behind its peak a part pulls the tool in: that is no retention.
        let pulls_out = phase == Phase::Retract;
        if !pulls_out && resistance > self.peak_force {
            (self.peak_force, self.travel_at_peak) = (resistance, travel);
        }
        if pulls_out && -resistance > self.peak_retention {
            (self.peak_retention, self.travel_at_retention) = (-resistance, travel);
        }
        let rise = &mut self.rise;
        let is_same_side = rise.peak * resistance > 0.0;
        let is_higher = resistance.abs() > rise.peak.abs();
        if is_same_side && is_higher && !rise.is_over {
            (rise.peak, rise.at) = (resistance, travel);
            return;
        }
        let sign = rise.peak.signum();
        let has_fallen = sign * resistance < (1.0 - FALL) * rise.peak.abs();
        let goes_on = sign * (travel - rise.at) > ONWARD;
        let largest = if sign > 0.0 {
            self.peak_force
        } else {
            self.peak_retention
        };
        let counts = !rise.is_over && rise.peak.abs() > LEAST.max(SHARE * largest);
        if counts && has_fallen && goes_on {
            rise.is_over = true;
            let passed = SnapPeak {
                force: rise.peak.abs(),
                travel: rise.at,
            };
            if sign > 0.0 {
                self.n_snaps_in += 1;
                self.snap_in = passed;
            } else {
                self.n_snaps_out += 1;
                self.snap_out = passed;
            }
        }
        // A new rise begins where the force has gone, or turned.
        if resistance.abs() < LEAST || (!is_same_side && resistance.abs() > LEAST) {
            *rise = Rise {
                peak: resistance,
                at: travel,
                is_over: false,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Goes along a polyline of (travel mm, force N), finely.
    fn go(watch: &mut SnapWatch, points: &[(f64, f64)]) {
        for pair in points.windows(2) {
            for k in 0..=100 {
                let t = f64::from(k) / 100.0;
                let at = |i: usize| -> (f64, f64) { pair[i] };
                let travel = at(0).0 + t * (at(1).0 - at(0).0);
                let force = at(0).1 + t * (at(1).1 - at(0).1);
                let phase = match at(1).0 > at(0).0 {
                    true => Phase::Approach,
                    false => Phase::Retract,
                };
                watch.follow(phase, 1e-3 * travel, force);
            }
        }
    }

    #[test]
    fn in_and_out_are_a_snap_each() {
        let mut watch = SnapWatch::default();
        go(
            &mut watch,
            &[(0.0, 0.0), (3.0, 8.4), (4.0, -2.0), (5.0, 0.0)],
        );
        assert_eq!((watch.n_snaps_in, watch.n_snaps_out), (1, 0));
        go(
            &mut watch,
            &[(5.0, 0.0), (4.0, -8.2), (3.0, 2.0), (0.0, 0.0)],
        );
        assert_eq!((watch.n_snaps_in, watch.n_snaps_out), (1, 1));
        assert!((watch.snap_in.force - 8.4).abs() < 1e-12);
        assert!((watch.snap_out.force - 8.2).abs() < 1e-12);
        assert!((watch.peak_force - 8.4).abs() < 1e-12);
        assert!((watch.travel_at_peak - 3e-3).abs() < 1e-12);
        assert!((watch.peak_retention - 8.2).abs() < 1e-12);
    }

    #[test]
    fn a_hand_that_gives_up_before_the_peak_is_no_snap() {
        let mut watch = SnapWatch::default();
        go(
            &mut watch,
            &[(0.0, 0.0), (2.0, 5.0), (0.0, 0.0), (2.0, 6.0), (0.0, 0.0)],
        );
        assert_eq!((watch.n_snaps_in, watch.n_snaps_out), (0, 0));
    }

    #[test]
    fn roughness_is_no_snap() {
        let mut watch = SnapWatch::default();
        go(
            &mut watch,
            &[
                (0.0, 0.0),
                (1.0, 5.0),
                (1.1, 4.4),
                (2.0, 8.0),
                (2.1, 7.2),
                (3.0, 9.0),
            ],
        );
        assert_eq!(watch.n_snaps_in, 0);
        go(
            &mut watch,
            &[(3.0, 9.0), (3.5, 1.0), (4.0, 0.0), (4.5, 0.0)],
        );
        assert_eq!(watch.n_snaps_in, 1);
    }

    #[test]
    fn what_is_not_finite_is_passed_over() {
        let mut watch = SnapWatch::default();
        watch.follow(Phase::Approach, f64::NAN, 1.0);
        watch.follow(Phase::Approach, 0.0, f64::INFINITY);
        assert_eq!(watch, SnapWatch::default());
    }
}

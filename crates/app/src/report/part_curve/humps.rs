//! Peaks that are passed, and the rise at the end that is not.

use super::{Place, Point};

/// Share by which the force must rise to a peak and fall from it, of that peak and of the largest peak that
/// is passed: less is a step from node to node, or a touch on the way. Hands tell forces apart from 7 to 10 % on
/// (Jones 1989; Tan et al. 1994), so that a smaller fall is not felt as a snap.
pub const HUMP_SHARE: f64 = 0.1;

/// Share of the largest force of the curve below which no force is a peak of its own, however alone it stands.
const LEAST_SHARE: f64 = 1e-6;

/// Share of a peak at which its force counts as gone.
pub(super) const GONE_SHARE: f64 = 1e-3;

/// A peak that is passed, and the fall after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hump {
    /// Position of the peak among the driven rows.
    pub row_idx: usize,
    /// At the peak, N, > 0.
    pub force_n: f64,
    /// At the peak, m.
    pub travel_m: f64,
    /// Lowest force after the peak, before the next hump or the end of the way, N.
    pub lowest_n: f64,
    /// Where that is, m.
    pub lowest_travel_m: f64,
    /// Peak minus lowest force, N. More than the peak where the part pulls the body in.
    pub drop_n: f64,
    /// Drop over peak, the snap ratio, 1.
    pub ratio: f64,
    /// Travel from the peak to where the force is gone (a thousandth of the peak), m; `None` where it
    /// is not before the next hump.
    pub gone_after_m: Option<f64>,
    /// Position of the lowest force among the points of the way in.
    pub(super) lowest_at: usize,
}

impl Hump {
    /// Where the peak is.
    pub fn peak(&self) -> Place {
        Place {
            travel_m: self.travel_m,
            force_n: self.force_n,
        }
    }
}

/// All humps of the way in. `scale`: the largest force of all rows, N.
pub(super) fn of(points: &[Point], scale: f64) -> Vec<Hump> {
    // Which humps are small is known once the largest is: the seat, which may be larger still, is none.
    let least = LEAST_SHARE * scale;
    let all = peaks(points, least);
    let highest = all.iter().map(|&at| points[at].force).fold(0.0, f64::max);
    let kept = peaks(points, least.max(HUMP_SHARE * highest));
    let ends = kept.iter().skip(1).copied().chain([points.len()]);
    kept.iter()
        .zip(ends)
        .map(|(&at, end)| hump(points, at, end))
        .collect()
}

/// Which is the main one: the largest, and the first of equals.
pub(super) fn main_of(humps: &[Hump]) -> Option<usize> {
    let by_peak = |a: &usize, b: &usize| humps[*a].force_n.total_cmp(&humps[*b].force_n);
    (0..humps.len()).rev().max_by(by_peak)
}

/// Positions of the peaks that the force rises to, and falls from, by [`HUMP_SHARE`] of them and by `least`.
fn peaks(points: &[Point], least: f64) -> Vec<usize> {
    let mut found = Vec::new();
    let needed = |force: f64| (HUMP_SHARE * force).max(least);
    // Either the force has risen, and `top` is the highest since, or it falls, and `low` is the lowest since.
    let mut top = None::<usize>;
    let mut low = f64::INFINITY;
    for (at, point) in points.iter().enumerate() {
        let force = point.force;
        let Some(peak) = top else {
            low = low.min(force);
            if force > 0.0 && force - low > 0.0 && force - low >= needed(force) {
                top = Some(at);
            }
            continue;
        };
        let highest = points[peak].force;
        if force > highest {
            top = Some(at);
        } else if highest - force >= needed(highest) {
            if highest >= least {
                found.push(peak);
            }
            (top, low) = (None, force);
        }
    }
    found
}

/// The hump with its peak at `at`; `end`: where the next one's peak is.
fn hump(points: &[Point], at: usize, end: usize) -> Hump {
    let peak = points[at];
    let (mut lowest_at, mut gone_after_m) = (at, None);
    for i in at + 1..end {
        if points[i].force < points[lowest_at].force {
            lowest_at = i;
        }
        if gone_after_m.is_none() && points[i].force <= GONE_SHARE * peak.force {
            gone_after_m = Some(zero_between(points[i - 1], points[i]) - peak.travel);
        }
    }
    let lowest = points[lowest_at];
    let drop_n = peak.force - lowest.force;
    Hump {
        row_idx: peak.row_idx,
        force_n: peak.force,
        travel_m: peak.travel,
        lowest_n: lowest.force,
        lowest_travel_m: lowest.travel,
        drop_n,
        ratio: drop_n / peak.force,
        gone_after_m,
        lowest_at,
    }
}

/// Travel at which the straight line from `a` (above zero) to `b` meets zero; at `b` where it does not.
fn zero_between(a: Point, b: Point) -> f64 {
    let share = if b.force < 0.0 {
        a.force / (a.force - b.force)
    } else {
        1.0
    };
    a.travel + share * (b.travel - a.travel)
}

/// The largest force after the last hump, where the force rises again to a resistance that counts beside the
/// largest hump.
pub(super) fn seat(points: &[Point], humps: &[Hump]) -> Option<Place> {
    let last = humps.last()?;
    let highest = humps.iter().map(|hump| hump.force_n).fold(0.0, f64::max);
    let after = points.get(last.lowest_at..)?.iter();
    let seat = after.max_by(|a, b| a.force.total_cmp(&b.force))?;
    let least = HUMP_SHARE * highest;
    let is_seat = seat.force >= least && seat.force - last.lowest_n >= least;
    is_seat.then(|| seat.place())
}

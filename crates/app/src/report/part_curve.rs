//! What the driven curve says about the part: humps, the snap, the seat, work, removal.
//!
//! ```text
//!   force        snap's peak                          seat
//!     |            /\                                  /
//!     |          /    \        a further hump        /
//!     |        /        \          /\              /
//!   0 +------/------------\------/----\----------/----- travel
//!     |                     \  /        \      /
//!     |                 lowest            \  /
//! ```
//!
//! The body is driven, so that the travel only grows on the way in: what falls there falls while the
//! body moves on. A hump is a peak that is passed; the rise at the end of the way is passed by nothing,
//! and is the seat where a hump is before it.

mod humps;
pub mod limits;
#[cfg(test)]
mod tests;
mod verdict;
pub(crate) mod words;
mod work;

use super::data::{DriveRow, Phase};
use super::plot::short;

pub use humps::{HUMP_SHARE, Hump};
pub use limits::{LimitFact, LimitState, Limits, StrainUse};
pub use verdict::{Doubts, Outcome, Verdict};
pub use work::Energy;

/// Share of the way since the first touch over which the curve's trend at its end is seen.
const END_SHARE: f64 = 0.05;

/// Share of the largest force by which it must change over that stretch to count as changing.
const TREND_SHARE: f64 = 1e-3;

/// Share of the largest force below which a force is round-off: positions carry about 1e-16 of the
/// part's size, which stiff contact makes into forces.
const ROUND_OFF_SHARE: f64 = 1e-9;

/// A place on the curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Travel of the held body, m.
    pub travel_m: f64,
    /// Force there, N; as the field that holds the place says, positive when it resists.
    pub force_n: f64,
}

/// What the force does at the end of the way in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trend {
    /// It grows.
    Rising,
    /// It does not change, or there is no force.
    #[default]
    Level,
    /// It falls.
    Falling,
}

/// How hard the part holds on the way out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Removal {
    /// There is no way out.
    #[default]
    NotPulled,
    /// The pull still grew where the way out ended: the body is not out.
    StillHeld(Place),
    /// Largest pull of the way out, which was passed; 0 N where nothing held.
    Out(Place),
}

impl Removal {
    /// The peak of the pull, positive; `None` without one that was passed.
    pub fn peak(self) -> Option<Place> {
        match self {
            Self::Out(place) => Some(place),
            Self::NotPulled | Self::StillHeld(_) => None,
        }
    }
}

/// A way that friction blocks: the force grows to its end, and all that touches sticks there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Locking {
    /// Whether it is the way out.
    pub is_out: bool,
    /// Where the way ends, with the resistance there, positive.
    pub place: Place,
}

/// Key numbers of a driven curve. Rows with numbers that are not finite are passed over.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartCurve {
    /// Rows, all phases.
    pub n_steps: usize,
    /// Rows on the way in that count: finite, and further in than all before.
    pub n_in: usize,
    /// Whether anything touched.
    pub is_touched: bool,
    /// Peaks that were passed, in order of travel.
    pub humps: Vec<Hump>,
    /// The main hump among them: the largest peak. `None` where none was passed.
    pub snap_idx: Option<usize>,
    /// Largest force of the last rise, where that is passed by nothing and a hump is before it.
    pub seat: Option<Place>,
    /// Largest resistance on the way in, passed or not; `None` where nothing resists.
    pub largest: Option<Place>,
    /// Where the way in ends.
    pub end: Place,
    /// What the force does there.
    pub end_trend: Trend,
    /// Largest value of the integral of force over travel on the way in, up to the seat, J: what must
    /// be put in to get the body past the last hump.
    pub insertion_work_j: f64,
    /// The integral over the whole way in, J: what the part has stored at its end. Negative where it
    /// gave more than it took.
    pub net_work_j: f64,
    /// How hard it holds on the way out.
    pub removal: Removal,
    /// Whether friction blocks a way.
    pub locking: Option<Locking>,
    /// Where the last contact ends on the way out, m; `None` where there is none, or it does not end.
    pub separation_m: Option<f64>,
    /// Where the work goes.
    pub energy: Energy,
    /// Largest travel across the direction, m.
    pub sideways_m: f64,
    /// Largest turn, rad.
    pub turn_rad: f64,
    /// Rows that did not converge.
    pub n_unconverged: usize,
}

impl PartCurve {
    /// Reads the numbers off the driven rows.
    pub fn of(rows: &[DriveRow]) -> Self {
        let way_in = way_in(rows);
        let finite = |value: &f64| value.is_finite();
        let forces = rows.iter().map(|row| row.force_n.abs());
        let scale = forces.filter(finite).fold(0.0, f64::max);
        let humps = humps::of(&way_in, scale);
        let seat = humps::seat(&way_in, &humps);
        // After the last hump's lowest place nothing adds to the work but the seat.
        let up_to = match (humps.last(), seat) {
            (Some(last), Some(_)) => last.lowest_at,
            _ => way_in.len().saturating_sub(1),
        };
        let largest_of = |value: fn(&DriveRow) -> f64| {
            let values = rows
                .iter()
                .map(value)
                .filter(|value: &f64| value.is_finite());
            values.map(f64::abs).fold(0.0, f64::max)
        };
        let largest = way_in
            .iter()
            .map(|p| p.place())
            .filter(|p| p.force_n > ROUND_OFF_SHARE * scale)
            .max_by(|a, b| a.force_n.total_cmp(&b.force_n));
        Self {
            n_steps: rows.len(),
            n_in: way_in.len(),
            is_touched: rows.iter().any(|row| row.contacts > 0),
            snap_idx: humps::main_of(&humps),
            seat,
            largest,
            end: way_in.last().map(|p| p.place()).unwrap_or_default(),
            end_trend: trend(&way_in),
            insertion_work_j: work::largest(way_in.get(..=up_to).unwrap_or_default()),
            net_work_j: work::whole(&way_in),
            removal: removal(rows, scale),
            locking: locking(rows),
            separation_m: separation(rows),
            energy: Energy::of(rows),
            sideways_m: largest_of(|row| row.sideways_m),
            turn_rad: largest_of(|row| row.turn_rad),
            n_unconverged: rows.iter().filter(|row| !row.is_converged).count(),
            humps,
        }
    }

    /// The main hump; `None` where nothing snaps.
    pub fn snap(&self) -> Option<&Hump> {
        self.snap_idx.and_then(|idx| self.humps.get(idx))
    }

    /// The other humps, in order of travel.
    pub fn further_humps(&self) -> impl Iterator<Item = &Hump> {
        let others = self.humps.iter().enumerate();
        others.filter_map(|(idx, hump)| (Some(idx) != self.snap_idx).then_some(hump))
    }

    /// In words, a way in that ends while the force falls from the snap: the body is not home, and what pulls it out again is
    /// not what holds it there.
    pub(crate) fn ends_in_the_fall(&self) -> Option<String> {
        let snap = self.snap()?;
        let is_falling = self.end_trend == Trend::Falling;
        (is_falling && self.end.force_n.abs() > humps::GONE_SHARE * snap.force_n).then(|| {
            format!(
                "the way in ends in the fall, {} N at {} mm, before the body is home: the pull out is not what holds it there; \
                 go on further with drive.travel",
                short(self.end.force_n),
                short(1e3 * self.end.travel_m)
            )
        })
    }

    /// Force that pushing in takes: the snap's peak, or, where nothing snaps, the largest resistance.
    pub fn insertion(&self) -> Option<Place> {
        self.snap().map(Hump::peak).or(self.largest)
    }
}

/// Position of the main hump's peak among forces (N) on a way in that only goes on; `None` where none is passed.
pub(crate) fn main_peak(forces: &[f64]) -> Option<usize> {
    let finite = forces.iter().enumerate().filter(|(_, f)| f.is_finite());
    let points: Vec<Point> = finite
        .map(|(row_idx, &force)| Point {
            row_idx,
            travel: row_idx as f64,
            force,
        })
        .collect();
    let scale = points.iter().map(|p| p.force.abs()).fold(0.0, f64::max);
    let humps = humps::of(&points, scale);
    humps::main_of(&humps).map(|idx| humps[idx].row_idx)
}

/// A row on the way in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    row_idx: usize,
    travel: f64,
    force: f64,
}

impl Point {
    fn place(&self) -> Place {
        Place {
            travel_m: self.travel,
            force_n: self.force,
        }
    }
}

/// The rows on the way in that are further in than all before: a place that is visited again is no way on.
fn way_in(rows: &[DriveRow]) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    let of_phase = rows
        .iter()
        .enumerate()
        .filter(|(_, r)| r.phase == Phase::Approach);
    for (row_idx, row) in of_phase {
        let is_further = points.last().is_none_or(|last| row.travel_m > last.travel);
        if row.travel_m.is_finite() && row.force_n.is_finite() && is_further {
            points.push(Point {
                row_idx,
                travel: row.travel_m,
                force: row.force_n,
            });
        }
    }
    points
}

/// What the force does over the last [`END_SHARE`] of the way since the first force, or over the last step.
fn trend(points: &[Point]) -> Trend {
    let [.., before_last, last] = points else {
        return Trend::Level;
    };
    let largest = points.iter().map(|p| p.force.abs()).fold(0.0, f64::max);
    let first_force = points
        .iter()
        .find(|p| p.force.abs() > ROUND_OFF_SHARE * largest);
    let start = first_force.unwrap_or(last).travel;
    let from = last.travel - END_SHARE * (last.travel - start);
    let before = points.iter().find(|p| p.travel >= from).unwrap_or(last);
    let before = if before.travel < last.travel {
        before
    } else {
        before_last
    };
    let change = last.force - before.force;
    if change > TREND_SHARE * largest {
        Trend::Rising
    } else if change < -TREND_SHARE * largest {
        Trend::Falling
    } else {
        Trend::Level
    }
}

/// The largest pull of the way out. `scale`: the largest force of all rows, N.
fn removal(rows: &[DriveRow], scale: f64) -> Removal {
    let mut last = None;
    let mut largest = None::<Place>;
    let is_finite = |row: &&DriveRow| row.travel_m.is_finite() && row.force_n.is_finite();
    let way_out = rows.iter().filter(|row| row.phase == Phase::Retract);
    for row in way_out.filter(is_finite) {
        let pull = Place {
            travel_m: row.travel_m,
            force_n: -row.force_n,
        };
        last = Some(pull);
        if pull.force_n > largest.map_or(ROUND_OFF_SHARE * scale, |p| p.force_n) {
            largest = Some(pull);
        }
    }
    match (last, largest) {
        (None, _) => Removal::NotPulled,
        (Some(last), Some(largest)) if last.force_n >= largest.force_n => {
            Removal::StillHeld(largest)
        }
        (Some(_), Some(largest)) => Removal::Out(largest),
        (Some(last), None) => Removal::Out(Place {
            force_n: 0.0,
            ..last
        }),
    }
}

/// Of the ways that end where they resist most, the first at whose end all contacts stick.
fn locking(rows: &[DriveRow]) -> Option<Locking> {
    let of_way = |phase: Phase| {
        let is_out = phase == Phase::Retract;
        let resistance = |row: &DriveRow| if is_out { -row.force_n } else { row.force_n };
        let way = || rows.iter().filter(|row| row.phase == phase);
        let last = way().next_back()?;
        let largest = way().map(resistance).fold(0.0, f64::max);
        let sticks = last.contacts > 0 && last.sticking == last.contacts;
        let ends_high = resistance(last) > 0.0 && resistance(last) >= largest;
        (sticks && ends_high).then(|| Locking {
            is_out,
            place: Place {
                travel_m: last.travel_m,
                force_n: resistance(last),
            },
        })
    };
    of_way(Phase::Approach).or_else(|| of_way(Phase::Retract))
}

fn separation(rows: &[DriveRow]) -> Option<f64> {
    let way_out: Vec<&DriveRow> = rows.iter().filter(|r| r.phase == Phase::Retract).collect();
    let last = way_out.iter().rposition(|row| row.contacts > 0)?;
    way_out.get(last + 1).map(|row| row.travel_m)
}

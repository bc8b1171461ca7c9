//! Integrals of force over travel, by the trapezoid rule.

use super::super::data::DriveRow;
use super::Point;

/// Where the work goes that the held body does, in and out, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Work against the part.
    pub put_in_j: f64,
    /// Work that the part gave back.
    pub given_back_j: f64,
    /// What friction took.
    pub dissipated_j: f64,
    /// What part and springs hold at the end.
    pub stored_j: f64,
}

impl Energy {
    /// Of driven rows, by the trapezoid rule. Rows with numbers that are not finite are passed over.
    pub(super) fn of(rows: &[DriveRow]) -> Self {
        let mut energy = Self::default();
        let is_finite = |row: &&DriveRow| row.travel_m.is_finite() && row.force_n.is_finite();
        let mut before: Option<&DriveRow> = None;
        for row in rows.iter().filter(is_finite) {
            if let Some(before) = before {
                let work = 0.5 * (before.force_n + row.force_n) * (row.travel_m - before.travel_m);
                if work > 0.0 {
                    energy.put_in_j += work;
                } else {
                    energy.given_back_j -= work;
                }
            }
            energy.dissipated_j += row.dissipated_j;
            energy.stored_j = row.stored_j;
            before = Some(row);
        }
        energy
    }

    /// What the balance lacks, J: the rule's error, and what is lost where the part itself springs.
    pub fn unaccounted_j(&self) -> f64 {
        self.put_in_j - self.given_back_j - self.dissipated_j - self.stored_j
    }
}

/// The whole integral, J.
pub(super) fn whole(points: &[Point]) -> f64 {
    points.windows(2).map(|w| step(w[0], w[1])).sum()
}

/// Largest value of the integral from the start, J, >= 0. It is reached where the force goes through zero, which
/// may be between two points.
pub(super) fn largest(points: &[Point]) -> f64 {
    let (mut sum, mut most) = (0.0f64, 0.0f64);
    for w in points.windows(2) {
        let [a, b] = [w[0], w[1]];
        if a.force > 0.0 && b.force < 0.0 {
            let way = a.force / (a.force - b.force) * (b.travel - a.travel);
            most = most.max(sum + 0.5 * a.force * way);
        }
        sum += step(a, b);
        most = most.max(sum);
    }
    most
}

fn step(a: Point, b: Point) -> f64 {
    0.5 * (a.force + b.force) * (b.travel - a.travel)
}

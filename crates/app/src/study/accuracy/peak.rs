//! Where a part snaps on a path: as in the verdict of a run, not what it meets at the end.

use crate::report::part_curve::main_peak;

/// The peak of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Peak {
    /// N.
    pub(super) force: f64,
    /// Position on the path.
    pub(super) at: usize,
    /// Whether the force falls after it; else it is the largest of the path, often that of the seat.
    pub(super) is_snap: bool,
}

/// The peak of the main hump; the largest force if there is none.
pub(super) fn snap(forces: impl Iterator<Item = f64>) -> Peak {
    let forces: Vec<f64> = forces.collect();
    let main = main_peak(&forces);
    let largest = || (0..forces.len()).max_by(|a, b| forces[*a].total_cmp(&forces[*b]));
    let at = main.or_else(largest);
    Peak {
        force: at.map_or(0.0, |at| forces[at]),
        at: at.unwrap_or(0),
        is_snap: main.is_some(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(forces: &[f64]) -> (f64, usize, bool) {
        let peak = snap(forces.iter().copied());
        (peak.force, peak.at, peak.is_snap)
    }

    #[test]
    fn a_seat_higher_than_the_snap_is_not_the_peak() {
        assert_eq!(of(&[0.0, 5.0, 9.2, 6.0, 1.0, 4.0, 9.87]), (9.2, 2, true));
        // However high, and where the force is gone between.
        assert_eq!(
            of(&[0.0, 1.0, 2.0, -1.0, 0.0, 100.0, 400.0]),
            (2.0, 2, true)
        );
        // At the stop the path may end with a force that has stopped to rise.
        assert_eq!(of(&[0.0, 2.0, 1.0, 50.0, 50.0]), (2.0, 1, true));
    }

    #[test]
    fn of_several_humps_the_largest_is_the_peak() {
        assert_eq!(of(&[0.0, 3.0, 1.0, 7.0, 2.0, 9.0]), (7.0, 3, true));
        assert_eq!(of(&[0.0, 7.0, 5.0, 3.0, 4.0, 1.0]), (7.0, 1, true));
    }

    #[test]
    fn steps_from_node_to_node_and_touches_on_the_way_are_no_peak() {
        assert_eq!(of(&[0.0, 4.0, 3.9, 8.0, 7.8, 10.0, 2.0]), (10.0, 5, true));
        assert_eq!(of(&[0.0, 0.1, 0.0, 4.0, 8.0, 1.0]), (8.0, 4, true));
    }

    #[test]
    fn without_a_fall_the_largest_force_is_told_and_that_it_is_no_snap() {
        assert_eq!(of(&[0.0, 1.0, 2.0, 3.0]), (3.0, 3, false));
        assert_eq!(of(&[0.0, 0.0]), (0.0, 1, false));
        assert_eq!(of(&[]), (0.0, 0, false));
        // Pulled in from the first touch on: no resistance, no peak.
        assert_eq!(of(&[0.0, -1.0, -3.0, -1.0]), (0.0, 0, false));
        assert!(!snap([f64::NAN, 1.0, f64::NAN].into_iter()).is_snap);
    }

    /// tests/data/cable-clip-force.csv: travel (mm) and force (N) of the clip of a 6 mm cable. Read off its plot: it snaps
    /// with 8.7 N at 3.0 mm and meets 9.87 N at the end of its path. The file has a line for every 0.02 mm.
    #[test]
    fn the_cable_clip_snaps_before_it_is_seated() {
        let text = include_str!("../../../tests/data/cable-clip-force.csv");
        let rows: Vec<(f64, f64)> = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split_once(',').unwrap())
            .map(|(travel, force)| (travel.parse().unwrap(), force.parse().unwrap()))
            .collect();
        let peak = snap(rows.iter().map(|row| row.1));
        assert!(peak.is_snap);
        assert!((peak.force - 8.7).abs() < 0.05, "{peak:?}");
        assert!((rows[peak.at].0 - 3.0).abs() < 0.05, "{}", rows[peak.at].0);
        let largest = rows.iter().map(|row| row.1).fold(0.0, f64::max);
        assert!(largest > peak.force + 1.0, "the seat is higher: {largest}");
    }
}

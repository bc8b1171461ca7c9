//! Where a part snaps on a path: the first hump of the force, not what it meets at the end.

/// Share of a peak that the force must fall by before it rises above it again: less is a step from node to node.
const FALL: f64 = 0.05;

/// A hump below this share of the highest one is a touch on the way, not the snap.
const LEAST_SHARE: f64 = 0.05;

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

/// The first peak that the force falls from by [`FALL`] of it; the largest force if there is none. Touches on the way
/// are passed over. A seat at the end of the path, however high, has no fall after it.
pub(super) fn snap(forces: impl Iterator<Item = f64>) -> Peak {
    let forces: Vec<f64> = forces.collect();
    let humps = humps(&forces);
    let highest = humps.iter().map(|peak| peak.force).fold(0.0, f64::max);
    let first = humps
        .into_iter()
        .find(|peak| peak.force >= LEAST_SHARE * highest);
    first.unwrap_or_else(|| {
        let largest = (0..forces.len()).max_by(|a, b| forces[*a].total_cmp(&forces[*b]));
        Peak {
            force: largest.map_or(0.0, |at| forces[at]),
            at: largest.unwrap_or(0),
            is_snap: false,
        }
    })
}

/// Peaks that the force falls from, in order.
fn humps(forces: &[f64]) -> Vec<Peak> {
    let mut found = Vec::new();
    // The highest since the last hump's valley, and the lowest since that peak.
    let (mut top, mut valley) = (None::<usize>, None::<f64>);
    for (at, &force) in forces.iter().enumerate() {
        if let Some(lowest) = valley {
            // Down from a hump: a new one begins once the force rises by as much as counts as a fall.
            valley = Some(lowest.min(force));
            let last: &Peak = match found.last() {
                Some(last) => last,
                None => continue,
            };
            if force - lowest.min(force) > FALL * last.force {
                (top, valley) = ((force > 0.0).then_some(at), None);
            }
            continue;
        }
        if top.is_none_or(|peak| force > forces[peak]) {
            top = if force > 0.0 { Some(at) } else { top };
        } else if let Some(peak) = top
            && force < (1.0 - FALL) * forces[peak]
        {
            found.push(Peak {
                force: forces[peak],
                at: peak,
                is_snap: true,
            });
            (top, valley) = (None, Some(force));
        }
    }
    found
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
    fn of_several_humps_the_first_is_the_peak() {
        assert_eq!(of(&[0.0, 3.0, 1.0, 7.0, 2.0, 9.0]), (3.0, 1, true));
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

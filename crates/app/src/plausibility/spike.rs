//! A peak that stands alone.

use super::track::Track;
use super::units::short;
use super::warning;
use crate::report::Warning;
use crate::report::part_curve::main_peak;

/// Of a step of the drive, how far beside the peak the force must have come down again.
const WIDTH: f64 = 0.25;
/// Share of the peak by which it stands out.
const SHARE: f64 = 0.02;

/// The peak is that of one place, with less before and behind: where a sharp edge of the tool passes a row of nodes, these
/// and the points of the edge carry for a moment together.
pub(super) fn stands_alone(track: &Track) -> Option<Warning> {
    let peak = track.peak?;
    let at = track.samples[peak].travel;
    let approach = track.samples[..track.n_approach].iter().enumerate();
    let forces: Vec<f64> = approach
        .filter(|(i, s)| i.abs_diff(peak) > 1 && (s.travel - at).abs() > WIDTH * track.per_period)
        .map(|(_, s)| s.force)
        .collect();
    let without = main_peak(&forces).map(|i| forces[i])?;
    let share = 1.0 - without / track.peak_force;
    if share < SHARE {
        return None;
    }
    Some(warning(
        "lone-peak",
        share,
        format!(
            "the peak of {} N at {} mm stands alone: but for that place it is {} N, {:.0} % less; the tool passes a row of \
             nodes there, and the peak is no better known than that: make the mesh finer there",
            short(track.peak_force),
            short(1e3 * at),
            short(without),
            100.0 * share,
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::track::Sample;
    use super::*;

    fn track(forces: &[f64]) -> Track {
        let sample = |(i, &force): (usize, &f64)| Sample {
            travel: 1e-5 * i as f64,
            force,
            touches: true,
            ..Sample::default()
        };
        let samples = forces.iter().enumerate().map(sample).collect();
        Track::new(samples, forces.len(), 1e-3, 1e-5, f64::INFINITY)
    }

    #[test]
    fn one_place_above_its_neighbours_is_told_and_a_round_or_steep_peak_is_not() {
        let rise: Vec<f64> = (0..60).map(|i| 0.01 * f64::from(i)).collect();
        let lone = [&rise[..], &[0.62, 1.0, 0.6, 0.1, 0.0]].concat();
        let told = stands_alone(&track(&lone)).unwrap();
        assert!(
            told.text.contains("it is 0.590 N, 41 % less"),
            "{}",
            told.text
        );
        let round: Vec<f64> = (0..100).map(|i| (0.0314 * f64::from(i)).sin()).collect();
        assert_eq!(stands_alone(&track(&round)), None);
        // As on the hook: up in one step from node to node, and down along its back.
        let fall: Vec<f64> = (0..60).map(|i| 1.0 - 0.005 * f64::from(i)).collect();
        assert_eq!(stands_alone(&track(&[&rise[..], &fall].concat())), None);
    }
}

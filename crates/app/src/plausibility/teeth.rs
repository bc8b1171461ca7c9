//! A force that steps from node to node.

use glam::DVec3;

use super::track::{Sample, Track};
use super::units::short;
use super::warning;
use crate::prepare::LoadedPart;
use crate::report::Warning;
use crate::session::Recording;

/// Share of the peak that a tooth measures at least, on the way to the peak and behind it, where the peak is not touched.
const BEFORE_PEAK: f64 = 0.1;
const BEHIND_PEAK: f64 = 0.2;
/// Fewer are humps of the part.
const FEWEST: usize = 3;
/// Distance of teeth over that of nodes: nodes beside the path count too, and some are passed over.
const PERIODS: std::ops::RangeInclusive<f64> = 0.1..=3.0;

/// A maximum of the force with the minimum behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tooth {
    top: usize,
    bottom: usize,
    /// N.
    height: f64,
}

/// The force goes up and down as the tool passes the nodes of the part.
pub(super) fn from_node_to_node(
    track: &Track,
    recording: &Recording,
    loaded: &LoadedPart,
) -> Option<Warning> {
    let peak = track.peak?;
    let approach = &track.samples[..track.n_approach];
    let (before, behind) = approach.split_at(peak + 1);
    let rise = (teeth(before, BEFORE_PEAK * track.peak_force), 0, "before");
    let fall = (
        teeth(behind, BEHIND_PEAK * track.peak_force),
        peak + 1,
        "behind",
    );
    [rise, fall].into_iter().find_map(|(teeth, offset, side)| {
        let (first, last) = (teeth.first()?, teeth.last()?);
        if teeth.len() < FEWEST {
            return None;
        }
        let (from, to) = (offset + first.top, offset + last.bottom);
        let way = approach[offset + last.top].travel - approach[offset + first.top].travel;
        let period = way / (teeth.len() - 1) as f64;
        let spacing = spacing(recording, loaded, from, to)?;
        if !PERIODS.contains(&(period / spacing)) {
            return None;
        }
        let height = teeth.iter().map(|t| t.height).sum::<f64>() / teeth.len() as f64;
        let mend = if side == "before" {
            "the peak is no better known than that"
        } else {
            "the fall and the work are no better known than that"
        };
        Some(warning(
            "teeth",
            height / track.peak_force,
            format!(
                "the force steps from node to node: {} times between {} and {} mm of travel ({side} the peak), by {} N \
                 or {:.0} % of the peak, every {} mm, where nodes are {} mm apart; {mend}: make the mesh finer there",
                teeth.len(),
                short(1e3 * approach[from].travel),
                short(1e3 * approach[to].travel),
                short(height),
                100.0 * height / track.peak_force,
                short(1e3 * period),
                short(1e3 * spacing),
            ),
        ))
    })
}

/// Maxima that fall by more than `least`, each after a rise by more than that.
fn teeth(samples: &[Sample], least: f64) -> Vec<Tooth> {
    let mut teeth = Vec::new();
    let force = |i: usize| samples[i].force;
    let (mut top, mut bottom, mut rises) = (0, 0, true);
    for i in 0..samples.len() {
        if rises {
            if force(i) > force(top) {
                top = i;
            } else if force(i) < force(top) - least {
                (rises, bottom) = (false, i);
            }
        } else if force(i) < force(bottom) {
            bottom = i;
        } else if force(i) > force(bottom) + least {
            let height = force(top) - force(bottom);
            teeth.push(Tooth {
                top,
                bottom,
                height,
            });
            (rises, top) = (true, i);
        }
    }
    teeth
}

/// m, median distance from the nodes that carried force to the nearest other one that can touch.
fn spacing(recording: &Recording, loaded: &LoadedPart, from: usize, to: usize) -> Option<f64> {
    let records = recording.records.get(from..=to)?;
    let mut pressed: Vec<u32> = records
        .iter()
        .flat_map(|r| recording.contacts(r))
        .map(|c| c.candidate)
        .collect();
    pressed.sort_unstable();
    pressed.dedup();
    let place =
        |node: &u32| DVec3::from_array(loaded.mesh.nodes[loaded.contact_node(*node) as usize]);
    let all = 0..(loaded.candidates.len() + loaded.held.len()) as u32;
    let mut distances: Vec<f64> = pressed
        .iter()
        .map(|a| {
            all.clone()
                .filter(|b| b != a)
                .map(|b| place(a).distance(place(&b)))
                .fold(f64::INFINITY, f64::min)
        })
        .collect();
    distances.sort_unstable_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(force: impl Fn(f64) -> f64) -> Vec<Sample> {
        (0..=1000)
            .map(|i| {
                let x = f64::from(i) * 1e-3;
                Sample {
                    travel: 1e-3 * x,
                    handle: 1e-3 * x,
                    force: force(x),
                    touches: true,
                }
            })
            .collect()
    }

    #[test]
    fn teeth_are_counted_and_measured_and_smaller_ones_are_not() {
        // Five teeth of 0.4 N on a slope.
        let wavy = samples(|x| x + 0.2 * (10.0 * std::f64::consts::PI * x).sin());
        let found = teeth(&wavy, 0.1);
        assert_eq!(found.len(), 5);
        for tooth in &found {
            let exact = 0.4 * (1.0 - 1.0 / (2.0 * std::f64::consts::PI).powi(2)).sqrt();
            assert!((tooth.height - exact).abs() < 0.1, "{}", tooth.height);
        }
        assert_eq!(teeth(&wavy, 0.5), []);
        assert_eq!(teeth(&samples(|x| (3.0 * x).sin()), 0.01), []);
    }
}

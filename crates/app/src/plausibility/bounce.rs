//! A handle that bounces off the part, and work that comes from nowhere.

use super::track::{Sample, Track};
use super::units::short;
use super::warning;
use crate::report::Warning;

/// Travels within so many periods' motion are the same.
const SAME_PERIODS: f64 = 3.0;
/// Of the motion in a period: a handle that went back by less did not turn round.
const BACK_SHARE: f64 = 0.1;
/// Of the whole work that goes to and fro: what sampling of jumps may err.
const WORK_SHARE: f64 = 0.1;

/// The contact in which the peak is was lost by the handle turning round, and found again where it was lost.
pub(super) fn bounced(track: &Track) -> Option<Warning> {
    let peak = track.peak?;
    let bounces: Vec<(usize, usize)> = gaps(&track.samples)
        .into_iter()
        .filter(|&(lost, found)| is_bounce(track, lost, found))
        .collect();
    let touches = |i: usize| track.samples[i].touches;
    let start = (0..=peak).rev().take_while(|&i| touches(i)).last()?;
    let end = (peak..track.samples.len())
        .take_while(|&i| touches(i))
        .last()?;
    // A bounce before or after: the peak is that of an impact, or of what is left of one.
    let of_peak = bounces
        .iter()
        .any(|&(lost, found)| lost == end || found == start);
    if !of_peak {
        return None;
    }
    let n = bounces.len();
    Some(warning(
        "bounce",
        n as f64,
        format!(
            "the handle bounces: contact was lost and found again at the same travel {n} time{}, at {} mm, and the peak \
             of {} N is that of an impact, no snap; write a lower hand.speed, more hand.damping or a softer \
             coupling.translational_stiffness",
            if n == 1 { "" } else { "s" },
            short(1e3 * track.samples[peak].travel),
            short(track.peak_force),
        ),
    ))
}

/// Last sample with contact and first one with contact again.
fn gaps(samples: &[Sample]) -> Vec<(usize, usize)> {
    let touching: Vec<usize> = (0..samples.len()).filter(|&i| samples[i].touches).collect();
    touching
        .windows(2)
        .filter(|w| w[1] > w[0] + 1)
        .map(|w| (w[0], w[1]))
        .collect()
}

fn is_bounce(track: &Track, lost: usize, found: usize) -> bool {
    let (s, step) = (&track.samples, track.per_period);
    let same = (s[found].travel - s[lost].travel).abs() <= SAME_PERIODS * step;
    let furthest_back = s[lost..found]
        .iter()
        .map(|s| s.handle)
        .fold(f64::INFINITY, f64::min);
    same && furthest_back < s[lost].handle - BACK_SHARE * step
}

/// The hand gets out more than it put in.
pub(super) fn negative_work(track: &Track) -> Option<Warning> {
    let approach = &track.samples[..track.n_approach];
    let sum = |of: &dyn Fn(f64) -> f64| {
        approach
            .windows(2)
            .map(|w| of(0.5 * (w[0].force + w[1].force) * (w[1].travel - w[0].travel)))
            .sum::<f64>()
    };
    let (net, gross) = (sum(&|w| w), sum(&f64::abs));
    if net >= -WORK_SHARE * gross || gross == 0.0 {
        return None;
    }
    Some(warning(
        "negative-work",
        net,
        format!(
            "the way in gives back {} mJ more than it takes, of {} mJ that went to and fro: without friction that cannot \
             be, so the curve is not to be trusted; where the tool is finer than the nodes of the part make the mesh \
             finer, where the handle bounces lower hand.speed or the coupling's stiffness",
            short(-1e3 * net),
            short(1e3 * gross),
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Body and handle at these places, mm, with this force; 0.02 mm in a period.
    fn track(points: &[(f64, f64)]) -> Track {
        let samples: Vec<Sample> = points
            .iter()
            .map(|&(mm, force)| Sample {
                travel: 1e-3 * mm,
                handle: 1e-3 * mm,
                force,
                touches: force != 0.0,
            })
            .collect();
        let n = samples.len();
        Track::new(samples, n, 1e-3, 2e-5, 2000.0)
    }

    #[test]
    fn a_peak_that_is_thrown_back_is_a_bounce() {
        let told = bounced(&track(&[
            (0.18, 0.0),
            (0.20, 3.0),
            (0.20, 5.0),
            (0.19, 0.0),
            (0.18, 0.0),
            (0.20, 2.0),
            (0.20, 2.1),
        ]))
        .unwrap();
        assert_eq!(told.number, Some(1.0));
        assert!(told.text.contains("5.00 N"), "{}", told.text);
    }

    #[test]
    fn a_snap_a_slide_over_nodes_and_a_small_bounce_before_the_peak_are_none() {
        // Found again further on.
        let snap = [(0.2, 1.0), (0.3, 5.0), (0.4, 0.0), (0.8, 0.0), (0.9, 2.0)];
        assert_eq!(bounced(&track(&snap)), None);
        // Lost for a step in passing.
        let slide = [(0.20, 5.0), (0.22, 0.0), (0.24, 4.0), (0.26, 3.0)];
        assert_eq!(bounced(&track(&slide)), None);
        // Small impact, then another and the press.
        let press = [
            (0.2, 1.0),
            (0.19, 0.0),
            (0.2, 0.9),
            (0.19, 0.0),
            (0.2, 0.8),
            (0.22, 0.0),
            (0.24, 5.0),
        ];
        assert_eq!(bounced(&track(&press)), None);
    }

    #[test]
    fn a_curve_that_gives_more_than_it_takes_is_told() {
        let way = |down: f64| {
            let points: Vec<(f64, f64)> = (0..=100)
                .map(|i| {
                    let x = f64::from(i) / 100.0;
                    let up = (2.0 * std::f64::consts::PI * x).sin();
                    (x, if up > 0.0 { up } else { down * up })
                })
                .collect();
            negative_work(&track(&points))
        };
        assert_eq!(way(1.0), None);
        assert_eq!(way(1.15), None);
        let told = way(1.4).unwrap();
        assert!(told.number.unwrap() < 0.0);
        assert_eq!(negative_work(&track(&[(0.0, 0.0), (1.0, 0.0)])), None);
    }
}

//! A run as the checks look at it: one line per period, plain numbers along the approach.

use crate::report::part_curve::main_peak;
use crate::scene::{Hand, Scene};
use crate::session::Recording;

/// One period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sample {
    /// m, of the held body.
    pub(super) travel: f64,
    /// m, of the handle.
    pub(super) handle: f64,
    /// N, positive when it resists.
    pub(super) force: f64,
    pub(super) touches: bool,
}

/// The way in, hold included.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Track {
    pub(super) samples: Vec<Sample>,
    /// Of the samples, those of the approach; the others hold.
    pub(super) n_approach: usize,
    /// N, largest of the approach, or that of the snap where the part is driven; 0 where nothing resists.
    pub(super) peak_force: f64,
    /// Where it is.
    pub(super) peak: Option<usize>,
    /// m, how far the script goes.
    pub(super) commanded: f64,
    /// m, how far it goes in a period at its full speed.
    pub(super) per_period: f64,
    /// N/m, of the hand's grip.
    pub(super) grip: f64,
}

impl Track {
    /// Of the part's own curve: the handle is the body, and nothing gives way.
    pub(super) fn of_drive(scene: &Scene, driven: &Recording) -> Self {
        let (samples, n_approach) = samples(driven);
        let drive = &scene.drive;
        let mut track = Self::new(samples, n_approach, drive.travel, drive.step, f64::INFINITY);
        if let Some(main) = main_peak(&track.forces()) {
            (track.peak, track.peak_force) = (Some(main), track.samples[main].force);
        }
        track
    }

    /// Of what a hand felt.
    pub(super) fn of(scene: &Scene, hand: &Hand, recording: &Recording) -> Self {
        let (samples, n_approach) = samples(recording);
        let per_period = hand.speed * scene.device.servo_period;
        Self::new(samples, n_approach, hand.travel, per_period, hand.stiffness)
    }

    pub(super) fn new(
        samples: Vec<Sample>,
        n_approach: usize,
        commanded: f64,
        per_period: f64,
        grip: f64,
    ) -> Self {
        let by_force = |a: &usize, b: &usize| samples[*a].force.total_cmp(&samples[*b].force);
        let largest = (0..n_approach).rev().max_by(by_force);
        let peak = largest.filter(|&p| samples[p].force > 0.0);
        Self {
            peak_force: peak.map_or(0.0, |p| samples[p].force),
            peak,
            samples,
            n_approach,
            commanded,
            per_period,
            grip,
        }
    }

    /// N, of the approach.
    fn forces(&self) -> Vec<f64> {
        let approach = self.samples[..self.n_approach].iter();
        approach.map(|sample| sample.force).collect()
    }
}

/// The way in, hold included, and how many of its samples approach.
fn samples(recording: &Recording) -> (Vec<Sample>, usize) {
    let start = recording.records.first().map(|r| r.handle_pose.translation);
    let samples: Vec<Sample> = recording
        .records
        .iter()
        .take_while(|r| r.phase != device::Phase::Retract)
        .map(|r| Sample {
            travel: r.travel,
            handle: start.map_or(0.0, |start| {
                (r.handle_pose.translation - start).dot(recording.direction)
            }),
            force: recording.resistance(r),
            touches: r.report.contacts > 0,
        })
        .collect();
    let n_approach = recording
        .records
        .iter()
        .take_while(|r| r.phase == device::Phase::Approach)
        .count();
    (samples, n_approach)
}

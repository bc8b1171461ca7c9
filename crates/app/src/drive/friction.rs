//! What a way without friction tells of friction: the faces that the body slides on, and whether friction changes much.

use super::Driven;
use crate::effects::{Effect, Observed, Ramp};
use crate::report::PartCurve;
use crate::scene::{EffectChoice, Effects};

/// The faces of a way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    /// At the peak of the way in.
    pub(crate) ramp: Ramp,
    /// Of the flank that the body comes back over, where one was seen.
    pub(crate) release: Option<Ramp>,
    /// Whether the body went on past the peak.
    pub(crate) has_passed: bool,
}

impl Seen {
    /// Of a way without friction, whose forces are along the normals.
    pub(crate) fn of(driven: &Driven) -> Self {
        let recording = &driven.recording;
        let records = &recording.records;
        // Contacts are in the part's frame, where a held part stands still and the tool comes.
        let way = driven.held.way_of_tool(recording.direction);
        let at = |i: usize| Ramp::of(recording.contacts(&records[i]), way);
        let force = |i: usize| recording.resistance(&records[i]);
        let curve = PartCurve::of(&driven.rows());
        let end = (0..records.len()).find(|&i| records[i].phase == device::Phase::Retract);
        let end = end.unwrap_or(records.len());
        let is_touched = records.iter().any(|r| r.report.contacts > 0);
        let largest = || (0..end).max_by(|&a, &b| force(a).total_cmp(&force(b)));
        let snap = curve.snap().map(|snap| snap.row_idx).or_else(largest);
        let Some(peak) = snap.filter(|_| is_touched) else {
            return Self::default();
        };
        // The hardest pull towards home, on the way in or out: that is the flank of the way out.
        let release = (peak..records.len())
            .min_by(|&a, &b| force(a).total_cmp(&force(b)))
            .filter(|&i| force(i) < 0.0)
            .map(|i| at(i).reversed());
        Self {
            ramp: at(peak),
            release,
            has_passed: (peak..end).any(|i| force(i) <= 0.0),
        }
    }
}

/// Whether friction is to be simulated: asked for, or left open with a coefficient that changes the force by more than the
/// threshold.
pub(super) fn is_called_for(effects: &Effects, frictionless: &Driven) -> bool {
    if effects.friction_coefficients().is_none() {
        return false;
    }
    match effects.friction {
        EffectChoice::Off => false,
        EffectChoice::On => true,
        EffectChoice::Auto => {
            let Seen {
                ramp,
                release,
                has_passed,
            } = Seen::of(frictionless);
            let observed = Observed {
                ramp,
                release,
                has_passed,
                friction_coefficient: effects.largest_friction(),
                ..Observed::default()
            };
            Effect::Friction.judge(&observed).missing
        }
    }
}

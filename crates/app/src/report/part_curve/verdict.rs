//! Whether the part snaps, and whether the curve can tell.

use super::super::plot::short;
use super::{HUMP_SHARE, PartCurve, Trend};

/// What a curve comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A peak is passed and the force falls while the body moves on.
    Snaps,
    /// It does not.
    DoesNotSnap,
    /// The curve cannot tell.
    Incomplete,
}

impl Outcome {
    /// In words, and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Snaps => "snaps",
            Self::DoesNotSnap => "does not snap",
            Self::Incomplete => "incomplete",
        }
    }
}

/// What a curve comes to, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The result.
    pub outcome: Outcome,
    /// What the curve looks like as far as it goes: never [`Outcome::Incomplete`], and the same as `outcome`
    /// where that is complete.
    pub so_far: Outcome,
    /// Sentences with numbers, without a full stop: what is missing of an incomplete curve, why another does or
    /// does not snap.
    pub reasons: Vec<String>,
    /// The share by which friction would raise the force of pushing in, where its lack alone makes the curve incomplete.
    pub friction_alone: Option<f64>,
    /// N by which friction would raise the pull out, in the same case.
    pub friction_out_n: Option<f64>,
}

/// What speaks against taking a curve for the part's, beside what the curve itself shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Doubts {
    /// Effects that are called for and are not simulated, one sentence each, with the number: "friction is called
    /// for and not simulated: it would change the force by 63 %".
    pub missing_effects: Vec<String>,
    /// By what share friction would raise the force of pushing in, where it is among them and was estimated.
    pub friction_share: Option<f64>,
    /// By how much it would raise the pull out, N, likewise.
    pub friction_out_n: Option<f64>,
    /// Whatever else makes the curve another than the part's, one sentence each.
    pub others: Vec<String>,
}

impl Verdict {
    /// Of a curve.
    pub fn of(curve: &PartCurve, doubts: &Doubts) -> Self {
        let (so_far, why) = as_it_looks(curve);
        let missing = missing(curve, doubts);
        if missing.is_empty() {
            Self {
                outcome: so_far,
                so_far,
                reasons: vec![why],
                friction_alone: None,
                friction_out_n: None,
            }
        } else {
            Self {
                outcome: Outcome::Incomplete,
                so_far,
                friction_alone: doubts.friction_share.filter(|_| missing.len() == 1),
                friction_out_n: doubts.friction_out_n.filter(|_| missing.len() == 1),
                reasons: missing,
            }
        }
    }
}

/// What the curve says by itself, and by which number.
fn as_it_looks(curve: &PartCurve) -> (Outcome, String) {
    if let Some(snap) = curve.snap() {
        let why = format!(
            "the force peaks at {} N after {} mm and falls by {} N while the body moves on",
            short(snap.force_n),
            short(1e3 * snap.travel_m),
            short(snap.drop_n)
        );
        return (Outcome::Snaps, why);
    }
    let why = match curve.largest {
        _ if !curve.is_touched => {
            format!(
                "nothing touched on {} mm of way",
                short(1e3 * curve.end.travel_m)
            )
        }
        None => "nothing resists on the way in".to_owned(),
        Some(largest) => format!(
            "the force reaches {} N at {} mm and passes no peak: it never falls by {} % after a rise",
            short(largest.force_n),
            short(1e3 * largest.travel_m),
            short(100.0 * HUMP_SHARE)
        ),
    };
    (Outcome::DoesNotSnap, why)
}

/// What keeps the curve from telling.
fn missing(curve: &PartCurve, doubts: &Doubts) -> Vec<String> {
    let mut reasons = doubts.missing_effects.clone();
    if curve.n_in < 2 {
        reasons.push(format!(
            "the way in has {} steps that can be told: make drive.step smaller or drive.travel longer",
            curve.n_in
        ));
    }
    if curve.n_unconverged > 0 {
        reasons.push(format!(
            "{} of {} steps did not converge: make drive.step smaller, or mesh the contact faces finer",
            curve.n_unconverged, curve.n_steps
        ));
    }
    if curve.snap().is_none() && curve.largest.is_some() {
        let doing = match curve.end_trend {
            Trend::Rising => Some("rises"),
            // A fall that is not yet a hump, from a force that was never seen to rise or just now.
            Trend::Falling if curve.end.force_n > 0.0 => Some("falls"),
            Trend::Falling | Trend::Level => None,
        };
        reasons.extend(doing.map(|doing| {
            format!(
                "the force still {doing} at the end of the way, {} N at {} mm: go on further with drive.travel",
                short(curve.end.force_n),
                short(1e3 * curve.end.travel_m)
            )
        }));
    }
    reasons.extend(doubts.others.iter().cloned());
    reasons
}

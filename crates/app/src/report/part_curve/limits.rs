//! What a scene asks of its part, and whether it is so.

use super::super::plot::short;
use super::super::strain::{REPEATED_SHARE, StrainFacts};
use super::{Outcome, PartCurve, Removal, Verdict};

/// What a scene asks of its part (`[limits]`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Pushing in takes less than this, N.
    pub insertion_below: Option<f64>,
    /// Pulling out takes more than this, N.
    pub removal_above: Option<f64>,
    /// The largest strain is below what the material bears once, 1.
    pub strain_below: Option<f64>,
    /// Whether the joint is closed once or often.
    pub strain_use: StrainUse,
}

/// How often a joint is opened and closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StrainUse {
    /// Once, or a few times.
    #[default]
    Once,
    /// Often: the material bears [`REPEATED_SHARE`] of the strain that it bears once.
    Repeatedly,
}

/// Whether a limit is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitState {
    /// It is.
    Pass,
    /// It is not.
    Fail,
    /// The run cannot tell; counts as not kept.
    NotKnown,
}

impl LimitState {
    /// In words, and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotKnown => "not known",
        }
    }
}

/// One limit beside what the run gives.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitFact {
    /// The scene's key: `insertion_below`, `removal_above`, `strain_below`.
    pub key: &'static str,
    /// What the value must be below or above; N, or 1 for a strain.
    pub limit: f64,
    /// What the run gives, in the same unit; `None` where it gives nothing.
    pub value: Option<f64>,
    /// Whether it is kept.
    pub state: LimitState,
    /// Both numbers with their units, and why it is not known where it is not.
    pub text: String,
}

impl LimitFact {
    /// Whether it is kept for sure.
    pub fn is_kept(&self) -> bool {
        self.state == LimitState::Pass
    }
}

/// All limits that are asked for, in the order of the scene's keys.
pub(crate) fn judge(
    asked: &Limits,
    curve: &PartCurve,
    verdict: &Verdict,
    strain: &StrainFacts,
) -> Vec<LimitFact> {
    let insertion = asked
        .insertion_below
        .map(|limit| insertion(limit, curve, verdict));
    let removal = asked
        .removal_above
        .map(|limit| removal(limit, curve, verdict));
    let strain = asked
        .strain_below
        .map(|limit| strained(limit, asked.strain_use, strain, verdict));
    let mut facts: Vec<LimitFact> = [insertion, removal, strain].into_iter().flatten().collect();
    // A tool that misses the part keeps a limit of its force, and says nothing of the part.
    let empty = facts
        .iter_mut()
        .filter(|fact| fact.is_kept() && !curve.is_touched);
    for fact in empty {
        fact.state = LimitState::NotKnown;
        fact.text += ", but nothing touched";
    }
    facts
}

/// A limit that is kept by an incomplete curve may not be kept by the part. `stands`: whether it is kept all the more, or
/// as well, with the friction that is left out, and what that is in words.
fn kept(verdict: &Verdict, stands: Option<String>) -> (LimitState, String) {
    match (verdict.outcome, stands) {
        (Outcome::Snaps | Outcome::DoesNotSnap, _) => (LimitState::Pass, String::new()),
        (Outcome::Incomplete, Some(words)) => (LimitState::Pass, words),
        (Outcome::Incomplete, None) => {
            let why = ", as far as it is simulated: the verdict is incomplete";
            (LimitState::NotKnown, why.to_owned())
        }
    }
}

fn insertion(limit: f64, curve: &PartCurve, verdict: &Verdict) -> LimitFact {
    // What resists nothing takes no force.
    let value = curve.insertion().map_or(0.0, |place| place.force_n);
    let with_friction = verdict.friction_alone.map(|share| value * (1.0 + share));
    let (state, why) = if value < limit {
        match with_friction {
            Some(force) if force < limit => kept(
                verdict,
                Some(format!(", and about {} N with friction", short(force))),
            ),
            Some(force) => {
                let why = format!(
                    ", but about {} N with friction, which is estimated",
                    short(force)
                );
                (LimitState::NotKnown, why)
            }
            None => kept(verdict, None),
        }
    } else {
        (LimitState::Fail, String::new())
    };
    LimitFact {
        key: "insertion_below",
        limit,
        value: Some(value),
        state,
        text: format!(
            "insertion takes {} N, to be below {} N{why}",
            apart(value, limit),
            written(limit)
        ),
    }
}

fn removal(limit: f64, curve: &PartCurve, verdict: &Verdict) -> LimitFact {
    let wanted = format!("to be above {} N", written(limit));
    let (value, state, text) = match curve.removal {
        Removal::NotPulled => (
            None,
            LimitState::NotKnown,
            format!("removal {wanted}: not pulled out (drive.retract = true)"),
        ),
        Removal::StillHeld(most) if most.force_n > limit => {
            let (state, why) = kept(verdict, holds_better(verdict));
            let most_n = apart(most.force_n, limit);
            let text = format!("removal takes at least {most_n} N, {wanted}{why}");
            (Some(most.force_n), state, text)
        }
        Removal::StillHeld(most) => {
            let most_n = apart(most.force_n, limit);
            let text = format!(
                "removal takes at least {most_n} N, {wanted}: not out at the end of the way out"
            );
            (Some(most.force_n), LimitState::NotKnown, text)
        }
        Removal::Out(peak) => {
            let with_friction = verdict.friction_out_n.map(|added| peak.force_n + added);
            let (state, why) = match with_friction {
                _ if peak.force_n > limit => kept(verdict, holds_better(verdict)),
                Some(force) if force > limit => {
                    let why = format!(
                        ", but about {} N with friction, which is estimated",
                        short(force)
                    );
                    (LimitState::NotKnown, why)
                }
                _ if curve.ends_in_the_fall().is_some() => {
                    let why = ", from where the way in ended in the fall: go on further with drive.travel";
                    (LimitState::NotKnown, why.to_owned())
                }
                None if verdict.outcome == Outcome::Incomplete
                    && verdict.friction_alone.is_none() =>
                {
                    let why = ", as far as it is simulated: the verdict is incomplete";
                    (LimitState::NotKnown, why.to_owned())
                }
                _ => (LimitState::Fail, String::new()),
            };
            let text = format!(
                "removal takes {} N, {wanted}{why}",
                apart(peak.force_n, limit)
            );
            (Some(peak.force_n), state, text)
        }
    };
    LimitFact {
        key: "removal_above",
        limit,
        value,
        state,
        text,
    }
}

/// Friction holds the body back on the way out.
fn holds_better(verdict: &Verdict) -> Option<String> {
    let words = |_| ", and more with friction".to_owned();
    verdict.friction_alone.map(words)
}

fn strained(
    once: f64,
    strain_use: StrainUse,
    strain: &StrainFacts,
    verdict: &Verdict,
) -> LimitFact {
    let (limit, of_use) = match strain_use {
        StrainUse::Once => (once, String::new()),
        StrainUse::Repeatedly => {
            let share = short(100.0 * REPEATED_SHARE);
            let of_use = format!(
                " ({share} % of {} %, for repeated use)",
                written(100.0 * once)
            );
            (REPEATED_SHARE * once, of_use)
        }
    };
    let (value, error) = strain
        .governing()
        .map_or((0.0, 0.0), |p| (p.value, p.error));
    let (state, why) = if value >= limit {
        (LimitState::Fail, String::new())
    } else if value + error >= limit {
        let why = ": the mesh's error reaches beyond, refine it or raise accuracy.order";
        (LimitState::NotKnown, why.to_owned())
    } else {
        // How far the part bends at a place of the way is a matter of shapes.
        let stands = verdict
            .friction_alone
            .map(|_| ", without friction".to_owned());
        kept(verdict, stands)
    };
    LimitFact {
        key: "strain_below",
        limit,
        value: Some(value),
        state,
        text: format!(
            "largest strain {} ± {} %, to be below {} %{of_use}{why}",
            apart(100.0 * value, 100.0 * limit),
            short(100.0 * error),
            written(100.0 * limit)
        ),
    }
}

/// A number that a user wrote, with the user's digits and without the last bits of a change of units.
fn written(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "0" && value != 0.0 {
        short(value)
    } else {
        text.to_owned()
    }
}

/// As [`short`], with as many digits more as put `value` on its side of `limit`: 9.9996 N is not "10 N, to be below
/// 10 N".
fn apart(value: f64, limit: f64) -> String {
    let side = value.partial_cmp(&limit);
    let more = (3..=17).map(|n| format!("{value:.n$}"));
    std::iter::once(short(value))
        .chain(more)
        .find(|text| {
            text.parse::<f64>()
                .is_ok_and(|v| v.partial_cmp(&limit) == side)
        })
        .unwrap_or_else(|| value.to_string())
}

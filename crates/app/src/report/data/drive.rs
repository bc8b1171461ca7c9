//! The part's own curve: the held body driven along its path, without a hand.

use contact::friction::Coefficients;

use super::super::part_curve::{Doubts, LimitFact, Limits, PartCurve, Verdict, limits};
use super::super::plot::short;
use super::super::strain::StrainFacts;
use super::Phase;

/// One place of the driven body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveRow {
    /// On the way in, at its end, or on the way out.
    pub phase: Phase,
    /// Travel of the held body along the direction since the start, m; imposed.
    pub travel_m: f64,
    /// Force along the direction, N: positive where the part resists the way in; negative where it
    /// pulls in, or, on the way out, where it resists removal.
    pub force_n: f64,
    /// Travel of the held body across the direction, m; 0 unless it is free to move so.
    pub sideways_m: f64,
    /// Turn of the held body, rad; 0 unless it is free to turn.
    pub turn_rad: f64,
    /// Places that carry force.
    pub contacts: u32,
    /// Of them, those that stick; 0 without friction.
    pub sticking: u32,
    /// What friction took since the place before, J; 0 without friction.
    pub dissipated_j: f64,
    /// What the part, and the springs of a guide, hold, J.
    pub stored_j: f64,
    /// Whether the contact planes stood still and the contact problem was solved to its tolerance.
    pub is_converged: bool,
    /// Largest violation of the contact conditions, scaled; 0 is exact.
    pub certificate: f64,
}

/// Friction that is in a curve, and the curve without it.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionFacts {
    /// Coulomb's.
    pub coefficients: Coefficients,
    /// Where it is from, if it was not stated.
    pub source: Option<String>,
    /// The same way without friction.
    pub frictionless_rows: Vec<DriveRow>,
    /// What those say.
    pub frictionless: PartCurve,
}

/// A coefficient; that at rest too, where it differs.
pub fn coefficient_in_words(of: &Coefficients) -> String {
    let kinetic = short(of.kinetic_coefficient);
    if of.is_constant() {
        return kinetic;
    }
    let at_rest = short(of.static_coefficient);
    let way = short(1e3 * of.weakening_distance);
    format!("{kinetic} ({at_rest} at rest, falling to it over {way} mm of slip)")
}

impl FrictionFacts {
    /// Of the way without friction.
    pub fn of(
        coefficients: Coefficients,
        source: Option<String>,
        frictionless_rows: Vec<DriveRow>,
    ) -> Self {
        Self {
            coefficients,
            source,
            frictionless: PartCurve::of(&frictionless_rows),
            frictionless_rows,
        }
    }
}

/// The driven curve, what is read off it, and what was asked of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// In the order in which they were driven.
    pub rows: Vec<DriveRow>,
    /// What the rows say.
    pub curve: PartCurve,
    /// Whether the part snaps, and why.
    pub verdict: Verdict,
    /// What the scene asks of the part, and whether it is so.
    pub limits: Vec<LimitFact>,
    /// Where friction is in it.
    pub friction: Option<FrictionFacts>,
}

impl Driven {
    /// Reads numbers, verdict and limits off the driven rows. `doubts`: what speaks against taking
    /// the curve for the part's; `asked` and `strain`: what the scene asks of the part, and the
    /// largest strain of the same run.
    pub fn of(rows: Vec<DriveRow>, doubts: &Doubts, asked: &Limits, strain: &StrainFacts) -> Self {
        let curve = PartCurve::of(&rows);
        let verdict = Verdict::of(&curve, doubts);
        let limits = limits::judge(asked, &curve, &verdict, strain);
        Self {
            rows,
            curve,
            verdict,
            limits,
            friction: None,
        }
    }

    /// Whether all limits are kept for sure; true where none is asked for.
    pub fn keeps_limits(&self) -> bool {
        self.limits.iter().all(LimitFact::is_kept)
    }
}

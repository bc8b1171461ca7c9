//! What an engineer would compute by hand, beside what was computed: formulas of the snap-fit
//! handbooks and of the textbooks behind them, one file for each kind of joint.

mod annular;
mod cantilever;
mod ring;

pub use annular::Annular;
pub use cantilever::{Cantilever, Ramp};
pub use ring::Ring;

use super::Material;

/// A joint for which there is a formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handbook {
    /// One or several straight arms.
    Cantilever(Cantilever),
    /// A round wall that a bead widens.
    Annular(Annular),
    /// A C-shaped ring that a round bar opens.
    Ring(Ring),
}

/// The formulas' answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// What it is and, after `: `, how it is computed.
    pub name: String,
    /// Numbers, each to be compared with one that was computed.
    pub rows: Vec<Predicted>,
    /// Force over travel from the first touch on, as (m, N).
    pub curve: Vec<(f64, f64)>,
}

/// One number of the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// What it is called.
    pub label: &'static str,
    /// What it is to be compared with.
    pub what: Measured,
    /// In N, or 1 for a strain.
    pub value: f64,
}

/// What a formula's number is the same as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// The largest force that resists the insertion.
    Insertion,
    /// The largest force that resists the removal.
    Removal,
    /// The largest force across the insertion.
    Across,
    /// The largest principal strain.
    Strain,
}

impl Handbook {
    /// What the formulas say of a part of this material, without friction.
    pub fn predict(&self, material: &Material) -> Prediction {
        match self {
            Self::Cantilever(arm) => arm.predict(material.young_modulus),
            Self::Annular(cap) => cap.predict(material.young_modulus, material.poisson_ratio),
            Self::Ring(ring) => ring.predict(material.young_modulus),
        }
    }
}

/// Where the force on a ramp that ends in a round edge is largest, as (deflection in m, angle of
/// the contact in rad).
///
/// On the round the contact's angle falls from the ramp's α to 0, while the deflection grows as
/// ```text
/// y = u − r (1 − cos a)
/// ```
/// to the whole undercut u. With a stiffness that does not change, the force along the insertion is
/// y tan a up to a factor, which is largest at cos³ a = 1 − u/r, or where the ramp ends if that is
/// less steep. `None`: the round is so large that it touches the ramp nowhere (y <= 0).
fn leaves_ramp(undercut: f64, edge_radius: f64, lead: f64) -> Option<(f64, f64)> {
    let angle = if undercut < edge_radius {
        (1.0 - undercut / edge_radius).cbrt().acos().min(lead)
    } else {
        lead
    };
    let deflection = undercut - edge_radius * (1.0 - angle.cos());
    (deflection > 0.0).then_some((deflection, angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a search: undercut 1, radii below and above what moves the peak onto the round.
    #[test]
    fn peak_on_a_round_edge_is_where_a_search_finds_it() {
        for (radius, lead_deg) in [(0.3, 30.0f64), (2.0, 30.0), (5.0, 45.0), (20.0, 45.0)] {
            let lead = lead_deg.to_radians();
            let best = (0..=100_000)
                .map(|i| lead * f64::from(i) / 1e5)
                .map(|a| (1.0 - radius * (1.0 - a.cos())) * a.tan())
                .fold(0.0, f64::max);
            let (y, a) = leaves_ramp(1.0, radius, lead).unwrap();
            assert!((y * a.tan() / best - 1.0).abs() < 1e-8, "{radius}");
        }
    }
}

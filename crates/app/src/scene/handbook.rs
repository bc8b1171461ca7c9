//! What an engineer would compute by hand, beside what was computed: formulas of the snap-fit
//! handbooks and of the textbooks behind them, one file for each kind of joint.

mod annular;
mod cantilever;
mod ring;

pub use annular::Annular;
pub use cantilever::{Cantilever, Ramp};
pub use ring::Ring;

use schemars::JsonSchema;
use serde::Deserialize;

use super::check::Check;
use super::check::Range::{NotNegative, Positive};
use super::keys::{Angle, At, Length, Plain, Whole, place};
use super::tool::ToolKeys;
use super::{Material, SceneError};

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
    /// The largest force that resists the insertion, without friction.
    Insertion,
    /// The same with friction.
    InsertionWithFriction,
    /// The largest force that resists the removal.
    Removal,
    /// The largest force across the insertion.
    Across,
    /// The largest principal strain.
    Strain,
}

impl Handbook {
    /// What the formulas say of a part of this material without friction, and of a cantilever with `friction` too, Coulomb's
    /// coefficient where it is simulated, else 0.
    pub fn predict(&self, material: &Material, friction: f64) -> Prediction {
        match self {
            Self::Cantilever(arm) => arm.predict(material.young_modulus, friction),
            Self::Annular(cap) => cap.predict(material.young_modulus, material.poisson_ratio),
            Self::Ring(ring) => ring.predict(material.young_modulus),
        }
    }
}

/// Kind of joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    /// straight arms, clamped at the root, with a catch at the end.
    #[default]
    Cantilever,
    /// a round wall with a bead inside, which a spigot widens.
    Annular,
    /// a C-shaped ring on a foot, which a round bar opens.
    Ring,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct HandbookKeys {
    /// Kind of the joint; a key that does not belong to it is an error.
    #[serde(default)]
    #[schemars(extend("default" = "cantilever"))]
    kind: Kind,
    /// Cantilever: length of the arm from its root to the catch, above 0.
    #[schemars(extend("x-default" = "by kind"))]
    length: Option<Length>,
    /// Thickness of the arm in the bending direction, or of the wall, above 0.
    thickness: Length,
    /// Cantilever and ring: width of the arm, above 0.
    #[schemars(extend("x-default" = "by kind"))]
    width: Option<Length>,
    /// Cantilever: how far the arm must bend to pass, above 0. Annular: how far the bead must widen, on the radius.
    #[schemars(extend("x-default" = "by kind"))]
    undercut: Option<Length>,
    /// Cantilever and annular: angle of the lead-in ramp to the direction of insertion, above 0 and below 90.
    #[schemars(extend("x-default" = "by kind"))]
    lead_angle_deg: Option<Angle>,
    /// Cantilever: Coulomb's coefficient on the ramp for the formula, at least 0; 0 is that of the scene where friction is
    /// simulated.
    #[schemars(extend("default" = 0.0))]
    friction: Option<Plain>,
    /// Cantilever: number of equal arms that are bent at once, 1 to 100.
    #[schemars(extend("default" = 1))]
    arms: Option<Whole<1, 100>>,
    /// Cantilever: which body has the ramp. That of an annular joint is the tool's.
    #[schemars(extend("default" = "part"))]
    ramp: Option<At<Ramp>>,
    /// Cantilever and annular: radius of the round edge at which the ramp is left, at least 0.
    #[schemars(extend("x-default" = "that of a cylinder as tool, else 0"))]
    edge_radius: Option<Length>,
    /// Annular: angle behind the spigot's crest to the axis, above 0 and below 90, for the removal.
    return_angle_deg: Option<Angle>,
    /// Annular: inner diameter of the wall, above 0.
    #[schemars(extend("x-default" = "by kind"))]
    diameter: Option<Length>,
    /// Annular: height of the bead above the wall's inside, at least 0.
    #[schemars(extend("default" = 0.0))]
    bead_height: Option<Length>,
    /// Annular: the wall's open end to the bead's crest, at least 0.
    #[schemars(extend("default" = 0.0))]
    from_end: Option<Length>,
    /// Ring: inner radius, above 0.
    #[schemars(extend("x-default" = "by kind"))]
    radius: Option<Length>,
    /// Ring: radius of the bar, above half of the opening.
    #[schemars(extend("x-default" = "that of a cylinder as tool"))]
    rod_radius: Option<Length>,
    /// Ring: opening from lip to lip, seen from the centre, above 0 and at most 180.
    #[schemars(extend("x-default" = "by kind"))]
    opening_deg: Option<Angle>,
    /// Ring: where an arm leaves the foot, from the direction opposite to the opening, at least 0.
    #[schemars(extend("default" = 0.0))]
    root_angle_deg: Option<Angle>,
    /// Part of the joint that the mesh is, above 0 to 1: 0.25 for a quarter between planes of symmetry.
    #[schemars(extend("default" = 1.0))]
    share: Option<Plain>,
}

/// The section with what its checks need.
struct Section<'a> {
    keys: &'a HandbookKeys,
    offset: usize,
    kind: &'static str,
    tool: &'a ToolKeys,
    check: &'a Check<'a>,
}

impl At<HandbookKeys> {
    /// The tool's radius is the default of radii that it stands for; the material says whether an
    /// annular joint's formula has an answer.
    pub(super) fn checked(
        &self,
        tool: &ToolKeys,
        material: &Material,
        check: &Check<'_>,
    ) -> Result<Handbook, SceneError> {
        let section = Section {
            keys: &self.value,
            offset: self.offset,
            kind: match self.value.kind {
                Kind::Cantilever => "cantilever",
                Kind::Annular => "annular",
                Kind::Ring => "ring",
            },
            tool,
            check,
        };
        section.refuse_foreign()?;
        match self.value.kind {
            Kind::Cantilever => Cantilever::checked(&section).map(Handbook::Cantilever),
            Kind::Annular => Annular::checked(&section, material).map(Handbook::Annular),
            Kind::Ring => Ring::checked(&section).map(Handbook::Ring),
        }
    }
}

impl Section<'_> {
    /// Keys of other kinds. `thickness` and `share` belong to all.
    fn refuse_foreign(&self) -> Result<(), SceneError> {
        use Kind::{Annular, Cantilever, Ring};
        let keys = self.keys;
        let owners: [(_, _, &[Kind]); 16] = [
            ("length", place(&keys.length), &[Cantilever]),
            ("width", place(&keys.width), &[Cantilever, Ring]),
            ("undercut", place(&keys.undercut), &[Cantilever, Annular]),
            (
                "lead_angle_deg",
                place(&keys.lead_angle_deg),
                &[Cantilever, Annular],
            ),
            ("friction", place(&keys.friction), &[Cantilever]),
            ("arms", place(&keys.arms), &[Cantilever]),
            ("ramp", place(&keys.ramp), &[Cantilever]),
            (
                "edge_radius",
                place(&keys.edge_radius),
                &[Cantilever, Annular],
            ),
            (
                "return_angle_deg",
                place(&keys.return_angle_deg),
                &[Annular],
            ),
            ("diameter", place(&keys.diameter), &[Annular]),
            ("bead_height", place(&keys.bead_height), &[Annular]),
            ("from_end", place(&keys.from_end), &[Annular]),
            ("radius", place(&keys.radius), &[Ring]),
            ("rod_radius", place(&keys.rod_radius), &[Ring]),
            ("opening_deg", place(&keys.opening_deg), &[Ring]),
            ("root_angle_deg", place(&keys.root_angle_deg), &[Ring]),
        ];
        let (own, foreign): (Vec<_>, Vec<_>) = owners
            .into_iter()
            .partition(|(_, _, kinds)| kinds.contains(&keys.kind));
        for (key, offset, _) in foreign {
            if let Some(offset) = offset {
                let what = format!("{key} does not belong to kind \"{}\"", self.kind);
                let own: Vec<&str> = own.iter().map(|(key, ..)| *key).collect();
                let own = own.join(", ");
                let mend = format!("remove it; its own keys: thickness, share, {own}");
                return Err(self.check.error(offset, what, mend));
            }
        }
        Ok(())
    }

    fn required<T>(&self, key: &str, written: Option<T>) -> Result<T, SceneError> {
        written.ok_or_else(|| {
            let what = format!("kind \"{}\" needs {key} in [handbook]", self.kind);
            self.check
                .missing(self.offset, what, format!("add `{key} = ...`"))
        })
    }

    fn length(&self, key: &str, written: Option<Length>) -> Result<f64, SceneError> {
        let written = self.required(key, written)?;
        self.check.number(key, written, Positive)
    }

    fn thickness(&self) -> Result<f64, SceneError> {
        self.length("thickness", Some(self.keys.thickness))
    }

    /// Above 0 and below 90.
    fn slope(&self, key: &str, written: Angle) -> Result<f64, SceneError> {
        let angle = self.check.number(key, written, Positive)?;
        if angle >= 90.0 {
            let what = format!("{key} {angle} must be below 90");
            return Err(self
                .check
                .error(written.offset, what, "ramps have 20 to 45"));
        }
        Ok(angle)
    }

    fn edge_radius(&self) -> Result<f64, SceneError> {
        let radius = self.keys.edge_radius.or(self.tool.cylinder_radius());
        self.check
            .number_or("edge_radius", radius, 0.0, NotNegative)
    }

    fn share(&self) -> Result<f64, SceneError> {
        let Some(written) = self.keys.share else {
            return Ok(1.0);
        };
        let share = self.check.number("share", written, Positive)?;
        if share > 1.0 {
            let what = format!("share {share} is more than the whole joint");
            let mend = "write 1 for a whole joint, 0.5 for half of it, 0.25 for a quarter";
            return Err(self.check.error(written.offset, what, mend));
        }
        Ok(share)
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

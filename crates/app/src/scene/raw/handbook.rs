//! Keys of `[handbook]`.

use schemars::JsonSchema;

use super::super::handbook::Ramp;
use super::At;

/// Kind of joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(in super::super) enum KindRaw {
    /// straight arms, clamped at the root, with a catch at the end.
    #[default]
    Cantilever,
    /// a round wall with a bead inside, which a spigot widens.
    Annular,
    /// a C-shaped ring on a foot, which a round bar opens.
    Ring,
}

#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct HandbookRaw {
    /// Kind of the joint; a key that does not belong to it is an error.
    #[serde(default)]
    #[schemars(extend("default" = "cantilever"))]
    pub(in super::super) kind: KindRaw,
    /// Cantilever: length of the arm from its root to the catch, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by kind"))]
    pub(in super::super) length: Option<At<f64>>,
    /// Thickness of the arm in the bending direction, or of the wall, above 0.
    #[schemars(extend("x-quantity" = "length"))]
    pub(in super::super) thickness: At<f64>,
    /// Cantilever and ring: width of the arm, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by kind"))]
    pub(in super::super) width: Option<At<f64>>,
    /// Cantilever: how far the arm must bend to pass, above 0. Annular: how far the bead must widen, on the radius.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by kind"))]
    pub(in super::super) undercut: Option<At<f64>>,
    /// Cantilever and annular: angle of the lead-in ramp to the direction of insertion, above 0 and below 90.
    #[schemars(extend("x-quantity" = "angle", "x-default" = "by kind"))]
    pub(in super::super) lead_angle_deg: Option<At<f64>>,
    /// Cantilever: Coulomb's coefficient on the ramp, at least 0; 0 compares with this program, which
    /// simulates none.
    #[schemars(extend("x-quantity" = "number", "default" = 0.0))]
    pub(in super::super) friction: Option<At<f64>>,
    /// Cantilever: number of equal arms that are bent at once, 1 to 100.
    #[schemars(range(min = 1, max = 100), extend("default" = 1))]
    pub(in super::super) arms: Option<At<i64>>,
    /// Cantilever: which body has the ramp. That of an annular joint is the tool's.
    #[schemars(extend("default" = "part"))]
    pub(in super::super) ramp: Option<At<Ramp>>,
    /// Cantilever and annular: radius of the round edge at which the ramp is left, at least 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "that of a cylinder as tool, else 0"))]
    pub(in super::super) edge_radius: Option<At<f64>>,
    /// Annular: angle behind the spigot's crest to the axis, above 0 and below 90, for the removal.
    #[schemars(extend("x-quantity" = "angle"))]
    pub(in super::super) return_angle_deg: Option<At<f64>>,
    /// Annular: inner diameter of the wall, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by kind"))]
    pub(in super::super) diameter: Option<At<f64>>,
    /// Annular: height of the bead above the wall's inside, at least 0.
    #[schemars(extend("x-quantity" = "length", "default" = 0.0))]
    pub(in super::super) bead_height: Option<At<f64>>,
    /// Annular: the wall's open end to the bead's crest, at least 0.
    #[schemars(extend("x-quantity" = "length", "default" = 0.0))]
    pub(in super::super) from_end: Option<At<f64>>,
    /// Ring: inner radius, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by kind"))]
    pub(in super::super) radius: Option<At<f64>>,
    /// Ring: radius of the bar, above half of the opening.
    #[schemars(extend("x-quantity" = "length", "x-default" = "that of a cylinder as tool"))]
    pub(in super::super) rod_radius: Option<At<f64>>,
    /// Ring: opening from lip to lip, seen from the centre, above 0 and at most 180.
    #[schemars(extend("x-quantity" = "angle", "x-default" = "by kind"))]
    pub(in super::super) opening_deg: Option<At<f64>>,
    /// Ring: where an arm leaves the foot, from the direction opposite to the opening, at least 0.
    #[schemars(extend("x-quantity" = "angle", "default" = 0.0))]
    pub(in super::super) root_angle_deg: Option<At<f64>>,
    /// Part of the joint that the mesh is, above 0 to 1: 0.25 for a quarter between planes of symmetry.
    #[schemars(extend("x-quantity" = "number", "default" = 1.0))]
    pub(in super::super) share: Option<At<f64>>,
}

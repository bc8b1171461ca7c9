//! `[coupling]`: the spring between the handle and the held body.

use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::{Check, Range::Positive};
use super::keys::{RotationalStiffness, Stiffness};

/// N/m.
const TRANSLATIONAL_STIFFNESS: f64 = 1e4;
/// N m/rad.
const ROTATIONAL_STIFFNESS: f64 = 20.0;

/// Virtual coupling between handle and held body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// N/m, > 0.
    pub translational_stiffness: f64,
    /// N m/rad, > 0.
    pub rotational_stiffness: f64,
    /// Whether the scene says so; a live session takes what the device allows where it does not.
    pub is_translational_given: bool,
    /// The same for turns.
    pub is_rotational_given: bool,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CouplingKeys {
    /// Stiffness against shifts, above 0.
    #[schemars(extend("default" = TRANSLATIONAL_STIFFNESS))]
    translational_stiffness: Option<Stiffness>,
    /// Stiffness against turns, above 0.
    #[schemars(extend("default" = ROTATIONAL_STIFFNESS))]
    rotational_stiffness: Option<RotationalStiffness>,
}

impl CouplingKeys {
    pub(super) fn checked(&self, check: &Check<'_>) -> Result<Coupling, SceneError> {
        Ok(Coupling {
            translational_stiffness: check.number_or(
                "translational_stiffness",
                self.translational_stiffness,
                TRANSLATIONAL_STIFFNESS,
                Positive,
            )?,
            rotational_stiffness: check.number_or(
                "rotational_stiffness",
                self.rotational_stiffness,
                ROTATIONAL_STIFFNESS,
                Positive,
            )?,
            is_translational_given: self.translational_stiffness.is_some(),
            is_rotational_given: self.rotational_stiffness.is_some(),
        })
    }
}

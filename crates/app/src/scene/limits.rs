//! `[limits]`: what the part's own curve has to keep.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SceneError;
use super::check::{Check, Range::Positive};
use super::keys::{Force, Plain};

/// What the part's own curve has to keep; each limit that is not kept fails the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// N, the peak of the way in stays below, > 0.
    pub insertion_below: Option<f64>,
    /// N, the largest pull of the way out goes above, > 0.
    pub removal_above: Option<f64>,
    /// The largest principal strain stays below, > 0 (0.02 is 2 %).
    pub strain_below: Option<f64>,
    /// How often the joint is used.
    pub strain_use: StrainUse,
}

/// How often a joint is opened and closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StrainUse {
    /// once: `strain_below` as it is.
    #[default]
    Once,
    /// often: 60 % of `strain_below`.
    Repeatedly,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LimitsKeys {
    /// The peak force of the way in stays below this, above 0.
    insertion_below: Option<Force>,
    /// The largest pull on the way out is above this, above 0.
    removal_above: Option<Force>,
    /// The largest principal strain (0.02 is 2 %) stays below this, above 0.
    strain_below: Option<Plain>,
    /// How often the joint is opened and closed.
    strain_use: StrainUse,
}

impl LimitsKeys {
    pub(super) fn checked(&self, check: &Check<'_>) -> Result<Limits, SceneError> {
        Ok(Limits {
            insertion_below: check.optional("insertion_below", self.insertion_below, Positive)?,
            removal_above: check.optional("removal_above", self.removal_above, Positive)?,
            strain_below: check.optional("strain_below", self.strain_below, Positive)?,
            strain_use: self.strain_use,
        })
    }
}

//! `[effects]`: what goes beyond the small-strain, frictionless, quasi-static model.

use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::{Check, Range::NotNegative};
use super::keys::{At, Plain};

/// How each effect is to be treated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effects {
    /// Coulomb friction between part and tool.
    pub friction: EffectChoice,
    /// Rotation of the part's arms beyond linear elasticity.
    pub large_rotation: EffectChoice,
    /// Weight of the part.
    pub gravity: EffectChoice,
    /// Mass of the tool.
    pub tool_inertia: EffectChoice,
    /// Mass of the part.
    pub part_inertia: EffectChoice,
    /// Damping of the part.
    pub damping: EffectChoice,
    /// Tool motion within one step.
    pub continuous_collision: EffectChoice,
    /// Elasticity of the tool.
    pub deformable_tool: EffectChoice,
    /// Coulomb's coefficient for the estimates, >= 0.
    pub friction_coefficient: Option<f64>,
}

/// Whether an effect is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffectChoice {
    /// Not looked at.
    Off,
    /// Its size is told.
    #[default]
    Auto,
}

/// How an effect is to be treated.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(extend("default" = "auto"))]
enum EffectWord {
    Off,
    Auto,
    // Refused with a reason, which an unknown word would not have. (A doc comment would be in the schema.)
    On,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct EffectsKeys {
    /// Coulomb friction between part and tool.
    friction: Option<At<EffectWord>>,
    /// Rotation of the part's arms beyond linear elasticity.
    large_rotation: Option<At<EffectWord>>,
    /// Weight of the part.
    gravity: Option<At<EffectWord>>,
    /// Mass of the tool.
    tool_inertia: Option<At<EffectWord>>,
    /// Mass of the part.
    part_inertia: Option<At<EffectWord>>,
    /// Damping of the part.
    damping: Option<At<EffectWord>>,
    /// Tool motion within one step.
    continuous_collision: Option<At<EffectWord>>,
    /// Elasticity of the tool.
    deformable_tool: Option<At<EffectWord>>,
    /// Coulomb's coefficient of part on tool, for the size of friction, at least 0.
    friction_coefficient: Option<Plain>,
}

impl EffectsKeys {
    pub(super) fn checked(&self, check: &Check<'_>) -> Result<Effects, SceneError> {
        let choice = |key: &str, word: Option<At<EffectWord>>| match word {
            None => Ok(EffectChoice::default()),
            Some(At { value, offset }) => match value {
                EffectWord::Off => Ok(EffectChoice::Off),
                EffectWord::Auto => Ok(EffectChoice::Auto),
                EffectWord::On => {
                    let what = format!("this version does not simulate {key}");
                    Err(check.error(offset, what, "use \"auto\" to be told its size"))
                }
            },
        };
        Ok(Effects {
            friction: choice("friction", self.friction)?,
            large_rotation: choice("large_rotation", self.large_rotation)?,
            gravity: choice("gravity", self.gravity)?,
            tool_inertia: choice("tool_inertia", self.tool_inertia)?,
            part_inertia: choice("part_inertia", self.part_inertia)?,
            damping: choice("damping", self.damping)?,
            continuous_collision: choice("continuous_collision", self.continuous_collision)?,
            deformable_tool: choice("deformable_tool", self.deformable_tool)?,
            friction_coefficient: check.optional(
                "friction_coefficient",
                self.friction_coefficient,
                NotNegative,
            )?,
        })
    }
}

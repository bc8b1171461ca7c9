//! `[effects]`: what goes beyond the small-strain, frictionless, quasi-static model.

use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::{Check, Range::NotNegative};
use super::friction::OfPair;
use super::keys::{At, Plain};

/// How each effect is to be treated.
#[derive(Clone, Debug, Default, PartialEq)]
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
    /// Coulomb's coefficient, >= 0: as stated, or that of the pair of materials.
    pub friction_coefficient: Option<f64>,
    /// Where the coefficient is from, if it is not stated.
    pub friction_source: Option<String>,
}

impl Effects {
    /// Coulomb's coefficient where friction is to be simulated whatever it does.
    pub fn simulated_friction(&self) -> Option<f64> {
        let is_on = self.friction == EffectChoice::On;
        // Without any there is nothing to simulate.
        self.friction_coefficient.filter(|mu| is_on && *mu > 0.0)
    }
}

/// Whether an effect is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffectChoice {
    /// Not looked at.
    Off,
    /// Its size decides, as far as this version has it; otherwise its size is told.
    #[default]
    Auto,
    /// Simulated.
    On,
}

/// How an effect is to be treated.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(extend("default" = "auto"))]
enum EffectWord {
    Off,
    Auto,
    // Where it is not simulated, refused with a reason, which an unknown word would not have. (A doc comment would be in
    // the schema.)
    On,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct EffectsKeys {
    /// Coulomb friction between part and tool. `"auto"`: with a coefficient, simulated where it changes the force by more
    /// than a tenth; `"on"`: simulated, `friction_coefficient` or a pair of materials must be there.
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
    /// Coulomb's coefficient of part on tool, at least 0.
    #[schemars(extend("x-default" = "of `tool.material` and `part.material.name`"))]
    friction_coefficient: Option<Plain>,
}

impl EffectsKeys {
    /// `pair`: coefficient of the materials, where both are named.
    pub(super) fn checked(
        &self,
        pair: Option<OfPair>,
        check: &Check<'_>,
    ) -> Result<Effects, SceneError> {
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
        let stated = check.optional(
            "friction_coefficient",
            self.friction_coefficient,
            NotNegative,
        )?;
        let source = pair.as_ref().filter(|_| stated.is_none());
        let friction_source = source.map(|pair| pair.words.clone());
        let friction_coefficient = stated.or(pair.map(|pair| pair.coefficient));
        Ok(Effects {
            friction: self.friction(friction_coefficient, check)?,
            large_rotation: choice("large_rotation", self.large_rotation)?,
            gravity: choice("gravity", self.gravity)?,
            tool_inertia: choice("tool_inertia", self.tool_inertia)?,
            part_inertia: choice("part_inertia", self.part_inertia)?,
            damping: choice("damping", self.damping)?,
            continuous_collision: choice("continuous_collision", self.continuous_collision)?,
            deformable_tool: choice("deformable_tool", self.deformable_tool)?,
            friction_coefficient,
            friction_source,
        })
    }

    fn friction(
        &self,
        coefficient: Option<f64>,
        check: &Check<'_>,
    ) -> Result<EffectChoice, SceneError> {
        let Some(At { value, offset }) = self.friction else {
            return Ok(EffectChoice::default());
        };
        match value {
            EffectWord::Off => Ok(EffectChoice::Off),
            EffectWord::Auto => Ok(EffectChoice::Auto),
            EffectWord::On if coefficient.is_none() => {
                let what = "friction is \"on\" and has no coefficient";
                let mend = "write friction_coefficient in [effects], or name both materials: part.material.name and \
                            tool.material";
                Err(check.error(offset, what, mend))
            }
            EffectWord::On => Ok(EffectChoice::On),
        }
    }
}

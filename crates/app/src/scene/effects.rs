//! `[effects]`: what goes beyond the small-strain, frictionless, quasi-static model.

use contact::friction::Coefficients;
use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::{
    Check,
    Range::{NotNegative, Positive},
};
use super::friction::OfPair;
use super::keys::{At, Length, Plain};

/// m, over which static friction falls to kinetic: about what a hand goes in a step. Of real pairs it is micrometres, which
/// no step resolves.
const WEAKENING_DISTANCE: f64 = 5e-5;

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
    /// Coulomb's coefficient of what slides, >= 0: as stated, or that of the pair of materials.
    pub friction_coefficient: Option<f64>,
    /// Of what is at rest, if it is stated.
    pub static_friction: Option<StaticFriction>,
    /// Where the coefficient is from, if it is not stated.
    pub friction_source: Option<String>,
}

/// Coulomb's coefficient of what is at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticFriction {
    /// No less than that of what slides.
    pub coefficient: f64,
    /// m of slip from one to the other, > 0.
    pub weakening_distance: f64,
}

impl Effects {
    /// Coulomb's coefficients, if there are any; both are the same where no static one is stated.
    pub fn friction_coefficients(&self) -> Option<Coefficients> {
        let kinetic_coefficient = self.friction_coefficient?;
        let constant = Coefficients::constant(kinetic_coefficient);
        let of = self
            .static_friction
            .map_or(constant, |at_rest| Coefficients {
                static_coefficient: at_rest.coefficient,
                kinetic_coefficient,
                weakening_distance: at_rest.weakening_distance,
            });
        // Without any there is nothing to simulate.
        (of.static_coefficient > 0.0).then_some(of)
    }

    /// The coefficient by which friction is judged: the largest that can act.
    pub fn largest_friction(&self) -> Option<f64> {
        let at_rest = self.static_friction.map(|at_rest| at_rest.coefficient);
        at_rest.or(self.friction_coefficient)
    }

    /// Coulomb's coefficients where friction is to be simulated whatever it does.
    pub fn simulated_friction(&self) -> Option<Coefficients> {
        let is_on = self.friction == EffectChoice::On;
        self.friction_coefficients().filter(|_| is_on)
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
    /// Coulomb's coefficient where part and tool have not slipped yet, or are at rest again; `friction_coefficient` is then
    /// that of sliding, and not above it. `"auto"` judges by this one.
    #[schemars(extend("x-default" = "that of sliding"))]
    static_friction_coefficient: Option<Plain>,
    /// Way of slip over which static friction falls to that of sliding.
    #[schemars(extend("x-default" = "5e-5 m"))]
    slip_weakening_distance: Option<Length>,
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
            static_friction: self.static_friction(friction_coefficient, check)?,
            friction_source,
        })
    }

    fn static_friction(
        &self,
        kinetic: Option<f64>,
        check: &Check<'_>,
    ) -> Result<Option<StaticFriction>, SceneError> {
        const KEY: &str = "static_friction_coefficient";
        let Some(number) = self.static_friction_coefficient else {
            return match self.slip_weakening_distance {
                Some(At { offset, .. }) => {
                    let what = format!(
                        "slip_weakening_distance is the way from {KEY} to friction_coefficient"
                    );
                    Err(check.error(offset, what, format!("write {KEY} too, or leave it out")))
                }
                None => Ok(None),
            };
        };
        let coefficient = check.number(KEY, number, NotNegative)?;
        let Some(kinetic) = kinetic else {
            let what = format!("{KEY} has no friction_coefficient beside it, that of sliding");
            let mend = "write friction_coefficient too, or both materials";
            return Err(check.error(number.offset, what, mend));
        };
        if kinetic > coefficient {
            let what =
                format!("{KEY} {coefficient} is below {kinetic}, the coefficient of sliding");
            let mend = format!("write {kinetic} or more, or leave it out");
            return Err(check.error(number.offset, what, mend));
        }
        let weakening_distance = check.number_or(
            "slip_weakening_distance",
            self.slip_weakening_distance,
            WEAKENING_DISTANCE,
            Positive,
        )?;
        Ok(Some(StaticFriction {
            coefficient,
            weakening_distance,
        }))
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

//! Which physical effects a scene calls for: a number for each, a threshold, a verdict in words.
//!
//! Each effect has a file: how it is estimated, from when on it matters, which key of `[effects]` decides, and which stage of
//! the step simulates it. This version simulates friction; every other effect is off and costs nothing, because there is
//! no stage for it. What can be estimated from a run is estimated, so that a scene that would need an effect is told so.

mod collision;
mod friction;
mod ramp;
mod rotation;
mod unseen;

pub use ramp::Ramp;

use crate::scene::{EffectChoice, Effects};

/// A physical effect beyond the quasi-static, frictionless model of small displacements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Coulomb friction between part and tool.
    Friction,
    /// Rotation of the part's arms beyond linear elasticity.
    LargeRotation,
    /// Tool motion within one step.
    ContinuousCollision,
    /// Weight of the part.
    Gravity,
    /// Mass of the tool.
    ToolInertia,
    /// Mass of the part.
    PartInertia,
    /// Damping of the part.
    Damping,
    /// Elasticity of the tool.
    DeformableTool,
}

impl Effect {
    /// All, in the order in which they are told.
    pub const ALL: [Self; 8] = [
        Self::Friction,
        Self::LargeRotation,
        Self::ContinuousCollision,
        Self::Gravity,
        Self::ToolInertia,
        Self::PartInertia,
        Self::Damping,
        Self::DeformableTool,
    ];

    /// Its key in `[effects]`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::LargeRotation => "large_rotation",
            Self::ContinuousCollision => "continuous_collision",
            Self::Gravity => "gravity",
            Self::ToolInertia => "tool_inertia",
            Self::PartInertia => "part_inertia",
            Self::Damping => "damping",
            Self::DeformableTool => "deformable_tool",
        }
    }

    /// What the scene says of it.
    pub fn choice(self, effects: &Effects) -> EffectChoice {
        match self {
            Self::Friction => effects.friction,
            Self::LargeRotation => effects.large_rotation,
            Self::ContinuousCollision => effects.continuous_collision,
            Self::Gravity => effects.gravity,
            Self::ToolInertia => effects.tool_inertia,
            Self::PartInertia => effects.part_inertia,
            Self::Damping => effects.damping,
            Self::DeformableTool => effects.deformable_tool,
        }
    }

    /// Whether a stage of the step simulates it.
    pub fn is_simulated(self) -> bool {
        self == Self::Friction
    }

    /// What a run without it says of it.
    pub fn judge(self, observed: &Observed) -> Verdict {
        match self {
            Self::Friction => friction::judge(observed),
            Self::LargeRotation => rotation::judge(observed),
            Self::ContinuousCollision => collision::judge(observed),
            Self::Gravity
            | Self::ToolInertia
            | Self::PartInertia
            | Self::Damping
            | Self::DeformableTool => unseen::judge(self),
        }
    }
}

/// What a run showed, as far as the estimators need it.
#[derive(Clone, Debug, Default)]
pub struct Observed {
    /// Largest rotation of a material point, rad.
    pub max_rotation: f64,
    /// The contacts at the peak of the insertion, for the way in; empty without contact.
    pub ramp: Ramp,
    /// Whether the body went on past that peak, so that what it slid on was no stop.
    pub has_passed: bool,
    /// The contacts of the flank that the body comes back over, for the way out, where one was seen.
    pub release: Option<Ramp>,
    /// Coefficient of friction, if the scene states one.
    pub friction_coefficient: Option<f64>,
    /// Motion of the tool in one servo period over the tool's size or the part's finest
    /// feature, whichever is smaller.
    pub motion_per_feature: Motion,
}

/// How far a hand moves the tool in one servo period, over a length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Motion {
    /// There is no hand.
    #[default]
    None,
    /// At most, in its run.
    Seen(f64),
    /// By its speed; it was not run.
    BySpeed(f64),
}

/// Verdict on one effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Which effect.
    pub effect: Effect,
    /// Whether it is simulated.
    pub on: bool,
    /// Estimate of what it would change, if one could be made.
    pub number: Option<f64>,
    /// N that friction would add to the pull on the way out, where a flank was seen that lets go.
    pub added_on_the_way_out: Option<f64>,
    /// Number from which the effect matters.
    pub threshold: f64,
    /// In words, with units.
    pub why: String,
    /// Whether the scene calls for an effect that is off.
    pub missing: bool,
}

impl Verdict {
    /// Off, not called for, without a number.
    fn quiet(effect: Effect, why: String) -> Self {
        Self {
            effect,
            on: false,
            number: None,
            added_on_the_way_out: None,
            threshold: FORCE_TOLERANCE,
            why,
            missing: false,
        }
    }
}

/// Share of the felt force that a missing effect may change before it is called for.
const FORCE_TOLERANCE: f64 = 0.1;

/// All effects of a scene with their numbers.
pub fn judge(observed: &Observed) -> Vec<Verdict> {
    Effect::ALL.map(|effect| effect.judge(observed)).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_claimed_to_be_simulated_by_an_estimate() {
        let all = judge(&Observed::default());
        assert!(all.iter().all(|v| !v.on && !v.missing));
        assert!(all.iter().map(|v| v.effect).eq(Effect::ALL));
    }
}

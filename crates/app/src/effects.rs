//! Which physical effects a scene calls for: a number for each, a threshold, a verdict in words.
//!
//! This version simulates quasi-static, frictionless, small-displacement contact; every other
//! effect is off and costs nothing, because there is no stage for it. What can be estimated from
//! a run is estimated, so that a scene that would need an effect is told so.

/// What a run showed, as far as the estimators need it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observed {
    /// Largest rotation of a material point, rad.
    pub max_rotation: f64,
    /// Angle of the contact normals against the plane across the approach at peak force, rad:
    /// sine = axial force over the sum of normal forces. `None` without contact.
    pub ramp_angle: Option<f64>,
    /// Coefficient of friction, if the scene states one.
    pub friction_coefficient: Option<f64>,
    /// Largest motion of the tool in one servo period over the tool's size or the part's finest
    /// feature, whichever is smaller.
    pub motion_per_feature: f64,
}

/// Verdict on one effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Name as in `[effects]` of a scene.
    pub name: &'static str,
    /// Whether it is simulated.
    pub on: bool,
    /// Estimate of what it would change, if one could be made.
    pub number: Option<f64>,
    /// Number from which the effect matters.
    pub threshold: f64,
    /// In words, with units.
    pub why: String,
    /// Whether the scene calls for an effect that is off.
    pub missing: bool,
}

/// Share of the felt force that a missing effect may change before it is called for.
const FORCE_TOLERANCE: f64 = 0.1;
/// Degrees. Beyond it linear strains of a rotated arm are no longer small beside the true ones.
const ROTATION_LIMIT_DEG: f64 = 10.0;
/// Motion per period over feature size from which a tool could pass through unseen.
const TUNNELLING_LIMIT: f64 = 0.5;

/// All effects of a scene with their numbers.
pub fn judge(observed: &Observed) -> Vec<Verdict> {
    let rotation = observed.max_rotation.to_degrees();
    let quiet = |name, why: &str| Verdict {
        name,
        on: false,
        number: None,
        threshold: FORCE_TOLERANCE,
        why: why.to_owned(),
        missing: false,
    };
    vec![
        friction(observed),
        Verdict {
            name: "large_rotation",
            on: false,
            number: Some(rotation),
            threshold: ROTATION_LIMIT_DEG,
            why: format!(
                "material points turn by up to {rotation:.1} degrees; {}",
                if rotation > ROTATION_LIMIT_DEG {
                    "small-displacement theory is too stiff here, expect a peak some percent too high"
                } else {
                    "small-displacement theory holds"
                }
            ),
            missing: rotation > ROTATION_LIMIT_DEG,
        },
        Verdict {
            name: "continuous_collision",
            on: false,
            number: Some(observed.motion_per_feature),
            threshold: TUNNELLING_LIMIT,
            why: format!(
                "the tool moves at most {:.1e} of the smallest feature in a period",
                observed.motion_per_feature
            ),
            missing: observed.motion_per_feature > TUNNELLING_LIMIT,
        },
        quiet(
            "gravity",
            "not estimated; weight of part and tool is left out",
        ),
        quiet(
            "tool_inertia",
            "not estimated; the tool follows its coupling without mass",
        ),
        quiet(
            "part_inertia",
            "not estimated; the part answers quasi-statically",
        ),
        quiet(
            "damping",
            "not estimated; only of interest with part inertia",
        ),
        quiet("deformable_tool", "not estimated; the tool is rigid"),
    ]
}

/// F grows from tan(a) to tan(a + phi): by 2 mu / sin 2a for small mu.
fn friction(observed: &Observed) -> Verdict {
    let leverage = observed
        .ramp_angle
        .map(|a| (2.0 * a).sin().abs() / 2.0)
        .filter(|s| *s > 0.0);
    let number = observed
        .friction_coefficient
        .zip(leverage)
        .map(|(mu, s)| mu / s);
    let why = match (number, leverage) {
        (Some(x), _) => format!(
            "would raise the force at the peak by about {:.0} %",
            100.0 * x
        ),
        (None, Some(s)) => format!(
            "matters from a coefficient of {:.2} on at this ramp; state friction_coefficient in \
             [effects] to have it judged",
            FORCE_TOLERANCE * s
        ),
        (None, None) => "nothing touched".to_owned(),
    };
    Verdict {
        name: "friction",
        on: false,
        number,
        threshold: FORCE_TOLERANCE,
        why,
        missing: number.is_some_and(|x| x > FORCE_TOLERANCE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_is_called_for_from_0_043_on_at_a_ramp_of_30_degrees() {
        // 2 mu / sin 60 deg = 0.1 at mu = 0.0433.
        let verdict = |mu| {
            let observed = Observed {
                ramp_angle: Some(30f64.to_radians()),
                friction_coefficient: Some(mu),
                ..Observed::default()
            };
            judge(&observed)[0].missing
        };
        assert!(!verdict(0.043));
        assert!(verdict(0.044));
    }

    #[test]
    fn nothing_is_claimed_to_be_simulated() {
        assert!(judge(&Observed::default()).iter().all(|v| !v.on));
    }
}

//! Rotation of the part's arms beyond linear elasticity.
//!
//! Estimate: the largest rotation of a material point that a run saw. Setting: `effects.large_rotation`. Stage: none yet.

use super::{Effect, Observed, Verdict};

/// Degrees. Beyond it linear strains of a rotated arm are no longer small beside the true ones.
const LIMIT_DEG: f64 = 10.0;

pub(super) fn judge(observed: &Observed) -> Verdict {
    let rotation = observed.max_rotation.to_degrees();
    let is_large = rotation > LIMIT_DEG;
    let what = if is_large {
        "small-displacement theory is too stiff here, expect a peak some percent too high"
    } else {
        "small-displacement theory holds"
    };
    let why = format!("material points turn by up to {rotation:.1} degrees; {what}");
    Verdict {
        number: Some(rotation),
        threshold: LIMIT_DEG,
        missing: is_large,
        ..Verdict::quiet(Effect::LargeRotation, why)
    }
}

//! Tool motion within one step.
//!
//! Estimate: the largest motion in a servo period over the finest feature. Setting: `effects.continuous_collision`. Stage: none;
//! a fast tool is followed in strides of the step.

use super::{Effect, Observed, Verdict};

/// Motion per period over feature size from which a tool could pass through unseen.
const TUNNELLING_LIMIT: f64 = 0.5;

pub(super) fn judge(observed: &Observed) -> Verdict {
    let motion = observed.motion_per_feature;
    let is_fast = motion > TUNNELLING_LIMIT;
    let mend = if is_fast {
        "; write a lower hand.speed, a stiffer hand.stiffness that does not jump, or a shorter device.servo_period (the \
         part's own curve has no such steps)"
    } else {
        ""
    };
    let why = format!(
        "in the hand's run the tool moves at most {motion:.2} of the smallest feature in a period{mend}"
    );
    Verdict {
        number: Some(motion),
        threshold: TUNNELLING_LIMIT,
        missing: is_fast,
        ..Verdict::quiet(Effect::ContinuousCollision, why)
    }
}

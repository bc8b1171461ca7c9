//! Tool motion within one step.
//!
//! Estimate: the largest motion in a servo period over the finest feature, as a hand's run showed it, or by `hand.speed` where none was run. Setting: `effects.continuous_collision`. Stage: none;
//! a fast tool is followed in strides of the step.

use super::{Effect, Motion, Observed, Verdict};

/// Motion per period over feature size from which a tool could pass through unseen.
const TUNNELLING_LIMIT: f64 = 0.5;

pub(super) fn judge(observed: &Observed) -> Verdict {
    let (motion, by) = match observed.motion_per_feature {
        Motion::None => (0.0, "no hand moves the tool by periods"),
        Motion::Seen(motion) => (motion, "in the hand's run the tool moves at most"),
        Motion::BySpeed(motion) => (motion, "at hand.speed the tool moves"),
    };
    let is_fast = motion > TUNNELLING_LIMIT;
    let mend = if is_fast {
        "; write a lower hand.speed, a stiffer hand.stiffness that does not jump, or a shorter device.servo_period (the \
         part's own curve has no such steps)"
    } else {
        ""
    };
    let why = match observed.motion_per_feature {
        Motion::None => by.to_owned(),
        _ => format!("{by} {motion:.2} of the smallest feature in a period{mend}"),
    };
    Verdict {
        number: Some(motion),
        threshold: TUNNELLING_LIMIT,
        missing: is_fast,
        ..Verdict::quiet(Effect::ContinuousCollision, why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words say where the number is from.
    #[test]
    fn the_motion_is_that_of_a_run_or_of_the_hands_speed() {
        let of = |motion_per_feature| {
            judge(&Observed {
                motion_per_feature,
                ..Observed::default()
            })
        };
        let seen = of(Motion::Seen(0.6));
        assert!(seen.missing);
        assert!(
            seen.why.starts_with(
                "in the hand's run the tool moves at most 0.60 of the smallest feature"
            )
        );
        let planned = of(Motion::BySpeed(0.3));
        assert_eq!(planned.number, Some(0.3));
        assert_eq!(
            planned.why,
            "at hand.speed the tool moves 0.30 of the smallest feature in a period"
        );
        assert!(
            of(Motion::BySpeed(0.6))
                .why
                .contains("write a lower hand.speed")
        );
        let none = of(Motion::None);
        assert_eq!((none.number, none.missing), (Some(0.0), false));
        assert_eq!(none.why, "no hand moves the tool by periods");
    }
}

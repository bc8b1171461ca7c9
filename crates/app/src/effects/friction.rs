//! Coulomb friction between part and tool.
//!
//! Estimate: F grows from tan(a) to tan(a + phi) of what presses across, on a face of angle a, with phi = atan(mu), read off
//! a curve without friction. Setting: `effects.friction` and a coefficient. Stage: the law of the step, `engine/law/coulomb.rs`.

use super::{Effect, FORCE_TOLERANCE, Observed, Ramp, Verdict};

/// What it would change at the peak, and on the way out.
pub(super) fn judge(observed: &Observed) -> Verdict {
    let ramp = &observed.ramp;
    let verdict = |number: Option<f64>, missing: bool, why: String| Verdict {
        number,
        missing,
        ..Verdict::quiet(Effect::Friction, why)
    };
    let Some(angle) = ramp.angle() else {
        return verdict(None, false, "nothing touched".to_owned());
    };
    let degrees = angle.to_degrees();
    if ramp.is_head_on() && !observed.has_passed {
        let why = format!(
            "the body is stopped head on ({degrees:.0} degrees), there is no ramp to rub on"
        );
        return verdict(None, false, why);
    }
    let Some(mu) = observed.friction_coefficient else {
        let from = ramp.coefficient_for(FORCE_TOLERANCE);
        return verdict(None, false, without_coefficient(ramp, from));
    };
    let phi = mu.atan().to_degrees();
    let Some(added) = ramp.friction(mu) else {
        let why = format!(
            "self-locking: the ramp of {degrees:.1} degrees and friction's angle of {phi:.1} make 90 or more, so no push \
             gets the body over; make the ramp flatter than {:.1} degrees",
            90.0 - phi
        );
        return verdict(None, true, why);
    };
    let out = on_the_way_out(observed, mu);
    let locks_out = observed.release.as_ref().is_some_and(|r| r.locks(mu));
    if ramp.is_level() {
        let why = format!(
            "the ramp is level at the peak ({degrees:.1} degrees): friction would add {added:.3} N to {:.3} N there, \
             mu times what presses{out}",
            ramp.along()
        );
        let matters = added > FORCE_TOLERANCE * ramp.along().abs();
        return verdict(None, matters || locks_out, why);
    }
    let share = added / ramp.along();
    let why = format!(
        "would raise the force at the peak by about {:.0} %, by {added:.3} N: tan(a + phi)/tan(a) with a ramp of \
         {degrees:.1} degrees and friction's angle of {phi:.1}{out}",
        100.0 * share
    );
    let release = observed.release.as_ref();
    Verdict {
        added_on_the_way_out: release.and_then(|release| release.friction(mu)),
        ..verdict(Some(share), share > FORCE_TOLERANCE || locks_out, why)
    }
}

fn without_coefficient(ramp: &Ramp, from: Option<f64>) -> String {
    const ASK: &str = "state friction_coefficient in [effects] to have it judged";
    match from.filter(|_| !ramp.is_level()) {
        Some(mu) => format!("matters from a coefficient of {mu:.3} on at this ramp; {ASK}"),
        None => format!("the ramp is level at the peak, any friction matters there; {ASK}"),
    }
}

/// What friction does to the pull out, after a comma; nothing where no flank was seen.
fn on_the_way_out(observed: &Observed, mu: f64) -> String {
    let Some((release, angle)) = observed
        .release
        .as_ref()
        .and_then(|r| r.angle().map(|a| (r, a)))
    else {
        return String::new();
    };
    let (degrees, phi) = (angle.to_degrees(), mu.atan().to_degrees());
    match release.friction(mu) {
        None => format!(
            "; on the way out the flank of {degrees:.1} degrees is self-locking with it: no pull gets the body out"
        ),
        Some(added) if degrees > 0.0 && degrees < phi => format!(
            "; on the way out {added:.3} N, and the back flank of {degrees:.1} degrees is flatter than friction's angle, \
             so the part does not draw the body home by itself"
        ),
        Some(added) => format!("; on the way out by {added:.3} N"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run on a ramp of so many degrees that is pressed with a newton.
    fn on_ramp(degrees: f64, mu: f64) -> Observed {
        Observed {
            ramp: Ramp::face(degrees.to_radians(), 1.0),
            friction_coefficient: Some(mu),
            has_passed: true,
            ..Observed::default()
        }
    }

    #[test]
    fn friction_is_called_for_from_0_0423_on_at_a_ramp_of_30_degrees() {
        // tan(30 deg + atan mu) = 1.1 tan 30 deg at mu = 0.0423.
        let missing = |mu| judge(&on_ramp(30.0, mu)).missing;
        assert!(!missing(0.0422));
        assert!(missing(0.0424));
    }

    #[test]
    fn friction_is_the_handbooks_factor_and_told_in_newtons() {
        let verdict = judge(&on_ramp(30.0, 0.6));
        // tan(30 + 30.964) / tan 30 - 1, where 2 mu / sin 60 would be 1.386.
        assert!(
            (verdict.number.unwrap() - 2.1210).abs() < 1e-3,
            "{verdict:?}"
        );
        assert!(
            verdict.why.contains("by about 212 %, by 1.060 N"),
            "{}",
            verdict.why
        );
    }

    #[test]
    fn a_level_ramp_is_told_in_newtons_and_not_in_percent() {
        for degrees in [-5.0, 0.0, 0.02, 0.9] {
            let verdict = judge(&on_ramp(degrees, 0.2));
            assert!(verdict.number.is_none() && verdict.missing, "{verdict:?}");
            assert!(verdict.why.contains("level at the peak"), "{}", verdict.why);
            assert!(!verdict.why.contains('%'), "{}", verdict.why);
        }
        assert!(judge(&on_ramp(1.1, 0.2)).number.is_some());
    }

    #[test]
    fn self_locking_is_flagged_on_the_way_in_and_out() {
        // atan 0.6 = 30.96 degrees.
        let locks = |degrees| judge(&on_ramp(degrees, 0.6)).why.contains("self-locking");
        assert!(!locks(59.0));
        assert!(locks(59.1));
        let out = |degrees: f64, mu: f64| {
            let observed = Observed {
                release: Some(Ramp::face(degrees.to_radians(), 1.0)),
                ..on_ramp(30.0, mu)
            };
            judge(&observed)
        };
        assert!(!out(59.0, 0.6).why.contains("self-locking"));
        let locked = out(59.1, 0.6);
        assert!(locked.missing && locked.why.contains("no pull gets the body out"));
        // A vertical back holds without friction too.
        assert!(out(90.0, 0.01).missing);
        assert!(out(30.0, 0.6).why.contains("does not draw the body home"));
        assert!(!out(31.0, 0.6).why.contains("does not draw the body home"));
    }

    #[test]
    fn what_is_stopped_head_on_does_not_call_for_friction() {
        let mut observed = on_ramp(88.0, 0.3);
        observed.has_passed = false;
        let verdict = judge(&observed);
        assert!(
            !verdict.missing && verdict.why.contains("head on"),
            "{verdict:?}"
        );
    }
}

//! A coupling that is too stiff for the period and the handle's mass.

use super::units::short;
use super::warning;
use crate::report::Warning;
use crate::scene::{Hand, Scene};
use crate::session::Recording;

/// K T²/m from which a handle is thrown about by a force that is held for a period, whatever damps it.
const ALWAYS: f64 = 1.0;
/// The same where the hand does not damp what the hold feeds in.
const UNDAMPED: f64 = 0.1;
/// Of the periods with contact: steps of a jump are fewer.
const MEDIAN: f64 = 0.5;
/// Of the fastest motion of the handle: slower ones do not tell a stiffness.
const SLOW_SHARE: f64 = 1e-2;

/// The stiffness that the handle meets, coupling and part in series, is too much for a force that is new only once in a
/// period.
pub(super) fn too_stiff(scene: &Scene, hand: &Hand, recording: &Recording) -> Option<Warning> {
    let stiffness = felt_stiffness(recording)?.min(scene.coupling.translational_stiffness);
    judged(
        scene,
        stiffness,
        scene.device.servo_period,
        hand.mass,
        hand.damping,
        scene.coupling.translational_stiffness,
    )
}

/// A held force lags by half a period, which acts like a damping of -K T/2 (Colgate and Schenkel 1997).
fn judged(
    scene: &Scene,
    stiffness: f64,
    period: f64,
    mass: f64,
    damping: f64,
    coupling: f64,
) -> Option<Warning> {
    let number = stiffness * period * period / mass;
    let fed = 0.5 * stiffness * period;
    if number < UNDAMPED || (number < ALWAYS && fed <= damping) {
        return None;
    }
    // Half of the limits.
    let of_mass = 0.5 * mass / (period * period);
    let fitting = (UNDAMPED * of_mass).max((damping / period).min(ALWAYS * of_mass));
    Some(warning(
        "stiff-coupling",
        number,
        format!(
            "coupling and part in series are {}, too stiff for a handle of {} and a period of {} s: K T^2/m is {} (0.1 is \
             safe), and holding the force for a period feeds in what a damping of {} would have to take out; write \
             coupling.translational_stiffness = {} (it is {}) or a shorter device.servo_period",
            scene.stiffness_words(rounded(stiffness)),
            scene.mass_words(mass),
            short(period),
            short(number),
            scene.damping_words(rounded(fed)),
            scene.stiffness_words(
                format!("{:.0e}", fitting.min(0.5 * stiffness))
                    .parse()
                    .unwrap_or(fitting)
            ),
            scene.stiffness_words(coupling),
        ),
    ))
}

/// To three digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// N/m, change of the wrench over the handle's motion, the median of the periods with contact.
fn felt_stiffness(recording: &Recording) -> Option<f64> {
    let steps: Vec<(f64, f64)> = recording
        .records
        .windows(2)
        .filter(|w| w.iter().all(|r| r.report.contacts > 0))
        .map(|w| {
            let moved = w[1].handle_pose.translation - w[0].handle_pose.translation;
            let changed = w[1].wrench_on_handle.force - w[0].wrench_on_handle.force;
            (moved.length(), changed.length())
        })
        .collect();
    let fastest = steps.iter().map(|s| s.0).fold(0.0, f64::max);
    let mut all: Vec<f64> = steps
        .iter()
        .filter(|s| s.0 > SLOW_SHARE * fastest)
        .map(|s| s.1 / s.0)
        .collect();
    all.sort_unstable_by(f64::total_cmp);
    let at = (MEDIAN * all.len().saturating_sub(1) as f64) as usize;
    all.get(at).copied().filter(|k| k.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip() -> Scene {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        Scene::load(&folder.join("clip.toml")).unwrap()
    }

    #[test]
    fn what_the_hand_damps_is_let_pass_and_what_it_does_not_is_told() {
        let scene = clip();
        let judge =
            |k: f64, damping: f64| judged(&scene, k, 1e-3, 0.5, damping, k).map(|w| w.number);
        // K T^2/m of 0.02, 0.2, 2 and 20; K T/2 of 5, 50, 500 and 5000.
        assert_eq!(judge(1e4, 0.0), None);
        assert_eq!(judge(1e5, 63.0), None);
        assert_eq!(judge(1e5, 45.0), Some(Some(0.2)));
        assert_eq!(judge(1e6, 1e4), Some(Some(2.0)));
        assert!(judge(1e7, 63.0).is_some());
        assert_eq!(judge(0.49e6, 1e4), None);
    }

    #[test]
    fn the_mend_mends() {
        for (k, period, mass, damping) in [
            (1e7, 1e-3, 0.5, 63.0),
            (1e6, 1e-2, 0.1, 0.0),
            (1e5, 1e-3, 0.02, 20.0),
        ] {
            let text = judged(&clip(), k, period, mass, damping, k).unwrap().text;
            let from = text.find("stiffness = ").unwrap() + "stiffness = ".len();
            let written: f64 = text[from..].split(' ').next().unwrap().parse().unwrap();
            assert!(
                judged(&clip(), written, period, mass, damping, written).is_none(),
                "{text}"
            );
        }
    }
}

//! A script of the hand that is too short for its period or for the hand.

use super::track::Track;
use super::units::short;
use super::warning;
use crate::report::Warning;
use crate::scene::Scene;

/// Periods of the approach: with fewer, steps are a twentieth of the way and more.
const FEW_PERIODS: f64 = 20.0;
/// Steps from the first touch to the peak.
const FEW_STEPS: usize = 5;
/// Share of the travel that the hand may still be away from the end of its script.
const LAG_SHARE: f64 = 0.05;

/// The approach takes few periods of the loop.
pub(super) fn few_periods(scene: &Scene) -> Option<Warning> {
    let hand = scene.hand.as_ref()?;
    let period = scene.device.servo_period;
    let seconds = hand.travel / hand.speed;
    let periods = seconds / period;
    if periods >= FEW_PERIODS {
        return None;
    }
    let mends = [
        (period > 1e-3).then(|| "device.servo_period = 1e-3".to_owned()),
        Some(format!(
            "a hand.speed below {} mm/s",
            short(1e3 * hand.travel / (FEW_PERIODS * period))
        )),
    ];
    let mends: Vec<String> = mends.into_iter().flatten().collect();
    Some(warning(
        "few-periods",
        periods,
        format!(
            "the hand's way of {} mm at {} mm/s takes {} s, {} period{} of {} s: the body moves {} mm from one step to \
             the next, and what lies between is not seen; write {}",
            short(1e3 * hand.travel),
            short(1e3 * hand.speed),
            short(seconds),
            short(periods),
            if periods == 1.0 { "" } else { "s" },
            short(period),
            short(1e3 * (hand.speed * period).min(hand.travel)),
            mends.join(" or "),
        ),
    ))
}

/// The script ends before the hand is there, and nothing holds it back.
pub(super) fn not_arrived(track: &Track) -> Option<Warning> {
    let last = track.samples.last()?;
    let held_back = last.force / track.grip;
    let lag = track.commanded - last.handle - held_back;
    if lag <= LAG_SHARE * track.commanded {
        return None;
    }
    Some(warning(
        "not-arrived",
        last.handle,
        format!(
            "the script ends before the hand arrives: the handle went {} of {} mm; write a longer hand.hold or a lower \
             hand.speed",
            short(1e3 * last.handle),
            short(1e3 * track.commanded),
        ),
    ))
}

/// The peak comes a few steps after the first touch.
pub(super) fn few_steps_to_the_peak(track: &Track) -> Option<Warning> {
    let peak = track.peak?;
    let touch = track.samples.iter().position(|s| s.touches)?;
    // As it is told: the steps of contact up to the peak, with the peak's own.
    let steps = (peak + 1).checked_sub(touch)?;
    let moves = track.samples[peak].travel > track.samples[touch].travel;
    if steps >= FEW_STEPS || !moves {
        return None;
    }
    Some(warning(
        "few-steps",
        steps as f64,
        format!(
            "the peak comes in step {steps} of contact, {} mm after the first touch, with {} mm of the hand's way in a \
             period: the rise is not resolved; write a lower hand.speed",
            short(1e3 * (track.samples[peak].travel - track.samples[touch].travel)),
            short(1e3 * track.per_period),
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::track::Sample;
    use super::*;

    fn scene(speed: &str, period: &str) -> Scene {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let text = std::fs::read_to_string(folder.join("clip.toml")).unwrap();
        let text = text.replace("speed = 0.02", &format!("speed = {speed}"));
        let text = format!("{text}\n[device]\nservo_period = {period}\n");
        Scene::from_bytes(text.into_bytes(), &folder.join("clip.toml")).unwrap()
    }

    #[test]
    fn twenty_periods_are_enough_and_nineteen_are_not() {
        // 14 mm.
        assert_eq!(few_periods(&scene("0.02", "1e-3")), None);
        assert_eq!(few_periods(&scene("0.69", "1e-3")), None);
        let told = few_periods(&scene("0.71", "1e-3")).unwrap();
        assert!(told.number.unwrap() < 20.0);
        assert!(!told.text.contains("servo_period"), "{}", told.text);
        let told = few_periods(&scene("0.02", "0.1")).unwrap();
        assert!(told.text.contains("servo_period = 1e-3"), "{}", told.text);
        assert!((told.number.unwrap() - 7.0).abs() < 1e-9);
        assert!(few_periods(&scene("100.0", "1e-3")).is_some());
    }

    /// A hand that ends at so many of ten millimetres against so much force on 2000 N/m.
    fn ended(handle_mm: f64, force: f64) -> Track {
        let last = Sample {
            travel: 1e-3 * handle_mm,
            handle: 1e-3 * handle_mm,
            force,
            touches: true,
        };
        Track::new(vec![Sample::default(), last], 1, 10e-3, 2e-5, 2000.0)
    }

    #[test]
    fn a_hand_that_is_held_back_has_arrived_and_one_that_is_cut_off_has_not() {
        assert_eq!(not_arrived(&ended(10.0, 0.0)), None);
        assert_eq!(not_arrived(&ended(9.6, 0.0)), None);
        assert_eq!(not_arrived(&ended(2.0, 16.0)), None);
        let told = not_arrived(&ended(9.4, 0.0)).unwrap();
        assert!(told.text.contains("9.40 of 10.0 mm"), "{}", told.text);
        assert!(not_arrived(&ended(2.0, 8.0)).is_some());
    }

    #[test]
    fn a_peak_in_the_fourth_step_of_contact_is_not_resolved() {
        let track = |rise: usize| {
            let samples: Vec<Sample> = (0..40)
                .map(|i| Sample {
                    travel: 1e-4 * f64::from(i),
                    handle: 1e-4 * f64::from(i),
                    force: match i as usize {
                        i if i < 10 || i >= 10 + rise => 0.0,
                        i => (i - 9) as f64,
                    },
                    touches: i >= 10,
                })
                .collect();
            Track::new(samples, 40, 4e-3, 1e-4, 2000.0)
        };
        assert_eq!(few_steps_to_the_peak(&track(5)), None);
        let told = few_steps_to_the_peak(&track(4)).unwrap();
        assert_eq!(told.number, Some(4.0));
    }
}

//! A hand that was too soft for the part: the body stayed behind.

use super::track::Track;
use super::units::short;
use super::warning;
use crate::report::Warning;
use crate::scene::Scene;

/// Of the way that was asked for and is open, what the body must have gone.
const SHARE: f64 = 0.9;

/// The body went less far than its handle was sent, although the part lets it through.
pub(super) fn gave_way(scene: &Scene, felt: &Track, driven: &Track) -> Option<Warning> {
    let furthest = |track: &Track| track.samples.iter().map(|s| s.travel).fold(0.0, f64::max);
    let (went, open) = (furthest(felt), furthest(driven).min(felt.commanded));
    if went >= SHARE * open {
        return None;
    }
    let handle = felt.samples.iter().map(|s| s.handle).fold(0.0, f64::max);
    // Whichever spring took up more of the way.
    let (key, now) = if felt.commanded - handle >= handle - went {
        ("hand.stiffness", felt.grip)
    } else {
        (
            "coupling.translational_stiffness",
            scene.coupling.translational_stiffness,
        )
    };
    Some(warning(
        "hand-gave-way",
        went,
        format!(
            "the hand gave way: the body went {} of {} mm, and what was felt is the way up to there; raise {key} (it is \
             {}, and the part's own curve goes up to {} N)",
            short(1e3 * went),
            short(1e3 * open),
            scene.stiffness_words(now),
            short(driven.peak_force),
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::track::Sample;
    use super::*;

    fn track(travel_mm: f64, handle_mm: f64, commanded_mm: f64) -> Track {
        let at = |share: f64| Sample {
            travel: 1e-3 * share * travel_mm,
            handle: 1e-3 * share * handle_mm,
            force: 20.0 * share,
            touches: true,
        };
        Track::new(
            vec![at(0.0), at(0.5), at(1.0)],
            3,
            1e-3 * commanded_mm,
            1e-4,
            2e3,
        )
    }

    fn clip() -> Scene {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        Scene::load(&folder.join("clip.toml")).unwrap()
    }

    #[test]
    fn a_body_that_stays_behind_is_told_with_the_spring_that_gave_way() {
        let driven = track(14.0, 14.0, 14.0);
        let scene = clip();
        assert_eq!(gave_way(&scene, &track(13.9, 14.0, 14.0), &driven), None);
        let soft_hand = gave_way(&scene, &track(1.6, 2.0, 4.5), &driven).unwrap();
        assert!(
            soft_hand.text.contains("1.60 of 4.50 mm"),
            "{}",
            soft_hand.text
        );
        assert!(
            soft_hand.text.contains("raise hand.stiffness"),
            "{}",
            soft_hand.text
        );
        let soft_coupling = gave_way(&scene, &track(1.6, 4.4, 4.5), &driven).unwrap();
        assert!(
            soft_coupling.text.contains("raise coupling"),
            "{}",
            soft_coupling.text
        );
        // Nothing lets the body further, whatever holds it.
        assert_eq!(
            gave_way(&scene, &track(1.6, 4.4, 4.5), &track(1.6, 1.6, 4.5)),
            None
        );
    }
}

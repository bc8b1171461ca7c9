//! A body that went aside, out of the plane of symmetry that a half or quarter model is cut at, or away from the part.

use super::units::short;
use super::warning;
use crate::report::Warning;
use crate::scene::{Guide, Scene};
use crate::session::Recording;

/// Of the travel, how far aside a body between planes of symmetry may go: it belongs in them.
const IN_PLANE: f64 = 1e-3;
/// The same where the part may push it aside, if the force is another by [`FORCE`].
const FREE: f64 = 0.02;
/// Of the driven peak.
const FORCE: f64 = 0.1;

/// Furthest aside on the way in, m, and the largest force, N.
fn furthest(recording: &Recording) -> (f64, f64) {
    let way_in = recording.records.iter();
    let way_in = way_in.take_while(|r| r.phase != device::Phase::Retract);
    way_in.fold((0.0, 0.0), |(aside, force): (f64, f64), r| {
        (aside.max(r.sideways), force.max(recording.resistance(r)))
    })
}

/// Groups that are held in some directions only, as at planes of symmetry.
fn planes(scene: &Scene) -> Option<String> {
    let fixed = scene.part.fixed.iter();
    let cut = fixed.filter(|f| f.components.iter().any(|held| !held));
    let names: Vec<&str> = cut.map(|f| f.group.name.as_str()).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// The drive of a half model is free to leave its plane.
pub(super) fn driven(scene: &Scene, driven: &Recording) -> Option<Warning> {
    let (aside, _) = furthest(driven);
    let is_aside = scene.drive.guide == Guide::Free && aside > IN_PLANE * scene.drive.travel;
    let planes = planes(scene).filter(|_| is_aside)?;
    Some(warning(
        "left-symmetry-plane",
        aside,
        format!(
            "guide = \"free\" let the body go {} mm aside of its way: at planes of symmetry ({planes} are held in some \
             directions only) the other half would hold it back; write drive.guide = \"axis\"",
            short(1e3 * aside)
        ),
    ))
}

/// What a hand let happen. `peak`: of the part's own curve, N.
pub(super) fn felt(scene: &Scene, felt: &Recording, peak: f64) -> Option<Warning> {
    let (aside, force) = furthest(felt);
    let travel = scene.hand.as_ref()?.travel;
    let is_other = (force - peak).abs() > FORCE * peak;
    if let Some(planes) = planes(scene).filter(|_| is_other && aside > IN_PLANE * travel) {
        let text = format!(
            "the hand let the body go {} mm aside of its way, and felt {} N where the part's own curve peaks at {} N: at \
             planes of symmetry ({planes} are held in some directions only) the other half would hold it back; leave \
             [hand] out, or mesh the whole part",
            short(1e3 * aside),
            short(force),
            short(peak)
        );
        return Some(warning("hand-aside", aside, text));
    }
    (is_other && aside > FREE * travel).then(|| {
        let text = format!(
            "the part pushed the body {} mm aside of its way, and the hand felt {} N where the part's own curve peaks at {} \
             N; raise hand.stiffness and coupling.translational_stiffness for a guided body, or write drive.guide = \"free\" \
             for a free one",
            short(1e3 * aside),
            short(force),
            short(peak)
        );
        warning("hand-aside", aside, text)
    })
}

/// The hand did not come as far as the part.
pub(super) fn felt_nothing(felt: &Recording, driven: &Recording) -> Option<Warning> {
    let touches = |recording: &Recording| recording.records.iter().any(|r| r.report.contacts > 0);
    if touches(felt) || !touches(driven) {
        return None;
    }
    let furthest = felt.records.iter().map(|r| r.travel).fold(0.0, f64::max);
    let first = driven.records.iter().find(|r| r.report.contacts > 0);
    let first = first.map_or(0.0, |r| r.travel);
    Some(warning(
        "hand-felt-nothing",
        furthest,
        format!(
            "the hand felt nothing: its body went {} mm and the part begins at {} mm; raise hand.travel",
            short(1e3 * furthest),
            short(1e3 * first)
        ),
    ))
}

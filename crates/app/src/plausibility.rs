//! What makes a result doubtful: each doubt is one warning with its number and the mend.
//!
//! A check is a function in a file of its own that answers with a [`Warning`] or with nothing. Those of
//! [`of_part`] need the mesh and the scene only, those of [`before`] the tool too, those of [`after`] a
//! recording. None of them refuses anything: what is doubtful may be meant.

mod aside;
mod bounce;
mod coupling;
mod gave_way;
mod groups;
mod order;
mod others;
mod script;
mod seam;
mod spike;
mod teeth;
mod touch;
mod track;
mod units;

use contact::tool::Tool;

use crate::Error;
use crate::drive::Driven;
use crate::engine::Engine;
use crate::prepare::{LoadedPart, PrepareOptions, PreparedPart};
use crate::progress::Ui;
use crate::report::Warning;
use crate::scene::{Hand, Scene};
use crate::session::Recording;
use track::Track;

fn warning(id: &'static str, number: f64, text: String) -> Warning {
    Warning {
        id,
        text,
        number: Some(number),
    }
}

/// Prints warnings to the error stream and counts them.
pub(crate) fn tell(warnings: &[Warning], ui: &Ui<'_>) -> usize {
    for warning in warnings {
        ui.note(&format!("warning: {}", warning.text));
    }
    warnings.len()
}

/// Doubts about material and mesh.
pub(crate) fn of_part(scene: &Scene, loaded: &LoadedPart) -> Vec<Warning> {
    [
        units::modulus(scene),
        units::size(scene, &loaded.mesh),
        seam::coincident(&loaded.mesh),
        seam::unmatched(&loaded.mesh),
        groups::same_name(loaded),
        groups::left_out(loaded),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Doubts that are there before a run.
pub(crate) fn before(scene: &Scene, prepared: &PreparedPart, tool: &Tool) -> Vec<Warning> {
    let mut warnings = of_part(scene, &prepared.loaded);
    warnings.extend(units::tool_size(scene, &prepared.loaded.mesh, tool));
    warnings.extend(script::few_periods(scene));
    warnings
}

/// What a run left behind.
pub(crate) struct Ran<'a> {
    pub(crate) prepared: &'a PreparedPart,
    pub(crate) engine: &'a Engine,
    pub(crate) driven: &'a Driven,
    /// What a hand felt, if there was one.
    pub(crate) felt: Option<&'a Recording>,
}

/// Doubts that a run gives rise to. What another order of the elements gives is computed where it is cheap.
///
/// # Errors
/// Ctrl-C.
pub(crate) fn after(
    scene: &Scene,
    ran: &Ran<'_>,
    options: &PrepareOptions,
) -> Result<Vec<Warning>, Error> {
    let driven = &ran.driven.recording;
    let track = Track::of_drive(scene, driven);
    let mut warnings: Vec<Warning> = [
        // What ends the way early touches, though nothing gives way.
        touch::nothing_touched(scene, ran.prepared, ran.engine, driven)
            .filter(|_| ran.driven.stopped_at.is_none()),
        bounce::negative_work(&track),
        teeth::from_node_to_node(&track, driven, &ran.prepared.loaded),
        spike::stands_alone(&track),
        aside::driven(scene, driven),
        others::several_answers(ran.driven),
    ]
    .into_iter()
    .flatten()
    .collect();
    if let (Some(felt), Some(hand)) = (ran.felt, &scene.hand) {
        warnings.extend(of_hand(scene, hand, felt, &track));
        warnings.extend(aside::felt(scene, felt, track.peak_force));
        warnings.extend(aside::felt_nothing(felt, driven));
    }
    warnings.extend(order::checked(
        scene,
        ran.prepared,
        Track::of_drive(scene, &ran.driven.plain().recording).peak_force,
        options,
    )?);
    Ok(warnings)
}

/// Doubts about what the hand felt. `driven`: the part's own curve.
fn of_hand(scene: &Scene, hand: &Hand, felt: &Recording, driven: &Track) -> Vec<Warning> {
    let track = Track::of(scene, hand, felt);
    let warnings = [
        script::not_arrived(&track),
        script::few_steps_to_the_peak(&track),
        bounce::bounced(&track),
        bounce::negative_work(&track).filter(|_| bounce::negative_work(driven).is_none()),
        coupling::too_stiff(scene, hand, felt),
        gave_way::gave_way(scene, &track, driven),
    ];
    warnings.into_iter().flatten().collect()
}

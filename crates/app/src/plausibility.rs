//! What makes a result doubtful: each doubt is one warning with its number and the mend.
//!
//! A check is a function in a file of its own that answers with a [`Warning`] or with nothing. Those of
//! [`of_part`] need the mesh and the scene only, those of [`before`] the tool too, those of [`after`] a
//! recording. None of them refuses anything: what is doubtful may be meant.

mod bounce;
mod coupling;
mod groups;
mod order;
mod script;
mod seam;
mod teeth;
mod touch;
mod track;
mod units;

use contact::tool::Tool;

use crate::Error;
use crate::engine::Engine;
use crate::prepare::{LoadedPart, PrepareOptions, PreparedPart};
use crate::progress::Ui;
use crate::report::Warning;
use crate::scene::Scene;
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

/// Doubts that a run gives rise to. What another order of the elements gives is computed where it is cheap.
///
/// # Errors
/// Ctrl-C.
pub(crate) fn after(
    scene: &Scene,
    prepared: &PreparedPart,
    engine: &Engine,
    recording: &Recording,
    options: &PrepareOptions,
) -> Result<Vec<Warning>, Error> {
    let track = Track::of(scene, recording);
    let mut warnings: Vec<Warning> = [
        touch::nothing_touched(scene, prepared, engine, recording),
        script::not_arrived(&track),
        script::few_steps_to_the_peak(&track),
        bounce::bounced(&track),
        bounce::negative_work(&track),
        coupling::too_stiff(scene, recording),
        teeth::from_node_to_node(&track, recording, &prepared.loaded),
    ]
    .into_iter()
    .flatten()
    .collect();
    warnings.extend(order::checked(scene, prepared, track.peak_force, options)?);
    Ok(warnings)
}

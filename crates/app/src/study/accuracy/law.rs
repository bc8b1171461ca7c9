//! With which law of contact a scene is studied.

use serde::Serialize;

use super::course::{Course, Increment};
use super::point::length;
use crate::prepare::{PrepareOptions, prepare};
use crate::progress::Ui;
use crate::report::plot::short;
use crate::scene::{EffectChoice, Scene};
use crate::{Error, drive, setup};

/// The law of contact of a study: that of the scene's own run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Law {
    /// Whether there is friction.
    pub has_friction: bool,
    /// Which law, and why.
    pub words: String,
}

/// The scene with friction on or off, as a run of it decides, by its own curve without friction where that is left open.
///
/// # Errors
/// As preparing and driving; Ctrl-C.
pub(super) fn decided(
    scene: &Scene,
    options: &PrepareOptions,
    ui: &Ui<'_>,
) -> Result<(Scene, Law), Error> {
    let has_friction = calls_for_friction(scene, options, ui)?;
    let words = words(scene, has_friction);
    let law = Law {
        has_friction,
        words,
    };
    Ok((scene.with_friction(has_friction), law))
}

fn calls_for_friction(scene: &Scene, options: &PrepareOptions, ui: &Ui<'_>) -> Result<bool, Error> {
    // What decides without a run needs no part.
    if let Some(decided) = drive::states_friction(scene) {
        return Ok(decided);
    }
    let (tool, _) = setup::tool(scene)?;
    let prepared = prepare(&setup::part_spec(scene)?, options, ui)?;
    drive::calls_for_friction(scene, &prepared, tool, &ui.progress())
}

fn words(scene: &Scene, has_friction: bool) -> String {
    let effects = &scene.effects;
    match effects.friction_coefficient {
        Some(mu) if has_friction => {
            format!("Coulomb's friction with a coefficient of {}", short(mu))
        }
        None => "without friction, of which the scene states no coefficient".to_owned(),
        Some(_) if effects.friction == EffectChoice::Off => {
            "without friction, which effects.friction leaves out".to_owned()
        }
        Some(mu) => format!(
            "without friction, which changes the force by less than a tenth with a coefficient of {}",
            short(mu)
        ),
    }
}

impl Law {
    /// The column of what is compared beside the forces.
    pub(super) fn energy(&self) -> &'static str {
        match self.has_friction {
            true => "work",
            false => "energy",
        }
    }

    /// What else is to be known of a study with friction: in which increments it is exact.
    pub(super) fn tell_increments(&mut self, course: &Course) {
        if self.has_friction {
            let of = |increment| length(course.length(increment));
            self.words += &format!(
                ", one increment of slip in each step of {}; the exact solutions, and the reference, go in increments of {}",
                of(Increment::OWN),
                of(Increment::EXACT),
            );
        }
    }
}

//! What settings are compared with: the most accurate run of the program itself that can be had.

use super::Runner;
use super::compare::{Reference, Scales, at, distance};
use super::course::Increment;
use super::point::{self, Setting, length};
use super::table::percent;
use crate::prepare::{budget::Forecast, load};
use crate::scene::{Accuracy, Multiply, Preset, Scene};
use crate::{Error, interrupt, setup};

/// Seconds that preparing the reference may take by its forecast, and in a quick study.
const REFERENCE_S: f64 = 120.0;
const QUICK_REFERENCE_S: f64 = 5.0;

/// Planes of the exact solution: enough for any part that is touched at nodes.
const MOST_CONTACTS: usize = 500;

/// In which a scene's exact solutions go: without friction any will do.
pub(super) fn increment(scene: &Scene) -> Increment {
    match scene.effects.simulated_friction() {
        Some(_) => Increment::EXACT,
        None => Increment::OWN,
    }
}

/// The exact solution on the part of a setting.
pub(super) fn exact_on(setting: &Setting) -> Setting {
    let mut exact = setting.clone();
    // Wrenches do not depend on where the shape is multiplied.
    exact.scene.accuracy.multiply = Multiply::Cpu;
    point::set_accuracy(&mut exact.scene, Accuracy::of(Some(Preset::Exact)));
    exact.scene.accuracy.preset = None;
    exact.scene.accuracy.max_contacts = exact.scene.accuracy.max_contacts.max(MOST_CONTACTS);
    exact.increment = increment(&exact.scene);
    exact
}

/// The exact solution on the scene's mesh at another order, refined so often.
fn exact(scene: &Scene, order: u8, refinements: u8) -> Setting {
    let mut setting = point::base(scene, None);
    point::set_order(&mut setting.scene, order);
    setting.refinements = refinements;
    exact_on(&setting)
}

impl Runner<'_, '_> {
    /// The most accurate run that can be prepared in [`REFERENCE_S`], and how wrong it may be.
    pub(super) fn overkill(&mut self, scene: &Scene, scales: &Scales) -> Result<Reference, Error> {
        // Each beside a coarser one, whose difference bounds its error.
        let ladder = [
            ((3, 1), (2, 1), "each element in eight at order 3"),
            ((2, 1), (2, 0), "each element in eight at order 2"),
            ((3, 0), (2, 0), "the scene's mesh at order 3"),
        ];
        let limit_s = match self.options.timed_s {
            Some(_) => QUICK_REFERENCE_S,
            None => REFERENCE_S,
        };
        for (best, coarser, made) in ladder {
            let setting = exact(scene, best.0, best.1);
            if self.store.find(&setting, self.options.timed_s).is_none()
                && !can_be_prepared(&setting, limit_s)?
            {
                continue;
            }
            self.ui.status(&format!("reference: {made}"));
            let coarser = exact(scene, coarser.0, coarser.1);
            let (Ok(fine), Ok(coarse)) = (self.run(&setting), self.run(&coarser)) else {
                if interrupt::is_requested() {
                    return Err(Error::Interrupted);
                }
                continue;
            };
            let of_mesh = self.apart(&coarse.wrench, &fine.wrench, scales);
            let of_increments = self.error_of_increments(scene, scales)?;
            let too = of_increments.map_or(String::new(), |error| {
                let error = percent(error);
                format!("; and {error} from increments twice as large on the scene's own mesh, by the same rule")
            });
            let solved = match increment(scene) {
                Increment::OWN => "LCP to 1e-13".to_owned(),
                _ => format!("friction solved{}", self.in_increments(scene)),
            };
            return Ok(Reference {
                bar: Some(of_mesh + of_increments.unwrap_or(0.0)),
                bar_made: format!(
                    "difference from {} nodes at order {}, which Richardson's rule takes for the error at first order and \
                     for more than it above{too}",
                    coarse.nodes, coarse.order
                ),
                made: format!("{made} ({} nodes), planes converged, {solved}", fine.nodes),
                ..Reference::of(fine)
            });
        }
        let mut own = self.base(scene);
        own.increment = increment(scene);
        Ok(Reference {
            made: format!(
                "the scene's own setting{}: nothing finer could be prepared",
                self.in_increments(scene)
            ),
            bar: None,
            bar_made: "not known: errors are differences within the scene's mesh".to_owned(),
            ..Reference::of(self.run(&own)?)
        })
    }

    /// Of the exact solutions, where they are not the scene's own.
    fn in_increments(&self, scene: &Scene) -> String {
        match increment(scene) {
            Increment::OWN => String::new(),
            finer => format!(" in increments of {}", length(self.course.length(finer))),
        }
    }

    /// How far the exact increments are from ones twice as large, on the scene's own mesh; `None` without friction.
    fn error_of_increments(
        &mut self,
        scene: &Scene,
        scales: &Scales,
    ) -> Result<Option<f64>, Error> {
        let finest = increment(scene);
        if finest == Increment::OWN {
            return Ok(None);
        }
        let mut own = exact_on(&self.base(scene));
        let fine = self.run(&own)?;
        own.increment = finest.doubled();
        let coarse = self.run(&own)?;
        Ok(Some(self.apart(&coarse.wrench, &fine.wrench, scales)))
    }

    /// Of two exact solutions, where settings are compared too.
    fn apart(&self, coarse: &[[f64; 6]], fine: &[[f64; 6]], scales: &Scales) -> f64 {
        let common = self.course.places(Increment::EXACT).common;
        distance(&at(&common, coarse), &at(&common, fine), scales)
    }
}

/// Whether the forecast of preparing is within time and memory.
fn can_be_prepared(setting: &Setting, limit_s: f64) -> Result<bool, Error> {
    let mut spec = setup::part_spec(&setting.scene)?;
    spec.refinements = setting.refinements;
    let Ok(loaded) = load(&spec) else {
        return Ok(false);
    };
    let forecast = Forecast::of(&loaded);
    Ok(forecast.seconds < limit_s && forecast.refuse_what_cannot_fit(&loaded).is_ok())
}

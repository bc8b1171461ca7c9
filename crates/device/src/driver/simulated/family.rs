//! `simulated:<model>`: devices without hardware, held by a hand that rests.

use std::sync::mpsc::channel;

use glamx::DPose3;

use super::{MODELS, Model, Simulated};
use crate::driver::{Family, Listing, Opened, Unavailable};
use crate::hand::{HandSettings, SimulatedHand};

/// Step of hand and body, s: several to the shortest period that real devices are driven at.
const STEP_S: f64 = 1e-4;

/// The family of the simulated devices.
#[derive(Debug)]
pub(crate) struct Simulations;

impl Family for Simulations {
    fn key(&self) -> &'static str {
        "simulated"
    }

    fn title(&self) -> &'static str {
        "simulated devices, no hardware needed"
    }

    fn list(&self) -> Vec<Listing> {
        MODELS
            .iter()
            .map(|model| Listing {
                name: format!("simulated:{}", model.key),
                status: Ok(format!(
                    "{}, {} N at peak, held by a resting hand",
                    model.name, model.limits.peak_force
                )),
            })
            .collect()
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let model = Model::named(place)?;
        let device = SimulatedHand::resting(HandSettings::default(), DPose3::IDENTITY, STEP_S)
            .and_then(|hand| Simulated::of_model(model, hand))
            .map_err(|error| Unavailable::Failed {
                reason: error.to_string(),
            })?;
        let (_nothing_to_tell, messages) = channel();
        let notes = model
            .sources
            .iter()
            .map(|(figures, source)| format!("{figures}: {source}"))
            .collect();
        Ok(Opened {
            device: Box::new(device),
            notes,
            messages,
        })
    }
}

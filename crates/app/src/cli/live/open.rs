//! The device of a live session: a real one by its name, or a simulated one that the scene's hand holds.

use std::str::FromStr;
use std::sync::mpsc::{Receiver, channel};

#[cfg(feature = "viewer")]
use device::Guide;
use device::driver::simulated::Model;
use device::driver::{self, Unavailable};
use device::{
    ChosenCoupling, CouplingWish, HapticDevice, Insertion, Limits, SafetySettings, Script,
    Simulated, SimulatedHand,
};
use glam::{DMat3, DQuat, DVec3};

use super::LiveArgs;
use super::ready::{Loaded, Ready};
use crate::Error;
use crate::report::plot::short;
use crate::scene::{DeviceModel, Scene};
use crate::session::live::{Hands, SecondHand};
use crate::session::{Held, SessionSpec};

/// What stands before the colon of a simulated device's name.
const SIMULATED: &str = "simulated";

const DEVICE: &str = "--device";
const SECOND: &str = "--second-device";

/// The devices of a session.
pub(in crate::cli) struct Devices {
    first: Option<Hand>,
    second: Option<Hand>,
}

impl Devices {
    /// Those that are really there.
    ///
    /// # Errors
    /// Why one cannot be opened.
    pub(in crate::cli) fn external(args: &LiveArgs) -> Result<Self, Error> {
        let second = args.second_device.as_deref();
        let second = second.map(|name| external(SECOND, name));
        Ok(Self {
            first: external(DEVICE, &args.device)?,
            second: second.transpose()?.flatten(),
        })
    }

    /// The simulated ones: the first is held by the scene's hand, the second by one that rests.
    ///
    /// # Errors
    /// A model that does not exist; a way that leaves the device's workspace.
    pub(in crate::cli) fn add_simulated(
        &mut self,
        args: &LiveArgs,
        loaded: &Loaded,
    ) -> Result<(), Error> {
        let session = &loaded.session;
        if self.first.is_none() {
            let of_scene = loaded.scene.device.model;
            self.first = Some(simulated(&args.device, of_scene, session)?);
        }
        if let (None, Some(name)) = (&self.second, &args.second_device) {
            self.second = Some(resting(name, &loaded.other(), session)?);
        }
        Ok(())
    }

    /// In place of a simulated one in the scene's hand: one in a hand that is moved from outside. `None` where the first
    /// device is really there.
    ///
    /// # Errors
    /// A model that does not exist.
    #[cfg(feature = "viewer")]
    pub(in crate::cli) fn add_guided(
        &mut self,
        args: &LiveArgs,
        loaded: &Loaded,
    ) -> Result<Option<Guided>, Error> {
        if self.first.is_some() {
            return Ok(None);
        }
        let session = &loaded.session;
        let model = model(&args.device, loaded.scene.device.model)?;
        let (guide, hand) =
            SimulatedHand::guided(session.hand, session.held.start(), session.period_s)?;
        self.first = Some(in_world(Simulated::of_model(model, hand)?, None));
        Ok(Some(Guided {
            guide,
            reach: model.limits.workspace_half_extents,
        }))
    }

    fn all(&self) -> impl Iterator<Item = &Hand> {
        self.first.iter().chain(&self.second)
    }

    /// What the user should know at once.
    pub(in crate::cli) fn notes(&self) -> impl Iterator<Item = &String> {
        self.all().flat_map(|hand| &hand.notes)
    }

    /// Of both.
    pub(in crate::cli) fn names(&self) -> String {
        let names: Vec<&str> = self.all().map(|hand| hand.device.name()).collect();
        names.join(" and ")
    }

    /// # Errors
    /// Where none was opened.
    pub(in crate::cli) fn first(&self) -> Result<&Hand, Error> {
        let none = || Error::Input("no device is open".to_owned());
        self.first.as_ref().ok_or_else(none)
    }

    /// For the session, and what they will tell.
    ///
    /// # Errors
    /// A scale or limits that are none.
    pub(in crate::cli) fn hands(
        &mut self,
        args: &LiveArgs,
        ready: &Ready,
    ) -> Result<(Hands<'_>, Vec<&Receiver<String>>), Error> {
        let first = self.first.as_mut();
        let first = first.ok_or_else(|| Error::Input("no device is open".to_owned()))?;
        let mut messages = vec![&first.messages];
        let second = match &mut self.second {
            None => None,
            Some(hand) => {
                messages.push(&hand.messages);
                Some(SecondHand {
                    held: ready.other,
                    mapping: hand.mapping(args.second_axes, args.scale, ready.other)?,
                    safety: SafetySettings::live(&hand.limits(args.max_force)?)?,
                    device: &mut *hand.device,
                })
            }
        };
        let first = &mut *first.device;
        Ok((Hands { first, second }, messages))
    }
}

/// What moves the hand of a simulated device.
#[cfg(feature = "viewer")]
pub(in crate::cli) struct Guided {
    pub(in crate::cli) guide: Guide,
    /// m, how far the handle gets from its start along each axis of the world.
    pub(in crate::cli) reach: DVec3,
}

/// A device, ready.
pub(in crate::cli) struct Hand {
    pub(in crate::cli) device: Box<dyn HapticDevice>,
    pub(in crate::cli) notes: Vec<String>,
    pub(in crate::cli) messages: Receiver<String>,
    /// Whether its frame is the scene's world.
    pub(in crate::cli) is_in_world: bool,
    /// Whether nothing holds its handle back.
    pub(in crate::cli) is_rate: bool,
    /// s, of a scripted hand.
    pub(in crate::cli) ends_after_s: Option<f64>,
}

impl Hand {
    /// The device's limits, with the largest force that the user allows.
    ///
    /// # Errors
    /// A largest force that is not one.
    pub(in crate::cli) fn limits(&self, max_force: Option<f64>) -> Result<Limits, Error> {
        let limits = *self.device.limits();
        let Some(most) = max_force else {
            return Ok(limits);
        };
        if !(most.is_finite() && most > 0.0) {
            return Err(Error::Input(format!(
                "--max-force {most} is no force above 0 N"
            )));
        }
        Ok(Limits {
            peak_force: limits.peak_force.min(most),
            continuous_force: limits.continuous_force.min(most),
            ..limits
        })
    }
}

/// A device that is really there; `None` where the name is that of a simulated one.
///
/// # Errors
/// Why it cannot be opened.
fn external(flag: &str, name: &str) -> Result<Option<Hand>, Error> {
    if name.split(':').next() == Some(SIMULATED) {
        return Ok(None);
    }
    let opened = driver::open(name).map_err(|why| cannot(flag, name, &why))?;
    Ok(Some(Hand {
        device: opened.device,
        notes: opened.notes,
        messages: opened.messages,
        is_in_world: false,
        is_rate: driver::is_rate(name),
        ends_after_s: None,
    }))
}

fn cannot(flag: &str, name: &str, why: &Unavailable) -> Error {
    Error::Input(format!("{flag} {name}: {why}"))
}

/// A simulated device, held by the scene's hand.
///
/// # Errors
/// A model that does not exist; a way that leaves the device's workspace.
fn simulated(name: &str, of_scene: DeviceModel, session: &SessionSpec) -> Result<Hand, Error> {
    let model = model(name, of_scene)?;
    let script = Script::new(&Insertion {
        start: session.held.start(),
        direction: session.direction,
        speed: session.speed,
        travel: session.travel,
        hold_s: session.hold_s,
        retract: session.retract,
    })?;
    let ends_after_s = script.periods(session.period_s) as f64 * session.period_s;
    let hand = SimulatedHand::new(session.hand, script, session.period_s)?;
    Ok(in_world(
        Simulated::of_model(model, hand)?,
        Some(ends_after_s),
    ))
}

/// The model that a name asks for.
///
/// # Errors
/// One that does not exist.
fn model(name: &str, of_scene: DeviceModel) -> Result<&'static Model, Error> {
    let place = name
        .split_once(':')
        .map_or(of_scene.key(), |(_, place)| place);
    Model::named(place).map_err(|why| cannot(DEVICE, name, &why))
}

/// A simulated device that holds the other body, in a hand that rests.
///
/// # Errors
/// A model that does not exist.
fn resting(name: &str, held: &Held, session: &SessionSpec) -> Result<Hand, Error> {
    let (_, place) = name.split_once(':').unwrap_or((name, ""));
    let model = Model::named(place).map_err(|why| cannot(SECOND, name, &why))?;
    let hand = SimulatedHand::resting(session.hand, held.start(), session.period_s)?;
    Ok(in_world(Simulated::of_model(model, hand)?, None))
}

/// A simulated device is where its hand is in the world, and nothing happens to it.
fn in_world(device: Simulated, ends_after_s: Option<f64>) -> Hand {
    let (_, messages) = channel();
    Hand {
        device: Box::new(device),
        notes: Vec::new(),
        messages,
        is_in_world: true,
        is_rate: false,
        ends_after_s,
    }
}

/// The scene with the coupling that the device allows where the scene states none; with what to tell of it.
///
/// # Errors
/// Limits that no device has.
pub(in crate::cli) fn coupled(
    mut scene: Scene,
    limits: &Limits,
    period_s: f64,
) -> Result<(Scene, String), Error> {
    let coupling = &mut scene.coupling;
    let wish = CouplingWish {
        translational: coupling.translational_stiffness,
        rotational: coupling.rotational_stiffness,
        ..CouplingWish::default()
    };
    let allowed = ChosenCoupling::for_device(limits, period_s, &wish)?;
    if !coupling.is_translational_given {
        coupling.translational_stiffness = allowed.translational;
    }
    if !coupling.is_rotational_given {
        coupling.rotational_stiffness = allowed.rotational;
    }
    let why = if coupling.translational_stiffness > allowed.translational {
        format!(
            "the scene's; leave it out where the device shakes, which alone bears {}",
            allowed.reason
        )
    } else if coupling.is_translational_given {
        "the scene's".to_owned()
    } else {
        allowed.reason
    };
    let text = format!(
        "{} N/m, {} N m/rad ({why})",
        short(coupling.translational_stiffness),
        short(coupling.rotational_stiffness)
    );
    Ok((scene, text))
}

/// A right-handed permutation of axes with signs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) struct Axes(pub(in crate::cli) DQuat);

impl FromStr for Axes {
    type Err = String;

    /// `+x-z+y`: the device's x, y and z are the scene's x, -z and y.
    fn from_str(text: &str) -> Result<Self, String> {
        const HOW: &str = "write three axes with signs, such as +x-z+y: where the device's x, y and z point in the scene";
        let letters: Vec<char> = text.chars().collect();
        let columns: Option<Vec<DVec3>> = letters
            .chunks(2)
            .map(|pair| {
                let sign = match pair.first()? {
                    '+' => 1.0,
                    '-' => -1.0,
                    _ => return None,
                };
                let axis = match pair.get(1)? {
                    'x' => DVec3::X,
                    'y' => DVec3::Y,
                    'z' => DVec3::Z,
                    _ => return None,
                };
                Some(sign * axis)
            })
            .collect();
        let Some([x, y, z]) = columns.as_deref() else {
            return Err(HOW.to_owned());
        };
        let matrix = DMat3::from_cols(*x, *y, *z);
        if matrix.determinant() != 1.0 {
            return Err(format!(
                "{text} is no right-handed frame: each axis once, and an even number of swaps and minus signs; {HOW}"
            ));
        }
        Ok(Self(DQuat::from_mat3(&matrix)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_turn_as_they_are_written() {
        let axes: Axes = "+x-z+y".parse().unwrap();
        assert!((axes.0 * DVec3::Y - DVec3::NEG_Z).length() < 1e-15);
        assert!((axes.0 * DVec3::Z - DVec3::Y).length() < 1e-15);
        let same: Axes = "+x+y+z".parse().unwrap();
        assert!((same.0 * DVec3::new(1.0, 2.0, 3.0) - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-15);
        for bad in [
            "", "x", "+x+y", "+x+y-z", "+x+x+z", "+x+y+z+x", "-x-y-z", "+a+b+c", "+x+y+é",
        ] {
            assert!(bad.parse::<Axes>().is_err(), "{bad}");
        }
    }
}

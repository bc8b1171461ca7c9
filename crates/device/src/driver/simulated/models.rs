//! Devices that people have, as far as their figures are known.
//!
//! Each figure's source stands beside it; "assumed" is a choice, not a fact. "Data sheet" figures are given from
//! memory of the maker's sheet, "chai3d" and others are what that program's source uses for the device.

use glam::DVec3;

use super::{BodySettings, SimulatedSettings};
use crate::driver::Unavailable;
use crate::haptic_device::Limits;
use crate::stability::Plant;

/// A device to simulate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// What stands after the colon of its name.
    pub key: &'static str,
    /// Name for people.
    pub name: &'static str,
    /// What the hardware can do.
    pub limits: Limits,
    /// Its moving parts and its wire.
    pub body: BodySettings,
    /// Figures and where each comes from.
    pub sources: &'static [(&'static str, &'static str)],
}

/// The source of what no maker states: rotational inertia and damping, velocity filter, jitter, thermal window.
const ASSUMED_FOR_ALL: (&str, &str) = (
    "inertia and damping of a turn, velocity filter, jitter, 60 s of thermal window",
    "assumed",
);

/// All models, the first is the one that is opened where none is named.
pub static MODELS: &[Model] = &[
    Model {
        key: "virtuose-6d",
        name: "simulated Virtuose 6D",
        limits: Limits {
            position_resolution: 1e-5,
            max_stiffness: Some(2000.0),
            max_rotational_stiffness: Some(30.0),
            damping: Some(2.0),
            ..Limits::virtuose_6d()
        },
        body: BodySettings {
            mass: 1.0,
            inertia: 2e-3,
            rotational_damping: 5e-3,
            ..body(1e-3)
        },
        sources: &[
            (
                "forces 10 and 35 N in steps of 0.2 N, 3.1 N m, cube of 0.40 m, 3e-5 rad",
                "Duriez, Andriot, Kheddar 2004",
            ),
            ("position to 0.01 mm", "from 3e-5 rad at 0.4 m"),
            (
                "largest stiffness 2000 N/m and 30 N m/rad, mass 1 kg, damping 2 N s/m, delay 1 ms",
                "assumed",
            ),
            ("dry friction", "not known, none is simulated"),
            ASSUMED_FOR_ALL,
        ],
    },
    Model {
        key: "touch",
        name: "simulated Touch",
        limits: Limits {
            workspace_half_extents: DVec3::new(0.080, 0.060, 0.035),
            continuous_force: 0.88,
            peak_force: 3.3,
            position_resolution: 5.5e-5,
            max_stiffness: Some(400.0),
            max_damping: Some(4.0),
            damping: Some(0.5),
            coulomb_friction: Some(0.26),
            ..FORCES_ALONE
        },
        body: BodySettings {
            mass: 0.045,
            ..body(1e-3)
        },
        sources: &[
            (
                "forces 0.88 and 3.3 N, 160 x 120 x 70 mm, step 0.055 mm, mass 45 g, friction 0.26 N",
                "data sheet",
            ),
            ("largest stiffness 400 N/m, damping 4 N s/m", "chai3d"),
            ("own damping 0.5 N s/m, delay 1 ms", "assumed"),
            ASSUMED_FOR_ALL,
        ],
    },
    Model {
        key: "falcon",
        name: "simulated Falcon",
        limits: Limits {
            workspace_half_extents: DVec3::splat(0.040),
            continuous_force: 4.0,
            peak_force: 8.0,
            position_resolution: 6e-5,
            max_stiffness: Some(3000.0),
            max_damping: Some(20.0),
            damping: Some(2.0),
            ..FORCES_ALONE
        },
        body: BodySettings {
            mass: 0.25,
            ..body(1e-3)
        },
        sources: &[
            (
                "force 8 N, largest stiffness 3000 N/m, damping 20 N s/m, radius 40 mm",
                "chai3d",
            ),
            ("step 0.06 mm", "data sheet"),
            (
                "continuous force 4 N, mass 0.25 kg, own damping 2 N s/m, delay 1 ms",
                "assumed",
            ),
            ("dry friction", "not known, none is simulated"),
            ASSUMED_FOR_ALL,
        ],
    },
    Model {
        key: "omega",
        name: "simulated omega.3",
        limits: Limits {
            workspace_half_extents: DVec3::new(0.055, 0.080, 0.080),
            continuous_force: 12.0,
            peak_force: 12.0,
            position_resolution: 1e-5,
            max_stiffness: Some(5000.0),
            max_damping: Some(30.0),
            damping: Some(3.0),
            ..FORCES_ALONE
        },
        body: BodySettings {
            mass: 0.2,
            ..body(2.5e-4)
        },
        sources: &[
            (
                "force 12 N, largest stiffness 5000 N/m, damping 30 N s/m",
                "chai3d",
            ),
            ("160 x 110 mm, step 0.01 mm", "data sheet"),
            (
                "12 N for ever, mass 0.2 kg, own damping 3 N s/m, delay 0.25 ms (a tick at 4 kHz)",
                "assumed",
            ),
            ("dry friction", "not known, none is simulated"),
            ASSUMED_FOR_ALL,
        ],
    },
    Model {
        key: "inverse3",
        name: "simulated Inverse3",
        limits: Limits {
            workspace_half_extents: DVec3::splat(0.100),
            continuous_force: 5.0,
            peak_force: 10.0,
            position_resolution: 1e-5,
            max_stiffness: Some(1000.0),
            max_damping: Some(6.0),
            damping: Some(1.0),
            ..FORCES_ALONE
        },
        body: BodySettings {
            mass: 0.1,
            ..body(5e-4)
        },
        sources: &[
            (
                "force 10 N, largest stiffness 1000 N/m, damping 6 N s/m, radius 100 mm",
                "chai3d for this device",
            ),
            ("step 0.01 mm", "data sheet"),
            (
                "continuous force 5 N, mass 0.1 kg, own damping 1 N s/m, delay 0.5 ms",
                "assumed",
            ),
            ("dry friction", "not known, none is simulated"),
            ASSUMED_FOR_ALL,
        ],
    },
];

/// A device that renders no torque, with nothing else known.
const FORCES_ALONE: Limits = Limits {
    peak_torque: 0.0,
    force_resolution: 0.0,
    rotation_resolution: 0.0,
    ..Limits::virtuose_6d()
};

/// What is assumed for all bodies, with a delay in s.
const fn body(delay_s: f64) -> BodySettings {
    BodySettings {
        mass: 1.0,
        inertia: 2e-4,
        rotational_damping: 1e-3,
        delay_s,
        jitter_s: 1e-4,
        velocity_window_s: 5e-3,
    }
}

impl Model {
    /// The model of a name; the first for "".
    ///
    /// # Errors
    /// An unknown name, with those that exist.
    pub fn named(key: &str) -> Result<&'static Self, Unavailable> {
        let found = MODELS
            .iter()
            .find(|model| key.is_empty() || model.key == key);
        found.ok_or_else(|| {
            let keys: Vec<&str> = MODELS.iter().map(|model| model.key).collect();
            Unavailable::UnknownName {
                given: format!("simulated:{key}"),
                mend: format!("simulated devices are {}", keys.join(", ")),
            }
        })
    }

    /// The settings of the simulated device.
    #[must_use]
    pub fn settings(&self) -> SimulatedSettings {
        SimulatedSettings {
            limits: self.limits,
            body: Some(self.body),
            ..SimulatedSettings::default()
        }
    }

    /// What moves at the handle, for the stability of a wall at a period (s); its delay in whole periods, rounded up.
    #[must_use]
    pub fn plant(&self, period_s: f64) -> Plant {
        // A rounded quotient just above a whole number is that number.
        let periods = (self.body.delay_s / period_s - 1e-9).ceil().max(0.0);
        Plant {
            mass: self.body.mass,
            damping: self.limits.damping.unwrap_or(0.0),
            delay_periods: periods as u32,
        }
    }
}

#[cfg(test)]
mod tests;

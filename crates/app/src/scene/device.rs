//! `[device]`: the haptic device.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SceneError;
use super::check::{Check, Range::Positive};
use super::keys::Time;

/// s.
const SERVO_PERIOD: f64 = 1e-3;

/// The haptic device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Device {
    /// Which one.
    pub model: DeviceModel,
    /// s, in [1e-5, 0.1].
    pub servo_period: f64,
    /// Whether steps wait for the clock; else they follow each other.
    pub real_time: bool,
}

/// Known devices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum DeviceModel {
    /// the force and torque limits of a Virtuose 6D as its paper gives them, and nothing else of it.
    #[default]
    #[serde(rename = "virtuose-6d")]
    Virtuose6d,
    /// a Touch: mass, friction, encoder, delay and limits.
    #[serde(rename = "touch")]
    Touch,
    /// a Falcon, likewise.
    #[serde(rename = "falcon")]
    Falcon,
    /// an omega.3, likewise.
    #[serde(rename = "omega")]
    Omega,
    /// an Inverse3, likewise.
    #[serde(rename = "inverse3")]
    Inverse3,
}

impl DeviceModel {
    /// What stands after `simulated:` in its name.
    pub fn key(self) -> &'static str {
        match self {
            Self::Virtuose6d => "virtuose-6d",
            Self::Touch => "touch",
            Self::Falcon => "falcon",
            Self::Omega => "omega",
            Self::Inverse3 => "inverse3",
        }
    }
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct DeviceKeys {
    /// Which device is simulated (`docs/devices.md` has their figures).
    model: DeviceModel,
    /// Time between two forces sent to the device, 1e-5 s to 0.1 s.
    #[schemars(extend("default" = SERVO_PERIOD))]
    servo_period: Option<Time>,
    /// Whether each step waits for its moment on the clock; else steps follow each other at once.
    real_time: bool,
}

impl DeviceKeys {
    pub(super) fn checked(&self, check: &Check<'_>) -> Result<Device, SceneError> {
        let servo_period = match self.servo_period {
            None => SERVO_PERIOD,
            Some(written) => {
                let period = check.number("servo_period", written, Positive)?;
                if !(1e-5..=0.1).contains(&period) {
                    let what = format!("servo_period {period} s is not between 1e-5 and 0.1");
                    let mend = "haptic devices take 0.001";
                    return Err(check.error(written.offset, what, mend));
                }
                period
            }
        };
        Ok(Device {
            model: self.model,
            servo_period,
            real_time: self.real_time,
        })
    }
}

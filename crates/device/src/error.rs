//! What can go wrong with a device or with the settings of this crate.

use thiserror::Error;

/// An error of a device, of its loop, or of a setting given to this crate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A setting is outside what it may be. Found at construction, never in the loop.
    #[error("{name} is {value}; it must be {allowed}")]
    InvalidSetting {
        /// The setting, as its field is called.
        name: &'static str,
        /// What was given, SI.
        value: f64,
        /// What is allowed, in words, with the unit.
        allowed: &'static str,
    },
    /// The scripted motion leaves the device's workspace.
    #[error(
        "the scripted motion goes {beyond} m beyond the workspace along {axis}; \
         shorten the travel or start nearer the middle of the workspace"
    )]
    LeavesWorkspace {
        /// How far beyond, m.
        beyond: f64,
        /// The axis of the device's frame: `x`, `y` or `z`.
        axis: char,
    },
    /// A device was asked for a time before the one it has already served.
    #[error("time went back from {from_s} s to {to_s} s; no sample was taken")]
    TimeWentBack {
        /// Time of the last sample, s.
        from_s: f64,
        /// Time asked for, s.
        to_s: f64,
    },
    /// A device was asked for a time too far after the last one, as after a suspended machine.
    #[error("time jumped from {from_s} s to {to_s} s; the device goes on from the new time")]
    TimeJump {
        /// Time of the last sample, s.
        from_s: f64,
        /// Time asked for, s.
        to_s: f64,
    },
    /// A wrench that is not finite reached a driver; it was not rendered.
    #[error("a wrench that is not finite was sent to {device}; nothing was rendered")]
    NonFiniteWrench {
        /// The device's name.
        device: String,
    },
    /// The device does not answer.
    #[error("{device} does not answer: {reason}")]
    NoAnswer {
        /// The device's name.
        device: String,
        /// What the operating system or the device said.
        reason: String,
    },
    /// The device or its server has gone: it must be opened anew.
    #[error("{reason}")]
    Gone {
        /// What the operating system or the device said.
        reason: String,
    },
    /// The newest sample of the device is too old. Carries no text: the loop meets it once a period.
    #[error("no sample from the device for {age_s:.3} s")]
    Silent {
        /// Age of the newest sample, s.
        age_s: f64,
    },
    /// The device failed for too many periods in a row; the loop was ended with zero force.
    #[error(
        "the device failed {failures} times in a row; the loop was ended with zero force \
         (last failure: {last})"
    )]
    Lost {
        /// Failures in a row.
        failures: u32,
        /// The last of them.
        last: Box<DeviceError>,
    },
}

/// `Ok` if `is_allowed`, else the error that names the setting.
pub(crate) fn check_setting(
    name: &'static str,
    value: f64,
    is_allowed: bool,
    allowed: &'static str,
) -> Result<(), DeviceError> {
    if is_allowed {
        Ok(())
    } else {
        Err(DeviceError::InvalidSetting {
            name,
            value,
            allowed,
        })
    }
}

/// The setting must be finite and above zero.
pub(crate) fn check_positive(name: &'static str, value: f64) -> Result<(), DeviceError> {
    check_setting(
        name,
        value,
        value.is_finite() && value > 0.0,
        "finite and above 0",
    )
}

/// The setting must be finite and not below zero.
pub(crate) fn check_not_negative(name: &'static str, value: f64) -> Result<(), DeviceError> {
    check_setting(
        name,
        value,
        value.is_finite() && value >= 0.0,
        "finite and 0 or above",
    )
}

//! Drivers: one file per family of devices, and one line in [`FAMILIES`].
//!
//! A device is named by its family and, after a colon, by its place: `simulated:virtuose-6d`,
//! `vrpn:Phantom0@host`. A family without a colon means its first device.
//!
//! ```text
//! loop (HapticDevice) ── command ──> newest-value box ──> thread of the driver ── Link ──> hardware
//!                     <── state ──── newest-value box <──
//! ```
//! What talks to hardware may block, fail or allocate, so it runs on a thread of its own ([`Threaded`]); the loop
//! only looks into boxes.

use std::sync::mpsc::Receiver;

use thiserror::Error;

use crate::haptic_device::HapticDevice;

pub mod dhd;
mod gamepad;
pub mod haply;
pub mod hd;
mod library;
pub mod link;
mod rate;
pub mod simulated;
mod spacemouse;
mod spnav;
pub mod virtuose;
pub mod vrpn;

pub use link::{Identity, Link, Threaded};

/// A family of devices: how they are found and opened.
pub trait Family: Sync {
    /// What stands before the colon of a device's name.
    fn key(&self) -> &'static str;

    /// What it is, for people, in a few words.
    fn title(&self) -> &'static str;

    /// What is attached, and what could be and why not. May take a second, never longer. At least one entry.
    fn list(&self) -> Vec<Listing>;

    /// Whether a deflection is a velocity: the handle's pose is integrated, and nothing holds it back at a wall.
    fn is_rate(&self) -> bool {
        false
    }

    /// Opens a device by its place, what stands after the colon; "" is the first there is.
    ///
    /// # Errors
    /// Why it cannot be opened.
    fn open(&self, place: &str) -> Result<Opened, Unavailable>;
}

/// One line of the list of devices.
#[derive(Debug, Clone, PartialEq)]
pub struct Listing {
    /// Name to open it by, or of the family where none is attached.
    pub name: String,
    /// What it is (model, serial number, version), or why there is none.
    pub status: Result<String, Unavailable>,
}

/// A device ready for the loop.
pub struct Opened {
    /// For the loop.
    pub device: Box<dyn HapticDevice>,
    /// What the user should know at once: settings of a service that change the force, versions.
    pub notes: Vec<String>,
    /// What the driver tells later, once each: lost, back again, blocked, the device's own safety. Not for the loop.
    pub messages: Receiver<String>,
}

impl std::fmt::Debug for Opened {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Opened")
            .field("device", &self.device.name())
            .field("notes", &self.notes)
            .finish_non_exhaustive()
    }
}

/// Why a device cannot be used, with the mend.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Unavailable {
    /// A name without a family, or a place that the family does not know.
    #[error("there is no device \"{given}\"; {mend}")]
    UnknownName {
        /// As given.
        given: String,
        /// The nearest names, or where they are listed.
        mend: String,
    },
    /// The maker's library is not installed.
    #[error("library not found, tried {}; {mend}", tried.join(", "))]
    NoLibrary {
        /// Names that were tried.
        tried: Vec<String>,
        /// Where it comes from.
        mend: String,
    },
    /// The library or service is there, but not in a version that is understood.
    #[error("{what} is version {found}; {mend}")]
    WrongVersion {
        /// Library, service or server.
        what: String,
        /// Its version.
        found: String,
        /// Versions that are understood.
        mend: String,
    },
    /// Nothing is attached, or nobody answers at the place.
    #[error("{reason}")]
    NotThere {
        /// What was looked for and where.
        reason: String,
    },
    /// The operating system refuses.
    #[error("permission denied for {path}; {mend}")]
    PermissionDenied {
        /// Device file or socket.
        path: String,
        /// The rule that mends it, ready to copy.
        mend: String,
    },
    /// Another program has it.
    #[error("busy: {reason}")]
    Busy {
        /// Who or what, as far as it is known.
        reason: String,
    },
    /// It answers, but would not render a force (not calibrated, no power).
    #[error("not ready: {reason}")]
    NotReady {
        /// What it waits for.
        reason: String,
    },
    /// Another failure on the way.
    #[error("{reason}")]
    Failed {
        /// What was done and what came of it.
        reason: String,
    },
}

/// All families. Adding one is a file and a line here.
pub static FAMILIES: &[&dyn Family] = &[
    &simulated::Simulations,
    &virtuose::INSTALLED,
    &dhd::INSTALLED,
    &hd::INSTALLED,
    &haply::Haply,
    &vrpn::Vrpn,
    &spacemouse::SpaceMouse,
    &spnav::Spnav,
    &gamepad::Gamepad,
];

/// Every device that is attached and every way that leads to none, with the reason.
#[must_use]
pub fn list() -> Vec<Listing> {
    std::thread::scope(|scope| {
        let asked: Vec<_> = FAMILIES
            .iter()
            .map(|family| (family, scope.spawn(|| family.list())))
            .collect();
        asked
            .into_iter()
            .flat_map(|(family, listing)| {
                listing.join().unwrap_or_else(|_| {
                    let reason = "looking for devices of this family failed".to_owned();
                    vec![Listing {
                        name: family.key().to_owned(),
                        status: Err(Unavailable::Failed { reason }),
                    }]
                })
            })
            .collect()
    })
}

/// Whether a device of this name is one whose deflection is a velocity ([`Family::is_rate`]).
#[must_use]
pub fn is_rate(name: &str) -> bool {
    let key = name.split(':').next();
    (FAMILIES.iter()).any(|family| key == Some(family.key()) && family.is_rate())
}

/// Opens a device by its name.
///
/// # Errors
/// Why it cannot be opened; for an unknown family the names that exist.
pub fn open(name: &str) -> Result<Opened, Unavailable> {
    let (key, place) = name.split_once(':').unwrap_or((name, ""));
    let family = FAMILIES.iter().find(|family| family.key() == key);
    let Some(family) = family else {
        let keys: Vec<&str> = FAMILIES.iter().map(|family| family.key()).collect();
        return Err(Unavailable::UnknownName {
            given: name.to_owned(),
            mend: format!(
                "a name begins with one of {}; `snapin devices` lists what is there",
                keys.join(", ")
            ),
        });
    };
    checked(family.open(place)?)
}

/// Nothing is rendered by limits that no device has.
fn checked(opened: Opened) -> Result<Opened, Unavailable> {
    match opened.device.limits().check() {
        Ok(()) => Ok(opened),
        Err(error) => Err(Unavailable::Failed {
            reason: format!(
                "{} reports limits that no device has: {error}",
                opened.device.name()
            ),
        }),
    }
}

//! 3D Systems' Touch, Touch X and Phantom, through the maker's OpenHaptics (`libHD`).
//!
//! `hd` is the default device, `hd:NAME` the one of this name in the maker's setup. The frame is the maker's: x to
//! the right, y up, z toward the operator.

use std::ffi::CString;
use std::path::PathBuf;
use std::time::Duration;

use super::link::Connected;
use super::{Family, Listing, Opened, Unavailable};
use crate::driver::library::{self, Library, Shelf, Spec};

mod api;
mod frame;
mod limits;
mod stylus;

use api::{Device, Failure, Functions, number};

/// Version of OpenHaptics that is understood, the first number.
const MAJOR_VERSION: u32 = 3;

static SHELF: Shelf<Functions> = Shelf::new();

const SPEC: Spec = Spec {
    variable: "SNAPIN_LIBHD",
    names: if cfg!(windows) {
        &["hd.dll"]
    } else if cfg!(target_os = "macos") {
        &["libHD.dylib"]
    } else {
        &["libHD.so.3.4", "libHD.so", "libHD.so.3.5", "libHD.so.3"]
    },
    folders: if cfg!(windows) {
        &["C:\\OpenHaptics\\Developer\\3.5.0\\lib\\x64\\Release"]
    } else {
        &[
            "/usr/lib",
            "/usr/lib64",
            "/usr/local/lib",
            "/opt/OpenHaptics/Developer/3.4-0/lib",
        ]
    },
    source: "it is part of OpenHaptics 3 by 3D Systems, which also needs the driver of the device",
};

/// The family of devices that OpenHaptics drives.
#[derive(Debug, Clone)]
pub struct Hd {
    /// The library's file; `None`: as the environment says, or where it usually lies.
    pub library: Option<PathBuf>,
    /// Longest time the library may take to open a device. Default 10 s.
    pub patience: Duration,
}

/// The family with the library that is installed.
pub static INSTALLED: Hd = Hd::with_library(None);

impl Hd {
    /// The family through this file, or through the one that is installed.
    #[must_use]
    pub const fn with_library(library: Option<PathBuf>) -> Self {
        Self {
            library,
            patience: library::PATIENCE,
        }
    }

    fn load(&self) -> Result<&'static Library<Functions>, Unavailable> {
        SHELF.get(&SPEC, self.library.as_deref())
    }

    fn connect(&self, name: Option<&CString>) -> Result<Connected, Unavailable> {
        let library = self.load()?;
        let lease = library.lease()?;
        let device = Device::init(library, name.map(CString::as_c_str)).map_err(|e| refused(&e))?;
        let version = version(library, &device).inspect_err(|_| device.disable())?;
        stylus::start(device, lease, &version)
    }

    /// The default device.
    fn look(&self) -> Result<String, Unavailable> {
        let library = self.load()?;
        let _lease = library.lease()?;
        let device = Device::init(library, None).map_err(|e| refused(&e))?;
        let found = version(library, &device)
            .map(|version| format!("{}, OpenHaptics {version}", stylus::name(&device)));
        device.disable();
        found
    }
}

impl Family for Hd {
    fn key(&self) -> &'static str {
        "hd"
    }

    fn title(&self) -> &'static str {
        "3D Systems Touch and Phantom (OpenHaptics)"
    }

    fn list(&self) -> Vec<Listing> {
        let this = self.clone();
        let status =
            library::within(library::LIST_LIMIT, move || this.look()).unwrap_or_else(|| {
                Err(Unavailable::NotThere {
                    reason:
                        "the default device has not answered so far; another one is named hd:NAME"
                            .to_owned(),
                })
            });
        vec![Listing {
            name: self.key().to_owned(),
            status,
        }]
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let name = name_of(place)?;
        let this = self.clone();
        library::open_within(self.patience, move || this.connect(name.as_ref()))
    }
}

/// The name of a device in the maker's setup, or none for the default one.
fn name_of(place: &str) -> Result<Option<CString>, Unavailable> {
    if place.is_empty() {
        return Ok(None);
    }
    let is_name = place.len() <= 255 && !place.chars().any(char::is_control);
    match CString::new(place) {
        Ok(name) if is_name => Ok(Some(name)),
        _ => Err(Unavailable::UnknownName {
            given: format!("hd:{}", place.escape_debug()),
            mend:
                "a place is the name the device has in the maker's setup, as in hd:Default Device"
                    .to_owned(),
        }),
    }
}

/// The version of the library as it states it; one that states none is taken as it is.
fn version(library: &Library<Functions>, device: &Device) -> Result<String, Unavailable> {
    let version = device.string(number::VERSION);
    let major = version
        .split('.')
        .next()
        .and_then(|major| major.trim().parse().ok());
    match major {
        Some(MAJOR_VERSION) => Ok(version),
        None => Ok("of unknown version".to_owned()),
        Some(_) => Err(Unavailable::WrongVersion {
            what: library.file.clone(),
            found: version,
            mend: "version 3 of OpenHaptics is understood".to_owned(),
        }),
    }
}

/// Why a device could not be initialised, by the library's error.
fn refused(failure: &Failure) -> Unavailable {
    match failure.code {
        0x0301 => Unavailable::Busy {
            reason: format!("it is initialised already, by another program ({failure})"),
        },
        0x0300 | 0x0302 | 0x0303 => Unavailable::NotThere {
            reason: format!(
                "no device answers ({failure}); it must be plugged in, switched on and set up with the maker's \
                 setup program, and the user must be allowed to open it"
            ),
        },
        _ => Unavailable::Failed {
            reason: format!("it could not be initialised: {failure}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_is_a_name_or_nothing() {
        assert_eq!(name_of(""), Ok(None));
        let named = name_of("Left Device").unwrap().unwrap();
        assert_eq!(named.to_str().unwrap(), "Left Device");
        for place in ["a\0b", "a\nb", &"x".repeat(300)] {
            let error = name_of(place).unwrap_err().to_string();
            assert!(error.contains("hd:Default Device"), "{error}");
            assert!(!error.contains('\0') && !error.contains('\n'));
        }
    }
}

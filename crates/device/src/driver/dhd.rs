//! Force Dimension's devices (omega, sigma, delta, lambda) and what else `libdhd` drives, through that library.
//!
//! `dhd` is the first device that is free, `dhd:0` the one of this number. The frame is the maker's: x toward the
//! operator, y to the right, z up.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::link::Connected;
use super::{Family, Listing, Opened, Unavailable};
use crate::driver::library::{self, Library, Shelf, Spec};

mod api;
mod arm;

use api::{Device, Failure, Functions};

/// Version of the library that is understood, the first number.
const MAJOR_VERSION: i32 = 3;

/// Devices that are listed at most.
const LISTED_MAX: i8 = 16;

/// What lets a user open the device on Linux; a file that sorts before 73.
const UDEV_RULE: &str = r#"SUBSYSTEM=="usb", ATTRS{idVendor}=="1451", TAG+="uaccess""#;

static SHELF: Shelf<Functions> = Shelf::new();

const SPEC: Spec = Spec {
    variable: "SNAPIN_LIBDHD",
    names: if cfg!(windows) {
        &["dhd64.dll", "drd64.dll", "dhd.dll"]
    } else if cfg!(target_os = "macos") {
        &["libdhd.dylib", "libdrd.dylib"]
    } else {
        &["libdhd.so.3", "libdhd.so", "libdrd.so.3", "libdrd.so"]
    },
    folders: if cfg!(windows) {
        &["C:\\Program Files\\Force Dimension\\sdk\\bin"]
    } else {
        &["/usr/local/lib", "/usr/lib", "/opt/forcedimension/lib"]
    },
    source: "it is part of the Force Dimension SDK 3 (lib/release/*/libdhd.so.3.*)",
};

/// The family of devices that `libdhd` drives.
#[derive(Debug, Clone)]
pub struct Dhd {
    /// The library's file; `None`: as the environment says, or where it usually lies.
    pub library: Option<PathBuf>,
    /// Longest time the library may take to open a device. Default 10 s.
    pub patience: Duration,
}

/// The family with the library that is installed.
pub static INSTALLED: Dhd = Dhd::with_library(None);

impl Dhd {
    /// The family through this file, or through the one that is installed.
    #[must_use]
    pub const fn with_library(library: Option<PathBuf>) -> Self {
        Self {
            library,
            patience: library::PATIENCE,
        }
    }

    /// The library in a version that is understood.
    fn load(&self) -> Result<(&'static Library<Functions>, String), Unavailable> {
        let library = SHELF.get(&SPEC, self.library.as_deref())?;
        let [major, minor, release] = api::sdk_version(library);
        let version = format!("{major}.{minor}.{release}");
        if major != MAJOR_VERSION {
            return Err(Unavailable::WrongVersion {
                what: library.file.clone(),
                found: version,
                mend: "version 3 of the Force Dimension SDK is understood".to_owned(),
            });
        }
        Ok((library, version))
    }

    fn connect(&self, id: Option<i8>) -> Result<Connected, Unavailable> {
        let (library, version) = self.load()?;
        let lease = library.lease()?;
        let device = Device::open(library, id).map_err(|failure| refused(library, &failure))?;
        arm::start(device, lease, &version)
    }

    /// What is attached, by number; told one by one, for each takes its time.
    fn look(&self, tell: &Mutex<Vec<Listing>>) -> Result<(), Unavailable> {
        let (library, version) = self.load()?;
        let _lease = library.lease()?;
        let count = api::device_count(library).map_err(|failure| refused(library, &failure))?;
        if count == 0 {
            return Err(not_there("no device is attached or switched on"));
        }
        for id in 0..count.min(LISTED_MAX) {
            let status = Device::open(library, Some(id))
                .map(|device| {
                    let name = arm::name(&device);
                    device.close();
                    format!("{name}, SDK {version}")
                })
                .map_err(|failure| refused(library, &failure));
            let name = format!("dhd:{id}");
            lock(tell).push(Listing { name, status });
        }
        Ok(())
    }

    fn without(&self, error: Unavailable) -> Listing {
        Listing {
            name: self.key().to_owned(),
            status: Err(error),
        }
    }
}

impl Family for Dhd {
    fn key(&self) -> &'static str {
        "dhd"
    }

    fn title(&self) -> &'static str {
        "Force Dimension omega, sigma, delta, lambda"
    }

    fn list(&self) -> Vec<Listing> {
        let this = self.clone();
        let told = Arc::new(Mutex::new(Vec::new()));
        let tell = Arc::clone(&told);
        let ended = library::within(library::LIST_LIMIT, move || this.look(&tell));
        let mut listings = std::mem::take(&mut *lock(&told));
        match ended {
            Some(Ok(())) => {}
            Some(Err(error)) => listings.push(self.without(error)),
            None => listings.push(self.without(not_there("the library has not answered so far"))),
        }
        listings
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let id = id_of(place)?;
        let this = self.clone();
        library::open_within(self.patience, move || this.connect(id))
    }
}

/// The number of a device, or none for the first that is free.
fn id_of(place: &str) -> Result<Option<i8>, Unavailable> {
    if place.is_empty() {
        return Ok(None);
    }
    match place.parse::<i8>() {
        Ok(id) if id >= 0 => Ok(Some(id)),
        _ => Err(Unavailable::UnknownName {
            given: format!("dhd:{place}"),
            mend: "a place is the number of a device, as in dhd:0; `snapin devices` lists them"
                .to_owned(),
        }),
    }
}

fn lock(listings: &Mutex<Vec<Listing>>) -> MutexGuard<'_, Vec<Listing>> {
    listings.lock().unwrap_or_else(PoisonError::into_inner)
}

fn not_there(reason: &str) -> Unavailable {
    Unavailable::NotThere {
        reason: reason.to_owned(),
    }
}

/// Why a device could not be opened, by the library's error.
fn refused(library: &Library<Functions>, failure: &Failure) -> Unavailable {
    match failure.code {
        // DHC_BUSY, DEVICE_IN_USE
        3 | 20 => Unavailable::Busy {
            reason: format!("another program has it ({failure})"),
        },
        // NO_DEVICE_FOUND, INVALID_INDEX
        5 | 15 => Unavailable::NotThere {
            reason: format!("no such device is attached or switched on ({failure})"),
        },
        // COM, where a device is attached all the same: on Linux this is how a refusal of the system looks.
        2 if cfg!(target_os = "linux")
            && api::device_count(library).is_ok_and(|count| count > 0) =>
        {
            Unavailable::PermissionDenied {
                path: format!("a device on the USB ({failure})"),
                mend: format!(
                    "where the user may not open it, write into /etc/udev/rules.d/70-force-dimension.rules: \
                     {UDEV_RULE}; otherwise plug it in anew"
                ),
            }
        }
        _ => Unavailable::Failed {
            reason: format!("it could not be opened: {failure}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_is_a_number_or_nothing() {
        assert_eq!(id_of(""), Ok(None));
        assert_eq!(id_of("0"), Ok(Some(0)));
        assert_eq!(id_of("12"), Ok(Some(12)));
        for place in ["-1", "128", "x", "0 ", "1.5", "99999999999999999999"] {
            let error = id_of(place).unwrap_err().to_string();
            assert!(error.contains("dhd:0"), "{error}");
        }
    }
}

//! Haption's Virtuose arms, through the maker's `libvirtuose` (API 3 and 4).
//!
//! `virtuose` is the controller at [`DEFAULT_ADDRESS`], `virtuose:host#port` another one. The arm is driven in
//! impedance: pose out, wrench with torque in.

use std::ffi::CString;
use std::path::PathBuf;
use std::time::Duration;

use super::link::Connected;
use super::{Family, Listing, Opened, Unavailable};
use crate::driver::library::{self, Library, Shelf, Spec};

mod api;
mod arm;

use api::{Connection, Failure, Functions};

/// Where a controller is looked for when no place is given: the maker's service on this machine.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1#5000";

/// Versions of the API that are understood, the first number.
const MAJOR_VERSIONS: std::ops::RangeInclusive<i32> = 3..=4;

static SHELF: Shelf<Functions> = Shelf::new();

const SPEC: Spec = Spec {
    variable: "SNAPIN_LIBVIRTUOSE",
    names: if cfg!(windows) {
        &["VirtuoseAPI.dll", "virtuoseDLL.dll"]
    } else if cfg!(target_os = "macos") {
        &["libvirtuose.dylib"]
    } else {
        &[
            "libvirtuose.so",
            "libvirtuose.so.4",
            "libvirtuose.so.3",
            "libVirtuoseAPI.so",
        ]
    },
    folders: if cfg!(windows) {
        &["C:\\Program Files\\Haption\\VirtuoseAPI"]
    } else {
        &[
            "/usr/local/lib",
            "/usr/lib",
            "/opt/haption/lib",
            "/opt/Haption/VirtuoseAPI",
        ]
    },
    source: "it is part of the Virtuose API 3 or 4 that Haption delivers with the device",
};

/// The family of Haption's arms.
#[derive(Debug, Clone)]
pub struct Virtuose {
    /// The library's file; `None`: as the environment says, or where it usually lies.
    pub library: Option<PathBuf>,
    /// Longest time the library may take to open a device. Default 10 s.
    pub patience: Duration,
    /// Time after power on in which the motors start and no force is given. Default 3 s.
    pub motor_start: Duration,
}

/// The family with the library that is installed.
pub static INSTALLED: Virtuose = Virtuose::with_library(None);

impl Virtuose {
    /// The family through this file, or through the one that is installed.
    #[must_use]
    pub const fn with_library(library: Option<PathBuf>) -> Self {
        Self {
            library,
            patience: library::PATIENCE,
            motor_start: Duration::from_secs(3),
        }
    }

    /// The library in a version that is understood.
    fn load(&self) -> Result<(&'static Library<Functions>, String), Unavailable> {
        let library = SHELF.get(&SPEC, self.library.as_deref())?;
        let (major, minor) = api::api_version(library);
        let version = format!("{major}.{minor:02}");
        if !MAJOR_VERSIONS.contains(&major) {
            return Err(Unavailable::WrongVersion {
                what: library.file.clone(),
                found: version,
                mend: "versions 3 and 4 of the Virtuose API are understood".to_owned(),
            });
        }
        Ok((library, version))
    }

    fn connect(&self, address: &Address) -> Result<Connected, Unavailable> {
        let (library, version) = self.load()?;
        let lease = library.lease()?;
        let connection = Connection::open(library, &address.text)
            .map_err(|failure| address.refused(&failure))?;
        arm::start(connection, lease, &version, self.motor_start)
    }

    /// What answers at the default address.
    fn look(&self) -> Result<String, Unavailable> {
        let (library, version) = self.load()?;
        let _lease = library.lease()?;
        let address = Address::of("")?;
        let connection = Connection::open(library, &address.text)
            .map_err(|failure| address.refused(&failure))?;
        let model = arm::model(&connection);
        connection.close();
        Ok(format!("{}, Virtuose API {version}", model.name))
    }
}

impl Family for Virtuose {
    fn key(&self) -> &'static str {
        "virtuose"
    }

    fn title(&self) -> &'static str {
        "Haption Virtuose"
    }

    fn list(&self) -> Vec<Listing> {
        let this = self.clone();
        let status = library::within(library::LIST_LIMIT, move || this.look()).unwrap_or_else(|| {
            Err(Unavailable::NotThere {
                reason: format!(
                    "nothing has answered at {DEFAULT_ADDRESS} so far; another place is named virtuose:host#port"
                ),
            })
        });
        let name = match status {
            Ok(_) => format!("virtuose:{DEFAULT_ADDRESS}"),
            Err(_) => self.key().to_owned(),
        };
        vec![Listing { name, status }]
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let address = Address::of(place)?;
        let this = self.clone();
        library::open_within(self.patience, move || this.connect(&address))
    }
}

/// Where a controller is.
#[derive(Debug)]
struct Address {
    text: CString,
}

impl Address {
    /// `host`, `host#port` or, for the library's own kinds of connection, `kind://host:port`.
    fn of(place: &str) -> Result<Self, Unavailable> {
        let place = if place.is_empty() {
            DEFAULT_ADDRESS
        } else {
            place
        };
        let unknown = || Unavailable::UnknownName {
            given: format!("virtuose:{place}"),
            mend: format!(
                "a place is a host, with its port after a # where it is not the usual one: virtuose:{DEFAULT_ADDRESS}"
            ),
        };
        let is_text = place.len() <= 255 && place.chars().all(|c| c.is_ascii_graphic());
        let (host, port) = match place.split_once('#') {
            Some((host, port)) => (host, port.parse().unwrap_or(0)),
            None => (place, 1_u16),
        };
        if !is_text || host.is_empty() || port == 0 {
            return Err(unknown());
        }
        let text = CString::new(place).map_err(|_| unknown())?;
        Ok(Self { text })
    }

    /// Why a connection could not be opened, by the library's error.
    fn refused(&self, failure: &Failure) -> Unavailable {
        let address = self.text.to_string_lossy();
        match failure.code {
            16 | 20 => Unavailable::WrongVersion {
                what: format!("the controller at {address}"),
                found: format!("one that this library does not understand ({failure})"),
                mend: "take the library that was delivered with the device".to_owned(),
            },
            2 | 6 => Unavailable::NotThere {
                reason: format!(
                    "no controller answers at {address} ({failure}); it must be switched on and its service running, \
                     and no other program may hold it. After a program that ended without leaving, switch the \
                     controller off and on. Another place is named virtuose:host#port"
                ),
            },
            _ => Unavailable::Failed {
                reason: format!("the controller at {address} could not be opened: {failure}"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_is_a_host_with_or_without_a_port() {
        for (place, text) in [
            ("", "127.0.0.1#5000"),
            ("10.0.0.7#53210", "10.0.0.7#53210"),
            ("arm.local", "arm.local"),
            ("udpxdr://10.0.0.7:3131", "udpxdr://10.0.0.7:3131"),
        ] {
            let address = Address::of(place).unwrap();
            assert_eq!(address.text.to_str().unwrap(), text);
        }
    }

    #[test]
    fn place_that_is_none_is_refused_with_the_way_to_write_it() {
        let long = "x".repeat(300);
        for place in [
            "#5000",
            "host#",
            "host#0",
            "host#70000",
            "a b",
            "a\0b",
            &long,
        ] {
            let error = Address::of(place).unwrap_err().to_string();
            assert!(error.contains("virtuose:127.0.0.1#5000"), "{error}");
        }
    }
}

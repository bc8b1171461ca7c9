//! SpaceMouse: a puck with six axes, read over HID or through its daemon. It renders no force.
//!
//! Where the daemon's socket exists it is preferred: no permission for the device file is needed then, and the
//! user's own settings of the daemon hold.

use std::sync::{Arc, Mutex};

use super::link::{Connected, Threaded};
use super::rate::{self, Input, RateHandle, RateSource};
use super::{Family, Identity, Listing, Opened, Unavailable, spnav};
use crate::error::DeviceError;

mod hid;
mod report;

#[cfg(unix)]
pub(super) use report::{DEAD, FULL};

use hid::{Found, Hid};
use report::Puck;

/// SpaceMouse over HID.
pub(super) struct SpaceMouse;

/// What stands before the colon.
const KEY: &str = "spacemouse";

/// Light of the puck: report 4.
const LIGHT_ON: [u8; 2] = [4, 1];
const LIGHT_OFF: [u8; 2] = [4, 0];

impl Family for SpaceMouse {
    fn key(&self) -> &'static str {
        KEY
    }

    fn is_rate(&self) -> bool {
        true
    }

    fn title(&self) -> &'static str {
        "SpaceMouse (input only)"
    }

    fn list(&self) -> Vec<Listing> {
        listings(hid::find(), hid::check_access)
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        open_unless_daemon(place, &spnav::usual_socket())
    }
}

/// Opens the device at a place over HID; the first there is rather through the daemon, if that listens at a socket.
fn open_unless_daemon(place: &str, socket: &str) -> Result<Opened, Unavailable> {
    let (path, settings) = rate::split_place(KEY, place)?;
    if path.is_empty() && spnav::is_at(socket) {
        return spnav::open_at(socket, settings);
    }
    let path = path.to_owned();
    let handle = Arc::new(Mutex::new(RateHandle::new(settings)));
    Threaded::open(move || {
        let found = pick(hid::find()?, &path)?;
        let reports = Hid::open(&found)?;
        let notes = vec![settings.note()];
        Ok(connect(found.title(), notes, reports, &handle))
    })
}

/// One line for each device, or one that says why there is none.
fn listings(
    found: Result<Vec<Found>, Unavailable>,
    check: impl Fn(&Found) -> Result<(), Unavailable>,
) -> Vec<Listing> {
    let none = |why| {
        vec![Listing {
            name: KEY.to_owned(),
            status: Err(why),
        }]
    };
    match found {
        Err(why) => none(why),
        Ok(found) if found.is_empty() => none(nothing()),
        Ok(found) => found
            .iter()
            .map(|device| Listing {
                name: format!("{KEY}:{}", device.path),
                status: check(device).map(|()| device.title()),
            })
            .collect(),
    }
}

fn nothing() -> Unavailable {
    Unavailable::NotThere {
        reason: "no SpaceMouse is attached (looked among the HID devices)".to_owned(),
    }
}

/// The device at a place: its file, its numbers as `256f:c635`, or the first.
fn pick(found: Vec<Found>, place: &str) -> Result<Found, Unavailable> {
    let numbers = place.split_once(':').and_then(|(vendor, product)| {
        let number = |text| u16::from_str_radix(text, 16).ok();
        Some((number(vendor)?, number(product)?))
    });
    let names: Vec<String> = found.iter().map(|f| format!("{KEY}:{}", f.path)).collect();
    let chosen = found
        .into_iter()
        .find(|f| place.is_empty() || f.path == place || numbers == Some((f.vendor, f.product)));
    match chosen {
        Some(device) => Ok(device),
        None if names.is_empty() => Err(nothing()),
        None => Err(Unavailable::UnknownName {
            given: format!("{KEY}:{place}"),
            mend: format!("attached: {}", names.join(", ")),
        }),
    }
}

/// Bytes to and from a HID device.
trait Reports {
    /// Waits up to a time, ms, for a report; 0 bytes where none came.
    fn read(&mut self, bytes: &mut [u8], timeout_ms: i32) -> std::io::Result<usize>;

    /// Sends an output report, its number first.
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<()>;
}

fn connect<R: Reports + 'static>(
    name: String,
    notes: Vec<String>,
    mut reports: R,
    handle: &Arc<Mutex<RateHandle>>,
) -> Connected {
    let message = reports
        .write(&LIGHT_ON)
        .err()
        .map(|e| format!("its light could not be switched on: {e}"));
    let identity = Identity {
        name,
        limits: rate::limits(0.0),
        notes,
    };
    let source = PuckSource {
        reports,
        puck: Puck::default(),
        has_told: false,
        message,
    };
    rate::connected(identity, source, handle)
}

/// The puck behind a HID device.
struct PuckSource<R> {
    reports: R,
    puck: Puck,
    has_told: bool,
    message: Option<String>,
}

impl<R: Reports> PuckSource<R> {
    /// Reports taken at most in one go: a device that floods does not hold the link.
    const BURST: usize = 64;

    fn read_all(&mut self, now_s: f64) -> std::io::Result<()> {
        // The longest report known has 13 bytes, the longest of a full-speed device 64.
        let mut bytes = [0; 64];
        for turn in 0..Self::BURST {
            let length = self.reports.read(&mut bytes, i32::from(turn == 0))?;
            let Some(report) = bytes.get(..length).filter(|r| !r.is_empty()) else {
                break;
            };
            match report::decode(report) {
                Ok(report) => self.puck.take(report, now_s),
                Err(short) if !self.has_told => {
                    self.has_told = true;
                    let id = short.id.unwrap_or_default();
                    self.message = Some(format!(
                        "a report {id} of {} bytes is too short and was left out, as others like it will be",
                        short.length
                    ));
                }
                Err(_) => {}
            }
        }
        Ok(())
    }
}

impl<R: Reports> RateSource for PuckSource<R> {
    fn poll(&mut self, now_s: f64) -> Result<Input, DeviceError> {
        match self.read_all(now_s) {
            Err(e) if e.kind() != std::io::ErrorKind::Interrupted => Err(DeviceError::Gone {
                reason: format!("the device no longer answers: {e}"),
            }),
            _ => Ok(self.puck.input(now_s)),
        }
    }

    fn message(&mut self) -> Option<String> {
        self.message.take()
    }

    fn close(&mut self) {
        // It may be gone already.
        let _unplugged = self.reports.write(&LIGHT_OFF);
    }
}

#[cfg(test)]
mod tests;

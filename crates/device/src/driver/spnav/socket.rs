//! The daemon's socket and what comes over it.

use std::io::{self, Read};
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use glam::DVec3;

use crate::driver::link::Threaded;
use crate::driver::rate::{self, Input, RateHandle, RateSettings, RateSource};
use crate::driver::spacemouse::{DEAD, FULL};
use crate::driver::{Identity, Opened, Unavailable};
use crate::error::DeviceError;

/// Opens the daemon, again and again once it was there.
pub(super) fn open(socket: String, settings: RateSettings) -> Result<Opened, Unavailable> {
    let handle = Arc::new(Mutex::new(RateHandle::new(settings)));
    Threaded::open(move || {
        let stream = connect(&socket)?;
        let identity = Identity {
            name: format!("SpaceMouse through spacenavd ({socket})"),
            limits: rate::limits(0.0),
            notes: vec![
                settings.note(),
                "axes, signs and sensitivity are as the daemon's own settings make them".to_owned(),
            ],
        };
        Ok(rate::connected(identity, Daemon::new(stream), &handle))
    })
}

/// A connection to the daemon.
pub(super) fn connect(socket: &str) -> Result<UnixStream, Unavailable> {
    UnixStream::connect(socket)
        .and_then(|stream| stream.set_nonblocking(true).map(|()| stream))
        .map_err(|e| refusal(socket, &e))
}

fn refusal(socket: &str, error: &io::Error) -> Unavailable {
    let start =
        "start it with `sudo systemctl start spacenavd`, or name its socket: spnav:/path/to/socket";
    match error.kind() {
        io::ErrorKind::NotFound => Unavailable::NotThere {
            reason: format!("spacenavd does not run, there is no {socket}; {start}"),
        },
        io::ErrorKind::ConnectionRefused => Unavailable::NotThere {
            reason: format!("nobody listens at {socket}, spacenavd has ended; {start}"),
        },
        io::ErrorKind::PermissionDenied => Unavailable::PermissionDenied {
            path: socket.to_owned(),
            mend: "the daemon makes it open to all: `sudo systemctl restart spacenavd`".to_owned(),
        },
        _ => Unavailable::Failed {
            reason: format!("{socket} could not be opened: {error}"),
        },
    }
}

/// Length of an event, bytes.
const EVENT: usize = 32;

/// An event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event {
    Motion([i32; 6]),
    Button { number: i32, is_pressed: bool },
    Other,
}

/// Reads an event; nothing where these bytes are no event of the daemon, so where the next begins is lost as well.
pub(super) fn decode(bytes: &[u8; EVENT]) -> Option<Event> {
    let (words, _) = bytes.as_chunks::<4>();
    let word = |i: usize| words.get(i).map_or(0, |w| i32::from_ne_bytes(*w));
    Some(match word(0) {
        0 => Event::Motion([word(1), word(2), word(3), word(4), word(5), word(6)]),
        kind @ (1 | 2) => Event::Button {
            number: word(1),
            is_pressed: kind == 1,
        },
        // Devices, settings and raw values, which are sent on request alone.
        3..=15 => Event::Other,
        _ => return None,
    })
}

/// The daemon as a source of deflections.
pub(super) struct Daemon<R> {
    stream: R,
    /// What has come of an event that is not whole yet.
    part: [u8; EVENT],
    filled: usize,
    axes: [i32; 6],
    moved_s: f64,
    buttons: u32,
}

impl<R: Read> Daemon<R> {
    /// Silence after which a deflection counts as over, s. The daemon speaks when something changes, so a puck that
    /// is held quite still may be silent for longer than the device itself ever is.
    const SILENCE_S: f64 = 0.25;

    /// Events taken at most in one go.
    const BURST: usize = 64;

    pub(super) fn new(stream: R) -> Self {
        Self {
            stream,
            part: [0; EVENT],
            filled: 0,
            axes: [0; 6],
            moved_s: 0.0,
            buttons: 0,
        }
    }

    /// Takes what has come.
    pub(super) fn read_all(&mut self, now_s: f64) -> Result<(), DeviceError> {
        let gone = |reason: String| DeviceError::Gone { reason };
        for _ in 0..Self::BURST {
            let free = self.part.get_mut(self.filled..).unwrap_or_default();
            match self.stream.read(free) {
                Ok(0) => return Err(gone("spacenavd has closed the connection".to_owned())),
                Ok(length) => self.filled += length,
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(gone(format!("spacenavd does not answer: {e}"))),
            }
            if self.filled >= EVENT {
                self.filled = 0;
                let Some(event) = decode(&self.part) else {
                    return Err(gone(
                        "what comes from the socket is nothing that spacenavd says".to_owned(),
                    ));
                };
                self.take(event, now_s);
            }
        }
        Ok(())
    }

    fn take(&mut self, event: Event, now_s: f64) {
        match event {
            Event::Motion(axes) => {
                self.axes = axes;
                self.moved_s = now_s;
            }
            Event::Button { number, is_pressed } => {
                let bit = u32::try_from(number)
                    .ok()
                    .and_then(|n| 1_u32.checked_shl(n))
                    .unwrap_or(0);
                self.buttons = if is_pressed {
                    self.buttons | bit
                } else {
                    self.buttons & !bit
                };
            }
            Event::Other => {}
        }
    }

    /// What is so at a time, s.
    ///
    /// The daemon counts x to the right, y up and z away, and turns right-handed about each of these directions.
    pub(super) fn input(&self, now_s: f64) -> Input {
        let is_silent = now_s - self.moved_s > Self::SILENCE_S;
        let axes = if is_silent { [0; 6] } else { self.axes };
        let [x, y, z, rx, ry, rz] = axes.map(|count| rate::share(f64::from(count), FULL, DEAD));
        Input {
            linear: DVec3::new(x, z, y),
            angular: DVec3::new(rx, rz, ry),
            buttons: self.buttons,
        }
    }
}

impl<R: Read> RateSource for Daemon<R> {
    fn poll(&mut self, now_s: f64) -> Result<Input, DeviceError> {
        std::thread::sleep(Duration::from_millis(1));
        self.read_all(now_s)?;
        Ok(self.input(now_s))
    }

    fn close(&mut self) {}
}

#[cfg(test)]
mod tests;

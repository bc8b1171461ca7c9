//! SpaceMouse through its free daemon, spacenavd, over a UNIX socket. It renders no force.
//!
//! ```text
//! event: 8 x i32 in the machine's order      0 x y z rx ry rz period_ms      1 button      2 button
//!                                            motion                          pressed       released
//! ```

#[cfg(unix)]
mod socket;

use super::rate::{self, RateSettings};
use super::{Family, Listing, Opened, Unavailable};

/// SpaceMouse through spacenavd.
pub(super) struct Spnav;

/// What stands before the colon.
const KEY: &str = "spnav";

/// Where the daemon listens unless it was told otherwise.
const SOCKET: &str = "/var/run/spnav.sock";

impl Family for Spnav {
    fn key(&self) -> &'static str {
        KEY
    }

    fn is_rate(&self) -> bool {
        true
    }

    fn title(&self) -> &'static str {
        "SpaceMouse through spacenavd (input only)"
    }

    fn list(&self) -> Vec<Listing> {
        let socket = usual_socket();
        let (name, status) = match probe(&socket) {
            Ok(()) => {
                let what =
                    "spacenavd answers; whether a SpaceMouse is attached shows when it moves";
                (format!("{KEY}:{socket}"), Ok(what.to_owned()))
            }
            Err(why) => (KEY.to_owned(), Err(why)),
        };
        vec![Listing { name, status }]
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let (path, settings) = rate::split_place(KEY, place)?;
        let socket = match path {
            "" => usual_socket(),
            path => path.to_owned(),
        };
        open_at(&socket, settings)
    }
}

/// The daemon's socket: as the environment says, or where it is by default.
pub(super) fn usual_socket() -> String {
    chosen_socket(std::env::var("SPNAV_SOCKET").ok())
}

fn chosen_socket(from_environment: Option<String>) -> String {
    from_environment
        .filter(|path| !path.is_empty())
        .unwrap_or_else(|| SOCKET.to_owned())
}

/// Does the daemon listen at a socket?
pub(super) fn is_at(socket: &str) -> bool {
    probe(socket).is_ok()
}

#[cfg(unix)]
fn probe(socket: &str) -> Result<(), Unavailable> {
    socket::connect(socket).map(|_| ())
}

#[cfg(not(unix))]
fn probe(_socket: &str) -> Result<(), Unavailable> {
    Err(elsewhere())
}

/// Opens the daemon at a socket.
#[cfg(unix)]
pub(super) fn open_at(socket: &str, settings: RateSettings) -> Result<Opened, Unavailable> {
    socket::open(socket.to_owned(), settings)
}

#[cfg(not(unix))]
pub(super) fn open_at(_socket: &str, _settings: RateSettings) -> Result<Opened, Unavailable> {
    Err(elsewhere())
}

#[cfg(not(unix))]
fn elsewhere() -> Unavailable {
    Unavailable::NotThere {
        reason: "spacenavd does not exist for this system; use spacemouse".to_owned(),
    }
}

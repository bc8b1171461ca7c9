//! Devices behind a VRPN server: Phantom, Touch, Falcon and whatever else it serves.
//!
//! VRPN (Virtual-Reality Peripheral Network) is an old and simple protocol: a server sends poses and buttons and takes
//! forces, over TCP, or TCP and datagrams. Nothing of VRPN's library is needed.
//!
//! ```text
//! wire      greeting, frames, numbers            place, dial     a name, and the way to its server
//! message   what messages say                    client          poses in, force fields out
//! peer      names and numbers of one link        server          offers any device to VRPN's clients
//! ```
//!
//! A force is sent as a field F₀ + J (x − x₀), which the server evaluates in its own faster loop: what keeps contact
//! stable over a slow link (Mark et al. 1996).
//!
//! Stock servers have no watchdog: a client that hangs leaves its force behind. Here the field fades with the command
//! (see [`Threaded`]), is switched off on the reliable connection, and before leaving the server's report is waited
//! for. The [`Server`] has a watchdog of its own.
//!
//! The velocity is made from the poses: of the stock servers the Falcon's sends metres per microsecond and no turn, and
//! the Phantom's the difference of two samples. `?velocity=server` takes the server's all the same.

use std::time::Duration;

use self::place::Place;
use super::link::Threaded;
use super::{Family, Listing, Opened, Unavailable};

mod client;
mod dial;
mod endpoint;
mod field;
mod place;
mod velocity;

pub mod message;
pub mod peer;
pub mod server;
pub mod wire;

pub use server::{Server, ServerReport};

/// The family `vrpn`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Vrpn;

/// How long the machine's own server is waited for when devices are listed.
const LIST_CONNECT: Duration = Duration::from_millis(250);

impl Family for Vrpn {
    fn key(&self) -> &'static str {
        "vrpn"
    }

    fn title(&self) -> &'static str {
        "devices behind a VRPN server (Phantom, Touch, Falcon)"
    }

    fn list(&self) -> Vec<Listing> {
        match Place::parse("") {
            Ok(here) => list_at(&here),
            Err(error) => vec![none(error)],
        }
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let place = Place::parse(place)?;
        Threaded::open(move || client::connect(&place))
    }
}

/// What a server offers, or that there is none: servers cannot be discovered, only asked.
fn list_at(place: &Place) -> Vec<Listing> {
    let server = place.server();
    let offered = dial::dial_within(place, LIST_CONNECT)
        .map_err(|_| Unavailable::NotThere {
            reason: format!(
                "no VRPN server at {server}; another machine's is not found by itself: name its device as \
                 vrpn:NAME@HOST[:PORT]"
            ),
        })
        .and_then(|stream| client::offers(place, stream));
    match offered {
        Ok((version, names)) if names.is_empty() => vec![Listing {
            name: "vrpn".to_owned(),
            status: Ok(format!(
                "VRPN {version} server at {server}, without devices"
            )),
        }],
        Ok((version, names)) => names
            .into_iter()
            .map(|name| Listing {
                name: format!("vrpn:{name}@{server}"),
                status: Ok(format!("VRPN {version} server")),
            })
            .collect(),
        Err(error) => vec![none(error)],
    }
}

fn none(error: Unavailable) -> Listing {
    Listing {
        name: "vrpn".to_owned(),
        status: Err(error),
    }
}

#[cfg(test)]
mod tests;

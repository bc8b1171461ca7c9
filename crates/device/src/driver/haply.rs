//! Haply devices (Inverse3, Inverse3x, Minverse) with a VerseGrip, through the maker's Inverse Service.
//!
//! The service speaks JSON over a WebSocket on this machine. It answers each frame with exactly one state of all
//! devices and sends nothing of itself, so the pace is ours; one frame is in flight. Safety events come on a second
//! socket.
//!
//! ```text
//! loop ── command ──> Threaded ──> HaplyLink ── force frame ──> service :10001 ──> device
//!                                     │     <── state frame ──
//!                                     └──────── events ──────── service :10020
//! ```
//! `conversation` holds what is known of the device, without a socket or a clock; `exchange` holds the socket.
//!
//! Frame: that of the service, x right, y forward, z up, right-handed, metres; poses pass as they are. The handle
//! point is the cursor. Forces alone are rendered; the orientation is sensed by a grip, some tens of times a second,
//! and smoothed.
//!
//! The service holds the last force until the next frame. A zero is sent when the link is closed, when an answer is
//! late, and as long as the device is not ready or tells nothing of itself.

use super::{Family, Listing, Opened, Threaded, Unavailable};

mod connect;
mod conversation;
mod events;
mod exchange;
mod felt;
mod frame;
mod messages;
mod orientation;
mod place;
mod socket;

use place::Place;

/// What stands before the colon of a name.
const KEY: &str = "haply";

/// The family of the Haply devices.
#[derive(Debug, Clone, Copy, Default)]
pub struct Haply;

impl Family for Haply {
    fn key(&self) -> &'static str {
        KEY
    }

    fn title(&self) -> &'static str {
        "Haply Inverse3 and Minverse, through the Haply Inverse Service"
    }

    fn list(&self) -> Vec<Listing> {
        connect::list(&Place::default())
    }

    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        let mut place = Place::parse(place)?;
        Threaded::open(move || connect::connect(&mut place))
    }
}

#[cfg(test)]
mod tests;

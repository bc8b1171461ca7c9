//! VRPN: recorded sessions, streams that are none, and our client against servers.
#![allow(
    clippy::unwrap_used,
    missing_docs,
    reason = "a test may stop at the first surprise"
)]

mod bench;
mod loopback;
mod mutated;
mod recorded;
mod recording;
mod refused;
mod replayed;

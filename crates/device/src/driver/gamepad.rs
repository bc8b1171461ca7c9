//! Gamepads: sticks and triggers as rates, and the force as the strength of the rumble. Linux only (evdev).
//!
//! ```text
//! left stick      right, away            right stick     turn about z (right: clockwise from above), tilt about x
//! triggers        right up, left down    cross           left and right: tilt about y
//! ```
//! Rumble has no direction: it tells how large the force is, not where it points.

#![cfg_attr(
    not(target_os = "linux"),
    allow(
        dead_code,
        reason = "without device files nothing asks for it, but it is compiled and tested"
    )
)]

#[cfg(target_os = "linux")]
mod node;
mod pad;
mod rumble;

use std::io::ErrorKind;
use std::time::Duration;

use glam::{BVec3, DVec3};

use super::rate::{Input, RateSource};
use super::{Family, Listing, Opened, Unavailable};
use crate::error::DeviceError;

use pad::{Shape, Snapshot};
use rumble::{Order, Rumble};

/// Gamepads of the kernel's input system.
pub(super) struct Gamepad;

/// What stands before the colon.
const KEY: &str = "gamepad";

impl Family for Gamepad {
    fn key(&self) -> &'static str {
        KEY
    }

    fn is_rate(&self) -> bool {
        true
    }

    fn title(&self) -> &'static str {
        "gamepad (input, force as rumble)"
    }

    #[cfg(target_os = "linux")]
    fn list(&self) -> Vec<Listing> {
        node::list()
    }

    #[cfg(not(target_os = "linux"))]
    fn list(&self) -> Vec<Listing> {
        vec![Listing {
            name: KEY.to_owned(),
            status: Err(elsewhere()),
        }]
    }

    #[cfg(target_os = "linux")]
    fn open(&self, place: &str) -> Result<Opened, Unavailable> {
        node::open(place)
    }

    #[cfg(not(target_os = "linux"))]
    fn open(&self, _place: &str) -> Result<Opened, Unavailable> {
        Err(elsewhere())
    }
}

#[cfg(not(target_os = "linux"))]
fn elsewhere() -> Unavailable {
    Unavailable::NotThere {
        reason: "gamepads are read on Linux alone; on other systems use spacemouse".to_owned(),
    }
}

/// What the link needs of a pad.
trait Port {
    /// The values of its axes and keys now.
    fn snapshot(&mut self) -> std::io::Result<Snapshot>;

    /// Rumbles at a strength (65535: all it can) for a time, ms, or until the next call.
    fn play(&mut self, strength: u16, length_ms: u16) -> std::io::Result<()>;

    /// Ends the rumble.
    fn stop(&mut self) -> std::io::Result<()>;
}

/// A pad as a source of deflections.
struct PadSource<P> {
    port: P,
    shape: Shape,
    /// None where the pad has no rumble, or where it failed.
    rumble: Option<Rumble>,
    rest: Rest,
    last: Input,
    message: Option<String>,
}

/// Which axes were seen at rest. One that was not yet moves nothing: until its first event the kernel gives 0 for
/// every axis, which for some triggers is half pressed.
#[derive(Debug, Clone, Copy, Default)]
struct Rest {
    linear: BVec3,
    angular: BVec3,
}

impl Rest {
    fn hold_back(&mut self, input: &Input) -> Input {
        self.linear |= input.linear.cmpeq(DVec3::ZERO);
        self.angular |= input.angular.cmpeq(DVec3::ZERO);
        Input {
            linear: DVec3::select(self.linear, input.linear, DVec3::ZERO),
            angular: DVec3::select(self.angular, input.angular, DVec3::ZERO),
            ..*input
        }
    }
}

impl<P: Port> PadSource<P> {
    fn new(port: P, shape: Shape, can_rumble: bool) -> Self {
        Self {
            port,
            shape,
            rumble: can_rumble.then(Rumble::default),
            rest: Rest::default(),
            last: Input::default(),
            message: None,
        }
    }
}

impl<P: Port> RateSource for PadSource<P> {
    fn poll(&mut self, _now_s: f64) -> Result<Input, DeviceError> {
        // Pads report every 4 to 8 ms; at half of that nothing is missed.
        std::thread::sleep(Duration::from_millis(2));
        match self.port.snapshot() {
            Ok(now) => self.last = self.rest.hold_back(&self.shape.input(&now)),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => {
                let reason = format!("the gamepad no longer answers: {e}");
                return Err(DeviceError::Gone { reason });
            }
        }
        Ok(self.last)
    }

    fn render(&mut self, force: f64, now_s: f64) {
        let Some(order) = self.rumble.as_mut().and_then(|r| r.next(force, now_s)) else {
            return;
        };
        let done = match order {
            Order::Play(strength) => self.port.play(strength, Rumble::LENGTH_MS),
            Order::Stop => self.port.stop(),
        };
        match done {
            Err(e) if e.kind() != ErrorKind::Interrupted => {
                self.rumble = None;
                self.message = Some(format!("its rumble failed and is off from now on: {e}"));
            }
            _ => {}
        }
    }

    fn message(&mut self) -> Option<String> {
        self.message.take()
    }

    fn close(&mut self) {
        if self.rumble.is_some() {
            // It may be gone already, and the last effect dies by itself.
            let _unplugged = self.port.stop();
        }
    }
}

#[cfg(test)]
mod tests;

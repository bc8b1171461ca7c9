//! A small VRPN server: offers any device to VRPN's clients, over TCP and datagrams.

use std::net::{SocketAddr, TcpListener, ToSocketAddrs, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::clock::RealTime;
use crate::driver::Unavailable;
use crate::error::DeviceError;
use crate::haptic_device::HapticDevice;
use crate::safety::{Safety, SafetyEvents, SafetySettings};
use round::Round;

mod callers;
mod guest;
mod hold;
mod round;

/// Tries to find a port that is free for TCP and datagrams, where any will do.
const PORT_TRIES: usize = 16;

/// Longest name of a sender, bytes.
const NAME_MAX: usize = 99;

/// What came of a server's run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ServerReport {
    /// Periods done.
    pub periods: u64,
    /// Scheduled times that went by unused.
    pub skipped: u64,
    /// Clients that greeted as VRPN does.
    pub guests: u64,
    /// Clients that were turned away: too many, or no greeting.
    pub refused: u64,
    /// Links that were ended because of what came over them.
    pub faults: u64,
    /// Force fields that were taken.
    pub fields: u64,
    /// Force fields that were not: another client holds the device, or no number.
    pub fields_refused: u64,
    /// Times that a force was dropped because its client fell silent.
    pub silences: u64,
    /// Times that a force was dropped because its client left.
    pub departures: u64,
    /// Reads of the device that failed.
    pub read_failures: u64,
    /// Writes to the device that failed.
    pub write_failures: u64,
    /// How often the guard before the device stepped in.
    pub safety: SafetyEvents,
}

/// A server that has its port.
///
/// It evaluates each client's force field at its own rate; the force goes through [`Safety`] with the limits of the
/// device and falls to zero when the client says so, leaves, or sends no field for 0.1 s. The device obeys the client
/// that sent the first field until that one lets go; the others are told that it is held, and see the poses.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    requests: UdpSocket,
    address: SocketAddr,
    name: String,
}

impl Server {
    /// A server at an address, usually port [`PORT`](super::wire::PORT); port 0 is any free one. `sender_name` is
    /// what stands before the `@` of the device's name.
    ///
    /// # Errors
    /// Where the name is none, or the address cannot be had.
    pub fn bind(address: impl ToSocketAddrs, sender_name: &str) -> Result<Self, Unavailable> {
        let is_name = !sender_name.is_empty()
            && sender_name.len() <= NAME_MAX
            && !sender_name.contains(|c: char| c == '@' || c.is_control());
        if !is_name {
            return Err(Unavailable::UnknownName {
                given: sender_name.to_owned(),
                mend: format!(
                    "the name of a VRPN sender has 1 to {NAME_MAX} bytes, no @ and no control characters"
                ),
            });
        }
        let mut last = None;
        for _ in 0..PORT_TRIES {
            match bind_both(&address) {
                Ok((listener, requests, address)) => {
                    return Ok(Self {
                        listener,
                        requests,
                        address,
                        name: sender_name.to_owned(),
                    });
                }
                Err(e) => last = Some(e),
            }
        }
        Err(cannot_listen(last))
    }

    /// Address that it listens at.
    #[must_use]
    pub fn local_addr(&self) -> SocketAddr {
        self.address
    }

    /// Serves a device once a period (s) until `stop` is set, then lets the force go to zero.
    ///
    /// # Errors
    /// Where the period or a limit of the device is outside its range. Failures of the device are counted, told to
    /// the clients, and end nothing.
    pub fn run(
        &mut self,
        device: &mut dyn HapticDevice,
        period_s: f64,
        stop: &AtomicBool,
    ) -> Result<ServerReport, DeviceError> {
        let mut clock = RealTime::new(period_s)?;
        let limits = *device.limits();
        let safety = Safety::new(SafetySettings::for_limits(&limits))?;
        let mut round = Round::new(self, &limits, safety, period_s);
        let device = StopOnDrop(device);
        while !stop.load(Ordering::Relaxed) {
            round.period(device.0, &mut clock);
        }
        round.release(device.0, &mut clock);
        Ok(round.finish())
    }
}

fn bind_both(
    address: &impl ToSocketAddrs,
) -> std::io::Result<(TcpListener, UdpSocket, SocketAddr)> {
    let listener = TcpListener::bind(address)?;
    let address = listener.local_addr()?;
    let requests = UdpSocket::bind(address)?;
    listener.set_nonblocking(true)?;
    requests.set_nonblocking(true)?;
    Ok((listener, requests, address))
}

fn cannot_listen(error: Option<std::io::Error>) -> Unavailable {
    use std::io::ErrorKind;
    let why = error.as_ref().map_or_else(String::new, ToString::to_string);
    let reason = format!("cannot listen for VRPN clients: {why}");
    match error.map(|e| e.kind()) {
        Some(ErrorKind::AddrInUse) => Unavailable::Busy {
            reason: format!("{reason}; another server has the port, end it or take another port"),
        },
        Some(ErrorKind::PermissionDenied) => Unavailable::PermissionDenied {
            path: "the port of the VRPN server".to_owned(),
            mend: "take one from 1024 upward, usually 3883".to_owned(),
        },
        _ => Unavailable::Failed { reason },
    }
}

/// Stops the device however the loop is left.
struct StopOnDrop<'a>(&'a mut dyn HapticDevice);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.stop();
    }
}

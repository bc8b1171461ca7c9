//! What a server offers, and why a device of it cannot be opened.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::LEAVE_CLOSE_S;
use super::heard::Heard;
use crate::driver::Unavailable;
use crate::driver::vrpn::endpoint::{Broken, Endpoint};
use crate::driver::vrpn::peer::Event;
use crate::driver::vrpn::place::{Place, Way};
use crate::driver::vrpn::wire::ProtocolError;

/// Longest wait for the descriptions when devices are listed, s.
const LIST_S: f64 = 0.4;

/// Version of the server at the other end, and the names of its devices.
pub(in crate::driver::vrpn) fn offers(
    place: &Place,
    tcp: TcpStream,
) -> Result<(String, Vec<String>), Unavailable> {
    let begun = Instant::now();
    let mut heard = Heard::new(place);
    let ask = || -> Result<Option<String>, Broken> {
        let mut endpoint = Endpoint::new(tcp, false)?;
        let mut has_all = false;
        while !has_all && begun.elapsed().as_secs_f64() < LIST_S {
            endpoint.flush()?;
            endpoint.receive(Duration::from_millis(20), |event| {
                // All senders are described before the first type.
                has_all |= matches!(event, Event::Kind { .. });
                heard.note(event, Instant::now());
            })?;
        }
        let version = endpoint.version().map(str::to_owned);
        endpoint.leave(Duration::from_secs_f64(LEAVE_CLOSE_S));
        Ok(version)
    };
    match ask() {
        Ok(Some(version)) => Ok((version, heard.offered().to_vec())),
        Ok(None) => Err(says_nothing(place)),
        Err(broken) => Err(explain(place, &broken, false)),
    }
}

/// What a broken link means to who wanted to open it.
pub(super) fn explain(place: &Place, broken: &Broken, has_greeted: bool) -> Unavailable {
    let server = place.server();
    match broken {
        Broken::Protocol(ProtocolError::Cookie { found }) => Unavailable::WrongVersion {
            what: format!("the VRPN server at {server}"),
            found: format!("\"{found}\""),
            mend: "07.xx is understood, and its greeting is \"vrpn: ver. 07.xx  0\"".to_owned(),
        },
        broken if has_greeted => Unavailable::Failed {
            reason: format!("the VRPN server at {server} is lost: {broken}"),
        },
        broken => Unavailable::NotThere {
            reason: format!(
                "what answers at {server} does not greet as a VRPN server does ({broken}); \
                 check host and port"
            ),
        },
    }
}

fn says_nothing(place: &Place) -> Unavailable {
    Unavailable::NotThere {
        reason: format!(
            "what answers at {} says nothing; check that it is a VRPN server",
            place.server()
        ),
    }
}

/// Why no pose has come.
pub(super) fn why_silent(place: &Place, version: Option<&str>, heard: &Heard) -> Unavailable {
    let server = place.server();
    if version.is_none() {
        return says_nothing(place);
    }
    let offered = match heard.offered() {
        [] => "none".to_owned(),
        names => names.join(", "),
    };
    let Some(name) = heard.offered_name() else {
        let wanted = place.sender.as_deref().unwrap_or("that sends poses");
        return Unavailable::NotThere {
            reason: format!(
                "the VRPN server at {server} has no device {wanted}; its devices: {offered}"
            ),
        };
    };
    let hint = match place.way {
        Way::Tcp => "",
        Way::Udp => ", and no firewall may stop its datagrams: vrpn:tcp:// does without them",
    };
    Unavailable::NotReady {
        reason: format!(
            "{name} at {server} sends no poses of sensor {}; it must be switched on and calibrated{hint}",
            place.sensor
        ),
    }
}

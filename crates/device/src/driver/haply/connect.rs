//! Finding the service and opening a device of it.

use std::time::{Duration, Instant};

use glam::DVec3;

use super::conversation::{Conversation, waits_for};
use super::exchange::HaplyLink;
use super::frame::{Config, Form, Frame, Inverse, configure_frame, session_frame};
use super::place::Place;
use super::socket::{NotOpened, Socket};
use crate::driver::link::{Connected, Identity};
use crate::driver::{Listing, Unavailable};
use crate::haptic_device::{Limits, Readiness};

/// Longest wait for a connection, a greeting and an answer when a device is opened.
const OPEN: Duration = Duration::from_secs(1);

/// The same when devices are listed: three of them must stay below a second.
const LIST: Duration = Duration::from_millis(300);

/// Longest wait for the events channel, which is not needed.
const EVENTS: Duration = Duration::from_millis(300);

/// Where the service comes from.
const MEND: &str = "install the Haply Hub or start the Haply Inverse Service (on Linux: sudo systemctl start \
                    haply-inverse-service), or name its place: haply:ID@host:port";

/// The devices of the service, one line each; at least one.
pub(super) fn list(place: &Place) -> Vec<Listing> {
    let none = |error| Listing {
        name: super::KEY.to_owned(),
        status: Err(error),
    };
    let mut socket = match open_socket(place, LIST) {
        Ok(socket) => socket,
        Err(error) => return vec![none(error)],
    };
    let inventory = receive_inventory(place, &mut socket, LIST);
    socket.close();
    match inventory {
        Err(error) => vec![none(error)],
        Ok(frame) if frame.devices.is_empty() => vec![none(no_device(place))],
        Ok(frame) => frame
            .devices
            .iter()
            .map(|device| Listing {
                name: place.name_of(&device.id),
                status: Ok(describe(device)),
            })
            .collect(),
    }
}

/// Opens the device of the place. A place without an identifier is given that of the device that was opened, so
/// that the same one is opened again after a loss.
pub(super) fn connect(place: &mut Place) -> Result<Connected, Unavailable> {
    let mut socket = open_socket(place, OPEN)?;
    let inventory = receive_inventory(place, &mut socket, OPEN)?;
    let device = choose(place, &inventory)?;
    place.id = Some(device.id.clone());
    let config = device.config.clone().unwrap_or_default();
    let limits = limits_of(&config.kind);
    let form = if config.is_from_3_5 {
        Form::Vector
    } else {
        Form::Values
    };
    ask(place, &mut socket, session_frame())?;
    let configured = ask(place, &mut socket, configure_frame(&device.id, form))?;
    let events = Socket::open(&place.host, place.events_port, EVENTS);

    let mut notes = vec![service_note(place, form)];
    notes.extend(filter_notes(&config, configured.device(&device.id)));
    notes.extend(frame_notes(&config, device, configured.device(&device.id)));
    notes.extend(device_notes(device, &inventory));
    if let Err(error) = &events {
        notes.push(no_events_note(place, error));
    }
    let identity = Identity {
        name: format!("Haply {} {}", title(&config.kind), device.id),
        limits,
        notes,
    };
    let conversation = Conversation::new(&device.id, limits.peak_force, form);
    let link = HaplyLink::new(socket, events.ok(), conversation);
    Ok((identity, Box::new(link)))
}

/// What the hardware can do.
///
/// 10 N and a stiffness and damping of 1000 N/m and 6 N s/m: a public client of the device for CHAI3D. A lower
/// limit for long times is not stated; the service scales torques down itself. Half the workspace, 0.10 m, and
/// 0.04 m of a Minverse: the radii to which the maker's own examples keep the cursor. Resolution of 0.01 mm: data
/// sheet, not checked. Own damping and friction are not stated.
fn limits_of(kind: &str) -> Limits {
    let reach = if kind == "minverse" { 0.04 } else { 0.10 };
    Limits {
        workspace_half_extents: DVec3::splat(reach),
        continuous_force: 10.0,
        peak_force: 10.0,
        peak_torque: 0.0,
        position_resolution: 1e-5,
        force_resolution: 0.0,
        rotation_resolution: 0.0,
        max_stiffness: Some(1000.0),
        max_rotational_stiffness: None,
        max_damping: Some(6.0),
        damping: None,
        coulomb_friction: None,
    }
}

fn title(kind: &str) -> &str {
    match kind {
        "inverse3" | "" => "Inverse3",
        "inverse3x" => "Inverse3x",
        "minverse" => "Minverse",
        other => other,
    }
}

fn open_socket(place: &Place, limit: Duration) -> Result<Socket, Unavailable> {
    Socket::open(&place.host, place.port, limit).map_err(|error| match error {
        NotOpened::Nobody(why) => Unavailable::NotThere {
            reason: format!("nobody answers at {} ({why}); {MEND}", place.url()),
        },
        NotOpened::NoWebSocket(why) => Unavailable::Failed {
            reason: format!(
                "what listens at {} is not the Haply Inverse Service ({why}); {MEND}",
                place.url()
            ),
        },
    })
}

fn receive_text(
    place: &Place,
    socket: &mut Socket,
    limit: Duration,
) -> Result<String, Unavailable> {
    let failed = |why: &str| Unavailable::Failed {
        reason: format!(
            "the service at {} {why}; start it anew (on Linux: sudo systemctl restart haply-inverse-service)",
            place.url()
        ),
    };
    socket
        .read_until(Instant::now() + limit)
        .map_err(|why| failed(&format!("ended the conversation ({why})")))?
        .ok_or_else(|| failed("says nothing"))
}

/// What the service says of itself when it is connected to.
fn receive_inventory(
    place: &Place,
    socket: &mut Socket,
    limit: Duration,
) -> Result<Frame, Unavailable> {
    let text = receive_text(place, socket, limit)?;
    Frame::decode(&text).map_err(|why| Unavailable::WrongVersion {
        what: format!("the service at {}", place.url()),
        found: format!("one that is not known: its frame {}", why.0),
        mend: "versions 3.1 to 3.5 of the Haply Inverse Service are understood, on the port of their format \
               3.1 (10001 by default)"
            .to_owned(),
    })
}

/// Sends a frame and takes its answer. One that cannot be read confirms nothing; the conversation judges the next.
fn ask(place: &Place, socket: &mut Socket, text: String) -> Result<Frame, Unavailable> {
    socket.send(text).map_err(|why| Unavailable::Failed {
        reason: format!("the service at {} hears nothing: {why}", place.url()),
    })?;
    let answer = receive_text(place, socket, OPEN)?;
    Ok(Frame::decode(&answer).unwrap_or_default())
}

fn no_device(place: &Place) -> Unavailable {
    Unavailable::NotThere {
        reason: format!(
            "the service at {} lists no Inverse3; plug one in, with its power supply",
            place.url()
        ),
    }
}

fn choose<'a>(place: &Place, inventory: &'a Frame) -> Result<&'a Inverse, Unavailable> {
    let devices = &inventory.devices;
    let first = devices.first().ok_or_else(|| no_device(place))?;
    let Some(id) = &place.id else {
        return Ok(first);
    };
    devices
        .iter()
        .find(|device| device.id.eq_ignore_ascii_case(id))
        .ok_or_else(|| Unavailable::NotThere {
            reason: format!(
                "the service at {} has no device {id}; it lists {}",
                place.url(),
                ids(devices.iter().map(|device| &device.id))
            ),
        })
}

fn ids<'a>(ids: impl Iterator<Item = &'a String>) -> String {
    ids.map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// Model, version and state, for the list of devices.
fn describe(device: &Inverse) -> String {
    let config = device.config.clone().unwrap_or_default();
    let version = config
        .version
        .map(|version| format!(", version {version}"))
        .unwrap_or_default();
    let state = match waits_for(device.status) {
        Readiness::Ready => "ready",
        Readiness::Waiting(why) | Readiness::Tripped(why) => why,
    };
    format!("{}{version}, {state}", title(&config.kind))
}

fn service_note(place: &Place, form: Form) -> String {
    let age = match form {
        Form::Vector => "3.5 or later",
        Form::Values => "before 3.5",
    };
    format!("Haply Inverse Service {age} at {}", place.url())
}

/// What of the service's filters was changed, and whether it says so itself.
fn filter_notes(before: &Config, after: Option<&Inverse>) -> Vec<String> {
    let gate = before.gate.map(|gain| gain.to_string());
    let damping = before.damping.map(|damping| {
        let (s, v) = (damping.scalar, damping.vector);
        if v == DVec3::ZERO {
            s.to_string()
        } else {
            format!("{s} and ({}, {}, {})", v.x, v.y, v.z)
        }
    });
    let after = after.and_then(|device| device.config.as_ref());
    let gate_now = after.and_then(|config| config.gate);
    let damping_now = after.and_then(|config| config.damping);
    let unknown = || "not stated".to_owned();
    vec![
        format!(
            "force_gate, by which the service weakens a force that it takes for an oscillation: was {}, set to 1 \
             (no weakening) for this session{}",
            gate.unwrap_or_else(unknown),
            outcome(gate_now.map(|gain| gain == 1.0))
        ),
        format!(
            "damping that the service adds: was {}, set to 0 N s/m for this session{}",
            damping.unwrap_or_else(unknown),
            outcome(damping_now.map(super::frame::Damping::is_zero))
        ),
    ]
}

fn outcome(is_taken: Option<bool>) -> &'static str {
    match is_taken {
        Some(true) => "",
        Some(false) => "; the service did not take it: forces will differ from those computed",
        None => "; the service does not confirm it",
    }
}

/// Where the service's frame is not the plain one.
fn frame_notes(before: &Config, inventory: &Inverse, after: Option<&Inverse>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(basis) = before.basis.as_deref().filter(|basis| *basis != "XYZ") {
        notes.push(format!(
            "the axes of the service were {basis}; set to XYZ for this session"
        ));
    }
    if let Some(preset) = &before.preset {
        notes.push(format!("origin of the positions: preset {preset}"));
    }
    let moves = |device: &Inverse| {
        device.is_moved || device.config.as_ref().is_some_and(|config| config.is_moved)
    };
    if moves(inventory) || after.is_some_and(moves) {
        notes.push(
            "a mount or workspace transform of the service moves, turns or scales positions: lengths and \
             directions may differ from the hand's; reset it in the Haply Hub"
                .to_owned(),
        );
    }
    notes
}

/// What is there besides, and what it waits for.
fn device_notes(device: &Inverse, inventory: &Frame) -> Vec<String> {
    let mut notes = Vec::new();
    if inventory.devices.len() > 1 {
        notes.push(format!(
            "several devices: {}; opened {}",
            ids(inventory.devices.iter().map(|device| &device.id)),
            device.id
        ));
    }
    match inventory.grips.as_slice() {
        [] => notes.push(
            "no VerseGrip is there: the handle's orientation is not sensed, that of the device's body stands for it"
                .to_owned(),
        ),
        [_] => {}
        several => notes.push(format!(
            "several grips: {}; the first that is awake is used",
            ids(several.iter().map(|grip| &grip.id))
        )),
    }
    if let Readiness::Waiting(why) | Readiness::Tripped(why) = waits_for(device.status) {
        notes.push(format!("no force yet: {why}"));
    }
    notes
}

fn no_events_note(place: &Place, error: &NotOpened) -> String {
    let (NotOpened::Nobody(why) | NotOpened::NoWebSocket(why)) = error;
    format!(
        "the events of the service are not heard at {} ({why}): its emergency brake and its stalls are not told",
        place.events_url()
    )
}

//! Recorded streams decode to what another decoder made of them, in whatever pieces, and encode to the same bytes.

use device::driver::vrpn::message::{
    ForceField, Kind, Message, Motion, Placement, Plane, SensorPose, Text, Workspace,
};
use device::driver::vrpn::peer::{Event, Peer};
use device::driver::vrpn::wire::{
    Decoder, Frame, HEAD_LEN, ProtocolError, Timestamp, read_datagram,
};
use serde_json::Value;

use crate::recording::{DIRECTIONS, Recording, SESSIONS, from_hex};

/// What was understood of a frame, owned.
#[derive(Debug, Clone, PartialEq)]
enum Seen {
    Sender(i32, String),
    Kind(i32, String),
    Udp(u16, String),
    Message(Timestamp, String, Message),
    Unknown,
}

fn own(event: Event<'_>) -> Seen {
    match event {
        Event::Sender { id, name } => Seen::Sender(id, name.to_owned()),
        Event::Kind { id, name } => Seen::Kind(id, name.to_owned()),
        Event::Udp { port, host } => Seen::Udp(port, host.to_owned()),
        Event::Message {
            time,
            sender,
            message,
        } => Seen::Message(time, sender.to_owned(), message),
        Event::Unknown => Seen::Unknown,
    }
}

fn decode<'a>(pieces: impl Iterator<Item = &'a [u8]>) -> (Peer, Vec<Seen>) {
    let mut decoder = Decoder::new();
    let mut peer = Peer::default();
    let mut seen = Vec::new();
    for piece in pieces {
        let result: Result<(), ProtocolError> = decoder.push(piece, |frame| {
            seen.push(own(peer.read(&frame)?));
            Ok(())
        });
        result.unwrap();
    }
    assert_eq!(decoder.version(), Some("07.38"));
    (peer, seen)
}

fn f64s<const N: usize>(value: &Value) -> [f64; N] {
    let numbers: Vec<f64> = value.as_array().unwrap().iter().map(number).collect();
    numbers.try_into().unwrap()
}

fn f32s<const N: usize>(value: &Value) -> [f32; N] {
    f64s::<N>(value).map(|x| x as f32)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn single(value: &Value) -> f32 {
    number(value) as f32
}

fn integer(value: &Value) -> i32 {
    value.as_i64().unwrap().try_into().unwrap()
}

fn placement(payload: &Value) -> Placement {
    Placement {
        position: f64s(&payload["pos"]),
        rotation: f64s(&payload["quat"]),
    }
}

fn motion(payload: &Value, of: &str) -> Motion {
    Motion {
        sensor: integer(&payload["sensor"]),
        linear: f64s(&payload[of]),
        rotation: f64s(&payload[format!("{of}_quat")]),
        interval_s: number(&payload[format!("{of}_quat_dt")]),
    }
}

/// The message that the other decoder found.
fn expected_message(kind: &str, payload: &Value) -> Message {
    let list = |name: &str| payload[name].as_array().unwrap().iter();
    match Kind::from_name(kind).unwrap() {
        Kind::Ping => Message::Ping,
        Kind::Pong => Message::Pong,
        Kind::RequestWorkspace => Message::RequestWorkspace,
        Kind::ResetOrigin => Message::ResetOrigin,
        Kind::SetUpdateRate => Message::SetUpdateRate(number(&payload["hz"])),
        Kind::Text => Message::Text(Text {
            severity: integer(&payload["severity"]) as u32,
            level: integer(&payload["level"]) as u32,
            text: payload["message"].as_str().unwrap().to_owned(),
        }),
        Kind::PosQuat => Message::PosQuat(SensorPose {
            sensor: integer(&payload["sensor"]),
            at: placement(payload),
        }),
        Kind::Velocity => Message::Velocity(motion(payload, "vel")),
        Kind::Acceleration => Message::Acceleration(motion(payload, "acc")),
        Kind::Workspace => Message::Workspace(Workspace {
            min: f64s(&payload["min"]),
            max: f64s(&payload["max"]),
        }),
        Kind::ButtonChange => Message::ButtonChange {
            button: integer(&payload["button"]),
            state: integer(&payload["state"]),
        },
        Kind::ButtonStates => Message::ButtonStates(list("states").map(integer).collect()),
        Kind::Analog => Message::Analog(list("channels").map(number).collect()),
        Kind::Dial => {
            // The other decoder left it as bytes: a double and an integer.
            let bytes = from_hex(payload["bytes"].as_str().unwrap());
            assert_eq!(bytes.len(), 12);
            Message::Dial {
                delta: f64::from_be_bytes(bytes[..8].try_into().unwrap()),
                dial: i32::from_be_bytes(bytes[8..].try_into().unwrap()),
            }
        }
        Kind::Force => Message::Force(f64s(&payload["force"])),
        Kind::SurfaceContact => Message::SurfaceContact(placement(payload)),
        Kind::ForceError => Message::ForceError(integer(&payload["code"])),
        Kind::ForceField => Message::ForceField(ForceField {
            origin: f32s(&payload["origin"]),
            force: f32s(&payload["force"]),
            jacobian: [0, 1, 2].map(|row| f32s(&payload["jacobian"][row])),
            radius: single(&payload["radius"]),
        }),
        Kind::Plane => Message::Plane(Plane {
            coefficients: f32s(&payload["plane"]),
            stiffness: single(&payload["kspring"]),
            damping: single(&payload["kdamp"]),
            dynamic_friction: single(&payload["fdyn"]),
            static_friction: single(&payload["fstat"]),
            index: integer(&payload["index"]),
            recovery_cycles: integer(&payload["recovery_cycles"]),
        }),
        Kind::PlaneEffects => Message::PlaneEffects([
            single(&payload["k_adhesion_normal"]),
            single(&payload["k_adhesion_lateral"]),
            single(&payload["texture_amplitude"]),
            single(&payload["texture_wavelength"]),
            single(&payload["buzz_amplitude"]),
            single(&payload["buzz_frequency"]),
        ]),
        Kind::CustomEffect => Message::CustomEffect {
            id: integer(&payload["id"]) as u32,
            parameters: list("params").map(single).collect(),
        },
        other => panic!("{other:?} was not recorded"),
    }
}

fn expected(message: &Value) -> Seen {
    let id = integer(&message["sender_id"]);
    let name = |key: &str| message[key].as_str().unwrap().to_owned();
    match message["kind"].as_str().unwrap() {
        "sender_description" => Seen::Sender(id, name("name")),
        "type_description" => Seen::Kind(id, name("name")),
        "udp_description" => Seen::Udp(integer(&message["port"]) as u16, name("host")),
        _ => Seen::Message(
            Timestamp {
                seconds: message["sec"].as_u64().unwrap() as u32,
                micros: message["usec"].as_u64().unwrap() as u32,
            },
            name("sender"),
            expected_message(&name("type"), &message["payload"]),
        ),
    }
}

fn each_recording(mut check: impl FnMut(&str, &Recording)) {
    for session in SESSIONS {
        for direction in DIRECTIONS {
            check(
                &format!("{session} {direction}"),
                &Recording::load(session, direction),
            );
        }
    }
}

#[test]
fn recorded_streams_decode_to_the_recorded_messages_in_any_pieces() {
    let mut messages = 0;
    each_recording(|what, recording| {
        let expected: Vec<Seen> = recording
            .messages_over("tcp")
            .into_iter()
            .map(expected)
            .collect();
        messages += expected.len();
        let whole = decode(std::iter::once(recording.stream.as_slice())).1;
        assert_eq!(whole, expected, "{what}, whole");
        let recorded = decode(recording.pieces()).1;
        assert_eq!(recorded, expected, "{what}, as recorded");
        for size in [1, 7, 24, 1000] {
            let cut = decode(recording.stream.chunks(size)).1;
            assert_eq!(cut, expected, "{what}, pieces of {size}");
        }
    });
    assert_eq!(messages, 930, "of the three sessions");
}

#[test]
fn recorded_datagrams_decode_to_the_recorded_messages() {
    let mut messages = 0;
    each_recording(|what, recording| {
        let peer = decode(recording.pieces()).0;
        let mut seen = Vec::new();
        for datagram in recording.datagrams() {
            read_datagram(datagram, |frame| {
                seen.push(own(peer.message(&frame)?));
                Ok(())
            })
            .unwrap();
        }
        let expected: Vec<Seen> = recording
            .messages_over("udp")
            .into_iter()
            .map(expected)
            .collect();
        assert_eq!(seen, expected, "{what}");
        messages += seen.len();
    });
    assert_eq!(messages, 932, "of the two sessions with datagrams");
}

#[test]
fn messages_whose_descriptions_have_not_come_yet_are_left_out() {
    let recording = Recording::load("simforce-udp", "server_to_client");
    let nobody = Peer::default();
    for datagram in recording.datagrams() {
        read_datagram(datagram, |frame| {
            assert_eq!(nobody.message(&frame)?, Event::Unknown);
            Ok(())
        })
        .unwrap();
    }
}

/// Where the library left bytes of its memory that say nothing: behind the text of a text message, in what fills up.
fn is_said(kind: &str, payload: &Value, at: usize) -> bool {
    match kind {
        "vrpn_Base text_message" => at < HEAD_LEN + 8 + payload["message"].as_str().unwrap().len(),
        _ => true,
    }
}

#[test]
fn recorded_messages_encode_to_the_recorded_bytes() {
    let mut encoded = 0;
    each_recording(|what, recording| {
        for message in recording.messages_over("tcp") {
            let Seen::Message(time, _, decoded) = expected(message) else {
                continue;
            };
            let mut payload = Vec::new();
            decoded.encode_into(&mut payload);
            let frame = Frame {
                time,
                sender: integer(&message["sender_id"]),
                kind: integer(&message["type_id"]),
                payload: &payload,
            };
            let mut bytes = Vec::new();
            frame.append_to(&mut bytes, integer(&message["sequence"]) as u32);

            let offset = integer(&message["offset"]) as usize;
            let length = integer(&message["length_field"]) as usize;
            let kind = message["type"].as_str().unwrap();
            assert_eq!(bytes.len(), integer(&message["bytes"]) as usize, "{what}");
            for at in (0..length).filter(|at| is_said(kind, &message["payload"], *at)) {
                let recorded = recording.stream[offset + at];
                assert_eq!(bytes[at], recorded, "{what} {kind}, byte {at} at {offset}");
            }
            encoded += 1;
        }
    });
    assert_eq!(encoded, 622);
}

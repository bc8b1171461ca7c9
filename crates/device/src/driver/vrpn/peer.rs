//! Names and numbers: what each side calls its senders and types on one link.

use std::collections::BTreeMap;

use super::message::{Kind, Message};
use super::wire::{Fields, Frame, ProtocolError, Timestamp};

/// Types of descriptions.
const SENDER: i32 = -1;
const KIND: i32 = -2;
const UDP: i32 = -3;

/// Senders and types that a link may have; the library allows as many.
const IDS_MAX: i32 = 2000;

/// Longest name of a sender or type, bytes; the library has room for 100.
const NAME_MAX: usize = 255;

/// The sender that stands for a link itself.
pub const CONTROL: &str = "VRPN Control";

/// What came of a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Event<'a> {
    /// The other side has a sender of this name.
    Sender {
        /// Its number on this link.
        id: i32,
        /// Its name, such as that of a device.
        name: &'a str,
    },
    /// The other side sends or takes messages of this type.
    Kind {
        /// Its number on this link.
        id: i32,
        /// Its name, known here or not.
        name: &'a str,
    },
    /// The other side takes datagrams.
    Udp {
        /// At this port.
        port: u16,
        /// Of this host, as it calls itself.
        host: &'a str,
    },
    /// A message.
    Message {
        /// When it was sent.
        time: Timestamp,
        /// Name of its sender.
        sender: &'a str,
        /// What it says.
        message: Message,
    },
    /// Nothing that is known here.
    Unknown,
}

/// What the other side has described so far.
#[derive(Debug, Clone, Default)]
pub struct Peer {
    senders: BTreeMap<i32, String>,
    kinds: BTreeMap<i32, Kind>,
}

impl Peer {
    /// Reads a frame; a message of a sender or type that was not described is [`Event::Unknown`].
    ///
    /// # Errors
    /// Where the payload cannot be what it is said to be.
    pub fn read<'a>(&'a mut self, frame: &Frame<'a>) -> Result<Event<'a>, ProtocolError> {
        match frame.kind {
            SENDER => {
                let (id, name) = described(frame, "sender")?;
                self.senders.insert(id, name.to_owned());
                Ok(Event::Sender { id, name })
            }
            KIND => {
                let (id, name) = described(frame, "type")?;
                match Kind::from_name(name) {
                    Some(kind) => self.kinds.insert(id, kind),
                    None => self.kinds.remove(&id),
                };
                Ok(Event::Kind { id, name })
            }
            UDP => udp(frame),
            _ => self.message(frame),
        }
    }

    /// Reads a frame that came in a datagram: messages alone, all else is [`Event::Unknown`].
    ///
    /// # Errors
    /// Where the payload cannot be what it is said to be.
    pub fn message<'a>(&'a self, frame: &Frame<'_>) -> Result<Event<'a>, ProtocolError> {
        let (Some(sender), Some(kind)) =
            (self.senders.get(&frame.sender), self.kinds.get(&frame.kind))
        else {
            return Ok(Event::Unknown);
        };
        Ok(Event::Message {
            time: frame.time,
            sender,
            message: Message::decode(*kind, frame.payload)?,
        })
    }
}

/// Number and name out of the description of a sender or type.
fn described<'a>(frame: &Frame<'a>, what: &'static str) -> Result<(i32, &'a str), ProtocolError> {
    let wrong = ProtocolError::Description { what };
    if !(0..IDS_MAX).contains(&frame.sender) {
        return Err(wrong);
    }
    let mut fields = Fields::new(frame.payload);
    let length = fields.i32().and_then(|length| usize::try_from(length).ok());
    let bytes = fields.rest();
    if length != Some(bytes.len()) {
        return Err(wrong);
    }
    let name = name(bytes).ok_or(wrong)?;
    Ok((frame.sender, name))
}

fn udp<'a>(frame: &Frame<'a>) -> Result<Event<'a>, ProtocolError> {
    let wrong = ProtocolError::Description { what: "port" };
    let port = u16::try_from(frame.sender).map_err(|_| wrong.clone())?;
    let host = name(frame.payload).ok_or(wrong)?;
    Ok(Event::Udp { port, host })
}

/// Text up to the NUL, not empty and not too long.
fn name(bytes: &[u8]) -> Option<&str> {
    let bytes = bytes.split(|byte| *byte == 0).next()?;
    let name = std::str::from_utf8(bytes).ok()?;
    (!name.is_empty() && name.len() <= NAME_MAX).then_some(name)
}

/// Our own names and numbers on one link: the number of a type is its place in [`Kind::ALL`].
#[derive(Debug, Clone, Default)]
pub struct Ours {
    sequence: u32,
    payload: Vec<u8>,
}

impl Ours {
    /// Number of the sender [`CONTROL`].
    const CONTROL_ID: i32 = 0;

    /// Number of the one device.
    const DEVICE_ID: i32 = 1;

    /// Describes the sender of a device, and the types that it sends and takes.
    pub fn describe(&mut self, device: &str, kinds: &[Kind], out: &mut Vec<u8>) {
        self.describe_one(SENDER, Self::CONTROL_ID, CONTROL, out);
        self.describe_one(SENDER, Self::DEVICE_ID, device, out);
        for kind in kinds {
            self.describe_one(KIND, number(*kind), kind.name(), out);
        }
    }

    /// Says where datagrams are taken.
    pub fn describe_udp(&mut self, port: u16, host: &str, out: &mut Vec<u8>) {
        self.payload.clear();
        self.payload.extend_from_slice(host.as_bytes());
        self.payload.push(0);
        self.append(UDP, i32::from(port), Timestamp::now(), out);
    }

    /// Writes a message of the device behind what is there.
    pub fn pack(&mut self, message: &Message, time: Timestamp, out: &mut Vec<u8>) {
        self.payload.clear();
        message.encode_into(&mut self.payload);
        self.append(number(message.kind()), Self::DEVICE_ID, time, out);
    }

    fn describe_one(&mut self, what: i32, id: i32, name: &str, out: &mut Vec<u8>) {
        let length = name.len() as i32 + 1;
        self.payload.clear();
        self.payload.extend_from_slice(&length.to_be_bytes());
        self.payload.extend_from_slice(name.as_bytes());
        self.payload.push(0);
        self.append(what, id, Timestamp::now(), out);
    }

    fn append(&mut self, kind: i32, sender: i32, time: Timestamp, out: &mut Vec<u8>) {
        let frame = Frame {
            time,
            sender,
            kind,
            payload: &self.payload,
        };
        frame.append_to(out, self.sequence);
        self.sequence = self.sequence.wrapping_add(1);
    }
}

/// Our number of a type.
fn number(kind: Kind) -> i32 {
    kind as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::vrpn::wire::Decoder;

    #[test]
    fn what_one_side_describes_and_packs_the_other_reads() {
        let mut ours = Ours::default();
        let mut out = Vec::new();
        ours.describe_udp(33320, "127.0.0.1", &mut out);
        ours.describe("Hand0", &[Kind::ForceError, Kind::Ping], &mut out);
        ours.pack(&Message::ForceError(3), Timestamp::now(), &mut out);
        ours.pack(&Message::Pong, Timestamp::now(), &mut out);

        let mut peer = Peer::default();
        let mut seen = Vec::new();
        let mut decoder = Decoder::after_cookie();
        decoder
            .push(&out, |frame| {
                seen.push(match peer.read(&frame)? {
                    Event::Sender { name, .. } | Event::Kind { name, .. } => name.to_owned(),
                    Event::Udp { port, host } => format!("{host}:{port}"),
                    Event::Message {
                        sender, message, ..
                    } => format!("{sender} {message:?}"),
                    Event::Unknown => "unknown".to_owned(),
                });
                Ok(())
            })
            .unwrap();
        assert_eq!(
            seen,
            [
                "127.0.0.1:33320",
                "VRPN Control",
                "Hand0",
                "vrpn_ForceDevice Force_Error",
                "vrpn_Base ping_message",
                "Hand0 ForceError(3)",
                "unknown", // pong was never described
            ]
        );
    }

    fn describe(kind: i32, id: i32, payload: &[u8]) -> Result<Event<'static>, ProtocolError> {
        let frame = Frame {
            time: Timestamp::default(),
            sender: id,
            kind,
            payload,
        };
        Peer::default().read(&frame).map(|_| Event::Unknown)
    }

    #[test]
    fn descriptions_that_make_no_sense_are_refused() {
        let named = |length: i32, name: &[u8]| [&length.to_be_bytes(), name].concat();
        for kind in [SENDER, KIND] {
            assert!(describe(kind, 1999, &named(6, b"Hand0\0")).is_ok());
            for (id, payload) in [
                (2000, named(6, b"Hand0\0")),
                (-1, named(6, b"Hand0\0")),
                (1, named(5, b"Hand0\0")),
                (1, named(-1, b"Hand0\0")),
                (1, named(i32::MAX, b"Hand0\0")),
                (1, named(1, b"\0")),
                (1, named(3, b"\xff\xfe\0")),
                (1, named(300, &[b'x'; 300])),
                (1, b"abc".to_vec()),
                (1, vec![]),
            ] {
                assert!(describe(kind, id, &payload).is_err(), "{id} {payload:?}");
            }
        }
        assert!(describe(UDP, 33320, b"127.0.0.1\0").is_ok());
        assert!(describe(UDP, 65536, b"127.0.0.1\0").is_err());
        assert!(describe(UDP, -1, b"127.0.0.1\0").is_err());
        assert!(describe(UDP, 33320, b"").is_err());
    }
}

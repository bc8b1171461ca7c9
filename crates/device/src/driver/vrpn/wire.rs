//! The bytes of VRPN: greeting, frames, and numbers in network order.

use std::time::{SystemTime, UNIX_EPOCH};

use thiserror::Error;

/// Port of a server, TCP and UDP.
pub const PORT: u16 = 3883;

/// Length of the greeting and of a frame's head, bytes.
pub const HEAD_LEN: usize = 24;

/// Largest payload of a frame, bytes; the library drops a link that sends more.
pub const PAYLOAD_MAX: usize = 64_000;

/// Largest datagram, bytes; it holds several whole frames.
pub const DATAGRAM_MAX: usize = 1472;

/// The greeting ("cookie") that each side sends first: version 07.38, nothing to be logged.
pub const COOKIE: [u8; HEAD_LEN] = *b"vrpn: ver. 07.38  0\0\0\0\0\0";

/// What of the other side's greeting must be as it is: all up to the last dot.
const COOKIE_START: &[u8] = b"vrpn: ver. 07.";

/// Where the version stands in the greeting.
const COOKIE_VERSION: std::ops::Range<usize> = 11..16;

/// Where the log mode stands in the greeting, a digit from 0 to 3.
const COOKIE_LOG_MODE: usize = 18;

/// Why bytes are not VRPN, or not the VRPN that is understood here. The link cannot go on after it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ProtocolError {
    /// The greeting is of another version or of no VRPN at all.
    #[error("greeting \"{found}\" is not that of VRPN 07.xx")]
    Cookie {
        /// The greeting as far as it can be printed.
        found: String,
    },
    /// A frame is said to be shorter than its head.
    #[error("a frame of {length} bytes is shorter than its head")]
    TooShort {
        /// Length as given, bytes.
        length: u32,
    },
    /// A frame is said to be longer than any may be.
    #[error("a frame of {length} bytes is longer than any may be")]
    TooLong {
        /// Length as given, bytes.
        length: u32,
    },
    /// The payload of a known message has another size than it must have.
    #[error("a message \"{kind}\" has a payload of {size} bytes, which cannot be")]
    WrongSize {
        /// Name of the message's type.
        kind: &'static str,
        /// Size of the payload, bytes.
        size: usize,
    },
    /// A description (of a sender, a type, a port) makes no sense.
    #[error("the description of a {what} makes no sense")]
    Description {
        /// What it describes.
        what: &'static str,
    },
}

/// Time of a message on its sender's clock, since 1970.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Timestamp {
    /// Whole seconds.
    pub seconds: u32,
    /// And millionths of a second.
    pub micros: u32,
}

impl Timestamp {
    /// The time on this machine's clock.
    #[must_use]
    pub fn now() -> Self {
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        Self {
            // Wraps in 2106, as the field does.
            seconds: since.as_secs() as u32,
            micros: since.subsec_micros(),
        }
    }
}

/// One message as it goes over the wire.
///
/// ```text
/// u32 length | u32 s | u32 µs | i32 sender | i32 kind | u32 sequence | payload | to a multiple of 8
///    length = 24 + payload, without what fills up
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// When it was sent.
    pub time: Timestamp,
    /// Number of the sender; of the described sender or type in a description.
    pub sender: i32,
    /// Number of the type; negative in a description.
    pub kind: i32,
    /// What it says.
    pub payload: &'a [u8],
}

impl Frame<'_> {
    /// Writes the frame behind what is there. The sequence number means nothing to the receiver.
    pub fn append_to(&self, out: &mut Vec<u8>, sequence: u32) {
        let length = (HEAD_LEN + self.payload.len()) as u32;
        out.extend_from_slice(&length.to_be_bytes());
        out.extend_from_slice(&self.time.seconds.to_be_bytes());
        out.extend_from_slice(&self.time.micros.to_be_bytes());
        out.extend_from_slice(&self.sender.to_be_bytes());
        out.extend_from_slice(&self.kind.to_be_bytes());
        out.extend_from_slice(&sequence.to_be_bytes());
        out.extend_from_slice(self.payload);
        let filler = padded(self.payload.len()) - self.payload.len();
        out.extend_from_slice(&[0; 8][..filler]);
    }
}

/// Length with what fills it up to a multiple of 8.
fn padded(length: usize) -> usize {
    length.next_multiple_of(8)
}

/// The head of a frame whose payload is still to come.
#[derive(Debug, Clone, Copy)]
struct Head {
    payload_len: usize,
    time: Timestamp,
    sender: i32,
    kind: i32,
}

impl Head {
    fn parse(bytes: &[u8]) -> Result<Self, ProtocolError> {
        let mut fields = Fields::new(bytes);
        let mut next = || fields.u32().ok_or(ProtocolError::TooShort { length: 0 });
        let length = next()?;
        let (seconds, micros) = (next()?, next()?);
        let (sender, kind) = (next()?.cast_signed(), next()?.cast_signed());
        let payload_len = (length as usize)
            .checked_sub(HEAD_LEN)
            .ok_or(ProtocolError::TooShort { length })?;
        if payload_len > PAYLOAD_MAX {
            return Err(ProtocolError::TooLong { length });
        }
        Ok(Self {
            payload_len,
            time: Timestamp { seconds, micros },
            sender,
            kind,
        })
    }

    fn with<'a>(&self, payload: &'a [u8]) -> Frame<'a> {
        Frame {
            time: self.time,
            sender: self.sender,
            kind: self.kind,
            payload,
        }
    }
}

/// What a [`Decoder`] waits for.
#[derive(Debug, Clone, Copy)]
enum Stage {
    Cookie,
    Head,
    Payload(Head),
}

/// Greeting and frames out of a stream that comes in pieces of any size.
///
/// Holds at most one frame; what it cannot understand ends it for good.
#[derive(Debug, Clone)]
pub struct Decoder {
    stage: Stage,
    unit: Vec<u8>,
    version: Option<String>,
    broken: Option<ProtocolError>,
}

impl Decoder {
    /// A decoder at the beginning of a stream: the greeting comes first.
    #[must_use]
    pub fn new() -> Self {
        Self {
            stage: Stage::Cookie,
            unit: Vec::new(),
            version: None,
            broken: None,
        }
    }

    /// A decoder of a stream whose greeting has gone by.
    #[must_use]
    pub fn after_cookie() -> Self {
        Self {
            stage: Stage::Head,
            ..Self::new()
        }
    }

    /// Version of the other side, such as `07.38`, once its greeting has come.
    #[must_use]
    pub fn version(&self) -> Option<&str> {
        self.version.as_deref()
    }

    /// Takes the next piece of the stream and hands over each frame that is complete with it.
    ///
    /// # Errors
    /// What is wrong with the stream, or what `on_frame` found wrong with a frame; the same ever after.
    pub fn push(
        &mut self,
        bytes: &[u8],
        on_frame: impl FnMut(Frame<'_>) -> Result<(), ProtocolError>,
    ) -> Result<(), ProtocolError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        let result = self.advance(bytes, on_frame);
        if let Err(error) = &result {
            self.broken = Some(error.clone());
            self.unit = Vec::new();
        }
        result
    }

    fn advance(
        &mut self,
        mut bytes: &[u8],
        mut on_frame: impl FnMut(Frame<'_>) -> Result<(), ProtocolError>,
    ) -> Result<(), ProtocolError> {
        loop {
            let needed = match self.stage {
                Stage::Cookie | Stage::Head => HEAD_LEN,
                Stage::Payload(head) => padded(head.payload_len),
            };
            let missing = needed - self.unit.len();
            let (taken, rest) = bytes.split_at(missing.min(bytes.len()));
            self.unit.extend_from_slice(taken);
            if taken.len() < missing {
                return Ok(());
            }
            bytes = rest;
            self.stage = match self.stage {
                Stage::Cookie => {
                    self.version = Some(check_cookie(&self.unit)?);
                    Stage::Head
                }
                Stage::Head => Stage::Payload(Head::parse(&self.unit)?),
                Stage::Payload(head) => {
                    on_frame(head.with(&self.unit[..head.payload_len]))?;
                    Stage::Head
                }
            };
            self.unit.clear();
        }
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

/// Hands over each frame of a datagram.
///
/// # Errors
/// What is wrong with the datagram, or what `on_frame` found wrong with a frame.
pub fn read_datagram(
    mut bytes: &[u8],
    mut on_frame: impl FnMut(Frame<'_>) -> Result<(), ProtocolError>,
) -> Result<(), ProtocolError> {
    while !bytes.is_empty() {
        let cut_short = ProtocolError::TooShort {
            length: bytes.len() as u32,
        };
        let Some((head, rest)) = bytes.split_at_checked(HEAD_LEN) else {
            return Err(cut_short);
        };
        let head = Head::parse(head)?;
        let Some(payload) = rest.get(..head.payload_len) else {
            return Err(cut_short);
        };
        on_frame(head.with(payload))?;
        // What fills up the last frame may be left out.
        bytes = &rest[padded(head.payload_len).min(rest.len())..];
    }
    Ok(())
}

/// The version out of a greeting, if it is one that is understood.
fn check_cookie(bytes: &[u8]) -> Result<String, ProtocolError> {
    let is_log_mode = |byte: &u8| (b'0'..=b'3').contains(byte);
    if bytes.starts_with(COOKIE_START) && bytes.get(COOKIE_LOG_MODE).is_some_and(is_log_mode) {
        Ok(printable(bytes.get(COOKIE_VERSION).unwrap_or_default()))
    } else {
        let found = printable(bytes).trim_end().to_owned();
        Err(ProtocolError::Cookie { found })
    }
}

/// Text up to the first NUL, with a mark for each byte that is no printable ASCII.
fn printable(bytes: &[u8]) -> String {
    let text = bytes.iter().take_while(|byte| **byte != 0);
    text.map(|byte| match byte {
        b' '..=b'~' => char::from(*byte),
        _ => '?',
    })
    .collect()
}

/// Numbers and text out of a payload, one after the other; `None` where it ends too soon.
#[derive(Debug)]
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All that is left.
    pub(super) fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.0)
    }

    fn chunk<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (chunk, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*chunk)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.chunk().map(u32::from_be_bytes)
    }

    pub(super) fn i32(&mut self) -> Option<i32> {
        self.chunk().map(i32::from_be_bytes)
    }

    pub(super) fn f32(&mut self) -> Option<f32> {
        self.chunk().map(f32::from_be_bytes)
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.chunk().map(f64::from_be_bytes)
    }

    pub(super) fn f32s<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f32()?;
        }
        Some(numbers)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests;

//! The recorded sessions as the tests use them.

use std::path::{Path, PathBuf};

use serde_json::Value;

pub(crate) const SESSIONS: [&str; 3] = ["simforce-tcp", "simforce-udp", "stock-udp"];

pub(crate) const DIRECTIONS: [&str; 2] = ["server_to_client", "client_to_server"];

/// One direction of a session.
pub(crate) struct Recording {
    /// The whole TCP stream.
    pub(crate) stream: Vec<u8>,
    /// What was sent when.
    pub(crate) segments: Vec<Segment>,
    /// What it says, by another decoder.
    pub(crate) messages: Vec<Value>,
}

pub(crate) struct Segment {
    /// s from the start of the session.
    pub(crate) time_s: f64,
    pub(crate) sent: Sent,
}

pub(crate) enum Sent {
    /// A piece of the TCP stream.
    Stream(std::ops::Range<usize>),
    Datagram(Vec<u8>),
}

impl Recording {
    pub(crate) fn load(session: &str, direction: &str) -> Self {
        let folder = folder().join(session);
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        let segments = read("segments.tsv")
            .lines()
            .skip(1)
            .filter_map(|line| segment(line, direction))
            .collect();
        let messages = read("messages.jsonl")
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).unwrap())
            .filter(|message| message["direction"] == direction && message["kind"] != "cookie")
            .collect();
        Self {
            stream: std::fs::read(folder.join(format!("{direction}.tcp.bin"))).unwrap(),
            segments,
            messages,
        }
    }

    pub(crate) fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        self.segments
            .iter()
            .filter_map(|segment| match &segment.sent {
                Sent::Stream(range) => Some(&self.stream[range.clone()]),
                Sent::Datagram(_) => None,
            })
    }

    pub(crate) fn datagrams(&self) -> impl Iterator<Item = &[u8]> {
        self.segments
            .iter()
            .filter_map(|segment| match &segment.sent {
                Sent::Datagram(bytes) => Some(bytes.as_slice()),
                Sent::Stream(_) => None,
            })
    }

    /// Those that came over `tcp` or `udp`.
    pub(crate) fn messages_over(&self, transport: &str) -> Vec<&Value> {
        let over = self.messages.iter();
        over.filter(|message| message["transport"] == transport)
            .collect()
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/vrpn")
}

fn segment(line: &str, direction: &str) -> Option<Segment> {
    let columns: Vec<&str> = line.split('\t').collect();
    if columns[1] != direction {
        return None;
    }
    let sent = match columns[2] {
        "tcp" => {
            let offset: usize = columns[3].parse().unwrap();
            let length: usize = columns[4].parse().unwrap();
            Sent::Stream(offset..offset + length)
        }
        "udp" => Sent::Datagram(from_hex(columns[5])),
        _ => return None,
    };
    Some(Segment {
        time_s: columns[0].parse().unwrap(),
        sent,
    })
}

pub(crate) fn from_hex(hex: &str) -> Vec<u8> {
    let digits = hex.as_bytes();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect()
}

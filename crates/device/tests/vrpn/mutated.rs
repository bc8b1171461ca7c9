//! Streams that are cut short, changed or made up end in an error or in nothing: no panic, no hang, no growth.

use device::driver::vrpn::peer::Peer;
use device::driver::vrpn::wire::{Decoder, read_datagram};

use crate::recording::{DIRECTIONS, Recording, SESSIONS};

/// xorshift64*: the same numbers each run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() >> 16) as usize % bound.max(1)
    }
}

/// Changes up to four places: a bit, a byte, a length that lies, some bytes lost or twice.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes.truncate(at),
            3 => {
                let word = [0, 23, 24, 25, 64_024, 64_025, u32::MAX][random.below(7)];
                for (byte, new) in bytes[at..].iter_mut().zip(word.to_be_bytes()) {
                    *byte = new;
                }
            }
            4 => {
                bytes.drain(at..(at + random.below(12)).min(bytes.len()));
            }
            _ => {
                let end = (at + random.below(12)).min(bytes.len());
                let twice = bytes[at..end].to_vec();
                bytes.splice(at..at, twice);
            }
        }
    }
}

/// Some frames of the recorded streams and datagrams, from a few bytes to a few hundred.
fn fragments() -> (Peer, Vec<Vec<u8>>) {
    let mut fragments = Vec::new();
    let mut peer = Peer::default();
    for session in SESSIONS {
        for direction in DIRECTIONS {
            let recording = Recording::load(session, direction);
            Decoder::new()
                .push(&recording.stream, |frame| peer.read(&frame).map(|_| ()))
                .unwrap();
            fragments.extend(recording.datagrams().map(<[u8]>::to_vec));
            // Single frames by their offsets, of each kind the recording has.
            for message in recording.messages_over("tcp") {
                let at = |key: &str| message[key].as_u64().unwrap() as usize;
                let frame = &recording.stream[at("offset")..at("offset") + at("bytes")];
                fragments.push(frame.to_vec());
            }
        }
    }
    (peer, fragments)
}

#[test]
fn hundred_thousand_mutations_are_survived() {
    let mut random = Random(0x5eed_0001);
    let (mut peer, fragments) = fragments();
    let (mut understood, mut refused) = (0_u32, 0_u32);
    for _ in 0..100_000 {
        let mut bytes = fragments[random.below(fragments.len())].clone();
        if random.below(3) == 0 {
            bytes.extend_from_slice(&fragments[random.below(fragments.len())]);
        }
        mutate(&mut bytes, &mut random);
        let result = if random.below(2) == 0 {
            let cut = random.below(bytes.len());
            let mut decoder = Decoder::after_cookie();
            decoder
                .push(&bytes[..cut], |frame| peer.read(&frame).map(|_| ()))
                .and_then(|()| decoder.push(&bytes[cut..], |frame| peer.read(&frame).map(|_| ())))
        } else {
            read_datagram(&bytes, |frame| peer.message(&frame).map(|_| ()))
        };
        match result {
            Ok(()) => understood += 1,
            Err(_) => refused += 1,
        }
    }
    // The changes do reach what is checked, and do not all end at the first check.
    assert!(
        understood > 10_000 && refused > 10_000,
        "{understood} {refused}"
    );
}

#[test]
fn whole_streams_cut_anywhere_wait_for_the_rest() {
    for session in SESSIONS {
        let recording = Recording::load(session, "client_to_server");
        let mut random = Random(0x5eed_0002);
        for _ in 0..30 {
            let cut = random.below(recording.stream.len());
            let mut peer = Peer::default();
            let mut decoder = Decoder::new();
            let mut frames = 0;
            decoder
                .push(&recording.stream[..cut], |frame| {
                    frames += 1;
                    peer.read(&frame).map(|_| ())
                })
                .unwrap();
            assert!(frames <= recording.messages_over("tcp").len());
        }
    }
}

#[test]
fn bytes_that_are_no_vrpn_are_refused_or_waited_on() {
    let mut random = Random(0x5eed_0003);
    for _ in 0..2_000 {
        let length = random.below(400);
        let bytes: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
        let mut peer = Peer::default();
        let greeted = Decoder::new().push(&bytes, |frame| peer.read(&frame).map(|_| ()));
        assert!(greeted.is_err() || bytes.len() < 24);
        let _any = Decoder::after_cookie().push(&bytes, |frame| peer.read(&frame).map(|_| ()));
        let _any = read_datagram(&bytes, |frame| peer.message(&frame).map(|_| ()));
    }
}

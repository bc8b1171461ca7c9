//! Frames and events that something has damaged on the way.

use super::*;
use crate::driver::haply::tests::recording::{Direction, inventory, recorded};

/// A xorshift generator: the same frames on every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

const GRAFTS: [&str; 12] = [
    "1e999",
    "-1e308",
    "1e-320",
    "null",
    "[]",
    "{}",
    "\"\"",
    "true",
    "-0",
    "99999999999999999999",
    "\\u0000",
    "NaN",
];

/// A frame with some of its bytes, numbers or parts changed.
fn mutated(text: &str, dice: &mut Dice) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len());
        match dice.below(6) {
            0 if !bytes.is_empty() => bytes[at] = dice.below(256) as u8,
            1 => bytes.truncate(at),
            2 => {
                let to = (at + dice.below(40)).min(bytes.len());
                bytes.drain(at.min(to)..to);
            }
            3 => {
                let graft = GRAFTS[dice.below(GRAFTS.len())];
                bytes.splice(at..at, graft.bytes());
            }
            4 => {
                // In place of a value, so that the frame stays JSON.
                let Some(colon) = bytes[at..].iter().position(|b| *b == b':') else {
                    continue;
                };
                let from = at + colon + 1;
                let length = bytes[from..]
                    .iter()
                    .position(|b| b",}]".contains(b))
                    .unwrap_or(0);
                let graft = GRAFTS[dice.below(GRAFTS.len())];
                bytes.splice(from..from + length, graft.bytes());
            }
            _ => {
                let to = (at + dice.below(200)).min(bytes.len());
                let piece = bytes[at..to].to_vec();
                let into = dice.below(bytes.len());
                bytes.splice(into..into, piece);
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn hundred_thousand_mutated_frames_leave_finite_states_and_forces() {
    let recorded: Vec<String> = recorded()
        .into_iter()
        .filter(|(direction, _)| *direction == Direction::ToClient)
        .map(|(_, text)| text)
        .chain([inventory().to_string()])
        .collect();
    let event = r#"{"name":"device-safety-triggered","category":"device","level":"warning","data":{"device_family":"inverse","device_id":"049D","safety_type":"fod_stage_changed"},"message":"FOD stage changed: guard -> hard"}"#;
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15);
    let mut talk = Talk::new();
    let (mut states, mut told, mut gone) = (0_u32, 0_u32, 0_u32);
    for n in 0..100_000_u32 {
        talk.now += MS;
        let command: Command = Wrench::new(UP, DVec3::ZERO).into();
        let said = talk.talk.say(&command, talk.now);
        assert!(said.contains(ID) && said.len() < 200, "{said}");
        if n % 10 == 9 {
            gone += u32::from(
                talk.talk
                    .hear_event(&mutated(event, &mut dice), talk.now)
                    .is_err(),
            );
        } else {
            let text = mutated(&recorded[dice.below(recorded.len())], &mut dice);
            match talk.talk.hear(&text, talk.now) {
                Ok(None) => {}
                Ok(Some(state)) => {
                    states += 1;
                    assert!(state.is_finite(), "{text}");
                    assert!((state.pose.rotation.length() - 1.0).abs() < 1e-9, "{text}");
                    assert!(state.pose.translation.abs().max_element() <= 2.0, "{text}");
                }
                Err(_) => gone += 1,
            }
        }
        while talk.talk.message().is_some() {
            told += 1;
        }
    }
    // Some of the frames are still good; what is told does not grow with what is wrong.
    assert!(states > 5_000, "{states}");
    assert!(told < 400, "{told}");
    assert!(gone < 1000, "{gone}");
}

//! Reports of a SpaceMouse: which axes and buttons a number of bytes means.

use glam::DVec3;

use crate::driver::rate::{self, Input};

/// Deflection that counts as full, in the device's counts.
pub(in crate::driver) const FULL: f64 = 350.0;

/// Deflection that counts as none: the rest position drifts by a few counts.
pub(in crate::driver) const DEAD: f64 = 5.0;

/// One report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Report {
    /// x, y, z: 7 bytes.
    Translation([i16; 3]),
    /// About x, y, z: 7 bytes.
    Rotation([i16; 3]),
    /// Both at once, as newer wireless models send: 13 bytes.
    Both([i16; 3], [i16; 3]),
    /// Buttons, bit 0 first; those beyond 32 are left out.
    Buttons(u32),
    /// Something else, such as the battery.
    Other,
}

/// A report that is too short for what it says it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Truncated {
    /// Its first byte; none where it was empty.
    pub(super) id: Option<u8>,
    /// Its bytes.
    pub(super) length: usize,
}

/// Reads a report. Which form it has is told by its length, never by the model.
pub(super) fn decode(bytes: &[u8]) -> Result<Report, Truncated> {
    let truncated = Truncated {
        id: bytes.first().copied(),
        length: bytes.len(),
    };
    let [id, data @ ..] = bytes else {
        return Err(truncated);
    };
    match (id, data) {
        (1, [a, b, c, d, e, f, rest @ ..]) => {
            let translation = axes([*a, *b, *c, *d, *e, *f]);
            Ok(match rest {
                [a, b, c, d, e, f, ..] => Report::Both(translation, axes([*a, *b, *c, *d, *e, *f])),
                _ => Report::Translation(translation),
            })
        }
        (2, [a, b, c, d, e, f, ..]) => Ok(Report::Rotation(axes([*a, *b, *c, *d, *e, *f]))),
        (3, [_, ..]) => {
            let mut bits = [0; 4];
            for (bit, byte) in bits.iter_mut().zip(data) {
                *bit = *byte;
            }
            Ok(Report::Buttons(u32::from_le_bytes(bits)))
        }
        (1..=3, _) => Err(truncated),
        _ => Ok(Report::Other),
    }
}

fn axes(bytes: [u8; 6]) -> [i16; 3] {
    let [a, b, c, d, e, f] = bytes;
    [
        i16::from_le_bytes([a, b]),
        i16::from_le_bytes([c, d]),
        i16::from_le_bytes([e, f]),
    ]
}

/// What the puck says now, from all reports so far.
///
/// The device speaks only while it is deflected. What has not been heard of for a while is zero, in case the last
/// word was lost.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Puck {
    translation: [i16; 3],
    rotation: [i16; 3],
    translated_s: f64,
    rotated_s: f64,
    buttons: u32,
}

impl Puck {
    /// Silence after which a deflection counts as over, s: while it lasts, reports come every 8 to 16 ms.
    const SILENCE_S: f64 = 0.1;

    /// Takes a report that came at a time, s.
    pub(super) fn take(&mut self, report: Report, now_s: f64) {
        if let Report::Translation(t) | Report::Both(t, _) = report {
            self.translation = t;
            self.translated_s = now_s;
        }
        if let Report::Rotation(r) | Report::Both(_, r) = report {
            self.rotation = r;
            self.rotated_s = now_s;
        }
        if let Report::Buttons(buttons) = report {
            self.buttons = buttons;
        }
    }

    /// What is so at a time, s.
    ///
    /// The device counts x to the right, y to the user, z down, and turns right-handed about these; half a turn
    /// about x makes that x right, y away, z up.
    pub(super) fn input(&self, now_s: f64) -> Input {
        let alive = |axes: [i16; 3], heard_s: f64| {
            if now_s - heard_s > Self::SILENCE_S {
                return DVec3::ZERO;
            }
            let [x, y, z] = axes.map(|count| rate::share(f64::from(count), FULL, DEAD));
            DVec3::new(x, -y, -z)
        };
        Input {
            linear: alive(self.translation, self.translated_s),
            angular: alive(self.rotation, self.rotated_s),
            buttons: self.buttons,
        }
    }
}

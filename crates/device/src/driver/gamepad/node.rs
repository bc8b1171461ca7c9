//! Gamepads as device files of the kernel's input system.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use evdev::{
    AbsoluteAxisCode, Device, FFEffect, FFEffectCode, FFEffectData, FFEffectKind, FFReplay,
    FFTrigger, KeyCode,
};

use super::pad::{Axis, CROSS_LEFT, CROSS_RIGHT, KEY_FIRST, KEY_LAST, Range, Shape, Snapshot};
use super::rumble::FULL_FORCE;
use super::{KEY, PadSource, Port};
use crate::driver::link::{Connected, Threaded};
use crate::driver::rate::{self, RateHandle, RateSettings};
use crate::driver::{Identity, Listing, Opened, Unavailable};

/// Where the kernel tells of its input devices, and where their files are.
const TOLD_IN: &str = "/sys/class/input";
const FILES_IN: &str = "/dev/input";

/// Effects that the kernel can hold, so no number of one is beyond.
const EFFECTS_MAX: u16 = 96;

/// A gamepad that is attached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Found {
    /// Its device file.
    pub(super) path: PathBuf,
    /// What it calls itself.
    pub(super) name: String,
}

/// One line for each pad.
pub(super) fn list() -> Vec<Listing> {
    let found = find(Path::new(TOLD_IN), Path::new(FILES_IN));
    if found.is_empty() {
        return vec![Listing {
            name: KEY.to_owned(),
            status: Err(nothing()),
        }];
    }
    found
        .iter()
        .map(|pad| Listing {
            name: format!("{KEY}:{}", pad.path.display()),
            status: open_file(&pad.path).map(|_| pad.name.clone()),
        })
        .collect()
}

/// Opens the pad at a device file, or the first.
pub(super) fn open(place: &str) -> Result<Opened, Unavailable> {
    let (path, settings) = rate::split_place(KEY, place)?;
    let path = path.to_owned();
    let handle = Arc::new(Mutex::new(RateHandle::new(settings)));
    Threaded::open(move || {
        let path = match path.as_str() {
            "" => first()?,
            path => PathBuf::from(path),
        };
        let pad = Pad::open(open_file(&path)?, &path)?;
        Ok(connect(pad, settings, &handle))
    })
}

fn connect(pad: Pad, settings: RateSettings, handle: &Arc<Mutex<RateHandle>>) -> Connected {
    let can_rumble = pad.can_rumble();
    let told = if can_rumble {
        format!("the force is told by the rumble, all of it at {FULL_FORCE} N; it has no direction")
    } else {
        "it has no rumble: the force is not felt".to_owned()
    };
    let identity = Identity {
        name: pad.device.name().unwrap_or("gamepad").to_owned(),
        limits: rate::limits(if can_rumble { FULL_FORCE } else { 0.0 }),
        notes: vec![settings.note(), told],
    };
    let shape = pad.shape;
    rate::connected(identity, PadSource::new(pad, shape, can_rumble), handle)
}

fn nothing() -> Unavailable {
    Unavailable::NotThere {
        reason: format!("no gamepad is attached (looked in {TOLD_IN})"),
    }
}

/// The first that may be opened; if none may, why the first may not.
fn first() -> Result<PathBuf, Unavailable> {
    let found = find(Path::new(TOLD_IN), Path::new(FILES_IN));
    let mut refused = None;
    for pad in found {
        match open_file(&pad.path) {
            Ok(_) => return Ok(pad.path),
            Err(why) => refused = refused.or(Some(why)),
        }
    }
    Err(refused.unwrap_or_else(nothing))
}

/// The gamepads among the input devices, by their numbers. No device file is opened: there are keyboards among them.
pub(super) fn find(told_in: &Path, files_in: &Path) -> Vec<Found> {
    let entries = std::fs::read_dir(told_in).into_iter().flatten().flatten();
    let mut numbers: Vec<u32> = entries
        .filter_map(|entry| {
            let name = entry.file_name();
            name.to_str()?.strip_prefix("event")?.parse().ok()
        })
        .collect();
    numbers.sort_unstable();
    let pad = |number: u32| {
        let file = format!("event{number}");
        let told = told_in.join(&file).join("device");
        let text = |part: &str| std::fs::read_to_string(told.join(part)).unwrap_or_default();
        let (keys, axes) = (text("capabilities/key"), text("capabilities/abs"));
        let is_pad = has_bit(&keys, KEY_FIRST)
            && has_bit(&axes, Axis::X.code())
            && has_bit(&axes, Axis::Y.code());
        is_pad.then(|| Found {
            path: files_in.join(&file),
            name: text("name").trim().to_owned(),
        })
    };
    numbers.into_iter().filter_map(pad).collect()
}

/// Is a bit set in the kernel's text of a bit field: words of hexadecimal digits, the highest first?
pub(super) fn has_bit(text: &str, bit: u16) -> bool {
    let (word, shift) = (
        usize::from(bit) / usize::BITS as usize,
        u32::from(bit) % usize::BITS,
    );
    text.split_whitespace()
        .rev()
        .nth(word)
        .and_then(|digits| usize::from_str_radix(digits, 16).ok())
        .is_some_and(|bits| bits >> shift & 1 == 1)
}

/// Opens a device file to read and to write: rumble is written.
fn open_file(path: &Path) -> Result<File, Unavailable> {
    OpenOptions::new()
        .read(true)
        .write(true)
        .open(path)
        .map_err(|e| refusal(path, &e))
}

/// What the system's refusal means, with the rule that mends it.
pub(super) fn refusal(path: &Path, error: &io::Error) -> Unavailable {
    let shown = path.display();
    match error.kind() {
        io::ErrorKind::PermissionDenied => Unavailable::PermissionDenied {
            path: shown.to_string(),
            mend: "put the line\n  KERNEL==\"event*\", SUBSYSTEM==\"input\", ENV{ID_INPUT_JOYSTICK}==\"1\", \
                   TAG+=\"uaccess\"\ninto /etc/udev/rules.d/70-gamepad.rules, run `sudo udevadm control --reload` and \
                   plug it in again; or join the group input"
                .to_owned(),
        },
        io::ErrorKind::NotFound => Unavailable::NotThere {
            reason: format!("there is no {shown}; `snapin devices` lists the gamepads that are attached"),
        },
        _ => Unavailable::Failed {
            reason: format!("{shown} could not be opened: {error}"),
        },
    }
}

/// An opened pad.
pub(super) struct Pad {
    device: Device,
    shape: Shape,
    /// The one effect, once it was uploaded. Dropping it takes it out of the pad.
    effect: Option<FFEffect>,
}

impl Pad {
    /// From its opened device file.
    pub(super) fn open(file: File, path: &Path) -> Result<Self, Unavailable> {
        let failed = |e: io::Error| Unavailable::Failed {
            reason: format!("{} is no input device: {e}", path.display()),
        };
        let device = Device::try_from(file).map_err(failed)?;
        let is_pad = device
            .supported_keys()
            .is_some_and(|keys| keys.contains(KeyCode(KEY_FIRST)))
            && device.supported_absolute_axes().is_some_and(|axes| {
                axes.contains(AbsoluteAxisCode::ABS_X) && axes.contains(AbsoluteAxisCode::ABS_Y)
            });
        if !is_pad {
            return Err(Unavailable::UnknownName {
                given: format!("{KEY}:{}", path.display()),
                mend: "this is another input device; `snapin devices` lists the gamepads"
                    .to_owned(),
            });
        }
        let mut ranges = [None; Axis::ALL.len()];
        for (axis, info) in device.get_absinfo().map_err(failed)? {
            let known = Axis::ALL.iter().zip(&mut ranges);
            for (_, range) in known.filter(|(known, _)| known.code() == axis.0) {
                *range = Some(Range {
                    min: info.minimum(),
                    max: info.maximum(),
                    flat: info.flat(),
                });
            }
        }
        Ok(Self {
            device,
            shape: Shape::new(ranges),
            effect: None,
        })
    }

    /// Does the pad know rumble? The number of effects it holds does not say which.
    pub(super) fn can_rumble(&self) -> bool {
        let known = self.device.supported_ff();
        known.is_some_and(|effects| effects.contains(FFEffectCode::FF_RUMBLE))
    }
}

impl Port for Pad {
    /// Asks for the state rather than following events: a queue that overflowed cannot mislead then.
    fn snapshot(&mut self) -> io::Result<Snapshot> {
        let mut now = Snapshot::default();
        let states = self.device.get_abs_state()?;
        for (value, axis) in now.axes.iter_mut().zip(Axis::ALL) {
            *value = states
                .get(usize::from(axis.code()))
                .map_or(0, |state| state.value);
        }
        let pressed = self.device.get_key_state()?;
        for code in KEY_FIRST..=KEY_LAST {
            let bit = u32::from(pressed.contains(KeyCode(code)));
            now.keys |= bit << (code - KEY_FIRST);
        }
        now.cross = [CROSS_LEFT, CROSS_RIGHT].map(|code| pressed.contains(KeyCode(code)));
        Ok(now)
    }

    fn play(&mut self, strength: u16, length_ms: u16) -> io::Result<()> {
        let data = FFEffectData {
            direction: 0,
            trigger: FFTrigger::default(),
            replay: FFReplay {
                length: length_ms,
                delay: 0,
            },
            kind: FFEffectKind::Rumble {
                strong_magnitude: strength,
                weak_magnitude: strength,
            },
        };
        let effect = match &mut self.effect {
            Some(effect) => {
                effect.update(data)?;
                effect
            }
            none => none.insert(self.device.upload_ff_effect(data)?),
        };
        if effect.id() >= EFFECTS_MAX {
            return Err(io::Error::other("the kernel gave the effect no number"));
        }
        effect.play(1)
    }

    fn stop(&mut self) -> io::Result<()> {
        match &mut self.effect {
            Some(effect) => effect.stop(),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;

//! What the axes and keys of a pad mean: from the values of the kernel's input system to deflections.

use glam::DVec3;

use crate::driver::rate::{self, Input};

/// Axes that are looked at, in the order of the arrays here. The values are the kernel's codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    X = 0x00,
    Y = 0x01,
    Z = 0x02,
    Rx = 0x03,
    Ry = 0x04,
    Rz = 0x05,
    Gas = 0x09,
    Brake = 0x0a,
    CrossX = 0x10,
}

impl Axis {
    pub(super) const ALL: [Self; 9] = [
        Self::X,
        Self::Y,
        Self::Z,
        Self::Rx,
        Self::Ry,
        Self::Rz,
        Self::Gas,
        Self::Brake,
        Self::CrossX,
    ];

    /// The kernel's code.
    pub(super) const fn code(self) -> u16 {
        self as u16
    }

    fn index(self) -> usize {
        Self::ALL.iter().position(|axis| *axis == self).unwrap_or(0)
    }
}

/// Codes of the keys: the first face button, which every gamepad has, and the last that becomes a bit.
pub(super) const KEY_FIRST: u16 = 0x130;
pub(super) const KEY_LAST: u16 = 0x13e;

/// Bits of the lower triggers, where these are keys.
const TRIGGER_LEFT: u32 = 1 << (0x138 - KEY_FIRST);
const TRIGGER_RIGHT: u32 = 1 << (0x139 - KEY_FIRST);

/// Codes of the cross, where it is keys.
pub(super) const CROSS_LEFT: u16 = 0x222;
pub(super) const CROSS_RIGHT: u16 = 0x223;

/// Dead zone of a stick as a share of its way, where the kernel states no larger one: sticks rest off their middle.
const DEAD: f64 = 0.1;

/// What the kernel says of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Range {
    pub(super) min: i32,
    pub(super) max: i32,
    /// Half the dead zone.
    pub(super) flat: i32,
}

impl Range {
    /// Deflection from the middle, in [-1, 1].
    fn stick(self, value: i32) -> f64 {
        let [min, max, flat, value] = self.numbers(value);
        let half = 0.5 * (max - min);
        rate::share(value - 0.5 * (max + min), half, flat.max(DEAD * half))
    }

    /// Deflection from the lower end, in [0, 1].
    fn trigger(self, value: i32) -> f64 {
        let [min, max, flat, value] = self.numbers(value);
        let way = max - min;
        rate::share((value - min).max(0.0), way, flat.max(DEAD * way))
    }

    /// In 64 bits: differences of absurd ranges overflow in 32.
    fn numbers(self, value: i32) -> [f64; 4] {
        [self.min, self.max, self.flat, value].map(f64::from)
    }
}

/// The values of a pad at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Snapshot {
    /// In the order of [`Axis::ALL`].
    pub(super) axes: [i32; Axis::ALL.len()],
    /// Keys from [`KEY_FIRST`] on, one bit each.
    pub(super) keys: u32,
    /// Is the cross pressed to the left, to the right, where it is keys?
    pub(super) cross: [bool; 2],
}

/// Which axes a pad has, and so what they mean.
///
/// Two habits are found. With Rx and Ry these are the right stick, and Z and Rz the triggers; without, Z and Rz are
/// the right stick, and the triggers are brake and gas. Where a pad has no axes for triggers, its keys are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    ranges: [Option<Range>; Axis::ALL.len()],
}

impl Shape {
    /// From the range of each axis that the pad has, in the order of [`Axis::ALL`].
    pub(super) fn new(ranges: [Option<Range>; Axis::ALL.len()]) -> Self {
        Self { ranges }
    }

    fn range(&self, axis: Axis) -> Option<Range> {
        self.ranges.get(axis.index()).copied().flatten()
    }

    fn has(&self, axes: [Axis; 2]) -> bool {
        axes.iter().all(|axis| self.range(*axis).is_some())
    }

    /// Deflections and buttons: x right, y away, z up.
    pub(super) fn input(&self, now: &Snapshot) -> Input {
        let value = |axis: Axis| now.axes.get(axis.index()).copied().unwrap_or(0);
        let stick = |axis: Axis| self.range(axis).map_or(0.0, |r| r.stick(value(axis)));
        let trigger = |axis: Axis| self.range(axis).map_or(0.0, |r| r.trigger(value(axis)));
        let key = |bit: u32| f64::from(u8::from(now.keys & bit != 0));

        let has_second_stick = self.has([Axis::Rx, Axis::Ry]);
        let (across, along) = if has_second_stick {
            (stick(Axis::Rx), stick(Axis::Ry))
        } else {
            (stick(Axis::Z), stick(Axis::Rz))
        };
        let (down, up) = if has_second_stick && self.has([Axis::Z, Axis::Rz]) {
            (trigger(Axis::Z), trigger(Axis::Rz))
        } else if self.has([Axis::Brake, Axis::Gas]) {
            (trigger(Axis::Brake), trigger(Axis::Gas))
        } else {
            (key(TRIGGER_LEFT), key(TRIGGER_RIGHT))
        };
        let [left, right] = now.cross.map(|pressed| f64::from(u8::from(pressed)));
        let roll = (stick(Axis::CrossX) + right - left).clamp(-1.0, 1.0);
        Input {
            // The kernel counts sticks down and to the user.
            linear: DVec3::new(stick(Axis::X), -stick(Axis::Y), up - down),
            angular: DVec3::new(along, roll, -across),
            buttons: now.keys,
        }
    }
}

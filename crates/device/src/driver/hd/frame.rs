//! What happens in a frame: the scheduler of the maker's library calls it a thousand times a second on its own
//! thread, and it neither waits nor allocates. All it shares with the link are two newest-value boxes.

#![allow(unsafe_code, reason = "the scheduler is C and calls back")]

use std::ffi::{c_uint, c_void};
use std::time::Instant;

use triple_buffer::{Input, Output};

use super::api::{Device, number};
use crate::safety::Watchdog;

/// The callback's answer: call again.
const CONTINUE: c_uint = 1;

/// Frames between two looks at the calibration.
const CALIBRATION_EVERY: u64 = 100;

/// Newest of what the link wants.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    /// N.
    pub(super) force: [f64; 3],
    /// N mm, as the library takes it.
    pub(super) torque: [f64; 3],
    pub(super) at: Instant,
    /// Counted up to have the forces switched on again.
    pub(super) switch_on: u32,
    /// The end: zero force from now on.
    pub(super) is_leaving: bool,
}

/// Newest of what a frame has seen, in the library's units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Frames so far; 0 before the first.
    pub(super) frame: u64,
    /// When it began; `None` before the first.
    pub(super) at: Option<Instant>,
    /// Column by column, mm.
    pub(super) transform: [f64; 16],
    /// mm/s.
    pub(super) velocity: [f64; 3],
    pub(super) buttons: u32,
    /// Is the stylus in its well?
    pub(super) is_in_inkwell: bool,
    pub(super) calibration: u32,
    /// Frames that have rendered nothing because the link is leaving.
    pub(super) leaving: u32,
    /// Errors so far of the functions' arguments (0x01..), of the force (0x02..), of the device and all others.
    pub(super) errors: [Errors; 3],
    /// Is a torque rendered?
    pub(super) has_torque: bool,
}

/// Errors of one kind.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    pub(super) count: u64,
    /// The last one's number.
    pub(super) last: u32,
}

/// Places in [`Seen::errors`].
pub(super) const ARGUMENTS: usize = 0;
pub(super) const FORCE: usize = 1;
pub(super) const DEVICE: usize = 2;

impl Seen {
    pub(super) const NOTHING: Self = Self {
        frame: 0,
        at: None,
        transform: [f64::NAN; 16],
        velocity: [f64::NAN; 3],
        buttons: 0,
        is_in_inkwell: false,
        calibration: number::CALIBRATION_OK,
        leaving: 0,
        errors: [Errors { count: 0, last: 0 }; 3],
        has_torque: false,
    };
}

/// The scheduler's end of the boxes.
#[derive(Debug)]
pub(super) struct Frames {
    pub(super) device: Device,
    pub(super) wanted: Output<Wanted>,
    pub(super) seen: Input<Seen>,
    /// What the last frame saw.
    pub(super) newest: Seen,
    /// Style of calibration, in the library's bits.
    pub(super) style: u32,
    pub(super) switched_on: u32,
}

impl Frames {
    fn run(&mut self) {
        let device = self.device;
        let newest = &mut self.newest;
        let is_calibration_due = newest.frame.is_multiple_of(CALIBRATION_EVERY);
        newest.frame += 1;

        if newest.at.is_none() {
            // The current device may be a matter of the thread.
            device.make_current();
        }
        newest.at = Some(Instant::now());
        device.begin_frame();
        newest.transform = device.doubles(number::TRANSFORM);
        newest.velocity = device.doubles(number::VELOCITY);
        newest.buttons = device.integer(number::BUTTONS).cast_unsigned();
        if self.style & number::STYLE_INKWELL != 0 {
            // The switch is closed while the stylus is out.
            newest.is_in_inkwell = !device.boolean(number::INKWELL_SWITCH);
        }
        if is_calibration_due {
            newest.calibration = device.check_calibration();
        }
        // Only now, so that what is wanted is the newest also where the library took long so far.
        let wanted = *self.wanted.read();
        let (force, torque) = rendered(&wanted);
        device.set(number::FORCE, force);
        if newest.has_torque {
            device.set(number::TORQUE, torque);
        }
        device.end_frame();

        if newest.calibration == number::CALIBRATION_NEEDS_UPDATE
            && is_calibration_due
            && force == [0.0; 3]
        {
            device.update_calibration(self.style);
        }
        if self.switched_on != wanted.switch_on {
            self.switched_on = wanted.switch_on;
            device.switch_on(number::FORCE_OUTPUT);
        }
        newest.leaving += u32::from(wanted.is_leaving);
        self.count_errors();
        self.seen.write(self.newest);
    }

    fn count_errors(&mut self) {
        for code in self.device.errors() {
            let kind = match code >> 8 {
                1 => ARGUMENTS,
                2 => FORCE,
                _ => DEVICE,
            };
            let errors = &mut self.newest.errors[kind];
            errors.count += 1;
            errors.last = code;
            if kind == ARGUMENTS {
                // Of what is set and asked, the torque alone is not on every device.
                self.newest.has_torque = false;
            }
        }
    }
}

/// The wrench of this frame: nothing that is not finite, and what the link does not renew fades.
fn rendered(wanted: &Wanted) -> ([f64; 3], [f64; 3]) {
    let gain = Watchdog::for_link().gain_at_age(wanted.at.elapsed().as_secs_f64());
    let (force, torque) = (
        wanted.force.map(|x| gain * x),
        wanted.torque.map(|x| gain * x),
    );
    let is_finite = force.iter().chain(&torque).all(|x| x.is_finite());
    if wanted.is_leaving || !is_finite {
        return ([0.0; 3], [0.0; 3]);
    }
    (force, torque)
}

/// What the scheduler calls.
///
/// # Safety
/// `data` must be a [`Frames`] that nothing else uses.
pub(super) unsafe extern "C" fn frame(data: *mut c_void) -> c_uint {
    // SAFETY: the caller promises it.
    let frames = unsafe { &mut *data.cast::<Frames>() };
    frames.run();
    CONTINUE
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn wanted(force: f64, torque: f64, age: Duration) -> Wanted {
        Wanted {
            force: [force; 3],
            torque: [torque; 3],
            at: Instant::now().checked_sub(age).unwrap(),
            switch_on: 0,
            is_leaving: false,
        }
    }

    #[test]
    fn wrench_that_the_link_does_not_renew_fades_to_zero() {
        let fresh = wanted(2.0, 30.0, Duration::ZERO);
        assert_eq!(rendered(&fresh), ([2.0; 3], [30.0; 3]));
        let ([fading, ..], _) = rendered(&wanted(2.0, 30.0, Duration::from_millis(35)));
        assert!(fading < 2.0);
        let stale = wanted(2.0, 30.0, Duration::from_millis(51));
        assert_eq!(rendered(&stale), ([0.0; 3], [0.0; 3]));
    }

    #[test]
    fn nothing_that_is_not_finite_is_rendered_and_nothing_at_the_end() {
        for bad in [f64::NAN, f64::INFINITY] {
            for numbers in [(bad, 0.0), (0.0, bad)] {
                let wanted = wanted(numbers.0, numbers.1, Duration::ZERO);
                assert_eq!(rendered(&wanted), ([0.0; 3], [0.0; 3]));
            }
        }
        let leaving = Wanted {
            is_leaving: true,
            ..wanted(2.0, 30.0, Duration::ZERO)
        };
        assert_eq!(rendered(&leaving), ([0.0; 3], [0.0; 3]));
    }
}

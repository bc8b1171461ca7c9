//! One device, from its scheduler's start to its stop.

#![allow(
    unsafe_code,
    reason = "the scheduler is handed a pointer and gives it back"
)]

use std::ffi::c_ulong;
use std::time::{Duration, Instant};

use glam::{DMat3, DVec3};
use triple_buffer::{Input, Output, triple_buffer};

use super::api::{Device, number};
use super::frame::{ARGUMENTS, DEVICE, FORCE, Frames, Seen, Wanted, frame};
use super::limits::Stated;
use crate::driver::library::Lease;
use crate::driver::library::guard::{
    AT_REST, Gate, Notices, REST_S, allowed, nonsense, sound_frame,
};
use crate::driver::link::{Connected, STALE_S};
use crate::driver::{Identity, Link, Unavailable};
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandPresence, HandleState, Limits, Readiness};
use crate::velocity::VelocityEstimator;
use crate::wrench::Wrench;

/// Longest wait for a frame in one exchange.
const FRAME_WAIT: Duration = Duration::from_millis(5);

/// Time between two looks whether there is a new frame; the scheduler's period is 1 ms.
const LOOK_EVERY: Duration = Duration::from_micros(200);

/// Longest wait for the last frames with zero force, at the end.
const LEAVE_WAIT: Duration = Duration::from_millis(50);

/// Name of the device: model and serial number.
pub(super) fn name(device: &Device) -> String {
    let known = |text: String| {
        if text.is_empty() {
            "unknown".to_owned()
        } else {
            text
        }
    };
    format!(
        "3D Systems {}, serial {}",
        known(device.string(number::MODEL)),
        known(device.string(number::SERIAL_NUMBER))
    )
}

/// Makes the device ready, from an initialised one, and starts the scheduler; whatever happens, it is disabled in
/// the end.
pub(super) fn start(device: Device, lease: Lease, version: &str) -> Result<Connected, Unavailable> {
    let name = name(&device);
    let (limits, more) = Stated::by(&device).limits();
    let mut notes = vec![format!("OpenHaptics {version}")];
    notes.extend(more);
    let style = device.integer(number::CALIBRATION_STYLE).cast_unsigned();
    if device.check_calibration() == number::CALIBRATION_NEEDS_UPDATE {
        device.update_calibration(style);
    }
    for what in [
        number::FORCE_CLAMPING,
        number::FORCE_RAMPING,
        number::FORCE_OUTPUT,
    ] {
        device.switch_on(what);
    }
    // What the library could not say or switch on so far: the frames will tell whether it matters.
    notes.extend(
        device
            .errors()
            .map(|code| format!("on opening: {}", device.failure(code))),
    );

    let scheduled = Scheduled::start(device, style, limits.peak_torque > 0.0);
    let started: Vec<u32> = device.errors().collect();
    let mut stylus = Stylus {
        device,
        lease: Some(lease),
        scheduled,
        name: name.clone(),
        limits,
        gate: Gate::default(),
        notices: Notices::default(),
        heard: Seen {
            has_torque: limits.peak_torque > 0.0,
            ..Seen::NOTHING
        },
        heard_at: Instant::now(),
        tripped: None,
        begun: Instant::now(),
        velocity: VelocityEstimator::default(),
    };
    if let Some(code) = started.first() {
        stylus.close();
        return Err(Unavailable::Failed {
            reason: format!(
                "the scheduler of {name} does not start: {}",
                device.failure(*code)
            ),
        });
    }
    let identity = Identity {
        name,
        limits,
        notes,
    };
    Ok((identity, Box::new(stylus)))
}

/// The running scheduler, and the link's end of the boxes.
struct Scheduled {
    number: c_ulong,
    /// The scheduler's; taken back when it has stopped.
    frames: *mut Frames,
    wanted: Input<Wanted>,
    seen: Output<Seen>,
    switch_on: u32,
}

impl Scheduled {
    fn start(device: Device, style: u32, has_torque: bool) -> Self {
        let (wanted, wanted_out) = triple_buffer(&Wanted {
            force: [0.0; 3],
            torque: [0.0; 3],
            at: Instant::now(),
            switch_on: 0,
            is_leaving: false,
        });
        let (seen_in, seen) = triple_buffer(&Seen::NOTHING);
        let frames = Box::into_raw(Box::new(Frames {
            device,
            wanted: wanted_out,
            seen: seen_in,
            newest: Seen {
                has_torque,
                ..Seen::NOTHING
            },
            style,
            switched_on: 0,
        }));
        // SAFETY: the callback takes frames, and `stop` takes them back only when the scheduler has stopped.
        let number = unsafe { device.schedule(frame, frames.cast()) };
        device.start_scheduler();
        Self {
            number,
            frames,
            wanted,
            seen,
            switch_on: 0,
        }
    }

    fn send(&mut self, wrench: &Wrench, is_leaving: bool) {
        self.wanted.write(Wanted {
            force: wrench.force.to_array(),
            torque: (wrench.torque * 1e3).to_array(),
            at: Instant::now(),
            switch_on: self.switch_on,
            is_leaving,
        });
    }

    /// The next frame, or nothing where none comes in time.
    fn next(&mut self) -> Option<Seen> {
        let begun = Instant::now();
        while !self.seen.updated() {
            if begun.elapsed() > FRAME_WAIT {
                return None;
            }
            std::thread::sleep(LOOK_EVERY);
        }
        Some(*self.seen.read())
    }

    /// Zero force in the frames that still come, then none comes any more.
    fn stop(&mut self, device: &Device) {
        let begun = Instant::now();
        let mut has_left = false;
        while !has_left && begun.elapsed() < LEAVE_WAIT {
            self.send(&Wrench::ZERO, true);
            has_left = self.next().is_some_and(|seen| seen.leaving >= 2);
        }
        device.unschedule(self.number);
        device.stop_scheduler();
        if has_left {
            // SAFETY: made by `Box::into_raw`; the scheduler is known to be alive, so it has stopped as it was told.
            drop(unsafe { Box::from_raw(self.frames) });
        }
        // Otherwise a frame may hang somewhere in the library: what it uses stays, for ever.
        self.frames = std::ptr::null_mut();
    }
}

struct Stylus {
    device: Device,
    /// Given back when the device is disabled.
    lease: Option<Lease>,
    scheduled: Scheduled,
    name: String,
    limits: Limits,
    gate: Gate,
    notices: Notices,
    /// The last frame and when it came.
    heard: Seen,
    heard_at: Instant,
    /// When and why the library cut the force.
    tripped: Option<(Instant, &'static str)>,
    begun: Instant,
    /// For turns: what the library says of them comes in axes that are not stated.
    velocity: VelocityEstimator,
}

impl Stylus {
    /// `None` where no frame has come in time but none is overdue.
    fn listen(&mut self) -> Result<Option<HandleState>, DeviceError> {
        let Some(seen) = self.scheduled.next() else {
            let silent_s = self.heard_at.elapsed().as_secs_f64();
            if silent_s <= STALE_S {
                return Ok(None);
            }
            return Err(self.no_answer(format!(
                "the scheduler of the library has not run for {:.0} ms",
                1e3 * silent_s
            )));
        };
        let before = std::mem::replace(&mut self.heard, seen);
        self.heard_at = Instant::now();
        let is_new = |kind: usize| seen.errors[kind].count != before.errors[kind].count;
        let device = self.device;
        let text = |kind: usize| device.failure(seen.errors[kind].last).to_string();
        if is_new(ARGUMENTS) {
            let has_lost_torque = before.has_torque && !seen.has_torque;
            let torque = if has_lost_torque {
                "; no torque is rendered from now on"
            } else {
                ""
            };
            let text = format!("{}{torque}", text(ARGUMENTS));
            self.notices.say("arguments", || text);
        }
        if is_new(DEVICE) {
            return Err(self.no_answer(text(DEVICE)));
        }
        let state = self.state(&seen).filter(HandleState::is_finite);
        let Some(mut state) = state else {
            return Err(nonsense(&self.name));
        };
        if is_new(FORCE) {
            let text = text(FORCE);
            let why = force_error(seen.errors[FORCE].last);
            self.tripped = Some((Instant::now(), why));
            self.notices.say(why, || format!("{why} ({text})"));
        }
        self.recover(state.linear_velocity.length());
        state.readiness = self.readiness(&seen);
        Ok(Some(state))
    }

    /// The handle in SI; `None` where the pose is no pose.
    fn state(&mut self, seen: &Seen) -> Option<HandleState> {
        let m = &seen.transform;
        let column = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]);
        let axes = DMat3::from_cols(column(0), column(4), column(8));
        let pose = sound_frame(column(12) * 1e-3, axes)?;
        let at_s = seen.at?.saturating_duration_since(self.begun).as_secs_f64();
        let (_, angular_velocity) = self.velocity.update(&pose, at_s);
        Some(HandleState {
            pose,
            linear_velocity: DVec3::from_array(seen.velocity) * 1e-3,
            angular_velocity,
            time_s: 0.0,
            buttons: seen.buttons,
            hand: if seen.is_in_inkwell {
                HandPresence::Absent
            } else {
                HandPresence::Unknown
            },
            readiness: Readiness::Ready,
        })
    }

    /// After the library has cut the force: switched on again when the handle has been at rest for a while.
    fn recover(&mut self, speed: f64) {
        if let Some((at, _)) = self.tripped
            && at.elapsed().as_secs_f64() > REST_S
            && speed < AT_REST
        {
            self.tripped = None;
            self.scheduled.switch_on += 1;
        }
    }

    fn readiness(&self, seen: &Seen) -> Readiness {
        if let Some((_, why)) = self.tripped {
            return Readiness::Tripped(why);
        }
        match seen.calibration {
            number::CALIBRATION_OK if seen.is_in_inkwell => {
                Readiness::Waiting("the stylus is in its well")
            }
            number::CALIBRATION_OK => Readiness::Ready,
            number::CALIBRATION_NEEDS_UPDATE => Readiness::Waiting(
                "the device is being calibrated: put the stylus into its well, where it has one",
            ),
            _ => Readiness::Waiting(
                "the device is not calibrated: do it with the maker's setup program",
            ),
        }
    }

    fn no_answer(&self, reason: String) -> DeviceError {
        DeviceError::NoAnswer {
            device: self.name.clone(),
            reason,
        }
    }
}

/// Why the library has cut the force.
fn force_error(code: u32) -> &'static str {
    match code {
        0x0200 => "the device cut the force: the motors are too warm",
        0x0201 => "the device cut the force: it was too large",
        0x0202 => "the device cut the force: it rose too fast",
        0x0203 => "the device cut the force: the handle moved too fast",
        _ => "the device cut the force",
    }
}

impl Link for Stylus {
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError> {
        let answer = allowed(command, self.gate.gain(), &self.limits, &self.name);
        // Also where the command is refused: what was wanted before must not stay.
        let wrench = *answer.as_ref().unwrap_or(&Wrench::ZERO);
        self.scheduled.send(&wrench, false);
        answer?;
        match self.listen() {
            Ok(None) => Ok(None),
            Ok(Some(state)) => {
                self.gate.judge(&Ok(state), Duration::ZERO);
                Ok(Some(state))
            }
            Err(error) => {
                self.gate.shut();
                self.scheduled.send(&Wrench::ZERO, false);
                Err(error)
            }
        }
    }

    fn message(&mut self) -> Option<String> {
        self.notices.next()
    }

    fn close(&mut self) {
        if self.lease.is_none() {
            return;
        }
        self.scheduled.stop(&self.device);
        self.device.switch_off(number::FORCE_OUTPUT);
        self.device.disable();
        self.lease = None;
    }
}

impl Drop for Stylus {
    fn drop(&mut self) {
        self.close();
    }
}

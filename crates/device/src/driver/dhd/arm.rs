//! One device, from opening to the brakes.

use std::time::Instant;

use glam::{DMat3, DVec3};

use super::api::{Device, Failure, Status};
use crate::driver::library::Lease;
use crate::driver::library::guard::{
    AT_REST, Gate, Notices, Pace, REST_S, allowed, nonsense, sound_frame,
};
use crate::driver::link::Connected;
use crate::driver::{Identity, Link, Unavailable};
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandPresence, HandleState, Limits, Readiness};

/// Shortest time between two exchanges, s. The loop's period is 1 ms; the half of it keeps the delay short.
const PACE_S: f64 = 5e-4;

/// Exchanges between two looks at the status.
const STATUS_EVERY: u64 = 10;

/// Time without a force after which the device cuts it, in the library's unit of 125 us: 20 ms.
const WATCHDOG: u8 = 160;

/// Why the forces are off, by the library's number.
const BUTTON: i32 = 1;
const DEADMAN: i32 = 6;

/// Name of the device: model and serial number.
pub(super) fn name(device: &Device) -> String {
    let model = device.system_name().unwrap_or_else(|| "device".to_owned());
    match device.serial_number() {
        Some(number) => format!("Force Dimension {model}, serial {number}"),
        None => format!("Force Dimension {model}"),
    }
}

/// The limits of a model, small ones where it is not known, and a note then.
fn limits(device: &Device) -> (Limits, Option<String>) {
    let number = device.system_type().unwrap_or(0);
    // (continuous and peak force N, torque N m, half extents m, stiffness N/m, damping N s/m)
    let omega = DVec3::new(0.055, 0.080, 0.080);
    let (continuous, peak, torque, half_extents, stiffness, damping) = match number {
        32..=37 => (12.0, 12.0, 0.0, omega, Some(5000.0), Some(30.0)),
        104..=107 => (
            12.0,
            12.0,
            0.2,
            DVec3::splat(0.065),
            Some(4000.0),
            Some(30.0),
        ),
        60 => (4.0, 8.0, 0.0, DVec3::splat(0.04), Some(3000.0), Some(20.0)),
        _ => (4.0, 4.0, 0.1, DVec3::splat(0.05), None, None),
    };
    let limits = Limits {
        workspace_half_extents: half_extents,
        continuous_force: continuous,
        peak_force: peak,
        peak_torque: if device.has_active_wrist() {
            torque
        } else {
            0.0
        },
        force_resolution: 0.0,
        rotation_resolution: 0.0,
        max_stiffness: stiffness,
        max_damping: damping,
        ..Limits::virtuose_6d()
    };
    let note = (stiffness.is_none()).then(|| {
        format!("the figures of this model (type {number}) are not known here: the force is held to {peak} N")
    });
    (limits, note)
}

/// Makes the device ready, from an opened one; whatever happens, it is closed in the end.
pub(super) fn start(device: Device, lease: Lease, version: &str) -> Result<Connected, Unavailable> {
    let name = name(&device);
    let (limits, note) = limits(&device);
    let mut arm = Arm {
        has_torque: limits.peak_torque > 0.0,
        has_wrist: device.has_wrist(),
        device,
        lease: Some(lease),
        name: name.clone(),
        limits,
        pace: Pace::new(PACE_S),
        notices: Notices::default(),
        gate: Gate::default(),
        exchanges: 0,
        readiness: Readiness::Waiting("the forces are being switched on"),
        hand: HandPresence::Unknown,
        enabled_at: None,
        cut_at: None,
        speed: f64::INFINITY,
    };
    let mut notes = vec![format!("Force Dimension SDK {version}")];
    notes.extend(note);
    match arm.set_up() {
        Ok(more) => notes.extend(more),
        Err(failure) => {
            arm.close();
            return Err(Unavailable::Failed {
                reason: format!("{name} could not be made ready: {failure}"),
            });
        }
    }
    let identity = Identity {
        name,
        limits,
        notes,
    };
    Ok((identity, Box::new(arm)))
}

struct Arm {
    device: Device,
    /// Given back when the device is closed.
    lease: Option<Lease>,
    name: String,
    limits: Limits,
    has_wrist: bool,
    has_torque: bool,
    pace: Pace,
    notices: Notices,
    gate: Gate,
    exchanges: u64,
    readiness: Readiness,
    hand: HandPresence,
    /// When the forces were last switched on; never before the device is calibrated.
    enabled_at: Option<Instant>,
    /// Since when the forces are off, after they were switched on.
    cut_at: Option<Instant>,
    /// Of the handle at the last sample, m/s.
    speed: f64,
}

impl Arm {
    /// Watchdog and gravity first; the forces only where the device is calibrated. Returns notes for the user.
    fn set_up(&mut self) -> Result<Vec<String>, Failure> {
        let status = self.device.status()?;
        let mut notes = Vec::new();
        if let Err(failure) = self.device.set_watchdog(WATCHDOG) {
            notes.push(format!(
                "the device's own watchdog is not set ({failure}): should this program hang, the last force stays"
            ));
        }
        if self.device.velocity_threshold() == Some(0) {
            notes.push(
                "the device's own limit of velocity is switched off; another program did that, \
                 it comes back when the device is switched off and on"
                    .to_owned(),
            );
        }
        match self.device.compensate_gravity() {
            Some(Ok(())) => {}
            Some(Err(failure)) => {
                notes.push(format!("the weight of the handle is not held ({failure})"))
            }
            None => {
                notes.push("the weight of the handle is not held: the library cannot".to_owned())
            }
        }
        self.set_wrench([0.0; 6])?;
        if status.is_calibrated {
            self.enable()?;
        } else {
            notes.push(format!(
                "{}; no force before that",
                readiness_text(Readiness::Waiting(UNCALIBRATED))
            ));
        }
        Ok(notes)
    }

    fn enable(&mut self) -> Result<(), Failure> {
        self.enabled_at = Some(Instant::now());
        self.device.enable_force(true)
    }

    fn set_wrench(&self, wrench: [f64; 6]) -> Result<(), Failure> {
        if self.has_torque
            && let Some(answer) = self.device.set_wrench(wrench)
        {
            return answer;
        }
        let [x, y, z, ..] = wrench;
        self.device.set_force([x, y, z])
    }

    fn render_and_read(&mut self, command: &Command) -> Result<HandleState, DeviceError> {
        let wrench = allowed(command, self.gate.gain(), &self.limits, &self.name)?;
        self.set_wrench(wrench.to_array())
            .map_err(|failure| self.failed(&failure))?;
        let state = self.read().map_err(|failure| self.failed(&failure))?;
        state
            .filter(HandleState::is_finite)
            .ok_or_else(|| nonsense(&self.name))
    }

    /// `None` where the pose is no pose.
    fn read(&mut self) -> Result<Option<HandleState>, Failure> {
        let (position, rows) = self.device.pose()?;
        let linear_velocity = DVec3::from_array(self.device.linear_velocity()?);
        let angular_velocity = if self.has_wrist {
            self.device
                .angular_velocity()
                .transpose()?
                .unwrap_or_default()
        } else {
            [0.0; 3]
        };
        let buttons = self.device.buttons();
        let speed = linear_velocity.length();
        self.speed = if speed.is_finite() {
            speed
        } else {
            f64::INFINITY
        };
        if self.exchanges.is_multiple_of(STATUS_EVERY) {
            self.read_status()?;
        }
        self.exchanges += 1;
        // Row by row is the transposed of what is stored column by column.
        let axes = DMat3::from_cols_array(&rows).transpose();
        let pose = sound_frame(DVec3::from_array(position), axes);
        Ok(pose.map(|pose| HandleState {
            pose,
            linear_velocity,
            angular_velocity: DVec3::from_array(angular_velocity),
            time_s: 0.0,
            buttons,
            hand: self.hand,
            readiness: self.readiness,
        }))
    }

    fn read_status(&mut self) -> Result<(), Failure> {
        let status = self.device.status()?;
        self.hand = if !status.has_force && status.force_off_cause == DEADMAN {
            HandPresence::Absent
        } else {
            HandPresence::Unknown
        };
        self.readiness = readiness(&status, self.enabled_at.is_some());
        if let Readiness::Tripped(why) = self.readiness {
            self.notices.say(why, || why.to_owned());
        }
        if status.has_force || self.enabled_at.is_none() {
            self.cut_at = None;
        } else {
            self.cut_at.get_or_insert_with(Instant::now);
        }
        self.enable_again(&status)
    }

    /// Switches the forces on where the device is calibrated meanwhile, or has cut them a while ago, and rests.
    fn enable_again(&mut self, status: &Status) -> Result<(), Failure> {
        let is_usable = status.has_power && status.is_calibrated && !status.has_error;
        let is_due = [self.enabled_at, self.cut_at]
            .iter()
            .flatten()
            .all(|at| at.elapsed().as_secs_f64() > REST_S);
        let is_wanted = self.enabled_at.is_none() || status.force_off_cause != BUTTON;
        if is_usable && !status.has_force && is_due && is_wanted && self.speed < AT_REST {
            self.set_wrench([0.0; 6])?;
            self.enable()?;
        }
        Ok(())
    }

    fn failed(&self, failure: &Failure) -> DeviceError {
        DeviceError::NoAnswer {
            device: self.name.clone(),
            reason: failure.to_string(),
        }
    }
}

const UNCALIBRATED: &str =
    "the device is not calibrated: put the handle into its calibration position";

fn readiness_text(readiness: Readiness) -> &'static str {
    match readiness {
        Readiness::Ready => "ready",
        Readiness::Waiting(why) | Readiness::Tripped(why) => why,
    }
}

/// What the status says; `was_enabled`: the forces were switched on before.
fn readiness(status: &Status, was_enabled: bool) -> Readiness {
    if !status.has_power {
        Readiness::Waiting("the device has no power")
    } else if status.has_error {
        Readiness::Tripped("the device reports an error: switch it off and on")
    } else if !status.is_calibrated {
        Readiness::Waiting(UNCALIBRATED)
    } else if status.has_force {
        Readiness::Ready
    } else if !was_enabled {
        Readiness::Waiting("the forces are being switched on")
    } else {
        match status.force_off_cause {
            0 => Readiness::Waiting("the forces are being switched on"),
            BUTTON => {
                Readiness::Waiting("the forces are off: press the force button of the device")
            }
            2 => Readiness::Tripped("the device cut the force: the handle moved too fast"),
            3 => Readiness::Tripped("the device cut the force: no command came for 20 ms"),
            4 => Readiness::Tripped("the forces were switched off by software"),
            5 => Readiness::Tripped("the device cut the force: the USB was interrupted"),
            DEADMAN => Readiness::Waiting("no hand holds the handle"),
            _ => {
                Readiness::Tripped("the device cut the force, for a reason that is not known here")
            }
        }
    }
}

impl Link for Arm {
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError> {
        self.pace.wait();
        let begun = Instant::now();
        let answer = self.render_and_read(command);
        self.gate.judge(&answer, begun.elapsed());
        answer.map(Some)
    }

    fn message(&mut self) -> Option<String> {
        self.notices.next()
    }

    fn close(&mut self) {
        if self.lease.is_none() {
            return;
        }
        // Whatever fails here, the rest is done. The brakes let the handle sink slowly.
        let _force = self.set_wrench([0.0; 6]);
        self.device.brake();
        self.device.stop();
        self.device.close();
        self.lease = None;
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        self.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READY: Status = Status {
        has_power: true,
        is_calibrated: true,
        has_force: true,
        has_error: false,
        force_off_cause: 0,
    };

    #[test]
    fn device_is_ready_only_with_power_calibration_and_force() {
        assert_eq!(readiness(&READY, true), Readiness::Ready);
        let without = [
            Status {
                has_power: false,
                ..READY
            },
            Status {
                is_calibrated: false,
                ..READY
            },
            Status {
                has_force: false,
                ..READY
            },
            Status {
                has_error: true,
                ..READY
            },
            Status::default(),
        ];
        for status in without {
            assert_ne!(readiness(&status, true), Readiness::Ready, "{status:?}");
        }
    }

    #[test]
    fn every_cause_of_a_cut_force_is_told_and_none_counts_as_ready() {
        let mut texts = Vec::new();
        for force_off_cause in -1..=20 {
            let status = Status {
                has_force: false,
                force_off_cause,
                ..READY
            };
            let said = readiness(&status, true);
            assert_ne!(said, Readiness::Ready);
            texts.push(readiness_text(said));
        }
        texts.dedup();
        assert_eq!(texts.len(), 9);
    }
}

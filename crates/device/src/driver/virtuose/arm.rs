//! One arm, from power on to closing.

use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};

use super::api::{Connection, Failure};
use crate::driver::library::Lease;
use crate::driver::library::guard::{Gate, Notices, Pace, allowed, nonsense, sound_pose};
use crate::driver::link::Connected;
use crate::driver::{Identity, Link, Unavailable};
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandPresence, HandleState, Limits, Readiness};

/// The controller's own period, s.
const TIME_STEP_S: f64 = 1e-3;

/// Exchanges between two looks at what changes slowly: power, emergency stop, alarms, buttons.
const STATUS_EVERY: u64 = 10;

/// Time between two tries to switch the motors on again, s.
const POWER_RETRY_S: f64 = 1.0;

/// Buttons that are asked for.
const BUTTONS: i32 = 3;

/// Shift (clutch) in all directions, with no force meanwhile.
const INDEXING_ALL_WITHOUT_FORCE: i32 = 3;

/// Force in, position out.
const COMMAND_IMPEDANCE: i32 = 3;

const NO_SHIFT: [f32; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// What the controller warns of, by its bit.
const ALARMS: [(u32, &str); 5] = [
    (
        0x4000,
        "the motors are too hot, the device weakens the force by itself",
    ),
    (0x8000, "the force is beyond what the motors give"),
    (0x2_0000, "the controller's loop is overrun"),
    (0x4_0000, "the controller reports an error of position"),
    (0x10_0000, "the battery of the handle is low"),
];

/// What an arm is.
#[derive(Debug)]
pub(super) struct Model {
    /// Model and serial number.
    pub(super) name: String,
    limits: Limits,
    note: Option<String>,
}

/// The model of the arm at the other end, with its limits where they are known and small ones where not.
pub(super) fn model(connection: &Connection) -> Model {
    let (number, serial) = connection.device_id().unwrap_or((0, 0));
    let (title, has_torque) = match number {
        1 => ("Virtuose 3D", false),
        2 => ("Virtuose 3D Desktop", false),
        3 => ("Virtuose 6D", true),
        4 => ("Virtuose 6D Desktop", true),
        5 => ("Virtuose 7D", true),
        8 => ("Inca 6D", true),
        9 => ("Inca 3D", false),
        _ => ("Virtuose of another model", true),
    };
    let controller = match connection.controller_version() {
        Some((major, minor)) => format!(", controller {major}.{minor:02}"),
        None => String::new(),
    };
    let name = format!("Haption {title}, serial {serial}{controller}");
    if number == 3 {
        return Model {
            name,
            limits: Limits::virtuose_6d(),
            note: None,
        };
    }
    let limits = Limits {
        workspace_half_extents: DVec3::splat(0.1),
        continuous_force: 5.0,
        peak_force: 5.0,
        peak_torque: if has_torque { 0.5 } else { 0.0 },
        force_resolution: 0.0,
        rotation_resolution: 0.0,
        ..Limits::virtuose_6d()
    };
    Model {
        name,
        limits,
        note: Some(format!(
            "the figures of this model are not known here: the force is held to {} N, the torque to {} N m",
            limits.peak_force, limits.peak_torque
        )),
    }
}

/// Makes the arm ready, from an open connection; whatever happens, the connection is closed in the end.
pub(super) fn start(
    connection: Connection,
    lease: Lease,
    version: &str,
    motor_start: Duration,
) -> Result<Connected, Unavailable> {
    let model = model(&connection);
    let mut arm = Arm {
        connection,
        lease: Some(lease),
        name: model.name.clone(),
        limits: model.limits,
        pace: Pace::new(TIME_STEP_S),
        notices: Notices::default(),
        motor_start,
        powered_at: Instant::now(),
        gate: Gate::default(),
        exchanges: 0,
        readiness: Readiness::Waiting("the motors are starting"),
        buttons: 0,
    };
    let mut notes = vec![format!("Virtuose API {version}")];
    notes.extend(model.note);
    match arm.set_up() {
        Ok(more) => notes.extend(more),
        Err(failure) => {
            arm.close();
            return Err(Unavailable::Failed {
                reason: format!("{} could not be made ready: {failure}", model.name),
            });
        }
    }
    let identity = Identity {
        name: model.name,
        limits: model.limits,
        notes,
    };
    Ok((identity, Box::new(arm)))
}

struct Arm {
    connection: Connection,
    /// Given back when the arm is closed.
    lease: Option<Lease>,
    name: String,
    limits: Limits,
    pace: Pace,
    notices: Notices,
    motor_start: Duration,
    powered_at: Instant,
    gate: Gate,
    exchanges: u64,
    readiness: Readiness,
    buttons: u32,
}

impl Arm {
    /// The maker's order: the time step before the command type, power last. Returns notes for the user.
    fn set_up(&mut self) -> Result<Vec<String>, Failure> {
        let c = &self.connection;
        let mut notes = Vec::new();
        c.set_indexing_mode(INDEXING_ALL_WITHOUT_FORCE)?;
        c.set_force_factor(1.0)?;
        c.set_speed_factor(1.0)?;
        c.set_time_step(TIME_STEP_S as f32)?;
        c.set_base_frame(&NO_SHIFT)?;
        c.set_observation_frame(&NO_SHIFT)?;
        c.set_command_type(COMMAND_IMPEDANCE)?;
        let limits = &self.limits;
        match c.saturate_torque(limits.peak_force as f32, limits.peak_torque as f32) {
            Some(Ok(())) => {}
            Some(Err(failure)) => notes.push(format!(
                "the controller's own limit of the force is not set ({failure}); this program's stands"
            )),
            None => notes.push(
                "the library has no virtSaturateTorque; this program's limit of the force stands alone".to_owned(),
            ),
        }
        c.set_force(&[0.0; 6])?;
        if let Some(enabled) = c.enable_force_feedback() {
            enabled?;
        }
        c.set_power_on(true)?;
        self.powered_at = Instant::now();
        Ok(notes)
    }

    fn render_and_read(&mut self, command: &Command) -> Result<HandleState, DeviceError> {
        let wrench = allowed(command, self.gate.gain(), &self.limits, &self.name)?;
        let numbers = wrench.to_array().map(|component| component as f32);
        self.connection
            .set_force(&numbers)
            .map_err(|failure| self.failed(&failure))?;
        let state = self.read().map_err(|failure| self.failed(&failure))?;
        state
            .filter(HandleState::is_finite)
            .ok_or_else(|| nonsense(&self.name))
    }

    /// `None` where the pose is no pose.
    fn read(&mut self) -> Result<Option<HandleState>, Failure> {
        let [x, y, z, qx, qy, qz, qw] = self.connection.position()?;
        let [vx, vy, vz, wx, wy, wz] = self.connection.speed()?;
        let is_held = self.connection.dead_man()?;
        if self.exchanges.is_multiple_of(STATUS_EVERY) {
            self.read_status(is_held)?;
        }
        self.exchanges += 1;
        let pose = sound_pose(DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw));
        Ok(pose.map(|pose| HandleState {
            pose,
            linear_velocity: DVec3::new(vx, vy, vz),
            angular_velocity: DVec3::new(wx, wy, wz),
            time_s: 0.0,
            buttons: self.buttons,
            hand: if is_held {
                HandPresence::Present
            } else {
                HandPresence::Absent
            },
            readiness: self.readiness,
        }))
    }

    fn read_status(&mut self, is_held: bool) -> Result<(), Failure> {
        let c = &self.connection;
        let is_chain_closed = c.emergency_stop()?;
        let failure = c.failure_bits().transpose()?.unwrap_or(0);
        let alarm = c.alarm().transpose()?.unwrap_or(0);
        let has_power = c.power_on().transpose()?.unwrap_or(true);
        let is_shifted = c.is_in_shift_position().transpose()?.unwrap_or(false);
        self.buttons = (0..BUTTONS)
            .filter(|number| c.button(*number) == Some(true))
            .fold(0, |bits, number| bits | 1 << number);
        for (bit, text) in ALARMS {
            if alarm & bit != 0 {
                self.notices.say(text, || text.to_owned());
            }
        }
        self.readiness = if !is_chain_closed {
            self.tripped("the emergency stop is pressed")
        } else if failure != 0 {
            let motors: Vec<String> = (0..32)
                .filter(|motor| failure >> motor & 1 == 1)
                .map(|motor| (motor + 1).to_string())
                .collect();
            let text = "the controller reports a failure of a motor";
            self.notices
                .say("failure", || format!("{text}: {}", motors.join(", ")));
            Readiness::Tripped(text)
        } else if !has_power {
            self.power_on_again(is_held)?;
            Readiness::Waiting(
                "the motors are off; they are switched on while no hand holds the handle",
            )
        } else if self.powered_at.elapsed() < self.motor_start {
            Readiness::Waiting("the motors are starting")
        } else if is_shifted {
            Readiness::Waiting("the handle is being shifted, without force")
        } else {
            Readiness::Ready
        };
        Ok(())
    }

    fn tripped(&mut self, why: &'static str) -> Readiness {
        self.notices.say(why, || why.to_owned());
        Readiness::Tripped(why)
    }

    /// After an emergency stop: the motors start only where nobody holds the handle, so that taking it is deliberate.
    fn power_on_again(&mut self, is_held: bool) -> Result<(), Failure> {
        if !is_held && self.powered_at.elapsed().as_secs_f64() > POWER_RETRY_S {
            self.connection.set_force(&[0.0; 6])?;
            self.connection.set_power_on(true)?;
            self.powered_at = Instant::now();
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
        // Whatever fails here, the rest is done: an arm that is not closed may refuse the next connection.
        let _force = self.connection.set_force(&[0.0; 6]);
        let _power = self.connection.set_power_on(false);
        self.connection.detach();
        self.connection.close();
        self.lease = None;
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        self.close();
    }
}

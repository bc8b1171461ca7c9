//! What a server says of one device, message by message.

use std::collections::VecDeque;
use std::time::Instant;

use glam::{DQuat, DVec3};
use glamx::DPose3;

use crate::driver::vrpn::message::{Kind, Message, Motion, SensorPose, Text, Workspace};
use crate::driver::vrpn::peer::{CONTROL, Event};
use crate::driver::vrpn::place::{Place, VelocityFrom};
use crate::driver::vrpn::velocity::Window;
use crate::driver::vrpn::wire::Timestamp;
use crate::haptic_device::{HandPresence, HandleState, Readiness};
use crate::wrench::rotation_vector;

/// Texts of a server that are told on one link; a server in a loop must not fill the memory.
const TEXTS_MAX: usize = 100;

/// Senders that are listed.
const OFFERED_MAX: usize = 100;

/// Time for which a reported fault counts, s: servers report the fault, but not that it is over.
const FAULT_S: f64 = 1.0;

/// A pose this much older than the newest is a datagram that came late, s; older still, and the server's clock was
/// set.
const LATE_MAX_S: f64 = 1.0;

/// What was heard so far.
#[derive(Debug)]
pub(super) struct Heard {
    /// Name of the device; none until the first that sends poses is taken.
    name: Option<String>,
    sensor: i32,
    velocity_from: VelocityFrom,
    offered: Vec<String>,
    renders_force: bool,
    newest: Option<Pose>,
    /// Has the newest pose not been taken yet?
    is_new: bool,
    poses: u64,
    first_at: Option<Instant>,
    window: Window,
    servers_motion: Option<Motion>,
    buttons: u32,
    force: Option<DVec3>,
    workspace: Option<Workspace>,
    fault: Option<(&'static str, Instant)>,
    told: Vec<String>,
    to_tell: VecDeque<String>,
}

#[derive(Debug, Clone, Copy)]
struct Pose {
    time: Timestamp,
    at: Instant,
    pose: DPose3,
}

impl Heard {
    pub(super) fn new(place: &Place) -> Self {
        Self {
            name: place.sender.clone(),
            sensor: place.sensor,
            velocity_from: place.velocity,
            offered: Vec::new(),
            renders_force: false,
            newest: None,
            is_new: false,
            poses: 0,
            first_at: None,
            window: Window::default(),
            servers_motion: None,
            buttons: 0,
            force: None,
            workspace: None,
            fault: None,
            told: Vec::new(),
            to_tell: VecDeque::new(),
        }
    }

    /// Name of the device, if it is known and the server has it.
    pub(super) fn offered_name(&self) -> Option<&str> {
        let name = self.name.as_deref()?;
        self.offered.iter().any(|o| o == name).then_some(name)
    }

    /// Names of all devices of the server.
    pub(super) fn offered(&self) -> &[String] {
        &self.offered
    }

    /// Does the server know of forces?
    pub(super) fn renders_force(&self) -> bool {
        self.renders_force
    }

    /// Position of the newest pose (m), and when it came.
    pub(super) fn newest(&self) -> Option<(DVec3, Instant)> {
        self.newest
            .map(|newest| (newest.pose.translation, newest.at))
    }

    /// Has a pose come?
    pub(super) fn has_pose(&self) -> bool {
        self.newest.is_some()
    }

    /// Poses in a second, once there were some for a while (s).
    pub(super) fn rate(&self, while_s: f64) -> Option<f64> {
        let elapsed_s = self.newest?.at.duration_since(self.first_at?).as_secs_f64();
        (elapsed_s > while_s).then(|| (self.poses - 1) as f64 / elapsed_s)
    }

    /// Force that the server rendered last (N); none where it reports none.
    pub(super) fn force(&self) -> Option<DVec3> {
        self.force
    }

    /// Forgets the force that was reported. Was there any report?
    pub(super) fn forget_force(&mut self) -> bool {
        self.force.take().is_some()
    }

    /// Half the workspace (m), where the server told one that a device can have.
    pub(super) fn workspace_half_extents(&self) -> Option<DVec3> {
        let workspace = self.workspace?;
        let half = 0.5 * (DVec3::from(workspace.max) - DVec3::from(workspace.min));
        let is_sane = half.to_array().iter().all(|h| (1e-3..=10.0).contains(h));
        is_sane.then_some(half)
    }

    /// The next message for the user.
    pub(super) fn message(&mut self) -> Option<String> {
        self.to_tell.pop_front()
    }

    /// Has something told to the user, once.
    pub(super) fn tell(&mut self, text: String) {
        if self.told.len() < TEXTS_MAX && !self.told.contains(&text) {
            self.told.push(text.clone());
            self.to_tell.push_back(text);
        }
    }

    /// Takes in what came.
    pub(super) fn note(&mut self, event: Event<'_>, now: Instant) {
        match event {
            Event::Sender { name, .. } => {
                let is_known = name == CONTROL || self.offered.iter().any(|o| o == name);
                // A name is printed on a terminal.
                let is_clean = !name.contains(char::is_control);
                if is_clean && !is_known && self.offered.len() < OFFERED_MAX {
                    self.offered.push(name.to_owned());
                }
            }
            Event::Kind { name, .. } => {
                self.renders_force |= name == Kind::Force.name() || name == Kind::ForceField.name();
            }
            Event::Message {
                time,
                sender,
                message,
            } => {
                if self.name.is_none() && matches!(message, Message::PosQuat(_)) {
                    self.name = Some(sender.to_owned());
                }
                if self.name.as_deref() == Some(sender) {
                    self.note_message(time, message, now);
                }
            }
            Event::Udp { .. } | Event::Unknown => {}
        }
    }

    fn note_message(&mut self, time: Timestamp, message: Message, now: Instant) {
        match message {
            Message::PosQuat(pose) if pose.sensor == self.sensor => {
                self.note_pose(time, &pose, now);
            }
            Message::Velocity(motion) if motion.sensor == self.sensor => {
                self.servers_motion = Some(motion);
            }
            Message::ButtonChange { button, state } => self.note_button(button, state),
            Message::ButtonStates(states) => {
                self.buttons = 0;
                for (button, state) in (0..).zip(states) {
                    self.note_button(button, state);
                }
            }
            Message::Force(force) => self.force = Some(DVec3::from(force)),
            Message::ForceError(code) => self.note_fault(code, now),
            Message::Workspace(workspace) => self.workspace = Some(workspace),
            Message::Text(text) => self.note_text(&text),
            _ => {}
        }
    }

    fn note_pose(&mut self, time: Timestamp, sent: &SensorPose, now: Instant) {
        if let Some(newest) = &self.newest {
            let older_s = seconds(newest.time) - seconds(time);
            if older_s > 0.0 && older_s < LATE_MAX_S {
                return;
            }
        }
        let pose = DPose3::from_parts(
            DVec3::from(sent.at.position),
            DQuat::from_array(sent.at.rotation),
        );
        self.window.push(now, seconds(time), &pose);
        self.newest = Some(Pose {
            time,
            at: now,
            pose,
        });
        self.is_new = true;
        self.poses += 1;
        self.first_at.get_or_insert(now);
    }

    fn note_button(&mut self, button: i32, state: i32) {
        let Some(bit) = u32::try_from(button)
            .ok()
            .and_then(|button| 1_u32.checked_shl(button))
        else {
            return;
        };
        if state == 0 {
            self.buttons &= !bit;
        } else {
            self.buttons |= bit;
        }
    }

    fn note_fault(&mut self, code: i32, now: Instant) {
        let reason = match code {
            // Of a surface or an effect, never ours; and nothing is cut.
            0 => return self.tell("the server was given a value out of range".to_owned()),
            1 => "the server's force loop took too long",
            2 => "force, speed or temperature too high, or amplifier off",
            4 => {
                self.fault = None;
                return;
            }
            _ => "a fault that the server does not explain",
        };
        self.fault = Some((reason, now));
        self.tell(format!("the server has cut the force: {reason}"));
    }

    fn note_text(&mut self, text: &Text) {
        if !text.text.trim().is_empty() {
            let weight = match text.severity {
                0 => "",
                1 => "warning: ",
                _ => "error: ",
            };
            self.tell(format!("the server says: {weight}{}", text.text.trim()));
        }
    }

    /// The newest state, once each.
    ///
    /// Numbers are as the server sent them, also where they are no pose: the loop's guard judges, counts and holds.
    pub(super) fn take_state(&mut self, now: Instant) -> Option<HandleState> {
        if !std::mem::take(&mut self.is_new) {
            return None;
        }
        let newest = self.newest?;
        let (linear_velocity, angular_velocity) = self.velocity();
        Some(HandleState {
            pose: newest.pose,
            linear_velocity,
            angular_velocity,
            time_s: 0.0,
            buttons: self.buttons,
            hand: HandPresence::Unknown,
            readiness: self.readiness(now),
        })
    }

    fn readiness(&self, now: Instant) -> Readiness {
        match self.fault {
            Some((reason, at)) if now.duration_since(at).as_secs_f64() < FAULT_S => {
                Readiness::Tripped(reason)
            }
            _ => Readiness::Ready,
        }
    }

    /// Velocity (m/s) and angular velocity (rad/s).
    fn velocity(&self) -> (DVec3, DVec3) {
        let (linear, angular) = self.window.velocity();
        match (self.velocity_from, &self.servers_motion) {
            (VelocityFrom::Server, Some(motion)) => (
                DVec3::from(motion.linear),
                angular_velocity(motion).unwrap_or(angular),
            ),
            _ => (linear, angular),
        }
    }
}

/// Angular velocity out of a turn within an interval; none where either is no such thing.
fn angular_velocity(motion: &Motion) -> Option<DVec3> {
    let turn = DQuat::from_array(motion.rotation);
    let is_turn = (turn.length_squared() - 1.0).abs() < 1e-3;
    let is_interval = motion.interval_s.is_finite() && motion.interval_s > 0.0;
    (is_turn && is_interval).then(|| rotation_vector(turn) / motion.interval_s)
}

fn seconds(time: Timestamp) -> f64 {
    f64::from(time.seconds) + 1e-6 * f64::from(time.micros)
}

#[cfg(test)]
mod tests;

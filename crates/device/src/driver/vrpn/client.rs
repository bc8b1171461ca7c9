//! The client's end: opening, exchanging poses and forces, leaving.

use std::time::{Duration, Instant};

use glam::DVec3;

use super::dial::{call_back, dial};
use super::endpoint::{Broken, Endpoint, Service};
use super::field::Form;
use super::message::{ForceField, Kind, Message};
use super::place::{Place, Way};
use crate::driver::Unavailable;
use crate::driver::link::{Connected, Identity, Link};
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandleState, Limits};
use heard::Heard;

pub(super) use opening::offers;
use opening::{explain, why_silent};

mod heard;
mod opening;

/// What this side sends; the other side ignores what was not described.
const SENT: &[Kind] = &[
    Kind::Ping,
    Kind::SetUpdateRate,
    Kind::RequestWorkspace,
    Kind::ForceField,
];

/// Rate of poses that is asked for, Hz.
const RATE: f64 = 1000.0;

/// Rate of poses below which the user is told, Hz.
const RATE_LOW: f64 = 250.0;

/// Time over which the rate of poses is judged, s.
const RATE_JUDGED_S: f64 = 2.0;

/// Longest wait for greeting, descriptions and the first pose, s.
const GREETING_S: f64 = 2.0;

/// Longest wait for the workspace after the first pose, s: it comes with the next turn of the server's loop.
const WORKSPACE_S: f64 = 0.2;

/// Longest wait for news in one exchange.
const WAIT: Duration = Duration::from_millis(4);

/// Time between two pings, s.
const PING_S: f64 = 1.0;

/// Silence after which the link counts as lost, s: three pings without an answer.
const SILENCE_MAX_S: f64 = 3.0;

/// Age of the newest pose at which the user is told, s.
const OLD_S: f64 = 0.5;

/// Time between two repetitions of "no force", s, in case a datagram was lost.
const REPEAT_OFF_S: f64 = 0.1;

/// Age at which a pose is one that the loop has read, s: its period.
const READ_AFTER_S: f64 = 0.8e-3;

/// Longest wait for the server to report that it renders no force, s.
const LEAVE_FORCE_S: f64 = 0.25;

/// Longest wait for the server to close its side, s.
const LEAVE_CLOSE_S: f64 = 0.1;

/// Force that counts as none when leaving, N.
const NO_FORCE: f64 = 0.05;

/// Share of the peak force that can be held for ever: that of a 3D Systems Touch, 0.88 N of 3.3 N.
const CONTINUOUS_SHARE: f64 = 0.88 / 3.3;

/// Largest damping, N s/m: what chai3d allows a Touch.
const DAMPING: f64 = 4.0;

/// Half the workspace where the server tells none, m: that of a 3D Systems Touch.
const HALF_EXTENTS: DVec3 = DVec3::new(0.08, 0.06, 0.035);

/// Opens a device on a server.
pub(super) fn connect(place: &Place) -> Result<Connected, Unavailable> {
    let made = match place.way {
        Way::Tcp => Endpoint::new(dial(place)?, false),
        Way::Udp => Endpoint::new(call_back(place)?, true),
    };
    let endpoint = made.map_err(|broken| explain(place, &broken, false))?;
    let mut link = VrpnLink::new(endpoint, place);
    link.greet(place)?;
    Ok((link.identity(place), Box::new(link)))
}

/// A link to one device.
struct VrpnLink {
    endpoint: Endpoint,
    heard: Heard,
    form: Form,
    /// The field that was sent last.
    sent: ForceField,
    /// When the force was switched off last, and when that was said last.
    off_at: Instant,
    off_said_at: Instant,
    /// Position of the pose that the loop was given last (m), when, and the one before.
    given: Option<(DVec3, Instant)>,
    given_before: Option<DVec3>,
    pinged_at: Instant,
    is_rate_judged: bool,
}

impl VrpnLink {
    fn new(endpoint: Endpoint, place: &Place) -> Self {
        let now = Instant::now();
        Self {
            endpoint,
            heard: Heard::new(place),
            form: place.form,
            sent: ForceField::OFF,
            off_at: now,
            off_said_at: now,
            given: None,
            given_before: None,
            pinged_at: now,
            is_rate_judged: false,
        }
    }

    /// Takes in what comes, until the device has sent a pose.
    fn greet(&mut self, place: &Place) -> Result<(), Unavailable> {
        let begun = Instant::now();
        let mut is_described = false;
        let mut posed_at = None;
        while begun.elapsed().as_secs_f64() < GREETING_S {
            if let Err(broken) = self.listen(Duration::from_millis(10)) {
                let has_greeted = self.endpoint.version().is_some();
                return Err(explain(place, &broken, has_greeted));
            }
            if let (false, Some(name)) = (is_described, self.heard.offered_name()) {
                self.endpoint.describe(name, SENT);
                self.ask();
                is_described = true;
            }
            if is_described && self.heard.has_pose() {
                let since: Instant = *posed_at.get_or_insert_with(Instant::now);
                let is_told = self.heard.workspace_half_extents().is_some();
                if is_told || since.elapsed().as_secs_f64() > WORKSPACE_S {
                    return Ok(());
                }
            }
        }
        self.endpoint.leave(Duration::from_secs_f64(LEAVE_CLOSE_S));
        Err(why_silent(place, self.endpoint.version(), &self.heard))
    }

    /// What is asked of the server at the beginning.
    fn ask(&mut self) {
        for message in [
            Message::SetUpdateRate(RATE),
            Message::RequestWorkspace,
            Message::Ping,
        ] {
            self.endpoint.send(Service::Reliable, &message);
        }
    }

    fn identity(&self, place: &Place) -> Identity {
        let name = self.heard.offered_name().unwrap_or_default();
        let version = self.endpoint.version().unwrap_or_default();
        let mut notes = vec![format!(
            "VRPN carries forces and no torque: what turns the handle is not felt at {name}"
        )];
        if !self.heard.renders_force() {
            notes.push(format!(
                "the server at {} knows of no force device: nothing will be felt",
                place.server()
            ));
        } else if !place.is_rated {
            notes.push(format!(
                "VRPN tells no limits of a device: {} N and {} N/m are taken for this one (of a 3D Systems Touch \
                 where not given); others are given behind its name, ?force=N&stiffness=N/m",
                place.force, place.stiffness
            ));
        }
        Identity {
            name: format!("{name} (VRPN {version} at {})", place.server()),
            limits: self.limits(place),
            notes,
        }
    }

    fn limits(&self, place: &Place) -> Limits {
        Limits {
            workspace_half_extents: self.heard.workspace_half_extents().unwrap_or(HALF_EXTENTS),
            continuous_force: place.force * CONTINUOUS_SHARE,
            peak_force: place.force,
            peak_torque: 0.0,
            position_resolution: 0.0,
            force_resolution: 0.0,
            rotation_resolution: 0.0,
            max_stiffness: Some(place.stiffness),
            max_rotational_stiffness: None,
            max_damping: Some(DAMPING),
            damping: None,
            coulomb_friction: None,
        }
    }

    /// Sends what waits and takes in what comes.
    fn listen(&mut self, wait: Duration) -> Result<(), Broken> {
        self.endpoint.flush()?;
        let heard = &mut self.heard;
        self.endpoint
            .receive(wait, |event| heard.note(event, Instant::now()))
    }

    fn send_field(&mut self, command: &Command, now: Instant) {
        let Some(position) = self.position_of_command(now) else {
            return;
        };
        if !self.heard.renders_force() {
            return;
        }
        let field = ForceField::of_command(command, position, self.form);
        let message = Message::ForceField(field);
        if field != ForceField::OFF {
            self.endpoint.send(Service::Newest, &message);
        } else if self.sent != ForceField::OFF {
            // On the connection, which loses nothing; and as the last of the datagrams.
            self.endpoint.send(Service::Reliable, &message);
            self.endpoint.send(Service::Newest, &message);
            (self.off_at, self.off_said_at) = (now, now);
        } else {
            // A datagram with a force that is still on its way must not be the last one.
            let since = |at| now.duration_since(at).as_secs_f64();
            if since(self.off_at) < REPEAT_OFF_S || since(self.off_said_at) > REPEAT_OFF_S {
                self.endpoint.send(Service::Newest, &message);
                self.off_said_at = now;
            }
        }
        self.sent = field;
    }

    /// Position of the handle that a command of now was computed at (m): that of the newest pose which the loop has
    /// had a period's time to read.
    fn position_of_command(&self, now: Instant) -> Option<DVec3> {
        let (position, at) = self.given?;
        if now.duration_since(at).as_secs_f64() >= READ_AFTER_S {
            Some(position)
        } else {
            self.given_before.or(Some(position))
        }
    }

    /// Pings, and judges whether anybody is there. `Err`: no.
    fn keep_alive(&mut self, now: Instant) -> Result<(), DeviceError> {
        let since = |at| now.duration_since(at).as_secs_f64();
        if since(self.pinged_at) > PING_S {
            self.endpoint.send(Service::Reliable, &Message::Ping);
            self.pinged_at = now;
        }
        let silence_s = since(self.endpoint.heard_at());
        if silence_s > SILENCE_MAX_S {
            return Err(DeviceError::Gone {
                reason: format!("nothing came from the server for {silence_s:.1} s"),
            });
        }
        if self.heard.newest().is_some_and(|(_, at)| since(at) > OLD_S) {
            self.heard.tell(format!(
                "the server is there, but has sent no pose for {OLD_S} s"
            ));
        }
        if let (false, Some(rate)) = (self.is_rate_judged, self.heard.rate(RATE_JUDGED_S)) {
            self.is_rate_judged = true;
            if rate < RATE_LOW {
                self.heard.tell(format!(
                    "the server sends {rate:.0} poses a second where {RATE} were asked for; \
                     stiff contact will feel rough"
                ));
            }
        }
        Ok(())
    }
}

impl Link for VrpnLink {
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError> {
        let now = Instant::now();
        self.send_field(command, now);
        self.keep_alive(now)?;
        self.listen(WAIT).map_err(|broken| DeviceError::Gone {
            reason: broken.to_string(),
        })?;
        let now = Instant::now();
        let state = self.heard.take_state(now);
        if let Some(state) = &state {
            self.given_before = self.given.map(|(position, _)| position);
            self.given = Some((state.pose.translation, now));
        }
        Ok(state)
    }

    fn message(&mut self) -> Option<String> {
        self.heard.message()
    }

    fn close(&mut self) {
        let begun = Instant::now();
        if self.heard.renders_force() {
            let off = Message::ForceField(ForceField::OFF);
            self.endpoint.send(Service::Newest, &off);
            self.endpoint.send(Service::Reliable, &off);
            // Servers do not always notice that a client has gone: the report says that the force has.
            let mut is_rendered = self.heard.forget_force();
            while is_rendered && begun.elapsed().as_secs_f64() < LEAVE_FORCE_S {
                if self.listen(WAIT).is_err() {
                    break;
                }
                is_rendered = !self
                    .heard
                    .force()
                    .is_some_and(|force| force.length() <= NO_FORCE);
            }
        }
        self.endpoint.leave(Duration::from_secs_f64(LEAVE_CLOSE_S));
    }
}

#[cfg(test)]
mod tests;

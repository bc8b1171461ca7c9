//! A run of the server: period by period, one device, some clients.

use std::net::TcpStream;
use std::time::Instant;

use glam::DVec3;

use super::callers::Callers;
use super::guest::{Guest, News};
use super::hold::{Hold, Taken};
use super::{Server, ServerReport};
use crate::clock::Clock;
use crate::driver::vrpn::endpoint::Broken;
use crate::driver::vrpn::message::{
    ForceField, Message, Motion, Placement, SensorPose, Text, Workspace,
};
use crate::error::DeviceError;
use crate::haptic_device::{HandleState, HapticDevice, Limits, Readiness};
use crate::safety::Safety;
use crate::wrench::{Wrench, rotation_from_vector};

/// Clients that are served at the same time; one of them holds the device, the others watch.
const GUESTS_MAX: usize = 4;

/// Interval over which the angular velocity is reported as a turn, s: half a turn in it is 314 rad/s.
const TURN_S: f64 = 0.01;

/// Time after which it is said again that the device renders no force, s.
const SAY_AGAIN_S: f64 = 0.5;

/// A run of the server.
pub(super) struct Round<'a> {
    server: &'a Server,
    period_s: f64,
    workspace: Workspace,
    callers: Callers,
    guests: Vec<Guest>,
    next_guest: u64,
    hold: Hold,
    safety: Safety,
    readiness: Readiness,
    is_failing: bool,
    inbox: Vec<Message>,
    report: ServerReport,
}

impl<'a> Round<'a> {
    pub(super) fn new(server: &'a Server, limits: &Limits, safety: Safety, period_s: f64) -> Self {
        let half = limits.workspace_half_extents.to_array();
        Self {
            server,
            period_s,
            workspace: Workspace {
                min: half.map(|h| -h),
                max: half,
            },
            callers: Callers::new(),
            guests: Vec::new(),
            next_guest: 0,
            hold: Hold::default(),
            safety,
            readiness: Readiness::Ready,
            is_failing: false,
            inbox: Vec::new(),
            report: ServerReport::default(),
        }
    }

    /// Reads the device, hears the clients, renders what the one that holds it wants, tells all.
    pub(super) fn period(&mut self, device: &mut dyn HapticDevice, clock: &mut impl Clock) {
        let release = clock.wait();
        let elapsed_s = (release.skipped as f64 + 1.0) * self.period_s;
        if release.skipped > 0 {
            self.safety.after_gap(elapsed_s);
        }
        self.report.periods += 1;
        self.report.skipped += release.skipped;

        let sample = device.read(release.time_s);
        let accepted = self
            .safety
            .accept_sample(sample.as_ref().ok(), release.time_s, elapsed_s);
        self.admit();
        self.hear();
        let wrench = self.wrench(accepted.map(|state| state.pose.translation));
        let written = device.write(&wrench.into());

        self.report.read_failures += u64::from(sample.is_err());
        self.report.write_failures += u64::from(written.is_err());
        self.tell_failure(sample.as_ref().err().or(written.as_ref().err()));
        if let Ok(state) = &sample {
            self.tell_readiness(state.readiness, release.index);
        }
        // No pose where the device gave none: that the client hears nothing is how it knows.
        let news = sample.ok().map(|state| news(&state, wrench));
        self.tell(release.index, news.as_ref());
    }

    /// The force that is wanted at a position (m), as it may be rendered.
    fn wrench(&mut self, position: Option<DVec3>) -> Wrench {
        let field = self.hold.field(Instant::now());
        self.report.silences += u64::from(field.is_err());
        match (field, position) {
            (Ok(Some(field)), Some(position)) => {
                let wanted = Wrench::new(field.force_at(position), DVec3::ZERO);
                self.safety.accept_wrench(&wanted, self.period_s)
            }
            _ => self.safety.decay(self.period_s),
        }
    }

    /// Lets in who called, and who answered a call.
    fn admit(&mut self) {
        while let Ok((stream, _)) = self.server.listener.accept() {
            self.admit_one(stream, true);
        }
        self.callers.read(&self.server.requests);
        while let Some(stream) = self.callers.answered() {
            self.admit_one(stream, false);
        }
    }

    fn admit_one(&mut self, stream: TcpStream, has_called: bool) {
        if self.guests.len() < GUESTS_MAX
            && let Ok(guest) = Guest::new(self.next_guest, stream, has_called)
        {
            self.guests.push(guest);
            self.next_guest += 1;
        } else {
            self.report.refused += 1;
        }
    }

    /// Hears each client, and lets go of those whose link is broken.
    fn hear(&mut self) {
        let mut guests = std::mem::take(&mut self.guests);
        guests.retain_mut(|guest| {
            let mut inbox = std::mem::take(&mut self.inbox);
            // What came before the link broke still counts: the last word may be that there is no force.
            let received = guest.receive(&self.server.name, &mut inbox);
            for message in inbox.drain(..) {
                self.answer(guest, &message);
            }
            self.inbox = inbox;
            if received == Ok(true) {
                self.report.guests += 1;
                say_readiness(guest, self.readiness);
            }
            self.keeps(guest, received.map(|_| ()))
        });
        self.guests = guests;
    }

    fn answer(&mut self, guest: &mut Guest, message: &Message) {
        match message {
            Message::Ping => guest.answer_ping(),
            Message::SetUpdateRate(rate) => guest.set_rate(*rate, self.period_s),
            Message::RequestWorkspace => guest.send(&Message::Workspace(self.workspace)),
            Message::ForceField(field) => self.take_field(guest, *field),
            _ => {}
        }
    }

    fn take_field(&mut self, guest: &mut Guest, field: ForceField) {
        match self.hold.take(guest.id, field, Instant::now()) {
            Taken::Yes => self.report.fields += 1,
            Taken::Held => {
                self.report.fields_refused += 1;
                if guest.is_news_that_held() {
                    guest.send(&text(
                        1,
                        "another client holds the device; it feels no force of this one",
                    ));
                }
            }
            Taken::NotFinite => {
                self.report.fields_refused += 1;
                guest.send(&Message::ForceError(0));
            }
        }
    }

    /// Does the link to a client go on? Where not, its force goes with it.
    fn keeps(&mut self, guest: &mut Guest, result: Result<(), Broken>) -> bool {
        let Err(broken) = result else {
            return true;
        };
        self.report.faults += u64::from(matches!(broken, Broken::Protocol(_)));
        self.report.refused += u64::from(!guest.is_welcome());
        self.report.departures += u64::from(self.hold.leave(guest.id));
        false
    }

    fn tell(&mut self, period: u64, news: Option<&News>) {
        let mut guests = std::mem::take(&mut self.guests);
        guests.retain_mut(|guest| {
            let told = guest.tell(period, news);
            self.keeps(guest, told)
        });
        self.guests = guests;
    }

    fn tell_failure(&mut self, failure: Option<&DeviceError>) {
        let was_failing = std::mem::replace(&mut self.is_failing, failure.is_some());
        if let (Some(error), false) = (failure, was_failing) {
            let message = text(2, &error.to_string());
            self.guests
                .iter_mut()
                .for_each(|guest| guest.send(&message));
        }
    }

    fn tell_readiness(&mut self, now: Readiness, period: u64) {
        let again = (SAY_AGAIN_S / self.period_s).ceil().max(1.0) as u64;
        let before = std::mem::replace(&mut self.readiness, now);
        if now != before || (now != Readiness::Ready && period.is_multiple_of(again)) {
            for guest in &mut self.guests {
                if now == Readiness::Ready {
                    guest.send(&Message::ForceError(4));
                }
                say_readiness(guest, now);
            }
        }
    }

    /// Lets the force go to zero.
    pub(super) fn release(&mut self, device: &mut dyn HapticDevice, clock: &mut impl Clock) {
        while self.safety.last_wrench() != Wrench::ZERO {
            let release = clock.wait();
            let wrench = self.safety.decay(self.period_s);
            let sample = device.read(release.time_s);
            if device.write(&wrench.into()).is_err() {
                return;
            }
            let news = sample.ok().map(|state| news(&state, wrench));
            self.tell(release.index, news.as_ref());
        }
    }

    /// Takes leave of the clients.
    pub(super) fn finish(mut self) -> ServerReport {
        self.guests.iter_mut().for_each(Guest::dismiss);
        self.report.safety = self.safety.events();
        self.report
    }
}

fn news(state: &HandleState, wrench: Wrench) -> News {
    let pose = state.pose;
    News {
        pose: SensorPose {
            sensor: 0,
            at: Placement {
                position: pose.translation.to_array(),
                rotation: pose.rotation.to_array(),
            },
        },
        motion: Motion {
            sensor: 0,
            linear: state.linear_velocity.to_array(),
            rotation: rotation_from_vector(state.angular_velocity * TURN_S).to_array(),
            interval_s: TURN_S,
        },
        force: wrench.force.to_array(),
        buttons: state.buttons,
    }
}

/// Says that the device renders no force, and why.
fn say_readiness(guest: &mut Guest, readiness: Readiness) {
    let (code, why) = match readiness {
        Readiness::Ready => return,
        Readiness::Waiting(why) => (2, why),
        Readiness::Tripped(why) => (3, why),
    };
    guest.send(&Message::ForceError(code));
    guest.send(&text(2, why));
}

fn text(severity: u32, text: &str) -> Message {
    Message::Text(Text {
        severity,
        level: 0,
        text: text.to_owned(),
    })
}

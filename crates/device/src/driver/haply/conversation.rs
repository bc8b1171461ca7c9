//! The conversation with the service about one device: answers in, states out, forces out. Knows no socket and no
//! clock, so each turn of it can be provoked in a test.

use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use glamx::DPose3;

use super::events::{Alarms, Event, Level};
use super::felt::{Comparison, Verdict};
use super::frame::{Form, Frame, Grip, Inverse, Status, force_frame};
use super::messages::{Messages, plain};
use super::orientation::Follower;
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandPresence, HandleState, Readiness};
use crate::wrench::limit_length;

/// Time for which a device that was not ready stays so, s: long enough for the loop to see it and to arm anew.
const NOT_READY_HOLD: Duration = Duration::from_millis(100);

/// Time without an answer after which a zero follows the force in flight.
pub(super) const STALL: Duration = Duration::from_millis(20);

/// Age of the last good state from which on no force is sent; the loop, too, takes the device for silent then.
const SILENT: Duration = Duration::from_millis(50);

/// Answers without a state of the device, in a row, after which the connection is given up.
const USELESS_MAX: u32 = 200;

/// Charge of a grip from which on it is told, 0 to 1.
const BATTERY_LOW: f64 = 0.15;

/// What is known of one device.
#[derive(Debug)]
pub(super) struct Conversation {
    id: String,
    force_max: f64,
    form: Form,
    is_form_settled: bool,
    status: Status,
    alarms: Alarms,
    not_ready: Option<(Readiness, Instant)>,
    grip_id: Option<String>,
    orientation: Follower,
    last_orientation: DQuat,
    felt: Comparison,
    /// The force in flight, N.
    sent: DVec3,
    answered_at: Option<Instant>,
    good_at: Option<Instant>,
    useless_in_row: u32,
    messages: Messages,
}

impl Conversation {
    /// About the device of this identifier, whose largest force is `force_max` (N), in a form of force.
    pub(super) fn new(id: &str, force_max: f64, form: Form) -> Self {
        Self {
            id: id.to_owned(),
            force_max,
            form,
            is_form_settled: false,
            status: Status::default(),
            alarms: Alarms::default(),
            not_ready: None,
            grip_id: None,
            orientation: Follower::default(),
            last_orientation: DQuat::IDENTITY,
            felt: Comparison::default(),
            sent: DVec3::ZERO,
            answered_at: None,
            good_at: None,
            useless_in_row: 0,
            messages: Messages::default(),
        }
    }

    /// The frame for a command. The force is zero unless the device is ready and has told of itself just now.
    pub(super) fn say(&mut self, command: &Command, now: Instant) -> String {
        let wanted = command.wrench.force;
        let is_silent = self
            .good_at
            .is_some_and(|at| now.saturating_duration_since(at) >= SILENT);
        if is_silent {
            let why = "the service told nothing of the device for a while";
            self.alarms.hold(Readiness::Tripped(why), now);
        }
        let is_heard = self.good_at.is_some() && !is_silent;
        let may_push = is_heard && wanted.is_finite() && self.readiness(now) == Readiness::Ready;
        self.sent = if may_push {
            limit_length(wanted, self.force_max)
        } else {
            DVec3::ZERO
        };
        force_frame(&self.id, self.sent, self.form)
    }

    /// The frame that ends all force.
    pub(super) fn say_zero(&mut self) -> String {
        self.sent = DVec3::ZERO;
        force_frame(&self.id, DVec3::ZERO, self.form)
    }

    /// Takes the service's answer to the last frame.
    ///
    /// # Errors
    /// [`DeviceError::Gone`] where nothing but useless answers comes.
    pub(super) fn hear(
        &mut self,
        text: &str,
        now: Instant,
    ) -> Result<Option<HandleState>, DeviceError> {
        let state = match Frame::decode(text) {
            Err(why) => {
                self.messages.say("unreadable", now, || {
                    format!("an answer of the service {}; it was passed over", why.0)
                });
                None
            }
            Ok(frame) => self.hear_frame(&frame, now),
        };
        if state.is_some() {
            self.useless_in_row = 0;
            self.good_at = Some(now);
            return Ok(state);
        }
        self.useless_in_row += 1;
        if self.useless_in_row >= USELESS_MAX {
            return Err(DeviceError::Gone {
                reason: format!("the service no longer tells of device {}", self.id),
            });
        }
        Ok(None)
    }

    /// Takes a message of the events channel.
    ///
    /// # Errors
    /// [`DeviceError::Gone`] where it says that the device was disconnected.
    pub(super) fn hear_event(&mut self, text: &str, now: Instant) -> Result<(), DeviceError> {
        let Some(event) = Event::decode(text) else {
            self.messages.say("unreadable event", now, || {
                "a message of the events channel is no event; it was passed over".to_owned()
            });
            return Ok(());
        };
        let is_mine = |id: &str| id.eq_ignore_ascii_case(&self.id);
        let names_me = event.device_id.as_deref().is_some_and(is_mine);
        let names_grip = match (&event.device_id, &self.grip_id) {
            (Some(named), Some(grip)) => named.eq_ignore_ascii_case(grip),
            _ => false,
        };
        if event.device_id.is_some() && !names_me && !names_grip {
            return Ok(());
        }
        match event.name.as_str() {
            "device-safety-triggered" => self.hear_safety(&event, now),
            "device-disconnected" if names_me => {
                return Err(DeviceError::Gone {
                    reason: format!("device {} was disconnected", self.id),
                });
            }
            "device-busy" if !names_grip => {
                let why = "another session of the service uses the device";
                self.alarms.hold(Readiness::Waiting(why), now);
                self.tell_event(&event, now);
            }
            "device-sleep" | "device-disconnected" => self.tell_event(&event, now),
            _ if event.level >= Level::Warning => {
                if event.level == Level::Critical {
                    let why = "the service reports a critical failure";
                    self.alarms.hold(Readiness::Tripped(why), now);
                }
                self.tell_event(&event, now);
            }
            _ => {}
        }
        Ok(())
    }

    /// Says that the events channel has ended.
    ///
    /// # Errors
    /// [`DeviceError::Gone`] where an alarm is on that only another event would end.
    pub(super) fn lose_events(&mut self, why: &str, now: Instant) -> Result<(), DeviceError> {
        if self.alarms.waits_for_an_event() {
            return Err(DeviceError::Gone {
                reason: format!(
                    "the events of the service ended ({why}) while the device's own safety was on"
                ),
            });
        }
        self.messages.say("events lost", now, || {
            format!(
                "the events of the service ended ({}); its brake and its stalls are no longer told",
                plain(why)
            )
        });
        Ok(())
    }

    /// Says that the service told more states than it was asked for.
    pub(super) fn skip_unasked(&mut self, now: Instant) {
        self.messages.say("unasked", now, || {
            "the service sends more states than it is asked for; the older ones are passed over"
                .to_owned()
        });
    }

    /// Says that an answer is late. The force is taken away, and must be armed anew: it would come back in a step.
    pub(super) fn be_late(&mut self, now: Instant) -> String {
        let why = "the service did not answer in time";
        self.alarms.hold(Readiness::Tripped(why), now);
        self.messages.say("late", now, || {
            format!(
                "the service did not answer for {} ms; zero force was sent",
                STALL.as_millis()
            )
        });
        self.say_zero()
    }

    /// Anything for the user.
    pub(super) fn message(&mut self) -> Option<String> {
        self.messages.next()
    }

    fn hear_frame(&mut self, frame: &Frame, now: Instant) -> Option<HandleState> {
        let elapsed_s = self
            .answered_at
            .map_or(0.0, |at| now.saturating_duration_since(at).as_secs_f64());
        self.answered_at = Some(now);
        let Some(device) = frame.device(&self.id) else {
            self.messages.say("not listed", now, || {
                "the service does not list the device".to_owned()
            });
            return None;
        };
        self.status = self.status.renewed(device.status);
        self.note_mode(device, now);
        if let Some(felt) = device.felt {
            let verdict = self.felt.compare(self.sent, felt, elapsed_s);
            // A form that has worked is not to blame later.
            self.is_form_settled |= self.felt.has_arrived();
            self.judge(verdict, now);
        }
        let Some(position) = device.position else {
            self.messages.say("no position", now, || {
                "the service tells no position of the device that could be true".to_owned()
            });
            return None;
        };
        if device.velocity.is_none() {
            self.messages.say("no velocity", now, || {
                "the service tells no velocity of the device; it is taken as zero".to_owned()
            });
        }
        let buttons = self.follow_grip(frame, device, now);
        let (rotation, angular_velocity) =
            self.orientation.follow(self.last_orientation, elapsed_s);
        Some(HandleState {
            pose: DPose3::from_parts(position, rotation),
            linear_velocity: device.velocity.unwrap_or(DVec3::ZERO),
            angular_velocity,
            buttons,
            hand: HandPresence::Unknown,
            readiness: self.readiness(now),
            ..HandleState::at_rest(DPose3::IDENTITY)
        })
    }

    /// Takes the orientation from the grip, or from the body as long as there is none; returns the buttons.
    fn follow_grip(&mut self, frame: &Frame, device: &Inverse, now: Instant) -> u32 {
        if self.grip_id.is_none() {
            let usable = |grip: &&Grip| grip.is_awake && grip.orientation.is_some();
            if let Some(grip) = frame.grips.iter().find(usable) {
                self.grip_id = Some(grip.id.clone());
                self.messages.say("grip", now, || {
                    format!("orientation and buttons come from grip {}", grip.id)
                });
            }
        }
        let Some(id) = &self.grip_id else {
            self.last_orientation = device.body.unwrap_or(self.last_orientation);
            return 0;
        };
        let Some(grip) = frame.grip(id).filter(|grip| grip.is_awake) else {
            self.messages.say("grip gone", now, || {
                format!("grip {id} is asleep or gone: the orientation stays as it was")
            });
            return 0;
        };
        self.messages.end("grip gone");
        if let Some(charge) = grip.battery.filter(|charge| *charge < BATTERY_LOW) {
            self.messages.say("battery", now, || {
                format!("grip {id} has {:.0} % of its charge left", 100.0 * charge)
            });
        }
        self.last_orientation = grip.orientation.unwrap_or(self.last_orientation);
        grip.buttons
    }

    /// Whether a force may go to the device. What was not ready stays so for a moment.
    fn readiness(&mut self, now: Instant) -> Readiness {
        let readiness = match self.alarms.readiness(now) {
            Readiness::Ready => waits_for(self.status),
            alarm => alarm,
        };
        if readiness != Readiness::Ready {
            self.not_ready = Some((readiness, now));
            return readiness;
        }
        match self.not_ready {
            Some((why, at)) if now.saturating_duration_since(at) < NOT_READY_HOLD => why,
            _ => Readiness::Ready,
        }
    }

    /// Another program may drive the device while our forces are passed over.
    fn note_mode(&mut self, device: &Inverse, now: Instant) {
        let is_passed_over =
            self.status.in_use == Some(false) && device.is_force_mode == Some(false);
        // The first answers come before the service has seen a force of ours.
        if is_passed_over && self.good_at.is_some() {
            let why = "the service does not hand the device over (in_use is false)";
            self.alarms.hold(Readiness::Waiting(why), now);
        }
    }

    fn judge(&mut self, verdict: Option<Verdict>, now: Instant) {
        match verdict {
            None => {}
            Some(Verdict::Weak { sent, felt }) => self.messages.say("weak", now, || {
                format!(
                    "of {sent:.1} N sent only {felt:.1} N are felt: the service weakens the force (its filters, \
                     its setting devices/force_scale) or the device limits it"
                )
            }),
            Some(Verdict::Nothing) if self.is_form_settled => {
                self.messages.say("nothing felt", now, || {
                    "the service renders nothing of the force that is sent".to_owned()
                });
            }
            Some(Verdict::Nothing) => {
                // An unknown service may take the force in its other form. It would begin with a step, so the
                // force must be armed anew.
                let from = self.form;
                self.form = from.other();
                self.is_form_settled = true;
                let why = "the form of the force was changed for this service";
                self.alarms.hold(Readiness::Tripped(why), now);
                self.messages.say("form", now, || {
                    format!(
                        "the service renders nothing of a force given as \"{}\"; it is now given as \"{}\"",
                        from.member(),
                        from.other().member()
                    )
                });
            }
        }
    }

    fn hear_safety(&mut self, event: &Event, now: Instant) {
        let kind = event.safety.as_deref().unwrap_or_default();
        self.alarms.safety(kind, event.level, now);
        // Of what has two sides each is told, and the one ends the other.
        let (side, other) = match kind {
            "ebrake_triggered" => (kind, "ebrake_released"),
            "ebrake_released" => (kind, "ebrake_triggered"),
            "fod_stage_changed" if event.level >= Level::Warning => (kind, "fod over"),
            "fod_stage_changed" => ("fod over", kind),
            _ => (kind, ""),
        };
        self.messages.end(&format!("safety {other}"));
        self.messages.say(&format!("safety {side}"), now, || {
            in_own_words("safety of the device", kind, &event.text)
        });
    }

    fn tell_event(&mut self, event: &Event, now: Instant) {
        self.messages
            .say(&format!("event {}", event.name), now, || {
                in_own_words("the service reports", &event.name, &event.text)
            });
    }
}

fn in_own_words(who: &str, name: &str, text: &str) -> String {
    if text.is_empty() {
        format!("{who}: {name}")
    } else {
        format!("{who}: {name} ({text})")
    }
}

/// What the device waits for. Calibration and readiness must have been said.
pub(super) fn waits_for(status: Status) -> Readiness {
    if status.power == Some(false) {
        Readiness::Waiting("the device has no power supply")
    } else if status.calibrated != Some(true) {
        Readiness::Waiting("the device is not calibrated")
    } else if status.ready != Some(true) {
        Readiness::Waiting("the service does not say that the device is ready")
    } else {
        Readiness::Ready
    }
}

#[cfg(test)]
mod tests;

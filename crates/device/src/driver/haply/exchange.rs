//! The link: one frame out, one answer in, and the events in between.

use std::time::{Duration, Instant};

use super::conversation::{Conversation, STALL};
use super::socket::Socket;
use crate::driver::link::Link;
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandleState};

/// Shortest time between two frames of ours: twice the loop's rate; the service answers within a fraction of it.
const PACE: Duration = Duration::from_micros(500);

/// Longest wait for an answer in one exchange.
const ANSWER: Duration = Duration::from_millis(5);

/// Silence after which the service counts as gone.
const DEAD: Duration = Duration::from_secs(1);

/// Longest wait for the answer to the last frame: it must have been read before the socket goes.
const LAST_ANSWER: Duration = Duration::from_millis(50);

/// Events that are taken in one exchange.
const EVENTS_MAX: usize = 16;

/// An open device.
pub(super) struct HaplyLink {
    socket: Socket,
    events: Option<Socket>,
    conversation: Conversation,
    /// Frames that are not answered yet: one, two where an answer is late.
    in_flight: u32,
    asked_at: Instant,
    is_late: bool,
}

impl HaplyLink {
    pub(super) fn new(socket: Socket, events: Option<Socket>, conversation: Conversation) -> Self {
        Self {
            socket,
            events,
            conversation,
            in_flight: 0,
            asked_at: Instant::now(),
            is_late: false,
        }
    }

    fn send(&mut self, text: String) -> Result<(), DeviceError> {
        self.socket.send(text).map_err(gone)?;
        self.in_flight += 1;
        Ok(())
    }

    /// Takes what has come on the events channel.
    fn hear_events(&mut self) -> Result<(), DeviceError> {
        for _ in 0..EVENTS_MAX {
            let Some(events) = &mut self.events else {
                return Ok(());
            };
            let now = Instant::now();
            match events.read_now() {
                Ok(None) => return Ok(()),
                Ok(Some(text)) => self.conversation.hear_event(&text, now)?,
                Err(why) => {
                    self.events = None;
                    return self.conversation.lose_events(&why, now);
                }
            }
        }
        Ok(())
    }

    /// Waits for the answers to all frames in flight; only the last one is of use.
    fn hear_answer(&mut self) -> Result<Option<HandleState>, DeviceError> {
        let until = Instant::now() + ANSWER;
        while self.in_flight > 0 {
            let Some(text) = self.socket.read_until(until).map_err(gone)? else {
                return Ok(None);
            };
            self.in_flight -= 1;
            if self.in_flight == 0 {
                self.is_late = false;
                return self.conversation.hear(&text, Instant::now());
            }
        }
        Ok(None)
    }

    /// What is done while an answer is late: a zero after the force in flight, once, and at last farewell.
    fn mind_the_delay(&mut self, now: Instant) -> Result<(), DeviceError> {
        let silent = now.saturating_duration_since(self.asked_at);
        if silent >= DEAD {
            return Err(gone(format!("no answer for {} s", DEAD.as_secs())));
        }
        if silent >= STALL && !self.is_late {
            self.is_late = true;
            let zero = self.conversation.be_late(now);
            return self.send(zero);
        }
        Ok(())
    }
}

impl Link for HaplyLink {
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError> {
        self.hear_events()?;
        let now = Instant::now();
        if self.in_flight > 0 {
            self.mind_the_delay(now)?;
            return self.hear_answer();
        }
        let left = PACE.saturating_sub(now.saturating_duration_since(self.asked_at));
        if !left.is_zero() {
            // The next call comes with the newest command.
            std::thread::sleep(left);
            return Ok(None);
        }
        if self.socket.drain().map_err(gone)? > 0 {
            self.conversation.skip_unasked(now);
        }
        let frame = self.conversation.say(command, now);
        self.asked_at = now;
        self.send(frame)?;
        self.hear_answer()
    }

    fn message(&mut self) -> Option<String> {
        self.conversation.message()
    }

    fn close(&mut self) {
        let zero = self.conversation.say_zero();
        if self.send(zero).is_ok() {
            // A socket that goes with something unread in it takes what it has sent with it.
            let until = Instant::now() + LAST_ANSWER;
            while self.in_flight > 0 {
                match self.socket.read_until(until) {
                    Ok(Some(_)) => self.in_flight -= 1,
                    Ok(None) | Err(_) => break,
                }
            }
        }
        self.socket.close();
        if let Some(events) = &mut self.events {
            events.close();
        }
    }
}

fn gone(reason: String) -> DeviceError {
    DeviceError::Gone { reason }
}

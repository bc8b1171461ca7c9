//! One client of the server.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::driver::vrpn::endpoint::{Broken, Endpoint, Service};
use crate::driver::vrpn::message::{Kind, Message, Motion, SensorPose};
use crate::driver::vrpn::peer::Event;

/// Time in which a client must have greeted, s.
const GREETING_S: f64 = 2.0;

/// Buttons that are reported: one for each bit of a handle's state.
const BUTTONS: u32 = 32;

/// What the server sends and takes.
const KINDS: &[Kind] = &[
    Kind::Ping,
    Kind::Pong,
    Kind::Text,
    Kind::PosQuat,
    Kind::Velocity,
    Kind::Workspace,
    Kind::RequestWorkspace,
    Kind::SetUpdateRate,
    Kind::ButtonChange,
    Kind::ButtonStates,
    Kind::Force,
    Kind::ForceError,
    Kind::ForceField,
];

/// What is told once a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct News {
    pub(super) pose: SensorPose,
    pub(super) motion: Motion,
    /// N
    pub(super) force: [f64; 3],
    /// One bit each.
    pub(super) buttons: u32,
}

/// A client.
#[derive(Debug)]
pub(super) struct Guest {
    pub(super) id: u64,
    endpoint: Endpoint,
    since: Instant,
    is_welcome: bool,
    is_told_held: bool,
    /// Buttons as it was told last, one bit each.
    buttons: u32,
    /// Poses are told every so many periods.
    every: u64,
}

impl Guest {
    pub(super) fn new(id: u64, stream: TcpStream, has_called: bool) -> Result<Self, Broken> {
        Ok(Self {
            id,
            // Who calls wants the connection alone; who was called back wants datagrams too.
            endpoint: Endpoint::new(stream, !has_called)?,
            since: Instant::now(),
            is_welcome: false,
            is_told_held: false,
            buttons: 0,
            every: 1,
        })
    }

    /// Takes in what came for the device of this name. `Ok(true)`: it has greeted with this.
    pub(super) fn receive(
        &mut self,
        device: &str,
        inbox: &mut Vec<Message>,
    ) -> Result<bool, Broken> {
        inbox.clear();
        self.endpoint.receive(Duration::ZERO, |event| {
            if let Event::Message {
                sender, message, ..
            } = event
                && sender == device
            {
                inbox.push(message);
            }
        })?;
        if self.is_welcome {
            return Ok(false);
        }
        if self.endpoint.version().is_none() {
            let is_late = self.since.elapsed().as_secs_f64() > GREETING_S;
            return if is_late {
                Err(Broken::Closed)
            } else {
                Ok(false)
            };
        }
        self.is_welcome = true;
        self.endpoint.describe(device, KINDS);
        self.tell_buttons();
        Ok(true)
    }

    /// Has it greeted as VRPN does?
    pub(super) fn is_welcome(&self) -> bool {
        self.is_welcome
    }

    /// Poses are wanted at this rate, Hz.
    pub(super) fn set_rate(&mut self, rate: f64, period_s: f64) {
        if rate.is_finite() && rate > 0.0 {
            self.every = (1.0 / (rate * period_s)).round().clamp(1.0, 1e6) as u64;
        }
    }

    /// Answers a ping as a device with buttons does.
    pub(super) fn answer_ping(&mut self) {
        self.send(&Message::Pong);
        self.tell_buttons();
    }

    /// Says that another one holds the device. `false`: it was told before.
    pub(super) fn is_news_that_held(&mut self) -> bool {
        !std::mem::replace(&mut self.is_told_held, true)
    }

    /// Sends a message that must arrive.
    pub(super) fn send(&mut self, message: &Message) {
        self.endpoint.send(Service::Reliable, message);
    }

    /// Tells the state of the device and sends what waits.
    pub(super) fn tell(&mut self, period: u64, news: Option<&News>) -> Result<(), Broken> {
        if let (true, Some(news)) = (self.is_welcome, news) {
            self.tell_changes(news.buttons);
            if period.is_multiple_of(self.every) {
                for message in [
                    Message::PosQuat(news.pose),
                    Message::Velocity(news.motion),
                    Message::Force(news.force),
                ] {
                    self.endpoint.send(Service::Newest, &message);
                }
            }
        }
        self.endpoint.flush()
    }

    fn tell_buttons(&mut self) {
        let states = (0..BUTTONS).map(|b| (self.buttons >> b & 1) as i32);
        let message = Message::ButtonStates(states.collect());
        self.send(&message);
    }

    fn tell_changes(&mut self, buttons: u32) {
        let changed = std::mem::replace(&mut self.buttons, buttons) ^ buttons;
        for button in (0..BUTTONS).filter(|b| changed >> b & 1 == 1) {
            self.send(&Message::ButtonChange {
                button: button as i32,
                state: (buttons >> button & 1) as i32,
            });
        }
    }

    /// Nothing more comes.
    pub(super) fn dismiss(&mut self) {
        self.endpoint.leave(Duration::from_millis(20));
    }
}

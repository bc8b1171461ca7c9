//! A device that is reached over a link: the link's thread, and the loop's end of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use triple_buffer::{Input, Output, triple_buffer};

use super::{Opened, Unavailable};
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandleState, HapticDevice, Limits};
use crate::safety::Watchdog;

/// Age of a sample beyond which the device counts as silent, s: the loop then lets the force go to zero.
pub const STALE_S: f64 = 0.05;

/// Failures of the link in a row after which it is closed and opened anew.
const FAILURES_MAX: u32 = 100;

/// Time between two tries to open a lost link, s.
const RETRY_S: f64 = 1.0;

/// Time between two messages with the same words about failures, s.
const RETELL_S: f64 = 10.0;

/// Different words that are remembered; more in that time are not told.
const WORDS_MAX: usize = 16;

/// Longest wait for the link's thread at the end, s: a library that hangs must not hold the program.
const JOIN_S: f64 = 1.0;

/// What a driver does: everything that may block, on a thread of its own.
pub trait Link {
    /// Renders a command and returns the newest state of the handle (its `time_s` is not read).
    ///
    /// Called again and again. Waits for the device's own pace, at most some 5 ms; where nothing new has come,
    /// `Ok(None)`. A command is new each time or faded: a link has no watchdog of its own to keep.
    ///
    /// # Errors
    /// What failed. [`DeviceError::Gone`] where it is no use going on: the link is closed and opened anew.
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError>;

    /// A message for the user, once each, such as a safety event of the device. Called after each exchange.
    fn message(&mut self) -> Option<String> {
        None
    }

    /// Zero force, then leaves. Must not fail.
    fn close(&mut self);
}

/// What a device says of itself when it is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// Name for people: maker, model, serial number.
    pub name: String,
    /// What the hardware can do.
    pub limits: Limits,
    /// What the user should know at once.
    pub notes: Vec<String>,
}

/// A link that was opened.
pub type Connected = (Identity, Box<dyn Link>);

/// The newest of what the link's thread knows.
#[derive(Debug, Clone, Copy)]
struct Heard {
    state: Option<HandleState>,
    at: Instant,
}

/// The newest of what the loop wants.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    command: Command,
    at: Instant,
}

/// The loop's end of a link. Nothing here blocks, and only failures allocate.
#[derive(Debug)]
pub struct Threaded {
    name: String,
    limits: Limits,
    heard: Output<Heard>,
    wanted: Input<Wanted>,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Threaded {
    /// Starts the link's thread and opens the link on it.
    ///
    /// `connect` is called there, also after a loss, once a second until it succeeds. The commands that the link is
    /// given fade to zero when the loop sends none (20 ms, then within 30 ms).
    ///
    /// # Errors
    /// What the first `connect` says.
    pub fn open(
        connect: impl FnMut() -> Result<Connected, Unavailable> + Send + 'static,
    ) -> Result<Opened, Unavailable> {
        let now = Instant::now();
        let (heard_in, heard) = triple_buffer(&Heard {
            state: None,
            at: now,
        });
        let (wanted, wanted_out) = triple_buffer(&Wanted {
            command: Command::ZERO,
            at: now,
        });
        let quit = Arc::new(AtomicBool::new(false));
        let (tell, messages) = channel();
        let (first, opened) = channel();
        let worker = Worker {
            connect,
            heard: heard_in,
            wanted: wanted_out,
            quit: Arc::clone(&quit),
            tell,
        };
        let thread = std::thread::Builder::new()
            .name("device".to_owned())
            .spawn(move || worker.run(&first))
            .map_err(|e| Unavailable::Failed {
                reason: format!("no thread for the device: {e}"),
            })?;
        let identity = first_answer(&opened)?;
        Ok(Opened {
            notes: identity.notes,
            messages,
            device: Box::new(Self {
                name: identity.name,
                limits: identity.limits,
                heard,
                wanted,
                quit,
                thread: Some(thread),
            }),
        })
    }

    fn send(&mut self, command: Command) {
        self.wanted.write(Wanted {
            command,
            at: Instant::now(),
        });
    }
}

/// What came of the first try; a thread that panicked says nothing.
fn first_answer(opened: &Receiver<Result<Identity, Unavailable>>) -> Result<Identity, Unavailable> {
    opened.recv().unwrap_or_else(|_| {
        Err(Unavailable::Failed {
            reason: "the driver ended without an answer".to_owned(),
        })
    })
}

impl HapticDevice for Threaded {
    fn name(&self) -> &str {
        &self.name
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        let heard = self.heard.read();
        let age_s = heard.at.elapsed().as_secs_f64();
        match heard.state {
            Some(state) if age_s <= STALE_S => Ok(HandleState { time_s, ..state }),
            _ => Err(DeviceError::Silent { age_s }),
        }
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        if !command.is_finite() {
            return Err(DeviceError::NonFiniteWrench {
                device: self.name.clone(),
            });
        }
        self.send(*command);
        Ok(())
    }

    fn stop(&mut self) {
        self.send(Command::ZERO);
    }
}

impl Drop for Threaded {
    fn drop(&mut self) {
        self.send(Command::ZERO);
        self.quit.store(true, Ordering::Release);
        let Some(thread) = self.thread.take() else {
            return;
        };
        let begun = Instant::now();
        while !thread.is_finished() && begun.elapsed().as_secs_f64() < JOIN_S {
            std::thread::sleep(Duration::from_millis(1));
        }
        if thread.is_finished() {
            let _ended = thread.join();
        }
    }
}

/// The link's thread.
struct Worker<F> {
    connect: F,
    heard: Input<Heard>,
    wanted: Output<Wanted>,
    quit: Arc<AtomicBool>,
    tell: Sender<String>,
}

impl<F: FnMut() -> Result<Connected, Unavailable>> Worker<F> {
    fn run(mut self, first: &Sender<Result<Identity, Unavailable>>) {
        let (identity, mut link) = match (self.connect)() {
            Ok(connected) => connected,
            Err(error) => {
                let _nobody_waits = first.send(Err(error));
                return;
            }
        };
        let name = identity.name.clone();
        if first.send(Ok(identity)).is_err() {
            link.close();
            return;
        }
        loop {
            let lost = self.serve(&name, &mut *link);
            link.close();
            let Some(error) = lost else {
                return;
            };
            self.say(format!(
                "{name} is lost ({error}); no force goes to it, and it is looked for once a second"
            ));
            match self.reconnect() {
                Some(again) => link = again,
                None => return,
            }
            self.say(format!("{name} is back; the force must be armed again"));
        }
    }

    /// Exchanges until the end or a loss. `None`: the end.
    fn serve(&mut self, name: &str, link: &mut dyn Link) -> Option<DeviceError> {
        let fade = Watchdog::for_link();
        let mut failures = 0;
        let mut told = Told::default();
        while !self.quit.load(Ordering::Acquire) {
            let wanted = *self.wanted.read();
            let age_s = wanted.at.elapsed().as_secs_f64();
            let begun = Instant::now();
            let answer = link.exchange(&wanted.command.faded(fade.gain_at_age(age_s)));
            let took_s = begun.elapsed().as_secs_f64();
            if took_s > STALE_S {
                self.say(format!(
                    "{name} or this machine was busy for {:.0} ms; the force was taken to zero meanwhile",
                    1e3 * took_s
                ));
            }
            while let Some(message) = link.message() {
                self.say(format!("{name}: {message}"));
            }
            match answer {
                Ok(None) => failures = 0,
                Ok(state) => {
                    failures = 0;
                    let at = Instant::now();
                    self.heard.write(Heard { state, at });
                }
                Err(error) => {
                    failures += 1;
                    if failures >= FAILURES_MAX || matches!(error, DeviceError::Gone { .. }) {
                        return Some(error);
                    }
                    let text = format!("{name}: {error}");
                    if failures == 1 && told.is_news(&text) {
                        self.say(text);
                    }
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
        }
        None
    }

    /// Opens the link again, however long it takes. `None`: the end.
    fn reconnect(&mut self) -> Option<Box<dyn Link>> {
        loop {
            let begun = Instant::now();
            while begun.elapsed().as_secs_f64() < RETRY_S {
                if self.quit.load(Ordering::Acquire) {
                    return None;
                }
                std::thread::sleep(Duration::from_millis(10));
            }
            if let Ok((identity, link)) = (self.connect)() {
                identity.notes.into_iter().for_each(|note| self.say(note));
                return Some(link);
            }
        }
    }

    fn say(&self, message: String) {
        let _nobody_listens = self.tell.send(message);
    }
}

/// What was told of failures: a link that fails every other time must not fill the memory with its messages.
#[derive(Debug, Default)]
struct Told(Vec<(String, Instant)>);

impl Told {
    fn is_news(&mut self, text: &str) -> bool {
        self.0
            .retain(|(_, at)| at.elapsed().as_secs_f64() <= RETELL_S);
        let is_known = self.0.iter().any(|(known, _)| known == text);
        if is_known || self.0.len() >= WORDS_MAX {
            return false;
        }
        self.0.push((text.to_owned(), Instant::now()));
        true
    }
}

#[cfg(test)]
mod tests;

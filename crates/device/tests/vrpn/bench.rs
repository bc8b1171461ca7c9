//! A device whose pose the test sets and whose force it reads, served by our server; and waiting.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use device::driver::Opened;
use device::driver::vrpn::{Server, ServerReport};
use device::{Command, DeviceError, HandleState, HapticDevice, Limits, Readiness};
use glam::{DMat3, DVec3};
use glamx::DPose3;

/// Longest wait for anything in these tests.
const WAIT: Duration = Duration::from_secs(20);

/// What the test sets and sees of its device.
pub(crate) struct Hand {
    pub(crate) state: HandleState,
    pub(crate) is_failing: bool,
    /// Force of the last write, N.
    pub(crate) force: DVec3,
    pub(crate) stops: u32,
}

pub(crate) type Shared = Arc<Mutex<Hand>>;

pub(crate) fn with<T>(hand: &Shared, f: impl FnOnce(&mut Hand) -> T) -> T {
    f(&mut hand.lock().unwrap_or_else(PoisonError::into_inner))
}

pub(crate) fn hand_at(x: f64) -> Shared {
    Arc::new(Mutex::new(Hand {
        state: HandleState::at_rest(DPose3::from_translation(DVec3::new(x, 0.0, 0.0))),
        is_failing: false,
        force: DVec3::ZERO,
        stops: 0,
    }))
}

pub(crate) fn force(hand: &Shared) -> DVec3 {
    with(hand, |hand| hand.force)
}

struct Bench {
    limits: Limits,
    hand: Shared,
}

impl HapticDevice for Bench {
    fn name(&self) -> &str {
        "bench"
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        with(&self.hand, |hand| {
            if hand.is_failing {
                return Err(DeviceError::NoAnswer {
                    device: "bench".to_owned(),
                    reason: "unplugged".to_owned(),
                });
            }
            Ok(HandleState {
                time_s,
                ..hand.state
            })
        })
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        with(&self.hand, |hand| hand.force = command.wrench.force);
        Ok(())
    }

    fn stop(&mut self) {
        with(&self.hand, |hand| {
            hand.force = DVec3::ZERO;
            hand.stops += 1;
        });
    }
}

/// Our server on a thread, with its device.
pub(crate) struct Serving {
    pub(crate) address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<ServerReport>,
}

impl Serving {
    /// Serves `Hand0` at any free port.
    pub(crate) fn start(hand: &Shared) -> Self {
        Self::start_at(hand, SocketAddr::from(([127, 0, 0, 1], 0)))
    }

    pub(crate) fn start_at(hand: &Shared, address: SocketAddr) -> Self {
        let mut server = Server::bind(address, "Hand0").unwrap();
        let address = server.local_addr();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let mut device = Bench {
            limits: Limits::virtuose_6d(),
            hand: Arc::clone(hand),
        };
        let thread = std::thread::spawn(move || server.run(&mut device, 1e-3, &stopped).unwrap());
        Self {
            address,
            stop,
            thread,
        }
    }

    pub(crate) fn end(self) -> ServerReport {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }

    /// Name of the device there.
    pub(crate) fn name(&self, way: &str, options: &str) -> String {
        format!("vrpn:{way}Hand0@{}{options}", self.address)
    }
}

pub(crate) fn open(name: &str) -> Opened {
    device::driver::open(name).unwrap()
}

/// Waits until it holds; `what` says what, where it never does.
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < WAIT, "it never came to be: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The newest state, or nothing while the device is silent.
pub(crate) fn read(opened: &mut Opened) -> Option<HandleState> {
    opened.device.read(0.0).ok()
}

/// Waits for a message with these words.
pub(crate) fn wait_for_message(opened: &Opened, words: &str) -> String {
    let begun = Instant::now();
    let mut others = Vec::new();
    while begun.elapsed() < WAIT {
        match opened.messages.recv_timeout(Duration::from_millis(50)) {
            Ok(message) if message.contains(words) => return message,
            Ok(message) => others.push(message),
            Err(_) => {}
        }
    }
    panic!("no message \"{words}\" came, but {others:?}");
}

pub(crate) fn push(force: DVec3, stiffness: f64) -> Command {
    Command {
        wrench: device::Wrench::new(force, DVec3::ZERO),
        stiffness: DMat3::from_diagonal(DVec3::splat(-stiffness)),
    }
}

/// Writes the command until it holds, as a loop would.
pub(crate) fn push_until(
    opened: &mut Opened,
    command: &Command,
    what: &str,
    mut holds: impl FnMut() -> bool,
) {
    wait_until(what, || {
        opened.device.write(command).unwrap();
        holds()
    });
}

pub(crate) fn tripped(opened: &mut Opened) -> Option<&'static str> {
    match read(opened)?.readiness {
        Readiness::Tripped(why) => Some(why),
        _ => None,
    }
}

//! Links of the test's own: one that works, fails, blocks, dies and comes back.

use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use glamx::DPose3;

use super::*;
use crate::wrench::Wrench;

/// What the test tells the link, and what the link saw.
#[derive(Default)]
struct Bench {
    blocks_ms: u64,
    fails: bool,
    dies: bool,
    connections: u32,
    closed: u32,
    rendered: Vec<f64>,
}

type Shared = Arc<Mutex<Bench>>;

fn with<T>(bench: &Shared, f: impl FnOnce(&mut Bench) -> T) -> T {
    f(&mut bench.lock().unwrap_or_else(PoisonError::into_inner))
}

struct BenchLink(Shared);

impl Link for BenchLink {
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError> {
        let (blocks_ms, fails, dies) = with(&self.0, |b| {
            b.rendered.push(command.wrench.force.x);
            (std::mem::take(&mut b.blocks_ms), b.fails, b.dies)
        });
        std::thread::sleep(Duration::from_millis(blocks_ms.max(1)));
        let error = DeviceError::NoAnswer {
            device: "bench".to_owned(),
            reason: "unplugged".to_owned(),
        };
        match (fails, dies) {
            (_, true) => Err(DeviceError::Gone {
                reason: "unplugged".to_owned(),
            }),
            (true, _) => Err(error),
            _ => Ok(Some(HandleState::at_rest(DPose3::IDENTITY))),
        }
    }

    fn close(&mut self) {
        with(&self.0, |b| b.closed += 1);
    }
}

fn open(bench: &Shared) -> Opened {
    let bench = Arc::clone(bench);
    Threaded::open(move || {
        with(&bench, |b| b.connections += 1);
        let identity = Identity {
            name: "bench".to_owned(),
            limits: Limits::virtuose_6d(),
            notes: vec!["a note".to_owned()],
        };
        Ok((
            identity,
            Box::new(BenchLink(Arc::clone(&bench))) as Box<dyn Link>,
        ))
    })
    .unwrap()
}

/// Waits until it holds, for five seconds at most.
fn wait_until(mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed().as_secs() < 5, "it never came to be");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn push(x: f64) -> Command {
    Wrench::new(DVec3::new(x, 0.0, 0.0), DVec3::ZERO).into()
}

#[test]
fn states_come_and_commands_go_without_waiting() {
    let bench = Shared::default();
    let mut opened = open(&bench);
    assert_eq!(opened.notes, ["a note"]);
    wait_until(|| opened.device.read(0.5).is_ok());
    assert_eq!(opened.device.read(0.7).unwrap().time_s, 0.7);
    wait_until(|| {
        opened.device.write(&push(3.0)).unwrap();
        with(&bench, |b| b.rendered.last() == Some(&3.0))
    });
    drop(opened);
    assert_eq!(with(&bench, |b| b.closed), 1);
}

#[test]
fn command_that_is_not_renewed_fades_to_zero() {
    let bench = Shared::default();
    let mut opened = open(&bench);
    wait_until(|| {
        opened.device.write(&push(3.0)).unwrap();
        with(&bench, |b| b.rendered.last() == Some(&3.0))
    });
    wait_until(|| with(&bench, |b| b.rendered.last() == Some(&0.0)));
}

#[test]
fn link_that_blocks_makes_the_device_silent_and_is_told() {
    let bench = Shared::default();
    let mut opened = open(&bench);
    wait_until(|| opened.device.read(0.0).is_ok());
    with(&bench, |b| b.blocks_ms = 200);
    wait_until(|| matches!(opened.device.read(0.0), Err(DeviceError::Silent { .. })));
    wait_until(|| opened.device.read(0.0).is_ok());
    let message = opened
        .messages
        .recv_timeout(Duration::from_secs(5))
        .unwrap();
    assert!(message.contains("was busy for"), "{message}");
}

#[test]
fn link_that_fails_once_is_told_once_and_goes_on() {
    let bench = Shared::default();
    let mut opened = open(&bench);
    with(&bench, |b| b.fails = true);
    let message = opened
        .messages
        .recv_timeout(Duration::from_secs(5))
        .unwrap();
    assert!(message.contains("unplugged"), "{message}");
    with(&bench, |b| b.fails = false);
    wait_until(|| opened.device.read(0.0).is_ok());
    assert_eq!(with(&bench, |b| b.connections), 1);
}

#[test]
fn lost_link_is_closed_and_opened_again() {
    let bench = Shared::default();
    let mut opened = open(&bench);
    with(&bench, |b| b.dies = true);
    let message = opened
        .messages
        .recv_timeout(Duration::from_secs(5))
        .unwrap();
    assert!(message.contains("is lost"), "{message}");
    wait_until(|| opened.device.read(0.0).is_err());
    with(&bench, |b| b.dies = false);
    wait_until(|| opened.device.read(0.0).is_ok());
    assert!(with(&bench, |b| (b.connections >= 2) && (b.closed >= 1)));
}

#[test]
fn first_connection_that_fails_is_the_error_of_opening() {
    let refused = Threaded::open(|| {
        Err(Unavailable::NotThere {
            reason: "nothing attached".to_owned(),
        })
    });
    assert_eq!(refused.unwrap_err().to_string(), "nothing attached");
}

#[test]
fn command_that_is_not_finite_is_refused_before_the_link() {
    let bench = Shared::default();
    let mut opened = open(&bench);
    assert!(opened.device.write(&push(f64::NAN)).is_err());
    wait_until(|| with(&bench, |b| b.rendered.len() > 5));
    assert!(with(&bench, |b| b.rendered.iter().all(|x| *x == 0.0)));
}

#[test]
fn the_same_words_are_told_once_and_many_different_ones_have_an_end() {
    let mut told = Told::default();
    assert!(told.is_news("no answer"));
    assert!(!told.is_news("no answer"));
    assert!(told.is_news("another"));
    let more = (0..1000).filter(|k| told.is_news(&format!("{k}"))).count();
    assert_eq!(more, WORDS_MAX - 2);
}

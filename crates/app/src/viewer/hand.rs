//! The hand behind mouse, keys and slider: where it wants the handle of a simulated device.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use device::Guide;
use glam::DVec3;
use glamx::DPose3;

use crate::Error;

/// Of the scene's travel, how far the slider goes beyond it.
const BEYOND: f64 = 1.25;

/// s, that a demonstration rests at the end of the way.
const REST_S: f64 = 0.6;

/// Time between two moves of the hand.
const BEAT: Duration = Duration::from_millis(4);

/// What a demonstration is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Show {
    Push,
    /// s, that are left.
    Rest(f64),
    Pull,
}

/// The way of a hand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// The handle at the start, world.
    pub(crate) start: DPose3,
    /// Unit vector, world.
    pub(crate) direction: DVec3,
    /// m, to the end of the scene's way.
    pub(crate) travel: f64,
    /// m/s.
    pub(crate) speed: f64,
    /// m, how far the handle gets from the start along each axis of the world.
    pub(crate) reach: DVec3,
}

/// What is asked of a hand.
#[derive(Clone, Copy, Debug)]
enum Wish {
    /// To a place along the approach direction, m.
    PushTo(f64),
    /// By a way in the world, m.
    Drag(DVec3),
    /// Goes on at a velocity, world, m/s; zero stands still.
    Go(DVec3),
    Reset,
    ToggleShow,
}

/// A hand on a thread of its own, so that it moves evenly however slow the window is; it ends with this.
pub(crate) struct Hand {
    wishes: Sender<Wish>,
    way: Way,
    /// Bits of the m along the approach direction, and whether a demonstration is on.
    push: Arc<AtomicU64>,
    shows: Arc<AtomicBool>,
}

impl Hand {
    /// # Errors
    /// A thread that cannot be started.
    pub(crate) fn new(guide: Guide, way: Way) -> Result<Self, Error> {
        let (wishes, asked) = channel();
        let (push, shows) = (Arc::default(), Arc::default());
        let hand = Self {
            wishes,
            way,
            push: Arc::clone(&push),
            shows: Arc::clone(&shows),
        };
        let mut mover = Mover::new(guide, way);
        let work = move || {
            let mut last = Instant::now();
            loop {
                match asked.recv_timeout(BEAT) {
                    Ok(wish) => mover.take(wish),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
                let now = Instant::now();
                mover.advance((now - last).as_secs_f64());
                last = now;
                push.store(mover.push.to_bits(), Ordering::Relaxed);
                shows.store(mover.show.is_some(), Ordering::Relaxed);
            }
        };
        std::thread::Builder::new()
            .name("hand".to_owned())
            .spawn(work)
            .map_err(Error::io(Path::new("the hand"), "start the thread of"))?;
        Ok(hand)
    }

    fn ask(&self, wish: Wish) {
        // The thread ends after this only.
        let _ = self.wishes.send(wish);
    }

    /// m, along the approach direction.
    pub(super) fn push(&self) -> f64 {
        f64::from_bits(self.push.load(Ordering::Relaxed))
    }

    /// Whether a demonstration is on.
    pub(super) fn shows(&self) -> bool {
        self.shows.load(Ordering::Relaxed)
    }

    /// m, from 0 to the end of the slider.
    pub(super) fn longest(&self) -> f64 {
        BEYOND * self.way.travel
    }

    /// m/s, of keys and demonstrations.
    pub(super) fn speed(&self) -> f64 {
        self.way.speed
    }

    /// Unit vector of the approach, world.
    pub(super) fn direction(&self) -> DVec3 {
        self.way.direction
    }

    /// Goes to a place along the approach direction, m.
    pub(crate) fn push_to(&self, push: f64) {
        self.ask(Wish::PushTo(push));
    }

    /// Moves by a way in the world, m.
    pub(super) fn drag(&self, way: DVec3) {
        self.ask(Wish::Drag(way));
    }

    /// Goes on at a velocity, world, m/s, until told otherwise.
    pub(super) fn go_at(&self, velocity: DVec3) {
        self.ask(Wish::Go(velocity));
    }

    /// Back to the start.
    pub(super) fn reset(&self) {
        self.ask(Wish::Reset);
    }

    /// Pushes to the end of the way and pulls back, from the start; ends a demonstration that is on.
    pub(super) fn toggle_show(&self) {
        self.ask(Wish::ToggleShow);
    }
}

/// Where a hand is, and how it goes on.
struct Mover {
    guide: Guide,
    way: Way,
    /// m, along the direction.
    push: f64,
    /// m, across it.
    aside: DVec3,
    show: Option<Show>,
    /// m/s, world.
    velocity: DVec3,
}

impl Mover {
    fn new(guide: Guide, way: Way) -> Self {
        Self {
            guide,
            way,
            push: 0.0,
            aside: DVec3::ZERO,
            show: None,
            velocity: DVec3::ZERO,
        }
    }

    fn take(&mut self, wish: Wish) {
        match wish {
            Wish::PushTo(push) => self.push_to(push),
            Wish::Drag(way) => self.drag(way),
            Wish::Go(velocity) => self.velocity = velocity,
            Wish::Reset => self.reset(),
            Wish::ToggleShow => self.toggle_show(),
        }
    }

    /// Goes to a place along the approach direction, m.
    fn push_to(&mut self, push: f64) {
        self.show = None;
        self.go(push, self.aside);
    }

    /// Moves by a way in the world, m.
    fn drag(&mut self, way: DVec3) {
        self.show = None;
        let along = way.dot(self.way.direction);
        let across = way - along * self.way.direction;
        self.go(self.push + along, self.aside + across);
    }

    /// Back to the start.
    fn reset(&mut self) {
        self.show = None;
        self.go(0.0, DVec3::ZERO);
    }

    /// Pushes to the end of the way and pulls back, from the start; ends a demonstration that is on.
    fn toggle_show(&mut self) {
        if self.show.take().is_none() {
            self.go(0.0, DVec3::ZERO);
            self.show = Some(Show::Push);
        }
    }

    /// Goes on. `elapsed_s`: since the last time.
    fn advance(&mut self, elapsed_s: f64) {
        let step = self.way.speed * elapsed_s;
        if self.velocity != DVec3::ZERO {
            self.drag(self.velocity * elapsed_s);
        }
        match self.show {
            None => {}
            Some(Show::Push) => {
                self.go((self.push + step).min(self.way.travel), self.aside);
                if self.push >= self.way.travel * (1.0 - 1e-9) {
                    self.show = Some(Show::Rest(REST_S));
                }
            }
            Some(Show::Rest(left_s)) => {
                self.show = Some(if left_s > elapsed_s {
                    Show::Rest(left_s - elapsed_s)
                } else {
                    Show::Pull
                });
            }
            Some(Show::Pull) => {
                self.go((self.push - step).max(0.0), self.aside);
                if self.push <= 0.0 {
                    self.show = None;
                }
            }
        }
    }

    /// As far as the device gets.
    fn go(&mut self, push: f64, aside: DVec3) {
        let Way {
            start,
            direction,
            reach,
            ..
        } = self.way;
        let shift = (push * direction + aside).clamp(-reach, reach);
        if !shift.is_finite() {
            return;
        }
        self.push = shift.dot(direction);
        self.aside = shift - self.push * direction;
        let pose = DPose3 {
            translation: start.translation + shift,
            ..start
        };
        // A finite pose with the start's rotation is never refused.
        let _ = self.guide.set_target(pose);
    }
}

#[cfg(test)]
mod tests {
    use device::{HandSettings, SimulatedHand};

    use super::*;

    fn mover() -> Mover {
        let start = DPose3::from_translation(DVec3::new(0.0, 0.014, 0.0));
        let guided = SimulatedHand::guided(HandSettings::default(), start, 1e-3);
        let way = Way {
            start,
            direction: DVec3::NEG_Y,
            travel: 0.01,
            speed: 0.02,
            reach: DVec3::splat(0.05),
        };
        Mover::new(guided.unwrap().0, way)
    }

    #[test]
    fn a_drag_goes_along_and_across_the_way_and_no_further_than_the_device() {
        let mut hand = mover();
        hand.drag(DVec3::new(0.003, -0.002, 0.0));
        assert!((hand.push - 0.002).abs() < 1e-15);
        let target = hand.guide.target().translation;
        assert!((target - DVec3::new(0.003, 0.012, 0.0)).length() < 1e-15);
        hand.drag(DVec3::new(0.0, -9.0, 0.0));
        assert!((hand.push - 0.05).abs() < 1e-15);
        hand.drag(DVec3::NAN);
        assert!((hand.push - 0.05).abs() < 1e-15);
        hand.reset();
        assert_eq!(hand.guide.target().translation, DVec3::new(0.0, 0.014, 0.0));
    }

    #[test]
    fn a_demonstration_goes_in_and_comes_back() {
        let mut hand = mover();
        hand.toggle_show();
        let mut deepest = 0.0_f64;
        for _ in 0..200 {
            hand.advance(0.016);
            deepest = deepest.max(hand.push);
        }
        assert!((deepest - 0.01).abs() < 1e-12 && hand.push == 0.0 && hand.show.is_none());
    }
}

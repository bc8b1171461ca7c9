//! The hand behind mouse, keys and slider: where it wants the handle of a simulated device.

use device::Guide;
use glam::DVec3;
use glamx::DPose3;

/// Of the scene's travel, how far the slider goes beyond it.
const BEYOND: f64 = 1.25;

/// s, that a demonstration rests at the end of the way.
const REST_S: f64 = 0.6;

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

/// A hand.
pub(crate) struct Hand {
    guide: Guide,
    way: Way,
    /// m, along the direction.
    push: f64,
    /// m, across it.
    aside: DVec3,
    show: Option<Show>,
}

impl Hand {
    pub(crate) fn new(guide: Guide, way: Way) -> Self {
        Self {
            guide,
            way,
            push: 0.0,
            aside: DVec3::ZERO,
            show: None,
        }
    }

    /// m, along the approach direction.
    pub(super) fn push(&self) -> f64 {
        self.push
    }

    /// m, from 0 to the end of the slider.
    pub(super) fn longest(&self) -> f64 {
        BEYOND * self.way.travel
    }

    /// m/s, of keys and demonstrations.
    pub(super) fn speed(&self) -> f64 {
        self.way.speed
    }

    /// Goes to a place along the approach direction, m.
    pub(crate) fn push_to(&mut self, push: f64) {
        self.show = None;
        self.go(push, self.aside);
    }

    /// Moves by a way in the world, m.
    pub(super) fn drag(&mut self, way: DVec3) {
        self.show = None;
        let along = way.dot(self.way.direction);
        let across = way - along * self.way.direction;
        self.go(self.push + along, self.aside + across);
    }

    /// Back to the start.
    pub(super) fn reset(&mut self) {
        self.show = None;
        self.go(0.0, DVec3::ZERO);
    }

    /// Whether a demonstration is on.
    pub(super) fn shows(&self) -> bool {
        self.show.is_some()
    }

    /// Pushes to the end of the way and pulls back, from the start; ends a demonstration that is on.
    pub(super) fn toggle_show(&mut self) {
        if self.show.take().is_none() {
            self.go(0.0, DVec3::ZERO);
            self.show = Some(Show::Push);
        }
    }

    /// Goes on with a demonstration. `elapsed_s`: since the last time.
    pub(super) fn advance(&mut self, elapsed_s: f64) {
        let step = self.way.speed * elapsed_s;
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

    fn hand() -> Hand {
        let start = DPose3::from_translation(DVec3::new(0.0, 0.014, 0.0));
        let guided = SimulatedHand::guided(HandSettings::default(), start, 1e-3);
        let way = Way {
            start,
            direction: DVec3::NEG_Y,
            travel: 0.01,
            speed: 0.02,
            reach: DVec3::splat(0.05),
        };
        Hand::new(guided.unwrap().0, way)
    }

    #[test]
    fn a_drag_goes_along_and_across_the_way_and_no_further_than_the_device() {
        let mut hand = hand();
        hand.drag(DVec3::new(0.003, -0.002, 0.0));
        assert!((hand.push() - 0.002).abs() < 1e-15);
        let target = hand.guide.target().translation;
        assert!((target - DVec3::new(0.003, 0.012, 0.0)).length() < 1e-15);
        hand.drag(DVec3::new(0.0, -9.0, 0.0));
        assert!((hand.push() - 0.05).abs() < 1e-15);
        hand.drag(DVec3::NAN);
        assert!((hand.push() - 0.05).abs() < 1e-15);
        hand.reset();
        assert_eq!(hand.guide.target().translation, DVec3::new(0.0, 0.014, 0.0));
    }

    #[test]
    fn a_demonstration_goes_in_and_comes_back() {
        let mut hand = hand();
        hand.toggle_show();
        let mut deepest = 0.0_f64;
        for _ in 0..200 {
            hand.advance(0.016);
            deepest = deepest.max(hand.push());
        }
        assert!((deepest - 0.01).abs() < 1e-12 && hand.push() == 0.0 && !hand.shows());
    }
}

//! The way on which settings are compared, and the increments in which each goes it.

use glam::DVec3;
use glamx::DPose3;

use crate::scene::{Hand, Handle, Scene};
use crate::session::{Held, Holds};

/// Increments of the scene's own size on a way at most.
const MOST_STEPS: usize = 1000;

/// Moments at which displacement and penetration are looked at.
const MOMENTS: usize = 30;

/// Way between two steps, as a power of two of the scene's own. With friction the forces depend on it, because each step is
/// one increment of the slip; without, the force at a place is that of the place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Increment(i8);

impl Increment {
    /// The scene's own: what its hand goes in a period, or `drive.step`.
    pub const OWN: Self = Self(0);

    /// Of what is taken for exact: a quarter of the finest that is compared, so that this one's error is seen to a quarter.
    pub(super) const EXACT: Self = Self(-4);

    /// Those that are compared, from a quarter to four times the scene's own.
    pub(super) const COMPARED: [Self; 5] = [Self(-2), Self(-1), Self(0), Self(1), Self(2)];

    /// Twice as large.
    pub(super) fn doubled(self) -> Self {
        Self(self.0 + 1)
    }

    /// Whether it is a line of the tables; finer ones are references, which nobody times.
    pub(super) fn is_compared(self) -> bool {
        Self::COMPARED.contains(&self)
    }

    /// Over the scene's own.
    fn ratio(self) -> f64 {
        2f64.powi(i32::from(self.0))
    }

    /// Steps in which one of the scene's own is gone.
    fn parts(self) -> usize {
        1 << (-self.0).max(0)
    }

    /// Of the scene's own that are gone in one.
    fn stride(self) -> usize {
        1 << self.0.max(0)
    }
}

/// How the held body goes: from the start to the end of its travel, rigidly as in the part's own curve, so
/// that all settings are asked the same question.
#[derive(Clone, Debug)]
pub(super) struct Course {
    held: Held,
    direction: DVec3,
    /// m.
    travel: f64,
    /// Increments of the scene's own size; wrenches are compared at their ends, the places.
    n: usize,
    /// Every so manieth place is one that the largest increments come to too.
    unit: usize,
}

/// Places at which a setting is compared.
#[derive(Clone, Debug)]
pub(super) struct Places {
    /// Those that it comes to.
    pub(super) gone: Vec<usize>,
    /// Those of them that all settings come to. Where a contact lands, the force is wrong in one increment and right again
    /// in the next: at other places, other such moments would be seen.
    pub(super) common: Vec<usize>,
}

impl Places {
    /// By common place, which of those gone to it is.
    pub(super) fn common_of_gone(&self) -> Vec<usize> {
        let is_common = |i: &usize| self.common.binary_search(&self.gone[*i]).is_ok();
        (0..self.gone.len()).filter(is_common).collect()
    }
}

/// A step of a way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    /// Of the tool.
    pub(super) target: DPose3,
    /// Which place this is, if it is one.
    pub(super) place: Option<usize>,
}

impl Course {
    pub(super) fn of(scene: &Scene) -> Self {
        let drive = &scene.drive;
        let per_period = |hand: &Hand| hand.speed * scene.device.servo_period;
        let per_step = scene.hand.as_ref().map_or(drive.step, per_period);
        let has_friction = scene.effects.simulated_friction().is_some();
        let largest = Increment::COMPARED.map(Increment::stride).into_iter().max();
        Self {
            // Nothing turns, so that where the body is held does not matter.
            held: Held {
                holds: match scene.handle {
                    Handle::Tool => Holds::Tool,
                    Handle::Part => Holds::Part,
                },
                grip: DVec3::ZERO,
                tool_pose: scene.tool.pose_part_tool,
            },
            direction: drive.direction,
            travel: drive.travel,
            n: ((drive.travel / per_step).ceil() as usize).clamp(1, MOST_STEPS),
            unit: largest.filter(|_| has_friction).unwrap_or(1),
        }
    }

    /// Places at which wrenches are compared.
    pub(super) fn n_places(&self) -> usize {
        self.n + 1
    }

    /// m.
    pub(super) fn length(&self, increment: Increment) -> f64 {
        self.travel / self.n as f64 * increment.ratio()
    }

    /// Steps in which the way is gone.
    pub(super) fn n_steps(&self, increment: Increment) -> usize {
        (self.n * increment.parts()).div_ceil(increment.stride())
    }

    /// Where a way in these increments is compared.
    pub(super) fn places(&self, increment: Increment) -> Places {
        Places {
            gone: self.each(increment.stride()),
            common: self.each(self.unit),
        }
    }

    /// Each so manieth place, and the end.
    fn each(&self, stride: usize) -> Vec<usize> {
        (0..self.n).step_by(stride).chain([self.n]).collect()
    }

    /// The way in these increments. Targets of the same place are the same to the last bit.
    pub(super) fn way(&self, increment: Increment) -> Vec<Stop> {
        let parts = increment.parts();
        let last = self.n * parts;
        let inner = (0..last).step_by(increment.stride());
        let stop = |k: usize| {
            let shift = self.travel * k as f64 / last as f64 * self.direction;
            Stop {
                target: self.held.target(&self.held.along(shift)),
                place: k.is_multiple_of(parts).then_some(k / parts),
            }
        };
        inner.chain([last]).map(stop).collect()
    }

    /// Places at which displacement and penetration are looked at.
    pub(super) fn moments(&self) -> Vec<usize> {
        let moment = |i: usize| match i * self.n / MOMENTS {
            place if place == self.n => place,
            place => place / self.unit * self.unit,
        };
        (1..=MOMENTS).map(moment).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(n: usize) -> Course {
        Course {
            held: Held {
                holds: Holds::Tool,
                grip: DVec3::ZERO,
                tool_pose: DPose3::IDENTITY,
            },
            direction: DVec3::X,
            travel: 0.7e-3,
            n,
            unit: 4,
        }
    }

    #[test]
    fn ways_in_other_increments_come_to_the_same_places() {
        // 14 is no multiple of 4: the last of the largest increments is shorter.
        let course = course(14);
        let own = course.way(Increment::OWN);
        assert_eq!((own.len(), course.n_places()), (15, 15));
        for increment in Increment::COMPARED.into_iter().chain([Increment::EXACT]) {
            let way = course.way(increment);
            assert_eq!(way.len(), course.n_steps(increment) + 1, "{increment:?}");
            let gone: Vec<usize> = way.iter().filter_map(|stop| stop.place).collect();
            let places = course.places(increment);
            assert_eq!(gone, places.gone);
            let common = places.common_of_gone().into_iter().map(|i| gone[i]);
            assert_eq!(common.collect::<Vec<_>>(), [0, 4, 8, 12, 14]);
            for stop in way {
                if let Some(place) = stop.place {
                    let there = own[place].target.translation;
                    assert_eq!(stop.target.translation, there, "to the last bit");
                }
            }
            let moments = course.moments();
            assert!(moments.iter().all(|m| gone.contains(m)), "{moments:?}");
        }
        assert_eq!(course.way(Increment(-2)).len(), 57);
        assert!((course.length(Increment(-2)) - 12.5e-6).abs() < 1e-18);
    }

    #[test]
    fn a_way_of_one_step_has_no_larger_ones() {
        let course = course(1);
        assert_eq!(course.places(Increment(2)).gone, [0, 1]);
        assert_eq!(course.n_steps(Increment(2)), 1);
    }
}

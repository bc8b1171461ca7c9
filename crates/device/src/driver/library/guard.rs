//! What stands between a link and its library: no wrench that is not finite or too large, no pose that is none, no
//! more calls than are of use, no flood of messages.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use glam::{DMat3, DQuat, DVec3};
use glamx::DPose3;

use crate::driver::link::STALE_S;
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandPresence, HandleState, Limits, Readiness};
use crate::wrench::{Wrench, limit_length};

/// Time in which one message is not repeated, s: a bit that flickers must not flood the user.
const QUIET_S: f64 = 10.0;

/// Messages that wait to be fetched; beyond them new ones are dropped.
const MESSAGES_MAX: usize = 16;

/// How far the square of a quaternion's length may be from 1 before the pose counts as nonsense. Dimensionless;
/// what a device reports in single precision is off by 1e-6.
const UNIT_TOLERANCE: f64 = 1e-2;

/// Handle speed below which a device that has cut its force may be switched on again, m/s.
pub(in crate::driver) const AT_REST: f64 = 0.1;

/// Time for which an opened gate still lets nothing through, s: so zero has surely gone out once.
const ZERO_S: f64 = 0.01;

/// Time in which a gate opens after that, s: after any trouble the force comes back slowly.
const OPENING_S: f64 = 0.2;

/// Shortest time between a cut of the force and switching on again, s.
pub(in crate::driver) const REST_S: f64 = 1.0;

/// Whether a link gives its library any force: shut until all is ready, shut at any trouble, and opened slowly.
#[derive(Debug, Default)]
pub(in crate::driver) struct Gate {
    opened_at: Option<Instant>,
}

impl Gate {
    /// Opens it where the sample says that all is ready and the library took no longer than a sample may be old;
    /// shuts it otherwise.
    pub(in crate::driver) fn judge(
        &mut self,
        answer: &Result<HandleState, DeviceError>,
        took: Duration,
    ) {
        let is_open = took.as_secs_f64() <= STALE_S
            && answer.as_ref().is_ok_and(|state| {
                state.hand != HandPresence::Absent && state.readiness == Readiness::Ready
            });
        if is_open {
            self.opened_at.get_or_insert_with(Instant::now);
        } else {
            self.shut();
        }
    }

    pub(in crate::driver) fn shut(&mut self) {
        self.opened_at = None;
    }

    /// Part of the force that goes through now, in [0, 1].
    pub(in crate::driver) fn gain(&self) -> f64 {
        self.opened_at.map_or(0.0, |at| {
            ((at.elapsed().as_secs_f64() - ZERO_S) / OPENING_S).clamp(0.0, 1.0)
        })
    }
}

/// The wrench a link may give to its library: within the limits, times the gain of its gate.
///
/// # Errors
/// [`DeviceError::NonFiniteWrench`], with which nothing is rendered: the loop refuses such a wrench before, but no
/// library may ever see one.
pub(in crate::driver) fn allowed(
    command: &Command,
    gain: f64,
    limits: &Limits,
    device: &str,
) -> Result<Wrench, DeviceError> {
    if !command.wrench.is_finite() {
        return Err(DeviceError::NonFiniteWrench {
            device: device.to_owned(),
        });
    }
    if gain == 0.0 {
        return Ok(Wrench::ZERO);
    }
    let limited = Wrench::new(
        limit_length(command.wrench.force, limits.peak_force),
        limit_length(command.wrench.torque, limits.peak_torque),
    );
    Ok(limited * gain)
}

/// A pose as a library gave it, or nothing where its numbers cannot be one.
pub(in crate::driver) fn sound_pose(position: DVec3, rotation: DQuat) -> Option<DPose3> {
    let off_unit = (rotation.length_squared() - 1.0).abs();
    (position.is_finite() && off_unit <= UNIT_TOLERANCE)
        .then(|| DPose3::from_parts(position, rotation.normalize()))
}

/// A pose from a position and the axes of the handle, or nothing where they are not at right angles and of length 1.
pub(in crate::driver) fn sound_frame(position: DVec3, axes: DMat3) -> Option<DPose3> {
    let residual = axes.transpose() * axes - DMat3::IDENTITY;
    let largest = residual
        .to_cols_array()
        .iter()
        .fold(0.0, |worst: f64, r| worst.max(r.abs()));
    let is_rotation = axes.is_finite() && largest <= UNIT_TOLERANCE && axes.determinant() > 0.0;
    is_rotation
        .then(|| sound_pose(position, DQuat::from_mat3(&axes).normalize()))
        .flatten()
}

/// The error of a device whose numbers are no pose.
pub(in crate::driver) fn nonsense(device: &str) -> DeviceError {
    DeviceError::NoAnswer {
        device: device.to_owned(),
        reason:
            "the pose it reports is no pose (not finite, or not a rotation); no force goes to it"
                .to_owned(),
    }
}

/// Keeps a link from calling its library more often than is of use.
#[derive(Debug)]
pub(in crate::driver) struct Pace {
    period: Duration,
    next: Instant,
}

impl Pace {
    pub(in crate::driver) fn new(period_s: f64) -> Self {
        Self {
            period: Duration::from_secs_f64(period_s),
            next: Instant::now(),
        }
    }

    /// Waits until a period has gone by since the last return; what was missed is not made up for.
    pub(in crate::driver) fn wait(&mut self) {
        let now = Instant::now();
        if self.next > now {
            std::thread::sleep(self.next - now);
        }
        self.next = self.next.max(now) + self.period;
    }
}

/// What a link has to tell the user.
#[derive(Debug, Default)]
pub(in crate::driver) struct Notices {
    waiting: VecDeque<String>,
    told: Vec<(&'static str, Instant)>,
}

impl Notices {
    /// Tells it, unless the same (by `key`) was told a short while ago.
    pub(in crate::driver) fn say(&mut self, key: &'static str, text: impl FnOnce() -> String) {
        self.told
            .retain(|(_, at)| at.elapsed().as_secs_f64() < QUIET_S);
        if self.told.iter().any(|(told, _)| *told == key) || self.waiting.len() >= MESSAGES_MAX {
            return;
        }
        self.told.push((key, Instant::now()));
        self.waiting.push_back(text());
    }

    pub(in crate::driver) fn next(&mut self) -> Option<String> {
        self.waiting.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrench_is_held_to_the_limits_and_zero_while_the_gate_is_shut() {
        let limits = Limits::virtuose_6d();
        let far = Command::from(Wrench::new(DVec3::splat(1e200), DVec3::NEG_Z * 9.0));
        let open = allowed(&far, 1.0, &limits, "test").unwrap();
        assert!((open.force - DVec3::splat(35.0 / 3_f64.sqrt())).length() < 1e-9);
        assert!((open.torque - DVec3::NEG_Z * 3.1).length() < 1e-12);
        assert_eq!(allowed(&far, 0.0, &limits, "test"), Ok(Wrench::ZERO));
    }

    #[test]
    fn wrench_that_is_not_finite_never_passes() {
        let limits = Limits::virtuose_6d();
        for i in 0..6 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut numbers = [0.0; 6];
                numbers[i] = bad;
                let command = Command::from(Wrench::from_array(&numbers));
                for gain in [0.0, 1.0] {
                    let refused = allowed(&command, gain, &limits, "test").unwrap_err();
                    assert!(matches!(refused, DeviceError::NonFiniteWrench { .. }));
                }
            }
        }
    }

    #[test]
    fn gate_opens_slowly_where_all_is_ready_and_shuts_at_once() {
        let ready = HandleState::at_rest(DPose3::IDENTITY);
        let mut gate = Gate::default();
        assert_eq!(gate.gain(), 0.0);
        gate.judge(&Ok(ready), Duration::ZERO);
        assert!(gate.gain() < 1.0 || gate.opened_at.unwrap().elapsed().as_secs_f64() >= OPENING_S);
        gate.opened_at = Instant::now().checked_sub(Duration::from_secs(1));
        gate.judge(&Ok(ready), Duration::ZERO);
        assert_eq!(gate.gain(), 1.0);
        let troubles = [
            Err(nonsense("test")),
            Ok(HandleState {
                hand: HandPresence::Absent,
                ..ready
            }),
            Ok(HandleState {
                readiness: Readiness::Waiting("x"),
                ..ready
            }),
            Ok(HandleState {
                readiness: Readiness::Tripped("x"),
                ..ready
            }),
        ];
        for trouble in troubles {
            gate.opened_at = Instant::now().checked_sub(Duration::from_secs(1));
            gate.judge(&trouble, Duration::ZERO);
            assert_eq!(gate.gain(), 0.0, "{trouble:?}");
        }
        gate.judge(&Ok(ready), Duration::from_millis(60));
        assert_eq!(gate.opened_at, None);
    }

    #[test]
    fn pose_is_sound_only_where_it_is_finite_and_a_rotation() {
        let p = DVec3::new(0.1, -0.2, 0.3);
        let q = DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5);
        let rounded = sound_pose(p, q * 1.001).unwrap();
        assert!((rounded.rotation.length() - 1.0).abs() < 1e-12);
        assert!(sound_pose(p * f64::NAN, q).is_none());
        assert!(sound_pose(p, q * f64::NAN).is_none());
        assert!(sound_pose(p, q * 1.1).is_none());
        assert!(sound_pose(p, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)).is_none());

        let axes = DMat3::from_quat(q);
        let framed = sound_frame(p, axes).unwrap();
        assert!(framed.rotation.angle_between(q) < 1e-7);
        assert!(sound_frame(p, axes * 1.1).is_none());
        assert!(sound_frame(p, axes * f64::NAN).is_none());
        assert!(sound_frame(p, DMat3::ZERO).is_none());
        // A mirror is no rotation.
        let mirror = DMat3::from_cols(-axes.x_axis, axes.y_axis, axes.z_axis);
        assert!(sound_frame(p, mirror).is_none());
    }

    #[test]
    fn notice_is_told_once_and_no_crowd_waits() {
        let mut notices = Notices::default();
        notices.say("hot", || "the motors are hot".to_owned());
        notices.say("hot", || "the motors are hot".to_owned());
        assert_eq!(notices.next().as_deref(), Some("the motors are hot"));
        assert_eq!(notices.next(), None);
        let keys: Vec<&'static str> = (0..100)
            .map(|i| &*Box::leak(i.to_string().into_boxed_str()))
            .collect();
        for key in &keys {
            notices.say(key, || (*key).to_owned());
        }
        assert_eq!(std::iter::from_fn(|| notices.next()).count(), MESSAGES_MAX);
    }
}

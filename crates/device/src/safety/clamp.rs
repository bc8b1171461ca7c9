//! The largest force and torque, each kept in its direction.

use super::events::SafetyEvents;
use crate::wrench::{Wrench, limit_length};

/// Shortens forces and torques, each by its own norm: N and N m are never in one.
#[derive(Debug, Clone)]
pub(super) struct NormClamp {
    /// N.
    pub(super) force_max: f64,
    /// N m.
    pub(super) torque_max: f64,
}

impl NormClamp {
    /// The wrench within the limits. Counted where it was beyond.
    pub(super) fn pass(&self, wanted: &Wrench, events: &mut SafetyEvents) -> Wrench {
        let clamped = Wrench::new(
            limit_length(wanted.force, self.force_max),
            limit_length(wanted.torque, self.torque_max),
        );
        // A device that renders no force or no torque at all is not limited in it.
        let is_shorter = (self.force_max > 0.0 && clamped.force != wanted.force)
            || (self.torque_max > 0.0 && clamped.torque != wanted.torque);
        events.wrenches_clamped += u64::from(is_shorter);
        clamped
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn force_and_torque_are_shortened_apart_and_keep_their_directions() {
        let clamp = NormClamp {
            force_max: 5.0,
            torque_max: 0.1,
        };
        let mut events = SafetyEvents::default();
        let wanted = Wrench::new(DVec3::new(3e200, 4e200, 0.0), DVec3::new(0.0, 0.05, 0.0));
        let passed = clamp.pass(&wanted, &mut events);
        assert!((passed.force - DVec3::new(3.0, 4.0, 0.0)).length() < 1e-14);
        // The small torque is not shortened with the force.
        assert_eq!(passed.torque, wanted.torque);
        assert_eq!(clamp.pass(&passed, &mut events), passed);
        assert_eq!(events.wrenches_clamped, 1);
    }

    #[test]
    fn limits_of_zero_let_nothing_through() {
        let clamp = NormClamp {
            force_max: 0.0,
            torque_max: 0.0,
        };
        let mut events = SafetyEvents::default();
        let wanted = Wrench::new(DVec3::splat(1e-300), DVec3::splat(1e300));
        assert_eq!(clamp.pass(&wanted, &mut events), Wrench::ZERO);
        assert_eq!(clamp.pass(&Wrench::ZERO, &mut events), Wrench::ZERO);
        // Such a device feels nothing; that it does is no event.
        assert_eq!(events.wrenches_clamped, 0);
        let force_alone = NormClamp {
            force_max: 1.0,
            ..clamp
        };
        let torque = Wrench::new(DVec3::ZERO, DVec3::X);
        assert_eq!(force_alone.pass(&torque, &mut events), Wrench::ZERO);
        assert_eq!(events.wrenches_clamped, 0);
        let beyond = Wrench::new(DVec3::X * 2.0, DVec3::X);
        assert_eq!(force_alone.pass(&beyond, &mut events).force, DVec3::X);
        assert_eq!(events.wrenches_clamped, 1);
    }
}

//! The first gate: nothing that is not a number comes any further.

use super::events::SafetyEvents;
use crate::haptic_device::Command;

/// Lets commands pass whose wrench and stiffness are finite.
#[derive(Debug, Clone)]
pub(super) struct FiniteCheck;

impl FiniteCheck {
    /// Is every number finite? Counted where not.
    pub(super) fn pass(&self, command: &Command, events: &mut SafetyEvents) -> bool {
        let is_finite = command.is_finite();
        events.wrenches_non_finite += u64::from(!is_finite);
        is_finite
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::wrench::Wrench;

    #[test]
    fn one_number_that_is_not_finite_stops_the_whole_command_and_is_counted() {
        let mut events = SafetyEvents::default();
        let good = Command {
            wrench: Wrench::new(DVec3::ONE, DVec3::ONE),
            stiffness: DMat3::IDENTITY,
        };
        assert!(FiniteCheck.pass(&good, &mut events));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut by_part = [good; 3];
            by_part[0].wrench.force.y = bad;
            by_part[1].wrench.torque.z = bad;
            by_part[2].stiffness.x_axis.z = bad;
            assert!(by_part.iter().all(|c| !FiniteCheck.pass(c, &mut events)));
        }
        assert_eq!(events.wrenches_non_finite, 9);
    }
}

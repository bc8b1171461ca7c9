//! What the library says a device can do, as far as it can be believed.

use glam::DVec3;

use super::api::{Device, number};
use crate::haptic_device::Limits;

/// Directions in which a device pushes, where it has a torque.
const SIX: i32 = 6;

/// What the library states, in its units; not numbers where it stated nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stated {
    /// Least and largest x, y, z, mm.
    workspace: [f64; 6],
    /// N.
    force: f64,
    /// N.
    continuous_force: f64,
    /// N mm.
    torque: f64,
    /// N/mm.
    stiffness: f64,
    /// N s/mm.
    damping: f64,
    has_torque: bool,
}

impl Stated {
    pub(super) fn by(device: &Device) -> Self {
        let one = |what| {
            let [number] = device.doubles(what);
            number
        };
        let has_torque = device.integer(number::OUTPUT_FREEDOMS) == SIX;
        Self {
            workspace: device.doubles(number::WORKSPACE),
            force: one(number::MAX_FORCE),
            continuous_force: one(number::MAX_CONTINUOUS_FORCE),
            torque: if has_torque {
                one(number::MAX_TORQUE)
            } else {
                0.0
            },
            stiffness: one(number::MAX_STIFFNESS),
            damping: one(number::MAX_DAMPING),
            has_torque,
        }
    }

    /// The limits in SI, and a note for each number that cannot be believed and was replaced by a small one.
    pub(super) fn limits(&self) -> (Limits, Vec<String>) {
        let mut notes = Vec::new();
        let mut believe = |what: &str, unit: &str, value: f64, range: [f64; 2], otherwise: f64| {
            if (range[0]..=range[1]).contains(&value) {
                return value;
            }
            notes.push(format!(
                "the library states a {what} of {value} {unit}; {otherwise} {unit} is taken instead"
            ));
            otherwise
        };
        // What is taken instead is what the weakest of these devices can do all day.
        let peak_force = believe("largest force", "N", self.force, [0.5, 100.0], 0.88);
        let continuous = believe(
            "continuous force",
            "N",
            self.continuous_force,
            [0.1, 100.0],
            0.88,
        );
        let stiffness = believe(
            "largest stiffness",
            "N/m",
            1e3 * self.stiffness,
            [50.0, 2e4],
            400.0,
        );
        let damping = believe(
            "largest damping",
            "N s/m",
            1e3 * self.damping,
            [0.1, 100.0],
            1.0,
        );
        let peak_torque = if self.has_torque {
            believe(
                "largest torque",
                "N m",
                1e-3 * self.torque,
                [0.01, 2.0],
                0.1,
            )
        } else {
            0.0
        };
        let [x0, y0, z0, x1, y1, z1] = self.workspace;
        let half_extents = DVec3::new(x1 - x0, y1 - y0, z1 - z0)
            .to_array()
            .map(|extent| believe("workspace", "m (half)", 0.5e-3 * extent, [0.01, 2.0], 0.035));
        let limits = Limits {
            workspace_half_extents: DVec3::from_array(half_extents),
            continuous_force: continuous.min(peak_force),
            peak_force,
            peak_torque,
            position_resolution: 0.0,
            force_resolution: 0.0,
            rotation_resolution: 0.0,
            max_stiffness: Some(stiffness),
            max_rotational_stiffness: None,
            max_damping: Some(damping),
            damping: None,
            coulomb_friction: None,
        };
        (limits, notes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Touch, as far as its sheet says.
    const TOUCH: Stated = Stated {
        workspace: [-80.0, -60.0, -35.0, 80.0, 60.0, 35.0],
        force: 3.3,
        continuous_force: 0.88,
        torque: 0.0,
        stiffness: 0.5,
        damping: 0.003,
        has_torque: false,
    };

    #[test]
    fn stated_limits_become_si() {
        let (limits, notes) = TOUCH.limits();
        assert_eq!(notes, Vec::<String>::new());
        assert!((limits.workspace_half_extents - DVec3::new(0.080, 0.060, 0.035)).length() < 1e-12);
        assert_eq!(
            (
                limits.peak_force,
                limits.continuous_force,
                limits.peak_torque
            ),
            (3.3, 0.88, 0.0)
        );
        assert_eq!(
            (limits.max_stiffness, limits.max_damping),
            (Some(500.0), Some(3.0))
        );
    }

    #[test]
    fn torque_counts_only_where_the_device_pushes_in_six_directions() {
        let premium = Stated {
            torque: 188.0,
            has_torque: true,
            ..TOUCH
        };
        assert!((premium.limits().0.peak_torque - 0.188).abs() < 1e-12);
    }

    #[test]
    fn absurd_limits_are_replaced_by_small_ones_and_noted() {
        for bad in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e9] {
            let absurd = Stated {
                workspace: [bad, bad, bad, -bad, -bad, -bad],
                force: bad,
                continuous_force: bad,
                torque: bad,
                stiffness: bad,
                damping: bad,
                has_torque: true,
            };
            let (limits, notes) = absurd.limits();
            assert_eq!(notes.len(), 8, "{notes:?}");
            assert_eq!((limits.peak_force, limits.continuous_force), (0.88, 0.88));
            assert_eq!(
                (limits.peak_torque, limits.max_stiffness),
                (0.1, Some(400.0))
            );
            assert_eq!(limits.workspace_half_extents, DVec3::splat(0.035));
        }
    }

    #[test]
    fn continuous_force_is_never_above_the_peak() {
        let (limits, _) = Stated {
            continuous_force: 8.0,
            ..TOUCH
        }
        .limits();
        assert_eq!(limits.continuous_force, 3.3);
    }
}

//! The simulated hand: a mass on a grip that follows a script and feels the wrench of the device.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_not_negative, check_positive};
use crate::haptic_device::HandleState;
use crate::script::{Phase, Script};
use crate::wrench::{Wrench, rotation_from_vector, rotation_vector};

/// What the hand is like: apparent mass of hand and handle, and the grip between intent and handle.
///
/// The defaults are an assumption for a firm two-finger to power grip, not a measurement: they lie
/// within the orders of magnitude reported for human hands (mass 0.1 to 1 kg, stiffness 0.1 to 5 kN/m)
/// with both axes critically damped. Where the force against travel of the part alone is wanted, use a
/// stiffer grip: the handle lags its script by force/stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandSettings {
    /// Apparent mass of hand and handle, kg, above 0. Default 0.5, nominal 0.1 to 1.
    pub apparent_mass: f64,
    /// Stiffness of the grip, N/m, 0 or above. Default 2000, nominal 100 to 20 000.
    pub grip_stiffness: f64,
    /// Damping of the grip, N s/m, 0 or above. Default 63: critical for the two above.
    pub grip_damping: f64,
    /// Apparent moment of inertia about the handle point, the same about all axes, kg m², above 0.
    /// Default 1e-3.
    pub apparent_inertia: f64,
    /// Stiffness of the grip against rotation, N m/rad, 0 or above. Default 20.
    pub grip_rotational_stiffness: f64,
    /// Damping of the grip against rotation, N m s/rad, 0 or above. Default 0.28: critical.
    pub grip_rotational_damping: f64,
}

impl Default for HandSettings {
    fn default() -> Self {
        Self {
            apparent_mass: 0.5,
            grip_stiffness: 2000.0,
            grip_damping: 63.0,
            apparent_inertia: 1e-3,
            grip_rotational_stiffness: 20.0,
            grip_rotational_damping: 0.28,
        }
    }
}

/// A hand that holds the handle and wants it to follow a [`Script`].
///
/// ```text
/// m dv/dt = k (x* − x) + c (v* − v) + f         J dω/dt = k_r rotvec(R* R⁻¹) + c_r (ω* − ω) + t
/// ```
/// f, t: wrench of the device on the handle. Integrated at the servo period by backward Euler in the
/// grip (unconditionally stable in k and c) with the wrench of the last period, which is what a device
/// holds between two writes. The inertia is the same about all axes, so no gyroscopic term arises.
///
/// The same wrenches give the same bits.
#[derive(Debug, Clone)]
pub struct SimulatedHand {
    settings: HandSettings,
    script: Script,
    period_s: f64,
    steps: u64,
    pose: DPose3,
    linear_velocity: DVec3,
    angular_velocity: DVec3,
}

impl SimulatedHand {
    /// A hand at rest at the start of its script, to be stepped by `period_s` (s).
    ///
    /// # Errors
    /// Where a setting or the period is outside its range.
    pub fn new(settings: HandSettings, script: Script, period_s: f64) -> Result<Self, DeviceError> {
        check_positive("period_s", period_s)?;
        check_positive("apparent_mass", settings.apparent_mass)?;
        check_positive("apparent_inertia", settings.apparent_inertia)?;
        check_not_negative("grip_stiffness", settings.grip_stiffness)?;
        check_not_negative("grip_damping", settings.grip_damping)?;
        check_not_negative(
            "grip_rotational_stiffness",
            settings.grip_rotational_stiffness,
        )?;
        check_not_negative("grip_rotational_damping", settings.grip_rotational_damping)?;
        Ok(Self {
            settings,
            script,
            period_s,
            steps: 0,
            pose: script.start(),
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
        })
    }

    /// Advances the hand by one period under a constant wrench on the handle (about the handle point).
    ///
    /// Real-time: no allocation. The wrench must be finite.
    pub fn step(&mut self, wrench_on_handle: &Wrench) {
        debug_assert!(wrench_on_handle.is_finite());
        self.steps += 1;
        let h = self.period_s;
        let s = &self.settings;
        let target = self.script.target(self.time_s());

        // (m + h c + h² k) v₁ = m v₀ + h (k (x*₁ − x₀) + c v*₁ + f)
        let (m, k, c) = (s.apparent_mass, s.grip_stiffness, s.grip_damping);
        let stretch = target.pose.translation - self.pose.translation;
        let pull = stretch * k + target.linear_velocity * c + wrench_on_handle.force;
        self.linear_velocity = (self.linear_velocity * m + pull * h) / (m + h * c + h * h * k);

        // The same about the rotation vector from the handle to its target.
        let (j, k, c) = (
            s.apparent_inertia,
            s.grip_rotational_stiffness,
            s.grip_rotational_damping,
        );
        let twist = rotation_vector(target.pose.rotation * self.pose.rotation.inverse());
        let pull = twist * k + target.angular_velocity * c + wrench_on_handle.torque;
        self.angular_velocity = (self.angular_velocity * j + pull * h) / (j + h * c + h * h * k);

        self.pose = DPose3::from_parts(
            self.pose.translation + self.linear_velocity * h,
            (rotation_from_vector(self.angular_velocity * h) * self.pose.rotation).normalize(),
        );
    }

    /// Stops the handle at a mechanical limit: `position` is where it is held (m); the velocity into
    /// the limit is taken away on each axis that was moved.
    pub(crate) fn stop_at(&mut self, position: DVec3) {
        let moved = position.cmpne(self.pose.translation);
        self.linear_velocity = DVec3::select(moved, DVec3::ZERO, self.linear_velocity);
        self.pose.translation = position;
    }

    /// Wrench of the hand on the handle, about the handle point, N and N m: the force of the push.
    #[must_use]
    pub fn wrench_of_hand(&self) -> Wrench {
        let s = &self.settings;
        let target = self.script.target(self.time_s());
        let twist = rotation_vector(target.pose.rotation * self.pose.rotation.inverse());
        Wrench::new(
            (target.pose.translation - self.pose.translation) * s.grip_stiffness
                + (target.linear_velocity - self.linear_velocity) * s.grip_damping,
            twist * s.grip_rotational_stiffness
                + (target.angular_velocity - self.angular_velocity) * s.grip_rotational_damping,
        )
    }

    /// True state of the handle, before any rounding by a device; its time is the hand's own.
    #[must_use]
    pub fn state(&self) -> HandleState {
        HandleState {
            linear_velocity: self.linear_velocity,
            angular_velocity: self.angular_velocity,
            time_s: self.time_s(),
            ..HandleState::at_rest(self.pose)
        }
    }

    /// The hand's own time: periods stepped times the period, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.period_s
    }

    /// The period the hand is stepped by, s.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The motion the hand follows.
    #[must_use]
    pub fn script(&self) -> &Script {
        &self.script
    }

    /// What the hand is about now.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.script.phase(self.time_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::script::Insertion;

    fn still() -> Script {
        Script::new(&Insertion {
            start: DPose3::IDENTITY,
            direction: DVec3::X,
            speed: 1.0,
            travel: 0.0,
            hold_s: 100.0,
            retract: false,
        })
        .unwrap()
    }

    fn hand(settings: HandSettings) -> SimulatedHand {
        SimulatedHand::new(settings, still(), 1e-3).unwrap()
    }

    #[test]
    fn hand_under_constant_wrench_rests_at_wrench_over_stiffness() {
        // Statics: x = f/k = 4/2000 = 2 mm, angle = t/k_r = 0.4/20 = 0.02 rad.
        let mut hand = hand(HandSettings::default());
        let wrench = Wrench::new(DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 0.4, 0.0));
        for _ in 0..2000 {
            hand.step(&wrench);
        }
        let state = hand.state();
        assert!((state.pose.translation - DVec3::new(0.002, 0.0, 0.0)).length() < 1e-12);
        let angle = rotation_vector(state.pose.rotation);
        assert!((angle - DVec3::new(0.0, 0.02, 0.0)).length() < 1e-12);
        // At rest the hand carries what the device gives.
        let sum = hand.wrench_of_hand() + wrench;
        assert!(sum.force.length() < 1e-9 && sum.torque.length() < 1e-9);
        assert!((state.time_s - 2.0).abs() < 1e-12);
    }

    #[test]
    fn hand_falls_freely_without_a_grip() {
        // m = 0.5 kg, f = 1 N: backward Euler gives x = a h² n(n+1)/2 exactly.
        let mut hand = hand(HandSettings {
            grip_stiffness: 0.0,
            grip_damping: 0.0,
            ..HandSettings::default()
        });
        for _ in 0..100 {
            hand.step(&Wrench::new(DVec3::Z, DVec3::ZERO));
        }
        let expected = 2.0 * 1e-6 * 100.0 * 101.0 / 2.0;
        assert!((hand.state().pose.translation.z - expected).abs() < 1e-15);
        assert!((hand.state().linear_velocity.z - 0.2).abs() < 1e-14);
    }

    #[test]
    fn hand_with_an_extremely_stiff_grip_stays_bounded_and_finite() {
        let mut hand = hand(HandSettings {
            grip_stiffness: 1e12,
            grip_damping: 1e9,
            grip_rotational_stiffness: 1e12,
            grip_rotational_damping: 1e9,
            ..HandSettings::default()
        });
        for k in 0..1000 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            hand.step(&(Wrench::new(DVec3::ONE, DVec3::ONE) * (35.0 * sign)));
            let state = hand.state();
            assert!(state.is_finite());
            assert!(state.pose.translation.length() < 1e-9);
        }
    }

    #[test]
    fn hand_follows_its_script_within_the_lag_of_its_inertia() {
        let script = Script::new(&Insertion {
            start: DPose3::IDENTITY,
            direction: DVec3::NEG_Z,
            speed: 0.05,
            travel: 0.02,
            hold_s: 0.3,
            retract: false,
        })
        .unwrap();
        let mut hand = SimulatedHand::new(HandSettings::default(), script, 1e-3).unwrap();
        // Largest wanted acceleration: 1.5 speed/ramp = 1.5 * 0.05/0.04 = 1.9 m/s²; lag <= m a/k.
        let bound = 1.2 * 0.5 * 1.9 / 2000.0;
        for _ in 0..script.periods(1e-3) {
            hand.step(&Wrench::ZERO);
            let wanted = script.target(hand.time_s()).pose.translation;
            assert!((hand.state().pose.translation - wanted).length() < bound);
        }
        assert!((hand.state().pose.translation.z + 0.02).abs() < 1e-6);
        assert_eq!(hand.phase(), Phase::Done);
    }

    #[test]
    fn hand_with_the_same_wrenches_gives_the_same_bits() {
        let run = || {
            let mut hand = hand(HandSettings::default());
            for k in 0..500 {
                let x = f64::from(k);
                hand.step(&Wrench::new(
                    DVec3::new(x.sin(), x.cos(), 0.1),
                    DVec3::new(0.01, -0.02, 0.03) * x.sin(),
                ));
            }
            hand.state()
        };
        assert_eq!(run(), run());
    }

    #[test]
    fn hand_refuses_each_bad_setting_by_name() {
        let refused = |change: fn(&mut HandSettings)| {
            let mut settings = HandSettings::default();
            change(&mut settings);
            match SimulatedHand::new(settings, still(), 1e-3) {
                Err(DeviceError::InvalidSetting { name, .. }) => name,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(refused(|s| s.apparent_mass = 0.0), "apparent_mass");
        assert_eq!(refused(|s| s.grip_stiffness = -1.0), "grip_stiffness");
        assert_eq!(refused(|s| s.grip_damping = f64::NAN), "grip_damping");
        assert_eq!(refused(|s| s.apparent_inertia = -1.0), "apparent_inertia");
        assert_eq!(
            refused(|s| s.grip_rotational_stiffness = f64::INFINITY),
            "grip_rotational_stiffness"
        );
        assert_eq!(
            refused(|s| s.grip_rotational_damping = -1.0),
            "grip_rotational_damping"
        );
        assert!(SimulatedHand::new(HandSettings::default(), still(), 0.0).is_err());
    }
}

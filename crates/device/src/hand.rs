//! The simulated hand: a mass on a grip that follows a script and feels the wrench of the device.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_not_negative, check_positive};
use crate::haptic_device::{HandPresence, HandleState};
use crate::script::{Insertion, Phase, Script, Target};
use crate::wrench::{Wrench, rotation_from_vector, rotation_vector};

pub(crate) mod body;
mod guide;

use body::{Body, HeldBody};
use guide::Follower;
pub use guide::Guide;

/// What the hand is like: apparent mass of hand and handle, and the grip between intent and handle.
///
/// The defaults are an assumption for a firm two-finger to power grip, not a measurement: they lie
/// within the orders of magnitude reported for human hands (mass 0.1 to 1 kg, stiffness 0.1 to 5 kN/m)
/// with both axes critically damped. Where the force against travel of the part alone is wanted, use a
/// stiffer grip: the handle lags its script by force/stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandSettings {
    /// Apparent mass of hand and handle, kg, above 0; on a device with a body of its own, of the hand
    /// alone. Default 0.5, nominal 0.1 to 1.
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

/// A hand that holds the handle and wants it to follow a [`Script`], or a [`Guide`] that is moved from
/// outside.
///
/// ```text
/// m dv/dt = k (x* − x) + c (v* − v) + f         J dω/dt = k_r rotvec(R* R⁻¹) + c_r (ω* − ω) + t
/// ```
/// f, t: wrench of the device on the handle. Integrated at the servo period by backward Euler in the
/// grip (unconditionally stable in k and c) with the wrench of the last period, which is what a device
/// holds between two writes. The inertia is the same about all axes, so no gyroscopic term arises.
///
/// On a device with a body of its own (`driver/simulated/models.rs`) hand and body move as one, with the
/// device's damping and dry friction, and exactly for a wrench that is held over the period: there the
/// edge of stability is wanted, and backward Euler would damp it away.
///
/// The same wrenches give the same bits.
#[derive(Debug)]
pub struct SimulatedHand {
    settings: HandSettings,
    script: Script,
    period_s: f64,
    steps: u64,
    pose: DPose3,
    linear_velocity: DVec3,
    angular_velocity: DVec3,
    guide: Option<Follower>,
    body: Option<HeldBody>,
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
            guide: None,
            body: None,
        })
    }

    /// A hand that wants to stay where it is.
    ///
    /// # Errors
    /// Where a setting, the pose or the period is outside its range.
    pub fn resting(
        settings: HandSettings,
        start: DPose3,
        period_s: f64,
    ) -> Result<Self, DeviceError> {
        let script = Script::new(&Insertion {
            start,
            direction: DVec3::NEG_Z,
            speed: 1.0,
            travel: 0.0,
            hold_s: 0.0,
            retract: false,
        })?;
        Self::new(settings, script, period_s)
    }

    /// A hand whose wanted pose is set from outside, from whatever thread: by mouse and keyboard, or a test.
    ///
    /// # Errors
    /// Where a setting, the pose or the period is outside its range.
    pub fn guided(
        settings: HandSettings,
        start: DPose3,
        period_s: f64,
    ) -> Result<(Guide, Self), DeviceError> {
        let mut hand = Self::resting(settings, start, period_s)?;
        let (guide, follower) = guide::pair(start);
        hand.guide = Some(follower);
        Ok((guide, hand))
    }

    /// Gives the hand a device's body to hold.
    ///
    /// # Errors
    /// Where grip and body together cannot be computed with at this period.
    pub(crate) fn take(&mut self, body: &Body) -> Result<(), DeviceError> {
        self.body = Some(HeldBody::new(body, &self.settings, self.period_s)?);
        Ok(())
    }

    /// Advances the hand by one period under a constant wrench on the handle (about the handle point).
    ///
    /// Real-time: no allocation. The wrench must be finite.
    pub fn step(&mut self, wrench_on_handle: &Wrench) {
        debug_assert!(wrench_on_handle.is_finite());
        self.steps += 1;
        if let Some(follower) = &mut self.guide {
            follower.advance(self.period_s);
        }
        let target = self.target();
        if self.body.is_some() {
            self.step_with_body(&target, wrench_on_handle);
        } else {
            self.step_alone(&target, wrench_on_handle);
        }
    }

    fn step_alone(&mut self, target: &Target, wrench_on_handle: &Wrench) {
        let h = self.period_s;
        let s = &self.grip();

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

    fn step_with_body(&mut self, target: &Target, wrench_on_handle: &Wrench) {
        let is_held = self.is_held();
        let grip = self.grip();
        let Some(body) = &self.body else {
            return;
        };
        // Offsets from the target, which stands at its end of the period and moves on from there.
        let pull = wrench_on_handle.force + target.linear_velocity * grip.grip_damping;
        let offset = self.pose.translation - target.pose.translation;
        let (way, velocity) = body.translate(is_held, offset, self.linear_velocity, pull);

        let pull = wrench_on_handle.torque + target.angular_velocity * grip.grip_rotational_damping;
        let offset = rotation_vector(self.pose.rotation * target.pose.rotation.inverse());
        let (turn, angular_velocity) = body.turn(is_held, offset, self.angular_velocity, pull);

        self.linear_velocity = velocity;
        self.angular_velocity = angular_velocity;
        self.pose = DPose3::from_parts(
            self.pose.translation + way,
            (rotation_from_vector(turn) * self.pose.rotation).normalize(),
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
        let s = &self.grip();
        let target = self.target();
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
            hand: self
                .guide
                .as_ref()
                .map_or(HandPresence::Unknown, Follower::hand),
            buttons: self.guide.as_ref().map_or(0, Follower::buttons),
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

    /// Where the hand wants the handle now.
    fn target(&self) -> Target {
        match &self.guide {
            Some(follower) => follower.target(),
            None => self.script.target(self.time_s()),
        }
    }

    fn is_held(&self) -> bool {
        self.guide
            .as_ref()
            .is_none_or(|guide| guide.hand() != HandPresence::Absent)
    }

    /// The hand as it grips now: a hand that has let go pulls no more.
    fn grip(&self) -> HandSettings {
        if self.is_held() {
            return self.settings;
        }
        HandSettings {
            grip_stiffness: 0.0,
            grip_damping: 0.0,
            grip_rotational_stiffness: 0.0,
            grip_rotational_damping: 0.0,
            ..self.settings
        }
    }

    /// The motion the hand follows; of a guided hand, the rest at its start.
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
mod tests;

//! Passivity observer and controller: what comes out of the simulation must have gone in before.
//!
//! A sampled, delayed loop can make energy of nothing and shake the hand. The observer adds up the work between hand
//! and device, from the force that went out and the way the handle then went; the controller damps where more came
//! out than went in. Translation and rotation are two ports that know nothing of each other.

use glam::DVec3;
use glamx::DPose3;

use super::events::SafetyEvents;
use crate::error::{DeviceError, check_not_negative, check_positive};
use crate::haptic_device::{HandleState, Limits};
use crate::wrench::{Wrench, limit_length, rotation_vector};

/// How much is damped, and how much energy may come out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassivitySettings {
    /// For forces.
    pub translation: PortSettings,
    /// For torques.
    pub rotation: PortSettings,
    /// Time in which observed energy is forgotten, s, in both directions: what was dissipated long ago must not hide
    /// what comes out now. Default 10: longer than a snap-fit is held half way. Nominal 1 to 60.
    pub bleed_s: f64,
    /// Time from a force that goes out to the hand that feels it, s: the work is done by the force that has arrived.
    /// Default 1e-3, assumed: a tick of the link; nominal 0 to 31 periods, longer is taken as that. Too long a delay
    /// damps contact more than is needed, too short a one lets a shaking wall pass for a passive one.
    pub delay_s: f64,
}

/// Wrenches that are remembered while they are on their way.
const SENT: usize = 32;

/// Time that devices take to make a velocity of encoder steps, s: a step alone looks like a step in this time.
const STEP_S: f64 = 5e-3;

/// One of the two ports: N, m, J or N m, rad, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortSettings {
    /// Largest force or torque, N or N m.
    pub effort_max: f64,
    /// Largest damping of the controller, N s/m or N m s/rad: what the device renders without buzzing.
    pub damping_max: f64,
    /// Speed below which the controller does not act, m/s or rad/s: there its direction is noise.
    pub speed_min: f64,
    /// Energy that may come out beyond what went in, J. The largest effort falls linearly to 0 as it is used up.
    pub allowance: f64,
    /// Energy that may be stored, J: a part and a coupling hold no more, so no more is credited.
    pub store: f64,
}

impl PassivitySettings {
    /// The settings for a device with these limits.
    ///
    /// Allowance: the peak force over 2 mm (peak torque over 0.04 rad), a period's way at 2 m/s and 1 kHz. Store: over
    /// 5 mm (0.1 rad). Damping: the device's largest where it is stated; else what takes the peak force at 2 m/s, at
    /// most 5 N s/m, and of the torque at 40 rad/s. Least speed: 2 mm/s (0.02 rad/s), or an encoder's step in 5 ms.
    #[must_use]
    pub fn for_limits(limits: &Limits) -> Self {
        let (force, torque) = (limits.peak_force, limits.peak_torque);
        Self {
            translation: PortSettings {
                effort_max: force,
                damping_max: limits.max_damping.unwrap_or((force / 2.0).min(5.0)),
                speed_min: (limits.position_resolution / STEP_S).max(2e-3),
                allowance: 2e-3 * force,
                store: 5e-3 * force,
            },
            rotation: PortSettings {
                effort_max: torque,
                damping_max: torque / 40.0,
                speed_min: (limits.rotation_resolution / STEP_S).max(0.02),
                allowance: 0.04 * torque,
                store: 0.1 * torque,
            },
            bleed_s: 10.0,
            delay_s: 1e-3,
        }
    }
}

/// Energy that went into the device's ports since the start, J; below 0 it came out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ObservedEnergy {
    /// Of the force, J.
    pub translation: f64,
    /// Of the torque, J.
    pub rotation: f64,
}

/// One port's account.
#[derive(Debug, Clone)]
struct Port {
    settings: PortSettings,
    energy: f64,
    lowest: f64,
}

impl Port {
    fn new(settings: PortSettings) -> Result<Self, DeviceError> {
        check_not_negative("effort_max", settings.effort_max)?;
        check_not_negative("damping_max", settings.damping_max)?;
        check_positive("speed_min", settings.speed_min)?;
        check_not_negative("allowance", settings.allowance)?;
        check_not_negative("store", settings.store)?;
        Ok(Self {
            settings,
            energy: 0.0,
            lowest: 0.0,
        })
    }

    /// Accounts for an effort on the hand that stood while the handle went a way.
    fn observe(&mut self, effort: DVec3, way: DVec3, bled: f64) {
        let kept = self.energy - self.energy * bled;
        self.energy = (kept - effort.dot(way)).min(self.settings.store);
        self.lowest = self.lowest.min(self.energy);
    }

    /// The damping that takes the debt back within a period, N s/m or N m s/rad; 0 where there is none.
    fn damping(&self, velocity: DVec3, elapsed_s: f64) -> f64 {
        let speed = velocity.length();
        if self.energy >= 0.0 || speed < self.settings.speed_min || elapsed_s <= 0.0 {
            return 0.0;
        }
        (-self.energy / (elapsed_s * speed * speed)).min(self.settings.damping_max)
    }

    /// The largest effort that the debt leaves.
    fn ceiling(&self) -> f64 {
        let PortSettings {
            effort_max,
            allowance,
            ..
        } = self.settings;
        if self.energy >= 0.0 {
            effort_max
        } else if allowance > 0.0 {
            effort_max * (1.0 + self.energy / allowance).max(0.0)
        } else {
            0.0
        }
    }

    /// The damped effort within the ceiling; whether each of the two changed it.
    fn pass(&self, wanted: DVec3, velocity: DVec3, elapsed_s: f64) -> (DVec3, bool, bool) {
        let damping = self.damping(velocity, elapsed_s);
        let damped = if damping > 0.0 {
            wanted - velocity * damping
        } else {
            wanted
        };
        if self.energy >= 0.0 {
            // The largest effort itself is the clamp's to keep.
            return (damped, false, false);
        }
        let passed = limit_length(damped, self.ceiling());
        (passed, damping > 0.0, passed != damped)
    }
}

/// The observer and controller of both ports.
///
/// ```text
/// E ← E(1 − T/(τ + T)) − F·Δx, at most the store          E < 0:  α = min(−E/(T|v|²), α_max),  F' = F − α v
/// |F'| ≤ F_max (1 + E/A) where E < 0
/// ```
/// E: energy from the hand into the device (J), with the force F on the hand as it really went out, d periods of delay
/// ago, and the way Δx that the handle then went; T period, v velocity, A allowance. The last line is what makes the
/// bound absolute: with a period's way of at most Δx, E never falls below −A − (d + 1) F_max Δx, for d = 0 not below
/// −max(A, F_max Δx), whatever the simulation wants and whatever the damping achieves. Real-time: no allocation.
///
/// Source: Hannaford and Ryu 2002 (observer and controller); the guards are ours.
#[derive(Debug, Clone)]
pub(super) struct Passivity {
    translation: Port,
    rotation: Port,
    bleed_s: f64,
    delay_s: f64,
    /// What went out in the last periods; the newest at `newest`.
    sent: [Wrench; SENT],
    newest: usize,
    last: Option<DPose3>,
    linear_velocity: DVec3,
    angular_velocity: DVec3,
}

impl Passivity {
    pub(super) fn new(settings: &PassivitySettings) -> Result<Self, DeviceError> {
        check_positive("bleed_s", settings.bleed_s)?;
        check_not_negative("delay_s", settings.delay_s)?;
        Ok(Self {
            translation: Port::new(settings.translation)?,
            rotation: Port::new(settings.rotation)?,
            bleed_s: settings.bleed_s,
            delay_s: settings.delay_s,
            sent: [Wrench::ZERO; SENT],
            newest: 0,
            last: None,
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
        })
    }

    /// Remembers what went out in a period. To be called once a period.
    pub(super) fn sent(&mut self, wrench: &Wrench) {
        self.newest = (self.newest + 1) % SENT;
        self.sent[self.newest] = *wrench;
    }

    /// Accounts for the way to a good sample, under the wrench that had arrived before it.
    pub(super) fn observe(&mut self, handle: &HandleState, elapsed_s: f64) {
        let rendered = self.arrived(elapsed_s);
        self.linear_velocity = handle.linear_velocity;
        self.angular_velocity = handle.angular_velocity;
        let Some(last) = self.last.replace(handle.pose) else {
            return;
        };
        let bled = elapsed_s / (self.bleed_s + elapsed_s);
        let way = handle.pose.translation - last.translation;
        let turn = rotation_vector(handle.pose.rotation * last.rotation.inverse());
        self.translation.observe(rendered.force, way, bled);
        self.rotation.observe(rendered.torque, turn, bled);
    }

    /// What the hand felt in a period of this length, s.
    fn arrived(&self, elapsed_s: f64) -> Wrench {
        // Not a number, as without time, becomes 0.
        let delay = (self.delay_s / elapsed_s).round() as usize;
        self.sent[(self.newest + SENT - delay.min(SENT - 1)) % SENT]
    }

    /// The wrench with damping where energy came out, within what the allowance leaves.
    pub(super) fn pass(
        &self,
        wanted: &Wrench,
        elapsed_s: f64,
        events: &mut SafetyEvents,
    ) -> Wrench {
        let (force, is_force_damped, is_force_cut) =
            self.translation
                .pass(wanted.force, self.linear_velocity, elapsed_s);
        let (torque, is_torque_damped, is_torque_cut) =
            self.rotation
                .pass(wanted.torque, self.angular_velocity, elapsed_s);
        events.passivity_damped += u64::from(is_force_damped || is_torque_damped);
        events.energy_limited += u64::from(is_force_cut || is_torque_cut);
        Wrench::new(force, torque)
    }

    /// Largest force (N) and torque (N m) that the debts leave.
    pub(super) fn ceilings(&self) -> (f64, f64) {
        (self.translation.ceiling(), self.rotation.ceiling())
    }

    pub(super) fn energy(&self) -> ObservedEnergy {
        ObservedEnergy {
            translation: self.translation.energy,
            rotation: self.rotation.energy,
        }
    }

    /// The lowest energies so far, 0 or below: the most that came out beyond what had gone in.
    pub(super) fn lowest(&self) -> ObservedEnergy {
        ObservedEnergy {
            translation: self.translation.lowest,
            rotation: self.rotation.lowest,
        }
    }
}

#[cfg(test)]
mod tests;

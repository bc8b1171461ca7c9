//! What the guard allows.

use super::Watchdog;
use super::arming::ArmingSettings;
use super::heating::HeatingSettings;
use super::passivity::PassivitySettings;
use crate::error::DeviceError;
use crate::haptic_device::Limits;

/// Time in which a scripted session's force may change by the peak, and in which a live one's may fall from it, s.
const CHANGE_S: f64 = 2e-3;

/// Time in which a live session's force may rise to the peak, s.
const RISE_S: f64 = 0.01;

/// Largest stiffness beside a command where the maker states none, N/m.
const STIFFNESS_MAX: f64 = 5e3;

/// What the guard allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetySettings {
    /// Largest force, N. A longer one is shortened in its direction.
    pub force_max: f64,
    /// Largest torque, N m. A longer one is shortened in its direction.
    pub torque_max: f64,
    /// Largest change of the force, N/s; with `force_fall_rate_max` only of its rise. By default the peak
    /// force within 2 ms (live: 10 ms): slower than a step. Nominal: the peak force within 1 to 20 ms.
    pub force_rate_max: f64,
    /// Largest change of the torque, N m/s. By default the peak torque within 2 ms (live: 10 ms).
    pub torque_rate_max: f64,
    /// Largest fall of the force towards zero, N/s; `None`: as any change. Live: the peak force within
    /// 2 ms, so that the fall at a snap is felt.
    pub force_fall_rate_max: Option<f64>,
    /// Largest fall of the torque towards zero, N m/s; `None`: as any change.
    pub torque_fall_rate_max: Option<f64>,
    /// Largest speed of the handle, m/s; a sample beyond is rejected. Default 10: no hand on a device
    /// is faster.
    pub speed_max: f64,
    /// Largest angular speed of the handle, rad/s. Default 100.
    pub angular_speed_max: f64,
    /// Time in which the largest wrench goes to zero while samples or wrenches are rejected, s.
    /// Default 0.05.
    pub decay_s: f64,
    /// Time without a period at which the last wrench is stale, s. Default 0.02: twenty periods at 1 kHz.
    pub stall_timeout_s: f64,
    /// Time in which a stale wrench goes to zero, s. Default 0.05.
    pub stall_ramp_s: f64,
    /// Age of the simulation's answer from which it fades, s. Default 0.01.
    pub answer_timeout_s: f64,
    /// Time in which an old answer goes to zero, s. Default 0.04: gone at 50 ms.
    pub answer_ramp_s: f64,
    /// Largest stiffness that goes beside a wrench (Frobenius norm over √3), N/m. Scripted: without
    /// bound; live: the device's, 5 kN/m where none is stated.
    pub stiffness_max: f64,
    /// Whether energy is observed and damped, and how.
    pub passivity: Option<PassivitySettings>,
    /// Whether the force goes from peak to continuous as the motors heat, and how fast.
    pub heating: Option<HeatingSettings>,
    /// Whether force must be armed, and what that asks for.
    pub arming: Option<ArmingSettings>,
}

impl SafetySettings {
    /// The settings for a scripted session on a simulated device with these limits: no hand can be hurt, and
    /// what is recorded is the simulation's own wrench as far as the limits allow.
    #[must_use]
    pub fn for_limits(limits: &Limits) -> Self {
        Self {
            force_max: limits.peak_force,
            torque_max: limits.peak_torque,
            force_rate_max: limits.peak_force / CHANGE_S,
            torque_rate_max: limits.peak_torque / CHANGE_S,
            force_fall_rate_max: None,
            torque_fall_rate_max: None,
            speed_max: 10.0,
            angular_speed_max: 100.0,
            decay_s: 0.05,
            stall_timeout_s: Watchdog::TIMEOUT_S,
            stall_ramp_s: Watchdog::RAMP_S,
            answer_timeout_s: 0.01,
            answer_ramp_s: 0.04,
            stiffness_max: f64::INFINITY,
            passivity: None,
            heating: None,
            arming: None,
        }
    }

    /// The settings for a live session on a device with these limits: every guard is on.
    ///
    /// The time constant of the motors' heat is 5 s, an assumption; makers do not state it.
    ///
    /// # Errors
    /// Where the limits are none that a device can have ([`Limits::check`]), by name.
    pub fn live(limits: &Limits) -> Result<Self, DeviceError> {
        limits.check()?;
        Ok(Self {
            force_rate_max: limits.peak_force / RISE_S,
            torque_rate_max: limits.peak_torque / RISE_S,
            force_fall_rate_max: Some(limits.peak_force / CHANGE_S),
            torque_fall_rate_max: Some(limits.peak_torque / CHANGE_S),
            stiffness_max: limits.max_stiffness.unwrap_or(STIFFNESS_MAX),
            passivity: Some(PassivitySettings::for_limits(limits)),
            heating: Some(HeatingSettings {
                continuous_force: limits.continuous_force,
                peak_force: limits.peak_force,
                time_constant_s: 5.0,
            }),
            arming: Some(ArmingSettings::for_limits(limits)),
            ..Self::for_limits(limits)
        })
    }
}

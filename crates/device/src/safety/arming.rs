//! When force may go to the hand: not before all is in order, then rising slowly, and the same again after any trip.

use std::fmt;

use super::events::SafetyEvents;
use crate::error::{DeviceError, check_not_negative, check_positive};
use crate::haptic_device::{HandPresence, Limits, Readiness};
use crate::wrench::Wrench;

/// What arming asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmingSettings {
    /// Time in which the force rises from nothing to all of it, s. Default 0.3, nominal 0.2 to 0.5.
    pub ramp_s: f64,
    /// Time in which it goes to nothing after a trip, s. Default 0.02.
    pub fall_s: f64,
    /// Time for which the wrench must have been small, s. Default 0.05: fifty periods at 1 kHz.
    pub calm_s: f64,
    /// What is a small force, N: the tool is at the handle. Default 5 % of the peak force.
    pub calm_force: f64,
    /// What is a small torque, N m. Default 5 % of the peak torque.
    pub calm_torque: f64,
    /// Largest speed of the handle with force on it, m/s. Default 2: a hand that is pushed away.
    pub speed_trip: f64,
    /// Largest angular speed with force on it, rad/s. Default 40.
    pub angular_speed_trip: f64,
    /// Time without a good sample after which they count as lost, s. Default 0.02.
    pub samples_timeout_s: f64,
}

impl ArmingSettings {
    /// The settings for a device with these limits.
    #[must_use]
    pub fn for_limits(limits: &Limits) -> Self {
        Self {
            ramp_s: 0.3,
            fall_s: 0.02,
            calm_s: 0.05,
            calm_force: 0.05 * limits.peak_force,
            calm_torque: 0.05 * limits.peak_torque,
            speed_trip: 2.0,
            angular_speed_trip: 40.0,
            samples_timeout_s: 0.02,
        }
    }
}

/// How far arming is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Arming {
    /// Arming is not asked for: the force is on.
    #[default]
    NotAsked,
    /// No force; what is waited for.
    Waiting(WaitsFor),
    /// The force is rising.
    Rising,
    /// The force is on.
    Armed,
}

/// What arming waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaitsFor {
    /// The device is not ready; [`HandleState::readiness`](crate::HandleState::readiness) says why.
    Device,
    /// No good sample comes.
    Samples,
    /// The handle must be let go of once, so that the sensor of the hand is seen to work.
    Release,
    /// The handle must be held.
    Hold,
    /// The wrench must be small for a moment: the tool is not at the handle, or pressed against something.
    SmallForce,
    /// The handle must be moved more slowly.
    SlowHandle,
}

impl fmt::Display for WaitsFor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Device => "waiting for the device",
            Self::Samples => "waiting for the device's samples",
            Self::Release => "let go of the handle once",
            Self::Hold => "take the handle",
            Self::SmallForce => "move the tool out of contact",
            Self::SlowHandle => "move the handle more slowly",
        })
    }
}

impl fmt::Display for Arming {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAsked => f.write_str("force on"),
            Self::Waiting(what) => write!(f, "no force: {what}"),
            Self::Rising => f.write_str("force rising"),
            Self::Armed => f.write_str("force on"),
        }
    }
}

/// What the gate looks at in a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub(super) hand: HandPresence,
    pub(super) readiness: Readiness,
    /// Time since the last good sample, s.
    pub(super) silent_s: f64,
    /// m/s.
    pub(super) speed: f64,
    /// rad/s.
    pub(super) angular_speed: f64,
    /// What all stages before this one let through.
    pub(super) wrench: Wrench,
}

/// What cuts the force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trip {
    NotReady,
    HandAbsent,
    SamplesLost,
    TooFast,
}

/// The gate: a factor in [0, 1] for the wrench.
///
/// ```text
/// waiting ── ready, samples, released once, held, slow, small wrench for calm_s ──> rising ── ramp_s ──> armed
///    ^                                                                               │                    │
///    └── not ready │ no hand │ samples lost │ too fast with force │ stall <──────────┴────────────────────┘
/// ```
/// A device without a sensor of the hand goes without "released once, held". Real-time: no allocation.
#[derive(Debug, Clone)]
pub(super) struct ArmingGate {
    settings: ArmingSettings,
    state: Arming,
    gain: f64,
    calm_for_s: f64,
    was_released: bool,
}

impl ArmingGate {
    pub(super) fn new(settings: ArmingSettings) -> Result<Self, DeviceError> {
        check_positive("ramp_s", settings.ramp_s)?;
        check_positive("fall_s", settings.fall_s)?;
        check_not_negative("calm_s", settings.calm_s)?;
        check_not_negative("calm_force", settings.calm_force)?;
        check_not_negative("calm_torque", settings.calm_torque)?;
        check_positive("speed_trip", settings.speed_trip)?;
        check_positive("angular_speed_trip", settings.angular_speed_trip)?;
        check_positive("samples_timeout_s", settings.samples_timeout_s)?;
        Ok(Self {
            settings,
            state: Arming::Waiting(WaitsFor::Samples),
            gain: 0.0,
            calm_for_s: 0.0,
            was_released: false,
        })
    }

    /// Looks at a period and gives the factor for its wrench.
    pub(super) fn pass(&mut self, seen: &Seen, elapsed_s: f64, events: &mut SafetyEvents) -> f64 {
        if self.is_on()
            && let Some(trip) = self.trip(seen)
        {
            *match trip {
                Trip::NotReady => &mut events.trips_not_ready,
                Trip::HandAbsent => &mut events.trips_hand_absent,
                Trip::SamplesLost => &mut events.trips_samples_lost,
                Trip::TooFast => &mut events.trips_too_fast,
            } += 1;
            self.disarm();
        }
        self.was_released |= seen.hand == HandPresence::Absent;
        if !self.is_on() {
            self.wait(seen, elapsed_s);
        }
        if self.is_on() {
            self.gain = (self.gain + elapsed_s / self.settings.ramp_s).min(1.0);
            if self.gain == 1.0 {
                self.state = Arming::Armed;
            }
        } else {
            self.gain = (self.gain - elapsed_s / self.settings.fall_s).max(0.0);
        }
        self.gain
    }

    /// Says that the loop stood still for so long that the device let the force go.
    pub(super) fn stalled(&mut self, events: &mut SafetyEvents) {
        if self.is_on() {
            events.trips_stalled += 1;
            self.disarm();
        }
        self.calm_for_s = 0.0;
        self.gain = 0.0;
    }

    pub(super) fn state(&self) -> Arming {
        self.state
    }

    /// The factor of the last call.
    pub(super) fn gain(&self) -> f64 {
        self.gain
    }

    fn is_on(&self) -> bool {
        matches!(self.state, Arming::Rising | Arming::Armed)
    }

    fn disarm(&mut self) {
        self.state = Arming::Waiting(WaitsFor::SmallForce);
        self.calm_for_s = 0.0;
        self.was_released = false;
    }

    fn trip(&self, seen: &Seen) -> Option<Trip> {
        let s = &self.settings;
        let is_pushed = self.gain * seen.wrench.force.length() > s.calm_force
            || self.gain * seen.wrench.torque.length() > s.calm_torque;
        if seen.readiness != Readiness::Ready {
            Some(Trip::NotReady)
        } else if seen.hand == HandPresence::Absent {
            Some(Trip::HandAbsent)
        } else if seen.silent_s > s.samples_timeout_s {
            Some(Trip::SamplesLost)
        } else if is_pushed && self.is_fast(seen) {
            Some(Trip::TooFast)
        } else {
            None
        }
    }

    fn is_fast(&self, seen: &Seen) -> bool {
        seen.speed > self.settings.speed_trip
            || seen.angular_speed > self.settings.angular_speed_trip
    }

    /// What stands in the way of the force; once nothing has for long enough, it rises.
    fn wait(&mut self, seen: &Seen, elapsed_s: f64) {
        let s = &self.settings;
        let is_calm = seen.wrench.force.length() <= s.calm_force
            && seen.wrench.torque.length() <= s.calm_torque;
        let obstacle = if seen.readiness != Readiness::Ready {
            Some(WaitsFor::Device)
        } else if seen.silent_s > 0.0 {
            Some(WaitsFor::Samples)
        } else if seen.hand == HandPresence::Absent {
            Some(WaitsFor::Hold)
        } else if seen.hand == HandPresence::Present && !self.was_released {
            Some(WaitsFor::Release)
        } else if self.is_fast(seen) {
            Some(WaitsFor::SlowHandle)
        } else if !is_calm {
            Some(WaitsFor::SmallForce)
        } else {
            None
        };
        if let Some(what) = obstacle {
            self.calm_for_s = 0.0;
            self.state = Arming::Waiting(what);
            return;
        }
        self.calm_for_s += elapsed_s;
        // Half a period's grace: sums of periods are not exact.
        if self.calm_for_s + 0.5 * elapsed_s >= s.calm_s && self.gain == 0.0 {
            self.state = Arming::Rising;
        } else {
            self.state = Arming::Waiting(WaitsFor::SmallForce);
        }
    }
}

#[cfg(test)]
mod tests;

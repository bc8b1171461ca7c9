//! The guard between simulation and hand.
//!
//! Samples are judged on the way in, commands on the way out, one stage after the other:
//!
//! ```text
//! device ── sample ──> samples ──> simulation ── answer ──┐
//!                                                         v
//!   finite ──> passivity ──> clamp ──> heating ──> slew ──> age ──> arming ──> device
//! ```
//!
//! | stage | what it keeps from the hand |
//! |---|---|
//! | `finite` | what is not a number |
//! | `passivity` | energy that never went in |
//! | `clamp` | more than the largest force or torque |
//! | `heating` | the peak force for longer than the motors bear it |
//! | `slew` | jumps; also the way to zero while samples or commands are rejected |
//! | `age` | answers that are no longer true |
//! | `arming` | force on a hand that is not there, or not yet |
//!
//! No clock is read here: time comes in as a number, so each stage can be provoked in a test.

use glam::DMat3;

use crate::error::{DeviceError, check_setting};
use crate::haptic_device::{Command, HandleState};
use crate::servo::Answer;
use crate::wrench::Wrench;

mod arming;
mod clamp;
mod events;
mod finite;
pub(crate) mod heating;
mod passivity;
mod samples;
mod settings;
mod slew;
mod watchdog;

use arming::{ArmingGate, Seen};
use clamp::NormClamp;
use finite::FiniteCheck;
use heating::Heating;
use passivity::Passivity;
use samples::SampleCheck;
use slew::{Rates, SlewLimit};
use watchdog::AgeGate;

pub use arming::{Arming, ArmingSettings, WaitsFor};
pub use events::SafetyEvents;
pub use heating::HeatingSettings;
pub use passivity::{ObservedEnergy, PassivitySettings, PortSettings};
pub use settings::SafetySettings;
pub use watchdog::Watchdog;

/// The guard: the stages in their order, and what went out last.
///
/// While the newest sample is rejected, or the wrench is not finite, the wrench goes to zero along its
/// direction within `decay_s`; afterwards it comes back no faster than the rate allows.
#[derive(Debug, Clone)]
pub struct Safety {
    samples: SampleCheck,
    finite: FiniteCheck,
    passivity: Option<Passivity>,
    clamp: NormClamp,
    heating: Option<Heating>,
    slew: SlewLimit,
    age: AgeGate,
    arming: Option<ArmingGate>,
    /// For the stiffness beside a wrench, N/m.
    stiffness_max: f64,
    /// For what the device lets go by itself while the loop stands still.
    stall: Watchdog,
    last_wrench: Wrench,
    events: SafetyEvents,
}

impl Safety {
    /// A guard that has seen nothing and let nothing through.
    ///
    /// # Errors
    /// Where a setting is not finite or outside its range.
    pub fn new(settings: SafetySettings) -> Result<Self, DeviceError> {
        let s = &settings;
        check_setting(
            "stiffness_max",
            s.stiffness_max,
            s.stiffness_max >= 0.0,
            "0 or above (N/m)",
        )?;
        let force = Rates {
            max: s.force_max,
            rise: s.force_rate_max,
            fall: s.force_fall_rate_max,
        };
        let torque = Rates {
            max: s.torque_max,
            rise: s.torque_rate_max,
            fall: s.torque_fall_rate_max,
        };
        Ok(Self {
            samples: SampleCheck::new(s.speed_max, s.angular_speed_max)?,
            finite: FiniteCheck,
            passivity: s.passivity.as_ref().map(Passivity::new).transpose()?,
            clamp: NormClamp {
                force_max: s.force_max,
                torque_max: s.torque_max,
            },
            heating: s.heating.map(Heating::new).transpose()?,
            slew: SlewLimit::new(force, torque, s.decay_s)?,
            age: AgeGate::new(s.answer_timeout_s, s.answer_ramp_s)?,
            arming: s.arming.map(ArmingGate::new).transpose()?,
            stiffness_max: s.stiffness_max,
            stall: Watchdog::new(s.stall_timeout_s, s.stall_ramp_s)?,
            last_wrench: Wrench::ZERO,
            events: SafetyEvents::default(),
        })
    }

    /// Judges a sample; `None` stands for a device that failed to read.
    ///
    /// Returns the sample (its quaternion normalised), or the last good pose at rest and with the time
    /// `time_s` (s), or nothing as long as there was no good one. `elapsed_s`: time since the last call.
    /// Real-time: no allocation.
    pub fn accept_sample(
        &mut self,
        sample: Option<&HandleState>,
        time_s: f64,
        elapsed_s: f64,
    ) -> Option<HandleState> {
        let handle = self
            .samples
            .pass(sample, time_s, elapsed_s, &mut self.events);
        let elapsed_s = elapsed_s.max(0.0);
        if let Some(heating) = &mut self.heating {
            heating.feed(self.last_wrench.force, elapsed_s);
        }
        if let Some(passivity) = &mut self.passivity {
            passivity.sent(&self.last_wrench);
            if let Some(handle) = &handle
                && self.samples.is_good()
            {
                passivity.observe(handle, elapsed_s);
            }
        }
        handle
    }

    /// Judges the simulation's answer and returns what may be rendered.
    ///
    /// `elapsed_s`: the period, which is what the rates and the decay are counted by. The result is
    /// finite and within the limits for whatever comes in. Its stiffness is the answer's, weakened as the
    /// wrench was, and zero where the wrench was cut or changed. Real-time: no allocation.
    pub fn accept(&mut self, answer: &Answer, elapsed_s: f64) -> Command {
        let elapsed_s = elapsed_s.max(0.0);
        let wanted = &answer.command;
        let is_finite = self.finite.pass(wanted, &mut self.events);
        let shaped = if is_finite && self.samples.is_good() {
            self.shape(&wanted.wrench, elapsed_s)
        } else {
            self.slew.decay(elapsed_s)
        };
        let shaped = self.keep_within(shaped);
        let gain = self.gate(&shaped, answer.age_s, elapsed_s);
        self.last_wrench = shaped * gain;
        let stiffness = if shaped == wanted.wrench {
            self.limit_stiffness(&wanted.stiffness) * gain
        } else {
            DMat3::ZERO
        };
        Command {
            wrench: self.last_wrench,
            stiffness,
        }
    }

    /// The same for a wrench that was computed now.
    pub fn accept_wrench(&mut self, wanted: &Wrench, elapsed_s: f64) -> Wrench {
        self.accept(&(*wanted).into(), elapsed_s).wrench
    }

    /// Lets the last wrench go towards zero for `elapsed_s`, and returns it: exactly zero after at most
    /// `decay_s`. Real-time: no allocation.
    pub fn decay(&mut self, elapsed_s: f64) -> Wrench {
        let decayed = self.slew.decay(elapsed_s.max(0.0));
        let gain = self.arming.as_ref().map_or(1.0, ArmingGate::gain);
        self.last_wrench = self.keep_within(decayed) * (self.age.gain() * gain);
        self.last_wrench
    }

    /// Says that the last wrench was rendered for `age_s` without a new one.
    ///
    /// Beyond the timeout the device has faded it by itself (see [`HapticDevice`](crate::HapticDevice)),
    /// so the next one rises from there; once it is gone, the force must be armed again. Real-time: no
    /// allocation.
    pub fn after_gap(&mut self, age_s: f64) {
        let gain = self.stall.gain_at_age(age_s);
        if gain < 1.0 {
            self.events.stalls += 1;
            self.slew.fade(gain);
            self.last_wrench = self.last_wrench * gain;
        }
        if gain == 0.0
            && let Some(arming) = &mut self.arming
        {
            arming.stalled(&mut self.events);
        }
    }

    /// The wrench that was let through last.
    #[must_use]
    pub fn last_wrench(&self) -> Wrench {
        self.last_wrench
    }

    /// How often the guard stepped in so far.
    #[must_use]
    pub fn events(&self) -> SafetyEvents {
        self.events
    }

    /// How far arming is.
    #[must_use]
    pub fn arming(&self) -> Arming {
        self.arming
            .as_ref()
            .map_or(Arming::NotAsked, ArmingGate::state)
    }

    /// The energy observed at the handle; 0 where none is.
    #[must_use]
    pub fn energy(&self) -> ObservedEnergy {
        self.passivity
            .as_ref()
            .map_or_else(ObservedEnergy::default, Passivity::energy)
    }

    /// The lowest energies observed, J, 0 or below: the most that came out beyond what had gone in.
    #[must_use]
    pub fn lowest_energy(&self) -> ObservedEnergy {
        self.passivity
            .as_ref()
            .map_or_else(ObservedEnergy::default, Passivity::lowest)
    }

    /// The stages that change a good wrench.
    fn shape(&mut self, wanted: &Wrench, elapsed_s: f64) -> Wrench {
        let events = &mut self.events;
        let passive = match &self.passivity {
            Some(passivity) => passivity.pass(wanted, elapsed_s, events),
            None => *wanted,
        };
        let mut limited = self.clamp.pass(&passive, events);
        if let Some(heating) = &self.heating {
            limited.force = heating.pass(limited.force, events);
        }
        self.slew.pass(&limited, elapsed_s, events)
    }

    /// What is held must also be within the limits that shrink with time: energy and heat.
    fn keep_within(&mut self, shaped: Wrench) -> Wrench {
        let (mut force, mut torque) = (self.clamp.force_max, self.clamp.torque_max);
        if let Some(passivity) = &self.passivity {
            let (force_left, torque_left) = passivity.ceilings();
            (force, torque) = (force.min(force_left), torque.min(torque_left));
        }
        if let Some(heating) = &self.heating {
            force = force.min(heating.allowed());
        }
        if force < self.clamp.force_max || torque < self.clamp.torque_max {
            self.slew.keep_within(force, torque)
        } else {
            shaped
        }
    }

    /// The factor of the two gates.
    fn gate(&mut self, shaped: &Wrench, age_s: f64, elapsed_s: f64) -> f64 {
        let (young, is_stale) = self.age.pass(age_s, elapsed_s);
        self.events.answers_stale += u64::from(is_stale);
        let Some(arming) = &mut self.arming else {
            return young;
        };
        let (hand, readiness) = self.samples.condition();
        let (speed, angular_speed) = self.samples.speeds();
        let seen = Seen {
            hand,
            readiness,
            silent_s: self.samples.silent_s(),
            speed,
            angular_speed,
            wrench: *shaped,
        };
        young * arming.pass(&seen, elapsed_s, &mut self.events)
    }

    /// The stiffness within the largest.
    fn limit_stiffness(&mut self, wanted: &DMat3) -> DMat3 {
        let squares: f64 = wanted.to_cols_array().iter().map(|x| x * x).sum();
        let norm = (squares / 3.0).sqrt();
        if norm <= self.stiffness_max {
            return *wanted;
        }
        self.events.stiffness_limited += 1;
        if norm.is_finite() {
            *wanted * (self.stiffness_max / norm)
        } else {
            DMat3::ZERO
        }
    }
}

#[cfg(test)]
mod tests;

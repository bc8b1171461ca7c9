//! Heat of the motors: the peak force for a short time, the continuous force for ever.

use glam::DVec3;

use super::events::SafetyEvents;
use crate::error::{DeviceError, check_not_negative, check_positive, check_setting};
use crate::wrench::limit_length;

/// Part of the continuous limit (as mean square) from which the peak force is taken back. Dimensionless.
const ONSET: f64 = 0.9;

/// The motors' limits and how fast they heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatingSettings {
    /// Force that can be held for ever, N.
    pub continuous_force: f64,
    /// Largest force, N.
    pub peak_force: f64,
    /// Time constant of the window over which the mean square of the force is held to the continuous force, s.
    pub time_constant_s: f64,
}

/// A leaky mean of the force squared, and the force that it leaves.
///
/// ```text
/// dS/dt = (F² − S)/τ        allowed: F_peak up to S = 0.9 F_c², then linearly in S to F_c at S = F_c²
/// ```
#[derive(Debug, Clone)]
pub(crate) struct Heating {
    settings: HeatingSettings,
    mean_square: f64,
}

impl Heating {
    /// Cold motors.
    ///
    /// # Errors
    /// Where the continuous force is 0 beside a peak, or above it, or a number is not finite.
    pub(crate) fn new(settings: HeatingSettings) -> Result<Self, DeviceError> {
        let (peak, continuous) = (settings.peak_force, settings.continuous_force);
        check_not_negative("continuous_force", continuous)?;
        check_setting(
            "continuous_force",
            continuous,
            continuous > 0.0 || peak == 0.0,
            "finite and above 0",
        )?;
        check_setting(
            "peak_force",
            peak,
            peak.is_finite() && peak >= continuous,
            "finite and at least the continuous force (N)",
        )?;
        check_positive("time_constant_s", settings.time_constant_s)?;
        Ok(Self {
            settings,
            mean_square: 0.0,
        })
    }

    /// Says that this force (N) was rendered for `elapsed_s`.
    pub(crate) fn feed(&mut self, force: DVec3, elapsed_s: f64) {
        let share = elapsed_s / (self.settings.time_constant_s + elapsed_s);
        self.mean_square += (force.length_squared() - self.mean_square) * share;
    }

    /// The force the heat allows now, N.
    pub(crate) fn allowed(&self) -> f64 {
        let (peak, continuous) = (self.settings.peak_force, self.settings.continuous_force);
        if continuous == 0.0 {
            return peak;
        }
        let heat = self.mean_square / (continuous * continuous);
        let taken_back = ((heat - ONSET) / (1.0 - ONSET)).clamp(0.0, 1.0);
        peak + (continuous - peak) * taken_back
    }

    /// The force within what the heat allows. Counted where it was beyond.
    pub(super) fn pass(&self, wanted: DVec3, events: &mut SafetyEvents) -> DVec3 {
        let passed = limit_length(wanted, self.allowed());
        events.heat_limited += u64::from(passed != wanted);
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-3;

    fn heating() -> Heating {
        Heating::new(HeatingSettings {
            continuous_force: 10.0,
            peak_force: 35.0,
            time_constant_s: 5.0,
        })
        .unwrap()
    }

    /// Periods until the peak is taken back for the first time, and the force after a minute.
    fn hold(wanted: f64) -> (u32, f64) {
        let mut heating = heating();
        let mut events = SafetyEvents::default();
        let mut first = u32::MAX;
        let mut last = DVec3::ZERO;
        for k in 0..60_000 {
            last = heating.pass(DVec3::X * wanted, &mut events);
            if last.x < wanted {
                first = first.min(k);
            }
            heating.feed(last, T);
        }
        assert_eq!(first == u32::MAX, events.heat_limited == 0);
        (first, last.x)
    }

    #[test]
    fn peak_force_lasts_for_its_time_and_ends_at_the_continuous_one() {
        // S reaches 0.9 F_c² under 35 N at -tau ln(1 - 90/F²) = 0.382 s; under 20 N the limit is met at
        // S = 0.96 F_c², -tau ln(1 - 96/F²) = 1.372 s.
        for (force, expected_s) in [(35.0_f64, 0.382), (20.0, 1.372)] {
            let (first, last) = hold(force);
            assert!((f64::from(first) * T - expected_s).abs() < 0.005, "{first}");
            assert!((9.0..=10.2).contains(&last), "{last}");
        }
    }

    #[test]
    fn continuous_force_is_never_taken_back() {
        assert_eq!(hold(10.0), (u32::MAX, 10.0));
    }

    #[test]
    fn heat_leaves_again() {
        let mut heating = heating();
        for _ in 0..5000 {
            heating.feed(DVec3::X * 35.0, T);
        }
        assert_eq!(heating.allowed(), 10.0);
        heating.feed(DVec3::ZERO, 1e6);
        assert_eq!(heating.allowed(), 35.0);
    }

    #[test]
    fn limits_of_zero_pass_and_limits_without_sense_do_not() {
        let settings = |continuous_force, peak_force| HeatingSettings {
            continuous_force,
            peak_force,
            time_constant_s: 1.0,
        };
        assert_eq!(Heating::new(settings(0.0, 0.0)).unwrap().allowed(), 0.0);
        for (continuous, peak) in [(0.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (1.0, f64::NAN)] {
            assert!(Heating::new(settings(continuous, peak)).is_err());
        }
    }
}

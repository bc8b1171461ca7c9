//! Age: what is not renewed fades to zero, and what comes back rises again.

use crate::error::{DeviceError, check_positive};

/// Fades what has not been renewed: full until the timeout, then smoothly to zero.
///
/// ```text
/// gain
///  1 ───────────╮
///               │╲         1 − (3x² − 2x³),  x = (age − timeout)/ramp
///  0            │ ╰──────
///            timeout  timeout + ramp        age
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watchdog {
    timeout_s: f64,
    ramp_s: f64,
    fed_s: f64,
}

impl Watchdog {
    /// Age at which a wrench is stale by default, s: twenty periods at 1 kHz.
    pub const TIMEOUT_S: f64 = 0.02;

    /// Time in which it then goes to zero by default, s.
    pub const RAMP_S: f64 = 0.05;

    /// A watchdog fed at time 0.
    ///
    /// # Errors
    /// Where a time is not finite or not above 0.
    pub fn new(timeout_s: f64, ramp_s: f64) -> Result<Self, DeviceError> {
        check_positive("stall_timeout_s", timeout_s)?;
        check_positive("stall_ramp_s", ramp_s)?;
        Ok(Self {
            timeout_s,
            ramp_s,
            fed_s: 0.0,
        })
    }

    /// That of a link: full for 20 ms, gone after 50 ms.
    #[must_use]
    pub(crate) fn for_link() -> Self {
        Self {
            timeout_s: Self::TIMEOUT_S,
            ramp_s: 0.03,
            fed_s: 0.0,
        }
    }

    /// Says that a new value came at `time_s`, s.
    pub fn feed(&mut self, time_s: f64) {
        self.fed_s = time_s;
    }

    /// Factor in [0, 1] for the value at `time_s`, s. A time before the last feeding counts as a new
    /// beginning; a time that is not a number gives 0.
    pub fn gain(&mut self, time_s: f64) -> f64 {
        if time_s < self.fed_s {
            self.fed_s = time_s;
        }
        self.gain_at_age(time_s - self.fed_s)
    }

    /// Factor in [0, 1] for a value of this age, s.
    #[must_use]
    pub fn gain_at_age(&self, age_s: f64) -> f64 {
        if age_s.is_nan() {
            return 0.0;
        }
        let x = ((age_s - self.timeout_s) / self.ramp_s).clamp(0.0, 1.0);
        1.0 - x * x * (3.0 - 2.0 * x)
    }
}

impl Default for Watchdog {
    fn default() -> Self {
        Self {
            timeout_s: Self::TIMEOUT_S,
            ramp_s: Self::RAMP_S,
            fed_s: 0.0,
        }
    }
}

/// Fades the force while the answers of the simulation are old, and lets it rise again when they are new.
///
/// It falls as the watchdog says; it rises no faster than from 0 to 1 within the watchdog's ramp, because the force
/// behind it may be large by then.
#[derive(Debug, Clone)]
pub(super) struct AgeGate {
    watchdog: Watchdog,
    gain: f64,
}

impl AgeGate {
    pub(super) fn new(timeout_s: f64, ramp_s: f64) -> Result<Self, DeviceError> {
        check_positive("answer_timeout_s", timeout_s)?;
        check_positive("answer_ramp_s", ramp_s)?;
        Ok(Self {
            watchdog: Watchdog::new(timeout_s, ramp_s)?,
            gain: 1.0,
        })
    }

    /// Factor in [0, 1] for an answer of this age (s) after another `elapsed_s`, and whether the answer is stale.
    pub(super) fn pass(&mut self, age_s: f64, elapsed_s: f64) -> (f64, bool) {
        let allowed = self.watchdog.gain_at_age(age_s);
        let risen = self.gain + elapsed_s.max(0.0) / self.watchdog.ramp_s;
        self.gain = allowed.min(risen);
        (self.gain, allowed < 1.0)
    }

    /// The factor of the last call.
    pub(super) fn gain(&self) -> f64 {
        self.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-3;

    #[test]
    fn watchdog_fades_smoothly_between_timeout_and_end_of_ramp() {
        let mut watchdog = Watchdog::new(0.02, 0.05).unwrap();
        watchdog.feed(1.0);
        assert_eq!(watchdog.gain(1.02), 1.0);
        assert!((watchdog.gain(1.045) - 0.5).abs() < 1e-12);
        assert_eq!(watchdog.gain(1.0701), 0.0);
        assert_eq!(watchdog.gain(f64::INFINITY), 0.0);
        assert_eq!(watchdog.gain(f64::NAN), 0.0);
        // The clock went back: the wait begins anew from there, it is not endless.
        assert_eq!(watchdog.gain(0.5), 1.0);
        assert_eq!(watchdog.gain(0.6), 0.0);
        watchdog.feed(0.6);
        assert_eq!(watchdog.gain(0.6), 1.0);
        assert!(Watchdog::new(0.0, 1.0).is_err());
        assert!(Watchdog::new(1.0, f64::NAN).is_err());
    }

    #[test]
    fn answer_that_grows_old_is_gone_at_50_ms_and_never_rises_meanwhile() {
        let mut gate = AgeGate::new(0.01, 0.04).unwrap();
        let mut last = 1.0;
        for k in 0..=60 {
            let (gain, is_stale) = gate.pass(f64::from(k) * T, T);
            assert!(gain <= last);
            assert_eq!(is_stale, k > 10);
            if k <= 10 {
                assert_eq!(gain, 1.0);
            }
            if k >= 50 {
                assert_eq!(gain, 0.0);
            }
            last = gain;
        }
        assert_eq!(gate.pass(f64::NAN, T), (0.0, true));
    }

    #[test]
    fn new_answer_rises_over_the_ramp_and_does_not_jump() {
        let mut gate = AgeGate::new(0.01, 0.04).unwrap();
        gate.pass(1.0, T);
        for k in 1..=40 {
            let (gain, is_stale) = gate.pass(0.0, T);
            assert!((gain - f64::from(k) / 40.0).abs() < 1e-12 && !is_stale);
        }
        assert_eq!(gate.pass(-1.0, T).0, 1.0);
        assert_eq!(gate.gain(), 1.0);
    }
}

//! The time source of the loop: real, as fast as possible, or driven by a test.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::error::{DeviceError, check_setting};

/// One release of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Release {
    /// Number of this period, from 0, without gaps.
    pub index: u64,
    /// Time on the loop's clock: `index` times the period, s. The same on each clock.
    pub time_s: f64,
    /// How late the loop woke after the scheduled time, s.
    pub wake_delay_s: f64,
    /// Scheduled times that went by since the last release because the loop was still at work.
    pub skipped: u64,
}

/// A time source that releases the loop once a period.
///
/// The loop's time is the number of the period times its length, on each clock and whatever was
/// missed: what is computed does not depend on how fast. Real time that went by unused is in
/// [`Release::skipped`].
pub trait Clock {
    /// Length of a period, s.
    fn period_s(&self) -> f64;

    /// Waits for the next scheduled time. Real-time: no allocation.
    fn wait(&mut self) -> Release;

    /// Time since the *scheduled* time of the last release, s: wake delay and work together.
    fn since_release_s(&self) -> f64;
}

/// Shortest period, s: below it waiting itself takes longer.
const PERIOD_MIN_S: f64 = 1e-5;

/// Longest period, s.
const PERIOD_MAX_S: f64 = 1.0;

fn check_period(period_s: f64) -> Result<(), DeviceError> {
    check_setting(
        "period_s",
        period_s,
        (PERIOD_MIN_S..=PERIOD_MAX_S).contains(&period_s),
        "from 1e-5 to 1 s",
    )
}

/// Real time: releases at t₀ + kT of the monotonic clock, slept to and then spun to.
///
/// A loop at 10 kHz with real-time priority must not spin all the time, or the system takes the processor
/// away from it for some 50 ms in each second: [`with_spin`](Self::with_spin).
///
/// t₀ is the first call of [`wait`](Clock::wait). A scheduled time that has gone by is skipped, never
/// made up for: after a miss the loop waits for the next scheduled time.
#[derive(Debug, Clone)]
pub struct RealTime {
    period_s: f64,
    index: u64,
    /// Number of the scheduled time, gaps included.
    slot: u64,
    first: Option<Instant>,
    scheduled: Instant,
    sleeper: spin_sleep::SpinSleeper,
}

impl RealTime {
    /// A clock with the given period, s.
    ///
    /// # Errors
    /// Where the period is not within 10 µs to 1 s.
    pub fn new(period_s: f64) -> Result<Self, DeviceError> {
        check_period(period_s)?;
        Ok(Self {
            period_s,
            index: 0,
            slot: 0,
            first: None,
            scheduled: Instant::now(),
            sleeper: spin_sleep::SpinSleeper::default(),
        })
    }

    /// The same, spinning only for the last `spin_s` before a scheduled time (s, at most half a period is
    /// taken): for a thread that wakes on time, as one with real-time priority does.
    ///
    /// # Errors
    /// Where the period is not within 10 µs to 1 s, or `spin_s` not within 0 to 10 ms.
    pub fn with_spin(period_s: f64, spin_s: f64) -> Result<Self, DeviceError> {
        let is_allowed = (0.0..=0.01).contains(&spin_s);
        check_setting("spin_s", spin_s, is_allowed, "from 0 to 0.01 s")?;
        let nanoseconds = (spin_s.min(0.5 * period_s) * 1e9).round() as u32;
        Ok(Self {
            sleeper: spin_sleep::SpinSleeper::new(nanoseconds),
            ..Self::new(period_s)?
        })
    }
}

impl Clock for RealTime {
    fn period_s(&self) -> f64 {
        self.period_s
    }

    fn wait(&mut self) -> Release {
        let Some(first) = self.first else {
            let now = Instant::now();
            self.first = Some(now);
            self.scheduled = now;
            return Release {
                index: 0,
                time_s: 0.0,
                wake_delay_s: 0.0,
                skipped: 0,
            };
        };
        self.index += 1;
        let next = self.slot + 1;
        let now_s = first.elapsed().as_secs_f64();
        self.slot = next_slot(now_s, self.period_s, next);
        self.scheduled = first + Duration::from_secs_f64(self.slot as f64 * self.period_s);
        self.sleeper.sleep_until(self.scheduled);
        Release {
            index: self.index,
            time_s: self.index as f64 * self.period_s,
            wake_delay_s: self.since_release_s(),
            skipped: self.slot - next,
        }
    }

    fn since_release_s(&self) -> f64 {
        self.scheduled.elapsed().as_secs_f64()
    }
}

/// The first scheduled time at or after `now_s`, at least `next`.
fn next_slot(now_s: f64, period_s: f64, next: u64) -> u64 {
    ((now_s / period_s).ceil() as u64).max(next)
}

/// No waiting: the next period begins when the last is done. For headless runs.
///
/// Work is still timed, so a report can say what would have been late; nothing is ever skipped.
#[derive(Debug, Clone)]
pub struct AsFastAsPossible {
    period_s: f64,
    next_index: u64,
    released: Instant,
}

impl AsFastAsPossible {
    /// A clock with the given period, s.
    ///
    /// # Errors
    /// Where the period is not within 10 µs to 1 s.
    pub fn new(period_s: f64) -> Result<Self, DeviceError> {
        check_period(period_s)?;
        Ok(Self {
            period_s,
            next_index: 0,
            released: Instant::now(),
        })
    }
}

impl Clock for AsFastAsPossible {
    fn period_s(&self) -> f64 {
        self.period_s
    }

    fn wait(&mut self) -> Release {
        let index = self.next_index;
        self.next_index += 1;
        self.released = Instant::now();
        Release {
            index,
            time_s: index as f64 * self.period_s,
            wake_delay_s: 0.0,
            skipped: 0,
        }
    }

    fn since_release_s(&self) -> f64 {
        self.released.elapsed().as_secs_f64()
    }
}

/// A clock without time of its own: each period is as late and as long as it is told to be.
///
/// Behaves as [`RealTime`] would: a response longer than the period skips scheduled times.
#[derive(Debug, Clone)]
pub struct Driven {
    period_s: f64,
    next_index: u64,
    periods: VecDeque<(f64, f64)>,
    response_s: f64,
}

impl Driven {
    /// A clock with the given period, s, on which all is on time until told otherwise.
    ///
    /// # Errors
    /// Where the period is not within 10 µs to 1 s.
    pub fn new(period_s: f64) -> Result<Self, DeviceError> {
        check_period(period_s)?;
        Ok(Self {
            period_s,
            next_index: 0,
            periods: VecDeque::new(),
            response_s: 0.0,
        })
    }

    /// Says how the next period not yet described goes: woken `wake_delay_s` after its scheduled time,
    /// done `response_s` after it.
    pub fn push(&mut self, wake_delay_s: f64, response_s: f64) {
        self.periods.push_back((wake_delay_s, response_s));
    }
}

impl Clock for Driven {
    fn period_s(&self) -> f64 {
        self.period_s
    }

    fn wait(&mut self) -> Release {
        let skipped = next_slot(self.response_s, self.period_s, 1) - 1;
        let (wake_delay_s, response_s) = self.periods.pop_front().unwrap_or((0.0, 0.0));
        self.response_s = response_s;
        let index = self.next_index;
        self.next_index += 1;
        Release {
            index,
            time_s: index as f64 * self.period_s,
            wake_delay_s,
            skipped,
        }
    }

    fn since_release_s(&self) -> f64 {
        self.response_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_clock_gives_the_same_times() {
        let mut real = RealTime::new(1e-4).unwrap();
        let mut fast = AsFastAsPossible::new(1e-4).unwrap();
        let mut driven = Driven::new(1e-4).unwrap();
        driven.push(0.0, 5e-4);
        for k in 0..20_u64 {
            let expected = (k, k as f64 * 1e-4);
            for release in [real.wait(), fast.wait(), driven.wait()] {
                assert_eq!((release.index, release.time_s), expected);
                assert!(release.wake_delay_s >= 0.0);
            }
        }
        assert!(real.since_release_s() >= 0.0 && fast.since_release_s() >= 0.0);
        assert_eq!(real.period_s(), fast.period_s());
    }

    #[test]
    fn driven_clock_skips_what_a_long_response_covers() {
        let mut clock = Driven::new(1e-3).unwrap();
        for response in [1.0e-3, 1.1e-3, 5.0e-3, 0.0] {
            clock.push(1e-5, response);
        }
        let skipped: Vec<u64> = (0..5).map(|_| clock.wait().skipped).collect();
        // 1.0 ms is just in time, 1.1 ms loses one scheduled time, 5 ms loses four.
        assert_eq!(skipped, [0, 0, 1, 4, 0]);
    }

    #[test]
    fn next_slot_is_never_in_the_past_and_never_a_burst() {
        assert_eq!(next_slot(0.5e-3, 1e-3, 1), 1);
        assert_eq!(next_slot(7.2e-3, 1e-3, 3), 8);
        assert_eq!(next_slot(0.0, 1e-3, 3), 3);
    }

    #[test]
    fn ten_kilohertz_with_a_short_spin_skips_no_number() {
        let mut clock = RealTime::with_spin(1e-4, 3e-5).unwrap();
        for k in 0..200_u64 {
            let release = clock.wait();
            assert_eq!(release.index, k);
            assert!(release.wake_delay_s >= 0.0);
        }
        for bad in [-1.0, f64::NAN, 1.0] {
            assert!(RealTime::with_spin(1e-3, bad).is_err());
        }
    }

    #[test]
    fn period_out_of_range_is_refused() {
        for bad in [0.0, -1.0, 1e-7, 2.0, f64::NAN] {
            assert!(RealTime::new(bad).is_err());
            assert!(AsFastAsPossible::new(bad).is_err());
            assert!(Driven::new(bad).is_err());
        }
    }
}

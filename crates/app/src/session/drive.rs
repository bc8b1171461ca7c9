//! What moves the handle, and until when.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use device::{Phase, Script};

use crate::{Error, interrupt};

/// m, by how much a hand turns back before it counts as pulling out: more than a hand trembles.
const TURNS_BACK: f64 = 2e-4;

/// What moves the handle.
#[derive(Debug)]
pub(super) enum Drive<'a> {
    /// A script: it knows its phase and its end, and Ctrl-C leaves nothing.
    Scripted {
        /// The motion.
        script: Script,
        /// Its length.
        n_periods: u64,
    },
    /// A hand: its phase is seen from its way, and it ends when it is told to, by Ctrl-C as well.
    Live {
        /// Set by whoever ends it.
        stop: &'a AtomicBool,
        /// Its length at most.
        n_periods: Option<u64>,
        /// When it ends at the latest.
        until: Option<Instant>,
        /// Which way it goes.
        heading: Heading,
    },
}

/// Which way a hand goes, by how far it has gone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heading {
    /// m, the last turning point as far as it is known.
    extreme: f64,
    goes_in: bool,
}

impl Heading {
    /// At the start.
    pub(super) fn new() -> Self {
        Self {
            extreme: 0.0,
            goes_in: true,
        }
    }

    fn follow(&mut self, travel: f64) -> Phase {
        let sign = if self.goes_in { 1.0 } else { -1.0 };
        if sign * (travel - self.extreme) > 0.0 {
            self.extreme = travel;
        } else if sign * (self.extreme - travel) > TURNS_BACK {
            self.extreme = travel;
            self.goes_in = !self.goes_in;
        }
        if self.goes_in {
            Phase::Approach
        } else {
            Phase::Retract
        }
    }
}

impl Drive<'_> {
    /// Whether a period comes next.
    ///
    /// # Errors
    /// Ctrl-C in a script.
    pub(super) fn goes_on(&self, period: u64) -> Result<bool, Error> {
        match self {
            Self::Scripted { n_periods, .. } => {
                if interrupt::is_requested() {
                    return Err(Error::Interrupted);
                }
                Ok(period < *n_periods)
            }
            Self::Live {
                stop,
                n_periods,
                until,
                ..
            } => {
                let is_told = stop.load(Ordering::Relaxed) || interrupt::is_requested();
                let is_late = until.is_some_and(|until| Instant::now() >= until);
                Ok(!is_told && !is_late && n_periods.is_none_or(|n| period < n))
            }
        }
    }

    /// What the hand is doing. `travel`: of the held body, m.
    pub(super) fn phase(&mut self, time_s: f64, travel: f64) -> Phase {
        match self {
            Self::Scripted { script, .. } => script.phase(time_s),
            Self::Live { heading, .. } => heading.follow(travel),
        }
    }

    /// Periods, where it is known how many.
    pub(super) fn n_periods(&self) -> Option<u64> {
        match self {
            Self::Scripted { n_periods, .. } => Some(*n_periods),
            Self::Live { n_periods, .. } => *n_periods,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_trembles_does_not_turn_back() {
        let mut heading = Heading::new();
        let phases = [0.0, 1e-3, 0.9e-3, 2e-3, 1.7e-3, 1.8e-3, 1.6e-3, 1.9e-3];
        let seen: Vec<bool> = (phases.iter())
            .map(|x| heading.follow(*x) == Phase::Approach)
            .collect();
        let expected = [true, true, true, true, false, false, false, true];
        assert_eq!(seen, expected);
    }
}

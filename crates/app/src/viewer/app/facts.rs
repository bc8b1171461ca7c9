//! What does not change while a session goes on, and how fast loop and window are.

/// What a session is made of, in words.
#[derive(Clone, Debug)]
pub(crate) struct Facts {
    pub(crate) device: String,
    pub(crate) coupling: String,
    /// Effects that are simulated.
    pub(crate) effects: String,
    pub(crate) has_friction: bool,
    /// s, of the loop.
    pub(crate) period_s: f64,
}

/// s, over which rates are counted.
const SPAN_S: f64 = 0.5;

/// Periods and pictures a second.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    since: f64,
    periods_then: u64,
    pictures: u64,
    pub(super) periods_per_s: f64,
    pub(super) pictures_per_s: f64,
}

impl Pace {
    /// A picture is drawn. `now`: s; `n_periods`: of the loop so far.
    pub(super) fn look(&mut self, now: f64, n_periods: u64) {
        self.pictures += 1;
        let span = now - self.since;
        if span < SPAN_S {
            return;
        }
        self.periods_per_s = (n_periods - self.periods_then) as f64 / span;
        self.pictures_per_s = self.pictures as f64 / span;
        (self.since, self.periods_then, self.pictures) = (now, n_periods, 0);
    }
}

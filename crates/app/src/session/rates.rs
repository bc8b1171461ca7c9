//! One rate or two: whether whole steps are solved in the haptic loop, or beside it.

use std::time::Instant;

use super::SessionSpec;
use super::fast::FastLog;
use super::slow::SlowStep;
use crate::engine::Engine;
use crate::report::summary::Percentiles;

/// Share of a period that 99 % of the steps may take in the loop: the rest is for the device and for the clock.
pub const SHARE_OF_PERIOD: f64 = 0.7;

/// Steps of a rehearsal at most.
const MOST_STEPS: usize = 20_000;

/// What the scene asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rates {
    /// One without a real clock; with it, two if a rehearsal of the approach shows that steps do not fit the period.
    #[default]
    Auto,
    /// The whole step in the loop.
    One,
    /// The engine beside the loop. Without a real clock its results are there after so many periods, with it as soon
    /// as they are solved.
    Every(u32),
}

/// What was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenRates {
    /// Periods after which results are there without a real clock; `None`: the whole step in the loop.
    pub every: Option<u64>,
    /// Whether the engine has a thread of its own, and its results are there as soon as they are solved.
    pub is_beside: bool,
    /// Why, with the numbers.
    pub why: String,
}

/// What two rates tell.
#[derive(Clone, Debug)]
pub struct TwoRates {
    /// Hand-overs, staleness and validity, by the loop's periods.
    pub log: FastLog,
    /// The engine's steps, in order of time.
    pub steps: Vec<SlowStep>,
}

impl ChosenRates {
    /// Of a drive, which has no loop.
    pub(crate) fn driven() -> Self {
        Self {
            every: None,
            is_beside: false,
            why: "there is no loop".to_owned(),
        }
    }

    /// In a sentence.
    pub fn words(&self) -> String {
        let what = match self.every {
            None => "one rate: the haptic loop solves whole steps".to_owned(),
            Some(_) if self.is_beside => {
                "two rates: the engine runs beside the haptic loop".to_owned()
            }
            Some(n) => format!(
                "two rates: results of whole steps are there {n} periods after their target"
            ),
        };
        format!("{what} ({})", self.why)
    }
}

impl TwoRates {
    pub(super) fn new(log: FastLog, steps: Vec<SlowStep>) -> Self {
        Self { log, steps }
    }

    /// N, median and largest difference between the two problems of a hand-over that was felt; 0 without any.
    pub fn differences(&self) -> (f64, f64) {
        let felt = self.log.hand_overs.iter().map(|h| h.difference);
        let mut felt: Vec<f64> = felt.filter(|d| *d > 0.0).collect();
        felt.sort_unstable_by(f64::total_cmp);
        let at = |i: Option<usize>| i.and_then(|i| felt.get(i)).copied().unwrap_or(0.0);
        (at(Some(felt.len() / 2)), at(felt.len().checked_sub(1)))
    }

    /// µs, of the engine's steps with contact, frozen: median and 99 %.
    pub fn step_us(&self) -> Option<Percentiles> {
        let touching = self.steps.iter().filter(|s| s.report.contacts > 0);
        Percentiles::of_ns(touching.map(|s| s.step_ns + s.freeze_ns))
    }
}

/// Decides by what the scene asks for; measures where it leaves it open and the clock is real. The engine is as before.
pub(super) fn choose(spec: &SessionSpec, engine: &mut Engine) -> ChosenRates {
    let (every, why) = match spec.rates {
        Rates::One => (None, "asked for".to_owned()),
        Rates::Every(n) => (Some(u64::from(n)), "asked for".to_owned()),
        Rates::Auto if !spec.real_time => (None, "no real clock to keep up with".to_owned()),
        Rates::Auto => rehearse(spec, engine),
    };
    ChosenRates {
        every,
        is_beside: every.is_some() && spec.real_time,
        why,
    }
}

/// Times the approach step by step, as the loop would go it. Ends early where too many steps are too long already.
fn rehearse(spec: &SessionSpec, engine: &mut Engine) -> (Option<u64>, String) {
    let limit_ns = 1e9 * SHARE_OF_PERIOD * spec.period_s;
    let n = (spec.travel / (spec.speed * spec.period_s)).ceil();
    let n = (n as usize).clamp(1, MOST_STEPS);
    let mut times = Vec::with_capacity(n + 1);
    let mut n_over = 0;
    engine.reset();
    for k in 0..=n {
        let shift = spec.travel * k as f64 / n as f64 * spec.direction.normalize();
        let target = spec.held.target(&spec.held.along(shift));
        let begun = Instant::now();
        let report = engine.step(&target);
        let step_ns = begun.elapsed().as_nanos() as u64;
        if report.contacts == 0 {
            continue;
        }
        times.push(step_ns);
        n_over += usize::from(step_ns as f64 > limit_ns);
        if n_over > n / 100 + 1 {
            break;
        }
    }
    engine.reset();
    let limit_us = 1e-3 * limit_ns;
    let Some(measured) = Percentiles::of_ns(times.iter().copied()) else {
        return (
            None,
            "a rehearsal of the approach touched nothing".to_owned(),
        );
    };
    let text = format!(
        "in a rehearsal of the approach 99 % of {} steps with contact took {:.0} us or less, half of them {:.0} us; \
         {limit_us:.0} us fit the period",
        times.len(),
        measured.p99,
        measured.p50,
    );
    let every = (measured.p99 > limit_us).then(|| {
        let periods = 1e-6 * measured.p99 / spec.period_s;
        periods.ceil().max(1.0) as u64
    });
    (every, text)
}

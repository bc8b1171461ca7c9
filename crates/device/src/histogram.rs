//! Statistics of times: a fixed histogram that is filled without allocating.

use hdrhistogram::Histogram;

/// Longest time told apart, ns: 100 s. Longer ones are counted in the last bucket; the maximum stays exact.
const LONGEST_NS: u64 = 100_000_000_000;

/// Histogram of durations from 1 ns to 100 s, each kept to three significant digits; the largest is exact.
#[derive(Debug, Clone)]
pub struct TimeHistogram {
    counts: Histogram<u64>,
    max_s: f64,
}

/// The figures by which a distribution of times is judged, s. All 0 where nothing was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TimeSummary {
    /// Number of times recorded.
    pub count: u64,
    /// Median, s.
    pub p50_s: f64,
    /// 99 % are no longer than this, s.
    pub p99_s: f64,
    /// 99.9 % are no longer than this, s.
    pub p999_s: f64,
    /// The longest, s.
    pub max_s: f64,
}

impl TimeHistogram {
    /// An empty histogram; all its memory (about 0.2 MB) is taken here.
    ///
    /// # Panics
    /// Never: the bounds are constants that the histogram accepts.
    #[must_use]
    pub fn new() -> Self {
        let mut counts = Histogram::new_with_bounds(1, LONGEST_NS, 3)
            .expect("1 ns to 100 s with three digits are valid bounds");
        counts.auto(false);
        Self { counts, max_s: 0.0 }
    }

    /// Adds one duration, s. Below 1 ns, negative or not a number counts as 0.
    ///
    /// Real-time: no allocation.
    pub fn record(&mut self, seconds: f64) {
        let seconds = seconds.max(0.0);
        self.max_s = self.max_s.max(seconds);
        // Float to integer saturates; what lies beyond the bounds goes into the last bucket.
        self.counts
            .saturating_record((seconds * 1e9).round() as u64);
    }

    /// Number of durations recorded.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.counts.len()
    }

    /// The duration that a part `quantile` (0 to 1) of the recorded ones do not exceed, s.
    #[must_use]
    pub fn quantile(&self, quantile: f64) -> f64 {
        if self.counts.is_empty() {
            return 0.0;
        }
        (self.counts.value_at_quantile(quantile) as f64 * 1e-9).min(self.max_s)
    }

    /// The figures for a report.
    #[must_use]
    pub fn summary(&self) -> TimeSummary {
        TimeSummary {
            count: self.count(),
            p50_s: self.quantile(0.5),
            p99_s: self.quantile(0.99),
            p999_s: self.quantile(0.999),
            max_s: self.max_s,
        }
    }

    /// Forgets all, as after a warm-up. Keeps the memory.
    pub fn clear(&mut self) {
        self.counts.reset();
        self.max_s = 0.0;
    }

    /// Buckets that hold something: (longest duration of the bucket in s, count), rising.
    pub fn buckets(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        self.counts
            .iter_recorded()
            .map(|v| (v.value_iterated_to() as f64 * 1e-9, v.count_at_value()))
    }
}

impl Default for TimeHistogram {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_ramp_are_its_values_to_three_digits() {
        let mut histogram = TimeHistogram::new();
        for k in 1..=10_000 {
            histogram.record(f64::from(k) * 1e-6);
        }
        let summary = histogram.summary();
        assert_eq!(summary.count, 10_000);
        for (is, expected) in [
            (summary.p50_s, 5.0e-3),
            (summary.p99_s, 9.9e-3),
            (summary.p999_s, 9.99e-3),
        ] {
            assert!((is / expected - 1.0).abs() < 1e-3, "{is} {expected}");
        }
        assert_eq!(summary.max_s, 10_000.0 * 1e-6);
        assert_eq!(histogram.buckets().map(|b| b.1).sum::<u64>(), 10_000);
    }

    #[test]
    fn times_out_of_range_are_counted_and_the_longest_is_exact() {
        let mut histogram = TimeHistogram::new();
        for time in [-1.0, f64::NAN, 0.0, 1e-12, 1e6] {
            histogram.record(time);
        }
        assert_eq!(histogram.count(), 5);
        assert_eq!(histogram.summary().max_s, 1e6);
        assert!(histogram.quantile(0.5) < 1e-8);
        histogram.record(f64::INFINITY);
        assert_eq!(histogram.summary().max_s, f64::INFINITY);
        histogram.clear();
        assert_eq!(histogram.summary(), TimeSummary::default());
    }
}

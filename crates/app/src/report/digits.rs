//! Numbers as people read them: few digits, and none below what the run can tell.

use super::data::{Frame, Run};
use super::plot::short;

/// Share of a scale below which a number says nothing: pictures and captions stand beside numbers of three digits.
const LEAST: f64 = 1e-4;

/// As [`short`], but without the digits that are lost beside `scale`, the largest number of its kind in the run: 3e-12 N in a run
/// that reaches 8 N is round-off, and is written 0.
pub(crate) fn beside(value: f64, scale: f64) -> String {
    let least = LEAST * scale.abs();
    if !value.is_finite() || !least.is_finite() || least == 0.0 {
        return short(value);
    }
    // The power of ten that is no larger than the least share: what is kept is a whole number of it.
    let digit = 10f64.powf(least.log10().floor());
    let kept = (value / digit).round() * digit;
    short(if kept == 0.0 { 0.0 } else { kept })
}

/// What travel and force of a run reach, for the captions of its frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunScale {
    travel_m: f64,
    force_n: f64,
}

impl RunScale {
    pub(crate) fn of(run: &Run) -> Self {
        let (rows, frames) = (|| run.rows.iter(), || run.frames.iter());
        let travel = rows().map(|r| r.travel_m);
        let force = rows().map(|r| r.force_n);
        Self {
            travel_m: largest(travel.chain(frames().map(|f| f.travel_m))),
            force_n: largest(force.chain(frames().map(|f| f.force_n))),
        }
    }

    /// Travel of a frame, mm.
    pub(crate) fn travel_mm(&self, frame: &Frame) -> String {
        beside(frame.travel_m * 1e3, self.travel_m * 1e3)
    }

    /// Force of a frame, N.
    pub(crate) fn force_n(&self, frame: &Frame) -> String {
        beside(frame.force_n, self.force_n)
    }
}

/// Largest size of the finite `values`; 0 of none.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values
        .filter(|v| v.is_finite())
        .fold(0.0, |max, v| v.abs().max(max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_off_beside_the_scale_is_zero_without_a_sign() {
        for (value, scale, text) in [
            (-3e-12, 8.4, "0"),
            (-0.0, 8.4, "0"),
            (-1.84e-7, 6.0, "0"),
            (0.012_34, 8.4, "0.0123"),
            (0.000_412, 8.4, "0.0004"),
            (-8.443, 8.4, "-8.44"),
            (3.1e-9, 8e-9, "0.0000000031"),
            (1234.4, 1234.4, "1234"),
        ] {
            assert_eq!(beside(value, scale), text, "{value} beside {scale}");
        }
        assert_eq!(beside(-2e-5, 0.0), "-0.00002");
        assert_eq!(beside(f64::NAN, 1.0), "NaN");
        assert_eq!(largest([1.0, -3.0, f64::NAN].into_iter()), 3.0);
    }
}

//! The felt curve for the plot, in memory of fixed size, and the times of the loop.

use egui_plot::PlotPoint;
use hdrhistogram::Histogram;

use crate::session::TracePoint;

/// Points that are kept; beyond, the older half goes.
const MOST_POINTS: usize = 8_192;

/// Of the plot's width and height, what a point has to differ from the last one by to be kept.
const GRAIN: f64 = 2e-3;

/// us, longest time that is told apart.
const LONGEST_US: u64 = 1_000_000;

/// What has been felt.
pub(super) struct Trail {
    /// mm and N.
    points: Vec<PlotPoint>,
    /// mm and N that fill the plot.
    scale: [f64; 2],
    /// us, scheduled time to the end of the write.
    response: Option<Histogram<u64>>,
    /// Periods, and those that ended too late.
    pub(super) n_periods: u64,
    pub(super) n_late: u64,
}

impl Trail {
    /// `scale`: mm and N that fill the plot.
    pub(super) fn new(scale: [f64; 2]) -> Self {
        Self {
            points: Vec::with_capacity(MOST_POINTS),
            scale,
            // The bounds are fixed and good.
            response: Histogram::new_with_bounds(1, LONGEST_US, 2).ok(),
            n_periods: 0,
            n_late: 0,
        }
    }

    /// A period.
    pub(super) fn push(&mut self, point: &TracePoint) {
        self.n_periods += 1;
        self.n_late += u64::from(point.is_late);
        if let Some(response) = &mut self.response {
            response.saturating_record((1e6 * point.response_s).max(1.0) as u64);
        }
        let new = PlotPoint::new(1e3 * point.travel, point.resistance);
        if !(new.x.is_finite() && new.y.is_finite()) {
            return;
        }
        let is_near = self.points.last().is_some_and(|last| {
            (new.x - last.x).abs() < GRAIN * self.scale[0]
                && (new.y - last.y).abs() < GRAIN * self.scale[1]
        });
        if is_near {
            return;
        }
        if self.points.len() == MOST_POINTS {
            self.points.drain(..MOST_POINTS / 2);
        }
        self.points.push(new);
    }

    /// mm and N, oldest first.
    pub(super) fn points(&self) -> &[PlotPoint] {
        &self.points
    }

    /// Begins a new curve.
    pub(super) fn clear(&mut self) {
        self.points.clear();
    }

    /// us below which this share of the periods were answered.
    pub(super) fn response_us(&self, share: f64) -> u64 {
        let response = self.response.as_ref();
        response.map_or(0, |r| r.value_at_quantile(share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded_and_peaks_stay() {
        let mut trail = Trail::new([10.0, 10.0]);
        let capacity = trail.points.capacity();
        for k in 0..200_000_u32 {
            let t = f64::from(k) * 1e-3;
            trail.push(&TracePoint {
                travel: 5e-3 * (1.0 + t.sin()),
                resistance: 8.0 * (7.0 * t).sin(),
                response_s: 5e-5,
                is_late: k % 1000 == 0,
            });
        }
        assert!(trail.points.len() <= MOST_POINTS && trail.points.capacity() == capacity);
        let peak = trail.points.iter().map(|p| p.y).fold(0.0, f64::max);
        assert!((peak - 8.0).abs() < 2.0 * GRAIN * 10.0, "{peak}");
        assert_eq!((trail.n_periods, trail.n_late), (200_000, 200));
        assert!((45..=55).contains(&trail.response_us(0.5)));
    }

    #[test]
    fn a_tool_at_rest_adds_nothing() {
        let mut trail = Trail::new([10.0, 10.0]);
        for travel in [1e-3, 1e-3, 1.001e-3, f64::NAN] {
            trail.push(&TracePoint {
                travel,
                resistance: 0.0,
                response_s: 0.0,
                is_late: false,
            });
        }
        assert_eq!(trail.points().len(), 1);
    }
}

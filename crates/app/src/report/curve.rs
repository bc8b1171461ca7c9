//! What a force-travel curve says about a snap: peak, drop, work, retention.

use super::data::{Phase, StepRow};

/// Share of the peak under which the force counts as gone: a clip that has let go is held by
/// nothing, but positions carry rounding of 1e-16 m that a stiff coupling turns into forces.
const ZERO_FORCE_SHARE: f64 = 1e-3;

/// Key numbers of a force-travel curve. Forces along the approach, positive when the hand is
/// resisted; rows whose force or travel is not finite are passed over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Curve {
    /// Largest resistance during insertion, N; 0 where nothing resists.
    pub peak_force_n: f64,
    /// Travel at the peak, m.
    pub travel_at_peak_m: f64,
    /// Position of the peak among the rows; `None` where nothing resists.
    pub peak_row_idx: Option<usize>,
    /// Peak minus the smallest force after it, still during insertion, N; >= 0. More than the
    /// peak where the part pulls the tool in.
    pub snap_drop_n: f64,
    /// Travel from the peak to where the force is gone, m; `None` where it never is.
    pub snap_travel_m: Option<f64>,
    /// Work that the hand puts in until the force is gone after the peak (to the end of the
    /// insertion, if it never is), J: integral of force over travel, trapezoid rule.
    pub insertion_work_j: f64,
    /// Work of the hand over the whole insertion, J: without friction the part gives back what was
    /// put in, and what is left is stored in it at home.
    pub net_work_j: f64,
    /// Largest pull during retraction, N, >= 0; `None` without retraction, or where the pull was
    /// still growing at its end, so that the tool is not out.
    pub retention_force_n: Option<f64>,
}

impl Curve {
    /// Reads the numbers off the steps of a run.
    pub fn of(rows: &[StepRow]) -> Self {
        let finite = |row: &StepRow| row.force_n.is_finite() && row.travel_m.is_finite();
        let insertion: Vec<(usize, f64, f64)> = rows
            .iter()
            .enumerate()
            .filter(|(_, row)| row.phase == Phase::Approach && finite(row))
            .map(|(idx, row)| (idx, row.travel_m, row.force_n))
            .collect();
        let net_work_j = work(&insertion);
        let mut curve = Self {
            insertion_work_j: net_work_j,
            net_work_j,
            retention_force_n: retention(rows.iter().filter(|row| finite(row))),
            ..Self::default()
        };
        let mut peak: Option<usize> = None;
        for (at, &(_, _, force)) in insertion.iter().enumerate() {
            if force > peak.map_or(0.0, |p| insertion[p].2) {
                peak = Some(at);
            }
        }
        let Some(peak) = peak else { return curve };
        let (row_idx, travel, force) = insertion[peak];
        curve.peak_row_idx = Some(row_idx);
        curve.peak_force_n = force;
        curve.travel_at_peak_m = travel;
        let after = &insertion[peak..];
        let lowest = after.iter().map(|&(_, _, f)| f).fold(force, f64::min);
        curve.snap_drop_n = force - lowest;
        let gone = ZERO_FORCE_SHARE * force;
        if let Some(end) = after.windows(2).position(|w| w[1].2 <= gone) {
            let ((_, x0, f0), (_, x1, f1)) = (after[end], after[end + 1]);
            // Where the straight line between the two steps meets zero, or at the second step.
            let share = if f1 < 0.0 { f0 / (f0 - f1) } else { 1.0 };
            let way = share * (x1 - x0);
            curve.snap_travel_m = Some(x0 + way - travel);
            curve.insertion_work_j =
                work(&insertion[..=peak + end]) + 0.5 * (f0 + f1.max(0.0)) * way;
        }
        curve
    }

    /// Whether the force was gone, or pulled, at some travel after the peak.
    pub fn snaps_home(&self) -> bool {
        self.snap_travel_m.is_some()
    }
}

/// J, trapezoid rule over (row, travel, force).
fn work(rows: &[(usize, f64, f64)]) -> f64 {
    rows.windows(2)
        .map(|w| 0.5 * (w[0].2 + w[1].2) * (w[1].1 - w[0].1))
        .sum()
}

fn retention<'a>(rows: impl Iterator<Item = &'a StepRow>) -> Option<f64> {
    let pulls: Vec<f64> = rows
        .filter(|row| row.phase == Phase::Retract)
        .map(|row| -row.force_n)
        .collect();
    let largest = pulls.iter().copied().fold(0.0, f64::max);
    let last = *pulls.last()?;
    let still_growing = last > 0.0 && last >= largest;
    (!still_growing).then_some(largest)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::sample;
    use super::*;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-3), "{a} is not {b}");
    }

    #[test]
    fn the_numbers_of_a_curve_made_of_straight_lines() {
        // 40 N at 2 mm, zero at 2.8 mm, -10 N at 3 mm, zero at 4 mm.
        let curve = Curve::of(&sample::rows());
        close(curve.peak_force_n, 40.0);
        close(curve.travel_at_peak_m, 2e-3);
        assert_eq!(curve.peak_row_idx, Some(200));
        close(curve.snap_drop_n, 50.0);
        close(curve.snap_travel_m.unwrap(), 0.8e-3);
        assert!(curve.snaps_home());
        close(curve.insertion_work_j, 0.5 * 2.8e-3 * 40.0);
        close(
            curve.net_work_j,
            0.5 * 2e-3 * 40.0 + 0.5 * 1e-3 * (40.0 - 10.0) - 0.5e-3 * 10.0,
        );
        close(curve.retention_force_n.unwrap(), 15.0);
    }

    #[test]
    fn the_numbers_of_a_smooth_curve() {
        // F = 30 sin(x): peak at pi/2, zero at pi, -30 N at 3 pi / 2; in mm.
        let template = sample::rows()[0];
        let rows: Vec<StepRow> = (0..=20_000)
            .map(|i| {
                let x = f64::from(i) / 20_000.0 * 1.5 * std::f64::consts::PI;
                let mut row = template;
                (row.travel_m, row.force_n) = (x * 1e-3, 30.0 * x.sin());
                row
            })
            .collect();
        let curve = Curve::of(&rows);
        assert!((curve.peak_force_n - 30.0).abs() < 1e-6);
        assert!((curve.travel_at_peak_m - 0.5e-3 * std::f64::consts::PI).abs() < 1e-6);
        assert!((curve.snap_travel_m.unwrap() - 0.5e-3 * std::f64::consts::PI).abs() < 1e-6);
        assert!((curve.snap_drop_n - 60.0).abs() < 1e-6);
        // Without the last thousandth of the peak: a triangle of 0.03 N by 1 um.
        assert!((curve.insertion_work_j - 0.06).abs() < 2e-8);
        assert!((curve.net_work_j - 0.03).abs() < 1e-8);
        assert_eq!(curve.retention_force_n, None);
    }

    #[test]
    fn a_force_that_only_grows_does_not_snap() {
        let rows: Vec<StepRow> = sample::rows().into_iter().take(150).collect();
        let curve = Curve::of(&rows);
        assert_eq!(curve.snap_drop_n, 0.0);
        assert_eq!(curve.snap_travel_m, None);
        assert!(!curve.snaps_home());
    }

    #[test]
    fn a_hook_that_lets_go_at_once_snaps_in_one_step() {
        let mut rows: Vec<StepRow> = sample::rows().into_iter().take(202).collect();
        rows[201].force_n = 1e-12;
        let curve = Curve::of(&rows);
        close(curve.snap_travel_m.unwrap(), 1e-5);
        close(curve.snap_drop_n, 40.0);
    }

    #[test]
    fn nothing_touched_is_no_peak() {
        assert_eq!(Curve::of(&[]), Curve::default());
        let mut rows = sample::rows();
        for row in &mut rows {
            row.force_n = 0.0;
        }
        let curve = Curve::of(&rows);
        assert_eq!(curve.peak_row_idx, None);
        assert_eq!(curve.retention_force_n, Some(0.0));
    }

    #[test]
    fn a_tool_that_is_still_held_has_no_retention_force_yet() {
        // The pull of the sample grows until half way back.
        let rows: Vec<StepRow> = sample::rows().into_iter().take(650).collect();
        assert_eq!(Curve::of(&rows).retention_force_n, None);
    }
}

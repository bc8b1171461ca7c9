//! How long steps take.

use std::error::Error;

use plotters::prelude::*;

use super::super::data::{STAGE_NAMES, StepRow};
use super::{
    BLUE, FINE, Format, GREEN, GREY, GRID, INK, Key, ORANGE, PURPLE, SKY, VERMILLION, draw, empty,
    short, words,
};

/// `step-time.svg`: for each stage and the whole step, which time (µs) is not exceeded by which
/// share of the steps. The horizontal axis gives each further nine of the share equal room.
///
/// # Errors
/// What the plot library says.
pub fn step_time(rows: &[StepRow], format: Format) -> Result<String, Box<dyn Error>> {
    let sorted = |times: Vec<u64>| -> Vec<f64> {
        let mut sorted: Vec<f64> = times.into_iter().map(|ns| ns.max(1) as f64 / 1e3).collect();
        sorted.sort_by(f64::total_cmp);
        sorted
    };
    let colours = [SKY, GREEN, ORANGE, VERMILLION, PURPLE];
    let mut lines: Vec<(Key, Vec<f64>)> = Vec::new();
    for (stage_idx, name) in STAGE_NAMES.into_iter().enumerate() {
        // A stage that the scene does not call for is no line.
        if !rows.is_empty() && rows.iter().all(|row| row.stage_ns[stage_idx] == 0) {
            continue;
        }
        let times = sorted(rows.iter().map(|row| row.stage_ns[stage_idx]).collect());
        lines.push((Key::new(name, colours[stage_idx % colours.len()], 2), times));
    }
    let multiply = sorted(rows.iter().filter_map(|row| row.multiply_ns).collect());
    if !multiply.is_empty() {
        lines.push((Key::new("multiply (display rate)", GREY, 2), multiply));
    }
    let total = sorted(rows.iter().map(|row| row.total_ns).collect());
    lines.push((Key::new("total", BLUE, 4), total));

    let all = || lines.iter().flat_map(|line| &line.1).copied();
    let low = all().fold(f64::INFINITY, f64::min).clamp(1e-3, 1.0);
    let high = all().fold(10.0 * low, f64::max);
    // 1 in n steps is slower; the last mark is the slowest of all.
    let nines = (rows.len().max(10) as f64).log10();
    let keys: Vec<Key> = lines.iter().map(|(key, _)| key.clone()).collect();
    draw(format, &keys, |root| {
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .margin_right(32 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(format.aside() * FINE)
            .build_cartesian_2d(0.0..nines, (0.7 * low..1.6 * high).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("share of the steps that took no longer")
            .y_desc("time (µs)")
            .label_style(words(17, INK))
            .axis_desc_style(words(18, INK))
            .axis_style(GREY.stroke_width(FINE as u32))
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(5 * FINE)
            .x_labels(nines.ceil() as usize + 1)
            .x_label_formatter(&|x| share(*x))
            .y_label_formatter(&|y| short(*y))
            .draw()?;
        for (key, times) in lines.iter().filter(|(_, times)| !times.is_empty()) {
            chart.draw_series(LineSeries::new(percentile_curve(times, nines), key.style()))?;
        }
        if rows.is_empty() {
            empty(root)?;
        }
        Ok(())
    })
}

/// Sorted times over -log10(1 - share).
fn percentile_curve(times: &[f64], nines: f64) -> Vec<(f64, f64)> {
    const POINTS: usize = 400;
    let n = times.len();
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut last = usize::MAX;
    for k in 0..=POINTS {
        let x = nines * k as f64 / POINTS as f64;
        let rank = ((1.0 - 10f64.powf(-x)) * n as f64).floor() as usize;
        let rank = rank.min(n - 1);
        if rank != last {
            points.push((x, times[rank]));
            last = rank;
        }
    }
    points.push((nines.min((n as f64).log10().max(0.0)), times[n - 1]));
    points
}

/// `-log10(1 - share)` as a share in per cent.
fn share(nines: f64) -> String {
    let rest = 100.0 * 10f64.powf(-nines);
    let digits = (nines.ceil() as usize).saturating_sub(2);
    format!("{:.digits$} %", 100.0 - rest)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::super::sample;
    use super::*;

    #[test]
    fn step_time_shows_every_stage() {
        let svg = step_time(&sample::rows(), Format::Wide).unwrap();
        for text in STAGE_NAMES
            .into_iter()
            .chain(["total", "multiply", "(µs)", "99 %"])
        {
            assert!(svg.contains(text), "{text}");
        }
    }

    #[test]
    fn nothing_to_show_is_said() {
        assert!(step_time(&[], Format::Narrow).unwrap().contains("no steps"));
    }

    #[test]
    fn shares_are_nines() {
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0].map(share),
            ["0 %", "90 %", "99 %", "99.9 %"]
        );
    }
}

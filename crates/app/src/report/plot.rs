//! Plots as SVG: force over travel, and how long steps take.

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::curve::Curve;
use super::data::{Phase, Run, STAGE_NAMES, StepRow};
use super::font;

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Colours that stay apart for every common colour vision (Okabe and Ito 2008).
pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(super) const SKY: RGBColor = RGBColor(86, 180, 233);
pub(super) const PURPLE: RGBColor = RGBColor(204, 121, 167);
pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
pub(super) const GREY: RGBColor = RGBColor(120, 120, 120);
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);

/// Size of a plot as it is shown, pixels.
pub(super) const SIZE: (i32, i32) = (960, 540);

/// The plot library rounds to whole units, which would show as steps in slanted lines: it gets
/// this many units per pixel.
pub(super) const FINE: i32 = 8;

/// Points of a line beyond which only extremes within equal stretches are drawn.
const MAX_POINTS: usize = 2_000;

/// `force-travel.svg`: mm and N, the peak marked, the handbook's curve dashed.
///
/// # Errors
/// What the plot library says.
pub fn force_travel(run: &Run, curve: &Curve) -> Result<String, Box<dyn Error>> {
    let of_phase = |wanted: &dyn Fn(Phase) -> bool| -> Vec<(f64, f64)> {
        let rows = run.rows.iter().filter(|row| wanted(row.phase));
        let points = rows.map(|row| (row.travel_m * 1e3, row.force_n));
        points
            .filter(|p| p.0.is_finite() && p.1.is_finite())
            .collect()
    };
    let insertion = of_phase(&|phase| phase != Phase::Retract);
    let retraction = of_phase(&|phase| phase == Phase::Retract);
    let handbook: Vec<(f64, f64)> =
        run.handbook
            .iter()
            .flat_map(|h| &h.curve)
            .fold(Vec::new(), |mut points, &(x, f)| {
                if x.is_finite() && f.is_finite() {
                    points.push((x * 1e3, f));
                }
                points
            });
    let all = || insertion.iter().chain(&retraction).chain(&handbook);
    let (x0, x1) = range(all().map(|p| p.0));
    let (y0, y1) = range(all().map(|p| p.1).chain([0.0]));
    let room = 0.08 * (y1 - y0);

    let dashes = handbook.len() > 1;
    // The formula after the colon stands beside the table, not in the legend.
    let book = run
        .handbook
        .as_ref()
        .and_then(|h| h.name.split(": ").next())
        .unwrap_or_default();
    let mut keys = vec![Key::new("pushing in", BLUE, 3)];
    if !retraction.is_empty() {
        keys.push(Key::new("pulling out", VERMILLION, 2));
    }
    if dashes {
        keys.push(Key {
            is_dashed: true,
            ..Key::new(&format!("handbook: {book}"), INK, 2)
        });
    }

    draw(&keys, |root| {
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(70 * FINE)
            .build_cartesian_2d(x0..x1, y0 - room..y1 + 2.0 * room)?;
        chart
            .configure_mesh()
            .x_desc("travel (mm)")
            .y_desc("force at the hand (N), positive when it resists")
            .label_style(words(17, INK))
            .axis_desc_style(words(18, INK))
            .axis_style(GREY.stroke_width(FINE as u32))
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(5 * FINE)
            .x_label_formatter(&|x| short(*x))
            .y_label_formatter(&|y| short(*y))
            .draw()?;
        chart.draw_series(LineSeries::new([(x0, 0.0), (x1, 0.0)], stroke(GREY, 1)))?;
        chart.draw_series(LineSeries::new(thinned(&retraction), stroke(VERMILLION, 2)))?;
        chart.draw_series(LineSeries::new(thinned(&insertion), stroke(BLUE, 3)))?;
        if dashes {
            let (dash, space) = (8 * FINE, 5 * FINE);
            chart.draw_series(DashedLineSeries::new(
                handbook.clone(),
                dash,
                space,
                stroke(INK, 2),
            ))?;
        }
        if curve.peak_row_idx.is_some() {
            let peak = (curve.travel_at_peak_m * 1e3, curve.peak_force_n);
            let text = format!("peak {} N at {} mm", short(peak.1), short(peak.0));
            let style = words(18, INK);
            let (width, height) = root.estimate_text_size(&text, &style)?;
            // On the side that has room.
            let is_right = peak.0 > 0.5 * (x0 + x1);
            let aside = if is_right {
                -12 * FINE - width as i32
            } else {
                12 * FINE
            };
            let shift = (aside, -8 * FINE - height as i32);
            let end = (shift.0 + width as i32, shift.1 + height as i32);
            // The words stay readable where a curve runs below them.
            let backdrop = WHITE.mix(0.85).filled();
            chart.draw_series([EmptyElement::at(peak)
                + Rectangle::new([shift, end], backdrop)
                + Circle::new((0, 0), 6 * FINE, INK.filled())
                + Circle::new((0, 0), 4 * FINE, ORANGE.filled())
                + Text::new(text, shift, style)])?;
        }
        if all().next().is_none() {
            empty(root)?;
        }
        Ok(())
    })
}

/// `step-time.svg`: for each stage and the whole step, which time (µs) is not exceeded by which
/// share of the steps. The horizontal axis gives each further nine of the share equal room.
///
/// # Errors
/// What the plot library says.
pub fn step_time(rows: &[StepRow]) -> Result<String, Box<dyn Error>> {
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
    draw(&keys, |root| {
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .margin_right(32 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(70 * FINE)
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

/// At most three significant digits, without trailing zeros.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 {
            "0".into()
        } else {
            value.to_string()
        };
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.digits$}");
    if !text.contains('.') {
        return text;
    }
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.to_owned()
    }
}

/// A line of the legend.
#[derive(Clone, Debug)]
pub(super) struct Key {
    label: String,
    colour: RGBColor,
    width: i32,
    pub(super) is_dashed: bool,
}

impl Key {
    pub(super) fn new(label: &str, colour: RGBColor, width: i32) -> Self {
        Self {
            label: label.to_owned(),
            colour,
            width,
            is_dashed: false,
        }
    }

    fn style(&self) -> ShapeStyle {
        stroke(self.colour, self.width)
    }
}

/// Draws on white, with the legend in a line above the plot, and hands the SVG text back.
pub(super) fn draw(
    keys: &[Key],
    content: impl FnOnce(&Area<'_>) -> Result<(), Box<dyn Error>>,
) -> Result<String, Box<dyn Error>> {
    font::register();
    let fine = ((SIZE.0 * FINE) as u32, (SIZE.1 * FINE) as u32);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, fine).into_drawing_area();
        root.fill(&WHITE)?;
        let lines = legend_lines(&root, keys)?;
        let (head, body) = root.split_vertically((10 + 24 * lines.len().max(1) as i32) * FINE);
        legend(&head, &lines)?;
        content(&body)?;
        root.present().map_err(|e| e.to_string())?;
    }
    let at_fine = format!("width=\"{}\" height=\"{}\"", fine.0, fine.1);
    let shown = format!("width=\"{}\" height=\"{}\"", SIZE.0, SIZE.1);
    Ok(svg.replacen(&at_fine, &shown, 1))
}

/// Letters of a legend's entry that fit beside the others.
const LEGEND_LENGTH: usize = 70;

/// A key, its label cut to what fits, and the label's size.
type LegendEntry<'a> = (&'a Key, String, (i32, i32));

/// The keys in as many lines as they need.
fn legend_lines<'a>(
    area: &Area<'_>,
    keys: &'a [Key],
) -> Result<Vec<Vec<LegendEntry<'a>>>, Box<dyn Error>> {
    let mut lines: Vec<Vec<LegendEntry<'a>>> = Vec::new();
    let mut x = i32::MAX;
    for key in keys {
        let mut label: String = key.label.chars().take(LEGEND_LENGTH).collect();
        if label.len() < key.label.len() {
            label.push('…');
        }
        let (width, height) = area.estimate_text_size(&label, &words(17, INK))?;
        let size = (width as i32, height as i32);
        let needed = 55 * FINE + size.0;
        if x.saturating_add(needed) > (SIZE.0 - 12) * FINE {
            lines.push(Vec::new());
            x = 84 * FINE;
        }
        x += needed;
        if let Some(line) = lines.last_mut() {
            line.push((key, label, size));
        }
    }
    Ok(lines)
}

fn legend(head: &Area<'_>, lines: &[Vec<LegendEntry<'_>>]) -> Result<(), Box<dyn Error>> {
    for (entries, k) in lines.iter().zip(0..) {
        let (mut x, y) = (84 * FINE, (20 + 24 * k) * FINE);
        for (key, label, (width, height)) in entries {
            let line = |from: i32, to: i32| {
                let ends = [(x + from * FINE, y), (x + to * FINE, y)];
                head.draw(&PathElement::new(ends, key.style()))
            };
            if key.is_dashed {
                line(0, 10)?;
                line(15, 25)?;
            } else {
                line(0, 25)?;
            }
            let place = (x + 33 * FINE, y - height / 2);
            head.draw(&Text::new(label.clone(), place, words(17, INK)))?;
            x += 55 * FINE + width;
        }
    }
    Ok(())
}

pub(super) fn stroke(colour: RGBColor, width: i32) -> ShapeStyle {
    colour.stroke_width((width * FINE) as u32)
}

pub(super) fn words(size: i32, colour: RGBColor) -> TextStyle<'static> {
    (font::FAMILY, size * FINE).into_font().color(&colour)
}

pub(super) fn empty(root: &Area<'_>) -> Result<(), Box<dyn Error>> {
    let place = ((SIZE.0 / 2 - 60) * FINE, (SIZE.1 / 2 - 40) * FINE);
    root.draw(&Text::new("no steps to show", place, words(20, GREY)))
        .map_err(|e| e.to_string().into())
}

/// Smallest and largest value, widened to an interval that can be drawn.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
        (a.min(v), b.max(v))
    });
    if low > high {
        return (0.0, 1.0);
    }
    if high - low < 1e-9 * high.abs().max(1e-3) {
        let half = 0.5 * high.abs().max(1.0);
        return (low - half, high + half);
    }
    (low, high)
}

/// The line itself if it is short, else lowest and highest point of equal stretches in order.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MAX_POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(MAX_POINTS / 2);
    let mut kept = Vec::with_capacity(MAX_POINTS + 2);
    for part in points.chunks(stretch) {
        let by_force = |a: &usize, b: &usize| part[*a].1.total_cmp(&part[*b].1);
        let low = (0..part.len()).min_by(by_force).unwrap_or(0);
        let high = (0..part.len()).max_by(by_force).unwrap_or(0);
        kept.push(part[low.min(high)]);
        if low != high {
            kept.push(part[low.max(high)]);
        }
    }
    kept.extend(points.last());
    kept
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn force_travel_names_its_units_peak_and_curves() {
        let run = sample::run();
        let svg = force_travel(&run, &Curve::of(&run.rows)).unwrap();
        for text in [
            "(mm)",
            "(N)",
            "peak 40 N at 2 mm",
            "pushing in",
            "pulling out",
            "handbook: cantilever",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(svg.starts_with("<svg"));
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn the_legend_names_the_formula_without_writing_it_out() {
        let mut run = sample::run();
        let book = run.handbook.as_mut().unwrap();
        book.name = "cantilever: P = b h² E ε / 6 L".into();
        let svg = force_travel(&run, &Curve::of(&run.rows)).unwrap();
        assert!(svg.contains("handbook: cantilever\n"));
        run.handbook.as_mut().unwrap().name = "long ".repeat(40);
        let svg = force_travel(&run, &Curve::of(&run.rows)).unwrap();
        assert!(svg.contains("long …\n"));
    }

    #[test]
    fn step_time_shows_every_stage() {
        let svg = step_time(&sample::rows()).unwrap();
        for text in STAGE_NAMES
            .into_iter()
            .chain(["total", "multiply", "(µs)", "99 %"])
        {
            assert!(svg.contains(text), "{text}");
        }
    }

    #[test]
    fn nothing_to_show_is_said() {
        let mut run = sample::run();
        run.rows.clear();
        run.handbook = None;
        assert!(
            force_travel(&run, &Curve::default())
                .unwrap()
                .contains("no steps")
        );
        assert!(step_time(&[]).unwrap().contains("no steps"));
    }

    #[test]
    fn a_long_line_keeps_its_extremes() {
        let points: Vec<(f64, f64)> = (0..100_000)
            .map(|i| (f64::from(i), if i == 54_321 { 9.0 } else { 0.0 }))
            .collect();
        let kept = thinned(&points);
        assert!(kept.len() <= MAX_POINTS + 2);
        assert!(kept.contains(&(54_321.0, 9.0)));
        assert_eq!(kept.last(), points.last());
        assert!(kept.is_sorted_by(|a, b| a.0 <= b.0));
    }

    #[test]
    fn short_numbers() {
        let texts = [0.0, -0.0, 1234.4, 12.34, 0.012_34, 2.0, -0.5, 100.0].map(short);
        assert_eq!(
            texts,
            ["0", "0", "1234", "12.3", "0.0123", "2", "-0.5", "100"]
        );
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0].map(share),
            ["0 %", "90 %", "99 %", "99.9 %"]
        );
    }
}

//! Work-precision plots: error against time, and the curves behind it.

use std::error::Error;

use plotters::prelude::*;

use super::plot::{
    BLUE, FINE, Format, GREEN, GREY, GRID, INK, Key, ORANGE, PURPLE, SIZE, SKY, VERMILLION, draw,
    empty, short, stroke, words,
};

/// A setting of the study in a plot.
#[derive(Clone, Debug)]
pub struct PlotPoint {
    /// Position of its line.
    pub line: usize,
    /// Words beside it; none if empty.
    pub label: String,
    /// What it costs, first (hollow) and last (filled): 50 % and 99.9 % of the steps, or the same.
    pub cost: [f64; 2],
    /// Relative error, > 0.
    pub error: f64,
    /// Whether no other beats it in both cost and error.
    pub is_front: bool,
}

/// What the axes of a plot say.
#[derive(Clone, Debug)]
pub struct Scale {
    /// Words below the horizontal axis, with the unit.
    pub cost: String,
    /// Words beside the vertical axis.
    pub error: String,
    /// A vertical line with its words: 1 ms.
    pub limit: Option<(f64, &'static str)>,
    /// The reference's own error: below it, differences mean nothing.
    pub bar: Option<f64>,
}

/// Colours of the lines; a fourteenth line begins again.
const COLOURS: [RGBColor; 13] = [
    BLUE,
    VERMILLION,
    GREEN,
    PURPLE,
    ORANGE,
    SKY,
    INK,
    RGBColor(150, 110, 60),
    RGBColor(130, 130, 130),
    RGBColor(0, 95, 75),
    RGBColor(120, 40, 40),
    RGBColor(110, 80, 190),
    RGBColor(140, 140, 20),
];

/// Forces that people tell apart differ by 7 to 10 %; 5 % is the aim.
const FORCE_LINES: [(f64, &str); 2] = [(0.05, "5 %"), (0.1, "10 %")];

/// Error over cost, both logarithmic, one line for each name.
///
/// # Errors
/// What the plot library says.
pub fn error_over_cost(
    names: &[String],
    points: &[PlotPoint],
    scale: &Scale,
) -> Result<String, Box<dyn Error>> {
    let keys: Vec<Key> = names
        .iter()
        .enumerate()
        .filter(|(k, _)| points.iter().any(|p| p.line == *k))
        .map(|(k, name)| Key::new(name, COLOURS[k % COLOURS.len()], 2))
        .collect();
    let costs = || points.iter().flat_map(|p| p.cost);
    let limit = scale.limit.map(|l| l.0);
    let x0 = 0.6 * costs().fold(limit.unwrap_or(f64::INFINITY), f64::min);
    let x1 = 2.2 * costs().fold(limit.unwrap_or(0.0), f64::max);
    let errors = || points.iter().map(|p| p.error).chain([0.05, 0.1]);
    let y0 = 0.6 * errors().fold(f64::INFINITY, f64::min);
    let y1 = 1.8 * errors().fold(0.0, f64::max);
    draw(Format::Wide, &keys, |root| {
        if points.is_empty() {
            return empty(root);
        }
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .margin_right(32 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(90 * FINE)
            .build_cartesian_2d((x0..x1).log_scale(), (y0..y1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc(&scale.cost)
            .y_desc(&scale.error)
            .label_style(words(17, INK))
            .axis_desc_style(words(18, INK))
            .axis_style(GREY.stroke_width(FINE as u32))
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(5 * FINE)
            .x_label_formatter(&|x| short(*x))
            .y_label_formatter(&|y| match 100.0 * y {
                y if y < 1e-3 => format!("{y:.0e} %"),
                y => format!("{} %", short(y)),
            })
            .draw()?;
        let note = |x: f64, y: f64, text: &str, shift: (i32, i32)| {
            let shift = (shift.0 * FINE, shift.1 * FINE);
            EmptyElement::at((x, y)) + Text::new(text.to_owned(), shift, words(15, GREY))
        };
        for (error, text) in FORCE_LINES {
            chart.draw_series(LineSeries::new([(x0, error), (x1, error)], stroke(GREY, 1)))?;
            chart.draw_series([note(x0, error, text, (6, -17))])?;
        }
        if let Some((at, text)) = scale.limit {
            chart.draw_series(LineSeries::new([(at, y0), (at, y1)], stroke(GREY, 1)))?;
            chart.draw_series([note(at, y1, text, (6, 4))])?;
        }
        if let Some(bar) = scale.bar.filter(|bar| *bar > y0) {
            let below = Rectangle::new([(x0, y0), (x1, bar.min(y1))], GREY.mix(0.12).filled());
            chart.draw_series([below])?;
            chart.draw_series([note(x0, bar, "below: the reference's own error", (6, 4))])?;
        }
        let mut front: Vec<(f64, f64)> = points
            .iter()
            .filter(|p| p.is_front)
            .map(|p| (p.cost[1], p.error))
            .collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        let band = ORANGE.mix(0.45).stroke_width((9 * FINE) as u32);
        chart.draw_series(LineSeries::new(front, band))?;
        for line in 0..names.len() {
            let colour = COLOURS[line % COLOURS.len()];
            let own: Vec<&PlotPoint> = points.iter().filter(|p| p.line == line).collect();
            let last: Vec<(f64, f64)> = own.iter().map(|p| (p.cost[1], p.error)).collect();
            chart.draw_series(LineSeries::new(last, stroke(colour, 2)))?;
            for p in own {
                let ends = p.cost.map(|cost| (cost, p.error));
                chart.draw_series(LineSeries::new(ends, stroke(colour, 1)))?;
                chart.draw_series([Circle::new(ends[0], 4 * FINE, stroke(colour, 1))])?;
                chart.draw_series([Circle::new(ends[1], 5 * FINE, colour.filled())])?;
            }
        }
        // Words where there is room: right, above, below or left of the point; else the table tells.
        let mut taken: Vec<[i32; 4]> = Vec::new();
        for p in points.iter().filter(|p| !p.label.is_empty()) {
            let style = words(15, COLOURS[p.line % COLOURS.len()]);
            let (width, height) = root.estimate_text_size(&p.label, &style)?;
            let (width, height) = (width as i32, height as i32);
            let at = chart.backend_coord(&(p.cost[1], p.error));
            let gap = 8 * FINE;
            let shifts = [
                (gap, -height / 2),
                (-width / 2, -height - gap),
                (-width / 2, gap),
                (-width - gap, -height / 2),
            ];
            let room = shifts.into_iter().find(|(dx, dy)| {
                let (x, y) = (at.0 + dx, at.1 + dy);
                let inside = x > 90 * FINE && x + width < SIZE.0 * FINE - 12 * FINE;
                let is_free =
                    |b: &[i32; 4]| x + width < b[0] || x > b[2] || y + height < b[1] || y > b[3];
                inside && taken.iter().all(is_free)
            });
            if let Some((dx, dy)) = room {
                let (x, y) = (at.0 + dx, at.1 + dy);
                taken.push([x, y, x + width, y + height]);
                let text = Text::new(p.label.clone(), (dx, dy), style);
                // The words stay readable where a line runs below them.
                let corners = [(dx, dy), (dx + width, dy + height)];
                let backdrop = Rectangle::new(corners, WHITE.mix(0.8).filled());
                chart.draw_series([EmptyElement::at((p.cost[1], p.error)) + backdrop + text])?;
            }
        }
        Ok(())
    })
}

/// Force (N) over travel (m) of several settings, the first one as reference.
///
/// # Errors
/// What the plot library says.
pub fn force_curves(curves: &[(String, Vec<(f64, f64)>)]) -> Result<String, Box<dyn Error>> {
    let colour = |k: usize| match k {
        0 => INK,
        _ => COLOURS[(k - 1) % COLOURS.len()],
    };
    let keys: Vec<Key> = curves
        .iter()
        .enumerate()
        .map(|(k, (name, _))| Key::new(name, colour(k), if k == 0 { 4 } else { 2 }))
        .collect();
    let all = || curves.iter().flat_map(|(_, points)| points);
    let x1 = all().map(|p| 1e3 * p.0).fold(1e-9, f64::max);
    let y0 = all().map(|p| p.1).fold(0.0, f64::min);
    let y1 = all().map(|p| p.1).fold(y0 + 1e-9, f64::max);
    let room = 0.08 * (y1 - y0);
    draw(Format::Wide, &keys, |root| {
        if curves.is_empty() {
            return empty(root);
        }
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(70 * FINE)
            .build_cartesian_2d(0.0..x1, y0 - room..y1 + room)?;
        chart
            .configure_mesh()
            .x_desc("travel of the handle (mm)")
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
        chart.draw_series(LineSeries::new([(0.0, 0.0), (x1, 0.0)], stroke(GREY, 1)))?;
        for (k, (_, points)) in curves.iter().enumerate() {
            let width = if k == 0 { 4 } else { 2 };
            let line = points.iter().map(|p| (1e3 * p.0, p.1));
            chart.draw_series(LineSeries::new(line, stroke(colour(k), width)))?;
        }
        Ok(())
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::*;

    fn point(line: usize, label: &str, cost: f64, error: f64) -> PlotPoint {
        PlotPoint {
            line,
            label: label.to_owned(),
            cost: [0.5 * cost, cost],
            error,
            is_front: line == 0,
        }
    }

    #[test]
    fn a_plot_names_lines_points_and_limits() {
        let points = [
            point(0, "order 1", 20.0, 0.8),
            point(0, "order 2", 100.0, 0.04),
            point(1, "1 pass", 30.0, 0.2),
        ];
        let scale = Scale {
            cost: "step (µs)".to_owned(),
            error: "error".to_owned(),
            limit: Some((1000.0, "1 ms")),
            bar: Some(0.03),
        };
        let names = ["order".to_owned(), "planes".to_owned()];
        let svg = error_over_cost(&names, &points, &scale).unwrap();
        for text in [
            "order 1",
            "order 2",
            "1 pass",
            "planes",
            "5 %",
            "10 %",
            "1 ms",
            "own error",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN"));
        let nothing = error_over_cost(&names, &[], &scale).unwrap();
        assert!(nothing.contains("no steps"));
    }

    #[test]
    fn curves_are_named() {
        let curves = [
            ("reference".to_owned(), vec![(0.0, 0.0), (1e-3, 5.0)]),
            ("order 1".to_owned(), vec![(0.0, 0.0), (1e-3, 9.0)]),
        ];
        let svg = force_curves(&curves).unwrap();
        assert!(svg.contains("reference") && svg.contains("order 1"));
        assert!(force_curves(&[]).unwrap().contains("no steps"));
    }
}

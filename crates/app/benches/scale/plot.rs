//! Time of a step and of its stages, both axes logarithmic.

use plotters::prelude::*;
use plotters::style::register_font;
use snapin::engine::Stage;

use super::Measured;

/// Pixels.
const SIZE: (u32, u32) = (760, 460);

const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
];

/// The plot as SVG text: medians over what is on the `axis`.
pub(crate) fn stages(axis: &str, measured: &[(f64, Measured)]) -> String {
    let mut lines = vec![("whole step", Vec::new())];
    lines.extend(
        Stage::ALL[..5]
            .iter()
            .map(|stage| (stage.name(), Vec::new())),
    );
    for (x, m) in measured {
        let times = std::iter::once(m.total[0]).chain(m.stages[..5].iter().copied());
        for ((_, line), time) in lines.iter_mut().zip(times) {
            line.push((*x, time.max(1e-2)));
        }
    }
    let all = || lines.iter().flat_map(|(_, line)| line);
    let least = all().map(|at| at.1).fold(f64::INFINITY, f64::min);
    let most = all().map(|at| at.1).fold(0.0, f64::max);
    let (first, last) = (measured[0].0, measured[measured.len() - 1].0);
    // The plot library measures text, and brings no typeface.
    let _ = register_font(
        "sans-serif",
        FontStyle::Normal,
        epaint_default_fonts::UBUNTU_LIGHT,
    );
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).unwrap();
        let mut chart = ChartBuilder::on(&area)
            .margin(14)
            .x_label_area_size(42)
            .y_label_area_size(60)
            .build_cartesian_2d(
                (0.9 * first..1.1 * last).log_scale(),
                (0.7 * least..4.0 * most).log_scale(),
            )
            .unwrap();
        chart
            .configure_mesh()
            .x_desc(axis)
            .y_desc("median time, µs")
            .label_style(("sans-serif", 14))
            .light_line_style(RGBColor(240, 240, 240))
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| format!("{y}"))
            .draw()
            .unwrap();
        for ((name, points), colour) in lines.into_iter().zip(COLOURS) {
            let width = if name == "whole step" { 3 } else { 1 };
            let marks = points.clone();
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(width)))
                .unwrap()
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(width))
                });
            let marks = marks
                .into_iter()
                .map(|at| Circle::new(at, 3, colour.filled()));
            chart.draw_series(marks).unwrap();
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.9))
            .border_style(RGBColor(220, 220, 220))
            .label_font(("sans-serif", 13))
            .draw()
            .unwrap();
        area.present().unwrap();
    }
    svg
}

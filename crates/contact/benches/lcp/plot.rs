//! Time over number of rows, both logarithmic.

use plotters::prelude::*;
use plotters::style::register_font;

use super::measure::{Row, SequenceRow};

/// Pixels.
const SIZE: (u32, u32) = (900, 560);

/// A line: words, colour, points (m, µs).
type Line = (&'static str, RGBColor, Vec<(f64, f64)>);

/// The plot as SVG text.
pub(crate) fn times(rows: &[Row], sequences: &[SequenceRow]) -> String {
    let of = |value: &dyn Fn(&Row) -> Option<f64>| -> Vec<(f64, f64)> {
        rows.iter()
            .filter_map(|row| value(row).map(|time| (row.m as f64, time)))
            .collect()
    };
    let warm = |value: &dyn Fn(&SequenceRow) -> f64| -> Vec<(f64, f64)> {
        let rough = sequences.iter().filter(|row| row.name == "rough");
        rough.map(|row| (row.m as f64, value(row))).collect()
    };
    let lines: [Line; 7] = [
        (
            "Clarabel (QP crate)",
            RGBColor(130, 130, 130),
            of(&|r| r.clarabel),
        ),
        (
            "Gauss-Seidel to 1e-10",
            RGBColor(204, 121, 167),
            of(&|r| r.gauss_seidel.map(|x| x.0)),
        ),
        (
            "active set, single pivots",
            RGBColor(86, 180, 233),
            of(&|r| Some(r.active_set)),
        ),
        (
            "Cholesky of all rows",
            RGBColor(0, 0, 0),
            of(&|r| Some(r.all_rows)),
        ),
        ("snapin, cold", RGBColor(213, 94, 0), of(&|r| Some(r.cold))),
        (
            "snapin, warm (sequence)",
            RGBColor(0, 114, 178),
            warm(&|r| r.warm.time),
        ),
        (
            "snapin, kept factor (sequence)",
            RGBColor(0, 158, 115),
            warm(&|r| r.kept.time),
        ),
    ];
    // The plot library measures text, and brings no typeface.
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    let _ = register_font("sans-serif", FontStyle::Normal, font);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).unwrap();
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d((12.0..1200.0).log_scale(), (0.2..200_000.0).log_scale())
            .unwrap();
        chart
            .configure_mesh()
            .x_desc("rows of the problem (rough sphere on a half-space)")
            .y_desc("time, µs")
            .label_style(("sans-serif", 15))
            .light_line_style(RGBColor(240, 240, 240))
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| format!("{y}"))
            .draw()
            .unwrap();
        for (name, colour, points) in lines {
            let marks = points.clone();
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                .unwrap()
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 22, y)], colour.stroke_width(2))
                });
            chart
                .draw_series(
                    marks
                        .into_iter()
                        .map(|at| Circle::new(at, 3, colour.filled())),
                )
                .unwrap();
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.9))
            .border_style(RGBColor(220, 220, 220))
            .label_font(("sans-serif", 14))
            .draw()
            .unwrap();
        area.present().unwrap();
    }
    svg
}

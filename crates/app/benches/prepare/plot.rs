//! Time over nodes, both logarithmic.

use plotters::prelude::*;
use plotters::style::register_font;

use super::Measured;

/// Pixels.
const SIZE: (u32, u32) = (900, 520);

const BLUE: RGBColor = RGBColor(0, 114, 178);
const VERMILLION: RGBColor = RGBColor(213, 94, 0);
const GREEN: RGBColor = RGBColor(0, 158, 115);
const GREY: RGBColor = RGBColor(130, 130, 130);

/// The plot as SVG text: kinds of part by colour, full lines ours, grey ones the plain solver's.
pub(crate) fn times(rows: &[Measured]) -> String {
    let kinds = [
        ("clip", "", BLUE),
        ("block, its surface can touch", "surface", GREEN),
        ("block, all nodes can touch", "all", VERMILLION),
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
            .build_cartesian_2d((500.0..12_000.0).log_scale(), (0.01..50.0).log_scale())
            .unwrap();
        chart
            .configure_mesh()
            .x_desc("nodes of the part")
            .y_desc("order, factor and columns, s")
            .label_style(("sans-serif", 15))
            .light_line_style(RGBColor(240, 240, 240))
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| format!("{y}"))
            .draw()
            .unwrap();
        for (name, ending, colour) in kinds {
            let of_kind = |m: &&Measured| match ending {
                "" => m.name.starts_with("clip"),
                ending => m.name.ends_with(ending),
            };
            let line = |time: fn(&Measured) -> f64| -> Vec<(f64, f64)> {
                let of_kind = rows.iter().filter(of_kind);
                of_kind.map(|m| (m.nodes as f64, time(m))).collect()
            };
            let plain = line(|m| m.plain.iter().sum());
            let ours = line(|m| m.stages[1..4].iter().sum());
            for (points, label, line, mark) in [
                (plain, format!("{name}, plain solver"), GREY, colour),
                (ours, name.to_owned(), colour, colour),
            ] {
                chart
                    .draw_series(LineSeries::new(points.clone(), line.stroke_width(2)))
                    .unwrap()
                    .label(label)
                    .legend(move |(x, y)| {
                        PathElement::new([(x, y), (x + 22, y)], line.stroke_width(2))
                    });
                let marks = points
                    .into_iter()
                    .map(|at| Circle::new(at, 4, mark.filled()));
                chart.draw_series(marks).unwrap();
            }
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

//! Lines over two logarithmic axes, for benches.

use plotters::prelude::*;
use plotters::style::register_font;

/// Pixels.
const SIZE: (u32, u32) = (800, 480);

/// One line of a plot.
pub(crate) struct Line {
    pub(crate) label: String,
    pub(crate) colour: RGBColor,
    pub(crate) of_marks: RGBColor,
    /// Pixels.
    pub(crate) width: u32,
    pub(crate) points: Vec<(f64, f64)>,
}

/// The plot as SVG text.
pub(crate) fn log_log(x_axis: &str, y_axis: &str, lines: Vec<Line>) -> String {
    let points = || lines.iter().flat_map(|line| &line.points);
    let range = |of: &dyn Fn(&(f64, f64)) -> f64| {
        let low = points().map(of).fold(f64::INFINITY, f64::min);
        (low, points().map(of).fold(0.0, f64::max))
    };
    let (x, y) = (range(&|at| at.0), range(&|at| at.1));
    // The plot library measures text, and brings no typeface.
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    let _ = register_font("sans-serif", FontStyle::Normal, font);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).unwrap();
        let mut chart = ChartBuilder::on(&area)
            .margin(14)
            .x_label_area_size(42)
            .y_label_area_size(62)
            .build_cartesian_2d(
                (0.9 * x.0..1.1 * x.1).log_scale(),
                // Room for the names above the lines.
                (0.7 * y.0..8.0 * y.1).log_scale(),
            )
            .unwrap();
        chart
            .configure_mesh()
            .x_desc(x_axis)
            .y_desc(y_axis)
            .label_style(("sans-serif", 14))
            .light_line_style(RGBColor(240, 240, 240))
            .x_label_formatter(&|x| number(*x))
            .y_label_formatter(&|y| number(*y))
            .draw()
            .unwrap();
        for line in lines {
            let style = line.colour.stroke_width(line.width);
            let marks: Vec<_> = line
                .points
                .iter()
                .map(|at| Circle::new(*at, 3, line.of_marks.filled()))
                .collect();
            chart
                .draw_series(LineSeries::new(line.points, style))
                .unwrap()
                .label(line.label)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
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

/// 1, 2 and 5 times powers of ten; the others would stand in each other's way.
fn number(x: f64) -> String {
    let leading = x / 10_f64.powf(x.log10().floor());
    if [1.0, 2.0, 5.0].iter().any(|n| (leading - n).abs() < 1e-6) {
        format!("{}", (1e9 * x).round() / 1e9)
    } else {
        String::new()
    }
}

//! Lines of the step's stages.

use plotters::style::RGBColor;
use snapin::engine::Stage;

use super::Measured;
use super::plot::{Line, log_log};

const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
];

/// The plot as SVG text: medians of the step and its stages over what is on the `axis`.
pub(crate) fn stages(axis: &str, measured: &[(f64, Measured)]) -> String {
    let names = std::iter::once("whole step").chain(Stage::ALL[..5].iter().map(|s| s.name()));
    let lines = names.zip(COLOURS).enumerate().map(|(k, (name, colour))| {
        let time = |m: &Measured| if k == 0 { m.total[0] } else { m.stages[k - 1] };
        Line {
            label: name.to_owned(),
            colour,
            of_marks: colour,
            width: if k == 0 { 3 } else { 1 },
            points: measured
                .iter()
                .map(|(x, m)| (*x, time(m).max(1e-2)))
                .collect(),
        }
    });
    log_log(axis, "median time, µs", lines.collect())
}

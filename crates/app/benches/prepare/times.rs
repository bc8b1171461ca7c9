//! Lines of the times of preparing.

use plotters::style::RGBColor;

use super::Measured;
use super::plot::{Line, log_log};

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
    let lines = kinds.into_iter().flat_map(|(name, ending, colour)| {
        let of_kind = move |m: &&Measured| match ending {
            "" => m.name.starts_with("clip"),
            ending => m.name.ends_with(ending),
        };
        let line = |label: String, of_line: RGBColor, time: fn(&Measured) -> f64| Line {
            label,
            colour: of_line,
            of_marks: colour,
            width: 2,
            points: rows
                .iter()
                .filter(of_kind)
                .map(|m| (m.nodes as f64, time(m)))
                .collect(),
        };
        [
            line(format!("{name}, plain solver"), GREY, |m| {
                m.plain.iter().sum()
            }),
            line(name.to_owned(), colour, |m| m.stages[1..4].iter().sum()),
        ]
    });
    log_log(
        "nodes of the part",
        "order, factor and columns, s",
        lines.collect(),
    )
}

//! Force over travel, and the handbook beside it.

use std::fmt::Write as _;

use super::super::data::{Handbook, Run};
use super::super::part_curve::words;
use super::super::plot::short;
use super::Plot;
use super::blocks::{figure, labelled, section, table};
use super::text::escaped;

/// The plot of the force, and what the handbook says.
pub(super) fn curve(page: &mut String, run: &Run, force_svg: &Plot) {
    section(page, "Force over travel");
    figure(page, force_svg, FORCE_CAPTION);
    if let Some(driven) = &run.driven {
        page.push_str(DRIVEN);
        labelled(page, &words::lines(driven));
    }
    if let Some(handbook) = &run.handbook {
        section(page, "Beside the handbook");
        handbook_table(page, handbook);
    }
}

const FORCE_CAPTION: &str = "Force along the direction of the push against how far the held body has moved. Above zero the \
    part resists; below zero it pulls the body in, or, on the way out, holds it.";

const DRIVEN: &str = "<p>The part's own curve is what a testing machine draws: the held body goes along its path \
    rigidly, without a hand. The verdict comes from it.</p>\n";

fn handbook_table(page: &mut String, handbook: &Handbook) {
    let _ = writeln!(page, "<p>{}</p>", escaped(&handbook.name));
    let rows = handbook.rows.iter().map(|row| {
        let difference = if row.handbook == 0.0 {
            String::new()
        } else {
            format!("{:+.1} %", 100.0 * (row.computed / row.handbook - 1.0))
        };
        let numbers = [short(row.handbook), short(row.computed), difference];
        (row.label.clone(), numbers.to_vec(), row.unit.clone())
    });
    let rows: Vec<Vec<String>> = rows
        .map(|(label, numbers, unit)| {
            let mut cells = vec![if unit.is_empty() {
                label
            } else {
                format!("{label} ({unit})")
            }];
            cells.extend(numbers);
            cells
        })
        .collect();
    table(
        page,
        &["", "handbook", "computed", "difference"],
        &rows,
        &[],
        false,
    );
}

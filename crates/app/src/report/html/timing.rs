//! How long the steps took.

use super::super::data::{PaperStage, Run};
use super::super::plot::short;
use super::super::summary::{Percentiles, stage_percentiles};
use super::Plot;
use super::blocks::{figure, section, table};

/// Time by stage, and beside the method's first publication.
pub(super) fn timing(page: &mut String, run: &Run, svg: &Plot) {
    section(page, "Time of a step");
    let stages = stage_percentiles(&run.rows);
    let rows: Vec<Vec<String>> = stages
        .iter()
        .map(|(name, times)| {
            let Percentiles {
                p50,
                p99,
                p999,
                max,
            } = *times;
            let mut cells = vec![(*name).to_owned()];
            cells.extend([p50, p99, p999, max].map(short));
            cells
        })
        .collect();
    let total = stages.iter().position(|(name, _)| *name == "total");
    page.push_str("<p>Microseconds of the wall clock per step, on the machine named below.</p>\n");
    table(
        page,
        &["stage", "p50", "p99", "p99.9", "max"],
        &rows,
        total.as_slice(),
        false,
    );
    if !run.paper.is_empty() {
        page.push_str(
            "<p>Beside the method's first publication (Duriez, Andriot and Kheddar 2004; Pentium 4, \
             2.4 GHz). Machine, mesh and code differ: the factor shows where the two stand, not \
             which code is better.</p>\n",
        );
        table(
            page,
            &["stage", "2004 (ms)", "here (µs)", "factor"],
            &paper_rows(&run.paper),
            &[run.paper.len()],
            false,
        );
    }
    figure(
        page,
        svg,
        "Time that the given share of the steps did not exceed. Logarithmic both ways.",
    );
}

/// The stages, and their sum where all of them were timed.
fn paper_rows(paper: &[PaperStage]) -> Vec<Vec<String>> {
    let sum = PaperStage {
        stage: "together".into(),
        paper_ms: paper.iter().map(|row| row.paper_ms).sum(),
        ours_us: paper.iter().map(|row| row.ours_us).sum(),
    };
    let is_whole = paper.iter().all(|row| row.ours_us > 0.0);
    paper
        .iter()
        .chain(is_whole.then_some(&sum))
        .map(|row| {
            let factor = row.paper_ms * 1e3 / row.ours_us;
            let factor = if factor.is_finite() {
                format!("{}x", short(factor))
            } else {
                String::new()
            };
            vec![
                row.stage.clone(),
                short(row.paper_ms),
                short(row.ours_us),
                factor,
            ]
        })
        .collect()
}

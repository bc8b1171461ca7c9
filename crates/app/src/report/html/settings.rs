//! Settings, checks and notes.

use std::fmt::Write as _;

use super::super::data::Run;
use super::blocks::{labelled, section};
use super::text::escaped;

/// What the run was made with, and what was checked.
pub(super) fn settings(page: &mut String, run: &Run) {
    section(page, "Settings and checks");
    let mut rows = run.settings.clone();
    rows.extend(run.origin.inputs.iter().map(|input| {
        let label = format!("{} file", input.kind);
        (label, format!("{}, BLAKE3 {}", input.name, input.hex()))
    }));
    labelled(page, &rows);
    if !run.checks.is_empty() {
        labelled(page, &run.checks);
    }
}

/// Sentences for the reader.
pub(super) fn notes(page: &mut String, run: &Run) {
    if run.notes.is_empty() {
        return;
    }
    section(page, "Notes");
    let items = run
        .notes
        .iter()
        .map(|note| format!("<li>{}</li>", escaped(note)));
    let _ = writeln!(page, "<ul>{}</ul>", items.collect::<String>());
}

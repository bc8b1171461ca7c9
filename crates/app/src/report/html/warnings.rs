//! What the reader must not miss.

use std::fmt::Write as _;

use super::super::data::Run;
use super::text::escaped;

/// A line for each warning.
pub(super) fn warnings(page: &mut String, run: &Run) {
    for warning in &run.warnings {
        let _ = writeln!(page, "<p class=\"warning\">{}</p>", escaped(&warning.text));
    }
}

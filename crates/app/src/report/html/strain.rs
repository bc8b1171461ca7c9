//! The largest strains, and what the material bears.

use std::fmt::Write as _;

use super::super::strain::{self, StrainFacts};
use super::blocks::{section, table};
use super::text::escaped;

/// The largest strains with their places and bars.
pub(super) fn strain(page: &mut String, strain: &StrainFacts) {
    section(page, "Strain");
    let _ = writeln!(page, "<p>{}</p>", escaped(&strain.words()));
    if !strain.peaks.is_empty() {
        table(page, &strain::TABLE_HEADINGS, &strain.table(), &[], true);
        let _ = writeln!(page, "<p>{}</p>", escaped(strain::CAPTION));
    }
}

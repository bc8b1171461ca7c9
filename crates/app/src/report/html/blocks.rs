//! What every section of the page is put together from: headings, figures, tables, lists.

use std::fmt::Write as _;

use super::Plot;
use super::text::escaped;

/// The heading of a section.
pub(super) fn section(page: &mut String, title: &str) {
    let _ = writeln!(page, "<h2>{}</h2>", escaped(title));
}

/// A drawing with its caption.
pub(super) fn figure(page: &mut String, plot: &Plot, caption: &str) {
    let Plot { wide, narrow } = plot;
    let _ = writeln!(
        page,
        "<figure class=\"plot\"><div class=\"wide\">{wide}</div><div class=\"narrow\">{narrow}</div>\
         <figcaption>{}</figcaption></figure>",
        escaped(caption)
    );
}

/// A table whose first column is text and whose others are numbers; `has_prose`: the last and the
/// second are text as well. `bold`: rows to be stressed.
pub(super) fn table(
    page: &mut String,
    head: &[&str],
    rows: &[Vec<String>],
    bold: &[usize],
    has_prose: bool,
) {
    let class = |column: usize| {
        let is_last = column + 1 == head.len();
        match has_prose {
            _ if column == 0 => "",
            true if is_last => " class=\"prose\"",
            true if column == 1 => " class=\"tight\"",
            _ => " class=\"n\"",
        }
    };
    page.push_str("<div class=\"scroll\"><table><thead><tr>");
    for (column, cell) in head.iter().enumerate() {
        let _ = write!(page, "<th{}>{}</th>", class(column), escaped(cell));
    }
    page.push_str("</tr></thead><tbody>");
    for (row_idx, row) in rows.iter().enumerate() {
        page.push_str(if bold.contains(&row_idx) {
            "<tr class=\"sum\">"
        } else {
            "<tr>"
        });
        for (column, cell) in row.iter().enumerate() {
            let _ = write!(page, "<td{}>{}</td>", class(column), escaped(cell));
        }
        page.push_str("</tr>");
    }
    page.push_str("</tbody></table></div>\n");
}

/// A list of labels and values.
pub(super) fn labelled(page: &mut String, rows: &[(String, String)]) {
    page.push_str("<dl>");
    for (label, value) in rows {
        let _ = write!(
            page,
            "<dt>{}</dt><dd>{}</dd>",
            escaped(label),
            escaped(value)
        );
    }
    page.push_str("</dl>\n");
}

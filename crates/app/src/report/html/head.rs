//! Begin and end of a page.

use std::fmt::Write as _;

use super::style::STYLE;
use super::text::escaped;

/// Opens a page: its head, its title and where it comes from. `kind` ends the title of the window.
pub(crate) fn open(page: &mut String, title: &str, kind: &str, scene_path: &str) {
    let title = escaped(title);
    page.push_str("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
    page.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    let _ = writeln!(page, "<title>{title}: {}</title>", escaped(kind));
    let _ = writeln!(page, "<style>{STYLE}</style></head><body><main>");
    let _ = writeln!(page, "<h1>{title}</h1>");
    let _ = writeln!(page, "<p class=\"where\">{}</p>", escaped(scene_path));
}

/// Closes a page with the program, its version and the machine.
pub(crate) fn close(page: &mut String, machine: &str) {
    let _ = writeln!(
        page,
        "<footer>Written by snapin {} on {}.</footer></main></body></html>",
        env!("CARGO_PKG_VERSION"),
        escaped(machine)
    );
}

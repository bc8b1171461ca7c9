//! Begin and end of a page.

use std::fmt::Write as _;

use super::super::origin::Origin;
use super::style::STYLE;
use super::text::escaped;

/// Digits of the input's hash that are shown at the top; the settings have them all.
const SHOWN_DIGITS: usize = 16;

/// Opens a page: its head, its title, where it comes from and when. `kind` ends the title of the window.
pub(crate) fn open(page: &mut String, title: &str, kind: &str, scene_path: &str, origin: &Origin) {
    let title = escaped(title);
    page.push_str("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
    page.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    page.push_str("<meta name=\"color-scheme\" content=\"light dark\">\n");
    let _ = writeln!(page, "<title>{title}: {}</title>", escaped(kind));
    let _ = writeln!(page, "<style>{STYLE}</style></head><body><main>");
    let _ = writeln!(page, "<h1>{title}</h1>");
    let mut from = vec![escaped(scene_path)];
    if !origin.made.is_empty() {
        let made = escaped(&origin.made);
        from.push(format!(
            "<time datetime=\"{made}\">{}</time>",
            spoken(&made)
        ));
    }
    let hash = origin.hash();
    if let Some(digits) = hash.get(..SHOWN_DIGITS) {
        from.push(format!("input {digits}"));
    }
    let _ = writeln!(page, "<p class=\"where\">{}</p>", from.join(" \u{b7} "));
}

/// `2026-11-27T08:15:30Z` as `2026-11-27 08:15 UTC`; other text as it is.
fn spoken(made: &str) -> String {
    match made.strip_suffix('Z').and_then(|t| t.split_once('T')) {
        Some((day, time)) => {
            let minutes = time.get(..5).unwrap_or(time);
            format!("{day} {minutes} UTC")
        }
        None => made.to_owned(),
    }
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

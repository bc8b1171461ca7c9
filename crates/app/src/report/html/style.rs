//! Looks of the page.

/// The page's style sheet: readable on a phone, a screen and paper, no fonts or pictures from elsewhere.
pub(super) const STYLE: &str = include_str!("page.css");

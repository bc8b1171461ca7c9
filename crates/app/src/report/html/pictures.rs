//! The drawn moments of the run.

use std::fmt::Write as _;

use super::super::data::Run;
use super::super::plot::short;
use super::super::render::Quantity;
use super::blocks::section;
use super::text::{escaped, push_base64};

/// A picture of a frame.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Position of the frame in the run.
    pub frame: usize,
    /// What its colours show.
    pub quantity: Quantity,
    /// The file's bytes.
    pub png: Vec<u8>,
}

/// Every picture with its caption.
pub(super) fn pictures(page: &mut String, run: &Run, pictures: &[Picture]) {
    if pictures.is_empty() {
        return;
    }
    section(page, "Pictures");
    page.push_str("<div class=\"pictures\">");
    for picture in pictures {
        let Some(frame) = run.frames.get(picture.frame) else {
            continue;
        };
        let quantity = picture.quantity.name();
        let caption = escaped(&format!(
            "{}: {quantity} at {} mm travel, {} N",
            frame.label,
            short(frame.travel_m * 1e3),
            short(frame.force_n)
        ));
        let _ = write!(
            page,
            "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,"
        );
        push_base64(page, &picture.png);
        let _ = writeln!(page, "\"><figcaption>{caption}</figcaption></figure>");
    }
    page.push_str("</div>\n");
}

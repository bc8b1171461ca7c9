//! The drawn moments of the run.

use std::fmt::Write as _;

use super::super::data::Run;
use super::super::digits::RunScale;
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
    /// Where the picture lies in full size, as seen from the page: `frames/03-peak.png`.
    pub file: String,
    /// The file's bytes.
    pub png: Vec<u8>,
}

/// Every picture with its caption. The page holds the pictures itself, so that it can be mailed; each is a link to its file, which
/// a browser shows in full size.
pub(super) fn pictures(page: &mut String, run: &Run, pictures: &[Picture]) {
    if pictures.is_empty() {
        return;
    }
    section(page, "Pictures");
    let scale = RunScale::of(run);
    page.push_str("<div class=\"pictures\">");
    for picture in pictures {
        let Some(frame) = run.frames.get(picture.frame) else {
            continue;
        };
        let caption = escaped(&format!(
            "{}: {}, {} mm of travel, {} N",
            frame.label,
            picture.quantity.name(),
            scale.travel_mm(frame),
            scale.force_n(frame)
        ));
        let _ = write!(
            page,
            "<figure><a href=\"{}\" title=\"full size\"><img alt=\"{caption}\" src=\"data:image/png;base64,",
            escaped(&picture.file)
        );
        push_base64(page, &picture.png);
        let _ = writeln!(page, "\"></a><figcaption>{caption}</figcaption></figure>");
    }
    page.push_str("</div>\n");
}

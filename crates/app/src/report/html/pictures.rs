//! The drawn moments of the run.

use std::fmt::Write as _;

use super::super::data::{Frame, Run};
use super::super::digits::{beside, largest};
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
    let scale = Scale::of(run);
    page.push_str("<div class=\"pictures\">");
    for picture in pictures {
        let Some(frame) = run.frames.get(picture.frame) else {
            continue;
        };
        let caption = escaped(&format!(
            "{}: {}, {}",
            frame.label,
            picture.quantity.name(),
            scale.words(frame)
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

/// What travel and force of a run reach: digits far below are round-off.
struct Scale {
    travel_m: f64,
    force_n: f64,
}

impl Scale {
    fn of(run: &Run) -> Self {
        let rows = || run.rows.iter();
        let frames = || run.frames.iter();
        Self {
            travel_m: largest(
                rows()
                    .map(|r| r.travel_m)
                    .chain(frames().map(|f| f.travel_m)),
            ),
            force_n: largest(rows().map(|r| r.force_n).chain(frames().map(|f| f.force_n))),
        }
    }

    fn words(&self, frame: &Frame) -> String {
        format!(
            "{} mm of travel, {} N",
            beside(frame.travel_m * 1e3, self.travel_m * 1e3),
            beside(frame.force_n, self.force_n)
        )
    }
}

//! The typeface of plots and pictures: carried in the program, so that none need be installed.

use std::sync::Once;

use plotters::style::{FontStyle, register_font};

/// Name under which the plots ask for the typeface.
pub(super) const FAMILY: &str = "sans-serif";

/// Makes the typeface known to the plot library. Cheap after the first call.
pub(super) fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Refused only for bytes that are no font; then the first drawing says so.
        let font = epaint_default_fonts::UBUNTU_LIGHT;
        let _ = register_font(FAMILY, FontStyle::Normal, font);
        let _ = register_font(FAMILY, FontStyle::Bold, font);
    });
}

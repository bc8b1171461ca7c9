//! The result in words and in six large numbers.

use std::fmt::Write as _;

use super::super::curve::Curve;
use super::super::data::Run;
use super::super::plot::short;
use super::super::strain::StrainPeak;
use super::text::escaped;

/// The result in two sentences, plain text.
pub fn headline(curve: &Curve) -> String {
    if curve.peak_row_idx.is_none() {
        return "Nothing resisted the hand: the tool did not touch the part, or pushed it nowhere."
            .to_owned();
    }
    let peak = format!(
        "The force peaks at {} N after {} mm",
        short(curve.peak_force_n),
        short(curve.travel_at_peak_m * 1e3)
    );
    let drop = match curve.snap_travel_m {
        Some(travel) => format!(
            " and drops by {} N: the part snaps home, {} mm after the peak.",
            short(curve.snap_drop_n),
            short(travel * 1e3)
        ),
        None if curve.snap_drop_n > 0.02 * curve.peak_force_n => format!(
            " and drops by {} N, but never to zero: the part does not snap home within this travel.",
            short(curve.snap_drop_n)
        ),
        None => " and does not drop: the part does not snap home within this travel.".to_owned(),
    };
    let work = format!(
        " Pushing it over takes {} mJ.",
        short(curve.insertion_work_j * 1e3)
    );
    let pull = match curve.retention_force_n {
        Some(pull) => format!(" Pulling out again takes {} N.", short(pull)),
        None => String::new(),
    };
    peak + &drop + &work + &pull
}

/// The numbers that are looked for first.
pub(super) fn cards(page: &mut String, run: &Run, curve: &Curve) {
    let snaps = if curve.snaps_home() { "yes" } else { "no" };
    let pull = curve
        .retention_force_n
        .map_or("not pulled".into(), |f| format!("{} N", short(f)));
    page.push_str("<div class=\"cards\">");
    for (value, label) in [
        (
            format!("{} N", short(curve.peak_force_n)),
            "peak insertion force",
        ),
        (
            format!("{} mm", short(curve.travel_at_peak_m * 1e3)),
            "travel at the peak",
        ),
        (format!("{} N", short(curve.snap_drop_n)), "snap drop"),
        (snaps.to_owned(), "snaps home"),
        (pull, "retention force"),
        (
            run.strain
                .governing()
                .map_or("none".into(), StrainPeak::percent),
            "largest strain",
        ),
        (
            run.strain.safety_once().map_or("not given".into(), short),
            "permissible over largest strain",
        ),
    ] {
        let _ = write!(
            page,
            "<div class=\"card\"><b>{}</b><span>{label}</span></div>",
            escaped(&value)
        );
    }
    page.push_str("</div>\n");
}

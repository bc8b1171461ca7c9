//! The result in words and in a few large numbers.

use std::fmt::Write as _;

use super::super::curve::Curve;
use super::super::data::Run;
use super::super::part_curve::{Removal, words};
use super::super::plot::short;
use super::super::strain::StrainPeak;
use super::text::escaped;

/// The result in a few sentences, plain text: that of the part's own curve, or of the felt one where there is no other.
pub fn headline(run: &Run, curve: &Curve) -> String {
    if let Some(driven) = &run.driven {
        return words::headline(driven);
    }
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
    let newtons = |force: f64| format!("{} N", short(force));
    let (verdict, peak, travel, drop, removal) = match &run.driven {
        Some(driven) => {
            let part = &driven.curve;
            let insertion = part.insertion().unwrap_or_default();
            (
                driven.verdict.outcome.name(),
                insertion.force_n,
                insertion.travel_m,
                part.snap().map_or(0.0, |snap| snap.drop_n),
                match part.removal {
                    Removal::NotPulled => "not pulled".to_owned(),
                    Removal::StillHeld(_) => "still held".to_owned(),
                    Removal::Out(place) => newtons(place.force_n),
                },
            )
        }
        None => (
            if curve.snaps_home() {
                "snaps"
            } else {
                "does not snap"
            },
            curve.peak_force_n,
            curve.travel_at_peak_m,
            curve.snap_drop_n,
            curve.retention_force_n.map_or("not pulled".into(), newtons),
        ),
    };
    let cards = [
        (verdict.to_owned(), "verdict"),
        (newtons(peak), "peak insertion force"),
        (format!("{} mm", short(travel * 1e3)), "travel at the peak"),
        (newtons(drop), "snap drop"),
        (removal, "peak removal force"),
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
    ];
    let cards = cards.map(|(value, label)| (value, label.to_owned()));
    let limits = run.driven.iter().flat_map(|driven| &driven.limits);
    let limits = limits.map(|limit| {
        let label = format!("limit: {}", limit.key.replace('_', " "));
        (limit.state.name().to_owned(), label)
    });
    page.push_str("<div class=\"cards\">");
    for (value, label) in cards.into_iter().chain(limits) {
        let _ = write!(
            page,
            "<div class=\"card\"><b>{}</b><span>{label}</span></div>",
            escaped(&value)
        );
    }
    page.push_str("</div>\n");
}

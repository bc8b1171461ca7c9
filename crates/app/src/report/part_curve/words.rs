//! The driven curve in words: for the terminal, and as the page's headline.

use std::fmt::Write as _;

use super::super::data::{Driven, FrictionFacts, coefficient_in_words};
use super::super::plot::short;
use super::{Hump, LimitState, Locking, Outcome, PartCurve, Place, Removal};

/// Humps beside the main one that are told one by one.
const MOST_TOLD: usize = 3;

/// Lines of the terminal, two blanks and a label before each.
pub(crate) fn terminal(driven: &Driven) -> String {
    lines(driven)
        .into_iter()
        .map(|(label, text)| format!("  {label:<22}{text}\n"))
        .collect()
}

/// Label and text of each thing that is read off the curve.
pub(crate) fn lines(driven: &Driven) -> Vec<(String, String)> {
    let curve = &driven.curve;
    let mut lines = Vec::new();
    let mut line = |label: &str, text: String| lines.push((label.to_owned(), text));
    line("verdict", verdict(driven));
    if driven.verdict.outcome == Outcome::Incomplete {
        let reasons = driven.verdict.reasons.iter();
        reasons.for_each(|reason| line("because", reason.clone()));
    }
    match (curve.snap(), curve.largest) {
        (Some(snap), _) => line("snap", hump(snap)),
        (None, Some(largest)) => line("largest force", at(largest)),
        (None, None) => {}
    }
    let further: Vec<&Hump> = curve.further_humps().collect();
    for one in further.iter().take(MOST_TOLD) {
        line("further hump", hump(one));
    }
    if further.len() > MOST_TOLD {
        line("", format!("and {} more", further.len() - MOST_TOLD));
    }
    if let Some(seat) = curve.seat {
        line("seat", format!("{}, where the way ends", at(seat)));
    }
    if curve.largest.is_some() {
        let (most, net) = (1e3 * curve.insertion_work_j, 1e3 * curve.net_work_j);
        let what = pushing(curve);
        line(
            "work",
            format!(
                "{} mJ to push it {what}, {} mJ at the end of the way",
                short(most),
                short(net)
            ),
        );
    }
    if curve.is_touched {
        line("removal", removal(curve.removal));
    }
    if let Some(friction) = &driven.friction {
        lines_of_friction(curve, friction, &mut line);
    }
    if curve.sideways_m > 0.0 {
        line("sideways", format!("{} mm", short(1e3 * curve.sideways_m)));
    }
    if curve.turn_rad > 0.0 {
        let degrees = short(curve.turn_rad.to_degrees());
        line("turn", format!("{degrees} degrees"));
    }
    for limit in &driven.limits {
        line(&limit.state.name().to_uppercase(), limit.text.clone());
    }
    lines
}

fn lines_of_friction(
    curve: &PartCurve,
    friction: &FrictionFacts,
    line: &mut impl FnMut(&str, String),
) {
    let plain = &friction.frictionless;
    let of = |place: Option<Place>| place.map_or_else(|| "0".to_owned(), |p| newtons(p.force_n));
    let mut text = format!(
        "coefficient {}: in {} N for {} without",
        coefficient_in_words(&friction.coefficients),
        of(curve.insertion()),
        of(plain.insertion()),
    );
    if let (Some(out), Some(plain_out)) = (curve.removal.peak(), plain.removal.peak()) {
        let _ = write!(
            text,
            ", out {} N for {}",
            newtons(out.force_n),
            newtons(plain_out.force_n)
        );
        if let Some(into) = curve.insertion().filter(|p| p.force_n > 0.0) {
            let _ = write!(text, "; out / in {}", short(out.force_n / into.force_n));
        }
    }
    line("friction", text);
    if let Some(source) = &friction.source {
        line("", source.clone());
    }
    let energy = &curve.energy;
    line(
        "energy",
        format!(
            "{} mJ put in = {} given back + {} by friction + {} stored, {} unaccounted",
            short(1e3 * energy.put_in_j),
            short(1e3 * energy.given_back_j),
            short(1e3 * energy.dissipated_j),
            short(1e3 * energy.stored_j),
            short(1e3 * energy.unaccounted_j()),
        ),
    );
    if let Some(locking) = curve.locking {
        line("locks", locks(locking));
    }
}

/// A way that friction blocks.
fn locks(locking: Locking) -> String {
    let way = if locking.is_out { "out" } else { "in" };
    format!(
        "self-locking on the way {way}: all contacts stick, and the force grows to {}, where the way ends",
        at(locking.place)
    )
}

/// The outcome, and why it does not snap; what keeps it from being known, and the snap's numbers, have lines of their own.
fn verdict(driven: &Driven) -> String {
    let verdict = &driven.verdict;
    match (verdict.outcome, verdict.so_far) {
        (Outcome::Incomplete, so_far) => {
            format!(
                "incomplete; as far as it is simulated, it {}",
                so_far.name()
            )
        }
        (Outcome::Snaps, _) => Outcome::Snaps.name().to_owned(),
        (outcome, _) => format!("{}: {}", outcome.name(), verdict.reasons.join("; ")),
    }
}

/// Past the snap, or no further than in.
fn pushing(curve: &PartCurve) -> &'static str {
    if curve.snap().is_some() { "over" } else { "in" }
}

fn at(place: Place) -> String {
    format!(
        "{} N at {} mm",
        newtons(place.force_n),
        millimetres(place.travel_m)
    )
}

fn hump(hump: &Hump) -> String {
    format!(
        "{}, falls by {} N to {} N (ratio {})",
        at(hump.peak()),
        short(hump.drop_n),
        short(hump.lowest_n),
        short(hump.ratio)
    )
}

fn removal(removal: Removal) -> String {
    match removal {
        Removal::NotPulled => "not pulled out".to_owned(),
        Removal::StillHeld(place) => format!(
            "more than {} N: the pull still grows where the way out ends",
            newtons(place.force_n)
        ),
        Removal::Out(place) if place.force_n > 0.0 => at(place),
        Removal::Out(_) => "nothing holds it on the way out".to_owned(),
    }
}

/// To a thousandth.
fn newtons(force: f64) -> String {
    if force.abs() < 1e-3 {
        short(force)
    } else {
        format!("{force:.3}")
    }
}

/// To a micrometre.
fn millimetres(length: f64) -> String {
    format!("{:.3}", 1e3 * length + 0.0)
}

/// The result in some sentences, plain text.
pub(crate) fn headline(driven: &Driven) -> String {
    let (curve, verdict) = (&driven.curve, &driven.verdict);
    let looks = match verdict.so_far {
        Outcome::Snaps => "the part snaps",
        _ => "the part does not snap",
    };
    let numbers = match (curve.snap(), curve.largest) {
        (Some(snap), _) => format!(
            "{looks}: the force peaks at {} N after {} mm and falls by {} N.",
            short(snap.force_n),
            short(1e3 * snap.travel_m),
            short(snap.drop_n)
        ),
        (None, Some(largest)) => format!(
            "{looks}: the force reaches {} N at {} mm and passes no peak.",
            short(largest.force_n),
            short(1e3 * largest.travel_m)
        ),
        (None, None) if curve.is_touched => format!("{looks}: nothing resists on the way in."),
        (None, None) => format!("{looks}: the tool touched nothing."),
    };
    let result = match verdict.outcome {
        Outcome::Incomplete => format!(
            "Incomplete: {}. As far as it is simulated, {numbers}",
            reasons(&verdict.reasons)
        ),
        _ => capitalised(&numbers),
    };
    result + &beside_the_snap(curve) + &friction(driven) + &limits(driven)
}

/// The first of many, which are told in full further down.
fn reasons(all: &[String]) -> String {
    match all {
        [] => "the curve cannot tell".to_owned(),
        [one] => one.clone(),
        [first, rest @ ..] => {
            let n = rest.len();
            let plural = if n == 1 { "reason" } else { "reasons" };
            format!("{first}; and {n} further {plural}, below")
        }
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Further humps, seat, work and removal, each a sentence with a blank before it where there is something to tell.
fn beside_the_snap(curve: &PartCurve) -> String {
    let further = match curve.further_humps().count() {
        0 => String::new(),
        1 => " There is a further hump.".to_owned(),
        n => format!(" There are {n} further humps."),
    };
    let seat = curve.seat.map_or_else(String::new, |seat| {
        let (force, travel) = (short(seat.force_n), short(1e3 * seat.travel_m));
        format!(" It is seated with {force} N at {travel} mm.")
    });
    let work = curve.largest.map_or_else(String::new, |_| {
        let (what, work) = (pushing(curve), short(1e3 * curve.insertion_work_j));
        format!(" Pushing it {what} takes {work} mJ.")
    });
    let removal = match curve.removal {
        Removal::StillHeld(place) => {
            format!(" Pulling out takes more than {} N.", short(place.force_n))
        }
        Removal::Out(place) if place.force_n > 0.0 => {
            format!(" Pulling out again takes {} N.", short(place.force_n))
        }
        Removal::Out(_) if curve.is_touched => " Nothing holds it on the way out.".to_owned(),
        Removal::Out(_) | Removal::NotPulled => String::new(),
    };
    further + &seat + &work + &removal
}

/// What friction adds to pushing in and pulling out, and whether it blocks a way.
fn friction(driven: &Driven) -> String {
    let Some(friction) = &driven.friction else {
        return String::new();
    };
    let (curve, plain) = (&driven.curve, &friction.frictionless);
    let of = |place: Option<Place>| place.map_or_else(|| "0".to_owned(), |p| short(p.force_n));
    let out = plain.removal.peak();
    let out = out.map_or_else(String::new, |p| format!(" and out {} N", short(p.force_n)));
    let locks = curve.locking.map_or_else(String::new, |locking| {
        let way = if locking.is_out { "out" } else { "in" };
        format!(" It locks on the way {way}: all contacts stick where the way ends.")
    });
    format!(
        " Friction with a coefficient of {} is in these numbers; without it pushing in takes {} N{out}.{locks}",
        coefficient_in_words(&friction.coefficients),
        of(plain.insertion()),
    )
}

/// How many limits are kept, and how many cannot be told.
fn limits(driven: &Driven) -> String {
    let of = |state| driven.limits.iter().filter(|l| l.state == state).count();
    let (n, failed, unknown) = (
        driven.limits.len(),
        of(LimitState::Fail),
        of(LimitState::NotKnown),
    );
    match (n, failed, unknown) {
        (0, ..) => String::new(),
        (1, 0, 0) => " Its limit is kept.".to_owned(),
        (_, 0, 0) => format!(" All {n} limits are kept."),
        (_, _, 0) => format!(" Limits that are not kept: {failed} of {n}."),
        (_, 0, _) => format!(" Limits that are not known to be kept: {unknown} of {n}."),
        _ => format!(" Limits that are not kept: {failed} of {n}; not known: {unknown}."),
    }
}

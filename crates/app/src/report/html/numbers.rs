//! All numbers of the run.

use super::super::curve::Curve;
use super::super::data::Run;
use super::super::plot::short;
use super::super::strain::StrainPeak;
use super::super::summary::{max_certificate, max_wrench_mismatch};
use super::blocks::{labelled, section};

/// The table of key numbers.
pub(super) fn key_numbers(page: &mut String, run: &Run, curve: &Curve) {
    section(page, "Key numbers");
    let facts = &run.facts;
    let order = match facts.order {
        1 => "linear".to_owned(),
        2 => "quadratic".to_owned(),
        3 => "cubic".to_owned(),
        n => format!("order {n}"),
    };
    let source = if facts.from_cache {
        " (read from the cache)"
    } else {
        ""
    };
    let rows = [
        (
            "largest principal strain",
            run.strain
                .governing()
                .map_or("none".into(), StrainPeak::percent),
        ),
        (
            "safety against permissible strain",
            run.strain.safety_words(),
        ),
        (
            "largest rotation",
            format!("{}\u{b0}", short(facts.max_rotation_deg)),
        ),
        (
            "mesh",
            format!("{} nodes, {} {order} elements", facts.nodes, facts.elements),
        ),
        (
            "surface nodes",
            format!(
                "{}, of which {} may touch",
                facts.surface_nodes, facts.candidates
            ),
        ),
        (
            "preparation",
            format!("{} s{source}", short(facts.prepare_s)),
        ),
    ];
    let mut rows: Vec<_> = rows.into_iter().map(|(l, v)| (l.to_owned(), v)).collect();
    if let Some(driven) = &run.driven {
        let worst = driven
            .rows
            .iter()
            .map(|row| row.certificate)
            .fold(0.0, f64::max);
        rows.push((
            "places of the part's own curve".to_owned(),
            driven.rows.len().to_string(),
        ));
        rows.push((
            "worst certificate of these".to_owned(),
            format!("{worst:.1e}"),
        ));
    }
    if !run.rows.is_empty() {
        rows.extend(felt(run, curve));
    }
    // Where no clock was kept, no step can be late.
    if let Some(missed) = facts.missed_deadlines {
        rows.push(("missed deadlines".to_owned(), missed.to_string()));
    }
    labelled(page, &rows);
}

/// What the hand felt, and how well its steps were solved.
fn felt(run: &Run, curve: &Curve) -> Vec<(String, String)> {
    let millimetres = |m: f64| format!("{} mm", short(m * 1e3));
    let newtons = |n: f64| format!("{} N", short(n));
    let contacts = run.rows.iter().map(|row| row.contacts).max().unwrap_or(0);
    let coupling = run.facts.coupling_stiffness;
    let rows = [
        ("felt peak insertion force", newtons(curve.peak_force_n)),
        (
            "travel at the felt peak",
            millimetres(curve.travel_at_peak_m),
        ),
        ("felt snap drop", newtons(curve.snap_drop_n)),
        (
            "felt snap travel",
            curve
                .snap_travel_m
                .map_or("does not snap".into(), millimetres),
        ),
        (
            "felt insertion work",
            format!("{} mJ", short(curve.insertion_work_j * 1e3)),
        ),
        (
            "felt net work of the whole insertion",
            format!("{} mJ", short(curve.net_work_j * 1e3)),
        ),
        (
            "felt retention force",
            curve
                .retention_force_n
                .map_or("not pulled out".into(), newtons),
        ),
        (
            "coupling stiffness",
            coupling.map_or("none: the tool's pose is imposed".into(), |k| {
                format!("{} N/mm", short(k / 1e3))
            }),
        ),
        ("most contacts at once", contacts.to_string()),
        ("steps", run.rows.len().to_string()),
        (
            "worst certificate",
            format!("{:.1e}", max_certificate(&run.rows)),
        ),
        (
            "worst imbalance of contact and coupling",
            format!("{:.1e}", max_wrench_mismatch(&run.rows)),
        ),
    ];
    let owned = |(label, value): (&str, String)| (label.to_owned(), value);
    rows.into_iter().map(owned).collect()
}

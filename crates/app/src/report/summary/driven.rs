//! The part's own curve in `summary.json`.

use serde::Serialize;

use super::super::data::Driven;
use super::super::part_curve::{Hump, Place, Removal};

#[derive(Serialize)]
pub(super) struct VerdictSummary<'a> {
    outcome: &'static str,
    so_far: &'static str,
    reasons: &'a [String],
}

pub(super) fn verdict(driven: &Driven) -> VerdictSummary<'_> {
    let verdict = &driven.verdict;
    VerdictSummary {
        outcome: verdict.outcome.name(),
        so_far: verdict.so_far.name(),
        reasons: &verdict.reasons,
    }
}

#[derive(Serialize)]
pub(super) struct LimitSummary<'a> {
    key: &'a str,
    limit: f64,
    value: Option<f64>,
    state: &'static str,
    text: &'a str,
}

pub(super) fn limits(driven: &Driven) -> Vec<LimitSummary<'_>> {
    let all = driven.limits.iter();
    all.map(|fact| LimitSummary {
        key: fact.key,
        limit: fact.limit,
        value: fact.value,
        state: fact.state.name(),
        text: &fact.text,
    })
    .collect()
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
struct PlaceSummary {
    force_N: f64,
    travel_m: f64,
}

impl From<Place> for PlaceSummary {
    fn from(place: Place) -> Self {
        Self {
            force_N: place.force_n,
            travel_m: place.travel_m,
        }
    }
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
pub(super) struct LockingSummary {
    way: &'static str,
    force_N: f64,
    travel_m: f64,
}

pub(super) fn locking(driven: &Driven) -> Option<LockingSummary> {
    let locking = driven.curve.locking?;
    Some(LockingSummary {
        way: if locking.is_out { "out" } else { "in" },
        force_N: locking.place.force_n,
        travel_m: locking.place.travel_m,
    })
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
struct FrictionSummary {
    coefficient: f64,
    static_coefficient: Option<f64>,
    slip_weakening_distance_m: Option<f64>,
    source: Option<String>,
    frictionless_peak_insertion_force_N: Option<f64>,
    frictionless_peak_removal_force_N: Option<f64>,
    removal_over_insertion: Option<f64>,
    separation_travel_m: Option<f64>,
    put_in_J: f64,
    given_back_J: f64,
    dissipated_J: f64,
    stored_J: f64,
    unaccounted_J: f64,
}

fn friction(driven: &Driven) -> Option<FrictionSummary> {
    let facts = driven.friction.as_ref()?;
    let (curve, plain) = (&driven.curve, &facts.frictionless);
    let at_rest = Some(facts.coefficients).filter(|of| !of.is_constant());
    let force = |place: Option<Place>| place.map(|place| place.force_n);
    let (into, out) = (force(curve.insertion()), force(curve.removal.peak()));
    Some(FrictionSummary {
        coefficient: facts.coefficients.kinetic_coefficient,
        static_coefficient: at_rest.map(|of| of.static_coefficient),
        slip_weakening_distance_m: at_rest.map(|of| of.weakening_distance),
        source: facts.source.clone(),
        frictionless_peak_insertion_force_N: force(plain.insertion()),
        frictionless_peak_removal_force_N: force(plain.removal.peak()),
        removal_over_insertion: into.zip(out).map(|(into, out)| out / into),
        separation_travel_m: curve.separation_m,
        put_in_J: curve.energy.put_in_j,
        given_back_J: curve.energy.given_back_j,
        dissipated_J: curve.energy.dissipated_j,
        stored_J: curve.energy.stored_j,
        unaccounted_J: curve.energy.unaccounted_j(),
    })
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
struct HumpSummary {
    peak_force_N: f64,
    travel_at_peak_m: f64,
    lowest_force_N: f64,
    travel_at_lowest_m: f64,
    drop_N: f64,
    snap_ratio: f64,
    snap_travel_m: Option<f64>,
}

impl From<&Hump> for HumpSummary {
    fn from(hump: &Hump) -> Self {
        Self {
            peak_force_N: hump.force_n,
            travel_at_peak_m: hump.travel_m,
            lowest_force_N: hump.lowest_n,
            travel_at_lowest_m: hump.lowest_travel_m,
            drop_N: hump.drop_n,
            snap_ratio: hump.ratio,
            snap_travel_m: hump.gone_after_m,
        }
    }
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
pub(super) struct CurveSummary {
    file: &'static str,
    steps: usize,
    peak_insertion_force_N: Option<f64>,
    travel_at_peak_m: Option<f64>,
    snap: Option<HumpSummary>,
    humps: Vec<HumpSummary>,
    seat: Option<PlaceSummary>,
    end: PlaceSummary,
    insertion_work_J: f64,
    net_work_J: f64,
    peak_removal_force_N: Option<f64>,
    travel_at_removal_m: Option<f64>,
    is_out: Option<bool>,
    sideways_m: f64,
    turn_deg: f64,
    not_converged: usize,
    friction: Option<FrictionSummary>,
}

pub(super) fn curve(driven: &Driven) -> CurveSummary {
    let curve = &driven.curve;
    let (insertion, removal) = (curve.insertion(), curve.removal.peak());
    CurveSummary {
        file: "curve.csv",
        steps: curve.n_steps,
        peak_insertion_force_N: insertion.map(|place| place.force_n),
        travel_at_peak_m: insertion.map(|place| place.travel_m),
        snap: curve.snap().map(HumpSummary::from),
        humps: curve.humps.iter().map(HumpSummary::from).collect(),
        seat: curve.seat.map(PlaceSummary::from),
        end: curve.end.into(),
        insertion_work_J: curve.insertion_work_j,
        net_work_J: curve.net_work_j,
        peak_removal_force_N: removal.map(|place| place.force_n),
        travel_at_removal_m: removal.map(|place| place.travel_m),
        is_out: match curve.removal {
            Removal::NotPulled => None,
            Removal::StillHeld(_) => Some(false),
            Removal::Out(_) => Some(true),
        },
        sideways_m: curve.sideways_m,
        turn_deg: curve.turn_rad.to_degrees(),
        not_converged: curve.n_unconverged,
        friction: friction(driven),
    }
}

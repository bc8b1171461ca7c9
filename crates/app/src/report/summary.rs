//! `summary.json`: the numbers of a run for other programs. Key names are relied upon.

use std::collections::BTreeMap;

use serde::Serialize;

use super::curve::Curve;
use super::data::{MultiplyFacts, RateFacts, Run, STAGE_NAMES, StepRow};
use super::strain;

mod driven;

use driven::{CurveSummary, LimitSummary, LockingSummary, VerdictSummary};

/// Of the file. 2: verdict, limits and the part's own curve came in; no key of 1 has changed or gone.
const SCHEMA_VERSION: u32 = 2;

/// Order statistics of one stage's time, µs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99 % of the steps took no longer.
    pub p99: f64,
    /// 99.9 % of the steps took no longer.
    pub p999: f64,
    /// The longest.
    pub max: f64,
}

impl Percentiles {
    /// Exact, by sorting: the smallest value that at least the asked share does not exceed. `None`
    /// for no values.
    pub fn of_ns(times_ns: impl Iterator<Item = u64>) -> Option<Self> {
        let mut sorted: Vec<u64> = times_ns.collect();
        sorted.sort_unstable();
        let max = *sorted.last()?;
        // In thousandths, because 0.999 * n is not exact.
        let at = |thousandths: usize| {
            let rank = (sorted.len() * thousandths).div_ceil(1000).max(1);
            sorted[rank - 1] as f64 / 1e3
        };
        Some(Self {
            p50: at(500),
            p99: at(990),
            p999: at(999),
            max: max as f64 / 1e3,
        })
    }
}

/// Time statistics by stage, in the order of the stages, then `multiply` if any step did it, then
/// `total`.
pub fn stage_percentiles(rows: &[StepRow]) -> Vec<(&'static str, Percentiles)> {
    let mut stages = Vec::new();
    let mut push = |name, times: Option<Percentiles>| {
        if let Some(times) = times {
            stages.push((name, times));
        }
    };
    for (stage_idx, name) in STAGE_NAMES.into_iter().enumerate() {
        push(
            name,
            Percentiles::of_ns(rows.iter().map(|row| row.stage_ns[stage_idx])),
        );
    }
    push(
        "multiply",
        Percentiles::of_ns(rows.iter().filter_map(|row| row.multiply_ns)),
    );
    push(
        "total",
        Percentiles::of_ns(rows.iter().map(|row| row.total_ns)),
    );
    stages
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
struct Summary<'a> {
    schema_version: u32,
    verdict: Option<VerdictSummary<'a>>,
    limits: Vec<LimitSummary<'a>>,
    curve: Option<CurveSummary>,
    peak_insertion_force_N: f64,
    travel_at_peak_m: f64,
    snap_drop_N: f64,
    snap_travel_m: Option<f64>,
    retention_force_N: Option<f64>,
    peak_retention_force_N: Option<f64>,
    travel_at_retention_m: Option<f64>,
    dissipated_work_J: Option<f64>,
    locking: Option<LockingSummary>,
    insertion_work_J: f64,
    net_work_J: f64,
    coupling_stiffness_N_per_m: Option<f64>,
    max_principal_strain: f64,
    strain: strain::StrainSummary,
    max_rotation_deg: f64,
    max_certificate: f64,
    max_wrench_mismatch_rel: Option<f64>,
    made: &'a str,
    input_hash: String,
    nodes: usize,
    elements: usize,
    order: u32,
    surface_nodes: usize,
    max_contacts: u32,
    steps: usize,
    missed_deadlines: u64,
    step_us: BTreeMap<&'static str, Percentiles>,
    prepare_s: f64,
    rates: RatesSummary<'a>,
    multiply: MultiplySummary<'a>,
    effects: BTreeMap<&'a str, EffectSummary<'a>>,
    warnings: Vec<WarningSummary<'a>>,
}

#[derive(Serialize)]
struct WarningSummary<'a> {
    id: &'a str,
    text: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    number: Option<f64>,
}

fn warnings_summary(run: &Run) -> Vec<WarningSummary<'_>> {
    run.warnings
        .iter()
        .map(|warning| WarningSummary {
            id: warning.id,
            text: &warning.text,
            number: warning.number,
        })
        .collect()
}

#[derive(Serialize)]
struct MultiplySummary<'a> {
    runs_on: &'a str,
    gpu: bool,
    why: &'a str,
    words: &'a str,
    compared: Option<MultiplyRaceSummary<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    late_products: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    given_up: Option<&'a str>,
}

#[derive(Serialize)]
struct MultiplyRaceSummary<'a> {
    adapter: &'a str,
    contacts: usize,
    processor_us: f64,
    gpu_us: f64,
    measured_earlier: bool,
}

fn multiply_summary(multiply: &MultiplyFacts) -> MultiplySummary<'_> {
    MultiplySummary {
        runs_on: &multiply.runs_on,
        gpu: multiply.is_on_gpu,
        why: multiply.why,
        words: &multiply.words,
        compared: multiply.race.as_ref().map(|race| MultiplyRaceSummary {
            adapter: &race.adapter,
            contacts: race.n_contacts,
            processor_us: 1e6 * race.processor_s,
            gpu_us: 1e6 * race.gpu_s,
            measured_earlier: race.is_remembered,
        }),
        late_products: Some(multiply.n_late).filter(|n| *n > 0),
        given_up: multiply.given_up.as_deref(),
    }
}

#[derive(Serialize)]
struct RatesSummary<'a> {
    rates: u32,
    why: &'a str,
    two: Option<TwoRatesSummary>,
}

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
struct TwoRatesSummary {
    every: Option<u64>,
    hand_overs: u64,
    difference_median_N: f64,
    difference_max_N: f64,
    max_staleness_periods: u64,
    beyond_margin_periods: u64,
    faded_periods: u64,
    engine_us: Option<Percentiles>,
}

fn rates_summary(rates: &RateFacts) -> RatesSummary<'_> {
    RatesSummary {
        rates: 1 + u32::from(rates.two.is_some()),
        why: &rates.why,
        two: rates.two.map(|two| TwoRatesSummary {
            every: two.every,
            hand_overs: two.hand_overs,
            difference_median_N: two.difference_median_n,
            difference_max_N: two.difference_max_n,
            max_staleness_periods: two.max_staleness,
            beyond_margin_periods: two.beyond_margin,
            faded_periods: two.faded,
            engine_us: two.engine_us,
        }),
    }
}

#[derive(Serialize)]
struct EffectSummary<'a> {
    on: bool,
    number: Option<f64>,
    threshold: f64,
    why: &'a str,
}

/// What the keys of the hand tell: what it felt, or, without a hand, the part's own curve.
fn told(run: &Run, felt: &Curve) -> Curve {
    let Some(driven) = run.driven.as_ref().filter(|_| run.rows.is_empty()) else {
        return *felt;
    };
    let curve = &driven.curve;
    let insertion = curve.insertion().unwrap_or_default();
    Curve {
        peak_force_n: insertion.force_n,
        travel_at_peak_m: insertion.travel_m,
        peak_row_idx: None,
        snap_drop_n: curve.snap().map_or(0.0, |snap| snap.drop_n),
        snap_travel_m: curve.snap().and_then(|snap| snap.gone_after_m),
        insertion_work_j: curve.insertion_work_j,
        net_work_j: curve.net_work_j,
        retention_force_n: curve.removal.peak().map(|place| place.force_n),
    }
}

/// The text of `summary.json`. Numbers that are not finite become `null`.
pub fn json(run: &Run, curve: &Curve) -> String {
    let facts = &run.facts;
    let curve = &told(run, curve);
    let driven = run.driven.as_ref();
    let retention = driven.and_then(|driven| driven.curve.removal.peak());
    let is_felt = !run.rows.is_empty();
    let (certificate, max_contacts) = match driven.filter(|_| !is_felt) {
        Some(driven) => (
            largest(driven.rows.iter().map(|row| row.certificate)),
            driven.rows.iter().map(|row| row.contacts).max(),
        ),
        None => (
            max_certificate(&run.rows),
            run.rows.iter().map(|row| row.contacts).max(),
        ),
    };
    let max_contacts = max_contacts.unwrap_or(0);
    let summary = Summary {
        schema_version: SCHEMA_VERSION,
        verdict: driven.map(driven::verdict),
        limits: driven.map_or_else(Vec::new, driven::limits),
        curve: driven.map(driven::curve),
        peak_insertion_force_N: curve.peak_force_n,
        travel_at_peak_m: curve.travel_at_peak_m,
        snap_drop_N: curve.snap_drop_n,
        snap_travel_m: curve.snap_travel_m,
        retention_force_N: curve.retention_force_n,
        peak_retention_force_N: retention.map(|place| place.force_n),
        travel_at_retention_m: retention.map(|place| place.travel_m),
        dissipated_work_J: driven.map(|driven| driven.curve.energy.dissipated_j),
        locking: driven.and_then(driven::locking),
        insertion_work_J: curve.insertion_work_j,
        net_work_J: curve.net_work_j,
        coupling_stiffness_N_per_m: facts.coupling_stiffness,
        max_principal_strain: facts.max_principal_strain,
        strain: strain::summary(&run.strain),
        max_rotation_deg: facts.max_rotation_deg,
        max_certificate: certificate,
        // A pose that is imposed carries whatever the contacts ask for.
        max_wrench_mismatch_rel: is_felt.then(|| max_wrench_mismatch(&run.rows)),
        made: &run.origin.made,
        input_hash: run.origin.hash(),
        nodes: facts.nodes,
        elements: facts.elements,
        order: facts.order,
        surface_nodes: facts.surface_nodes,
        max_contacts,
        steps: run.rows.len(),
        // Other programs count on a number; without a clock nothing is late.
        missed_deadlines: facts.missed_deadlines.unwrap_or(0),
        step_us: stage_percentiles(&run.rows).into_iter().collect(),
        prepare_s: facts.prepare_s,
        rates: rates_summary(&facts.rates),
        multiply: multiply_summary(&facts.multiply),
        effects: run
            .effects
            .iter()
            .map(|effect| {
                let &super::Effect {
                    on,
                    number,
                    threshold,
                    ref why,
                    ..
                } = effect;
                (
                    effect.name.as_str(),
                    EffectSummary {
                        on,
                        number,
                        threshold,
                        why,
                    },
                )
            })
            .collect(),
        warnings: warnings_summary(run),
    };
    // Plain numbers, strings and maps with string keys: there is nothing to refuse.
    let mut text = serde_json::to_string_pretty(&summary).unwrap_or_default();
    text.push('\n');
    text
}

/// Worst imbalance of contact and coupling wrench on the tool of all steps, relative; not a number
/// if any step's is not.
pub fn max_wrench_mismatch(rows: &[StepRow]) -> f64 {
    largest(rows.iter().map(|row| row.wrench_mismatch_rel))
}

/// Worst certificate of all steps; not a number if any step's is not.
pub fn max_certificate(rows: &[StepRow]) -> f64 {
    largest(rows.iter().map(|row| row.certificate))
}

/// Largest of `values`, or NaN if one of them is: a broken step must not hide behind a good one.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |max, value| {
        if value.is_nan() || value > max {
            value
        } else {
            max
        }
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn percentiles_are_exact() {
        let times = Percentiles::of_ns((1..=1000).rev().map(|i| i * 1000)).unwrap();
        assert_eq!(
            times,
            Percentiles {
                p50: 500.0,
                p99: 990.0,
                p999: 999.0,
                max: 1000.0
            }
        );
        let one = Percentiles::of_ns([7_500].into_iter()).unwrap();
        assert_eq!(
            one,
            Percentiles {
                p50: 7.5,
                p99: 7.5,
                p999: 7.5,
                max: 7.5
            }
        );
        assert_eq!(Percentiles::of_ns(std::iter::empty()), None);
    }

    #[test]
    fn an_adapter_that_was_late_or_given_up_is_told_and_one_that_was_not_leaves_no_key() {
        let mut run = sample::run();
        let multiply = |run: &Run| -> serde_json::Value {
            let text = json(run, &Curve::of(&run.rows));
            let all: serde_json::Value = serde_json::from_str(&text).unwrap();
            all["multiply"].clone()
        };
        let before = multiply(&run);
        assert_eq!(before["why"], "asked");
        assert!(before.get("late_products").is_none() && before.get("given_up").is_none());
        run.facts.multiply.n_late = 3;
        run.facts.multiply.given_up = Some("it was lost".into());
        let after = multiply(&run);
        assert_eq!(after["late_products"], 3);
        assert_eq!(after["given_up"], "it was lost");
    }

    #[test]
    fn the_agreed_keys_are_there() {
        let run = sample::run();
        let text = json(&run, &Curve::of(&run.rows));
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        for key in [
            "peak_insertion_force_N",
            "travel_at_peak_m",
            "snap_drop_N",
            "snap_travel_m",
            "retention_force_N",
            "insertion_work_J",
            "net_work_J",
            "coupling_stiffness_N_per_m",
            "max_principal_strain",
            "strain",
            "max_rotation_deg",
            "max_certificate",
            "max_wrench_mismatch_rel",
            "nodes",
            "elements",
            "order",
            "surface_nodes",
            "max_contacts",
            "steps",
            "missed_deadlines",
            "made",
            "input_hash",
            "step_us",
            "prepare_s",
            "rates",
            "effects",
            "warnings",
        ] {
            assert!(!value[key].is_null(), "{key}");
        }
        assert_eq!(value["steps"], 900);
        for stage in STAGE_NAMES.into_iter().chain(["multiply", "total"]) {
            for key in ["p50", "p99", "p999", "max"] {
                assert!(value["step_us"][stage][key].is_f64(), "{stage} {key}");
            }
        }
        assert_eq!(value["effects"]["friction"]["number"], 0.3);
        assert_eq!(
            value["effects"]["gravity"]["number"],
            serde_json::Value::Null
        );
        assert_eq!(value["effects"]["gravity"]["on"], false);
    }

    #[test]
    fn a_part_not_pulled_out_has_a_null_retention_force() {
        let mut run = sample::run();
        run.rows.truncate(500);
        let value: serde_json::Value =
            serde_json::from_str(&json(&run, &Curve::of(&run.rows))).unwrap();
        assert!(value["retention_force_N"].is_null());
        assert!(value.as_object().unwrap().contains_key("retention_force_N"));
    }

    #[test]
    fn one_broken_certificate_is_not_hidden() {
        let mut rows = sample::rows();
        rows[3].certificate = f64::NAN;
        assert!(max_certificate(&rows).is_nan());
    }
}

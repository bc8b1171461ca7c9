//! Curves made of straight lines, whose numbers are read off by hand.
#![allow(clippy::unwrap_used, reason = "a test may fail by panic")]

use super::super::data::Driven;
use super::super::strain::{PeakKind, StrainFacts, StrainPeak};
use super::*;
use Phase::{Approach, Hold, Retract};

/// A line of the polygon's corners (mm, N), 50 rows from corner to corner.
fn polygon(phase: Phase, corners: &[(f64, f64)]) -> Vec<DriveRow> {
    let mut rows = Vec::new();
    for w in corners.windows(2) {
        let ((x0, f0), (x1, f1)) = (w[0], w[1]);
        for i in 0..50 {
            let share = f64::from(i) / 50.0;
            rows.push(row(phase, x0 + share * (x1 - x0), f0 + share * (f1 - f0)));
        }
    }
    let &(x, f) = corners.last().unwrap();
    rows.push(row(phase, x, f));
    rows
}

fn row(phase: Phase, travel_mm: f64, force_n: f64) -> DriveRow {
    DriveRow {
        phase,
        travel_m: 1e-3 * travel_mm,
        force_n,
        sideways_m: 0.0,
        turn_rad: 0.0,
        contacts: u32::from(force_n != 0.0),
        sticking: 0,
        dissipated_j: 0.0,
        stored_j: 0.0,
        is_converged: true,
        certificate: 0.0,
    }
}

fn into(corners: &[(f64, f64)]) -> PartCurve {
    PartCurve::of(&polygon(Approach, corners))
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-3), "{a} is not {b}");
}

fn verdict(curve: &PartCurve) -> Verdict {
    Verdict::of(curve, &Doubts::default())
}

const SNAP: [(f64, f64); 5] = [(0.0, 0.0), (1.0, 0.0), (3.0, 10.0), (4.0, -5.0), (5.0, 0.0)];

#[test]
fn a_single_snap() {
    let curve = into(&SNAP);
    let snap = *curve.snap().unwrap();
    close(snap.force_n, 10.0);
    close(snap.travel_m, 3e-3);
    assert_eq!(snap.row_idx, 100);
    close(snap.lowest_n, -5.0);
    close(snap.lowest_travel_m, 4e-3);
    close(snap.drop_n, 15.0);
    close(snap.ratio, 1.5);
    // 15 N in 1 mm: the force is gone after two thirds.
    close(snap.gone_after_m.unwrap(), 2e-3 / 3.0);
    assert_eq!(curve.further_humps().count(), 0);
    assert_eq!(curve.seat, None);
    // 10 mJ up to the peak and 10/3 mJ down to zero; then 5/6 mJ and 2.5 mJ come back.
    close(curve.insertion_work_j, 1e-3 * (10.0 + 10.0 / 3.0));
    close(
        curve.net_work_j,
        1e-3 * (10.0 + 10.0 / 3.0 - 5.0 / 6.0 - 2.5),
    );
    assert_eq!(curve.removal, Removal::NotPulled);
    let verdict = verdict(&curve);
    assert_eq!(verdict.outcome, Outcome::Snaps);
    assert_eq!(
        verdict.reasons,
        ["the force peaks at 10 N after 3 mm and falls by 15 N while the body moves on"]
    );
}

/// The tube of a cable clip: 9.3 N at 2.9 mm, then -8 N, then the stop at 24.6 N, or at any other force.
#[test]
fn a_seat_is_not_the_snap_however_hard_it_is() {
    for stop in [2.0, 24.6, 5e5] {
        let curve = into(&[
            (0.0, 0.0),
            (2.9, 9.3),
            (3.9, -8.0),
            (4.6, 0.0),
            (6.11, stop),
        ]);
        close(curve.snap().unwrap().force_n, 9.3);
        close(curve.snap().unwrap().travel_m, 2.9e-3);
        close(curve.snap().unwrap().drop_n, 17.3);
        assert_eq!(curve.humps.len(), 1);
        let seat = curve.seat.unwrap();
        close(seat.force_n, stop);
        close(seat.travel_m, 6.11e-3);
        close(curve.insertion().unwrap().force_n, 9.3);
        // The stop's work is not what the snap takes.
        close(curve.insertion_work_j, 0.5e-3 * 9.3 * (2.9 + 9.3 / 17.3));
        assert_eq!(verdict(&curve).outcome, Outcome::Snaps);
    }
}

/// Travel (mm) and force (N) of the clip of a 6 mm cable: 8.7 N at 3 mm, and 9.87 N at the stop.
#[test]
fn a_simulated_cable_clip_snaps_before_its_seat() {
    let text = include_str!("../../../tests/data/cable-clip-force.csv");
    let rows: Vec<DriveRow> = text
        .lines()
        .filter_map(|line| line.split_once(','))
        .filter_map(|(x, f)| Some(row(Approach, x.parse().ok()?, f.parse().ok()?)))
        .collect();
    assert!(rows.len() > 100, "{}", rows.len());
    let curve = PartCurve::of(&rows);
    let snap = curve.snap().unwrap();
    assert!((snap.force_n - 8.7).abs() < 0.05, "{snap:?}");
    assert!((snap.travel_m - 3e-3).abs() < 0.05e-3, "{snap:?}");
    assert!(
        curve.seat.unwrap().force_n > snap.force_n + 1.0,
        "{curve:?}"
    );
    assert_eq!(curve.humps.len(), 1);
}

#[test]
fn without_a_pull_in_after_the_snap_a_rise_is_a_seat_only_where_it_counts() {
    // Home is where the pull has gone: no seat.
    assert_eq!(into(&SNAP).seat, None);
    // The force never goes, and rises a little again.
    let curve = into(&[(0.0, 0.0), (1.0, 10.0), (2.0, 4.0), (3.0, 4.5)]);
    assert_eq!(curve.seat, None);
    close(curve.snap().unwrap().ratio, 0.6);
    assert_eq!(curve.snap().unwrap().gone_after_m, None);
    let curve = into(&[(0.0, 0.0), (1.0, 10.0), (2.0, 4.0), (3.0, 7.0)]);
    close(curve.seat.unwrap().force_n, 7.0);
}

#[test]
fn several_humps_are_each_told_and_the_largest_is_the_snap() {
    let curve = into(&[
        (0.0, 0.0),
        (1.0, 4.0),
        (2.0, -1.0),
        (3.0, 8.0),
        (4.0, 2.0),
        (5.0, 6.0),
        (6.0, 0.0),
    ]);
    let forces: Vec<f64> = curve.humps.iter().map(|h| h.force_n).collect();
    let lowest: Vec<f64> = curve.humps.iter().map(|h| h.lowest_n).collect();
    assert_eq!(forces, [4.0, 8.0, 6.0]);
    for (lowest, right) in lowest.into_iter().zip([-1.0, 2.0, 0.0]) {
        close(lowest, right);
    }
    assert_eq!(curve.snap_idx, Some(1));
    let further: Vec<f64> = curve.further_humps().map(|h| h.force_n).collect();
    assert_eq!(further, [4.0, 6.0]);
    // The force is gone after the first, not after the second.
    close(curve.humps[0].gone_after_m.unwrap(), 0.8e-3);
    assert_eq!(curve.humps[1].gone_after_m, None);
    // The sum is largest at the end: triangles 2, 1.6, -0.1, ... all over 6 mm.
    let whole = 0.5 * (4.0 + 3.0 + 7.0 + 10.0 + 8.0 + 6.0);
    close(curve.insertion_work_j, 1e-3 * whole);
    close(curve.net_work_j, 1e-3 * whole);
}

#[test]
fn the_work_of_humps_is_the_largest_sum_on_the_way() {
    // 10 mJ in, 12 mJ back, 3 mJ in, 3 mJ back.
    let curve = into(&[
        (0.0, 0.0),
        (1.0, 20.0),
        (1.0 + 1e-9, -24.0),
        (2.0, 0.0),
        (3.0, 6.0),
        (3.0 + 1e-9, -6.0),
        (4.0, 0.0),
    ]);
    assert_eq!(curve.humps.len(), 2);
    assert!((curve.insertion_work_j - 10e-3).abs() < 1e-9);
    // More came back than was put in.
    assert!((curve.net_work_j + 2e-3).abs() < 1e-9);
}

#[test]
fn teeth_and_round_off_are_no_humps() {
    // Teeth of 0.6 N on the way up, of 9 % at the top, and on the way down to the seat.
    let mut corners = vec![(0.0, 0.0)];
    for i in 1..=20 {
        let x = 0.1 * f64::from(i);
        corners.extend([(x - 0.02, 5.0 * x + 0.3), (x, 5.0 * x - 0.3)]);
    }
    corners.extend([
        (2.1, 10.0),
        (2.2, 9.1),
        (2.3, 9.9),
        (3.0, -2.0),
        (4.0, 1e-13),
        (5.0, 0.0),
    ]);
    let curve = into(&corners);
    assert_eq!(curve.humps.len(), 1, "{:#?}", curve.humps);
    close(curve.snap().unwrap().force_n, 10.3);
    // Nothing but round-off, and much of it, before a stop.
    let mut corners: Vec<(f64, f64)> = (0..30)
        .map(|i| (0.1 * f64::from(i), 1e-9 * f64::from(i % 2)))
        .collect();
    corners.extend([(3.0, 0.0), (4.0, 50.0)]);
    let curve = into(&corners);
    assert_eq!(curve.humps, []);
    assert_eq!(curve.seat, None);
}

#[test]
fn without_a_peak_that_is_passed_nothing_snaps() {
    // A press fit: it takes 8 N from 1 mm on.
    let curve = into(&[(0.0, 0.0), (1.0, 8.0), (3.0, 8.0)]);
    assert_eq!(curve.end_trend, Trend::Level);
    close(curve.insertion().unwrap().force_n, 8.0);
    close(curve.insertion_work_j, 1e-3 * (4.0 + 16.0));
    let level = verdict(&curve);
    assert_eq!(level.outcome, Outcome::DoesNotSnap);
    assert!(level.reasons[0].contains("reaches 8 N"), "{level:?}");
    // It only pulls.
    let curve = into(&[(0.0, 0.0), (1.0, -3.0), (2.0, 0.0)]);
    assert_eq!((curve.largest, curve.humps.len()), (None, 0));
    close(curve.net_work_j, -3e-3);
    assert_eq!(curve.insertion_work_j, 0.0);
    let pulled = verdict(&curve);
    assert_eq!(pulled.outcome, Outcome::DoesNotSnap);
    assert_eq!(pulled.reasons, ["nothing resists on the way in"]);
}

#[test]
fn a_way_that_ends_too_soon_is_incomplete() {
    for (corners, doing) in [
        (vec![(0.0, 0.0), (4.5, 21.3)], "rises"),
        // The crest of a smooth hump, and just beyond.
        (vec![(0.0, 0.0), (4.0, 21.0), (4.5, 21.1)], "rises"),
        (vec![(0.0, 0.0), (4.0, 21.0), (4.5, 20.0)], "falls"),
    ] {
        let curve = into(&corners);
        let verdict = verdict(&curve);
        assert_eq!(verdict.outcome, Outcome::Incomplete);
        assert_eq!(verdict.so_far, Outcome::DoesNotSnap);
        let reason = &verdict.reasons[0];
        assert!(
            reason.starts_with(&format!("the force still {doing} at the end of the way")),
            "{reason}"
        );
        assert!(
            reason.contains("at 4.5 mm: go on further with drive.travel"),
            "{reason}"
        );
    }
}

#[test]
fn nothing_touched_is_a_verdict() {
    let curve = into(&[(0.0, 0.0), (4.5, 0.0)]);
    assert!(!curve.is_touched);
    assert_eq!(curve.insertion(), None);
    let verdict = verdict(&curve);
    assert_eq!(verdict.outcome, Outcome::DoesNotSnap);
    assert_eq!(verdict.reasons, ["nothing touched on 4.5 mm of way"]);
}

#[test]
fn without_rows_there_is_no_number_and_no_panic() {
    let curve = PartCurve::of(&[]);
    assert_eq!(curve, PartCurve::default());
    assert_eq!(verdict(&curve).outcome, Outcome::Incomplete);
    let mut rows = polygon(Approach, &SNAP);
    for row in rows.iter_mut().step_by(7) {
        row.force_n = f64::NAN;
    }
    rows[1].travel_m = f64::INFINITY;
    let curve = PartCurve::of(&rows);
    assert!((curve.snap().unwrap().force_n - 10.0).abs() < 0.2);
    assert!(curve.net_work_j.is_finite());
}

/// What bounces visits the same travel with other forces: that is no fall on the way on.
#[test]
fn going_back_is_no_way_in() {
    let mut rows = polygon(Approach, &[(0.0, 0.0), (1.0, 5.0)]);
    rows.extend(polygon(Approach, &[(1.0, 5.0), (0.8, 0.0)]));
    rows.extend(polygon(Approach, &[(0.8, 0.0), (1.0, 5.0), (2.0, 10.0)]));
    let curve = PartCurve::of(&rows);
    assert_eq!(curve.humps, []);
    assert_eq!(curve.n_in, 101);
    close(curve.net_work_j, 10e-3);
    assert_eq!(verdict(&curve).outcome, Outcome::Incomplete);
}

#[test]
fn a_force_that_is_there_from_the_start_and_falls_was_never_seen_to_peak() {
    let curve = into(&[(0.0, 10.0), (1.0, 0.0), (2.0, 0.0)]);
    assert_eq!(curve.humps, []);
    assert_eq!(verdict(&curve).outcome, Outcome::DoesNotSnap);
}

#[test]
fn the_pull_out_is_positive_and_told_only_where_its_peak_is_passed() {
    let mut rows = polygon(Approach, &SNAP);
    rows.push(row(Hold, 5.0, 0.0));
    let way_out = polygon(Retract, &[(5.0, 0.0), (4.0, -12.0), (3.0, 3.0), (0.0, 0.0)]);
    rows.extend(&way_out[..40]);
    let Removal::StillHeld(most) = PartCurve::of(&rows).removal else {
        panic!("{:?}", PartCurve::of(&rows).removal)
    };
    close(most.force_n, 12.0 * 39.0 / 50.0);
    rows.extend(&way_out[40..]);
    let curve = PartCurve::of(&rows);
    let peak = curve.removal.peak().unwrap();
    close(peak.force_n, 12.0);
    close(peak.travel_m, 4e-3);
    // The way in's numbers do not change by it.
    assert_eq!(curve.snap(), into(&SNAP).snap());
    // What nothing holds comes out with 0 N.
    let mut rows = polygon(Approach, &[(0.0, 0.0), (1.0, 5.0)]);
    rows.extend(polygon(Retract, &[(1.0, 5.0), (0.0, 0.0)]));
    let peak = PartCurve::of(&rows).removal.peak().unwrap();
    assert_eq!(peak.force_n, 0.0);
}

#[test]
fn what_the_curve_cannot_tell_is_said_with_what_it_looks_like() {
    let mut rows = polygon(Approach, &SNAP);
    rows[20].is_converged = false;
    (rows[30].sideways_m, rows[31].turn_rad) = (-4e-4, -0.02);
    let curve = PartCurve::of(&rows);
    assert_eq!((curve.sideways_m, curve.turn_rad), (4e-4, 0.02));
    let doubts = Doubts {
        missing_effects: vec!["friction is called for".into()],
        friction_share: Some(0.6),
        friction_out_n: Some(3.0),
        others: vec!["another".into()],
    };
    let verdict = Verdict::of(&curve, &doubts);
    assert_eq!(verdict.outcome, Outcome::Incomplete);
    assert_eq!(verdict.so_far, Outcome::Snaps);
    let [friction, steps, another] = &verdict.reasons[..] else {
        panic!("{:?}", verdict.reasons)
    };
    assert_eq!(
        (friction.as_str(), another.as_str()),
        ("friction is called for", "another")
    );
    assert!(
        steps.starts_with("1 of 201 steps did not converge"),
        "{steps}"
    );
}

fn strained(value: f64, error: f64) -> StrainFacts {
    StrainFacts {
        peaks: vec![StrainPeak {
            value,
            error,
            place: [0.0; 3],
            node_tag: 1,
            travel_m: 1e-3,
            force_n: 1.0,
            kind: PeakKind::Free,
        }],
        permissible: None,
        at_seat: None,
        n_moments: 1,
    }
}

fn judged(
    asked: Limits,
    rows: &[DriveRow],
    doubts: &Doubts,
    strain: &StrainFacts,
) -> (LimitState, String) {
    let curve = PartCurve::of(rows);
    let facts = limits::judge(&asked, &curve, &Verdict::of(&curve, doubts), strain);
    let [fact] = &facts[..] else {
        panic!("{facts:?}")
    };
    (fact.state, fact.text.clone())
}

#[test]
fn the_insertion_limit_is_against_the_snap_and_not_against_the_seat() {
    let rows = polygon(
        Approach,
        &[(0.0, 0.0), (2.9, 9.3), (3.9, -8.0), (6.0, 24.6)],
    );
    let of = |limit, doubts: &Doubts| {
        let asked = Limits {
            insertion_below: Some(limit),
            ..Limits::default()
        };
        judged(asked, &rows, doubts, &StrainFacts::default())
    };
    let sure = Doubts::default();
    assert_eq!(
        of(10.25, &sure),
        (
            LimitState::Pass,
            "insertion takes 9.3 N, to be below 10.25 N".into()
        )
    );
    assert_eq!(of(9.3, &sure).0, LimitState::Fail);
    assert_eq!(
        of(9.3001, &sure),
        (
            LimitState::Pass,
            "insertion takes 9.3 N, to be below 9.3001 N".into()
        )
    );
    // 9.3 N is not below 9.2999 N, nor does it look so.
    assert_eq!(of(9.2999, &sure).0, LimitState::Fail);
    // With something missing a pass is none, and a fail stays one.
    let doubts = Doubts {
        missing_effects: vec!["friction".into()],
        ..Doubts::default()
    };
    let (state, text) = of(10.0, &doubts);
    assert_eq!(state, LimitState::NotKnown);
    assert!(text.contains("the verdict is incomplete"), "{text}");
    assert_eq!(of(9.0, &doubts).0, LimitState::Fail);
    // Where friction alone is missing, and its share is estimated, a limit that is kept with it is kept.
    let estimated = Doubts {
        friction_share: Some(0.6),
        friction_out_n: Some(3.0),
        ..doubts
    };
    assert_eq!(of(14.87, &estimated).0, LimitState::NotKnown);
    let (state, text) = of(14.9, &estimated);
    assert_eq!(state, LimitState::Pass);
    assert!(text.contains("about 14.9 N with friction"), "{text}");
}

#[test]
fn the_removal_limit_needs_a_way_out() {
    let mut rows = polygon(Approach, &SNAP);
    let of = |limit, rows: &[DriveRow]| {
        let asked = Limits {
            removal_above: Some(limit),
            ..Limits::default()
        };
        judged(asked, rows, &Doubts::default(), &StrainFacts::default())
    };
    let (state, text) = of(3.0, &rows);
    assert_eq!(state, LimitState::NotKnown);
    assert!(text.contains("drive.retract = true"), "{text}");
    let way_out = polygon(Retract, &[(5.0, 0.0), (4.0, -12.0), (0.0, 0.0)]);
    rows.extend(&way_out[..26]);
    // Held with 6 N so far: more than 5 N for sure, perhaps more than 7 N.
    assert_eq!(of(5.0, &rows).0, LimitState::Pass);
    assert_eq!(of(7.0, &rows).0, LimitState::NotKnown);
    rows.extend(&way_out[26..]);
    assert_eq!(
        of(11.0, &rows),
        (
            LimitState::Pass,
            "removal takes 12 N, to be above 11 N".into()
        )
    );
    assert_eq!(of(12.0, &rows).0, LimitState::Fail);
    // With friction it may hold; and where the way in ended in the fall the pull is not the one from home.
    let asked = Limits {
        removal_above: Some(14.0),
        ..Limits::default()
    };
    let estimated = Doubts {
        missing_effects: vec!["friction".into()],
        friction_share: Some(0.6),
        friction_out_n: Some(3.0),
        others: Vec::new(),
    };
    let (state, text) = judged(asked, &rows, &estimated, &StrainFacts::default());
    assert_eq!(state, LimitState::NotKnown);
    assert!(text.contains("about 15 N with friction"), "{text}");
    let too_much = Limits {
        removal_above: Some(15.1),
        ..Limits::default()
    };
    let (state, _) = judged(too_much, &rows, &estimated, &StrainFacts::default());
    assert_eq!(state, LimitState::Fail);
    let mut short = polygon(Approach, &[(0.0, 0.0), (1.0, 10.0), (2.0, 5.0)]);
    short.extend(polygon(Retract, &[(2.0, 0.0), (1.5, -2.0), (0.0, 0.0)]));
    let (state, text) = judged(asked, &short, &Doubts::default(), &StrainFacts::default());
    assert_eq!(state, LimitState::NotKnown);
    assert!(text.contains("ended in the fall"), "{text}");
    assert_eq!(
        of(12.0004, &rows),
        (
            LimitState::Fail,
            "removal takes 12 N, to be above 12.0004 N".into()
        )
    );
}

#[test]
fn a_strain_within_the_mesh_s_error_of_the_limit_is_not_known() {
    let rows = polygon(Approach, &SNAP);
    let of = |strain_use, value, error| {
        let asked = Limits {
            strain_below: Some(0.04),
            strain_use,
            ..Limits::default()
        };
        judged(asked, &rows, &Doubts::default(), &strained(value, error))
    };
    assert_eq!(
        of(StrainUse::Once, 0.03, 0.002),
        (
            LimitState::Pass,
            "largest strain 3 ± 0.2 %, to be below 4 %".into()
        )
    );
    assert_eq!(of(StrainUse::Once, 0.039, 0.002).0, LimitState::NotKnown);
    assert_eq!(of(StrainUse::Once, 0.041, 0.002).0, LimitState::Fail);
    // What is borne once is not borne often.
    let (state, text) = of(StrainUse::Repeatedly, 0.03, 0.002);
    assert_eq!(state, LimitState::Fail);
    assert_eq!(
        text,
        "largest strain 3 ± 0.2 %, to be below 2.4 % (60 % of 4 %, for repeated use)"
    );
    assert_eq!(of(StrainUse::Repeatedly, 0.02, 0.002).0, LimitState::Pass);
}

#[test]
fn a_number_is_told_on_its_side_of_the_limit() {
    let rows = polygon(Approach, &[(0.0, 0.0), (1.0, 9.9996), (2.0, 0.0)]);
    let asked = Limits {
        insertion_below: Some(10.0),
        ..Limits::default()
    };
    let (state, text) = judged(asked, &rows, &Doubts::default(), &StrainFacts::default());
    assert_eq!(state, LimitState::Pass);
    assert_eq!(text, "insertion takes 9.9996 N, to be below 10 N");
}

#[test]
fn a_limit_is_not_kept_by_a_tool_that_misses() {
    let rows = polygon(Approach, &[(0.0, 0.0), (4.5, 0.0)]);
    let asked = Limits {
        insertion_below: Some(50.0),
        ..Limits::default()
    };
    let (state, text) = judged(asked, &rows, &Doubts::default(), &StrainFacts::default());
    assert_eq!(state, LimitState::NotKnown);
    assert_eq!(
        text,
        "insertion takes 0 N, to be below 50 N, but nothing touched"
    );
}

fn driven(rows: Vec<DriveRow>, doubts: &Doubts, asked: &Limits) -> Driven {
    Driven::of(rows, doubts, asked, &StrainFacts::default())
}

#[test]
fn the_terminal_says_all_of_it_in_a_few_lines() {
    let mut rows = polygon(
        Approach,
        &[
            (0.0, 0.0),
            (2.0, 5.0),
            (3.0, 0.0),
            (4.0, 10.0),
            (5.0, -5.0),
            (6.0, 25.0),
        ],
    );
    rows.extend(polygon(Retract, &[(6.0, 25.0), (5.0, -12.0), (0.0, 0.0)]));
    rows[5].sideways_m = 2e-4;
    let asked = Limits {
        insertion_below: Some(9.0),
        removal_above: Some(11.0),
        ..Limits::default()
    };
    let snap = driven(rows, &Doubts::default(), &asked);
    assert_eq!(
        words::terminal(&snap),
        "  verdict               snaps\n  \
         snap                  10.000 N at 4.000 mm, falls by 15 N to -5 N (ratio 1.5)\n  \
         further hump          5.000 N at 2.000 mm, falls by 5 N to 0 N (ratio 1)\n  \
         seat                  25.000 N at 6.000 mm, where the way ends\n  \
         work                  15.8 mJ to push it over, 25 mJ at the end of the way\n  \
         removal               12.000 N at 5.000 mm\n  \
         sideways              0.2 mm\n  \
         FAIL                  insertion takes 10 N, to be below 9 N\n  \
         PASS                  removal takes 12 N, to be above 11 N\n"
    );
    assert_eq!(
        words::headline(&snap),
        "The part snaps: the force peaks at 10 N after 4 mm and falls by 15 N. There is a further hump. It is seated \
         with 25 N at 6 mm. Pushing it over takes 15.8 mJ. Pulling out again takes 12 N. Limits that are not kept: 1 of \
         2."
    );
}

#[test]
fn an_incomplete_curve_says_so_first_and_each_reason_on_a_line() {
    let mut rows = polygon(Approach, &[(0.0, 0.0), (4.5, 21.3)]);
    rows[3].is_converged = false;
    let short = driven(rows, &Doubts::default(), &Limits::default());
    assert_eq!(
        words::terminal(&short),
        "  verdict               incomplete; as far as it is simulated, it does not snap\n  \
         because               1 of 51 steps did not converge: make drive.step smaller, or mesh the contact faces finer\n  \
         because               the force still rises at the end of the way, 21.3 N at 4.5 mm: go on further with drive.travel\n  \
         largest force         21.300 N at 4.500 mm\n  \
         work                  47.9 mJ to push it in, 47.9 mJ at the end of the way\n  \
         removal               not pulled out\n"
    );
    let headline = words::headline(&short);
    assert!(
        headline.starts_with("Incomplete: 1 of 51 steps did not converge"),
        "{headline}"
    );
    assert!(
        headline.contains(
            "and 1 further reason, below. As far as it is simulated, the part does not snap"
        ),
        "{headline}"
    );
}

#[test]
fn nothing_touched_has_no_number_that_looks_like_a_result() {
    let mut rows = polygon(Approach, &[(0.0, 0.0), (4.5, 0.0)]);
    rows.extend(polygon(Retract, &[(4.5, 0.0), (0.0, 0.0)]));
    let missed = driven(rows, &Doubts::default(), &Limits::default());
    assert_eq!(
        words::terminal(&missed),
        "  verdict               does not snap: nothing touched on 4.5 mm of way\n"
    );
    assert_eq!(
        words::headline(&missed),
        "The part does not snap: the tool touched nothing."
    );
}

//! The part's own curve, its verdict and its limits, as a user runs them.

use std::fs;
use std::path::Path;

use serde_json::Value;

use snapin_tests::{Outcome, arg, root, snapin};

/// The shipped clip with `[drive]` in place of its hand, and no coefficient of friction.
fn clip(folder: &Path, more: &str) -> (Outcome, Value) {
    let scenes = root().join("scenes");
    let text = fs::read_to_string(scenes.join("clip.toml")).unwrap();
    let hand = text.find("[hand]").unwrap();
    let mesh = scenes.join("clip.msh").display().to_string();
    let text = text[..hand].replace("\"clip.msh\"", &format!("{mesh:?}"));
    let drive = "[drive]\ndirection = [0, -1, 0]\ntravel = 0.014\n";
    let file = folder.join("clip.toml");
    fs::write(&file, format!("{text}{drive}{more}")).unwrap();
    let out = folder.join("out");
    let outcome = snapin(&["run", arg(&file), "--no-cache", "--out", arg(&out)]);
    let summary = fs::read_to_string(out.join("summary.json")).unwrap_or_default();
    (outcome, serde_json::from_str(&summary).unwrap_or_default())
}

fn near(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().unwrap_or(f64::NAN);
    assert!(
        (value - expected).abs() < tolerance,
        "{value} is not {expected}"
    );
}

#[test]
fn a_scene_without_a_hand_has_the_parts_curve_and_nothing_felt() {
    let folder = tempfile::tempdir().unwrap();
    let (outcome, summary) = clip(folder.path(), "");
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    assert!(
        outcome.out.contains("verdict               snaps"),
        "{}",
        outcome.out
    );
    assert_eq!(summary["schema_version"], 2);
    assert_eq!(summary["verdict"]["outcome"], "snaps");
    let curve = &summary["curve"];
    near(&curve["snap"]["peak_force_N"], 8.444, 5e-3);
    near(&curve["snap"]["travel_at_peak_m"], 3.547e-3, 2e-5);
    // Without friction the way out is the way in: what pulls the tube in holds it.
    near(&curve["peak_removal_force_N"], 8.258, 5e-3);
    near(&curve["net_work_J"], 0.0, 1e-5);
    assert_eq!(curve["sideways_m"], 0.0);
    let out = folder.path().join("out");
    assert!(out.join("curve.csv").is_file());
    for name in ["force-travel.csv", "timing.csv", "session.mcap"] {
        assert!(!out.join(name).exists(), "{name}");
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for text in [
        " NaN",
        "felt by the hand",
        "felt peak insertion force",
        "Time of a step",
    ] {
        assert!(!page.contains(text), "{text}");
    }
}

#[test]
fn a_limit_that_is_not_kept_is_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let limits = |insertion: f64, removal: f64| {
        let more = format!("[limits]\ninsertion_below = {insertion}\nremoval_above = {removal}\n");
        let (outcome, summary) = clip(folder.path(), &more);
        let states: Vec<String> = summary["limits"]
            .as_array()
            .unwrap()
            .iter()
            .map(|limit| limit["state"].as_str().unwrap().to_owned())
            .collect();
        (outcome.code, states)
    };
    assert_eq!(limits(8.5, 8.2), (0, vec!["pass".into(), "pass".into()]));
    assert_eq!(limits(8.4, 8.2), (1, vec!["fail".into(), "pass".into()]));
    assert_eq!(limits(8.5, 8.3), (1, vec!["pass".into(), "fail".into()]));
}

#[test]
fn the_step_of_the_drive_does_not_move_the_peak() {
    let folder = tempfile::tempdir().unwrap();
    let peak = |step: f64| {
        let (_, summary) = clip(folder.path(), &format!("step = {step}\nretract = false\n"));
        summary["curve"]["peak_insertion_force_N"].as_f64().unwrap()
    };
    let (fine, coarse) = (peak(2e-5), peak(2e-4));
    assert!((coarse / fine - 1.0).abs() < 2e-3, "{fine} {coarse}");
}

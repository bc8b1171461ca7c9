//! Every shipped scene is run, and the main things it should show are checked.

use std::path::Path;

use serde_json::Value;
use snapin_tests::{arg, csv, root, snapin};

fn run_scene(name: &str, out: &Path) -> Value {
    let scene = root().join("scenes").join(name);
    let result = snapin(&["run", arg(&scene), "--out", arg(out), "--no-cache"]);
    assert_eq!(result.code, 0, "{}\n{}", result.out, result.err);
    // Two sets of nodes once took turns in the hook: each lifted off while the other was pressed, lost
    // its plane, and sank in again.
    for trouble in ["come to a stand", "not solved", "max_contacts", "refused"] {
        assert!(!result.err.contains(trouble), "{}", result.err);
    }
    serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

fn column(columns: &[(String, Vec<f64>)], name: &str) -> Vec<f64> {
    columns.iter().find(|c| c.0 == name).unwrap().1.clone()
}

/// Snapping is: the force rises from nothing, peaks, falls through zero and comes to rest.
fn assert_snaps(out: &Path, summary: &Value) {
    let curve = csv(&out.join("force-travel.csv"));
    let force = column(&curve, "force_N");
    let peak_at = (0..force.len())
        .max_by(|&a, &b| force[a].total_cmp(&force[b]))
        .unwrap();
    let peak = force[peak_at];
    assert_eq!(force[0], 0.0, "free at the start");
    assert!(peak > 0.0 && peak_at > 0);
    let lowest = force[peak_at..]
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    assert!(lowest < 0.0, "the clip pulls the tool home: {lowest}");
    let tail = &force[force.len() - 50..];
    let swing = tail.iter().fold(0.0f64, |a, f| a.max((f - tail[0]).abs()));
    assert!(
        swing < 0.01 * peak,
        "at rest at the end, swings by {swing} N"
    );

    let number = |key: &str| summary[key].as_f64().unwrap();
    assert!((number("peak_insertion_force_N") - peak).abs() < 1e-12 * peak);
    for key in [
        "insertion_work_J",
        "snap_travel_m",
        "coupling_stiffness_N_per_m",
        "snap_drop_N",
    ] {
        assert!(number(key) > 0.0, "{key}");
    }
    // Both sides of the tool's equilibrium, every step: nine digits.
    assert!(
        number("max_wrench_mismatch_rel") < 1e-9,
        "{}",
        number("max_wrench_mismatch_rel")
    );
    // Scaled natural residual of every LCP: round-off of problems of about 50 rows.
    assert!(
        number("max_certificate") < 1e-10,
        "{}",
        number("max_certificate")
    );
}

#[test]
fn the_clip_snaps_and_two_runs_agree_to_the_last_digit() {
    let dir = tempfile::tempdir().unwrap();
    let (first, second) = (dir.path().join("first"), dir.path().join("second"));
    let summary = run_scene("clip.toml", &first);
    assert_snaps(&first, &summary);
    // The paper's clip: 686 nodes and 293 quadratic elements (Duriez et al. 2004, 5.2).
    assert_eq!(summary["order"], 2);
    assert!(
        (650..=720).contains(&summary["nodes"].as_u64().unwrap()),
        "{}",
        summary["nodes"]
    );
    assert!(
        (270..=320).contains(&summary["elements"].as_u64().unwrap()),
        "{}",
        summary["elements"]
    );
    for file in [
        "report.html",
        "force-travel.csv",
        "force-travel.svg",
        "timing.csv",
        "session.mcap",
    ] {
        assert!(first.join(file).is_file(), "{file}");
    }

    run_scene("clip.toml", &second);
    let read = |dir: &Path| std::fs::read(dir.join("force-travel.csv")).unwrap();
    assert!(
        read(&first) == read(&second),
        "the curve differs between two runs"
    );
}

#[test]
fn the_hook_snaps_near_its_handbook_force() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("hook");
    let summary = run_scene("hook.toml", &out);
    assert_snaps(&out, &summary);
    // Handbook: P = b h³ E y / (4 L³) and W = P tan α, here with the deflection at which the rounded
    // edge of the tool (radius 2 mm) leaves the ramp, y - r (1 - cos 30°), and the ramp turned by the
    // arm's slope, 3 y / (2 L). The handbook itself claims 10 %.
    let alpha = 30f64.to_radians();
    let bent = 1e-3 - 2e-3 * (1.0 - alpha.cos());
    let across = 6e-3 * 2e-3f64.powi(3) * 1.3e9 * bent / (4.0 * 20e-3f64.powi(3));
    let handbook = across * (alpha + 1.5 * bent / 20e-3).tan();
    let peak = summary["peak_insertion_force_N"].as_f64().unwrap();
    assert!(
        (peak / handbook - 1.0).abs() < 0.1,
        "{peak} N, handbook {handbook} N"
    );
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(
        report.contains("handbook"),
        "the formula stands beside the curve"
    );
}

/// A corner leaves the ramp only at the crest, so that the arm bends by the whole undercut: the handbook's formula as in
/// the hook's test, P = b h³ E y / (4 L³), W = P tan(α + 3 y / 2 L). Contact at nodes alone peaks at twice as much.
#[test]
fn the_hook_under_a_sharp_corner_snaps_near_its_handbook_force() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("edge");
    let summary = run_scene("edge.toml", &out);
    let across = 6e-3 * 2e-3f64.powi(3) * 1.3e9 * 1e-3 / (4.0 * 20e-3f64.powi(3));
    let handbook = across * (30f64.to_radians() + 1.5 * 1e-3 / 20e-3).tan();
    let peak = summary["peak_insertion_force_N"].as_f64().unwrap();
    assert!(
        (peak / handbook - 1.0).abs() < 0.05,
        "{peak} N, handbook {handbook} N"
    );
}

/// The clip's scene with changes, in a folder of its own; pictures left out.
fn varied_clip(dir: &Path, edit: impl Fn(String) -> String) -> Value {
    std::fs::copy(root().join("scenes/clip.msh"), dir.join("clip.msh")).unwrap();
    let text = std::fs::read_to_string(root().join("scenes/clip.toml")).unwrap();
    let scene = dir.join("varied.toml");
    let quiet = "\n[output]\nframes = 0\npictures = false\nvtu = false\nmcap = false\n";
    std::fs::write(&scene, edit(text) + quiet).unwrap();
    let out = dir.join("out");
    let result = snapin(&["run", arg(&scene), "--out", arg(&out), "--no-cache"]);
    assert_eq!(result.code, 0, "{}\n{}", result.out, result.err);
    serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

/// Holding the part and pushing it onto the tube is the same contact with the signs turned. The
/// coupling then acts about another point, which moves the tilt of the tool by a little: 0.1 %.
#[test]
fn holding_the_part_gives_the_force_of_holding_the_tool() {
    let dir = tempfile::tempdir().unwrap();
    let tool = varied_clip(dir.path(), |text| text);
    let part = varied_clip(dir.path(), |text| {
        text.replacen(
            "direction = [0.0, -1.0, 0.0]",
            "direction = [0.0, 1.0, 0.0]",
            1,
        ) + "\n[holds]\nhandle = \"part\"\n"
    });
    let peak = |s: &Value| s["peak_insertion_force_N"].as_f64().unwrap();
    assert!(
        (peak(&part) / peak(&tool) - 1.0).abs() < 1e-3,
        "{} {}",
        peak(&part),
        peak(&tool)
    );
}

/// Without friction the way out is the way in: the clip holds the tube with the force that pulled
/// it home. 2 %: steps of 20 um meet the peak at different places.
#[test]
fn without_friction_the_clip_lets_go_with_the_force_that_pulled_it_home() {
    let dir = tempfile::tempdir().unwrap();
    let summary = varied_clip(dir.path(), |text| {
        text.lines()
            .map(|l| {
                if l.starts_with("hold") {
                    "hold = 0.1\nretract = true\n".to_owned()
                } else {
                    format!("{l}\n")
                }
            })
            .collect()
    });
    let number = |key: &str| summary[key].as_f64().unwrap();
    let pull = number("snap_drop_N") - number("peak_insertion_force_N");
    let retention = number("retention_force_N");
    assert!(
        (retention / pull - 1.0).abs() < 0.02,
        "{retention} N out, {pull} N in"
    );
    // What the hand puts in comes back: nothing is stored in the clip at home.
    assert!(number("net_work_J").abs() < 0.01 * number("insertion_work_J"));
}

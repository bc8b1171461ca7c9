//! The part's own curve, its verdict and its limits, as a user runs them.

use std::fs;
use std::path::Path;

use serde_json::Value;

use snapin_tests::{Outcome, arg, csv, root, snapin};

/// The shipped clip with `[drive]` in place of its hand, and no coefficient of friction.
fn clip(folder: &Path, more: &str) -> (Outcome, Value) {
    let scenes = root().join("scenes");
    let text = fs::read_to_string(scenes.join("clip.toml")).unwrap();
    let drive = text.find("[drive]").unwrap();
    let mesh = scenes.join("clip.msh").display().to_string();
    let text = text[..drive].replace("\"clip.msh\"", &format!("{mesh:?}"));
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

const QUIET: &str = "[output]\nframes = 0\npictures = false\nvtu = false\nmcap = false\n";

/// Writes a scene into the folder and runs it.
fn run(folder: &Path, scene: &str) -> Value {
    let file = folder.join("scene.toml");
    fs::write(&file, scene).unwrap();
    let out = folder.join("out");
    let outcome = snapin(&["run", arg(&file), "--no-cache", "--out", arg(&out)]);
    assert_eq!(outcome.code, 0, "{}\n{}", outcome.out, outcome.err);
    serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

/// A quarter of a ring is widened by a pin: nothing but its planes of symmetry holds the pin in the middle, and a hand of
/// the default stiffness would give way sideways by the whole interference.
///
/// Expected: Lamé's ring under inner pressure in plane stress, u = p a / E ((b² + a²) / (b² - a²) + ν) = 0.05 mm, and
/// ½ p u over a quarter of its inner face, 17.97 mJ. 1 %: the round end of the pin rests above the ring's edge.
#[test]
fn a_quarter_between_planes_of_symmetry_is_widened_as_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = root().join("tests/data/drive/quarter-ring.msh");
    let scene = format!(
        "[part]\nmesh = {:?}\ncontact = \"inner\"\nfixed = [{{ group = \"symx\", components = [\"x\"] }}, \
         {{ group = \"symy\", components = [\"y\"] }}, {{ group = \"bottom\", components = [\"z\"] }}]\n\
         material = {{ young_modulus = 2.7e9, poisson_ratio = 0.35 }}\n\
         [tool]\nshape = \"capsule\"\nradius = 0.01005\nhalf_length = 0.02\nposition = [0, 0, 0.041]\n\
         [hand]\ndirection = [0, 0, -1]\nspeed = 0.1\ntravel = 0.026\n{QUIET}",
        mesh.display().to_string()
    );
    let summary = run(folder.path(), &scene);
    let (a, b, height, interference) = (0.01f64, 0.015f64, 0.01, 5e-5);
    let (e, nu) = (2.7e9, 0.35);
    let softness = a / e * ((b * b + a * a) / (b * b - a * a) + nu);
    let pressure = interference / softness;
    let quarter = 0.5 * std::f64::consts::PI * a * height;
    let expected = 0.5 * pressure * interference * quarter;
    near(&summary["curve"]["net_work_J"], expected, 0.01 * expected);
    assert_eq!(summary["curve"]["sideways_m"], 0.0);
    // The hand of the default stiffness beside it is told to have left the planes.
    assert!(warned(&summary, "hand-aside").contains("symx, symy"));
    let free = scene.replace("[hand]", "[drive]\nguide = \"free\"\n[hand]");
    let summary = run(folder.path(), &free);
    assert_eq!(summary["verdict"]["outcome"], "incomplete");
    assert!(warned(&summary, "left-symmetry-plane").contains("drive.guide = \"axis\""));
}

/// Text of a warning; empty without it.
fn warned(summary: &Value, id: &str) -> String {
    let warnings = summary["warnings"].as_array().unwrap();
    let found = warnings.iter().find(|warning| warning["id"] == id);
    found.map_or_else(String::new, |warning| {
        warning["text"].as_str().unwrap().to_owned()
    })
}

/// A slab of 2 mm goes into the hook's arm where nothing is named as contact: a node is 1 mm deep in it at most.
#[test]
fn a_tool_that_goes_through_what_is_no_contact_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = root().join("scenes/hook.msh").display().to_string();
    let scene = |height: f64| {
        format!(
            "units = \"mm-N-MPa\"\n[part]\nmesh = {mesh:?}\nfixed = \"fixed\"\ncontact = \"contact\"\n\
             material = {{ young_modulus = 1300.0, poisson_ratio = 0.42 }}\n\
             [tool]\nshape = \"box\"\nhalf_extents = [3, 1, 5]\nposition = [8, {height}, 3]\n\
             [drive]\ndirection = [0, -1, 0]\ntravel = 2.0\n{QUIET}"
        )
    };
    let summary = run(folder.path(), &scene(1.5));
    assert_eq!(summary["verdict"]["outcome"], "incomplete");
    let reasons = summary["verdict"]["reasons"].to_string();
    assert!(reasons.contains("up to 1.000 mm deep"), "{reasons}");
    // Beside the arm it goes through nothing.
    let summary = run(folder.path(), &scene(3.5));
    assert_eq!(summary["verdict"]["outcome"], "does not snap");
}

/// The hook's edge on a guide that gives way across the direction, as stiff as the arm is.
///
/// Expected: the arm (3 E I / L³ = b h³ E / 4 L³ = 1.95 N/mm) and the coupling's spring of 2 N/mm in series share the
/// undercut of 1 mm less the 0.02 mm of play, so that the body is pushed aside by 0.484 mm. 10 %, the handbook's claim.
#[test]
fn a_free_guide_gives_way_across_the_direction_as_far_as_its_spring_lets_it() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = root().join("scenes");
    let text = fs::read_to_string(scenes.join("hook.toml")).unwrap();
    let mesh = scenes.join("hook.msh").display().to_string();
    let head = text[..text.find("[drive]").unwrap()].replace("\"hook.msh\"", &format!("{mesh:?}"));
    let of_guide = |guide: &str| {
        let scene = format!(
            "{head}[drive]\ndirection = [-1, 0, 0]\ntravel = 7.5\nguide = \"{guide}\"\n\
             [coupling]\ntranslational_stiffness = 2.0\nrotational_stiffness = 1e6\n{QUIET}"
        );
        let summary = run(folder.path(), &scene);
        let number = |key: &str| summary["curve"][key].as_f64().unwrap();
        (number("sideways_m"), number("peak_insertion_force_N"))
    };
    let (still, along) = of_guide("axis");
    assert_eq!(still, 0.0);
    let (aside, free) = of_guide("free");
    let arm = 6.0 * 2.0f64.powi(3) * 1300.0 / (4.0 * 20f64.powi(3));
    let expected = 0.98e-3 * arm / (arm + 2.0);
    assert!((aside / expected - 1.0).abs() < 0.1, "{aside} {expected}");
    // The arm bends by half as much, and is pushed along half as hard; the ramp turns by less, too.
    assert!((0.4..0.55).contains(&(free / along)), "{free} {along}");
}

/// The same window over the same buckle, in coordinates that begin 3 m away: nothing that is felt or driven changes
/// but by the rounding of such coordinates.
#[test]
fn where_the_origin_of_a_file_lies_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = root().join("scenes");
    let text = fs::read_to_string(scenes.join("buckle.toml")).unwrap();
    let mesh = scenes.join("buckle.msh").display().to_string();
    let window = fs::read(scenes.join("window.stl")).unwrap();
    let number = |at: usize| f32::from_le_bytes(window[at..at + 4].try_into().unwrap());
    let at = |shift: [f64; 3]| {
        let mut stl = "solid window\n".to_owned();
        for triangle in 0..(window.len() - 84) / 50 {
            stl += "facet normal 0 0 0\nouter loop\n";
            for corner in 0..3 {
                let first = 84 + 50 * triangle + 12 * (corner + 1);
                let x: [f64; 3] =
                    std::array::from_fn(|c| f64::from(number(first + 4 * c)) + shift[c]);
                stl += &format!("vertex {} {} {}\n", x[0], x[1], x[2]);
            }
            stl += "endloop\nendfacet\n";
        }
        fs::write(folder.path().join("window.stl"), stl + "endsolid window\n").unwrap();
        let place = format!(
            "position = [{}, {}, {}]",
            -shift[0],
            25.0 - shift[1],
            3.0 - shift[2]
        );
        let scene = text
            .replace("\"buckle.msh\"", &format!("{mesh:?}"))
            .replace("position = [0.0, 25.0, 3.0]", &place);
        let hand = "[hand]\nspeed = 50.0\nretract = true\n";
        run(folder.path(), &format!("{scene}{hand}{QUIET}"));
        let column = |file: &str| {
            let columns = csv(&folder.path().join("out").join(file));
            let force = columns.into_iter().find(|c| c.0 == "force_N").unwrap();
            force.1
        };
        (column("force-travel.csv"), column("curve.csv"))
    };
    let here = at([0.0; 3]);
    let far = at([3000.0, -2000.0, 500.0]);
    for (here, far) in [(here.0, far.0), (here.1, far.1)] {
        let largest = here.iter().fold(0.0f64, |a, f| a.max(f.abs()));
        assert!(largest > 5.0 && here.len() == far.len());
        for (a, b) in here.iter().zip(&far) {
            assert!((a - b).abs() < 1e-6 * largest, "{a} {b}");
        }
    }
}

//! Contact at places that move with the tool (`accuracy.contact_at = "places"`), as a user runs it.

use std::path::Path;

use serde_json::Value;
use snapin_tests::{arg, csv, root, snapin};

/// Runs a scene; its summary.
fn run(folder: &Path, text: &str) -> Value {
    let file = folder.join("scene.toml");
    std::fs::write(&file, text).unwrap();
    let out = folder.join("out");
    let outcome = snapin(&["run", arg(&file), "--no-cache", "--out", arg(&out)]);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

/// The shipped clip's own curve, with order 4 inside, in steps of 20 µm.
fn clip(contact_at: &str) -> String {
    let scenes = root().join("scenes");
    let text = std::fs::read_to_string(scenes.join("clip.toml")).unwrap();
    let mesh = format!("{:?}", scenes.join("clip.msh"));
    let text = text[..text.find("[drive]").unwrap()].replace("\"clip.msh\"", &mesh);
    let text = text.replace("[part]", "[part]\ninterior_order = 4");
    format!(
        "{text}[drive]\ndirection = [0, -1, 0]\ntravel = 0.014\nstep = 2e-5\n\
         [accuracy]\ncontact_at = \"{contact_at}\"\n[output]\nframes = 0\n"
    )
}

/// Largest change of the slope of force over travel (N/mm) between first touch and seat, over steps of 20 µm.
fn roughness(folder: &Path) -> f64 {
    let columns = csv(&folder.join("out/curve.csv"));
    let column = |name: &str| &columns.iter().find(|column| column.0 == name).unwrap().1;
    // The way in, which comes first.
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (x, force) in column("travel_m").iter().zip(column("force_N")) {
        if points.last().is_none_or(|last| 1e3 * x > last.0) {
            points.push((1e3 * x, *force));
        }
    }
    let force_at = |x: f64| {
        let after = points
            .partition_point(|p| p.0 < x)
            .clamp(1, points.len() - 1);
        let ((x0, f0), (x1, f1)) = (points[after - 1], points[after]);
        f0 + (f1 - f0) * (x - x0) / (x1 - x0)
    };
    let forces: Vec<f64> = (0..600)
        .map(|k| force_at(1.4 + 0.02 * f64::from(k)))
        .collect();
    forces
        .windows(3)
        .map(|f| ((f[2] - f[1]) - (f[1] - f[0])).abs() / 0.02)
        .fold(0.0, f64::max)
}

/// Expected: 7.50 N, by contact places on exact arcs with three graded meshes (independent, ±0.3 %); its curve bends by
/// 0.44 N/mm over 20 µm at most. Work over the whole way is none, without friction.
#[test]
fn the_clips_force_is_right_between_its_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let at_nodes = run(folder.path(), &clip("nodes"));
    let rough_at_nodes = roughness(folder.path());
    let folder = tempfile::tempdir().unwrap();
    let at_places = run(folder.path(), &clip("places"));
    let rough = roughness(folder.path());
    let peak = |summary: &Value| summary["curve"]["snap"]["peak_force_N"].as_f64().unwrap();
    assert!(
        (peak(&at_places) / 7.50 - 1.0).abs() < 0.01,
        "{}",
        peak(&at_places)
    );
    assert!(
        (peak(&at_nodes) / 7.50 - 1.0).abs() > 0.03,
        "{}",
        peak(&at_nodes)
    );
    assert!(rough < 0.44, "{rough}");
    assert!(rough_at_nodes > 2.0, "{rough_at_nodes}");
    let work = &at_places["curve"];
    let (net, over) = (&work["net_work_J"], &work["insertion_work_J"]);
    assert!(
        net.as_f64().unwrap().abs() < 1e-4 * over.as_f64().unwrap(),
        "{work}"
    );
}

/// The edge of a lid, 0.5 mm round, over a hook meshed at 1.4 mm: contact at nodes alone gives 14.6 N, a fine mesh and the
/// beam formula 3.1 N. On so coarse a mesh places take most of that away, not all: 5.6 N.
#[test]
fn a_small_round_is_felt_between_nodes_far_apart() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = root().join("tests/data/contact/tapered-hook.msh");
    let text = format!(
        "[part]\nmesh = {mesh:?}\nfixed = \"fixed\"\ncontact = \"contact\"\n\
         material = {{ young_modulus = 1.815e9, poisson_ratio = 0.38 }}\n\
         [tool]\nshape = \"cylinder\"\nradius = 0.0005\nposition = [0.0255, 0.0038, 0.0005]\n\
         [drive]\ndirection = [-1, 0, 0]\ntravel = 0.0075\n\
         [accuracy]\ncontact_at = \"places\"\n[output]\nframes = 0\n"
    );
    let summary = run(folder.path(), &text);
    let peak = summary["curve"]["snap"]["peak_force_N"].as_f64().unwrap();
    assert!(peak > 3.1 && peak < 6.0, "{peak}");
}

//! Files as other programs write them give what their plain form gives.
//!
//! Source: scenes and files as users sent them (`tests/data/readers/README.md`). The numbers are those of each plain
//! file.

use std::path::{Path, PathBuf};

use serde_json::Value;
use snapin_tests::{Outcome, arg, root, snapin};

const QUIET: &str = "\n[output]\nframes = 1\npictures = false\nvtu = false\nmcap = false\n";

fn data(name: &str) -> PathBuf {
    root().join("tests/data/readers").join(name)
}

/// Runs a scene on a mesh, by its name under the data, and a tool.
fn run(mesh: &str, fixed: &str, tool: &str) -> (Outcome, Option<Value>) {
    let dir = tempfile::tempdir().unwrap();
    let text = format!(
        "[part]\nmesh = {:?}\nfixed = {fixed:?}\ncontact = \"contact\"\n\
         material = {{ young_modulus = 2700000000.0, poisson_ratio = 0.35 }}\n\
         [tool]\n{tool}\n[hand]\ndirection = [0, 0, -1]\nspeed = 0.02\ntravel = 0.001\n{QUIET}",
        arg(&data(mesh)),
    );
    let scene = dir.path().join("scene.toml");
    std::fs::write(&scene, text).unwrap();
    let out = dir.path().join("out");
    let outcome = snapin(&["run", arg(&scene), "--out", arg(&out), "--no-cache"]);
    let summary = std::fs::read(out.join("summary.json")).ok();
    (
        outcome,
        summary.map(|json| serde_json::from_slice(&json).unwrap()),
    )
}

/// N; the strongest push of a run that must end well.
fn peak((outcome, summary): (Outcome, Option<Value>)) -> f64 {
    let summary = summary.unwrap_or_else(|| panic!("{}\n{}", outcome.out, outcome.err));
    summary["peak_insertion_force_N"].as_f64().unwrap()
}

fn mesh_tool(file: &Path, position: &str) -> String {
    format!(
        "shape = \"mesh\"\nfile = {:?}\nposition = {position}",
        arg(file)
    )
}

fn sphere(radius: f64, position: &str) -> String {
    format!("shape = \"sphere\"\nradius = {radius}\nposition = {position}")
}

#[test]
fn stl_and_obj_of_any_spelling_give_the_plain_ones_force() {
    let position = "[0.015, 0.01, 0.0152]";
    let files = [
        "stl/plain.stl",
        "stl/no-name.stl",
        "stl/upper-case.stl",
        "stl/latin-1-name.stl",
        "stl/leading-space.stl",
        "stl/byte-order-mark.stl",
        "stl/end-space-solid.stl",
        "stl/binary-solid-line.stl",
        "obj/plain.obj",
        "obj/empty-material.obj",
        "obj/polyline.obj",
        "obj/continued-line.obj",
    ];
    for file in files {
        let ran = run("stl/m.msh", "fixed", &mesh_tool(&data(file), position));
        let peak = peak(ran);
        assert!((peak - 2.142).abs() < 0.001, "{file}: {peak} N");
    }
}

#[test]
fn corners_apart_by_a_bit_are_joined_and_that_is_told() {
    let tool = |file: &str, position: &str| mesh_tool(&data(file), position);
    let one_ulp = tool("rounding/one-ulp.stl", "[0.015, 0.01, 0.0152]");
    let ran = run("rounding/m.msh", "fixed", &one_ulp);
    let told = ran.0.err.clone() + &ran.0.out;
    assert!((peak(ran) - 2.142).abs() < 0.002);
    assert!(
        told.contains("corner points, apart by round-off, became one"),
        "{told}"
    );
    // Its origin is a corner, not the middle.
    let exact = tool("rounding/exact.stl", "[0.01, 0.006, 0.0052]");
    let ran = run("rounding/m.msh", "fixed", &exact);
    let told = ran.0.err.clone() + &ran.0.out;
    assert!((peak(ran) - 2.141).abs() < 0.002);
    assert!(!told.contains("became one"), "{told}");
}

#[test]
fn concave_polygon_leaves_its_notch_free_and_its_leg_hard() {
    for file in ["concave/polygons.obj", "concave/triangles.obj"] {
        let notch = run(
            "concave/m.msh",
            "fixed",
            &mesh_tool(&data(file), "[0.0, 0.0005, 0.0152]"),
        );
        assert_eq!(peak(notch), 0.0, "{file}");
        let leg = run(
            "concave/m.msh",
            "fixed",
            &(mesh_tool(&data(file), "[0.006, 0.0037, 0.0152]")
                + "\n[accuracy]\ntool_features = \"off\"\n[holds]\ngrip = [0, 0, 0]\n"),
        );
        // Held where the number was found: at the origin of the file.
        let leg = peak(leg);
        assert!((leg - 2.145).abs() < 0.001, "{file}: {leg} N");
    }
}

#[test]
fn msh_of_any_spelling_and_partitioned_gives_the_plain_ones_force() {
    let tool = sphere(0.005, "[0.01, 0.005, 0.0152]");
    for name in ["plain", "comments-first", "names-tabs", "names-two-spaces"] {
        let peak = peak(run(&format!("msh/{name}.msh"), "fixed", &tool));
        assert!((peak - 0.691).abs() < 0.001, "{name}: {peak} N");
    }
    let tool = sphere(0.02, "[0.02, 0.005, 0.0242]");
    for name in ["plain", "partitioned"] {
        let peak = peak(run(&format!("partitioned/{name}.msh"), "fixed", &tool));
        assert!((peak - 2.109).abs() < 0.001, "{name}: {peak} N");
    }
}

#[test]
fn curves_hold_a_part_and_points_are_found() {
    let tool = sphere(0.005, "[0.01, 0.005, 0.0152]");
    assert!(peak(run("msh/curve-group.msh", "rim", &tool)) > 0.1);
    assert!(peak(run("msh/curve-group.msh", "corners", &tool)) > 0.1);
}

#[test]
fn version_1_is_named_with_the_command_that_converts_it() {
    let tool = sphere(0.005, "[0.01, 0.005, 0.0152]");
    let (outcome, _) = run("msh/version-1.msh", "fixed", &tool);
    assert_eq!(outcome.code, 2);
    let command = "`gmsh version-1.msh -save -format msh41 -o version-1.msh`";
    assert!(
        outcome.err.contains("MSH version 1 is not read"),
        "{}",
        outcome.err
    );
    assert!(outcome.err.contains(command), "{}", outcome.err);
}

#[test]
fn an_open_tool_is_refused_in_the_files_coordinates() {
    let dir = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(data("stl/plain.stl")).unwrap();
    let first = text.find("facet").unwrap();
    let second = first + text[first..].find("endfacet").unwrap() + "endfacet".len();
    let open = dir.path().join("open.stl");
    std::fs::write(&open, [&text[..first], &text[second..]].concat()).unwrap();
    let (outcome, _) = run(
        "stl/m.msh",
        "fixed",
        &mesh_tool(&open, "[0, 0, 0.1]\nscale = 7.0"),
    );
    assert_eq!(outcome.code, 2);
    let told = &outcome.err;
    assert!(
        told.contains("(coordinates of the file) (3 open edges); close it"),
        "{told}"
    );
    // A corner of the box as the file has it, whatever the scale.
    let corner = text[first..]
        .lines()
        .find(|l| l.contains("vertex"))
        .unwrap();
    let x = corner
        .split_whitespace()
        .nth(1)
        .unwrap()
        .parse::<f64>()
        .unwrap()
        .abs();
    assert!(told.contains(&format!("{x}")), "{told}");
}

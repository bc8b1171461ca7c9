//! Small cases whose files are damaged at random: read or refused, never a panic, never without an end.
//!
//! A failure names its seed; `SNAPIN_SEEDS=100000 cargo test -p snapin-tests damaged` tries as many.

use std::fs;
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use serde_json::{Value, json};
use snapin_tests::brick::{Brick, Random, Takes};
use snapin_tests::{Outcome, arg, root, snapin};

use super::copy;
use crate::random_scenes::seeds;

/// s, of one small case. They take milliseconds; this is for a machine with other work.
const LONGEST: Duration = Duration::from_secs(120);

const STATIC_TOML: &str = "\
kind = \"static\"
mesh = \"mesh.msh\"
order = 1
material = { E = 2.3e9, nu = 0.35 }
fixed = { group = \"left\", components = [\"x\", \"y\", \"z\"] }
load = [{ group = \"top\", force = [0.0, 0.0, -1.0] }, { group = \"right\", pressure = 1e3 }]
";

const CONTACT_TOML: &str = "\
kind = \"contact\"
mesh = \"mesh.msh\"
units = \"SI\"
contact_iterations = \"converged\"
[material]
E = 2.3e9
nu = 0.35
[fixed]
group = \"left\"
[contact]
group = \"top\"
friction = 0.0
[tool]
shape = \"sphere\"
radius = 0.005
[[pose]]
centre = [0.03, 0.005, 0.0148]
[handbook]
undercut = 1e-3
";

/// A wall that comes down on the bar, slides and turns.
const FRICTION_TOML: &str = "\
kind = \"contact-friction\"
mesh = \"mesh.msh\"
contact_iterations = \"converged\"
[material]
E = 2.3e9
nu = 0.35
[fixed]
group = \"left\"
[contact]
group = \"top\"
friction = 0.3
[tool]
shape = \"half-space\"
[path]
substeps = [1, 2]
[[pose]]
point = [0.02, 0.005, 0.0101]
normal = [0.0, 0.0, -1.0]
[[pose]]
point = [0.02, 0.005, 0.0099]
normal = [0.0, 0.0, -1.0]
[[pose]]
point = [0.0201, 0.005, 0.0099]
normal = [0.0, 0.0, -1.0]
turn = [0.0, 0.0, 0.01]
";

/// A bar held at one end, 40 x 10 x 10 mm.
fn mesh() -> String {
    let at = |axis: usize, place: f64| {
        move |c: &[[f64; 3]]| c.iter().all(|x| (x[axis] - place).abs() < 1e-9)
    };
    let (left, right, top) = (at(0, 0.0), at(0, 0.04), at(2, 0.01));
    let faces: [Takes<'_>; 3] = [("left", &left), ("right", &right), ("top", &top)];
    let brick = Brick {
        cells: [3, 1, 1],
        size: [0.04, 0.01, 0.01],
        is_hole: &|_| false,
    };
    brick.msh(&faces, &[])
}

fn static_expected() -> Value {
    let block = vec![vec![1e-6; 6]; 6];
    json!({
        "mesh": {"nodes": 16, "elements": 18, "order": 1, "geometry": "straight"},
        "quantities": [
            {"name": "displacement", "value": {"4": [0, 0, -1e-6], "16": [0, 1e-7, -1e-6]}, "tolerance": {"rel": 0.5},
             "quadrature": "degree-3"},
            {"name": "work_mean_displacement", "value": 1e-6, "tolerance": {"rel": 0.5, "abs": 1e-9}},
            {"name": "strain_energy", "value": 1e-6, "tolerance": {"rel": 0.5}, "quadrature": "converged"},
            {"name": "stress_at_point", "point_m": [0.02, 0.005, 0.005], "tolerance": {"rel": 0.5},
             "value": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]},
            {"name": "compliance", "nodes": [4, 16], "value": block, "tolerance": {"rel": 0.5}},
        ],
    })
}

fn contact_expected() -> Value {
    json!({
        "quantities": [
            {"name": "contact.pose1", "tolerance": {"rel": 0.5}, "value": {
                "force_on_tool_N": [0, 0, 1.0], "torque_on_tool_Nm": [0, 0, 0], "max_displacement_m": 1e-5,
                "sample_displacement_m": {"12": [0, 0, -1e-5]}, "max_principal_strain": 1e-3,
                "one_pass_planes_at_rest": {"force_on_tool_N": [0, 0, 1], "active_count": 1}}},
            {"name": "lcp.pose1", "tolerance": {"rel": 0.5}, "value": {
                "nodes": [11, 15], "q": [-1e-5, 1e-5], "M": [[1e-5, 1e-6], [1e-6, 1e-5]], "solution_z": [1, 0]}},
            {"name": "insertion.linear", "file": "path.csv", "tolerance": {"rel": 0.5}, "value": {
                "peak_force_N": 1, "axis_y_at_peak_m": 0.005, "min_force_N": 0}},
            {"name": "catch_edge_stiffness", "edge_nodes": [4, 8], "edge_weights": [0.5, 0.5], "value": 2000,
             "tolerance": {"rel": 0.5}},
            {"name": "deflection_force_fe", "value": 2, "tolerance": {"rel": 0.5}},
        ],
    })
}

fn friction_expected() -> Value {
    let vectors = [[0, 0, 0], [0, 0, 9], [1, 0, 9]];
    json!({
        "quantities": [
            {"name": "path.degree-2.substeps2", "tolerance": {"rel": 0.5}, "value": {
                "force_on_tool_N": vectors, "torque_on_tool_Nm": vectors, "dissipated_J": [0, 0, 1e-4],
                "elastic_energy_J": [0, 1e-3, 1e-3], "work_total_J": [0, 1e-3, 1e-3], "normal_force_sum_N": [0, 9, 9]}},
            {"name": "summary.substeps1", "tolerance": {"rel": 0.5}, "value": {
                "axis": "z", "peak_force_N": 9, "peak_pose": 2, "peak_at_m": 0.0099, "dissipated_total_J": 1e-4}},
            {"name": "state.pose3", "tolerance": {"rel": 0.5}, "value": {
                "force_on_tool_N": [1, 0, 9], "sample_displacement_m": {"12": [0, 0, -1e-5]}}},
            {"name": "frictionless", "tolerance": {"rel": 0.5}, "value": {"axis": "z", "peak_force_N": 9}},
            {"name": "repeated", "informative": true, "value": {"force_on_tool_N": vectors}},
            {"name": "problem.pose2", "tolerance": {"rel": 0.5}, "value": {
                "nodes": [11], "friction": 0.3, "q": [-1e-5, 0, 0], "solution_r": [1, 0, 0], "y": [0, 0, 0],
                "M": [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]]}},
        ],
    })
}

/// A NumPy array of the header's `fields` and these bytes.
fn npy(fields: &str, payload: Vec<u8>) -> Vec<u8> {
    let header = format!("{{{fields}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(payload);
    bytes
}

/// Two steps of two rows, M = 1, z = (1, 0).
fn write_sequence(dir: &Path) {
    fs::create_dir_all(dir).unwrap();
    let floats = |shape: &str, numbers: &[f64]| {
        let fields = format!("'descr': '<f8', 'fortran_order': False, 'shape': {shape}");
        npy(
            &fields,
            numbers.iter().flat_map(|x| x.to_le_bytes()).collect(),
        )
    };
    let problem = json!({"name": "two steps", "unique": true, "steps": [{"m": 2}, {"m": 2}]});
    fs::write(dir.join("problem.json"), problem.to_string()).unwrap();
    for step in ["00", "01"] {
        let files = [
            ("M", floats("(2, 2)", &[1.0, 0.0, 0.0, 1.0])),
            ("q", floats("(2,)", &[-1.0, 1.0])),
            ("z", floats("(2,)", &[1.0, 0.0])),
            (
                "ids",
                npy(
                    "'descr': '<i8', 'fortran_order': False, 'shape': (2,)",
                    [7i64, 9].iter().flat_map(|x| x.to_le_bytes()).collect(),
                ),
            ),
        ];
        for (name, bytes) in files {
            fs::write(dir.join(format!("{name}-{step}.npy")), bytes).unwrap();
        }
    }
}

/// One case of each sort, all of which are computed.
fn write_cases(dir: &Path) {
    for (name, toml, expected) in [
        ("static", STATIC_TOML, static_expected()),
        ("contact", CONTACT_TOML, contact_expected()),
        ("friction", FRICTION_TOML, friction_expected()),
    ] {
        let case = dir.join(name);
        fs::create_dir_all(&case).unwrap();
        fs::write(case.join("case.toml"), toml).unwrap();
        fs::write(case.join("expected.json"), expected.to_string()).unwrap();
        fs::write(case.join("mesh.msh"), mesh()).unwrap();
        fs::write(case.join("path.csv"), "axis_y_m,force\n0.004,0\n0.005,1\n").unwrap();
    }
    copy(&root().join("tests/cases/lcp/fathi-16"), &dir.join("lcp"));
    write_sequence(&dir.join("sequence"));
}

/// Damages bytes: one is changed, some are lost, doubled or put elsewhere, a number becomes an extreme one.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    const WORDS: [&str; 24] = [
        "0",
        "-1",
        "1e999",
        "1e308",
        "-1e-308",
        "NaN",
        "nan",
        "inf",
        "4294967296",
        "18446744073709551616",
        "null",
        "{}",
        "[]",
        "[[",
        "\"",
        "true",
        "'shape': (",
        "999999999,",
        "degree-99",
        "False",
        "'<f4'",
        "1e-300",
        "\\u0000",
        "\u{e9}",
    ];
    let at = random.below(bytes.len().max(1)).min(bytes.len());
    let most = if random.chance(0.3) { 200 } else { 8 };
    let end = (at + 1 + random.below(most)).min(bytes.len());
    match random.below(7) {
        0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
        1 if at < bytes.len() => bytes[at] = random.bits() as u8,
        2 => drop(bytes.drain(at..end)),
        3 => {
            let part = bytes[at..end].to_vec();
            let to = random.below(bytes.len().max(1)).min(bytes.len());
            bytes.splice(to..to, part);
        }
        4 => bytes.truncate(at),
        5 => {
            let word = random.pick(&WORDS);
            let n = if random.chance(0.1) { 3000 } else { 1 };
            bytes.splice(at..at, word.repeat(n).into_bytes());
        }
        _ => {
            let word = random.pick(&WORDS);
            replace_number(bytes, word, random);
        }
    }
}

/// Puts a word in the place of one of the numbers.
fn replace_number(bytes: &mut Vec<u8>, word: &str, random: &mut Random) {
    let is_part = |b: &u8| b.is_ascii_digit() || b"+-.e".contains(b);
    let starts: Vec<usize> = (0..bytes.len())
        .filter(|k| bytes[*k].is_ascii_digit() && (*k == 0 || !is_part(&bytes[k - 1])))
        .collect();
    if starts.is_empty() {
        return;
    }
    let start = random.pick(&starts);
    let length = bytes[start..].iter().take_while(|b| is_part(b)).count();
    bytes.splice(start..start + length, word.bytes());
}

/// Runs the program on a thread, so that one without an end is found out.
fn verify_within(dir: &Path, seed: u64) -> Outcome {
    let (send, receive) = mpsc::channel();
    let path = dir.to_path_buf();
    std::thread::spawn(move || {
        // Nobody is left to listen once it took too long.
        let _ = send.send(snapin(&["verify", arg(&path), "--json"]));
    });
    receive
        .recv_timeout(LONGEST)
        .unwrap_or_else(|_| panic!("seed {seed}: not done after {LONGEST:?}"))
}

#[test]
fn cases_that_are_whole_are_computed() {
    let dir = tempfile::tempdir().unwrap();
    write_cases(dir.path());
    let outcome = verify_within(dir.path(), 0);
    assert!(outcome.code < 2, "{}\n{}", outcome.out, outcome.err);
    let results: Value = serde_json::from_str(&outcome.out).unwrap();
    for case in results["cases"].as_array().unwrap() {
        assert!(
            case["status"] == "ok" || case["status"] == "out of tolerance",
            "{case}"
        );
        assert!(
            case["quantities"]
                .as_array()
                .unwrap()
                .iter()
                .all(|q| !q["computed"].is_null()),
            "{case}"
        );
    }
}

#[test]
fn damaged_cases_are_read_or_refused() {
    let dir = tempfile::tempdir().unwrap();
    let whole = tempfile::tempdir().unwrap();
    write_cases(whole.path());
    let cases = ["static", "contact", "friction", "lcp", "sequence"];
    for seed in seeds(600) {
        let mut random = Random::new(seed);
        let name = random.pick(&cases);
        let case = dir.path().join(format!("case-{seed}"));
        copy(&whole.path().join(name), &case);
        let mut files: Vec<_> = fs::read_dir(&case)
            .unwrap()
            .map(|e| e.unwrap().path())
            .collect();
        files.sort();
        let file = &files[random.below(files.len())];
        let mut bytes = fs::read(file).unwrap();
        for _ in 0..1 + random.below(3) {
            damage(&mut bytes, &mut random);
        }
        fs::write(file, bytes).unwrap();
        let outcome = verify_within(&case, seed);
        let told = format!(
            "seed {seed}, {}: {}\n{}",
            file.display(),
            outcome.out,
            outcome.err
        );
        assert!(outcome.code < 2, "{told}");
        let results: Value =
            serde_json::from_str(&outcome.out).unwrap_or_else(|e| panic!("{e}: {told}"));
        let result = &results["cases"][0];
        let has_words = result["message"].as_str().is_some_and(|m| !m.is_empty());
        let is_computed = result["quantities"]
            .as_array()
            .is_some_and(|q| !q.is_empty());
        assert!(has_words || is_computed, "{told}");
        fs::remove_dir_all(&case).unwrap();
    }
}

//! Reference cases with results of independent programs (tests/cases/README.md).
//!
//! Tolerances are those of the cases; what is compared is unique: resultants, displacements,
//! compliance, certificates, never the set of active nodes.

use serde_json::Value;
use snapin_tests::{arg, root, snapin};

#[test]
fn every_case_is_within_its_tolerance() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("computed.json");
    let result = snapin(&[
        "verify",
        arg(&root().join("tests/cases")),
        "--out",
        arg(&out),
    ]);
    assert_eq!(result.code, 0, "{}\n{}", result.out, result.err);

    let computed: Value = serde_json::from_str(&std::fs::read_to_string(out).unwrap()).unwrap();
    let cases = computed["cases"].as_array().unwrap();
    let folders = [
        "patch-tet10",
        "cantilever-tet10-nu030",
        "clip-coarse",
        "clip-coarse-friction-reversal",
        "hard-redundant-friction",
        "error-no-fixed",
        "lcp/fathi-16",
    ];
    for name in folders {
        assert!(
            cases
                .iter()
                .any(|c| c["case"] == name && c["status"] == "ok"),
            "{name}"
        );
    }
    // The whole expected value is there in its shape, the single pass of the paper included.
    let clip = cases.iter().find(|c| c["case"] == "clip-coarse").unwrap();
    let pose = clip["quantities"]
        .as_array()
        .unwrap()
        .iter()
        .find(|q| q["name"] == "contact.pose1.points-4");
    let computed = &pose.unwrap()["computed"];
    for key in [
        "force_on_tool_N",
        "torque_on_tool_Nm",
        "sample_displacement_m",
        "one_pass_planes_at_rest",
    ] {
        assert!(!computed[key].is_null(), "{key}");
    }
}

#[test]
fn a_wrong_expectation_fails_with_exit_code_1() {
    let dir = tempfile::tempdir().unwrap();
    let case = dir.path().join("wrong");
    std::fs::create_dir(&case).unwrap();
    let source = root().join("tests/cases/cantilever-tet10-nu030");
    for file in ["case.toml", "mesh.msh"] {
        std::fs::copy(source.join(file), case.join(file)).unwrap();
    }
    let text = std::fs::read_to_string(source.join("expected.json")).unwrap();
    let mut expected: Value = serde_json::from_str(&text).unwrap();
    for quantity in expected["quantities"].as_array_mut().unwrap() {
        if quantity["name"] == "strain_energy" {
            quantity["value"] = (quantity["value"].as_f64().unwrap() * (1.0 + 1e-6)).into();
        }
    }
    std::fs::write(case.join("expected.json"), expected.to_string()).unwrap();
    let result = snapin(&["verify", arg(dir.path())]);
    assert_eq!(result.code, 1, "{}", result.out);
    assert!(result.out.contains("FAIL strain_energy"), "{}", result.out);
}

/// An answer that is not unique is given as context: whatever it is, it is told, and must be finite.
#[test]
fn a_path_of_which_all_is_informative_is_told_with_its_error() {
    let dir = tempfile::tempdir().unwrap();
    let source = root().join("tests/cases/hard-redundant-friction");
    for file in ["case.toml", "mesh.msh"] {
        std::fs::copy(source.join(file), dir.path().join(file)).unwrap();
    }
    let text = std::fs::read_to_string(source.join("expected.json")).unwrap();
    let mut expected: Value = serde_json::from_str(&text).unwrap();
    for quantity in expected["quantities"].as_array_mut().unwrap() {
        quantity["informative"] = true.into();
        if quantity["name"] == "summary.substeps1" {
            quantity["value"]["peak_force_N"] = 5.0.into();
        }
    }
    std::fs::write(dir.path().join("expected.json"), expected.to_string()).unwrap();
    let result = snapin(&["verify", arg(dir.path())]);
    assert_eq!(result.code, 0, "{}", result.out);
    for words in [
        "all quantities are informative",
        "told summary.substeps1",
        "error 4.9e-1",
    ] {
        assert!(result.out.contains(words), "{words}: {}", result.out);
    }
}

/// The polygonal form of friction, a problem that the solver is not made for.
#[test]
fn a_problem_with_an_unsymmetric_matrix_is_not_supported_and_says_why() {
    let case = root().join("crates/contact/tests/data/lcp/friction-4x4");
    let result = snapin(&["verify", arg(&case)]);
    assert_eq!(result.code, 1);
    for words in [
        "friction-4x4: not supported",
        "needs a symmetric matrix",
        "on its cone",
    ] {
        assert!(result.out.contains(words), "{words}: {}", result.out);
    }
}

#[test]
fn a_case_that_cannot_be_run_is_reported_and_fails() {
    let dir = tempfile::tempdir().unwrap();
    for (name, toml) in [
        ("broken", "kind = \"static\"\nmesh = "),
        ("unknown", "kind = \"magic\"\n"),
    ] {
        let case = dir.path().join(name);
        std::fs::create_dir(&case).unwrap();
        std::fs::write(case.join("case.toml"), toml).unwrap();
    }
    let result = snapin(&["verify", arg(dir.path())]);
    assert_eq!(result.code, 1);
    assert!(
        result.out.contains("broken: error") && result.out.contains("unknown: error"),
        "{}",
        result.out
    );
    let empty = tempfile::tempdir().unwrap();
    assert_eq!(snapin(&["verify", arg(empty.path())]).code, 2);
}

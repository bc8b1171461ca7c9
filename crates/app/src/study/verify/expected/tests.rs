use serde_json::json;

use super::*;

/// A file with one quantity, read as a case of this kind.
fn outcome(kind: Kind, file: &Value) -> Result<Value, Failure> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("expected.json");
    std::fs::write(&path, file.to_string()).unwrap();
    read(&path, kind)
}

fn message(kind: Kind, file: &Value) -> String {
    match outcome(kind, file) {
        Ok(_) => "accepted".to_owned(),
        Err(Failure::Error(message) | Failure::NotSupported(message) | Failure::Fault(message)) => {
            message
        }
    }
}

fn energy() -> Value {
    json!({"name": "strain_energy", "value": 3.4, "tolerance": {"rel": 1e-6}})
}

fn with(key: &str, value: Value) -> Value {
    let mut quantity = energy();
    quantity[key] = value;
    json!({"quantities": [quantity]})
}

#[test]
fn a_case_that_compares_nothing_is_refused() {
    let cases = [
        (json!({}), "quantities is missing"),
        (
            json!({"quantites": [energy()]}),
            "unknown key \"quantites\": the nearest is `quantities`",
        ),
        (json!({"quantities": []}), "quantities has no entry"),
        (json!({"quantities": {}}), "must be a list"),
        (
            with("informative", json!(true)),
            "all quantities are informative",
        ),
        (
            with("value", json!({})),
            "quantities[0].value: an object of 0 keys must be a number",
        ),
        (with("value", json!(null)), "value is missing"),
        (
            with("tolerance", json!(null)),
            "quantities[0].tolerance: null must be an object",
        ),
        (with("tolerance", json!({})), "needs rel or abs"),
        (
            with("name", json!("displacement")),
            "quantities[0].value: 3.4 must be an object with a value",
        ),
        (
            json!({"quantities": [{"name": "displacement", "value": {}, "tolerance": {"rel": 0.1}}]}),
            "value for one node",
        ),
    ];
    for (file, words) in cases {
        let message = message(Kind::Patch, &file);
        assert!(message.contains(words), "{words}: {message}");
        assert!(message.contains("expected.json: "), "{message}");
    }
}

#[test]
fn unknown_keys_are_named_with_the_nearest() {
    let cases = [
        (
            with("tolerence", json!({})),
            "quantities[0]: unknown key \"tolerence\": the nearest is `tolerance`",
        ),
        (with("vlaue", json!(1)), "the nearest is `value`"),
        (
            with("quadratur", json!("points-4")),
            "the nearest is `quadrature`",
        ),
        (
            with("tolerance", json!({"relative": 1e-6})),
            "quantities[0].tolerance: unknown key \"relative\"",
        ),
        (
            with("name", json!("strain_enrgy")),
            "the nearest is `strain_energy`",
        ),
        (
            json!({"mesh": {"node": 3}, "quantities": [energy()]}),
            "mesh: unknown key \"node\": the nearest is `nodes`",
        ),
    ];
    for (file, words) in cases {
        let message = message(Kind::Static, &file);
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[test]
fn numbers_out_of_their_range_are_named_with_it() {
    let cases = [
        (
            with("quadrature", json!("degree-4294967295")),
            "a number from 1 to 40",
        ),
        (
            with("quadrature", json!("degree-0")),
            "a number from 1 to 40",
        ),
        (
            with("quadrature", json!("degree--3")),
            "a number from 1 to 40",
        ),
        (
            with("tolerance", json!({"rel": 0.0})),
            "tolerance.rel: 0.0 must be a number above 0 and below 1",
        ),
        (
            with("tolerance", json!({"rel": -1e-6})),
            "above 0 and below 1",
        ),
        (
            with("tolerance", json!({"rel": 1e300})),
            "above 0 and below 1",
        ),
        (with("tolerance", json!({"abs": -1})), "above zero"),
        (
            with("tolerance", json!({"abs": 4})),
            "not below the largest expected number, 3.4e0",
        ),
        (
            with("agreement_rel", json!(-1)),
            "agreement_rel: -1 must be",
        ),
        (
            json!({"mesh": {"order": 300}, "quantities": [energy()]}),
            "mesh.order: 300 must be a whole number from 1 to 3",
        ),
        (
            json!({"mesh": {"nodes": -3}, "quantities": [energy()]}),
            "mesh.nodes: -3 must be",
        ),
    ];
    for (file, words) in cases {
        let message = message(Kind::Static, &file);
        assert!(message.contains(words), "{words}: {message}");
    }
    assert!(outcome(Kind::Static, &with("quadrature", json!("degree-40"))).is_ok());
}

#[test]
fn lengths_that_do_not_agree_are_named_both() {
    let quantity = |rest: Value| {
        let mut quantity = rest;
        quantity["tolerance"] = json!({"rel": 1e-6});
        json!({"quantities": [quantity]})
    };
    let cases = [
        (
            json!({"name": "compliance", "nodes": [4], "value": [[1, 0, 0], [0, 1, 0]]}),
            "has 2 rows, 3 are wanted (three times the 1 of",
        ),
        (
            json!({"name": "compliance", "nodes": [4], "value": [[1, 0, 0], [0, 1], [0, 0, 1]]}),
            "value[1]: has 2 entries, 3 are wanted",
        ),
        (
            json!({"name": "compliance", "value": [[1]]}),
            "nodes is missing",
        ),
        (
            json!({"name": "lcp.pose1", "value": {"nodes": [1, 2], "q": [1, 2, 3]}}),
            "value.q: has 3 entries, quantities[0].value.nodes has 2",
        ),
        (
            json!({"name": "lcp.pose1", "value": {"nodes": [1, 2], "M": [[1, 2]]}}),
            "value.M: has 1 rows, 2 are wanted",
        ),
        (
            json!({"name": "lcp.pose1", "value": {"nodes": [1, 2]}}),
            "none of its keys is compared",
        ),
        (
            json!({"name": "contact.pose1", "value": {"active_count": 2}}),
            "none of its keys is compared",
        ),
        (
            json!({"name": "contact.pose1", "value": {"forc_on_tool_N": [1, 2, 3]}}),
            "the nearest is `force_on_tool_N`",
        ),
        (
            json!({"name": "catch_edge_stiffness", "value": 1, "edge_nodes": [1, 2], "edge_weights": [1]}),
            "edge_weights: has 1 entries, quantities[0].edge_nodes has 2",
        ),
        (
            json!({"name": "catch_edge_stiffness", "value": 1, "edge_nodes": [1, 2], "edge_weights": [1, -1]}),
            "their sum is 0e0",
        ),
        (
            json!({"name": "insertion.linear", "value": {"peak_force_N": 1}}),
            "file is missing",
        ),
    ];
    for (rest, words) in cases {
        let message = message(Kind::Contact, &quantity(rest));
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// Of paths with friction: keys, names and lengths, also where a quantity is only told.
#[test]
fn quantities_of_a_path_with_friction_are_checked() {
    let problem = json!({"nodes": [7], "friction": 0.3, "q": [-1e-5, 0, 0], "solution_r": [1, 0, 0],
        "M": [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]]});
    let but = |key: &str, value: Value| {
        let mut problem = problem.clone();
        problem[key] = value;
        problem
    };
    let cases = [
        (
            "problem.pose2",
            but("q", json!([1, 2])),
            "value.q: has 2 entries, 3 are wanted",
        ),
        (
            "problem.pose2",
            but("M", json!([[1]])),
            "value.M: has 1 rows, 3 are wanted",
        ),
        (
            "problem.pose2",
            but("friction", json!(-0.1)),
            "friction: -0.1 must be a number, zero or above",
        ),
        (
            "problem.pose2",
            json!({"nodes": [7]}),
            "friction is missing",
        ),
        (
            "path.substeps1",
            json!({"forces_on_tool_N": []}),
            "the nearest is `force_on_tool_N`",
        ),
        (
            "path.substeps1",
            json!({"sticking": [1]}),
            "none of its keys is compared",
        ),
        (
            "path.substeps1",
            json!({"dissipated_J": []}),
            "a list of one entry or more",
        ),
        (
            "path.points-4.substeps1",
            json!({"force_on_tool_N": [1, 2]}),
            "[0]: 1 must be a list of 3",
        ),
        (
            "summary.substeps1",
            json!({"axis": "r"}),
            "must be one of \"x\", \"y\", \"z\"",
        ),
        (
            "summary.substeps1",
            json!({"peak_pose": 0}),
            "peak_pose: 0 must be a whole number from 1",
        ),
        (
            "frictionless",
            json!({"dissipated_total_J": 0}),
            "none of its keys is compared",
        ),
        (
            "state.points-5.pose1",
            json!({}),
            "quantity \"state.points-5.pose1\" in a case of this kind",
        ),
        (
            "paths.substeps1",
            json!({}),
            "the nearest is `path.substeps1`",
        ),
    ];
    for (name, value, words) in cases {
        let quantity = json!({"name": name, "value": value, "tolerance": {"rel": 1e-6}});
        let file = json!({"quantities": [quantity]});
        let message = message(Kind::ContactFriction, &file);
        assert!(message.contains(words), "{words}: {message}");
    }
    let told = |name: &str, value: &Value| {
        let quantity = json!({"name": name, "value": value, "informative": true});
        outcome(Kind::ContactFriction, &json!({"quantities": [quantity]}))
    };
    assert!(
        told("problem.pose2", &problem).is_ok(),
        "no tolerance is wanted"
    );
    assert!(told("problem.pose2", &but("M", json!([[1]]))).is_err());
    assert!(told("handbook", &json!({})).is_err(), "nothing is computed");
}

#[test]
fn a_refusal_that_need_not_name_anything_is_refused() {
    for (file, words) in [
        (json!({}), "expected_error.must_name is missing"),
        (
            json!({"expected_error": {"must_name": []}}),
            "must be a list of one entry or more",
        ),
        (
            json!({"expected_error": {"must_name": ["fixed or "]}}),
            "has nothing to name",
        ),
        (
            json!({"expected_error": {"must_nam": ["fixed"]}}),
            "the nearest is `must_name`",
        ),
    ] {
        let message = message(Kind::Error, &file);
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// Every key that a case may have is in the document, so that a refusal can be looked up.
#[test]
fn every_key_is_in_the_document() {
    fn keys(shape: &Shape, all: &mut Vec<&'static str>) {
        match shape {
            Shape::Object(list) => {
                for (key, shape) in *list {
                    all.push(key);
                    keys(shape, all);
                }
            }
            Shape::List(entry) | Shape::Exactly(_, entry) | Shape::ByNode(entry) => {
                keys(entry, all)
            }
            _ => {}
        }
    }
    let document = include_str!("../../../../../../docs/reference-cases.md");
    let mut all = Vec::new();
    let shapes = [
        &FILE,
        &QUANTITY,
        &POSE_VALUE,
        &LCP_VALUE,
        &INSERTION_VALUE,
        &PATH_VALUE,
        &SUMMARY_VALUE,
        &STATE_VALUE,
        &PROBLEM_VALUE,
        &crate::study::verify::lcp_case::PROBLEM,
    ];
    for shape in shapes {
        keys(shape, &mut all);
    }
    for key in all {
        assert!(
            document.contains(&format!("`{key}`")),
            "docs/reference-cases.md lacks `{key}`"
        );
    }
}

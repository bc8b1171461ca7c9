//! `snapin accuracy` from the command line: what it writes, that it goes on where it was, and what it
//! refuses. Only cheap choices are run; nothing here looks at a time.

use std::fs;
use std::path::Path;

use serde_json::Value;
use snapin_tests::{Outcome, arg, root, snapin};

fn accuracy(out: &Path, more: &[&str]) -> Outcome {
    let scene = root().join("scenes/clip.toml");
    let mut args = vec![
        "accuracy",
        arg(&scene),
        "--out",
        arg(out),
        "--quick",
        "--no-cache",
    ];
    args.extend(more);
    snapin(&args)
}

fn json(out: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join("accuracy.json")).unwrap()).unwrap()
}

#[test]
fn the_study_of_passes_is_whole_resumes_and_refuses_what_is_not_its_own() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("study");
    let file = dir.path().join("reference.json");

    // A reference of the scene's own mesh keeps the test short: made by a first, tiny study.
    let first = accuracy(&out, &["--axes", "scalar", "--save-reference", arg(&file)]);
    assert_eq!(first.code, 0, "{}", first.err);
    let study = json(&out);
    let bar = study["reference"]["bar"].as_f64().unwrap();
    assert!(
        bar > 0.0 && bar < 0.2,
        "Richardson's bar of a reasonable mesh: {bar}"
    );
    for name in [
        "accuracy.csv",
        "error-over-time.svg",
        "solver-error-over-time.svg",
        "force-curves.svg",
    ] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for text in [
        "What accuracy costs in time",
        "Under 1 ms",
        "numbers of the drawn shape",
    ] {
        assert!(page.to_lowercase().contains(&text.to_lowercase()), "{text}");
    }
    // What is drawn is no part of a step: whatever the clock says, no such setting is recommended.
    let sentence = study["sentence"].as_str().unwrap();
    assert!(!sentence.contains("scalar"), "{sentence}");
    // On any adapter, one in software too; where there is none, the study says what was looked for.
    match first.out.contains("on the GPU  ") || first.out.contains("on the GPU, software") {
        true => {
            assert!(first.out.contains("f16 on the GPU"), "{}", first.out);
            assert!(first.out.contains("\nthe GPU: "), "{}", first.out);
        }
        false => assert!(
            first
                .out
                .contains("multiply on the GPU: no choice, looked for adapters of "),
            "{}",
            first.out
        ),
    }

    let passes = accuracy(&out, &["--axes", "planes", "--reference", arg(&file)]);
    assert_eq!(passes.code, 0, "{}", passes.err);
    assert!(
        passes.err.contains("were finished before"),
        "{}",
        passes.err
    );
    let study = json(&out);
    let rows = study["rows"].as_array().unwrap();
    let error = |label: &str, key: &str| {
        let row = rows.iter().find(|r| r["setting"] == label).unwrap();
        row["errors"][key].as_f64().unwrap()
    };
    // More passes, less error of the solver; converged planes are exact but for their tolerance of a
    // nanometre; one pass is within a hundredth at this pace.
    let solver: Vec<f64> = ["1 pass", "2 passes", "3 passes", "5 passes", "converged"]
        .map(|label| error(label, "solver_l2"))
        .to_vec();
    assert!(solver.is_sorted_by(|a, b| a > b), "{solver:?}");
    assert!(solver[0] < 1e-2 && solver[4] < 1e-6, "{solver:?}");
    // The mesh's own error is the same for all of them.
    let wrench = error("converged", "wrench_l2");
    assert!(wrench > solver[0], "{wrench}");
    let csv = fs::read_to_string(out.join("accuracy.csv")).unwrap();
    let columns = csv.lines().next().unwrap().split(',').count();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    for line in csv.lines() {
        assert_eq!(line.split(',').count(), columns, "{line}");
    }

    let hook = root().join("scenes/hook.toml");
    let other = dir.path().join("hook");
    let args = [
        "accuracy",
        arg(&hook),
        "--out",
        arg(&other),
        "--reference",
        arg(&file),
    ];
    let refused = snapin(&args);
    assert_eq!(refused.code, 2);
    assert!(
        refused.err.contains("is the reference of another scene"),
        "{}",
        refused.err
    );
    fs::write(&file, "{}").unwrap();
    let refused = accuracy(&out, &["--reference", arg(&file)]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("is no reference"), "{}", refused.err);
}

#[test]
fn a_folder_with_other_files_and_an_unknown_choice_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("thesis.tex"), "years of work").unwrap();
    let refused = accuracy(dir.path(), &[]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("--out"), "{}", refused.err);
    assert!(dir.path().join("thesis.tex").exists());

    let unknown = accuracy(&dir.path().join("out"), &["--axes", "speed"]);
    assert_eq!(unknown.code, 2);
    assert!(
        unknown.err.contains("there are order, mesh, planes"),
        "{}",
        unknown.err
    );
}

#[test]
fn a_budget_that_no_setting_keeps_names_the_nearest() {
    let dir = tempfile::tempdir().unwrap();
    fs::copy(root().join("scenes/clip.msh"), dir.path().join("clip.msh")).unwrap();
    let scene = dir.path().join("clip.toml");
    let text = fs::read_to_string(root().join("scenes/clip.toml")).unwrap();
    let text = text.replace("order = 2\n", "");
    fs::write(
        &scene,
        format!("accuracy = {{ budget_us = 0.001 }}\n{text}"),
    )
    .unwrap();
    let outcome = snapin(&["prepare", arg(&scene), "--no-cache"]);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
    assert!(
        outcome
            .err
            .contains("no setting keeps accuracy.budget_us = 0.001: the nearest is order"),
        "{}",
        outcome.err
    );
}

//! Reference cases that are wrong: each is refused by file, place and mend, and takes only itself.
//!
//! Inputs: tests/data/verify/README.md, and small cases damaged at random.

mod damaged;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use snapin_tests::{Outcome, arg, root, snapin};

/// Copies the files of a folder.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// A case of the data folder, made whole where it is only its expected.json.
fn broken(name: &str, to: &Path) {
    let from = root().join("tests/data/verify").join(name);
    if !from.join("problem.json").exists() {
        copy(&root().join("tests/cases/patch-tet10"), to);
    }
    copy(&from, to);
}

fn verify(dir: &Path) -> Outcome {
    snapin(&["verify", arg(dir)])
}

/// Refused with these words, while the case beside it, which is right, is run.
#[test]
fn each_broken_case_is_named_and_the_others_run() {
    let dir = tempfile::tempdir().unwrap();
    copy(
        &root().join("tests/cases/lcp/one-by-one"),
        &dir.path().join("zz-right"),
    );
    let cases = [
        ("z-of-three", "z.npy: has 3 entries, q says 16"),
        (
            "z-cut-to-twelve",
            "z.npy: shape (12,) needs 96 bytes after the header, the file has 128",
        ),
        (
            "brackets-in-z",
            "z.npy: byte 26: the header has '[' where the name of a key is wanted",
        ),
        (
            "brackets-in-q",
            "q.npy: byte 20: the header has '[' where the type of the entries",
        ),
        (
            "degree-4294967295",
            "quantities[0].quadrature: \"degree-4294967295\" must be",
        ),
        (
            "empty-value",
            "quantities[0].value: an object of 0 keys must be",
        ),
        (
            "misspelt-quantities",
            "unknown key \"quantites\": the nearest is `quantities`",
        ),
    ];
    for (name, _) in cases {
        broken(name, &dir.path().join(name));
    }
    let start = Instant::now();
    let outcome = verify(dir.path());
    assert!(
        start.elapsed() < Duration::from_secs(60),
        "{:?}",
        start.elapsed()
    );
    assert_eq!(outcome.code, 1, "{}\n{}", outcome.out, outcome.err);
    for (name, words) in cases {
        assert!(
            outcome.out.contains(&format!("{name}: error\n")),
            "{name}: {}",
            outcome.out
        );
        assert!(outcome.out.contains(words), "{words}: {}", outcome.out);
    }
    assert!(outcome.out.contains("zz-right: ok"), "{}", outcome.out);
    assert!(
        outcome.out.contains("1 of 8 cases within tolerance"),
        "{}",
        outcome.out
    );
}

/// Changes one file of a case that is right; the refusal must have these words.
fn refused_after(case: &str, file: &str, change: impl Fn(&Path), words: &str) {
    refused_with(case, file, change, words, file);
}

/// As [`refused_after`], with words in the place of the file's name.
fn refused_with(case: &str, file: &str, change: impl Fn(&Path), words: &str, named: &str) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case");
    copy(&root().join("tests/cases").join(case), &path);
    change(&path.join(file));
    let outcome = verify(&path);
    assert_eq!(outcome.code, 1, "{words}: {}{}", outcome.out, outcome.err);
    assert!(outcome.out.contains(words), "{words}: {}", outcome.out);
    assert!(outcome.out.contains(named), "{named}: {}", outcome.out);
}

/// Replaces text that is there.
fn replace(from: &'static str, to: &'static str) -> impl Fn(&Path) {
    move |path| {
        let text = fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{from}");
        fs::write(path, text.replacen(from, to, 1)).unwrap();
    }
}

#[test]
fn arrays_whose_shapes_do_not_agree_are_named_with_both() {
    let npy = |header: &'static str, n: usize| {
        move |path: &Path| {
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            let header =
                format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {header}, }}\n");
            bytes.extend((header.len() as u16).to_le_bytes());
            bytes.extend(header.as_bytes());
            bytes.extend((0..n).flat_map(|_| 1f64.to_le_bytes()));
            fs::write(path, bytes).unwrap();
        }
    };
    let case = "lcp/fathi-16";
    refused_after(
        case,
        "M.npy",
        npy("(16, 15)", 240),
        "has shape (16, 15); a square matrix is wanted, (16, 16)",
    );
    refused_after(
        case,
        "M.npy",
        npy("(4, 4)", 16),
        "has shape (4, 4), q has 16 entries",
    );
    refused_after(
        case,
        "M.npy",
        npy("(256,)", 256),
        "has shape (256,); a square matrix",
    );
    refused_after(
        case,
        "q.npy",
        npy("(16, 1)", 16),
        "has shape (16, 1); a list",
    );
    refused_after(case, "q.npy", npy("()", 1), "has shape (); a list");
    refused_after(
        case,
        "q.npy",
        npy("(0,)", 0),
        "has shape (0,); a list of one entry or more",
    );
    refused_after(case, "z.npy", npy("(17,)", 17), "has 17 entries, q says 16");
    refused_after(
        case,
        "problem.json",
        replace("\"m\": 16", "\"m\": 15"),
        "has 16 entries, problem.json (`m`) says 15",
    );
    let cut = |path: &Path| {
        let bytes = fs::read(path).unwrap();
        fs::write(path, &bytes[..bytes.len() - 3]).unwrap();
    };
    refused_after(case, "z.npy", cut, "the file has 125: it was cut off");
    refused_after(
        case,
        "z.npy",
        |path: &Path| fs::remove_file(path).unwrap(),
        "the case needs this file",
    );
}

#[test]
fn misspelt_keys_of_all_files_are_named() {
    let lcp = "lcp/fathi-16";
    refused_after(
        lcp,
        "problem.json",
        replace("\"unique\"", "\"uniqe\""),
        "unknown key \"uniqe\": the nearest is `unique`",
    );
    refused_after(
        lcp,
        "problem.json",
        replace("\"solution\"", "\"solved\""),
        "must be one of \"solution\", \"no solution\"",
    );
    let static_case = "cantilever-tet10-nu030";
    refused_after(
        static_case,
        "case.toml",
        replace("[[load]]", "[[lode]]"),
        "unknown field `lode`, expected one of",
    );
    refused_after(
        static_case,
        "case.toml",
        replace("order = 2", "order = 7"),
        "order = 7 must be 1, 2 or 3",
    );
    refused_after(
        static_case,
        "case.toml",
        replace("\"strain_energy\"", "\"strain_enrgy\""),
        "the nearest is `strain_energy`",
    );
    refused_after(
        static_case,
        "case.toml",
        replace("force = [", "force = [inf, 0, 0] # ["),
        "inf is no number",
    );
    refused_after(
        "error-no-fixed",
        "expected.json",
        replace("must_name", "must_nam"),
        "the nearest is `must_name`",
    );
    // The folder's own name must not stand for what the refusal should name.
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("fixed");
    copy(&root().join("tests/cases/error-no-fixed"), &path);
    fs::write(path.join("mesh.msh"), "no mesh").unwrap();
    let outcome = verify(&path);
    assert!(
        outcome.code == 1 && outcome.out.contains("FAIL named"),
        "{}",
        outcome.out
    );
}

#[test]
fn a_path_with_friction_that_is_wrong_is_refused_by_key_and_mend() {
    let case = "hard-redundant-friction";
    let first = "point = [0.0, -6e-06, 0.0]";
    for (from, to, words) in [
        (
            "friction = 0.3",
            "friction = -0.1",
            "[contact] friction = -0.1 must be a number, zero or above",
        ),
        (
            "friction = 0.3",
            "friction = nan",
            "[contact] friction = NaN must be",
        ),
        (
            "substeps = [1, 2]",
            "substeps = [1, 0]",
            "[path] substeps: 0 must be a whole number from 1 to 1000",
        ),
        (
            "substeps = [1, 2]",
            "substeps = [1001]",
            "1001 must be a whole number from 1 to 1000",
        ),
        (
            "substeps = [1, 2]",
            "substeps = [-1]",
            "-1 must be a whole number from 1 to 1000",
        ),
        (
            "substeps = [1, 2]",
            "substeps = []",
            "[path] substeps is missing",
        ),
        ("substeps = [1, 2]", "", "missing field `substeps`"),
        (
            "[path]\nsubsteps = [1, 2]",
            "#",
            "[path] substeps is missing",
        ),
        (
            "substeps = [1, 2]",
            "substep = [1]",
            "unknown field `substep`",
        ),
        (
            "turn = [0.0, 0.004, 0.0]",
            "turn = [0.0, inf, 0.0]",
            "[[pose]] number 15: inf is no number",
        ),
        (
            "turn = [0.0, 0.004, 0.0]",
            "turn = [0.0, 7.0, 0.0]",
            "number 15: turn [0.0, 7.0, 0.0] is of more than a whole",
        ),
        (
            "turn = [0.0, 0.004, 0.0]",
            "turn = [0.1, 0.0, 0.0]",
            "[[pose]] number 15: its direction is 1.0e-1 rad from",
        ),
        (
            first,
            "point = [0.0, 6e-06, 0.0]",
            "[[pose]] number 1 overlaps the part",
        ),
        (
            first,
            "point = [0.0, -6e-06, 0.0]\nturn = [0.0, 0.1, 0.0]",
            "[[pose]] number 1: `turn` is of the step",
        ),
        (
            "kind = \"contact-friction\"",
            "kind = \"contact\"",
            "kind = \"contact-friction\" has it",
        ),
    ] {
        refused_with(case, "case.toml", replace(from, to), words, words);
    }
    let contact = "hard-redundant-contacts";
    for (to, words) in [
        (
            "[path]\nsubsteps = [1]\n[tool]",
            "[path] belongs to kind = \"contact-friction\"",
        ),
        ("[tool]", "`turn` belongs to kind = \"contact-friction\""),
    ] {
        let change = |path: &Path| {
            replace("[tool]", to)(path);
            if to == "[tool]" {
                replace("[[pose]]", "[[pose]]\nturn = [0.0, 0.1, 0.0]")(path);
            }
        };
        refused_after(contact, "case.toml", change, words);
    }
    for (from, to, words) in [
        (
            "path.substeps2",
            "path.substeps3",
            "path.substeps3: [path] substeps of case.toml is [1, 2]; add 3",
        ),
        (
            "state.pose34",
            "state.pose35",
            "state.pose35: case.toml has [[pose]] number 1 to 34",
        ),
        (
            "\"dissipated_J\": [",
            "\"dissipated_J\": [0.0, ",
            "dissipated_J has 35 entries, case.toml has 34 [[pose]]",
        ),
    ] {
        refused_after(case, "expected.json", replace(from, to), words);
    }
}

#[test]
fn a_mesh_that_is_wrong_or_another_is_named_in_its_case() {
    let case = "cantilever-tet10-nu030";
    refused_after(
        case,
        "mesh.msh",
        |path: &Path| fs::write(path, "no mesh").unwrap(),
        "mesh.msh",
    );
    refused_after(
        case,
        "mesh.msh",
        |path: &Path| fs::remove_file(path).unwrap(),
        "mesh.msh",
    );
    let other = |path: &Path| {
        fs::copy(root().join("tests/cases/error-no-fixed/mesh.msh"), path).unwrap();
    };
    refused_after(case, "mesh.msh", other, "mesh.msh");
    refused_after(
        case,
        "expected.json",
        replace("\"nodes\": ", "\"nodes\": 1"),
        "is it the mesh that the values are of",
    );
    // A file is missing or has another name.
    refused_after(
        case,
        "case.toml",
        |path: &Path| fs::remove_file(path).unwrap(),
        "the case needs this file",
    );
    refused_after(
        case,
        "expected.json",
        |path: &Path| fs::remove_file(path).unwrap(),
        "the case needs this file",
    );
}

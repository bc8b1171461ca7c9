//! The solver against answers of other programs, see `data/lcp/README.md`.
//!
//! Tolerances are those of that file: the programs agree to 1e-15, so 1e-9 is room for another
//! path through ill-conditioned rows, not for a wrong row. Set `SNAPIN_LCP_CASES` to a folder to run more problems.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

#[path = "support/lemke.rs"]
mod lemke;

use std::path::{Path, PathBuf};

use contact::Error;
use contact::lcp::{Problem, Scratch, Settings, Solution, Start, Status, check, solve};
use lemke::lemke;

struct Case {
    name: String,
    folder: PathBuf,
    json: serde_json::Value,
}

impl Case {
    fn array(&self, file: &str) -> Vec<f64> {
        let bytes = std::fs::read(self.folder.join(file)).unwrap();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        assert!(matches!(file.order(), npyz::Order::C));
        file.into_vec::<f64>().unwrap()
    }

    fn ids(&self, file: &str) -> Vec<i64> {
        let bytes = std::fs::read(self.folder.join(file)).unwrap();
        npyz::NpyFile::new(&bytes[..])
            .unwrap()
            .into_vec::<i64>()
            .unwrap()
    }

    /// Row-major in the file, column-major here.
    fn matrix(&self, file: &str, m: usize) -> Vec<f64> {
        let rows = self.array(file);
        let mut columns = vec![0.0; m * m];
        for i in 0..m {
            for j in 0..m {
                columns[j * m + i] = rows[i * m + j];
            }
        }
        columns
    }

    fn is_symmetric(&self) -> bool {
        self.json["symmetric"] == true
    }

    fn is_z_compared(&self) -> bool {
        self.json["unique"].as_bool().unwrap() && self.json["family"] != "ill-conditioned"
    }
}

fn cases() -> Vec<Case> {
    let mut roots = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/lcp")];
    roots.extend(std::env::var_os("SNAPIN_LCP_CASES").map(PathBuf::from));
    let mut cases = Vec::new();
    for root in roots {
        for entry in std::fs::read_dir(root).unwrap() {
            let folder = entry.unwrap().path();
            if let Ok(text) = std::fs::read_to_string(folder.join("problem.json")) {
                cases.push(Case {
                    name: folder.file_name().unwrap().to_string_lossy().into_owned(),
                    json: serde_json::from_str(&text).unwrap(),
                    folder,
                });
            }
        }
    }
    cases.sort_by(|a, b| a.name.cmp(&b.name));
    cases
}

fn max_abs(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max: f64, x| max.max(x.abs()))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .fold(0.0, |max: f64, (a, b)| max.max((a - b).abs()))
}

fn gaps(matrix: &[f64], q: &[f64], z: &[f64]) -> Vec<f64> {
    let m = q.len();
    (0..m)
        .map(|i| q[i] + (0..m).map(|j| matrix[j * m + i] * z[j]).sum::<f64>())
        .collect()
}

/// Everything asked of one answer; the list of what is wrong.
fn complaints(
    problem: &Problem,
    z: &[f64],
    w: &[f64],
    expected_z: &[f64],
    is_z_compared: bool,
) -> Vec<String> {
    let (matrix, q) = (problem.matrix(), problem.q());
    let mut complaints = Vec::new();
    let mut demand = |ok: bool, text: String| {
        if !ok {
            complaints.push(text);
        }
    };
    let certificate = check(problem, z).unwrap();
    demand(
        certificate.natural_residual <= 1e-10,
        format!("certificate {:e}", certificate.natural_residual),
    );
    let w_error = distance(w, &gaps(matrix, q, expected_z)) / max_abs(q).max(f64::MIN_POSITIVE);
    demand(w_error <= 1e-9, format!("w differs by {w_error:e}"));
    let z_error = distance(z, expected_z) / max_abs(expected_z).max(f64::MIN_POSITIVE);
    demand(
        !is_z_compared || z_error <= 1e-8,
        format!("z differs by {z_error:e}"),
    );
    demand(z.iter().all(|&z| z >= 0.0), "a negative z".into());
    complaints
}

/// As [`complaints`], and what the solver says of its answer.
fn complaints_of(
    problem: &Problem,
    (z, w): (&[f64], &[f64]),
    solution: &Solution,
    expected_z: &[f64],
    is_z_compared: bool,
) -> Vec<String> {
    let mut complaints = complaints(problem, z, w, expected_z, is_z_compared);
    if solution.status != Status::Solved {
        complaints.push(format!("{:?}", solution.status));
    }
    let own = solution.certificate.natural_residual;
    if own > 1e-10 {
        complaints.push(format!("own certificate {own:e}"));
    }
    complaints
}

fn run(
    problem: &Problem,
    settings: &Settings,
    scratch: &mut Scratch,
    start: Start,
) -> (Solution, Vec<f64>, Vec<f64>) {
    let (mut z, mut w) = (problem.q().to_vec(), problem.q().to_vec());
    let solution = solve(problem, settings, scratch, start, &mut z, &mut w).unwrap();
    (solution, z, w)
}

fn run_all(settings: &Settings, is_wanted: impl Fn(&Case) -> bool) {
    let mut wrong = Vec::new();
    let mut n_run = 0;
    for case in cases().iter().filter(|case| is_wanted(case)) {
        n_run += 1;
        let mut report = |name: String, solution: &Solution, complaints: Vec<String>| {
            eprintln!(
                "{name}: {:?} {:?} certificate {:.1e} rounds {} pivots {} sweeps {}",
                solution.status,
                solution.method,
                solution.certificate.natural_residual,
                solution.rounds,
                solution.pivots,
                solution.sweeps
            );
            if !complaints.is_empty() {
                wrong.push(format!("{name}: {}", complaints.join(", ")));
            }
        };
        if let Some(steps) = case.json["steps"].as_array() {
            let largest = steps
                .iter()
                .map(|s| s["m"].as_u64().unwrap())
                .max()
                .unwrap();
            let mut scratch = Scratch::new(largest as usize);
            let mut held_ids: Vec<i64> = Vec::new();
            for step in 0..steps.len() {
                let q = case.array(&format!("q-{step:02}.npy"));
                let matrix = case.matrix(&format!("M-{step:02}.npy"), q.len());
                let ids = case.ids(&format!("ids-{step:02}.npy"));
                let expected = case.array(&format!("z-{step:02}.npy"));
                let problem = Problem::new(&matrix, &q).unwrap();
                let warm: Vec<bool> = ids.iter().map(|id| held_ids.contains(id)).collect();
                let (solution, z, w) = run(&problem, settings, &mut scratch, Start::Rows(&warm));
                let complaints = complaints_of(&problem, (&z, &w), &solution, &expected, true);
                report(format!("{} step {step}", case.name), &solution, complaints);
                held_ids = (0..z.len())
                    .filter(|&i| z[i] > 0.0)
                    .map(|i| ids[i])
                    .collect();
            }
        } else {
            let q = case.array("q.npy");
            let matrix = case.matrix("M.npy", q.len());
            let problem = Problem::new(&matrix, &q).unwrap();
            let mut scratch = Scratch::new(q.len());
            let (solution, z, w) = run(&problem, settings, &mut scratch, Start::Cold);
            let complaints = if case.json["outcome"] == "solution" {
                let expected = case.array("z.npy");
                complaints_of(
                    &problem,
                    (&z, &w),
                    &solution,
                    &expected,
                    case.is_z_compared(),
                )
            } else if solution.status == Status::NoSolution {
                vec![]
            } else {
                vec![format!("{:?} instead of no solution", solution.status)]
            };
            report(case.name.clone(), &solution, complaints);
        }
    }
    assert!(n_run > 0);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn reference_problems_have_the_known_answers() {
    run_all(&Settings::default(), Case::is_symmetric);
}

#[test]
fn reference_problems_without_block_pivoting_have_the_known_answers() {
    let settings = Settings {
        max_rounds: 0,
        ..Settings::default()
    };
    run_all(&settings, Case::is_symmetric);
}

/// These are refused by the solver; the oracle of other tests has the known answers.
#[test]
fn unsymmetric_reference_problems_are_refused_and_solved_by_lemke() {
    let mut n_run = 0;
    for case in cases().iter().filter(|case| !case.is_symmetric()) {
        n_run += 1;
        let name = &case.name;
        let q = case.array("q.npy");
        let matrix = case.matrix("M.npy", q.len());
        let problem = Problem::new(&matrix, &q).unwrap();
        let (mut z, mut w) = (q.clone(), q.clone());
        let refused = solve(
            &problem,
            &Settings::default(),
            &mut Scratch::new(q.len()),
            Start::Cold,
            &mut z,
            &mut w,
        );
        assert!(
            matches!(refused, Err(Error::NotSymmetric { .. })),
            "{name}: {refused:?}"
        );
        let z = lemke(&matrix, &q).unwrap();
        let w = gaps(&matrix, &q, &z);
        let expected = case.array("z.npy");
        let complaints = complaints(&problem, &z, &w, &expected, case.is_z_compared());
        assert!(complaints.is_empty(), "{name}: {}", complaints.join(", "));
    }
    assert!(n_run >= 7, "{n_run}");
}

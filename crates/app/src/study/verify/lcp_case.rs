//! Linear complementarity problems: `problem.json` with NumPy arrays beside it.

use std::collections::HashSet;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use contact::lcp;
use serde_json::{Value, json};

use super::{Failure, Outcome, Quantity};

/// What the reference asks: certificate and w always, z where it is unique.
const CERTIFICATE: f64 = 1e-10;
const GAP_REL: f64 = 1e-9;
const FORCE_REL: f64 = 1e-8;

pub(super) fn run(dir: &Path) -> Outcome {
    let path = dir.join("problem.json");
    let wrong = |e: String| Failure::Error(format!("{}: {e}", path.display()));
    let text = std::fs::read_to_string(&path).map_err(|e| wrong(e.to_string()))?;
    let problem: Value = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    if problem["steps"].is_array() {
        run_sequence(dir, &problem)
    } else {
        run_one(dir, &problem)
    }
}

struct Answer {
    solved: bool,
    no_solution: bool,
    certificate: f64,
    z: Vec<f64>,
    w: Vec<f64>,
}

fn solve(
    matrix: &[f64],
    q: &[f64],
    start: lcp::Start,
    scratch: &mut lcp::Scratch,
) -> Result<Answer, Failure> {
    let m = q.len();
    let problem = lcp::Problem::new(matrix, q).map_err(|e| Failure::Error(e.to_string()))?;
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    let failure = |e: contact::Error| Failure::Error(e.to_string());
    let solution = lcp::solve(
        &problem,
        &lcp::Settings::default(),
        scratch,
        start,
        &mut z,
        &mut w,
    )
    .map_err(failure)?;
    // Judged by the public check, not by what the solver says of itself.
    let certificate = lcp::check(&problem, &z).map_err(failure)?.natural_residual;
    Ok(Answer {
        solved: solution.status == lcp::Status::Solved,
        no_solution: matches!(solution.status, lcp::Status::NoSolution | lcp::Status::Ray),
        certificate,
        z,
        w,
    })
}

fn run_one(dir: &Path, problem: &Value) -> Outcome {
    let (matrix, q) = (read_matrix(dir, "M.npy")?, read(dir, "q.npy")?);
    let answer = solve(
        &matrix,
        &q,
        lcp::Start::Cold,
        &mut lcp::Scratch::new(q.len()),
    )?;
    let outcome = if answer.solved {
        "solution"
    } else if answer.no_solution {
        "no solution"
    } else {
        "stopped before a solution"
    };
    let expected = problem["outcome"].as_str().unwrap_or("solution");
    let mut quantities = vec![Quantity::text("outcome", outcome, expected)];
    if expected == "solution" {
        quantities.push(certificate(answer.certificate));
        let z = read(dir, "z.npy")?;
        let m = q.len();
        let w: Vec<f64> = (0..m)
            .map(|i| q[i] + (0..m).map(|j| matrix[j * m + i] * z[j]).sum::<f64>())
            .collect();
        let scale = q.iter().fold(0.0f64, |a, x| a.max(x.abs()));
        quantities.push(Quantity::compare(
            "w",
            json!(answer.w),
            &json!(w),
            &json!({ "abs": GAP_REL * scale }),
        ));
        if problem["unique"] == Value::Bool(true) {
            quantities.push(Quantity::compare(
                "z",
                json!(answer.z),
                &json!(z),
                &json!({ "rel": force_tolerance(problem) }),
            ));
        }
    }
    Ok((String::new(), quantities))
}

/// z of an ill-conditioned problem is determined only as well as its matrix lets it be.
fn force_tolerance(problem: &Value) -> f64 {
    match problem["family"].as_str() {
        Some("ill-conditioned") => 1e-2,
        _ => FORCE_REL,
    }
}

fn certificate(value: f64) -> Quantity {
    Quantity::compare(
        "certificate",
        json!(value),
        &json!(0.0),
        &json!({ "abs": CERTIFICATE }),
    )
}

fn run_sequence(dir: &Path, problem: &Value) -> Outcome {
    let n_steps = problem["steps"].as_array().map_or(0, Vec::len);
    let mut active: HashSet<i64> = HashSet::new();
    let mut worst = 0.0f64;
    let mut last = None;
    for step in 0..n_steps {
        let matrix = read_matrix(dir, &format!("M-{step:02}.npy"))?;
        let q = read(dir, &format!("q-{step:02}.npy"))?;
        let ids = read_ids(dir, &format!("ids-{step:02}.npy"))?;
        if ids.len() != q.len() {
            return Err(Failure::Error(format!(
                "{}: step {step} has {} ids and {} rows",
                dir.display(),
                ids.len(),
                q.len()
            )));
        }
        // The set of rows changes from step to step: the warm start is carried by id.
        let warm: Vec<bool> = ids.iter().map(|id| active.contains(id)).collect();
        let answer = solve(
            &matrix,
            &q,
            lcp::Start::Rows(&warm),
            &mut lcp::Scratch::new(q.len()),
        )?;
        worst = if answer.solved {
            worst.max(answer.certificate)
        } else {
            f64::INFINITY
        };
        active = ids
            .iter()
            .zip(&answer.z)
            .filter(|(_, z)| **z > 0.0)
            .map(|(id, _)| *id)
            .collect();
        last = Some((step, answer));
    }
    let mut quantities = vec![certificate(worst)];
    if let Some((step, answer)) = last {
        let z = read(dir, &format!("z-{step:02}.npy"))?;
        quantities.push(Quantity::compare(
            "z",
            json!(answer.z),
            &json!(z),
            &json!({ "rel": FORCE_REL }),
        ));
    }
    Ok((String::new(), quantities))
}

/// A square matrix, turned from C order into columns.
fn read_matrix(dir: &Path, name: &str) -> Result<Vec<f64>, Failure> {
    let (shape, data) = read_array::<f64>(dir, name)?;
    match shape[..] {
        [rows, columns] if rows == columns => {
            let n = rows as usize;
            Ok((0..n * n).map(|k| data[(k % n) * n + k / n]).collect())
        }
        _ => Err(Failure::Error(format!(
            "{}: shape {shape:?} is not square",
            dir.join(name).display()
        ))),
    }
}

fn read(dir: &Path, name: &str) -> Result<Vec<f64>, Failure> {
    Ok(read_array(dir, name)?.1)
}

fn read_ids(dir: &Path, name: &str) -> Result<Vec<i64>, Failure> {
    Ok(read_array(dir, name)?.1)
}

fn read_array<T: npyz::Deserialize>(dir: &Path, name: &str) -> Result<(Vec<u64>, Vec<T>), Failure> {
    let path = dir.join(name);
    let wrong = |e: std::io::Error| Failure::Error(format!("{}: {e}", path.display()));
    let file =
        npyz::NpyFile::new(BufReader::new(File::open(&path).map_err(wrong)?)).map_err(wrong)?;
    if file.order() != npyz::Order::C {
        return Err(Failure::Error(format!(
            "{}: is not in C order",
            path.display()
        )));
    }
    let shape = file.shape().to_vec();
    Ok((shape, file.into_vec().map_err(wrong)?))
}

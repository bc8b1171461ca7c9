//! Linear complementarity problems: `problem.json` with NumPy arrays beside it.

use std::collections::HashSet;
use std::path::Path;

use contact::lcp;
use serde_json::{Value, json};

use super::files::{text, wrong};
use super::schema::{Shape, check};
use super::{Failure, Outcome, Quantity, npy};

/// What the reference asks: certificate and w always, z where it is unique.
const CERTIFICATE: f64 = 1e-10;
const GAP_REL: f64 = 1e-9;
const FORCE_REL: f64 = 1e-8;

/// Rows of a problem: the arrays of more are not read.
const ROWS: Shape = Shape::Count(1, 5000);

/// Keys of `problem.json`. Those that only describe are listed in docs/reference-cases.md.
pub(super) const PROBLEM: Shape = Shape::Object(&[
    ("name", Shape::Text),
    ("family", Shape::Text),
    ("note", Shape::Text),
    ("m", ROWS),
    ("symmetric", Shape::Flag),
    ("outcome", Shape::Choice(&["solution", "no solution"])),
    ("unique", Shape::Flag),
    (
        "steps",
        Shape::List(&Shape::Object(&[
            ("m", ROWS),
            ("active", Shape::Any),
            ("certificate", Shape::Any),
        ])),
    ),
    ("solvers", Shape::Any),
    ("certificate", Shape::Any),
    ("active", Shape::Any),
    ("agreement_rel", Shape::Any),
    ("w_agreement_rel", Shape::Any),
]);

pub(super) fn run(dir: &Path) -> Outcome {
    let path = dir.join("problem.json");
    let problem: Value =
        serde_json::from_str(&text(&path)?).map_err(|e| wrong(&path, &e.to_string()))?;
    check(&problem, &PROBLEM, "").map_err(|e| wrong(&path, &e))?;
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
    let failure = |e: contact::Error| match e {
        contact::Error::NotSymmetric { .. } => Failure::NotSupported(format!(
            "{e}; frictional contact is solved on its cone, not as a problem of this kind"
        )),
        _ => Failure::Error(e.to_string()),
    };
    let problem = lcp::Problem::symmetric(matrix, q).map_err(failure)?;
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
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
        no_solution: solution.status == lcp::Status::NoSolution,
        certificate,
        z,
        w,
    })
}

fn run_one(dir: &Path, problem: &Value) -> Outcome {
    let q = read(dir, "q.npy")?;
    let matrix = read_matrix(dir, "M.npy", q.len())?;
    same_length(
        dir,
        "q.npy",
        q.len(),
        "problem.json (`m`)",
        problem["m"].as_u64(),
    )?;
    // All files first: what is wrong with one is told whatever the solver says.
    let expected = problem["outcome"].as_str().unwrap_or("solution");
    let z = match expected {
        "solution" => Some(read_forces(dir, "z.npy", q.len())?),
        _ => None,
    };
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
    let mut quantities = vec![Quantity::text("outcome", outcome, expected)];
    if let Some(z) = z {
        quantities.push(certificate(answer.certificate));
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
    let steps = problem["steps"].as_array().map_or(&[][..], Vec::as_slice);
    if problem["outcome"] == "no solution" {
        return Err(wrong(
            &dir.join("problem.json"),
            "outcome: a sequence of steps is compared by its solutions; give a problem without one a folder of its own",
        ));
    }
    let mut active: HashSet<i64> = HashSet::new();
    let mut worst = 0.0f64;
    let mut last = None;
    for (step, described) in steps.iter().enumerate() {
        let names = ["M", "q", "ids"].map(|name| format!("{name}-{step:02}.npy"));
        let q = read(dir, &names[1])?;
        let matrix = read_matrix(dir, &names[0], q.len())?;
        let ids = read_list::<i64>(dir, &names[2])?;
        same_length(dir, &names[2], ids.len(), &names[1], Some(q.len() as u64))?;
        let of_step = format!("problem.json (`m` of step {step})");
        same_length(dir, &names[1], q.len(), &of_step, described["m"].as_u64())?;
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
        let z = read_forces(dir, &format!("z-{step:02}.npy"), answer.z.len())?;
        quantities.push(Quantity::compare(
            "z",
            json!(answer.z),
            &json!(z),
            &json!({ "rel": FORCE_REL }),
        ));
    }
    Ok((String::new(), quantities))
}

/// A square matrix of as many rows as q, by columns.
fn read_matrix(dir: &Path, name: &str, m: usize) -> Result<Vec<f64>, Failure> {
    let path = dir.join(name);
    let array = npy::read::<f64>(&path)?;
    let shape = npy::shown(&array.shape);
    match array.shape[..] {
        [rows, columns] if rows == columns && rows == m as u64 => {}
        [rows, columns] if rows == columns => {
            return Err(wrong(
                &path,
                &format!("has shape {shape}, q has {m} entries; write both from one problem"),
            ));
        }
        _ => {
            return Err(wrong(
                &path,
                &format!("has shape {shape}; a square matrix is wanted, ({m}, {m}) beside this q"),
            ));
        }
    }
    if array.is_fortran {
        return Ok(array.entries);
    }
    Ok((0..m * m)
        .map(|k| array.entries[(k % m) * m + k / m])
        .collect())
}

fn read(dir: &Path, name: &str) -> Result<Vec<f64>, Failure> {
    read_list(dir, name)
}

/// Forces of the reference, as many as q has entries.
fn read_forces(dir: &Path, name: &str, m: usize) -> Result<Vec<f64>, Failure> {
    let z = read(dir, name)?;
    same_length(dir, name, z.len(), "q", Some(m as u64))?;
    Ok(z)
}

/// A list that is not empty.
fn read_list<T: npy::Entry>(dir: &Path, name: &str) -> Result<Vec<T>, Failure> {
    let path = dir.join(name);
    let array = npy::read(&path)?;
    match array.shape[..] {
        [n] if n > 0 => Ok(array.entries),
        _ => Err(wrong(
            &path,
            &format!(
                "has shape {}; a list of one entry or more is wanted, such as (3,)",
                npy::shown(&array.shape)
            ),
        )),
    }
}

/// Two lengths that must agree, where the second is given.
fn same_length(
    dir: &Path,
    name: &str,
    length: usize,
    other: &str,
    other_length: Option<u64>,
) -> Result<(), Failure> {
    match other_length {
        Some(n) if n != length as u64 => Err(wrong(
            &dir.join(name),
            &format!("has {length} entries, {other} says {n}; write both from one problem"),
        )),
        _ => Ok(()),
    }
}

//! The problem of one increment as numbers, `y = q + M r`: the solver alone, no finite elements.

use contact::friction;
use serde_json::{Value, json};

use super::numbers;
use crate::study::verify::Failure;

/// Forces r and what they leave, y; whether the solver calls them solved.
pub(super) fn solve(value: &Value) -> Result<(Value, bool), Failure> {
    let failure = |e: contact::Error| Failure::Error(format!("expected.json: {e}"));
    let q = numbers(&value["q"]);
    let n = q.len();
    let rows: Vec<Vec<f64>> = value["M"]
        .as_array()
        .into_iter()
        .flatten()
        .map(numbers)
        .collect();
    // Symmetric to round-off as it is written; the problem is to be so to the bit.
    let matrix: Vec<f64> = (0..n * n)
        .map(|k| 0.5 * (rows[k / n][k % n] + rows[k % n][k / n]))
        .collect();
    let coefficients = vec![value["friction"].as_f64().unwrap_or(f64::NAN); n / 3];
    let problem = friction::Problem::new(&matrix, &q, &coefficients).map_err(failure)?;
    let (mut r, mut y) = (vec![0.0; n], vec![0.0; n]);
    let solution = friction::solve(
        &problem,
        &friction::Settings::default(),
        &mut friction::Scratch::new(n / 3),
        false,
        &mut r,
        &mut y,
    )
    .map_err(failure)?;
    let residual = solution.certificate.natural_residual;
    Ok((
        json!({ "solution_r": r, "y": y, "residual": residual }),
        solution.status == friction::Status::Solved,
    ))
}

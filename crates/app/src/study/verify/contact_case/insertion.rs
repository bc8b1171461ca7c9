//! A tool that goes the way of the reference's curve.

use serde_json::{Value, json};

use super::{Touchable, engine, extremes, nodal_forces, pose, pose_of, require_converged, stride};
use crate::study::verify::Failure;
use crate::study::verify::case::Case;
use crate::study::verify::files::{text, wrong};

/// The path of the reference's curve, walked in its steps.
pub(super) fn run(case: &Case, ready: &Touchable, quantity: &Value) -> Result<Value, Failure> {
    let file = quantity["file"].as_str().ok_or_else(|| {
        Failure::NotSupported("an insertion without the file of its path".to_owned())
    })?;
    let path = case.dir.join(file);
    let heights = heights(&text(&path)?).map_err(|e| wrong(&path, &e))?;
    let mut target = pose(pose_of(case, 1)?)?;
    let near = 2.0 * stride(ready);
    let mut walker = engine(ready, case.iterations, near)?;
    let (mut peak, mut at_peak, mut lowest, mut strain) = (f64::MIN, 0.0, f64::MAX, 0.0f64);
    for y in heights {
        target.translation.y = y;
        let report = walker.step(&target);
        require_converged(&report)?;
        let force = report.contact_force_on_tool().y;
        if force > peak {
            (peak, at_peak) = (force, y);
        }
        lowest = lowest.min(force);
        if report.contacts > 0 {
            let u = ready.elastic.factor.solve(&nodal_forces(ready, &walker));
            strain = strain.max(extremes(case, ready, &u)?.max_principal_strain);
        }
    }
    Ok(json!({
        "peak_force_N": peak,
        "axis_y_at_peak_m": at_peak,
        "min_force_N": lowest,
        "max_principal_strain": strain,
    }))
}

/// Heights of the tool along its path, m: the first column.
fn heights(text: &str) -> Result<Vec<f64>, String> {
    let mut lines = text.lines();
    if lines.next().and_then(|header| header.split(',').next()) != Some("axis_y_m") {
        return Err("line 1: the first column must be axis_y_m".to_owned());
    }
    let mut heights = Vec::new();
    for (k, line) in lines.enumerate() {
        let cell = line.split(',').next().unwrap_or_default().trim();
        match cell.parse::<f64>() {
            Ok(y) if y.is_finite() => heights.push(y),
            _ => return Err(format!("line {}: {cell:?} must be a height in m", k + 2)),
        }
    }
    if heights.is_empty() {
        return Err("has no line below its header; the path needs one height or more".to_owned());
    }
    Ok(heights)
}

//! `expected.json` of a case: every key known, every number in its range, something to compare.
//!
//! Checked before anything is computed. What is here has the right shape for what
//! [`super::elastic_case`] and [`super::contact_case`] compute; they look only at the mesh.

pub(super) mod keys;

use std::path::Path;

use serde_json::Value;

use super::Failure;
use super::case::Kind;
use super::compare::COMPARED_KEYS;
use super::files::{text, wrong};
use super::friction_case::Asked;
use super::schema::{Shape, below, check, nearest};
use keys::{FILE, INSERTION_VALUE, LCP_VALUE, MATRIX, POSE_VALUE, QUANTITY, VECTOR, VECTORS};
use keys::{
    FRICTIONLESS_COMPARED, PATH_COMPARED, PATH_VALUE, PROBLEM_COMPARED, PROBLEM_VALUE,
    STATE_COMPARED, STATE_VALUE, SUMMARY_COMPARED, SUMMARY_VALUE,
};

/// Degrees of quadrature: a conical rule of degree 40 has 9261 points in each element.
const DEGREES: std::ops::RangeInclusive<u32> = 1..=40;

/// What is computed for a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Displacement,
    Scalar,
    Stress,
    Radii,
    Compliance,
    EdgeStiffness,
    Pose,
    Lcp,
    Insertion,
    OnEachMesh,
    WithFriction(Asked),
}

impl Form {
    /// By kind of case and name; `None` for a name that the program does not compute.
    fn of(kind: Kind, name: &str) -> Option<Self> {
        Some(match (kind, name) {
            (Kind::Convergence, "nodal_rms_error" | "strain_energy" | "L2_error") => {
                Self::OnEachMesh
            }
            (Kind::Convergence, "rate_nodal_rms" | "rate_L2") => Self::Scalar,
            (Kind::Convergence, _) => return None,
            (_, _) if name.starts_with("compliance") => Self::Compliance,
            (Kind::ContactFriction, _) => Self::WithFriction(Asked::of(name)?.0),
            (Kind::Contact, "catch_edge_stiffness") => Self::EdgeStiffness,
            (Kind::Contact, "deflection_force_fe") => Self::Scalar,
            (Kind::Contact, _) => match name {
                _ if name.starts_with("contact.pose") || name.starts_with("contact.depth") => {
                    Self::Pose
                }
                _ if name.starts_with("lcp.pose") => Self::Lcp,
                _ if name.starts_with("insertion.") => Self::Insertion,
                _ => return None,
            },
            (_, "displacement") => Self::Displacement,
            (_, "work_mean_displacement" | "strain_energy") => Self::Scalar,
            (_, "stress_at_point") => Self::Stress,
            (_, _) if name.starts_with("radial_displacement") => Self::Radii,
            (_, _) => return None,
        })
    }

    fn shape(self) -> &'static Shape {
        match self {
            Self::Displacement => &VECTORS,
            Self::Scalar | Self::EdgeStiffness => &Shape::Number,
            Self::Stress => &Shape::Exactly(3, &VECTOR),
            Self::Radii => &Shape::Exactly(2, &Shape::Number),
            Self::Compliance => &MATRIX,
            Self::Pose => &POSE_VALUE,
            Self::Lcp => &LCP_VALUE,
            Self::Insertion => &INSERTION_VALUE,
            Self::OnEachMesh => &Shape::List(&Shape::Number),
            Self::WithFriction(asked) => match asked {
                Asked::Path { .. } | Asked::Repeated => &PATH_VALUE,
                Asked::Summary { .. } | Asked::Frictionless => &SUMMARY_VALUE,
                Asked::State { .. } => &STATE_VALUE,
                Asked::Problem => &PROBLEM_VALUE,
            },
        }
    }

    /// Of a value that is an object, the keys that are compared.
    fn compared(self) -> &'static [&'static str] {
        match self {
            Self::WithFriction(asked) => match asked {
                Asked::Path { .. } | Asked::Repeated => &PATH_COMPARED,
                Asked::Summary { .. } => &SUMMARY_COMPARED,
                Asked::Frictionless => &FRICTIONLESS_COMPARED,
                Asked::State { .. } => &STATE_COMPARED,
                Asked::Problem => &PROBLEM_COMPARED,
            },
            _ => &COMPARED_KEYS,
        }
    }

    /// Keys beside the value without which it cannot be computed.
    fn needs(self) -> &'static [&'static str] {
        match self {
            Self::Stress => &["point_m"],
            Self::Compliance => &["nodes"],
            Self::EdgeStiffness => &["edge_nodes", "edge_weights"],
            Self::Insertion => &["file"],
            _ => &[],
        }
    }
}

/// Names that are computed, for the mend of a misspelt one.
pub(super) fn names(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::Convergence => &[
            "nodal_rms_error",
            "strain_energy",
            "rate_nodal_rms",
            "rate_L2",
            "L2_error",
        ],
        Kind::Contact => &[
            "compliance",
            "contact.pose1",
            "contact.depth1",
            "lcp.pose1",
            "insertion.linear",
            "catch_edge_stiffness",
            "deflection_force_fe",
        ],
        Kind::ContactFriction => &[
            "compliance",
            "path.substeps1",
            "summary.substeps1",
            "state.pose1",
            "frictionless",
            "repeated",
            "problem.pose1",
        ],
        Kind::Patch | Kind::Static | Kind::Error => &[
            "displacement",
            "work_mean_displacement",
            "strain_energy",
            "stress_at_point",
            "radial_displacement",
            "compliance",
        ],
    }
}

/// Reads the file and checks it.
///
/// # Errors
/// With file, place and mend; a quantity that the program does not compute is not supported.
pub(super) fn read(path: &Path, kind: Kind) -> Result<Value, Failure> {
    let text = text(path)?;
    let expected: Value = serde_json::from_str(&text).map_err(|e| wrong(path, &e.to_string()))?;
    check(&expected, &FILE, "").map_err(|e| wrong(path, &e))?;
    if kind == Kind::Error {
        check_refusal(&expected["expected_error"]).map_err(|e| wrong(path, &e))?;
        return Ok(expected);
    }
    let quantities =
        check_quantities(&expected["quantities"], kind).map_err(|e| wrong(path, &e))?;
    for (place, quantity) in quantities {
        let name = quantity["name"].as_str().unwrap_or_default();
        let Some(form) = Form::of(kind, name) else {
            return Err(Failure::NotSupported(format!(
                "{}: {place}: quantity {name:?} in a case of this kind: {}; what is only context has \
                 \"informative\": true",
                path.display(),
                nearest(name, names(kind))
            )));
        };
        check_compared(quantity, form, &place).map_err(|e| wrong(path, &e))?;
    }
    Ok(expected)
}

/// The words that a refusal has to name.
fn check_refusal(expected_error: &Value) -> Result<(), String> {
    const PLACE: &str = "expected_error.must_name";
    let Some(phrases) = expected_error["must_name"].as_array() else {
        return Err(format!(
            "{PLACE} is missing: a case of kind \"error\" says what the refusal must name"
        ));
    };
    for phrase in phrases.iter().filter_map(Value::as_str) {
        if phrase.split(" or ").any(|words| words.trim().is_empty()) {
            return Err(format!(
                "{PLACE}: {phrase:?} has nothing to name; give words, alternatives between \" or \""
            ));
        }
    }
    Ok(())
}

/// Quantities that are computed, with their places: those that are compared, and on a path with friction also those that
/// are only told, which must come out finite.
fn check_quantities(quantities: &Value, kind: Kind) -> Result<Vec<(String, &Value)>, String> {
    const NONE: &str = "a case in which nothing is compared is not right but empty";
    let list = match quantities {
        Value::Array(list) if !list.is_empty() => list,
        Value::Null => return Err(format!("quantities is missing: {NONE}")),
        Value::Array(_) => return Err(format!("quantities has no entry: {NONE}")),
        _ => return Err("quantities must be a list of objects".to_owned()),
    };
    let mut compared = Vec::new();
    for (k, quantity) in list.iter().enumerate() {
        let place = format!("quantities[{k}]");
        check(quantity, &QUANTITY, &place)?;
        let name = quantity["name"].as_str().unwrap_or_default();
        let is_told = kind == Kind::ContactFriction && Form::of(kind, name).is_some();
        if !is_informative(quantity) || is_told {
            compared.push((place, quantity));
        }
    }
    if compared.is_empty() {
        return Err(format!("all quantities are informative: {NONE}"));
    }
    Ok(compared)
}

fn is_informative(quantity: &Value) -> bool {
    quantity["informative"] == Value::Bool(true)
}

/// A quantity that is computed: its value in that form, a tolerance if it is compared, and what is needed beside.
fn check_compared(quantity: &Value, form: Form, place: &str) -> Result<(), String> {
    let name = quantity["name"].as_str().unwrap_or_default();
    let needs_tolerance = !is_informative(quantity);
    for key in ["value", "tolerance"].iter().chain(form.needs()) {
        if quantity[*key].is_null() && (*key != "tolerance" || needs_tolerance) {
            return Err(format!(
                "{place}: {key} is missing; {name:?} is compared and needs it"
            ));
        }
    }
    let value = &quantity["value"];
    let in_value = below(place, "value");
    check(value, form.shape(), &in_value)?;
    check_quadrature(&quantity["quadrature"], place)?;
    match form {
        Form::Lcp => check_lcp(value, &in_value)?,
        Form::WithFriction(Asked::Problem) => check_problem(value, &in_value)?,
        Form::Pose | Form::Insertion | Form::WithFriction(_) => {
            check_any_compared(value, form, &in_value)?;
        }
        Form::Compliance => {
            let n = 3 * length(&quantity["nodes"]);
            let of = format!("three times the {} of {place}.nodes", n / 3);
            check_square(value, n, &in_value, &of)?;
        }
        Form::EdgeStiffness => check_edge(quantity, place)?,
        _ => {}
    }
    if needs_tolerance {
        check_tolerance(quantity, form, place)?;
    }
    Ok(())
}

/// An object of which at least one key is compared.
fn check_any_compared(value: &Value, form: Form, place: &str) -> Result<(), String> {
    let is_compared = |key: &String| form.compared().contains(&key.as_str());
    if value.as_object().is_some_and(|o| o.keys().any(is_compared)) {
        Ok(())
    } else {
        Err(format!(
            "{place}: none of its keys is compared; give force_on_tool_N, or peak_force_N for a path"
        ))
    }
}

/// Matrix and vectors of a problem with friction: three rows for each node.
fn check_problem(value: &Value, place: &str) -> Result<(), String> {
    for key in ["nodes", "friction", "M", "q", "solution_r"] {
        if value[key].is_null() {
            return Err(format!("{place}: {key} is missing: the problem needs it"));
        }
    }
    let n = 3 * length(&value["nodes"]);
    let of = format!("three times the {} of {place}.nodes", n / 3);
    for key in ["q", "solution_r", "y"] {
        if !value[key].is_null() && length(&value[key]) != n {
            return Err(format!(
                "{place}.{key}: has {} entries, {n} are wanted ({of})",
                length(&value[key])
            ));
        }
    }
    check_square(&value["M"], n, &below(place, "M"), &of)
}

fn check_lcp(value: &Value, place: &str) -> Result<(), String> {
    if value["nodes"].is_null() {
        return Err(format!("{place}: nodes is missing: the nodes of the rows"));
    }
    check_any_compared(value, Form::Lcp, place)?;
    let n = length(&value["nodes"]);
    for key in ["q", "solution_z"] {
        if !value[key].is_null() && length(&value[key]) != n {
            return Err(format!(
                "{place}.{key}: has {} entries, {place}.nodes has {n}; they are the same rows",
                length(&value[key])
            ));
        }
    }
    if value["M"].is_null() {
        return Ok(());
    }
    let of = format!("{place}.nodes has {n}");
    check_square(&value["M"], n, &below(place, "M"), &of)
}

fn check_square(matrix: &Value, n: usize, place: &str, of: &str) -> Result<(), String> {
    let rows = matrix.as_array().map_or(&[][..], Vec::as_slice);
    if rows.len() != n {
        return Err(format!(
            "{place}: has {} rows, {n} are wanted ({of})",
            rows.len()
        ));
    }
    match rows.iter().position(|row| length(row) != n) {
        Some(row) => Err(format!(
            "{place}[{row}]: has {} entries, {n} are wanted ({of})",
            length(&rows[row])
        )),
        None => Ok(()),
    }
}

fn check_edge(quantity: &Value, place: &str) -> Result<(), String> {
    let (nodes, weights) = (
        length(&quantity["edge_nodes"]),
        length(&quantity["edge_weights"]),
    );
    if nodes != weights {
        return Err(format!(
            "{place}.edge_weights: has {weights} entries, {place}.edge_nodes has {nodes}; each node has its weight"
        ));
    }
    let sum: f64 = numbers(&quantity["edge_weights"]).sum();
    if sum > 0.0 && sum.is_finite() {
        Ok(())
    } else {
        Err(format!(
            "{place}.edge_weights: their sum is {sum:e}; it must be above zero"
        ))
    }
}

fn check_quadrature(rule: &Value, place: &str) -> Result<(), String> {
    match rule.as_str() {
        None => Ok(()),
        Some(rule) => quadrature(rule)
            .map(|_| ())
            .map_err(|e| format!("{place}.quadrature: {e}")),
    }
}

/// The rule that a text names.
pub(super) fn quadrature(rule: &str) -> Result<fem::Quadrature, String> {
    match rule {
        "points-4" => Ok(fem::Quadrature::Fast),
        "converged" => Ok(fem::Quadrature::Converged),
        _ => match rule.strip_prefix("degree-").map(str::parse) {
            Some(Ok(degree)) if DEGREES.contains(&degree) => Ok(fem::Quadrature::Degree(degree)),
            _ => Err(format!(
                "{rule:?} must be \"points-4\", \"converged\", or \"degree-\" and a number from {} to {}",
                DEGREES.start(),
                DEGREES.end()
            )),
        },
    }
}

fn check_tolerance(quantity: &Value, form: Form, place: &str) -> Result<(), String> {
    let (tolerance, value) = (&quantity["tolerance"], &quantity["value"]);
    if tolerance["rel"].is_null() && tolerance["abs"].is_null() {
        return Err(format!("{place}.tolerance: needs rel or abs, above zero"));
    }
    let Some(abs) = tolerance["abs"].as_f64() else {
        return Ok(());
    };
    let largest = largest_compared(value, form.compared());
    if largest > 0.0 && abs >= largest {
        return Err(format!(
            "{place}.tolerance.abs: {abs:e} is not below the largest expected number, {largest:e}, so that zero \
             would pass; where zero is meant write 0 as the value"
        ));
    }
    Ok(())
}

/// Largest number of a value; of an object, of the keys that are compared.
fn largest_compared(value: &Value, keys: &[&str]) -> f64 {
    let largest = |value: &Value| largest_compared(value, keys);
    match value {
        Value::Object(object) => object
            .iter()
            .filter(|(key, _)| keys.contains(&key.as_str()) || key.parse::<u64>().is_ok())
            .map(|(_, value)| largest(value))
            .fold(0.0, f64::max),
        Value::Array(list) => list.iter().map(largest).fold(0.0, f64::max),
        _ => value.as_f64().map_or(0.0, f64::abs),
    }
}

fn length(value: &Value) -> usize {
    value.as_array().map_or(0, Vec::len)
}

fn numbers(value: &Value) -> impl Iterator<Item = f64> + '_ {
    value
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
}

#[cfg(test)]
mod tests;

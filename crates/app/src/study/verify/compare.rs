//! Computed beside expected: relative error of a value of any shape.

use serde_json::{Value, json};

/// One compared quantity.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// As in `expected.json`.
    pub name: String,
    /// Whole, in the shape of the expected value.
    pub computed: Value,
    /// As in `expected.json`.
    pub expected: Value,
    /// Largest difference over the largest expected entry; for an object the worst of its keys.
    pub error_rel: f64,
    /// As in `expected.json`: `rel` and `abs`.
    pub tolerance: Value,
    within: bool,
    is_informative: bool,
}

impl Quantity {
    /// Compares by the tolerance: within if the difference is below `abs`, or below `rel` times
    /// the largest expected entry (of each key, for an object).
    ///
    /// A value without a number in it is never within: nothing was compared.
    pub(super) fn compare(
        name: &str,
        computed: Value,
        expected: &Value,
        tolerance: &Value,
    ) -> Self {
        Self::compare_keys(name, computed, expected, tolerance, &COMPARED_KEYS)
    }

    /// As [`Self::compare`], with the keys of an object that are compared.
    pub(super) fn compare_keys(
        name: &str,
        computed: Value,
        expected: &Value,
        tolerance: &Value,
        keys: &[&str],
    ) -> Self {
        let rel = tolerance["rel"].as_f64().unwrap_or(0.0);
        let abs = tolerance["abs"].as_f64().unwrap_or(0.0);
        let pairs = match (expected, &computed) {
            (Value::Object(e), Value::Object(_)) if !e.keys().all(|k| k.parse::<u64>().is_ok()) => {
                keys.iter()
                    .filter(|key| e.contains_key(**key))
                    .map(|key| {
                        let floor = if *key == "torque_on_tool_Nm" {
                            LEVER * largest(&e["force_on_tool_N"])
                        } else {
                            0.0
                        };
                        (e[*key].clone(), computed[*key].clone(), floor)
                    })
                    .collect()
            }
            _ => vec![(expected.clone(), computed.clone(), 0.0)],
        };
        let mut within = !pairs.is_empty();
        let mut error_rel: f64 = if pairs.is_empty() { f64::INFINITY } else { 0.0 };
        for (expected, computed, floor) in &pairs {
            match difference(expected, computed) {
                Some((largest_difference, largest_entry)) if count(expected) > 0 => {
                    let largest_entry = largest_entry.max(*floor);
                    let relative = if largest_difference == 0.0 {
                        0.0
                    } else {
                        largest_difference / largest_entry
                    };
                    error_rel = error_rel.max(relative);
                    within &= largest_difference <= abs.max(rel * largest_entry);
                }
                _ => {
                    error_rel = f64::INFINITY;
                    within = false;
                }
            }
        }
        Self {
            name: name.to_owned(),
            computed,
            expected: expected.clone(),
            error_rel,
            tolerance: tolerance.clone(),
            within,
            is_informative: false,
        }
    }

    /// A yes or no.
    pub(super) fn verdict(name: &str, yes: bool) -> Self {
        Self {
            name: name.to_owned(),
            computed: json!(yes),
            expected: json!(true),
            error_rel: if yes { 0.0 } else { 1.0 },
            tolerance: json!({ "abs": 0.0 }),
            within: yes,
            is_informative: false,
        }
    }

    /// A text that must be equal.
    pub(super) fn text(name: &str, computed: &str, expected: &str) -> Self {
        Self {
            name: name.to_owned(),
            computed: json!(computed),
            expected: json!(expected),
            error_rel: if computed == expected { 0.0 } else { 1.0 },
            tolerance: json!({ "abs": 0.0 }),
            within: computed == expected,
            is_informative: false,
        }
    }

    /// Makes a failed second condition count.
    pub(super) fn and(mut self, holds: bool) -> Self {
        self.within &= holds;
        self
    }

    /// Context, or an answer that is not unique: reported with its error, and within if it is there and finite.
    pub(super) fn informative(self) -> Self {
        Self {
            within: has_only_numbers(&self.computed),
            is_informative: true,
            ..self
        }
    }

    /// Whether the quantity is inside its tolerance.
    pub fn is_within(&self) -> bool {
        self.within
    }

    /// Whether it is only reported.
    pub fn is_informative(&self) -> bool {
        self.is_informative
    }
}

/// m. A torque about a point that the resultant passes through is round-off of cancelling parts;
/// its error counts against the force on a lever of a millimetre.
const LEVER: f64 = 1e-3;

/// Keys of an object value that are unique and therefore compared; single nodal forces and the
/// set of active nodes are not (quadratic elements share a face's force unevenly). Maxima are those
/// over the points of the 4-point rule and over components.
pub(super) const COMPARED_KEYS: [&str; 14] = [
    "force_on_tool_N",
    "torque_on_tool_Nm",
    "sample_displacement_m",
    "one_pass_planes_at_rest",
    "max_displacement_m",
    "peak_force_N",
    "axis_y_at_peak_m",
    "min_force_N",
    "q",
    "M",
    "solution_z",
    "max_principal_strain",
    "max_von_mises_Pa",
    "max_rotation_rad",
];

/// Largest number of a list, or of lists in it.
fn largest(value: &Value) -> f64 {
    match value {
        Value::Array(list) => list.iter().map(largest).fold(0.0, f64::max),
        _ => value.as_f64().map_or(0.0, f64::abs),
    }
}

/// No number that is not finite: JSON has none, and writes null there.
fn has_only_numbers(value: &Value) -> bool {
    match value {
        Value::Null => false,
        Value::Array(list) => list.iter().all(has_only_numbers),
        Value::Object(object) => object.values().all(has_only_numbers),
        _ => true,
    }
}

/// Largest difference and largest expected entry, or `None` if the shapes do not fit or a number
/// is missing or not finite.
fn difference(expected: &Value, computed: &Value) -> Option<(f64, f64)> {
    match (expected, computed) {
        (Value::Number(e), Value::Number(c)) => {
            let (e, c) = (e.as_f64()?, c.as_f64()?);
            Some(((e - c).abs(), e.abs()))
        }
        (Value::Array(e), Value::Array(c)) if e.len() == c.len() => {
            fold(e.iter().zip(c).map(|(e, c)| difference(e, c)))
        }
        (Value::Object(e), Value::Object(c)) => {
            let keys: Vec<&String> = e.keys().filter(|k| is_compared(k)).collect();
            fold(keys.iter().map(|k| difference(&e[*k], c.get(*k)?)))
        }
        _ => None,
    }
}

/// Numbers that [`difference`] looks at.
fn count(expected: &Value) -> usize {
    match expected {
        Value::Number(_) => 1,
        Value::Array(list) => list.iter().map(count).sum(),
        Value::Object(object) => object
            .iter()
            .filter(|(key, _)| is_compared(key))
            .map(|(_, value)| count(value))
            .sum(),
        _ => 0,
    }
}

/// The set of active nodes is not unique, and a remark is no number.
fn is_compared(key: &str) -> bool {
    !key.starts_with("active") && key != "note"
}

fn fold(parts: impl Iterator<Item = Option<(f64, f64)>>) -> Option<(f64, f64)> {
    let mut all = (0.0, 0.0);
    for part in parts {
        let (difference, entry) = part?;
        all = (f64::max(all.0, difference), f64::max(all.1, entry));
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_relative_to_the_largest_entry() {
        let q = Quantity::compare(
            "u",
            json!([1.0, 1e-9]),
            &json!([1.0, 0.0]),
            &json!({"rel": 1e-8}),
        );
        assert!(q.is_within());
        assert!((q.error_rel - 1e-9).abs() < 1e-20);
    }

    #[test]
    fn a_missing_or_wrongly_shaped_value_is_never_within() {
        let tolerance = json!({"rel": 1.0});
        for computed in [json!(null), json!([1.0]), json!({"a": 1.0}), json!("1")] {
            assert!(!Quantity::compare("u", computed, &json!([1.0, 2.0]), &tolerance).is_within());
        }
        let contact = json!({"force_on_tool_N": [1.0, 0.0, 0.0]});
        assert!(!Quantity::compare("c", json!({}), &contact, &tolerance).is_within());
    }

    #[test]
    fn what_is_only_told_is_within_if_it_is_finite() {
        let told = |computed: Value| {
            Quantity::compare("f", computed, &json!([1.0]), &json!({"rel": 1e-6})).informative()
        };
        let off = told(json!([2.0]));
        assert!(off.is_within() && off.is_informative() && off.error_rel == 1.0);
        assert!(!told(json!([f64::NAN])).is_within());
        assert!(!told(json!({"a": [[1.0, null]]})).is_within());
    }

    #[test]
    fn a_value_without_a_number_is_never_within() {
        let tolerance = json!({"rel": 0.5});
        for value in [
            json!({}),
            json!([]),
            json!([[], []]),
            json!({"12": []}),
            json!({"note": "nothing"}),
            json!({"active": [1, 2]}),
            json!({"sample_displacement_m": {}}),
            json!({"one_pass_planes_at_rest": {"active_count": 3}}),
        ] {
            let q = Quantity::compare("u", value.clone(), &value, &tolerance);
            assert!(!q.is_within(), "{value}");
            assert_eq!(q.error_rel, f64::INFINITY);
        }
    }
}

//! What a walk gives, in the shape of the expected values.

use glam::DVec3;
use serde_json::{Value, json};

use super::walk::Listed;
use crate::study::verify::Failure;
use crate::study::verify::case::Case;
use crate::study::verify::contact_case::{Touchable, on_all_nodes};

/// One entry for each listed pose.
pub(super) fn path(listed: &[Listed]) -> Value {
    let vectors = |of: fn(&Listed) -> DVec3| -> Vec<[f64; 3]> {
        listed.iter().map(|l| of(l).to_array()).collect()
    };
    let numbers = |of: fn(&Listed) -> f64| -> Vec<f64> { listed.iter().map(of).collect() };
    let counts = |of: fn(&Listed) -> u32| -> Vec<u32> { listed.iter().map(of).collect() };
    json!({
        "force_on_tool_N": vectors(|l| l.force),
        "torque_on_tool_Nm": vectors(|l| l.torque),
        "dissipated_J": numbers(|l| l.dissipated),
        "elastic_energy_J": numbers(|l| l.elastic_energy),
        "work_total_J": numbers(|l| l.work),
        "normal_force_sum_N": numbers(Listed::normal_force_sum),
        "sticking": counts(|l| l.sticking),
        "slipping": counts(|l| l.slipping),
    })
}

/// Largest and smallest force along the expected axis, and what the whole way took.
pub(super) fn summary(case: &Case, listed: &[Listed], quantity: &Value) -> Value {
    let expected = &quantity["value"];
    let rel = quantity["tolerance"]["rel"].as_f64().unwrap_or(0.0);
    let name = expected["axis"].as_str().unwrap_or("y");
    let axis = ["x", "y", "z"].iter().position(|a| *a == name).unwrap_or(1);
    let forces: Vec<f64> = listed.iter().map(|l| l.force[axis]).collect();
    let peak = largest(&forces, &expected["peak_pose"], rel);
    let opposite: Vec<f64> = forces.iter().map(|f| -f).collect();
    let least = largest(&opposite, &expected["min_pose"], rel);
    let at = |k: usize| case.poses.get(k).map(|pose| pose.axis_point[axis]);
    json!({
        "axis": name,
        "peak_force_N": forces.get(peak),
        "peak_pose": peak + 1,
        "peak_at_m": at(peak),
        "min_force_N": forces.get(least),
        "min_pose": least + 1,
        "min_at_m": at(least),
        "dissipated_total_J": listed.iter().map(|l| l.dissipated).sum::<f64>(),
        "work_total_J": listed.last().map(|l| l.work),
    })
}

/// Where the largest is: at the expected pose, if it is there to the tolerance. A tool that comes through a place twice
/// has its peak twice, and round-off would say where.
fn largest(values: &[f64], expected_pose: &Value, rel: f64) -> usize {
    let mut first = 0;
    for (k, value) in values.iter().enumerate() {
        if *value > values[first] {
            first = k;
        }
    }
    let asked = expected_pose
        .as_u64()
        .map(|pose| (pose as usize).wrapping_sub(1));
    match asked.and_then(|k| Some((k, values.get(k)?))) {
        Some((k, value)) if values[first] - value <= rel * values[first].abs() => k,
        _ => first,
    }
}

/// Forces and displacements at one pose.
pub(super) fn state(
    listed: &Listed,
    ready: &Touchable,
    expected: &Value,
) -> Result<Value, Failure> {
    let elastic = &ready.elastic;
    let u = elastic.factor.solve(&on_all_nodes(ready, &listed.active));
    let active: Vec<Value> = listed
        .active
        .iter()
        .map(|c| {
            let node = ready.candidates[c.candidate as usize] as usize;
            json!({
                "node": elastic.mesh.node_tags[node],
                "normal_force_N": c.normal_force,
                "force_on_part_N": c.force_on_part.to_array(),
            })
        })
        .collect();
    Ok(json!({
        "pose": expected["pose"],
        "force_on_tool_N": listed.force.to_array(),
        "torque_on_tool_Nm": listed.torque.to_array(),
        "sample_displacement_m": elastic.by_tag(&expected["sample_displacement_m"], &u)?,
        "active": active,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_that_is_there_twice_is_where_it_is_expected() {
        let forces = [0.0, 2.0, 1.0, 2.0 * (1.0 - 1e-9), 1.5];
        for (expected, rel, at) in [
            (json!(4), 1e-6, 3),
            (json!(2), 1e-6, 1),
            (json!(4), 1e-12, 1),
            (json!(5), 1e-6, 1),
            (json!(0), 1e-6, 1),
            (json!(99), 1e-6, 1),
            (json!(null), 1e-6, 1),
        ] {
            assert_eq!(largest(&forces, &expected, rel), at, "{expected}");
        }
    }
}

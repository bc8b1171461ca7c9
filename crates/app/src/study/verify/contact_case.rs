//! Contact with a rigid tool at given poses, with fixed-point planes and in the paper's single
//! pass, through the same engine that the hand feels.

mod insertion;

use std::path::Path;
use std::sync::Arc;

use contact::delassus::ComplianceBlocks;
use contact::friction::Coefficients;
use contact::lcp;
use contact::tool::{BoxShape, Capsule, Cylinder, HalfSpace, Sphere, Tool};
use fem::Compliance;
use fem::stress::Extremes;
use glam::{DQuat, DVec3};
use glamx::DPose3;
use serde_json::{Map, Value, json};

use super::case::{Case, RawPose};
use super::elastic_case::Elastic;
use super::{Failure, Outcome, Quantity};
use crate::engine::{
    ActiveContact, ContactIterations, ContactPart, Engine, EngineSettings, Plan, StepReport,
};
use crate::progress::Ui;

/// m. As the reference: planes stand still when no displacement changes by more.
const STANDSTILL: f64 = 1e-14;

/// A part ready for contact, under one quadrature rule.
pub(super) struct Touchable {
    pub(super) elastic: Elastic,
    pub(super) part: Arc<ContactPart>,
    pub(super) candidates: Vec<u32>,
    pub(super) tool: Tool,
}

pub(super) fn run(case: &Case, ui: &Ui<'_>) -> Outcome {
    let path = &case.mesh_paths[0];
    let mut ready: Vec<Touchable> = Vec::new();
    let mut quantities = Vec::new();
    for quantity in case.quantities() {
        let quadrature = case.quadrature(quantity)?;
        let at = match ready
            .iter()
            .position(|t| t.elastic.quadrature == quadrature)
        {
            Some(at) => at,
            None => {
                ready.push(touchable(
                    case,
                    path,
                    Elastic::new(case, path, quadrature, ui)?,
                    ui,
                )?);
                ready.len() - 1
            }
        };
        quantities.push(compute(case, quantity, &ready[at])?);
    }
    Ok((String::new(), quantities))
}

pub(super) fn touchable(
    case: &Case,
    path: &Path,
    elastic: Elastic,
    ui: &Ui<'_>,
) -> Result<Touchable, Failure> {
    let group = case.contact_group.as_deref().ok_or_else(|| {
        Failure::Error("case.toml: a contact case needs [contact] with its group".into())
    })?;
    let candidates: Vec<u32> = case
        .nodes(&elastic.mesh, group, path)?
        .iter()
        .copied()
        .filter(|&n| !elastic.supports.is_fixed_in_all(n))
        .collect();
    let compliance = Compliance::build(&elastic.factor, &candidates, &candidates, &ui.progress())
        .map_err(Failure::in_file(path))?;
    let rest = candidates
        .iter()
        .map(|&n| DVec3::from_array(elastic.mesh.nodes[n as usize]))
        .collect();
    let part = Arc::new(ContactPart::new(rest, candidates.len(), compliance.blocks));
    Ok(Touchable {
        elastic,
        part,
        candidates,
        tool: tool(case)?,
    })
}

fn tool(case: &Case) -> Result<Tool, Failure> {
    let raw = case
        .tool
        .as_ref()
        .ok_or_else(|| Failure::Error("case.toml: a contact case needs [tool]".into()))?;
    let radius = || {
        raw.radius
            .ok_or_else(|| Failure::Error("case.toml: [tool] needs `radius`".into()))
    };
    let half_length = || {
        raw.half_length
            .ok_or_else(|| Failure::Error("case.toml: [tool] needs `half_length`".into()))
    };
    match raw.shape.as_str() {
        "cylinder" => Cylinder::new(radius()?, raw.half_length).map(Tool::Cylinder),
        "sphere" => Sphere::new(radius()?).map(Tool::Sphere),
        "capsule" => Capsule::new(radius()?, half_length()?).map(Tool::Capsule),
        "half-space" => Ok(Tool::HalfSpace(HalfSpace)),
        "box" => {
            let half_extents = raw
                .half_extents
                .ok_or_else(|| Failure::Error("case.toml: [tool] needs `half_extents`".into()))?;
            BoxShape::new(DVec3::from_array(half_extents)).map(Tool::Box)
        }
        other => return Err(Failure::NotSupported(format!("tool shape {other:?}"))),
    }
    .map_err(|e| Failure::Error(format!("case.toml: [tool]: {e}")))
}

pub(super) fn pose(raw: &RawPose) -> Result<DPose3, Failure> {
    let axis = DVec3::from_array(raw.axis_direction.unwrap_or([0.0, 0.0, 1.0]));
    let unit = axis
        .try_normalize()
        .ok_or_else(|| Failure::Error("case.toml: a pose's direction has no length".into()))?;
    Ok(DPose3 {
        translation: DVec3::from_array(raw.axis_point),
        rotation: DQuat::from_rotation_arc(DVec3::Z, unit),
    })
}

fn compute(case: &Case, quantity: &Value, ready: &Touchable) -> Result<Quantity, Failure> {
    let name = quantity["name"].as_str().unwrap_or_default();
    let expected = &quantity["value"];
    let undercut = || {
        case.undercut
            .ok_or_else(|| Failure::Error("case.toml: [handbook] needs `undercut`".into()))
    };
    let computed = if name.starts_with("compliance") {
        ready.elastic.compliance_block(quantity)?
    } else if let Some(index) = pose_index(name, &["contact.pose", "contact.depth"]) {
        at_pose(case, ready, pose_of(case, index)?, expected)?
    } else if let Some(index) = pose_index(name, &["lcp.pose"]) {
        rest_problem(ready, &pose(pose_of(case, index)?)?, expected)?
    } else if name.starts_with("insertion.") {
        insertion::run(case, ready, quantity)?
    } else if name == "catch_edge_stiffness" {
        json!(edge_stiffness(&ready.elastic, quantity)?)
    } else if name == "deflection_force_fe" {
        let stiffness = case
            .quantities()
            .find(|q| q["name"] == "catch_edge_stiffness")
            .ok_or_else(|| {
                Failure::Error(
                    "expected.json: deflection_force_fe needs catch_edge_stiffness".into(),
                )
            })?;
        json!(edge_stiffness(&ready.elastic, stiffness)? * undercut()?)
    } else {
        return Err(Failure::NotSupported(format!("quantity {name:?}")));
    };
    Ok(Quantity::compare(
        name,
        computed,
        expected,
        &quantity["tolerance"],
    ))
}

fn pose_index(name: &str, prefixes: &[&str]) -> Option<usize> {
    let rest = prefixes.iter().find_map(|p| name.strip_prefix(p))?;
    rest.split('.').next()?.parse().ok()
}

fn pose_of(case: &Case, index: usize) -> Result<&RawPose, Failure> {
    index
        .checked_sub(1)
        .and_then(|i| case.poses.get(i))
        .ok_or_else(|| Failure::Error(format!("case.toml has no [[pose]] number {index}")))
}

fn engine(
    ready: &Touchable,
    iterations: ContactIterations,
    near_distance: f64,
) -> Result<Engine, Failure> {
    engine_of(&ready.part, &ready.tool, iterations, near_distance, None)
}

/// An engine whose tool goes where it is told, in one go. `friction`: Coulomb's coefficient, `None` for none.
pub(super) fn engine_of(
    part: &Arc<ContactPart>,
    tool: &Tool,
    iterations: ContactIterations,
    near_distance: f64,
    friction: Option<f64>,
) -> Result<Engine, Failure> {
    let settings = EngineSettings {
        contact_iterations: iterations,
        displacement_tolerance: STANDSTILL,
        near_distance,
        max_contacts: part.n_candidates(),
        merge_tolerance: 0.0,
        lcp: lcp::Settings::default(),
        max_stride: f64::INFINITY,
    };
    let plan = Plan {
        friction: friction.map(Coefficients::constant),
        ..Plan::new(part.clone(), tool.clone(), None, settings)
    };
    Engine::new(plan).map_err(|e| Failure::Error(e.to_string()))
}

/// Walks the tool in from where it is free, which picks the branch, and reports the equilibrium.
fn at_pose(
    case: &Case,
    ready: &Touchable,
    raw: &RawPose,
    expected: &Value,
) -> Result<Value, Failure> {
    let target = pose(raw)?;
    let stride = stride(ready);
    let mut walker = engine(ready, case.iterations, 2.0 * stride)?;
    // A half-space has no path through the poses: each is entered along its own normal.
    let first = match case.poses.first() {
        Some(first) if case.tool.as_ref().is_some_and(|t| t.shape != "half-space") => pose(first)?,
        _ => target,
    };
    let back = retreat_direction(ready, &first);
    let mut n_strides = 0;
    let at = |k: i32| DPose3 {
        translation: target.translation + back * (stride * f64::from(k)),
        ..target
    };
    while n_strides < 2000 && touches_at_rest(ready, &at(n_strides)) && back != DVec3::ZERO {
        n_strides += 1;
    }
    let mut report = walker.step(&at(n_strides));
    for k in (0..n_strides).rev() {
        report = walker.step(&at(k));
    }
    require_converged(&report)?;

    let force = nodal_forces(ready, &walker);
    let u = ready.elastic.factor.solve(&force);
    let mut object = Map::new();
    let [fx, fy, fz, tx, ty, tz] = report.contact_wrench_on_tool;
    object.insert("force_on_tool_N".into(), json!([fx, fy, fz]));
    object.insert("torque_on_tool_Nm".into(), json!([tx, ty, tz]));
    object.insert("active_count".into(), json!(report.contacts));
    let active: Vec<Value> = walker
        .active_contacts()
        .iter()
        .map(|c| {
            let node = ready.candidates[c.candidate as usize] as usize;
            let normal = c.force_on_part / c.normal_force;
            json!({
                "node": ready.elastic.mesh.node_tags[node],
                "normal_force_N": c.normal_force,
                "normal": normal.to_array(),
            })
        })
        .collect();
    object.insert("active".into(), json!(active));
    object.insert(
        "sample_displacement_m".into(),
        ready
            .elastic
            .by_tag(&expected["sample_displacement_m"], &u)?,
    );
    let largest = u.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    object.insert("max_displacement_m".into(), json!(largest));
    object.insert("iterations".into(), json!(report.passes));
    object.insert("certificate".into(), json!(report.certificate));
    let extremes = extremes(case, ready, &u)?;
    object.insert(
        "max_principal_strain".into(),
        json!(extremes.max_principal_strain),
    );
    object.insert("max_von_mises_Pa".into(), json!(extremes.max_von_mises));
    object.insert("max_rotation_rad".into(), json!(extremes.max_rotation));
    object.insert("one_pass_planes_at_rest".into(), one_pass(ready, &target)?);
    Ok(Value::Object(object))
}

/// m, tool motion between two equilibria on the way in: a fiftieth of the tool's size, or of the
/// part's where the tool has no size or is larger.
pub(super) fn stride(ready: &Touchable) -> f64 {
    crate::session::part_extent(&ready.elastic.mesh).min(ready.tool.characteristic_size()) / 50.0
}

/// The paper's single pass from rest: planes of all candidates at their undeformed positions.
fn one_pass(ready: &Touchable, target: &DPose3) -> Result<Value, Failure> {
    const ALL: f64 = 1e6;
    let mut engine = engine(ready, ContactIterations::Fixed(1), ALL)?;
    let report = engine.step(target);
    Ok(json!({
        "force_on_tool_N": report.contact_force_on_tool().to_array(),
        "active_count": report.contacts,
    }))
}

fn require_converged(report: &StepReport) -> Result<(), Failure> {
    if report.converged && report.lcp_solved {
        return Ok(());
    }
    Err(Failure::Error(format!(
        "the contact planes did not come to a stand within {} passes (certificate {:.1e})",
        report.passes, report.certificate
    )))
}

/// Against the mean normal of the nodes that the tool overlaps at rest; zero if there are none.
fn retreat_direction(ready: &Touchable, pose: &DPose3) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for &x in ready.part.rest_positions() {
        let surface = ready.tool.signed_distance(pose, x);
        if surface.signed_distance < 0.0 {
            sum -= surface.normal;
        }
    }
    sum.normalize_or_zero()
}

pub(super) fn touches_at_rest(ready: &Touchable, pose: &DPose3) -> bool {
    ready
        .part
        .rest_positions()
        .iter()
        .any(|&x| ready.tool.signed_distance(pose, x).signed_distance < 0.0)
}

/// Contact forces on all degrees of freedom of the mesh, N.
fn nodal_forces(ready: &Touchable, engine: &Engine) -> Vec<f64> {
    on_all_nodes(ready, engine.active_contacts())
}

/// The same of contacts that were kept.
pub(super) fn on_all_nodes(ready: &Touchable, active: &[ActiveContact]) -> Vec<f64> {
    let mut force = vec![0.0; 3 * ready.elastic.mesh.n_nodes()];
    for c in active {
        let at = 3 * ready.candidates[c.candidate as usize] as usize;
        force[at..at + 3].copy_from_slice(&c.force_on_part.to_array());
    }
    force
}

fn extremes(case: &Case, ready: &Touchable, u: &[f64]) -> Result<Extremes, Failure> {
    let path = &case.mesh_paths[0];
    let (materials, of_element) = case.materials(&ready.elastic.mesh, path)?;
    Ok(Extremes::of(
        &ready.elastic.mesh,
        &materials,
        &of_element,
        u,
    ))
}

/// The complementarity problem of the nodes that the tool overlaps at rest.
fn rest_problem(ready: &Touchable, pose: &DPose3, expected: &Value) -> Result<Value, Failure> {
    let mut rows = Vec::new();
    for tag in expected["nodes"].as_array().into_iter().flatten() {
        let node = ready.elastic.node(tag.as_u64())? as u32;
        let candidate = ready.candidates.binary_search(&node).map_err(|_| {
            Failure::Error(format!(
                "expected.json: node {tag} is not among those that can touch"
            ))
        })?;
        let surface = ready
            .tool
            .signed_distance(pose, ready.part.rest_positions()[candidate]);
        rows.push((candidate, surface.normal, surface.signed_distance));
    }
    let m = rows.len();
    let mut matrix = vec![0.0; m * m];
    for (j, b) in rows.iter().enumerate() {
        for (i, a) in rows.iter().enumerate() {
            matrix[j * m + i] = a.1.dot(ready.part.block(a.0, b.0) * b.1);
        }
    }
    // C is symmetric to round-off; the problem is to be so to the bit.
    for j in 0..m {
        for i in 0..j {
            let mean = 0.5 * (matrix[j * m + i] + matrix[i * m + j]);
            matrix[j * m + i] = mean;
            matrix[i * m + j] = mean;
        }
    }
    let q: Vec<f64> = rows.iter().map(|r| r.2).collect();
    let problem = lcp::Problem::new(&matrix, &q).map_err(|e| Failure::Error(e.to_string()))?;
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    lcp::solve(
        &problem,
        &lcp::Settings::default(),
        &mut lcp::Scratch::new(m),
        lcp::Start::Cold,
        &mut z,
        &mut w,
    )
    .map_err(|e| Failure::Error(e.to_string()))?;
    let by_row: Vec<&[f64]> = matrix.chunks_exact(m.max(1)).collect();
    Ok(json!({ "nodes": expected["nodes"], "q": q, "M": by_row, "solution_z": z }))
}

/// Force in -y, spread over the edge by weights, over its work-mean deflection, N/m.
fn edge_stiffness(elastic: &Elastic, quantity: &Value) -> Result<f64, Failure> {
    let tags = quantity["edge_nodes"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    let weights = quantity["edge_weights"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    let mut force = vec![0.0; 3 * elastic.mesh.n_nodes()];
    let mut total = 0.0;
    for (tag, weight) in tags.iter().zip(weights) {
        let weight = weight.as_f64().unwrap_or(f64::NAN);
        force[3 * elastic.node(tag.as_u64())? + 1] -= weight;
        total += weight;
    }
    let u = elastic.factor.solve(&force);
    let work: f64 = force.iter().zip(&u).map(|(f, u)| f * u).sum();
    Ok(total * total / work)
}

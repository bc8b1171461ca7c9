//! Cases without contact: patch tests, loaded parts, convergence towards an exact field.

use std::path::Path;

use fem::{FactoredStiffness, Mesh, Quadrature, Stiffness, Supports};
use serde_json::{Map, Value, json};

use super::case::{Case, Field};
use super::files::wrong;
use super::{Failure, Outcome, Quantity};
use crate::progress::Ui;

/// Mesh, supports, stiffness and factor under one quadrature rule.
pub(super) struct Elastic {
    pub(super) mesh: Mesh,
    pub(super) supports: Supports,
    pub(super) stiffness: Stiffness,
    pub(super) factor: FactoredStiffness,
    pub(super) quadrature: Quadrature,
}

impl Elastic {
    pub(super) fn new(
        case: &Case,
        path: &Path,
        quadrature: Quadrature,
        ui: &Ui<'_>,
    ) -> Result<Self, Failure> {
        let (mesh, supports) = case.load_mesh(path)?;
        let (materials, of_element) = case.materials(&mesh, path)?;
        let stiffness = fem::assemble_stiffness(&mesh, &materials, &of_element, quadrature)
            .map_err(Failure::in_file(path))?;
        let factor = FactoredStiffness::new(&stiffness, &supports, &ui.progress())
            .map_err(Failure::in_file(path))?;
        Ok(Self {
            mesh,
            supports,
            stiffness,
            factor,
            quadrature,
        })
    }

    /// Value by node tag, in the keys of the expected object.
    pub(super) fn by_tag(&self, keys: &Value, u: &[f64]) -> Result<Value, Failure> {
        let mut object = Map::new();
        for key in keys.as_object().into_iter().flat_map(Map::keys) {
            let node = self.node(key.parse().ok())?;
            object.insert(key.clone(), json!(u[3 * node..3 * node + 3]));
        }
        Ok(Value::Object(object))
    }

    /// Node index of a tag in the mesh file.
    pub(super) fn node(&self, tag: Option<u64>) -> Result<usize, Failure> {
        tag.and_then(|t| self.mesh.node_of_tag(t))
            .map(|n| n as usize)
            .ok_or_else(|| {
                Failure::Error(format!(
                    "expected.json names node {tag:?}, which is not in the mesh"
                ))
            })
    }

    /// Block of the compliance for the nodes that a quantity lists.
    pub(super) fn compliance_block(&self, quantity: &Value) -> Result<Value, Failure> {
        let nodes: Vec<usize> = quantity["nodes"]
            .as_array()
            .into_iter()
            .flatten()
            .map(|tag| self.node(tag.as_u64()))
            .collect::<Result<_, _>>()?;
        let mut block = vec![vec![0.0; 3 * nodes.len()]; 3 * nodes.len()];
        for (j, &loaded) in nodes.iter().enumerate() {
            for c in 0..3 {
                let mut force = vec![0.0; 3 * self.mesh.n_nodes()];
                force[3 * loaded + c] = 1.0;
                let u = self.factor.solve(&force);
                for (i, &node) in nodes.iter().enumerate() {
                    for r in 0..3 {
                        block[3 * i + r][3 * j + c] = u[3 * node + r];
                    }
                }
            }
        }
        Ok(json!(block))
    }
}

/// Displacement, load and energy of a case on one mesh.
struct Solved {
    elastic: Elastic,
    force: Vec<f64>,
    total_force: f64,
    u: Vec<f64>,
}

fn solve(case: &Case, path: &Path, quadrature: Quadrature, ui: &Ui<'_>) -> Result<Solved, Failure> {
    let elastic = Elastic::new(case, path, quadrature, ui)?;
    let mesh = &elastic.mesh;
    let mut force = vec![0.0; 3 * mesh.n_nodes()];
    let mut total_force = 0.0;
    for load in &case.loads {
        let group = mesh.group(&load.group).ok_or_else(|| {
            Failure::Error(format!(
                "{}: has no physical group {:?}",
                path.display(),
                load.group
            ))
        })?;
        let nodal = match (load.force, load.pressure) {
            (Some(total), None) => {
                total_force += total.iter().map(|f| f * f).sum::<f64>().sqrt();
                fem::load::traction_of_total_force(mesh, group, total)
            }
            (None, Some(pressure)) => fem::load::pressure(mesh, group, pressure),
            _ => {
                return Err(Failure::Error(format!(
                    "case.toml: load on {:?} needs either `force` or `pressure`",
                    load.group
                )));
            }
        }
        .map_err(Failure::in_file(path))?;
        for (sum, f) in force.iter_mut().zip(nodal) {
            *sum += f;
        }
    }
    let u = match &case.prescribed {
        Some((group, field)) => {
            let mut prescribed = vec![0.0; 3 * mesh.n_nodes()];
            for &node in case.nodes(mesh, group, path)? {
                let (at, x) = (3 * node as usize, mesh.nodes[node as usize]);
                let u = field.at(x);
                if u.iter().any(|c| !c.is_finite()) {
                    return Err(wrong(
                        &case.dir.join("case.toml"),
                        &format!(
                            "the prescribed field at {x:?} m is {u:?}, which is no displacement"
                        ),
                    ));
                }
                prescribed[at..at + 3].copy_from_slice(&u);
            }
            elastic
                .factor
                .solve_prescribed(&elastic.stiffness, &force, &prescribed)
        }
        None => elastic.factor.solve(&force),
    };
    Ok(Solved {
        elastic,
        force,
        total_force,
        u,
    })
}

/// Computes what an `error` case must be refused for, and compares nothing.
pub(super) fn solve_only(case: &Case, ui: &Ui<'_>) -> Result<(), Failure> {
    solve(case, &case.mesh_paths[0], case.own_quadrature(), ui).map(|_| ())
}

/// Runs a `patch` or `static` case.
pub(super) fn run(case: &Case, ui: &Ui<'_>) -> Outcome {
    let path = &case.mesh_paths[0];
    let mut solved: Vec<Solved> = Vec::new();
    let mut quantities = Vec::new();
    for quantity in case.quantities() {
        let quadrature = case.quadrature(quantity)?;
        let known = solved
            .iter()
            .position(|s| s.elastic.quadrature == quadrature);
        let at = match known {
            Some(at) => at,
            None => {
                solved.push(solve(case, path, quadrature, ui)?);
                solved.len() - 1
            }
        };
        quantities.push(compute(case, quantity, &solved[at])?);
    }
    Ok((String::new(), quantities))
}

fn compute(case: &Case, quantity: &Value, solved: &Solved) -> Result<Quantity, Failure> {
    let name = quantity["name"].as_str().unwrap_or_default();
    let Solved {
        elastic,
        force,
        total_force,
        u,
    } = solved;
    let expected = &quantity["value"];
    let mut holds = true;
    let computed = if name == "displacement" {
        if let Some((_, field)) = &case.prescribed {
            holds = largest_error(&elastic.mesh, u, field)
                <= quantity["tolerance"]["rel"].as_f64().unwrap_or(0.0);
        }
        elastic.by_tag(expected, u)?
    } else if name == "work_mean_displacement" {
        if *total_force == 0.0 {
            return Err(wrong(
                &case.dir.join("case.toml"),
                "work_mean_displacement needs a [[load]] with a `force` that is not zero",
            ));
        }
        let work: f64 = force.iter().zip(u).map(|(f, u)| f * u).sum();
        json!(work / total_force)
    } else if name == "strain_energy" {
        json!(elastic.stiffness.strain_energy(u))
    } else if name == "stress_at_point" {
        let point = point_of(&quantity["point_m"])?;
        let path = &case.mesh_paths[0];
        let (materials, of_element) = case.materials(&elastic.mesh, path)?;
        let stress = fem::stress::stress_at_point(&elastic.mesh, &materials, &of_element, u, point)
            .map_err(Failure::in_file(path))?;
        json!(stress)
    } else if name.starts_with("radial_displacement") {
        let path = &case.mesh_paths[0];
        let mean = |group: &str| -> Result<f64, Failure> {
            let nodes = case.nodes(&elastic.mesh, group, path)?;
            let sum: f64 = nodes
                .iter()
                .map(|&n| {
                    let n = n as usize;
                    let [x, y, _] = elastic.mesh.nodes[n];
                    (u[3 * n] * x + u[3 * n + 1] * y) / x.hypot(y)
                })
                .sum();
            Ok(sum / nodes.len() as f64)
        };
        json!([mean("load")?, mean("outer")?])
    } else if name.starts_with("compliance") {
        elastic.compliance_block(quantity)?
    } else {
        return Err(Failure::NotSupported(format!("quantity {name:?}")));
    };
    Ok(Quantity::compare(name, computed, expected, &quantity["tolerance"]).and(holds))
}

/// Largest nodal distance from the field, relative to the largest displacement.
fn largest_error(mesh: &Mesh, u: &[f64], field: &Field) -> f64 {
    let (mut error, mut size) = (0.0f64, 0.0f64);
    for (x, u) in mesh.nodes.iter().zip(u.chunks_exact(3)) {
        for (exact, u) in field.at(*x).into_iter().zip(u) {
            error = error.max((exact - u).abs());
            size = size.max(exact.abs());
        }
    }
    error / size
}

fn point_of(value: &Value) -> Result<[f64; 3], Failure> {
    serde_json::from_value(value.clone())
        .map_err(|e| Failure::Error(format!("expected.json: point_m: {e}")))
}

/// Runs a `convergence` case: errors on every mesh and the observed order between the last two.
pub(super) fn run_convergence(case: &Case, ui: &Ui<'_>) -> Outcome {
    let Some((_, field)) = &case.prescribed else {
        return Err(Failure::Error(
            "case.toml: a convergence case needs [prescribed] and its field".into(),
        ));
    };
    let mut rms = Vec::new();
    let mut energy = Vec::new();
    let mut l2 = Vec::new();
    let mut elements: Vec<f64> = Vec::new();
    let quadrature = case.own_quadrature();
    for path in &case.mesh_paths {
        let solved = solve(case, path, quadrature, ui)?;
        let Elastic {
            mesh,
            supports,
            stiffness,
            ..
        } = &solved.elastic;
        let mut sum = 0.0;
        let mut count = 0usize;
        for (n, x) in mesh
            .nodes
            .iter()
            .enumerate()
            .filter(|(n, _)| !supports.is_fixed(3 * n))
        {
            let exact = field.at(*x);
            sum += (0..3)
                .map(|c| (solved.u[3 * n + c] - exact[c]).powi(2))
                .sum::<f64>();
            count += 1;
        }
        rms.push((sum / count.max(1) as f64).sqrt());
        energy.push(stiffness.strain_energy(&solved.u));
        l2.push(fem::stress::l2_error(mesh, &solved.u, |x| field.at(x), 8));
        elements.push(mesh.n_elements() as f64);
    }
    // Uniform refinement: the element size goes with the cube root of their number.
    let rate = |errors: &[f64]| match errors {
        [.., coarse, fine] => {
            let [.., n_coarse, n_fine] = elements[..] else {
                return f64::NAN;
            };
            (coarse / fine).ln() / (n_fine / n_coarse).cbrt().ln()
        }
        _ => f64::NAN,
    };
    let mut quantities = Vec::new();
    for quantity in case.quantities() {
        let name = quantity["name"].as_str().unwrap_or_default();
        let computed = match name {
            "nodal_rms_error" => json!(rms),
            "strain_energy" => json!(energy),
            "rate_nodal_rms" => json!(rate(&rms)),
            "rate_L2" => json!(rate(&l2)),
            "L2_error" => json!(l2),
            _ => return Err(Failure::NotSupported(format!("quantity {name:?}"))),
        };
        quantities.push(Quantity::compare(
            name,
            computed,
            &quantity["value"],
            &quantity["tolerance"],
        ));
    }
    Ok((String::new(), quantities))
}

//! `case.toml` and `expected.json` of a reference case.

use std::path::{Path, PathBuf};

use fem::{Material, Mesh, Quadrature, Supports};
use serde::Deserialize;
use serde_json::Value;

use super::Failure;
use crate::engine::ContactIterations;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    Patch,
    Static,
    Convergence,
    Contact,
    Error,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum OneOrMore<T> {
    One(T),
    More(Vec<T>),
}

impl<T> OneOrMore<T> {
    fn as_slice(&self) -> &[T] {
        match self {
            Self::One(x) => std::slice::from_ref(x),
            Self::More(list) => list,
        }
    }
}

#[derive(Debug, Deserialize)]
struct RawMaterial {
    group: Option<String>,
    #[serde(rename = "E")]
    young_modulus: f64,
    nu: f64,
}

#[derive(Debug, Deserialize)]
struct RawFixed {
    group: String,
    components: Option<Vec<String>>,
}

/// A load on a group of faces.
#[derive(Debug, Deserialize)]
pub(super) struct Load {
    pub(super) group: String,
    /// N, total, as a uniform dead traction.
    pub(super) force: Option<[f64; 3]>,
    /// Pa, along the normal of the undeformed face, into the body.
    pub(super) pressure: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct RawPrescribed {
    group: String,
}

/// Polynomial displacement field: rows `[coefficient, i, j, k]`.
#[derive(Debug, Deserialize)]
pub(super) struct PolynomialField {
    scale: f64,
    length: f64,
    x: Vec<[f64; 4]>,
    y: Vec<[f64; 4]>,
    z: Vec<[f64; 4]>,
}

/// Exact displacement of a thick cylinder, u = (A + B / r²) (x, y, 0).
#[derive(Debug, Deserialize)]
#[allow(non_snake_case)]
pub(super) struct LameField {
    A: f64,
    B: f64,
}

#[derive(Debug, Deserialize)]
struct RawContact {
    group: String,
    friction: Option<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct RawTool {
    pub(super) shape: String,
    pub(super) radius: Option<f64>,
    pub(super) half_length: Option<f64>,
    pub(super) half_extents: Option<[f64; 3]>,
}

/// Pose of a tool, in the keys that suit its shape.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct RawPose {
    #[serde(alias = "centre", alias = "center", alias = "point")]
    pub(super) axis_point: [f64; 3],
    #[serde(alias = "normal")]
    pub(super) axis_direction: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
struct RawHandbook {
    undercut: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct RawCase {
    kind: Kind,
    mesh: Option<String>,
    meshes: Option<Vec<String>>,
    order: Option<u8>,
    geometry: Option<String>,
    units: Option<String>,
    contact_iterations: Option<toml::Value>,
    material: OneOrMore<RawMaterial>,
    fixed: Option<OneOrMore<RawFixed>>,
    #[serde(default)]
    load: Vec<Load>,
    prescribed: Option<RawPrescribed>,
    field: Option<PolynomialField>,
    lame: Option<LameField>,
    contact: Option<RawContact>,
    tool: Option<RawTool>,
    #[serde(default)]
    pose: Vec<RawPose>,
    handbook: Option<RawHandbook>,
}

/// A prescribed displacement.
#[derive(Debug)]
pub(super) enum Field {
    Polynomial(PolynomialField),
    Lame(LameField),
}

impl Field {
    /// Displacement at `x`, m.
    pub(super) fn at(&self, x: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Polynomial(f) => {
                let s = x.map(|c| c / f.length);
                [&f.x, &f.y, &f.z].map(|terms| {
                    let sum: f64 = terms
                        .iter()
                        .map(|t| t[0] * s[0].powf(t[1]) * s[1].powf(t[2]) * s[2].powf(t[3]))
                        .sum();
                    f.scale * sum
                })
            }
            Self::Lame(f) => {
                let factor = f.A + f.B / (x[0] * x[0] + x[1] * x[1]);
                [factor * x[0], factor * x[1], 0.0]
            }
        }
    }
}

/// A case, read and checked for what this program can do.
#[derive(Debug)]
pub(super) struct Case {
    pub(super) dir: PathBuf,
    pub(super) kind: Kind,
    pub(super) mesh_paths: Vec<PathBuf>,
    pub(super) order: Option<u8>,
    pub(super) curved: bool,
    materials: Vec<(Option<String>, Material)>,
    fixed: Vec<(String, [bool; 3])>,
    pub(super) loads: Vec<Load>,
    pub(super) prescribed: Option<(String, Field)>,
    pub(super) contact_group: Option<String>,
    pub(super) tool: Option<RawTool>,
    pub(super) poses: Vec<RawPose>,
    pub(super) iterations: ContactIterations,
    pub(super) undercut: Option<f64>,
    pub(super) expected: Value,
}

impl Case {
    pub(super) fn read(dir: &Path) -> Result<Self, Failure> {
        let path = dir.join("case.toml");
        let wrong = |what: String| Failure::Error(format!("{}: {what}", path.display()));
        let text = std::fs::read_to_string(&path).map_err(|e| wrong(e.to_string()))?;
        let raw: RawCase = toml::from_str(&text).map_err(|e| wrong(e.to_string()))?;

        let expected_path = dir.join("expected.json");
        let in_expected =
            |what: String| Failure::Error(format!("{}: {what}", expected_path.display()));
        let text =
            std::fs::read_to_string(&expected_path).map_err(|e| in_expected(e.to_string()))?;
        let expected: Value =
            serde_json::from_str(&text).map_err(|e| in_expected(e.to_string()))?;

        if let Some(units) = raw.units.as_deref().filter(|u| *u != "SI") {
            return Err(Failure::NotSupported(format!(
                "units {units:?}; cases are in SI"
            )));
        }
        if let Some(friction) = raw
            .contact
            .as_ref()
            .and_then(|c| c.friction)
            .filter(|f| *f != 0.0)
        {
            return Err(Failure::NotSupported(format!(
                "friction {friction}; contact is frictionless"
            )));
        }
        let iterations = match &raw.contact_iterations {
            None => ContactIterations::Converged,
            Some(toml::Value::String(s)) if s == "converged" => ContactIterations::Converged,
            Some(toml::Value::Integer(n @ 1..=50)) => ContactIterations::Fixed(*n as u32),
            Some(other) => {
                return Err(Failure::NotSupported(format!(
                    "contact_iterations = {other}"
                )));
            }
        };
        let mut materials = Vec::new();
        for m in raw.material.as_slice() {
            let material =
                Material::new(m.young_modulus, m.nu).map_err(|e| wrong(e.to_string()))?;
            materials.push((m.group.clone(), material));
        }
        let mut fixed = Vec::new();
        for f in raw.fixed.as_ref().map_or(&[][..], OneOrMore::as_slice) {
            fixed.push((
                f.group.clone(),
                components(f.components.as_deref()).map_err(&wrong)?,
            ));
        }
        let meshes = match (raw.mesh, raw.meshes) {
            (Some(mesh), None) => vec![mesh],
            (None, Some(meshes)) if !meshes.is_empty() => meshes,
            _ => return Err(wrong("needs either `mesh` or a list `meshes`".to_owned())),
        };
        let field = match (raw.field, raw.lame) {
            (Some(field), _) => Some(Field::Polynomial(field)),
            (None, Some(lame)) => Some(Field::Lame(lame)),
            (None, None) => None,
        };
        let prescribed = match (raw.prescribed, field) {
            (Some(p), Some(field)) => Some((p.group, field)),
            (Some(_), None) => {
                return Err(wrong("[prescribed] needs [field] or [lame]".to_owned()));
            }
            (None, _) => None,
        };
        let curved = match raw.geometry.as_deref() {
            None | Some("straight") => false,
            Some("curved") => true,
            Some(other) => return Err(Failure::NotSupported(format!("geometry {other:?}"))),
        };
        Ok(Self {
            dir: dir.to_path_buf(),
            kind: raw.kind,
            mesh_paths: meshes.iter().map(|m| dir.join(m)).collect(),
            order: raw.order,
            curved,
            materials,
            fixed,
            loads: raw.load,
            prescribed,
            contact_group: raw.contact.map(|c| c.group),
            tool: raw.tool,
            poses: raw.pose,
            iterations,
            undercut: raw.handbook.and_then(|h| h.undercut),
            expected,
        })
    }

    /// Quantities that are asked for: all that are not only informative.
    pub(super) fn quantities(&self) -> impl Iterator<Item = &Value> {
        self.expected["quantities"]
            .as_array()
            .map_or(&[][..], Vec::as_slice)
            .iter()
            .filter(|q| q["informative"] != Value::Bool(true))
    }

    /// The rule that a quantity was computed with.
    pub(super) fn quadrature(&self, quantity: &Value) -> Result<Quadrature, Failure> {
        match quantity["quadrature"].as_str() {
            Some("points-4") => Ok(Quadrature::Fast),
            Some("converged") => Ok(Quadrature::Converged),
            Some(other) => match other.strip_prefix("degree-").and_then(|n| n.parse().ok()) {
                Some(degree) => Ok(Quadrature::Degree(degree)),
                None => Err(Failure::NotSupported(format!("quadrature {other:?}"))),
            },
            // Straight elements are exact with the lowest rule.
            None if self.curved => Ok(Quadrature::Converged),
            None => Ok(Quadrature::Fast),
        }
    }

    /// Reads a mesh, holds it and finds what cannot be computed.
    pub(super) fn load_mesh(&self, path: &Path) -> Result<(Mesh, Supports), Failure> {
        let mesh = fem::mesh::gmsh::read(path).map_err(Failure::in_file(path))?;
        if let Some(order) = self.order
            && usize::from(order) != mesh.order as usize
        {
            return Err(Failure::Error(format!(
                "{}: elements of order {}, the case says {order}",
                path.display(),
                mesh.order as usize
            )));
        }
        let mut supports = Supports::new(mesh.n_nodes());
        for (name, components) in &self.fixed {
            for &node in self.nodes(&mesh, name, path)? {
                supports.fix_node(node, *components);
            }
        }
        if let Some((name, _)) = &self.prescribed {
            for &node in self.nodes(&mesh, name, path)? {
                supports.fix_node(node, [true; 3]);
            }
        }
        mesh.check(&supports).map_err(Failure::in_file(path))?;
        Ok((mesh, supports))
    }

    /// Materials and the one of each element.
    pub(super) fn materials(
        &self,
        mesh: &Mesh,
        path: &Path,
    ) -> Result<(Vec<Material>, Vec<u32>), Failure> {
        let mut of_element = vec![u32::MAX; mesh.n_elements()];
        for (k, (group, _)) in self.materials.iter().enumerate() {
            match group {
                None => of_element.iter_mut().for_each(|m| *m = k as u32),
                Some(name) => {
                    let group = mesh.group(name).ok_or_else(|| no_group(name, path))?;
                    for &e in &group.elements {
                        of_element[e as usize] = k as u32;
                    }
                }
            }
        }
        if let Some(e) = of_element.iter().position(|m| *m == u32::MAX) {
            return Err(Failure::Error(format!(
                "{}: element {} has no material",
                path.display(),
                mesh.element_tags[e]
            )));
        }
        Ok((self.materials.iter().map(|(_, m)| *m).collect(), of_element))
    }

    pub(super) fn nodes<'a>(
        &self,
        mesh: &'a Mesh,
        name: &str,
        path: &Path,
    ) -> Result<&'a [u32], Failure> {
        mesh.group(name)
            .map(|g| g.nodes.as_slice())
            .ok_or_else(|| no_group(name, path))
    }
}

fn no_group(name: &str, path: &Path) -> Failure {
    Failure::Error(format!(
        "{}: has no physical group {name:?}",
        path.display()
    ))
}

fn components(names: Option<&[String]>) -> Result<[bool; 3], String> {
    let Some(names) = names else {
        return Ok([true; 3]);
    };
    let mut held = [false; 3];
    for name in names {
        match name.as_str() {
            "x" => held[0] = true,
            "y" => held[1] = true,
            "z" => held[2] = true,
            other => return Err(format!("component {other:?} of [[fixed]] is not x, y or z")),
        }
    }
    Ok(held)
}

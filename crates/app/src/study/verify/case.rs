//! `case.toml` and `expected.json` of a reference case.

mod raw;

use std::path::{Path, PathBuf};

use fem::{Material, Mesh, Quadrature, Supports};
use serde_json::Value;

use super::files::{text, wrong};
use super::schema::nearest;
use super::{Failure, expected};
use crate::engine::ContactIterations;
pub(super) use raw::{Kind, Load, RawPose, RawTool};
use raw::{LameField, OneOrMore, PolynomialField, RawCase, RawFixed, RawMaterial};

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
    /// Coulomb's coefficient.
    pub(super) friction: Option<f64>,
    /// Increments between two poses of a path, each number walked for itself.
    pub(super) substeps: Vec<u32>,
    pub(super) iterations: ContactIterations,
    pub(super) undercut: Option<f64>,
    pub(super) expected: Value,
}

impl Case {
    /// Reads both files and checks all that can be checked without the mesh.
    pub(super) fn read(dir: &Path) -> Result<Self, Failure> {
        let path = dir.join("case.toml");
        if dir.join("problem.json").exists() {
            return Err(wrong(
                dir,
                "holds case.toml and problem.json; give each case a folder of its own",
            ));
        }
        let raw = RawCase::parse(&text(&path)?, &path)?;
        let not_in_si = raw.units.as_deref().filter(|u| *u != "SI");
        if let Some(units) = not_in_si {
            return Err(Failure::NotSupported(format!(
                "units {units:?}; cases are in SI"
            )));
        }
        let friction = raw.contact.as_ref().and_then(|c| c.friction);
        if raw.kind != Kind::ContactFriction
            && let Some(friction) = friction.filter(|f| *f != 0.0)
        {
            return Err(Failure::NotSupported(format!(
                "friction {friction} in a case of this kind; kind = \"contact-friction\" has it, along a path"
            )));
        }
        let curved = match raw.geometry.as_deref() {
            None | Some("straight") => false,
            Some("curved") => true,
            Some(other) => return Err(Failure::NotSupported(format!("geometry {other:?}"))),
        };
        let in_case = |what: String| wrong(&path, &what);
        check_numbers(&raw).map_err(in_case)?;
        let substeps = substeps(&raw).map_err(in_case)?;
        let expected = expected::read(&dir.join("expected.json"), raw.kind)?;
        if let Some(compare) = &raw.compare {
            check_compare(&compare.quantities, &expected, raw.kind).map_err(in_case)?;
        }
        let undercut = raw.handbook.as_ref().and_then(|h| h.undercut);
        Ok(Self {
            dir: dir.to_path_buf(),
            kind: raw.kind,
            mesh_paths: mesh_paths(dir, raw.mesh, raw.meshes).map_err(in_case)?,
            order: raw.order,
            curved,
            materials: materials(raw.material.as_slice()).map_err(in_case)?,
            fixed: fixed(raw.fixed.as_ref()).map_err(in_case)?,
            loads: raw.load,
            prescribed: prescribed(raw.prescribed.map(|p| p.group), raw.field, raw.lame)
                .map_err(in_case)?,
            contact_group: raw.contact.map(|c| c.group),
            tool: raw.tool,
            poses: raw.pose,
            friction,
            substeps,
            iterations: iterations(raw.contact_iterations.as_ref())?,
            undercut,
            expected,
        })
    }

    /// Quantities that are asked for: all that are not only informative.
    pub(super) fn quantities(&self) -> impl Iterator<Item = &Value> {
        self.all_quantities()
            .filter(|q| q["informative"] != Value::Bool(true))
    }

    /// With those that are only informative.
    pub(super) fn all_quantities(&self) -> impl Iterator<Item = &Value> {
        self.expected["quantities"]
            .as_array()
            .map_or(&[][..], Vec::as_slice)
            .iter()
    }

    /// The rule that a quantity was computed with.
    pub(super) fn quadrature(&self, quantity: &Value) -> Result<Quadrature, Failure> {
        match quantity["quadrature"].as_str() {
            Some(rule) => expected::quadrature(rule)
                .map_err(|e| wrong(&self.dir.join("expected.json"), &format!("quadrature: {e}"))),
            None => Ok(self.own_quadrature()),
        }
    }

    /// Where a quantity names no rule: straight elements are exact with the lowest.
    pub(super) fn own_quadrature(&self) -> Quadrature {
        if self.curved {
            Quadrature::Converged
        } else {
            Quadrature::Fast
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
        self.check_counts(&mesh, path)?;
        Ok((mesh, supports))
    }

    /// What the other programs counted in this mesh; another count is another mesh.
    fn check_counts(&self, mesh: &Mesh, path: &Path) -> Result<(), Failure> {
        let name = path.file_name().and_then(|name| name.to_str());
        let listed = self.expected["meshes"].as_array();
        let described = listed
            .and_then(|list| list.iter().find(|m| m["mesh"].as_str() == name))
            .unwrap_or(&self.expected["mesh"]);
        for (key, count) in [
            ("nodes", mesh.n_nodes()),
            ("elements", mesh.n_elements()),
            ("order", mesh.order as usize),
        ] {
            match described[key].as_u64() {
                Some(expected) if expected != count as u64 => {
                    return Err(wrong(
                        path,
                        &format!(
                            "{key} {count}, expected.json says {expected}; is it the mesh that the values are of?"
                        ),
                    ));
                }
                _ => {}
            }
        }
        Ok(())
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

/// TOML has `nan` and `inf`, and neither is a load, a place or a size.
fn check_numbers(raw: &RawCase) -> Result<(), String> {
    if let Some(order) = raw.order.filter(|order| !(1..=3).contains(order)) {
        return Err(format!("order = {order} must be 1, 2 or 3"));
    }
    let finite = |what: String, numbers: &[f64]| match numbers.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(format!("{what}: {x} is no number; give one")),
        None => Ok(()),
    };
    for load in &raw.load {
        let of = format!("[[load]] on {:?}", load.group);
        match (load.force, load.pressure) {
            (Some(force), None) => finite(of, &force)?,
            (None, Some(pressure)) => finite(of, &[pressure])?,
            _ => return Err(format!("{of} needs either `force` or `pressure`")),
        }
    }
    for (k, pose) in raw.pose.iter().enumerate() {
        let of = format!("[[pose]] number {}", k + 1);
        finite(of.clone(), &pose.axis_point)?;
        finite(of.clone(), &pose.axis_direction.unwrap_or_default())?;
        let turn = pose.turn.unwrap_or_default();
        finite(of.clone(), &turn)?;
        if turn.iter().any(|angle| angle.abs() > std::f64::consts::TAU) {
            return Err(format!(
                "{of}: turn {turn:?} is of more than a whole turn about an axis; give it in rad, or on several poses"
            ));
        }
    }
    match raw.contact.as_ref().and_then(|c| c.friction) {
        Some(mu) if !(mu.is_finite() && mu >= 0.0) => {
            return Err(format!(
                "[contact] friction = {mu} must be a number, zero or above"
            ));
        }
        _ => {}
    }
    if let Some(undercut) = raw.handbook.as_ref().and_then(|h| h.undercut) {
        finite("[handbook] undercut".to_owned(), &[undercut])?;
    }
    match &raw.field {
        Some(field) if field.length == 0.0 => Err("[field] length must not be zero".to_owned()),
        _ => Ok(()),
    }
}

/// Increments of the path of a case with friction; other cases have no path, and a turn there would do nothing.
fn substeps(raw: &RawCase) -> Result<Vec<u32>, String> {
    const RANGE: std::ops::RangeInclusive<i64> = 1..=1000;
    const KIND: &str = "belongs to kind = \"contact-friction\"";
    if raw.kind != Kind::ContactFriction {
        if raw.path.is_some() {
            return Err(format!("[path] {KIND}"));
        }
        return match raw.pose.iter().position(|pose| pose.turn.is_some()) {
            Some(k) => Err(format!("[[pose]] number {}: `turn` {KIND}", k + 1)),
            None => Ok(Vec::new()),
        };
    }
    if raw.pose.first().is_some_and(|pose| pose.turn.is_some()) {
        return Err(
            "[[pose]] number 1: `turn` is of the step that leads to a pose; the path starts here"
                .to_owned(),
        );
    }
    let listed = match &raw.path {
        Some(path) if !path.substeps.is_empty() => &path.substeps,
        _ => {
            return Err(
                "[path] substeps is missing: increments between two poses, such as [1, 2]"
                    .to_owned(),
            );
        }
    };
    match listed.iter().find(|n| !RANGE.contains(n)) {
        Some(n) => Err(format!(
            "[path] substeps: {n} must be a whole number from {} to {}",
            RANGE.start(),
            RANGE.end()
        )),
        None => Ok(listed.iter().map(|n| *n as u32).collect()),
    }
}

/// Each name that is to be compared is that of a quantity, whole or its first part: of one in expected.json, or of one
/// that is computed in such cases (a list is often that of all cases alike).
fn check_compare(names: &[String], expected: &Value, kind: Kind) -> Result<(), String> {
    let quantities = expected["quantities"].as_array();
    let mut known: Vec<&str> = quantities
        .into_iter()
        .flatten()
        .filter_map(|q| q["name"].as_str())
        .collect();
    known.extend(expected::names(kind));
    let is_there = |name: &String| {
        known.iter().any(|quantity| {
            let rest = quantity.strip_prefix(name.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    };
    match names.iter().find(|name| !is_there(name)) {
        Some(name) => Err(format!(
            "[compare] quantities: {name:?} is no quantity of such a case: {}",
            nearest(name, &known)
        )),
        None => Ok(()),
    }
}

fn iterations(raw: Option<&toml::Value>) -> Result<ContactIterations, Failure> {
    match raw {
        None => Ok(ContactIterations::Converged),
        Some(toml::Value::String(s)) if s == "converged" => Ok(ContactIterations::Converged),
        Some(toml::Value::Integer(n @ 1..=50)) => Ok(ContactIterations::Fixed(*n as u32)),
        Some(other) => Err(Failure::NotSupported(format!(
            "contact_iterations = {other}; \"converged\" and 1 to 50 are"
        ))),
    }
}

fn materials(raw: &[RawMaterial]) -> Result<Vec<(Option<String>, Material)>, String> {
    raw.iter()
        .map(|m| {
            let material = Material::new(m.young_modulus, m.nu).map_err(|e| e.to_string())?;
            Ok((m.group.clone(), material))
        })
        .collect()
}

fn fixed(raw: Option<&OneOrMore<RawFixed>>) -> Result<Vec<(String, [bool; 3])>, String> {
    raw.map_or(&[][..], OneOrMore::as_slice)
        .iter()
        .map(|f| Ok((f.group.clone(), components(f.components.as_deref())?)))
        .collect()
}

fn mesh_paths(
    dir: &Path,
    mesh: Option<String>,
    meshes: Option<Vec<String>>,
) -> Result<Vec<PathBuf>, String> {
    let names = match (mesh, meshes) {
        (Some(mesh), None) => vec![mesh],
        (None, Some(meshes)) if !meshes.is_empty() => meshes,
        _ => return Err("needs either `mesh` or a list `meshes`".to_owned()),
    };
    Ok(names.iter().map(|name| dir.join(name)).collect())
}

fn prescribed(
    group: Option<String>,
    field: Option<PolynomialField>,
    lame: Option<LameField>,
) -> Result<Option<(String, Field)>, String> {
    match (group, field, lame) {
        (None, None, None) => Ok(None),
        (Some(group), Some(field), None) => Ok(Some((group, Field::Polynomial(field)))),
        (Some(group), None, Some(lame)) => Ok(Some((group, Field::Lame(lame)))),
        (_, Some(_), Some(_)) => Err("[field] and [lame] are two fields; give one".to_owned()),
        (Some(_), None, None) => Err("[prescribed] needs [field] or [lame]".to_owned()),
        (None, _, _) => Err("[field] or [lame] without [prescribed], which says where".to_owned()),
    }
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

//! The part's mesh: read, held, and which of its nodes can touch.

use std::path::Path;

use fem::{Mesh, Order, Supports};

use super::interior::Interior;
use super::{GroupRef, LoadedPart, PartSpec};
use crate::Error;

/// Reads the mesh and finds everything that would make the stiffness singular or wrong.
///
/// # Errors
/// An unreadable mesh, a group that is not in it, elements that are inverted, a free rigid
/// motion, no node that can touch.
pub fn load(spec: &PartSpec) -> Result<LoadedPart, Error> {
    let path = &spec.mesh_path;
    let bytes = std::fs::read(path).map_err(Error::io(path, "read the mesh"))?;
    let mesh_hash = *blake3::hash(&bytes).as_bytes();
    let mut mesh = fem::mesh::gmsh::read_bytes(&bytes, path).map_err(|e| Error::part(path, e))?;
    if spec.length_scale != 1.0 {
        mesh.scale(spec.length_scale);
    }
    for _ in 0..spec.refinements {
        mesh = mesh.refined().map_err(|e| Error::part(path, e))?;
    }
    if let Some(order) = spec.order.and_then(Order::try_from_number) {
        mesh = mesh.with_order(order).map_err(|e| Error::part(path, e))?;
    }
    let supports = held(&mesh, spec)?;
    let mut warnings = mesh.check(&supports).map_err(|e| Error::part(path, e))?;
    let Touchable { candidates, held } = touchable(&mesh, spec, &supports, &mut warnings)?;
    let mut can_touch = vec![false; mesh.n_nodes()];
    for &node in &candidates {
        can_touch[node as usize] = true;
    }
    let mut rows = candidates.clone();
    rows.extend(
        mesh.surface_nodes()
            .into_iter()
            .filter(|&node| !can_touch[node as usize]),
    );
    let interior = Interior::of(&mesh, spec)?;
    Ok(LoadedPart {
        spec: spec.clone(),
        interior,
        mesh,
        supports,
        candidates,
        held,
        rows,
        warnings,
        mesh_hash,
    })
}

/// The held degrees of freedom of a mesh of the part.
pub(super) fn held(mesh: &Mesh, spec: &PartSpec) -> Result<Supports, Error> {
    let mut supports = Supports::new(mesh.n_nodes());
    for (name, components) in &spec.fixed {
        for &node in &group(mesh, name, &spec.mesh_path, "fixed")?.nodes {
            supports.fix_node(node, *components);
        }
    }
    Ok(supports)
}

/// Nodes of the contact groups, ascending.
struct Touchable {
    candidates: Vec<u32>,
    held: Vec<u32>,
}

/// Sorts the nodes of the contact groups. Those of no element are a leftover of the model, not the part's, and are told
/// in `warnings`.
fn touchable(
    mesh: &Mesh,
    spec: &PartSpec,
    supports: &Supports,
    warnings: &mut Vec<String>,
) -> Result<Touchable, Error> {
    let path = &spec.mesh_path;
    let mut is_of_part = vec![false; mesh.n_nodes()];
    for element in 0..mesh.n_elements() {
        for &node in mesh.element_nodes(element) {
            is_of_part[node as usize] = true;
        }
    }
    let mut is_of_contact = vec![false; mesh.n_nodes()];
    for name in &spec.contact {
        let nodes = &group(mesh, name, path, "contact")?.nodes;
        let loose = nodes.iter().filter(|node| !is_of_part[**node as usize]);
        let (n_loose, first) = (loose.clone().count(), loose.clone().next());
        if let Some(&first) = first {
            warnings.push(format!(
                "{n_loose} of {} nodes of the contact group {:?} are in no element (the first is node {}): a surface \
                 left over beside the part, or that of another body; nothing can touch them",
                nodes.len(),
                name.name,
                mesh.node_tags[first as usize],
            ));
        }
        for &node in nodes {
            is_of_contact[node as usize] = is_of_part[node as usize];
        }
    }
    let (held, candidates): (Vec<u32>, Vec<u32>) = (0..mesh.n_nodes() as u32)
        .filter(|&node| is_of_contact[node as usize])
        .partition(|&node| supports.is_fixed_in_all(node));
    if let (true, Some(first)) = (candidates.is_empty(), spec.contact.first()) {
        let why = if held.is_empty() {
            "no node of contact is in an element of"
        } else {
            "every node of contact is held in"
        };
        return Err(Error::Input(format!(
            "{}: {why} {}, so nothing that gives way can touch; name a group of faces that are free to move",
            first.place,
            path.display(),
        )));
    }
    Ok(Touchable { candidates, held })
}

fn group<'a>(
    mesh: &'a Mesh,
    wanted: &GroupRef,
    path: &Path,
    role: &str,
) -> Result<&'a fem::Group, Error> {
    let named = mesh.groups.iter().filter(|g| g.name == wanted.name);
    match named.collect::<Vec<_>>()[..] {
        [group] => Ok(group),
        [] => {
            let known: Vec<&str> = mesh.groups.iter().map(|g| g.name.as_str()).collect();
            let mend = if known.is_empty() {
                "it has none: name regions in Gmsh with Physical Surface(\"...\")".to_owned()
            } else {
                format!("it has {}", known.join(", "))
            };
            Err(Error::Input(format!(
                "{}: {role} names the group {:?}, which {} does not have; {mend}",
                wanted.place,
                wanted.name,
                path.display(),
            )))
        }
        ref several => {
            let kinds: Vec<&str> = several.iter().map(|g| kind_of(g)).collect();
            Err(Error::Input(format!(
                "{}: {role} names the group {:?}, of which {} has several: {}; give each a name of its own",
                wanted.place,
                wanted.name,
                path.display(),
                kinds.join(" and "),
            )))
        }
    }
}

fn kind_of(group: &fem::Group) -> &'static str {
    match group.dimension {
        0 => "one of points",
        1 => "one of curves",
        2 => "one of surfaces",
        _ => "one of volumes",
    }
}

//! Consistent nodal forces of loads on faces.

use crate::element::{MAX_FACE_NODES, Order, face_shape};
use crate::mesh::{Group, Mesh};
use crate::{Error, quadrature};

/// Nodal forces (3 node + component), N, of a uniform dead traction with the given total force.
///
/// # Errors
/// [`Error::NoFaces`], [`Error::NoArea`].
pub fn traction_of_total_force(
    mesh: &Mesh,
    group: &Group,
    total: [f64; 3],
) -> Result<Vec<f64>, Error> {
    let mut forces = vec![0.0; 3 * mesh.n_nodes()];
    let mut area = 0.0;
    integrate(mesh, group, |node, value, normal| {
        let size = value * norm(normal);
        area += size;
        for c in 0..3 {
            forces[3 * node + c] += size * total[c];
        }
    })?;
    if !(area > 0.0 && area.is_finite()) {
        return Err(Error::NoArea(group.name.clone(), area));
    }
    for f in &mut forces {
        *f /= area;
    }
    Ok(forces)
}

/// Nodal forces, N, of a pressure (Pa) along the inward normal of the undeformed faces.
///
/// # Errors
/// [`Error::NoFaces`].
pub fn pressure(mesh: &Mesh, group: &Group, pressure: f64) -> Result<Vec<f64>, Error> {
    let mut forces = vec![0.0; 3 * mesh.n_nodes()];
    let outward = outward_signs(mesh, group);
    let mut signs = outward.iter();
    let mut face_idx = usize::MAX;
    let mut sign = 1.0;
    integrate_faces(mesh, group, |face, node, value, normal| {
        if face != face_idx {
            face_idx = face;
            sign = signs.next().copied().unwrap_or(1.0);
        }
        for c in 0..3 {
            forces[3 * node + c] -= pressure * sign * value * normal[c];
        }
    })?;
    Ok(forces)
}

/// +1 where the face's normal points out of the body, -1 where it points in.
fn outward_signs(mesh: &Mesh, group: &Group) -> Vec<f64> {
    let mut boundary = std::collections::HashMap::new();
    for face in mesh.boundary_faces() {
        let v = [face.nodes[0], face.nodes[1], face.nodes[2]];
        let mut key = v;
        key.sort_unstable();
        boundary.insert(key, v);
    }
    group
        .faces
        .iter()
        .map(|face| {
            let v = [face.nodes[0], face.nodes[1], face.nodes[2]];
            let mut key = v;
            key.sort_unstable();
            let same = boundary.get(&key).is_none_or(|out| {
                (0..3).any(|k| v == [out[k], out[(k + 1) % 3], out[(k + 2) % 3]])
            });
            if same { 1.0 } else { -1.0 }
        })
        .collect()
}

fn integrate(
    mesh: &Mesh,
    group: &Group,
    mut add: impl FnMut(usize, f64, [f64; 3]),
) -> Result<(), Error> {
    integrate_faces(mesh, group, |_, node, value, normal| {
        add(node, value, normal)
    })
}

/// Calls `add(face, node, N w, dA n)` for every face, point and node; the normal has the area
/// element as its length.
fn integrate_faces(
    mesh: &Mesh,
    group: &Group,
    mut add: impl FnMut(usize, usize, f64, [f64; 3]),
) -> Result<(), Error> {
    if group.faces.is_empty() {
        return Err(Error::NoFaces(group.name.clone()));
    }
    // Shape functions times the area element of a curved face: far above what either needs.
    let degree = match mesh.order {
        Order::Linear => 2,
        Order::Quadratic => 8,
        Order::Cubic => 12,
        Order::Quartic => 16,
        Order::Quintic => 20,
    };
    let rule = quadrature::triangle(degree);
    let n = mesh.order.nodes_per_face();
    for (f, face) in group.faces.iter().enumerate() {
        for point in &rule {
            let (mut values, mut d) = ([0.0; MAX_FACE_NODES], [[0.0; 3]; MAX_FACE_NODES]);
            face_shape(mesh.order, point.coordinates, &mut values, &mut d);
            let (mut along, mut across) = ([0.0; 3], [0.0; 3]);
            for (&node, d) in face.nodes.iter().zip(&d[..n]) {
                for c in 0..3 {
                    along[c] += mesh.nodes[node as usize][c] * (d[1] - d[0]);
                    across[c] += mesh.nodes[node as usize][c] * (d[2] - d[0]);
                }
            }
            let normal = [
                0.5 * (along[1] * across[2] - along[2] * across[1]),
                0.5 * (along[2] * across[0] - along[0] * across[2]),
                0.5 * (along[0] * across[1] - along[1] * across[0]),
            ];
            for (&node, value) in face.nodes.iter().zip(&values[..n]) {
                add(f, node as usize, value * point.weight, normal);
            }
        }
    }
    Ok(())
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Face;

    #[test]
    fn a_total_force_on_faces_without_area_is_refused() {
        let nodes = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let group = Group {
            name: "edge".to_owned(),
            dimension: 2,
            nodes: vec![0, 1, 2],
            lines: Vec::new(),
            faces: vec![Face {
                nodes: vec![0, 1, 2],
            }],
            elements: vec![],
        };
        let mesh = Mesh::new(
            Order::Linear,
            nodes,
            vec![1, 2, 3, 4],
            vec![0, 1, 2, 3],
            vec![1],
            vec![],
        );
        let error = traction_of_total_force(&mesh, &group, [1.0, 0.0, 0.0]).unwrap_err();
        assert_eq!(error, Error::NoArea("edge".to_owned(), 0.0));
    }
}

//! Strain, stress and rotation of a displacement field.

use crate::element::MAX_NODES;
use crate::geometry::{determinant, gradients, jacobian};
use crate::material::Material;
use crate::mesh::Mesh;
use crate::{Error, quadrature};

/// A symmetric tensor, full.
pub type Tensor = [[f64; 3]; 3];

/// Displacement gradient du_i / dx_j at a local point of an element.
pub fn displacement_gradient(mesh: &Mesh, u: &[f64], element: usize, l: [f64; 4]) -> Tensor {
    let n = mesh.order.nodes_per_element();
    let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
    mesh.order.shape(l, &mut values, &mut d);
    let mut g = [[0.0; 3]; MAX_NODES];
    gradients(&d[..n], &mesh.element_coordinates(element), &mut g);
    let mut h = [[0.0; 3]; 3];
    for (&node, g) in mesh.element_nodes(element).iter().zip(&g[..n]) {
        for i in 0..3 {
            for j in 0..3 {
                h[i][j] += u[3 * node as usize + i] * g[j];
            }
        }
    }
    h
}

/// Linear strain of a displacement gradient.
pub fn strain(gradient: &Tensor) -> Tensor {
    std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (gradient[i][j] + gradient[j][i])))
}

/// Stress of a strain, Pa.
pub fn stress(material: &Material, strain: &Tensor) -> Tensor {
    let pressure = material.lame_lambda() * (strain[0][0] + strain[1][1] + strain[2][2]);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            2.0 * material.shear_modulus() * strain[i][j] + if i == j { pressure } else { 0.0 }
        })
    })
}

/// Von Mises stress, Pa.
pub fn von_mises(s: &Tensor) -> f64 {
    let normal =
        (s[0][0] - s[1][1]).powi(2) + (s[1][1] - s[2][2]).powi(2) + (s[2][2] - s[0][0]).powi(2);
    let shear = s[0][1] * s[0][1] + s[1][2] * s[1][2] + s[2][0] * s[2][0];
    (0.5 * normal + 3.0 * shear).sqrt()
}

/// Principal values of a symmetric tensor, the largest first.
pub fn principal_values(t: &Tensor) -> [f64; 3] {
    let m = nalgebra::Matrix3::from_fn(|i, j| t[i][j]);
    let mut values: [f64; 3] = m.symmetric_eigenvalues().into();
    values.sort_unstable_by(|a, b| b.total_cmp(a));
    values
}

/// Largest principal value by size, with its sign dropped.
pub fn largest_principal(t: &Tensor) -> f64 {
    principal_values(t)
        .into_iter()
        .fold(0.0f64, |a, v| a.max(v.abs()))
}

/// Angle of the linear rotation (half the curl), rad.
pub fn rotation_angle(gradient: &Tensor) -> f64 {
    let w = [
        0.5 * (gradient[2][1] - gradient[1][2]),
        0.5 * (gradient[0][2] - gradient[2][0]),
        0.5 * (gradient[1][0] - gradient[0][1]),
    ];
    (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]).sqrt()
}

/// Element and local coordinates of a point of the body, if it is in one (to 1e-9 of an element).
pub fn locate(mesh: &Mesh, point: [f64; 3]) -> Option<(usize, [f64; 4])> {
    (0..mesh.n_elements()).find_map(|e| {
        let nodes = mesh.element_nodes(e);
        // A curved element bulges out of its nodes' box by less than half the box.
        for c in 0..3 {
            let coordinates = nodes.iter().map(|&n| mesh.nodes[n as usize][c]);
            let (low, high) = coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                (a.min(x), b.max(x))
            });
            let margin = 0.5 * (high - low);
            if point[c] < low - margin || point[c] > high + margin {
                return None;
            }
        }
        local_coordinates(mesh, e, point)
            .filter(|l| l.iter().all(|x| *x >= -1e-9))
            .map(|l| (e, l))
    })
}

/// Newton's method on x(l) = point; exact in one step for straight elements.
fn local_coordinates(mesh: &Mesh, element: usize, point: [f64; 3]) -> Option<[f64; 4]> {
    let n = mesh.order.nodes_per_element();
    let x = mesh.element_coordinates(element);
    let mut l = [0.25; 4];
    let mut change = f64::INFINITY;
    for _ in 0..30 {
        let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
        mesh.order.shape(l, &mut values, &mut d);
        let j = jacobian(&d[..n], &x);
        let det = determinant(&j);
        if det == 0.0 {
            return None;
        }
        let inverse = crate::geometry::inverse(&j, det);
        let residual: [f64; 3] =
            std::array::from_fn(|c| point[c] - (0..n).map(|a| values[a] * x[a][c]).sum::<f64>());
        let step: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|i| inverse[k][i] * residual[i]).sum());
        for k in 0..3 {
            l[k + 1] += step[k];
        }
        l[0] = 1.0 - l[1] - l[2] - l[3];
        if !l.iter().all(|v| v.abs() < 10.0) {
            return None;
        }
        change = step.iter().fold(0.0, |a, s| s.abs().max(a));
        if change < 1e-13 {
            return Some(l);
        }
    }
    // Far from the origin round-off of the coordinates keeps the last steps above 1e-13.
    (change < 1e-9).then_some(l)
}

/// Strain at a point of the body; its principal values are [`principal_values`] of it.
///
/// # Errors
/// [`Error::OutsideMesh`].
pub fn strain_at_point(mesh: &Mesh, u: &[f64], point: [f64; 3]) -> Result<Tensor, Error> {
    let (e, l) = locate(mesh, point).ok_or(Error::OutsideMesh(point))?;
    Ok(strain(&displacement_gradient(mesh, u, e, l)))
}

/// Stress at a point of the body, Pa.
///
/// # Errors
/// [`Error::OutsideMesh`].
pub fn stress_at_point(
    mesh: &Mesh,
    materials: &[Material],
    material_of_element: &[u32],
    u: &[f64],
    point: [f64; 3],
) -> Result<Tensor, Error> {
    let (e, l) = locate(mesh, point).ok_or(Error::OutsideMesh(point))?;
    let gradient = displacement_gradient(mesh, u, e, l);
    Ok(stress(
        &materials[material_of_element[e] as usize],
        &strain(&gradient),
    ))
}

/// Strain at the nodes of an element, in the element's node order: its own, not averaged with
/// that of its neighbours.
pub fn element_nodal_strain(mesh: &Mesh, u: &[f64], element: usize) -> Vec<Tensor> {
    mesh.order
        .node_coordinates()
        .into_iter()
        .map(|l| strain(&displacement_gradient(mesh, u, element, l)))
        .collect()
}

/// Stress at the nodes of an element, Pa, in the element's node order: its own, not averaged with
/// that of its neighbours.
pub fn element_nodal_stress(
    mesh: &Mesh,
    materials: &[Material],
    material_of_element: &[u32],
    u: &[f64],
    element: usize,
) -> Vec<Tensor> {
    let material = &materials[material_of_element[element] as usize];
    element_nodal_strain(mesh, u, element)
        .iter()
        .map(|eps| stress(material, eps))
        .collect()
}

/// Strain at every node: that of each element at the node, averaged over its elements; zero at
/// nodes of no element.
pub fn nodal_strain(mesh: &Mesh, u: &[f64]) -> Vec<Tensor> {
    average_at_nodes(mesh, |e| element_nodal_strain(mesh, u, e))
}

/// Principal values of [`nodal_strain`] at every node, the largest first.
pub fn nodal_principal_strains(mesh: &Mesh, u: &[f64]) -> Vec<[f64; 3]> {
    nodal_strain(mesh, u).iter().map(principal_values).collect()
}

/// Stress at every node, Pa: that of each element at the node, averaged over its elements. Where
/// materials meet, the mean of both sides, which neither has; zero at nodes of no element.
pub fn nodal_stress(
    mesh: &Mesh,
    materials: &[Material],
    material_of_element: &[u32],
    u: &[f64],
) -> Vec<Tensor> {
    average_at_nodes(mesh, |e| {
        element_nodal_stress(mesh, materials, material_of_element, u, e)
    })
}

/// Von Mises stress at every node, Pa, of [`nodal_stress`].
pub fn nodal_von_mises(
    mesh: &Mesh,
    materials: &[Material],
    material_of_element: &[u32],
    u: &[f64],
) -> Vec<f64> {
    nodal_stress(mesh, materials, material_of_element, u)
        .iter()
        .map(von_mises)
        .collect()
}

/// Mean at every node of what its elements have there, given for each element in its node order.
fn average_at_nodes(mesh: &Mesh, of_element: impl Fn(usize) -> Vec<Tensor>) -> Vec<Tensor> {
    let mut sum = vec![[[0.0; 3]; 3]; mesh.n_nodes()];
    let mut count = vec![0.0f64; mesh.n_nodes()];
    for e in 0..mesh.n_elements() {
        for (&node, t) in mesh.element_nodes(e).iter().zip(of_element(e)) {
            count[node as usize] += 1.0;
            for i in 0..3 {
                for j in 0..3 {
                    sum[node as usize][i][j] += t[i][j];
                }
            }
        }
    }
    sum.into_iter()
        .zip(count)
        .map(|(t, n)| t.map(|row| row.map(|x| x / n.max(1.0))))
        .collect()
}

/// Largest values over a part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Largest principal strain by size.
    pub max_principal_strain: f64,
    /// Pa.
    pub max_von_mises: f64,
    /// rad.
    pub max_rotation: f64,
}

impl Extremes {
    /// Samples every element at the points of the lowest rule that is exact on straight elements,
    /// where strains are one order more accurate than at the nodes (Barlow 1976). Nodal values at
    /// contacts and re-entrant corners grow without bound under refinement.
    pub fn of(mesh: &Mesh, materials: &[Material], material_of_element: &[u32], u: &[f64]) -> Self {
        let points = quadrature::tetrahedron(mesh.order.stiffness_degree());
        let mut extremes = Self::default();
        for e in 0..mesh.n_elements() {
            let material = &materials[material_of_element[e] as usize];
            for p in &points {
                let h = displacement_gradient(mesh, u, e, p.coordinates);
                let eps = strain(&h);
                extremes.max_principal_strain =
                    extremes.max_principal_strain.max(largest_principal(&eps));
                extremes.max_von_mises = extremes
                    .max_von_mises
                    .max(von_mises(&stress(material, &eps)));
                extremes.max_rotation = extremes.max_rotation.max(rotation_angle(&h));
            }
        }
        extremes
    }
}

/// Root of the integral of |u - exact|² over the body, m^(5/2).
pub fn l2_error(mesh: &Mesh, u: &[f64], exact: impl Fn([f64; 3]) -> [f64; 3], degree: u32) -> f64 {
    let n = mesh.order.nodes_per_element();
    let mut sum = 0.0;
    for p in quadrature::tetrahedron(degree) {
        let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
        mesh.order.shape(p.coordinates, &mut values, &mut d);
        for e in 0..mesh.n_elements() {
            let x = mesh.element_coordinates(e);
            let volume = determinant(&jacobian(&d[..n], &x)).abs() * p.weight / 6.0;
            let at = |component: &dyn Fn(usize, usize) -> f64| -> [f64; 3] {
                std::array::from_fn(|c| (0..n).map(|a| values[a] * component(a, c)).sum())
            };
            let nodes = mesh.element_nodes(e);
            let point = at(&|a, c| x[a][c]);
            let here = at(&|a, c| u[3 * nodes[a] as usize + c]);
            let error: f64 = exact(point)
                .iter()
                .zip(here)
                .map(|(e, h)| (e - h) * (e - h))
                .sum();
            sum += volume * error;
        }
    }
    sum.sqrt()
}

//! Energy norm of the error of a displacement.

use crate::element::MAX_NODES;
use crate::geometry::gradients;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::quadrature;
use crate::stress::{Tensor, strain, stress};

/// Energy norm of the error of a displacement against an exact strain field, J^(1/2).
///
/// ```text
/// |e|² = ∫ (ε(u) - ε_exact) : D : (ε(u) - ε_exact) dV
/// ```
/// `u`: 3 values for each node, m. `exact_strain`: at a point, m, of the mesh (curved as it is).
/// `degree`: of the quadrature; 2 p + 2 or more, or the error at the points of a low rule, where
/// elements are better than elsewhere, is taken for that of the whole. With `u` of zeros it is
/// the norm of the exact field, for relative errors; its half square is the strain energy.
///
/// # Panics
/// If `u` or `material_of_element` does not fit the mesh (a programmer's mistake).
pub fn energy_error(
    mesh: &Mesh,
    materials: &[Material],
    material_of_element: &[u32],
    u: &[f64],
    exact_strain: impl Fn([f64; 3]) -> Tensor,
    degree: u32,
) -> f64 {
    assert_eq!(u.len(), 3 * mesh.n_nodes(), "three components at each node");
    assert_eq!(
        material_of_element.len(),
        mesh.n_elements(),
        "one material for each element"
    );
    let n = mesh.order.nodes_per_element();
    let points: Vec<_> = quadrature::tetrahedron(degree)
        .into_iter()
        .map(|p| {
            let (mut values, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            mesh.order.shape(p.coordinates, &mut values, &mut d);
            (p.weight, values, d)
        })
        .collect();
    let mut sum = 0.0;
    for (e, &material) in material_of_element.iter().enumerate() {
        let material = &materials[material as usize];
        let nodes = mesh.element_nodes(e);
        let x = mesh.element_coordinates(e);
        for (weight, values, d) in &points {
            let mut g = [[0.0; 3]; MAX_NODES];
            let volume = gradients(&d[..n], &x, &mut g).abs() * weight / 6.0;
            let mut place = [0.0; 3];
            let mut h = [[0.0; 3]; 3];
            for a in 0..n {
                for i in 0..3 {
                    place[i] += values[a] * x[a][i];
                    for j in 0..3 {
                        h[i][j] += u[3 * nodes[a] as usize + i] * g[a][j];
                    }
                }
            }
            let (here, exact) = (strain(&h), exact_strain(place));
            let error: Tensor =
                std::array::from_fn(|i| std::array::from_fn(|j| here[i][j] - exact[i][j]));
            let energy: f64 = stress(material, &error)
                .iter()
                .flatten()
                .zip(error.iter().flatten())
                .map(|(s, e)| s * e)
                .sum();
            sum += volume * energy;
        }
    }
    sum.sqrt()
}

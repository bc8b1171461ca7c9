//! Energy of an error, and strains at nodes and points, against polynomials.

use fem::energy::energy_error;
use fem::stress::{
    Tensor, element_nodal_strain, nodal_principal_strains, nodal_strain, nodal_stress,
    principal_values, strain_at_point, stress,
};
use fem::{Error, Material, Order, Quadrature};

use crate::common::{ORDERS, assemble, bend, cube, interpolate, largest_difference, place, steel};

/// u = (x², x y, z + y z) / 10 m and its strain.
fn quadratic([x, y, z]: [f64; 3]) -> [f64; 3] {
    [0.1 * x * x, 0.1 * x * y, 0.1 * (z + y * z)]
}

fn quadratic_strain([x, y, z]: [f64; 3]) -> Tensor {
    let (xy, yz) = (0.05 * y, 0.05 * z);
    [
        [0.2 * x, xy, 0.0],
        [xy, 0.1 * x, yz],
        [0.0, yz, 0.1 * (1.0 + y)],
    ]
}

/// The energy of a field that the space holds has no error; against no strain it is 2 Π = uᵀ K u.
#[test]
fn energy_of_a_field_in_the_space_is_that_of_the_stiffness() {
    for order in [Order::Quadratic, Order::Cubic] {
        let mesh = cube(order, 2, |x| x);
        let u = interpolate(&mesh, quadratic);
        let of_element = vec![0; mesh.n_elements()];
        let norm = energy_error(&mesh, &[steel()], &of_element, &u, |_| [[0.0; 3]; 3], 6);
        let error = energy_error(&mesh, &[steel()], &of_element, &u, quadratic_strain, 6);
        assert!(error < 1e-13 * norm, "order {order}: {error:e} {norm:e}");
        let energy = assemble(&mesh, steel(), Quadrature::Fast).strain_energy(&u);
        assert!((norm * norm / (2.0 * energy) - 1.0).abs() < 1e-13);
        // No displacement: the error is the exact field.
        let rest = vec![0.0; u.len()];
        let exact = energy_error(&mesh, &[steel()], &of_element, &rest, quadratic_strain, 6);
        assert!((exact / norm - 1.0).abs() < 1e-13);
    }
}

/// A uniform strain error e in xx on a curved body of volume V: (λ + 2 μ) e² V, each part with
/// its own material.
#[test]
fn energy_of_a_uniform_error_is_known_by_hand() {
    let materials = [steel(), Material::new(2e9, 0.4).unwrap()];
    for order in ORDERS {
        let mesh = cube(order, 2, bend);
        let u = interpolate(&mesh, |x| [1e-3 * x[0], 0.0, 0.0]);
        let of_element: Vec<u32> = (0..mesh.n_elements() as u32).map(|e| e % 2).collect();
        let exact = |_| [[4e-4, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        let found = energy_error(&mesh, &materials, &of_element, &u, exact, 9);
        let expected: f64 = (0..mesh.n_elements())
            .map(|e| {
                let m = &materials[e % 2];
                (m.lame_lambda() + 2.0 * m.shear_modulus()) * 3.6e-7 * mesh.element_volume(e)
            })
            .sum();
        assert!(
            (found * found / expected - 1.0).abs() < 1e-12,
            "order {order}"
        );
    }
}

/// Interpolation of x² on n cells along each edge: the error of the derivative halves with them.
#[test]
fn energy_of_an_interpolation_error_falls_with_the_cells() {
    let error = |n: usize| {
        let mesh = cube(Order::Linear, n, |x| x);
        let u = interpolate(&mesh, quadratic);
        let of_element = vec![0; mesh.n_elements()];
        energy_error(&mesh, &[steel()], &of_element, &u, quadratic_strain, 4)
    };
    let ratio = error(4) / error(8);
    assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
}

/// Values of the book: a plane state with ε_xx = 3, ε_yy = 1, γ_xy / 2 = 1 has 2 ± √2.
#[test]
fn principal_values_are_sorted() {
    let plane = [[3.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, -5.0]];
    let root = 2f64.sqrt();
    assert!(largest_difference(&principal_values(&plane), &[2.0 + root, 2.0 - root, -5.0]) < 1e-14);
    let shear = [[0.0, 0.0, 2.0], [0.0; 3], [2.0, 0.0, 0.0]];
    assert!(largest_difference(&principal_values(&shear), &[2.0, 0.0, -2.0]) < 1e-14);
}

#[test]
fn strains_at_nodes_and_points_are_those_of_the_polynomial() {
    for order in [Order::Quadratic, Order::Cubic] {
        let mesh = cube(order, 2, |x| x);
        let u = interpolate(&mesh, quadratic);
        let principal = nodal_principal_strains(&mesh, &u);
        for ((x, eps), principal) in mesh
            .nodes
            .iter()
            .zip(nodal_strain(&mesh, &u))
            .zip(principal)
        {
            let exact = quadratic_strain(*x);
            assert!(largest_difference(eps.as_flattened(), exact.as_flattened()) < 1e-14);
            assert!(principal[0] >= principal[1] && principal[1] >= principal[2]);
            assert!(largest_difference(&principal, &principal_values(&exact)) < 1e-14);
        }
        for element in [0, 17, 40] {
            let x = place(&mesh, element, [0.4, 0.3, 0.2, 0.1]);
            let found = strain_at_point(&mesh, &u, x).unwrap();
            assert!(
                largest_difference(found.as_flattened(), quadratic_strain(x).as_flattened())
                    < 1e-14
            );
        }
        let outside = strain_at_point(&mesh, &u, [2.0; 3]);
        assert_eq!(outside, Err(Error::OutsideMesh([2.0; 3])));
    }
}

/// Linear elements have a constant strain each; the node has the mean of them, and its stress is
/// that of its strain.
#[test]
fn nodal_strain_is_the_mean_of_the_elements() {
    let mesh = cube(Order::Linear, 2, bend);
    let u = interpolate(&mesh, quadratic);
    let nodal = nodal_strain(&mesh, &u);
    let of_element = vec![0; mesh.n_elements()];
    let stresses = nodal_stress(&mesh, &[steel()], &of_element, &u);
    for node in 0..mesh.n_nodes() as u32 {
        let around: Vec<Tensor> = (0..mesh.n_elements())
            .filter(|&e| mesh.element_nodes(e).contains(&node))
            .map(|e| element_nodal_strain(&mesh, &u, e)[0])
            .collect();
        let mean: Tensor = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                around.iter().map(|t| t[i][j]).sum::<f64>() / around.len() as f64
            })
        });
        let found = nodal[node as usize];
        assert!(largest_difference(found.as_flattened(), mean.as_flattened()) < 1e-15);
        let expected = stress(&steel(), &mean);
        let found = stresses[node as usize];
        assert!(largest_difference(found.as_flattened(), expected.as_flattened()) < 1e-14 * 2.1e11);
    }
}

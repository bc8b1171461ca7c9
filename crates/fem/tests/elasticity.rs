//! Rigid motion, supports and the error norm on a small box (tests/data/README.md).

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use fem::{Error, FactoredStiffness, Material, Mesh, Quadrature, Silent, Stiffness, Supports};

fn mesh(order: u8) -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join(format!("tests/data/box-order{order}-ascii.msh"));
    fem::mesh::gmsh::read(&path).unwrap()
}

fn stiffness(mesh: &Mesh) -> Stiffness {
    let material = Material::new(2.3e9, 0.3).unwrap();
    let of_element = vec![0; mesh.n_elements()];
    fem::assemble_stiffness(mesh, &[material], &of_element, Quadrature::Converged).unwrap()
}

#[test]
fn a_turned_and_shifted_curved_body_carries_no_force() {
    for order in 1..=3 {
        let mut mesh = mesh(order);
        // Bent a little, so that its elements are curved.
        for x in &mut mesh.nodes {
            *x = [x[0], x[1] + 0.05 * x[0] * x[0], x[2] + 0.03 * x[0] * x[1]];
        }
        let u: Vec<f64> = mesh
            .nodes
            .iter()
            .flat_map(|x| [1.0 - 0.2 * x[1], 2.0 + 0.2 * x[0] - 0.1 * x[2], 0.1 * x[1]])
            .collect();
        let force = stiffness(&mesh).multiply(&u);
        let largest = force.iter().fold(0.0f64, |a, f| a.max(f.abs()));
        // K is about E times a metre.
        assert!(largest < 1e-12 * 2.3e9, "order {order}: {largest}");
    }
}

/// A quadratic field is in the space of quadratic elements: no error but round-off.
#[test]
fn the_error_of_an_interpolated_field_is_round_off() {
    let mesh = mesh(2);
    let field = |x: [f64; 3]| [x[0] * x[1], x[2] * x[2] - x[0], 1.0 + x[1]];
    let u: Vec<f64> = mesh.nodes.iter().flat_map(|x| field(*x)).collect();
    assert!(fem::stress::l2_error(&mesh, &u, field, 6) < 1e-14);
    let off_by_one = |x: [f64; 3]| [x[0] * x[1], x[2] * x[2] - x[0], x[1]];
    assert!(fem::stress::l2_error(&mesh, &u, off_by_one, 6) > 1.0);
}

#[test]
fn a_body_that_is_not_held_is_not_positive_definite() {
    let mesh = mesh(1);
    let loose = FactoredStiffness::new(&stiffness(&mesh), &Supports::new(mesh.n_nodes()), &Silent);
    assert!(matches!(
        loose.err(),
        Some(Error::NotPositiveDefinite { .. })
    ));
}

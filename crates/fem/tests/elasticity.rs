//! Stiffness, loads and compliance on a small box (tests/data/README.md), against what must hold.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use fem::{
    Compliance, Error, FactoredStiffness, Material, Mesh, Progress, Quadrature, Silent, Stiffness,
    Supports,
};

struct Held {
    mesh: Mesh,
    supports: Supports,
    stiffness: Stiffness,
    factor: FactoredStiffness,
}

fn mesh(order: u8) -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join(format!("tests/data/box-order{order}-ascii.msh"));
    fem::mesh::gmsh::read(&path).unwrap()
}

/// Bends the box a little, so that its elements are curved.
fn bent(order: u8) -> Mesh {
    let mut mesh = mesh(order);
    for x in &mut mesh.nodes {
        *x = [x[0], x[1] + 0.05 * x[0] * x[0], x[2] + 0.03 * x[0] * x[1]];
    }
    mesh
}

fn hold(mesh: Mesh, young_modulus: f64) -> Held {
    let mut supports = Supports::new(mesh.n_nodes());
    for &node in &mesh.group("left side").unwrap().nodes {
        supports.fix_node(node, [true; 3]);
    }
    let material = Material::new(young_modulus, 0.3).unwrap();
    let of_element = vec![0; mesh.n_elements()];
    let stiffness =
        fem::assemble_stiffness(&mesh, &[material], &of_element, Quadrature::Converged).unwrap();
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    Held {
        mesh,
        supports,
        stiffness,
        factor,
    }
}

fn compliance(held: &Held) -> Compliance {
    let surface = held.mesh.surface_nodes();
    let candidates: Vec<u32> = surface
        .iter()
        .copied()
        .filter(|&n| !held.supports.is_fixed_in_all(n))
        .collect();
    Compliance::build(&held.factor, &candidates, &candidates, &Silent).unwrap()
}

#[test]
fn a_turned_and_shifted_curved_body_carries_no_force() {
    for order in 1..=3 {
        let held = hold(bent(order), 2.3e9);
        let u: Vec<f64> = held
            .mesh
            .nodes
            .iter()
            .flat_map(|x| [1.0 - 0.2 * x[1], 2.0 + 0.2 * x[0] - 0.1 * x[2], 0.1 * x[1]])
            .collect();
        let force = held.stiffness.multiply(&u);
        let largest = force.iter().fold(0.0f64, |a, f| a.max(f.abs()));
        // K is about E times a metre.
        assert!(largest < 1e-12 * 2.3e9, "order {order}: {largest}");
    }
}

#[test]
fn columns_of_the_compliance_are_solutions_and_symmetric() {
    for order in 1..=3 {
        let held = hold(bent(order), 2.3e9);
        let c = compliance(&held);
        let checks = c.check(&held.stiffness, &held.factor).unwrap();
        assert!(
            checks.symmetry_rel < 1e-12 && checks.residual_rel < 1e-10,
            "{checks:?}"
        );
        assert!(checks.smallest_pivot_rel > 0.0);
        let j = c.candidates.len() / 2;
        let mut force = vec![0.0; held.factor.n_dofs()];
        force[3 * c.candidates[j] as usize + 1] = 1.0;
        let u = held.factor.solve(&force);
        for (i, &node) in c.rows.iter().enumerate() {
            for r in 0..3 {
                let difference = c.block(i, j)[3 + r] - u[3 * node as usize + r];
                assert!(
                    difference.abs()
                        < 1e-14 * u.iter().fold(0.0, |a, x| f64::max(a, x.abs())) * 10.0
                );
            }
        }
    }
}

/// C goes with 1/E, and a change of units by a power of two changes no bit of it.
#[test]
fn compliance_scales_with_the_modulus_to_the_last_bit() {
    let (soft, stiff) = (
        compliance(&hold(bent(2), 1e9)),
        compliance(&hold(bent(2), 4e9)),
    );
    assert!(
        soft.blocks
            .iter()
            .zip(&stiff.blocks)
            .all(|(a, b)| *a == 4.0 * b)
    );
}

#[test]
fn the_stiffness_has_the_same_bits_for_any_number_of_threads() {
    let assemble = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| hold(bent(3), 2.3e9).stiffness)
    };
    assert_eq!(assemble(1).matrix().val(), assemble(3).matrix().val());
}

/// Uniform pressure p on a face of area A: T3 pA/3 each; T6 vertices 0, mid nodes pA/3; T10 vertices
/// pA/30, edge nodes 3pA/40, centre 9pA/20 (integrals of the shape functions).
#[test]
fn loads_are_consistent() {
    let shares: [&[f64]; 3] = [
        &[1.0 / 3.0],
        &[0.0, 1.0 / 3.0],
        &[1.0 / 30.0, 3.0 / 40.0, 9.0 / 20.0],
    ];
    for (order, shares) in (1..=3).zip(shares) {
        let mesh = mesh(order);
        let surface = mesh.group("surface").unwrap();
        let single = fem::Group {
            faces: vec![surface.faces[0].clone()],
            ..surface.clone()
        };
        let force = fem::load::traction_of_total_force(&mesh, &single, [0.0, 7.0, 0.0]).unwrap();
        for (k, &node) in single.faces[0].nodes.iter().enumerate() {
            let share = match k {
                0..=2 => shares[0],
                9 => shares[2],
                _ => shares[1],
            };
            assert!(
                (force[3 * node as usize + 1] - 7.0 * share).abs() < 1e-12,
                "order {order} node {k}"
            );
        }
        // A pressure all round pushes nowhere; on the left side (1 m²) it pushes along +x.
        let around = fem::load::pressure(&mesh, surface, 3.0).unwrap();
        let left = fem::load::pressure(&mesh, mesh.group("left side").unwrap(), 3.0).unwrap();
        for c in 0..3 {
            let sum = |f: &[f64]| f.iter().skip(c).step_by(3).sum::<f64>();
            assert!(sum(&around).abs() < 1e-12);
            assert!((sum(&left) - if c == 0 { 3.0 } else { 0.0 }).abs() < 1e-12);
        }
    }
}

#[test]
fn a_point_of_a_curved_body_is_located_and_its_stress_is_the_fields() {
    let held = hold(bent(2), 2.3e9);
    // u = strain times x: exact for every element that holds linear fields.
    let u: Vec<f64> = held
        .mesh
        .nodes
        .iter()
        .flat_map(|x| [1e-3 * x[0], 0.0, 0.0])
        .collect();
    let material = Material::new(2.3e9, 0.3).unwrap();
    let of_element = vec![0; held.mesh.n_elements()];
    let point = [1.1, 0.5 + 0.05 * 1.21, 0.4 + 0.03 * 0.55];
    let stress =
        fem::stress::stress_at_point(&held.mesh, &[material], &of_element, &u, point).unwrap();
    let along = 1e-3 * (material.lame_lambda() + 2.0 * material.shear_modulus());
    assert!((stress[0][0] / along - 1.0).abs() < 1e-10, "{stress:?}");
    assert!(fem::stress::locate(&held.mesh, [5.0, 5.0, 5.0]).is_none());
    let uniaxial = [[3.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
    assert_eq!(fem::stress::von_mises(&uniaxial), 3.0);
    let shear = [[0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0; 3]];
    assert!((fem::stress::largest_principal(&shear) - 2.0).abs() < 1e-14);
    assert!((fem::stress::von_mises(&shear) - 2.0 * 3f64.sqrt()).abs() < 1e-14);
}

/// A quadratic field is in the space of quadratic elements: no error but round-off.
#[test]
fn the_error_of_an_interpolated_field_is_round_off() {
    let mesh = mesh(2);
    let field = |x: [f64; 3]| [x[0] * x[1], x[2] * x[2] - x[0], 1.0 + x[1]];
    let u: Vec<f64> = mesh.nodes.iter().flat_map(|x| field(*x)).collect();
    assert!(fem::stress::l2_error(&mesh, &u, field, 6) < 1e-14);
    assert!(fem::stress::l2_error(&mesh, &u, |x| [x[0] * x[1], x[2] * x[2] - x[0], x[1]], 6) > 1.0);
}

struct Stop;

impl Progress for Stop {
    fn advance(&self, _stage: &str, _done: usize, _total: usize) {}
    fn is_cancelled(&self) -> bool {
        true
    }
}

#[test]
fn work_stops_when_it_is_asked_to() {
    let held = hold(mesh(1), 1e9);
    let factor = FactoredStiffness::new(&held.stiffness, &held.supports, &Stop);
    assert_eq!(factor.err(), Some(Error::Cancelled));
    let nodes = held.mesh.surface_nodes();
    assert_eq!(
        Compliance::build(&held.factor, &nodes, &nodes, &Stop).err(),
        Some(Error::Cancelled)
    );
}

#[test]
fn a_body_that_is_not_held_is_not_positive_definite() {
    let held = hold(mesh(1), 1e9);
    let loose = FactoredStiffness::new(
        &held.stiffness,
        &Supports::new(held.mesh.n_nodes()),
        &Silent,
    );
    assert!(matches!(
        loose.err(),
        Some(Error::NotPositiveDefinite { .. })
    ));
}

//! Points on curved elements, norms of the field, values of tensors.

use fem::Quadrature;
use fem::stress::{Extremes, l2_error, largest_principal, locate, nodal_von_mises, von_mises};

use crate::common::{ORDERS, assemble, bend, cube, interpolate, largest, place, read, steel};

/// Shear s in one plane: von Mises √3 s, principal ±s. Uniaxial s: both s. Pressure: no von Mises.
#[test]
fn tensors_have_the_values_of_the_book() {
    let shear = [[0.0, 5.0, 0.0], [5.0, 0.0, 0.0], [0.0; 3]];
    assert!((von_mises(&shear) - 5.0 * 3f64.sqrt()).abs() < 1e-14);
    assert!((largest_principal(&shear) - 5.0).abs() < 1e-14);
    let axial = [[0.0; 3], [0.0; 3], [0.0, 0.0, -7.0]];
    assert!((von_mises(&axial) - 7.0).abs() < 1e-14);
    assert!((largest_principal(&axial) - 7.0).abs() < 1e-14);
    let pressure = [[-4.0, 0.0, 0.0], [0.0, -4.0, 0.0], [0.0, 0.0, -4.0]];
    assert_eq!(von_mises(&pressure), 0.0);
    // Principal values 3 + 1, 3 - 1 and 1.
    let mixed = [[3.0, 1.0, 0.0], [1.0, 3.0, 0.0], [0.0, 0.0, 1.0]];
    assert!((largest_principal(&mixed) - 4.0).abs() < 1e-14);
    // ½((4-2)² + (2-1)² + (1-4)²) = 7.
    assert!((von_mises(&mixed) - 7f64.sqrt()).abs() < 1e-14);
}

#[test]
fn every_point_of_a_curved_body_is_found_in_an_element_that_holds_it() {
    for name in ["ring-tet10.msh", "ring-tet20.msh"] {
        let mesh = read(name);
        for element in 0..mesh.n_elements() {
            for l in [
                [0.25; 4],
                [0.7, 0.1, 0.1, 0.1],
                [0.0, 0.3, 0.3, 0.4],
                [1.0, 0.0, 0.0, 0.0],
                [0.5, 0.0, 0.5, 0.0],
            ] {
                let x = place(&mesh, element, l);
                let (found, l) = locate(&mesh, x).expect("a point of the body");
                let back = place(&mesh, found, l);
                assert!(
                    (0..3).all(|c| (x[c] - back[c]).abs() < 1e-12),
                    "{x:?} {back:?}"
                );
            }
        }
        // Inside of the ring (radius 0.9), outside of it (radius 2.1), and above it.
        assert!(locate(&mesh, [0.54, 0.72, 0.5]).is_none());
        assert!(locate(&mesh, [1.5, 1.5, 0.5]).is_none());
        assert!(locate(&mesh, [0.9, 1.2, 1.1]).is_none());
    }
}

/// Millimetre elements a metre away from the origin: coordinates are only good to 1e-13 of an
/// element, and points must be found all the same.
#[test]
fn points_of_a_small_body_far_from_the_origin_are_found() {
    for order in ORDERS {
        let mesh = cube(order, 2, |x| bend(x).map(|c| 1.7 + 2e-4 * c));
        for element in 0..mesh.n_elements() {
            for l in [[0.25; 4], [0.1, 0.2, 0.3, 0.4], [0.15, 0.55, 0.15, 0.15]] {
                assert!(
                    locate(&mesh, place(&mesh, element, l)).is_some(),
                    "order {order}"
                );
            }
        }
    }
}

/// Isoparametric elements hold linear fields on curved meshes and degree p on straight ones.
#[test]
fn l2_error_of_a_field_in_the_space_is_round_off() {
    for order in ORDERS {
        let degree = order as i32;
        let field = |x: [f64; 3]| x.map(|c| (c + 0.3 * x[0] - 0.2 * x[2]).powi(degree));
        let mesh = cube(order, 2, |x| x);
        let u = interpolate(&mesh, field);
        assert!(l2_error(&mesh, &u, field, 6) < 1e-14);
        // A constant error of 1 m in x over a volume of 1 m³.
        let shifted = |x: [f64; 3]| [field(x)[0] + 1.0, field(x)[1], field(x)[2]];
        assert!((l2_error(&mesh, &u, shifted, 6) - 1.0).abs() < 1e-13);
    }
}

/// Uniaxial strain on a curved mesh: the same stress at every node and every point.
#[test]
fn a_uniform_strain_is_uniform_everywhere() {
    let strain = 1e-3;
    for order in ORDERS {
        let mesh = cube(order, 2, bend);
        let u = interpolate(&mesh, |x| [strain * x[0], 0.0, 0.0]);
        let of_element = vec![0; mesh.n_elements()];
        let expected = 2.0 * steel().shear_modulus() * strain;
        for value in nodal_von_mises(&mesh, &[steel()], &of_element, &u) {
            assert!(
                (value / expected - 1.0).abs() < 1e-11,
                "order {order}: {value}"
            );
        }
        let extremes = Extremes::of(&mesh, &[steel()], &of_element, &u);
        assert!((extremes.max_von_mises / expected - 1.0).abs() < 1e-11);
        assert!((extremes.max_principal_strain / strain - 1.0).abs() < 1e-11);
        assert!(extremes.max_rotation < 1e-14);
    }
}

#[test]
fn a_turn_is_a_turn_without_strain() {
    for order in ORDERS {
        let mesh = cube(order, 2, bend);
        let turn = 0.01;
        let u = interpolate(&mesh, |x| [-turn * x[1], turn * x[0], 0.0]);
        let extremes = Extremes::of(&mesh, &[steel()], &vec![0; mesh.n_elements()], &u);
        assert!((extremes.max_rotation - turn).abs() < 1e-14);
        assert!(extremes.max_principal_strain < 1e-14);
        let stiffness = assemble(&mesh, steel(), Quadrature::Converged);
        // K has entries of E times a length; u is about 0.01 m.
        assert!(largest(&stiffness.multiply(&u)) < 1e-13 * 2.1e11 * turn);
    }
}

//! Patch tests: a polynomial that balances itself without body force, given on the boundary, must
//! come out inside, to round-off.
//!
//! The fields are gradients of harmonic polynomials: no divergence, no Laplacian, so the stress
//! is in balance for any λ and μ.

use fem::{FactoredStiffness, Order, Quadrature, Silent};

use crate::common::{
    ALL_ORDERS, ORDERS, assemble, bend, cube, hold, interpolate, largest, largest_difference,
    place, steel,
};

type Field = fn([f64; 3]) -> [f64; 3];

fn linear([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        0.3 + 1.1 * x - 0.4 * y + 0.2 * z,
        -0.1 + 0.7 * x + 0.5 * y - 0.6 * z,
        0.9 - 0.2 * x + 0.3 * y - 0.8 * z,
    ]
}

/// Gradient of x³ - 3 x y² + y³ - 3 y z² + x y z.
fn quadratic([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.0 * (x * x - y * y) + y * z,
        -6.0 * x * y + 3.0 * (y * y - z * z) + x * z,
        -6.0 * y * z + x * y,
    ]
}

/// Gradient of x⁴ - 6 x² y² + y⁴ + x³ z - 3 x y² z.
fn cubic([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        4.0 * x * x * x - 12.0 * x * y * y + 3.0 * x * x * z - 3.0 * y * y * z,
        -12.0 * x * x * y + 4.0 * y * y * y - 6.0 * x * y * z,
        x * x * x - 3.0 * x * y * y,
    ]
}

/// The gradient of Re (x + iy)^n / n: harmonic, without divergence, and so in equilibrium whatever the material.
fn power(x: [f64; 3], n: u32) -> [f64; 3] {
    let (mut re, mut im) = (1.0, 0.0);
    for _ in 1..n {
        (re, im) = (re * x[0] - im * x[1], re * x[1] + im * x[0]);
    }
    [re, -im, 0.0]
}

fn quartic(x: [f64; 3]) -> [f64; 3] {
    power(x, 5)
}

fn quintic(x: [f64; 3]) -> [f64; 3] {
    power(x, 6)
}

/// Largest error of a node, over the largest displacement.
fn error(order: Order, field: Field, quadrature: Quadrature, is_curved: bool) -> f64 {
    let mesh = cube(order, 2, |x| if is_curved { bend(x) } else { x });
    let supports = hold(&mesh, &mesh.surface_nodes());
    let stiffness = assemble(&mesh, steel(), quadrature);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    assert!(factor.n_free() > 0, "nothing inside to test");
    let exact = interpolate(&mesh, field);
    let u = factor.solve_prescribed(&stiffness, &vec![0.0; exact.len()], &exact);
    largest_difference(&u, &exact) / largest(&exact)
}

#[test]
fn patch_straight_elements_hold_their_degree_and_no_more() {
    let fields: [Field; 5] = [linear, quadratic, cubic, quartic, quintic];
    for (i, order) in ALL_ORDERS.into_iter().enumerate() {
        for (j, field) in fields.into_iter().enumerate() {
            for quadrature in [Quadrature::Fast, Quadrature::Converged] {
                let error = error(order, field, quadrature, false);
                if j <= i {
                    // Round-off of a well-conditioned solve.
                    let limit = if order <= Order::Cubic { 1e-13 } else { 2e-13 };
                    assert!(error < limit, "order {order}, degree {}: {error:e}", j + 1);
                } else {
                    assert!(error > 1e-5, "order {order}, degree {}: {error:e}", j + 1);
                }
            }
        }
    }
}

/// Constant stress on curved elements needs ∫ cof J ∂N, of degree 3 (tet10), 6 (tet20), 9 and 12.
#[test]
fn patch_curved_elements_hold_linear_fields_with_the_converged_rule() {
    for order in &ALL_ORDERS[1..] {
        let error = error(*order, linear, Quadrature::Converged, true);
        let limit = if *order <= Order::Cubic { 1e-13 } else { 2e-13 };
        assert!(error < limit, "order {order}: {error:e}");
    }
}

/// Stress of the interpolated field at points inside, against the field's derivatives.
#[test]
fn stress_at_points_is_that_of_the_polynomial() {
    let fields: [Field; 3] = [linear, quadratic, cubic];
    for (order, field) in ORDERS.into_iter().zip(fields) {
        let mesh = cube(order, 2, |x| x);
        let u = interpolate(&mesh, field);
        let of_element = vec![0; mesh.n_elements()];
        for element in [0, 17, 40] {
            let x = place(&mesh, element, [0.4, 0.3, 0.2, 0.1]);
            let h = 1e-5;
            let gradient: fem::stress::Tensor = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let (mut up, mut down) = (x, x);
                    up[j] += h;
                    down[j] -= h;
                    (field(up)[i] - field(down)[i]) / (2.0 * h)
                })
            });
            let exact = fem::stress::stress(&steel(), &fem::stress::strain(&gradient));
            let found =
                fem::stress::stress_at_point(&mesh, &[steel()], &of_element, &u, x).unwrap();
            for (a, b) in found.iter().flatten().zip(exact.iter().flatten()) {
                // Central differences of a cubic: h² in the gradient.
                assert!((a - b).abs() < 1e-8 * 2.1e11, "order {order}: {a} {b}");
            }
        }
    }
}

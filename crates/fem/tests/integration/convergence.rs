//! Observed orders of convergence on Lame's thick ring.
//!
//! Goal: errors against a closed form fall with h^p in the energy norm and h^(p+1) in L2, for
//! tet4, tet10 and tet20 (Brenner, Scott, The Mathematical Theory of Finite Element Methods).
//!
//! ```text
//!   y
//!   |--__            inner radius 10 mm with 10 MPa, outer 20 mm free, plane strain
//!   |    \           held: u_x on x = 0, u_y on y = 0, u_z on both faces across z
//!   |__   \          u = (A + B / r²) (x, y, 0)
//!      \   |         A = (1 + ν)(1 - 2ν) p a² / (E (b² - a²))
//!       |__|__ x     B = (1 + ν) p a² b² / (E (b² - a²))
//! ```
//! Source of the field: Timoshenko, Goodier, Theory of Elasticity, section 28.
//!
//! The cells are boxes in (r, φ, z), n by 2n by one, of six tetrahedra. Nothing depends on z, so
//! the slab is as thick as a cell is wide: cells keep their shape and all of h falls together.
//! Nodes lie where the polar map has them, so the boundary is met to order p + 1 as the field is.
//! Errors are relative, which takes the slab's volume out.

use std::f64::consts::FRAC_PI_2;

use fem::energy::energy_error;
use fem::stress::{Tensor, l2_error};
use fem::{FactoredStiffness, Group, Material, Mesh, Order, Quadrature, Silent, Supports};

use crate::common::assemble;

pub(crate) const INNER: f64 = 0.010;
pub(crate) const OUTER: f64 = 0.020;
pub(crate) const PRESSURE: f64 = 10e6;
const YOUNG: f64 = 2.3e9;
const POISSON: f64 = 0.37;

/// A (no unit) and B (m²) of the closed form.
fn constants() -> (f64, f64) {
    let (a2, b2) = (INNER * INNER, OUTER * OUTER);
    let common = (1.0 + POISSON) * PRESSURE * a2 / (YOUNG * (b2 - a2));
    (common * (1.0 - 2.0 * POISSON), common * b2)
}

pub(crate) fn material() -> Material {
    Material::new(YOUNG, POISSON).unwrap()
}

fn displacement([x, y, _]: [f64; 3]) -> [f64; 3] {
    let (a, b) = constants();
    let factor = a + b / (x * x + y * y);
    [factor * x, factor * y, 0.0]
}

pub(crate) fn strain([x, y, _]: [f64; 3]) -> Tensor {
    let (a, b) = constants();
    let r2 = x * x + y * y;
    let (uniform, shear) = (a + b / r2, -2.0 * b * x * y / (r2 * r2));
    [
        [uniform - 2.0 * b * x * x / (r2 * r2), shear, 0.0],
        [shear, uniform - 2.0 * b * y * y / (r2 * r2), 0.0],
        [0.0; 3],
    ]
}

/// The ring with `n` cells across its wall, its supports, and the group `inner`.
pub(crate) fn ring(order: Order, n: usize) -> (Mesh, Supports) {
    const PATHS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    let p = order as usize;
    let cells = [n, 2 * n, 1];
    let sides = cells.map(|c| p * c + 1);
    let index = |at: [usize; 3]| at[0] + sides[0] * (at[1] + sides[1] * at[2]);
    let height = (OUTER - INNER) / n as f64;
    let mut nodes = Vec::new();
    let mut supports = Supports::new(sides.iter().product());
    for k in 0..sides[2] {
        for j in 0..sides[1] {
            for i in 0..sides[0] {
                let [s, t, z] =
                    [(0, i), (1, j), (2, k)].map(|(c, i)| i as f64 / (sides[c] - 1) as f64);
                let (r, angle) = (INNER + (OUTER - INNER) * s, FRAC_PI_2 * t);
                supports.fix_node(
                    nodes.len() as u32,
                    [j == sides[1] - 1, j == 0, k == 0 || k == sides[2] - 1],
                );
                nodes.push([r * angle.cos(), r * angle.sin(), height * z]);
            }
        }
    }
    let mut elements = Vec::new();
    for cell in 0..cells[0] * cells[1] {
        let corner = [cell % n, cell / n, 0];
        for (k, path) in PATHS.iter().enumerate() {
            let mut vertices = [corner; 4];
            for (step, &axis) in path.iter().enumerate() {
                vertices[step + 1] = vertices[step];
                vertices[step + 1][axis] += 1;
            }
            // Odd permutations of the axes turn the element inside out.
            if k >= 3 {
                vertices.swap(1, 2);
            }
            for l in order.node_coordinates() {
                // On the grid of all nodes, p steps for a cell.
                let at: [usize; 3] = std::array::from_fn(|c| {
                    (0..4)
                        .map(|v| (l[v] * p as f64).round() as usize * vertices[v][c])
                        .sum()
                });
                elements.push(index(at) as u32);
            }
        }
    }
    let n_elements = elements.len() / order.nodes_per_element();
    let mut mesh = Mesh::new(
        order,
        nodes,
        (1..=sides.iter().product::<usize>() as u64).collect(),
        elements,
        (1..=n_elements as u64).collect(),
        vec![],
    );
    let mut faces = mesh.boundary_faces();
    faces.retain(|f| {
        f.nodes
            .iter()
            .all(|&i| (i as usize).is_multiple_of(sides[0]))
    });
    assert_eq!(faces.len(), 4 * n);
    let inner: std::collections::BTreeSet<u32> =
        faces.iter().flat_map(|f| f.nodes.clone()).collect();
    mesh.groups = vec![Group {
        name: "inner".to_owned(),
        dimension: 2,
        nodes: inner.into_iter().collect(),
        lines: Vec::new(),
        faces,
        elements: vec![],
    }];
    (mesh, supports)
}

/// Relative errors: energy norm and L2.
fn errors(order: Order, n: usize) -> [f64; 2] {
    let (mesh, supports) = ring(order, n);
    assert_eq!(mesh.check(&supports), Ok(vec![]));
    let material = material();
    let of_element = vec![0; mesh.n_elements()];
    let stiffness = assemble(&mesh, material, Quadrature::Converged);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let load = fem::load::pressure(&mesh, mesh.group("inner").unwrap(), PRESSURE).unwrap();
    let u = factor.solve(&load);
    let rest = vec![0.0; u.len()];
    // Degree 15 changes these norms by 1e-5 of them at most.
    let energy = |u: &[f64]| energy_error(&mesh, &[material], &of_element, u, strain, 9);
    let l2 = |u: &[f64]| l2_error(&mesh, u, displacement, 9);
    [energy(&u) / energy(&rest), l2(&u) / l2(&rest)]
}

/// Orders between each mesh and the next, printed; those of the last two are within 0.15 of the
/// theory (what is left of the next term of the expansion on meshes of this size).
fn check_orders(order: Order, meshes: &[usize]) {
    let errors: Vec<[f64; 2]> = meshes.iter().map(|&n| errors(order, n)).collect();
    let theory = [f64::from(order as u8), f64::from(order as u8) + 1.0];
    let mut last = [0.0; 2];
    eprintln!(
        "order {order}: n {}, energy and L2 {:?}",
        meshes[0], errors[0]
    );
    for k in 1..meshes.len() {
        let ratio = (meshes[k] as f64 / meshes[k - 1] as f64).ln();
        last = [0, 1].map(|c| (errors[k - 1][c] / errors[k][c]).ln() / ratio);
        eprintln!(
            "order {order}: n {}, energy and L2 {:?}, orders {last:.3?}",
            meshes[k], errors[k]
        );
    }
    for c in 0..2 {
        assert!(
            (last[c] - theory[c]).abs() < 0.15,
            "order {order}: observed {last:?}, theory {theory:?}"
        );
    }
}

#[test]
fn ring_tet4_converges_with_orders_1_and_2() {
    check_orders(Order::Linear, &[8, 16, 32]);
}

/// In L2 the order comes down to 3 from above (3.32, 3.16, 3.09): beside the h³ there is an h⁴, so
/// that e² / h⁶ is a constant and a term in h². Hence the finer meshes here.
#[test]
fn ring_tet10_converges_with_orders_2_and_3() {
    check_orders(Order::Quadratic, &[8, 16, 24, 32]);
}

#[test]
fn ring_tet20_converges_with_orders_3_and_4() {
    check_orders(Order::Cubic, &[3, 6, 12]);
}

/// The closed form against numbers of the book: u_r = 0.084583 mm and a hoop stress of
/// (b² + a²) / (b² - a²) p = 16.667 MPa at the inner radius, no radial stress at the outer one.
#[test]
fn the_closed_form_has_the_numbers_of_the_book() {
    let material = material();
    let stress = |r: f64| fem::stress::stress(&material, &strain([r, 0.0, 0.0]));
    assert!((displacement([INNER, 0.0, 0.0])[0] - 0.084583e-3).abs() < 5e-10);
    assert!((stress(INNER)[1][1] - 5.0 / 3.0 * PRESSURE).abs() < 1e-12 * PRESSURE);
    assert!((stress(INNER)[0][0] + PRESSURE).abs() < 1e-12 * PRESSURE);
    assert!(stress(OUTER)[0][0].abs() < 1e-12 * PRESSURE);
}

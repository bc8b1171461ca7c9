//! Strain at the skin against closed forms: exact where the elements are, of which order where they are not, and
//! whether the error bar covers.

use fem::recovery::Recovery;
use fem::stress::{Extremes, Tensor, largest_principal};
use fem::{FactoredStiffness, Material, Mesh, Order, Quadrature, Silent, Supports};

use crate::common::{ORDERS, assemble, bend, block, cube, hold, interpolate};
use crate::convergence::{self, INNER, ring};

fn worst(a: &Tensor, b: &Tensor) -> f64 {
    largest_principal(&std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][j] - b[i][j])
    }))
}

/// A vector or a tensor at each place.
type Field<T> = Box<dyn Fn([f64; 3]) -> T>;

/// A displacement of degree p, and its strain.
fn polynomial(degree: i32) -> (Field<[f64; 3]>, Field<Tensor>) {
    const A: [[f64; 3]; 3] = [[0.3, -0.7, 0.4], [0.9, 0.2, -0.5], [-0.1, 0.6, 0.8]];
    const B: [[f64; 3]; 3] = [[1.0, 0.2, -0.4], [-0.3, 0.8, 0.5], [0.6, -0.9, 0.1]];
    let along = |d: [f64; 3], x: [f64; 3]| 0.2 + d[0] * x[0] + d[1] * x[1] + d[2] * x[2];
    let u = move |x: [f64; 3]| {
        std::array::from_fn(|c| {
            (0..3)
                .map(|k| 1e-2 * B[c][k] * along(A[k], x).powi(degree))
                .sum()
        })
    };
    let strain = move |x: [f64; 3]| {
        let h: Tensor = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..3)
                    .map(|k| {
                        1e-2 * B[i][k]
                            * f64::from(degree)
                            * along(A[k], x).powi(degree - 1)
                            * A[k][j]
                    })
                    .sum()
            })
        });
        fem::stress::strain(&h)
    };
    (Box::new(u), Box::new(strain))
}

/// Strains of degree p - 1 are those of a displacement that the elements hold exactly: nothing may be lost, at vertices,
/// between them, at edges, corners, on faces; and the bar is nothing then.
#[test]
fn strains_of_the_elements_order_are_exact_everywhere_on_the_skin() {
    for order in ORDERS {
        for n in [1, 2, 3] {
            let (u, exact) = polynomial(order as i32);
            let mesh = cube(order, n, |x| x);
            let u = interpolate(&mesh, u);
            let recovery = Recovery::new(&mesh);
            let strain = recovery.strain(&u);
            assert_eq!(recovery.nodes(), mesh.surface_nodes());
            for (i, &node) in recovery.nodes().iter().enumerate() {
                let off = worst(&strain.at_nodes()[i], &exact(mesh.nodes[node as usize]));
                assert!(off < 1e-10, "order {order}, n {n}, node {node}: {off:e}");
                assert!(strain.error(i) < if order == Order::Linear { 1e-10 } else { 1.0 });
            }
            for (f, face) in recovery.faces().iter().enumerate() {
                let l = [0.2, 0.5, 0.3];
                let x = std::array::from_fn(|c| {
                    (0..3)
                        .map(|k| l[k] * mesh.nodes[face.nodes[k] as usize][c])
                        .sum()
                });
                let off = worst(&strain.on_face(f, l), &exact(x));
                assert!(off < 1e-10, "order {order}, n {n}, face {f}: {off:e}");
            }
        }
    }
}

/// Curved elements hold uniform strains.
#[test]
fn a_uniform_strain_is_exact_on_curved_elements_and_has_no_bar() {
    for order in ORDERS {
        let (u, exact) = polynomial(1);
        let mesh = cube(order, 2, bend);
        let u = interpolate(&mesh, u);
        let recovery = Recovery::new(&mesh);
        let strain = recovery.strain(&u);
        for (i, &node) in recovery.nodes().iter().enumerate() {
            let off = worst(&strain.at_nodes()[i], &exact(mesh.nodes[node as usize]));
            assert!(off < 1e-11, "order {order}: {off:e}");
            assert!(strain.error(i) < 1e-11, "order {order}");
        }
    }
}

/// A tetrahedron alone has too few samples for its own degree: what it holds is kept all the same.
#[test]
fn one_element_alone_keeps_its_own_strain() {
    for order in ORDERS {
        let (u, exact) = polynomial(order as i32);
        let vertices = [[0.0; 3], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.1, 0.3, 1.1]];
        let nodes: Vec<[f64; 3]> = order
            .node_coordinates()
            .into_iter()
            .map(|l| std::array::from_fn(|c| (0..4).map(|v| l[v] * vertices[v][c]).sum()))
            .collect();
        let count = nodes.len() as u64;
        let elements = (0..count as u32).collect();
        let mesh = Mesh::new(
            order,
            nodes,
            (1..=count).collect(),
            elements,
            vec![1],
            vec![],
        );
        let u = interpolate(&mesh, u);
        let recovery = Recovery::new(&mesh);
        for (i, t) in recovery.strain(&u).at_nodes().iter().enumerate() {
            let off = worst(t, &exact(mesh.nodes[recovery.nodes()[i] as usize]));
            assert!(off < 1e-10, "order {order}: {off:e}");
        }
    }
}

/// Largest errors over the inner radius, relative to the largest strain there; and the largest ratio of true error of
/// the principal strain to the bar.
struct Seen {
    recovered: f64,
    bar: f64,
    beyond: f64,
    covered: f64,
}

fn look(mesh: &Mesh, u: &[f64], exact: impl Fn([f64; 3]) -> Tensor) -> Seen {
    let recovery = Recovery::new(mesh);
    let strain = recovery.strain(u);
    let (mut top, mut off, mut bar, mut beyond) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let (mut covered, mut count) = (0.0, 0.0);
    for (i, &node) in recovery.nodes().iter().enumerate() {
        let x = mesh.nodes[node as usize];
        if (x[0].hypot(x[1]) / INNER - 1.0).abs() > 1e-6 {
            continue;
        }
        let right = exact(x);
        top = top.max(largest_principal(&right));
        let error = (largest_principal(&strain.at_nodes()[i]) - largest_principal(&right)).abs();
        off = off.max(error);
        bar = bar.max(strain.error(i));
        beyond = beyond.max(error / strain.error(i));
        count += 1.0;
        covered += f64::from(u8::from(error <= strain.error(i)));
    }
    Seen {
        recovered: off / top,
        bar: bar / top,
        beyond,
        covered: covered / count,
    }
}

fn lame(order: Order, n: usize) -> Seen {
    let (mesh, supports) = ring(order, n);
    let material = convergence::material();
    let stiffness = assemble(&mesh, material, Quadrature::Converged);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let inner = mesh.group("inner").unwrap();
    let load = fem::load::pressure(&mesh, inner, convergence::PRESSURE).unwrap();
    look(&mesh, &factor.solve(&load), convergence::strain)
}

/// Strip under tension with a round hole (Kirsch 1898; Timoshenko, Goodier, Theory of Elasticity, section 35), plane
/// strain; the closed form's displacement is imposed at the outer radius.
///
/// ```text
/// u_x = a/8μ [r/a (κ+1) cos θ + 2 a/r ((1+κ) cos θ + cos 3θ) - 2 (a/r)³ cos 3θ]
/// u_y = a/8μ [r/a (κ-3) sin θ + 2 a/r ((1-κ) sin θ + sin 3θ) - 2 (a/r)³ sin 3θ]      κ = 3 - 4ν
/// at r = a: σ_θ = 1 - 2 cos 2θ, alone
/// ```
fn kirsch(order: Order, n: usize) -> Seen {
    let (mesh, mut supports) = ring(order, n);
    let material = convergence::material();
    let (mu, nu) = (material.shear_modulus(), material.poisson_ratio());
    let kappa = 3.0 - 4.0 * nu;
    let stress = 1e6;
    let exact = |x: [f64; 3]| {
        let (r, t) = (x[0].hypot(x[1]) / INNER, x[1].atan2(x[0]));
        let scale = stress * INNER / (8.0 * mu);
        let (c3, s3) = ((3.0 * t).cos(), (3.0 * t).sin());
        let ux = r * (kappa + 1.0) * t.cos() + 2.0 / r * ((1.0 + kappa) * t.cos() + c3)
            - 2.0 * c3 / r.powi(3);
        let uy = r * (kappa - 3.0) * t.sin() + 2.0 / r * ((1.0 - kappa) * t.sin() + s3)
            - 2.0 * s3 / r.powi(3);
        [scale * ux, scale * uy, 0.0]
    };
    let mut imposed = vec![0.0; 3 * mesh.n_nodes()];
    for (i, &x) in mesh.nodes.iter().enumerate() {
        if (x[0].hypot(x[1]) / convergence::OUTER - 1.0).abs() < 1e-6 {
            supports.fix_node(i as u32, [true; 3]);
            imposed[3 * i..3 * i + 3].copy_from_slice(&exact(x));
        }
    }
    let stiffness = assemble(&mesh, material, Quadrature::Converged);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let load: Vec<f64> = stiffness.multiply(&imposed).iter().map(|f| -f).collect();
    let u: Vec<f64> = factor
        .solve(&load)
        .iter()
        .zip(&imposed)
        .map(|(u, i)| u + i)
        .collect();
    let young = 2.0 * mu * (1.0 + nu);
    look(&mesh, &u, |x| {
        let t = x[1].atan2(x[0]);
        let hoop = stress * (1.0 - 2.0 * (2.0 * t).cos());
        let (e_t, e_r) = (
            (1.0 - nu * nu) / young * hoop,
            -nu * (1.0 + nu) / young * hoop,
        );
        let (c, s) = (t.cos(), t.sin());
        let shear = (e_r - e_t) * c * s;
        [
            [e_r * c * c + e_t * s * s, shear, 0.0],
            [shear, e_r * s * s + e_t * c * c, 0.0],
            [0.0; 3],
        ]
    })
}

/// Observed on n cells across the wall: errors fall with at least h^(p - 1/2) (h^0.8, h^2.3 and h^2.7 are seen); the bar is
/// passed by no more than a factor of 2, by few nodes, on the coarsest meshes, and by none on the finer ones of orders 2 and 3
/// (there it is up to fifty times too wide: it is the error of the elements' own strain, of a lower order).
fn check(case: impl Fn(Order, usize) -> Seen, order: Order, meshes: [usize; 3]) {
    let seen = meshes.map(|n| case(order, n));
    for (n, s) in meshes.iter().zip(&seen) {
        eprintln!(
            "order {order}, n {n}: error {:.2e}, bar {:.2e}, passed {:.2} times, {:.0} % covered",
            s.recovered,
            s.bar,
            s.beyond,
            100.0 * s.covered
        );
        assert!(s.beyond < 2.0, "order {order}, n {n}: {}", s.beyond);
        assert!(s.covered > 0.55, "order {order}, n {n}: {}", s.covered);
        assert!(
            s.bar < 10.0 * s.recovered.max(0.02),
            "order {order}, n {n}: {}",
            s.bar
        );
    }
    let finest = &seen[2];
    assert!(finest.covered > 0.9, "order {order}: {}", finest.covered);
    if order > Order::Linear {
        assert!(finest.beyond < 1.0, "order {order}: {}", finest.beyond);
    }
    let ratio = meshes[2] as f64 / meshes[0] as f64;
    let rate = (seen[0].recovered / finest.recovered).ln() / ratio.ln();
    assert!(rate > f64::from(order as u8) - 0.5, "order {order}: {rate}");
}

#[test]
fn lames_ring_has_its_hoop_strain_at_the_inner_radius() {
    check(lame, Order::Linear, [2, 4, 12]);
    check(lame, Order::Quadratic, [2, 4, 12]);
    check(lame, Order::Cubic, [2, 4, 8]);
}

#[test]
fn a_hole_has_three_times_the_strain_of_the_strip() {
    check(kirsch, Order::Linear, [4, 8, 12]);
    check(kirsch, Order::Quadratic, [2, 4, 12]);
    check(kirsch, Order::Cubic, [2, 4, 8]);
}

/// Cantilever under an end load: on top, one to three thicknesses from the clamp, ε = 6 P (L - x) / (E b h²). One quadratic
/// element across the thickness bends to some per cent.
#[test]
fn a_cantilevers_surface_strain_is_the_beams() {
    let (length, width, height) = (20e-3, 3e-3, 2e-3);
    for (order, cells, tolerance) in [
        (Order::Quadratic, [14, 2, 1], 0.03),
        (Order::Quadratic, [20, 2, 2], 0.01),
        (Order::Cubic, [10, 1, 1], 0.01),
    ] {
        let mesh = block(order, cells, [length, width, height]);
        let young = 2e9;
        let material = Material::new(young, 0.0).unwrap();
        let fixed = mesh.group("fixed").unwrap();
        let supports: Supports = hold(&mesh, &fixed.nodes);
        let stiffness = assemble(&mesh, material, Quadrature::Fast);
        let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
        let load_nodes = &mesh.group("load").unwrap().nodes;
        let total = -1.0;
        let mut load = vec![0.0; 3 * mesh.n_nodes()];
        for &node in load_nodes {
            load[3 * node as usize + 2] = total / load_nodes.len() as f64;
        }
        let u = factor.solve(&load);
        let recovery = Recovery::new(&mesh);
        let strain = recovery.strain(&u);
        let (mut count, mut off, mut bar, mut beyond) = (0, 0.0f64, 0.0f64, 0.0f64);
        for (i, &node) in recovery.nodes().iter().enumerate() {
            let x = mesh.nodes[node as usize];
            if (x[2] - height).abs() > 1e-9 || (x[0] - 2.0 * height).abs() > height {
                continue;
            }
            let beam = 6.0 * total.abs() * (length - x[0]) / (young * width * height * height);
            let here = strain.at_nodes()[i][0][0];
            off = off.max((here / beam - 1.0).abs());
            bar = bar.max(strain.error(i) / beam);
            beyond = beyond.max((here - beam).abs() / strain.error(i));
            count += 1;
        }
        eprintln!(
            "order {order} {cells:?}: off {off:.2e}, bar {bar:.2e}, passed {beyond:.2} times"
        );
        assert!(count > 20, "{count}");
        assert!(
            off < tolerance && off < bar && beyond < 1.0,
            "{off} {bar} {beyond}"
        );
        // The integration points, which lie inside, see little of it.
        let inside = Extremes::of(&mesh, &[material], &vec![0; mesh.n_elements()], &u);
        let clamp = 6.0 * total.abs() * length / (young * width * height * height);
        eprintln!(
            "integration points {:.3} of the clamp's",
            inside.max_principal_strain / clamp
        );
    }
}

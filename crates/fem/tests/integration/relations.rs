//! Relations that hold whatever the numbers are: symmetry, scaling, threads, loads, cancellation.

use std::sync::atomic::{AtomicUsize, Ordering};

use fem::{
    Compliance, Error, FactoredStiffness, Material, Mesh, Order, Progress, Quadrature, Silent,
    Stiffness, Supports,
};

use crate::common::{ORDERS, assemble, bend, cube, hold, largest, largest_difference, read, steel};

struct Solved {
    mesh: Mesh,
    stiffness: Stiffness,
    factor: FactoredStiffness,
}

fn solved(mesh: Mesh, material: Material) -> Solved {
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    assert_eq!(mesh.check(&supports), Ok(vec![]));
    let stiffness = assemble(&mesh, material, Quadrature::Converged);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    Solved {
        mesh,
        stiffness,
        factor,
    }
}

fn compliance(solved: &Solved) -> Compliance {
    let candidates = solved.mesh.group("load").unwrap().nodes.clone();
    let mut rows = candidates.clone();
    rows.extend(
        solved
            .mesh
            .surface_nodes()
            .into_iter()
            .filter(|n| !candidates.contains(n)),
    );
    Compliance::build(&solved.factor, &candidates, &rows, &Silent).unwrap()
}

#[test]
fn stiffness_is_symmetric_to_the_last_bit() {
    for order in ORDERS {
        let stiffness = assemble(&cube(order, 2, bend), steel(), Quadrature::Converged);
        let k = stiffness.matrix();
        let scale = largest(k.val());
        let mut worst = 0.0f64;
        for j in 0..stiffness.n_dofs() {
            for (&i, &value) in k.row_idx_of_col_raw(j).iter().zip(k.val_of_col(j)) {
                worst = worst.max((value - k.get(j, i as usize).unwrap()).abs());
            }
        }
        assert!(worst <= 1e-16 * scale, "order {order}: {worst:e}");
    }
}

#[test]
fn assembly_and_compliance_have_the_same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let solved = solved(cube(Order::Quadratic, 3, bend), steel());
            let c = compliance(&solved);
            (solved.stiffness.matrix().val().to_vec(), c)
        })
    };
    let (one, two) = (run(1), run(2));
    assert!(one == two, "threads change the answer");
}

/// C = 1 / (E L): units of length and of force changed by powers of two change exponents only.
#[test]
fn compliance_scales_with_units_to_the_last_bit() {
    for order in ORDERS {
        let material = |e: f64| Material::new(e, 0.31).unwrap();
        let base = compliance(&solved(cube(order, 2, bend), material(1.3e9)));
        let mut mesh = cube(order, 2, bend);
        mesh.scale(1.0 / 1024.0);
        let scaled = compliance(&solved(mesh, material(2.0 * 1.3e9)));
        assert!(
            base.blocks
                .iter()
                .zip(&scaled.blocks)
                .all(|(a, b)| a * 512.0 == *b),
            "order {order}"
        );
    }
}

#[test]
fn compliance_is_what_solve_gives_and_is_symmetric() {
    for order in ORDERS {
        let solved = solved(cube(order, 2, bend), steel());
        let c = compliance(&solved);
        let checks = c.check(&solved.stiffness, &solved.factor).unwrap();
        assert!(checks.symmetry_rel < 1e-13, "{checks:?}");
        assert!(checks.residual_rel < 1e-11, "{checks:?}");
        assert!(checks.smallest_pivot_rel > 0.0, "{checks:?}");
        for (j, &candidate) in c.candidates.iter().enumerate().step_by(5) {
            for component in 0..3 {
                let mut force = vec![0.0; solved.factor.n_dofs()];
                force[3 * candidate as usize + component] = 1.0;
                let u = solved.factor.solve(&force);
                for (i, &row) in c.rows.iter().enumerate() {
                    let block = &c.block(i, j)[3 * component..][..3];
                    let error = largest_difference(block, &u[3 * row as usize..][..3]);
                    assert!(error < 1e-13 * largest(&u), "order {order}: {error:e}");
                }
            }
        }
        // Held nodes do not move and are not moved by forces on them.
        let held = c
            .rows
            .iter()
            .position(|n| solved.mesh.group("fixed").unwrap().nodes.contains(n));
        assert!(c.block(held.unwrap(), 0).iter().all(|v| *v == 0.0));
    }
}

#[test]
fn a_spoiled_compliance_fails_its_check() {
    let solved = solved(cube(Order::Linear, 2, bend), steel());
    let good = compliance(&solved);
    let mut bad = good.clone();
    let n_rows = bad.rows.len();
    bad.blocks[9 * n_rows] += 1e-3 * largest(&good.blocks);
    let error = bad.check(&solved.stiffness, &solved.factor).unwrap_err();
    assert!(
        matches!(
            error,
            Error::CheckFailed {
                what: "asymmetry",
                ..
            }
        ),
        "{error}"
    );
    // Wrong on both sides alike, as a copy by symmetry would be.
    let mut bad = good.clone();
    bad.blocks[9] += 1e-3 * largest(&good.blocks);
    bad.blocks[9 * n_rows] += 1e-3 * largest(&good.blocks);
    let error = bad.check(&solved.stiffness, &solved.factor).unwrap_err();
    assert!(error.to_string().contains("solved again"), "{error}");
    let mut bad = good;
    bad.blocks.iter_mut().for_each(|v| *v = -*v);
    let error = bad.check(&solved.stiffness, &solved.factor).unwrap_err();
    assert!(error.to_string().contains("positive definite"), "{error}");
}

/// A bar held on rollers and pulled by its end face being displaced: uniaxial stress E ε.
#[test]
fn a_prescribed_displacement_gives_the_uniaxial_state() {
    let (e, nu, stretch) = (70e9, 0.33, 1e-3);
    for order in ORDERS {
        let mesh = cube(order, 2, |x| x);
        let mut supports = Supports::new(mesh.n_nodes());
        for (node, x) in (0..).zip(&mesh.nodes) {
            supports.fix_node(node, [x[0] == 0.0 || x[0] == 1.0, x[1] == 0.0, x[2] == 0.0]);
        }
        assert_eq!(mesh.check(&supports), Ok(vec![]));
        let stiffness = assemble(&mesh, Material::new(e, nu).unwrap(), Quadrature::Fast);
        let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
        let exact: Vec<f64> = mesh
            .nodes
            .iter()
            .flat_map(|x| [stretch * x[0], -nu * stretch * x[1], -nu * stretch * x[2]])
            .collect();
        let u = factor.solve_prescribed(&stiffness, &vec![0.0; exact.len()], &exact);
        assert!(
            largest_difference(&u, &exact) < 1e-13 * stretch,
            "order {order}"
        );
        // ½ E ε² V.
        let energy = 0.5 * e * stretch * stretch;
        assert!((stiffness.strain_energy(&u) / energy - 1.0).abs() < 1e-12);
    }
}

/// Shares of a uniform load on a straight face, in the order of the triangle's nodes: T3 1/3;
/// T6 0 and 1/3; T10 1/30, 3/40, 9/20.
#[test]
fn loads_on_a_straight_face_have_the_shares_of_the_book() {
    for order in ORDERS {
        let mesh = cube(order, 1, |x| x);
        let mut group = mesh.group("load").unwrap().clone();
        group.faces.truncate(1);
        let (p, area) = (12.0, 0.5);
        let force = fem::load::pressure(&mesh, &group, p).unwrap();
        let total =
            fem::load::traction_of_total_force(&mesh, &group, [-p * area, 0.0, 0.0]).unwrap();
        assert!(largest_difference(&force, &total) < 1e-14);
        for (i, &node) in group.faces[0].nodes.iter().enumerate() {
            let share = match (order, i) {
                (Order::Linear, _) => 1.0 / 3.0,
                (Order::Quadratic, 0..3) => 0.0,
                (Order::Quadratic, _) => 1.0 / 3.0,
                (Order::Cubic, 0..3) => 1.0 / 30.0,
                (Order::Cubic, 3..9) => 3.0 / 40.0,
                (_, _) => 9.0 / 20.0,
            };
            let found = &force[3 * node as usize..][..3];
            // Pressure pushes into the body: along -x on the face x = 1.
            assert!(
                largest_difference(found, &[-p * area * share, 0.0, 0.0]) < 1e-14,
                "order {order}, node {i}: {found:?}"
            );
        }
    }
}

/// A pressure all around sums to no force and no torque; the file's triangles may point anywhere.
#[test]
fn pressure_on_a_closed_surface_sums_to_nothing() {
    let turned = |mesh: &Mesh| {
        let mut group = mesh.group("surface").unwrap().clone();
        for face in group.faces.iter_mut().step_by(2) {
            face.nodes.swap(0, 1);
            match face.nodes.len() {
                6 => face.nodes.swap(4, 5),
                10 => {
                    face.nodes.swap(3, 4);
                    face.nodes.swap(5, 8);
                    face.nodes.swap(6, 7);
                }
                _ => {}
            }
        }
        group
    };
    let meshes = ORDERS.map(|order| cube(order, 2, bend));
    let rings = ["ring-tet10.msh", "ring-tet20.msh"].map(read);
    for mesh in meshes.iter().chain(&rings) {
        let surface = mesh.group("surface").unwrap();
        let force = fem::load::pressure(mesh, surface, 1.0).unwrap();
        let again = fem::load::pressure(mesh, &turned(mesh), 1.0).unwrap();
        assert!(largest_difference(&force, &again) < 1e-14);
        let (mut sum, mut torque) = ([0.0; 3], [0.0; 3]);
        for (x, f) in mesh.nodes.iter().zip(force.chunks_exact(3)) {
            for c in 0..3 {
                let (a, b) = ((c + 1) % 3, (c + 2) % 3);
                sum[c] += f[c];
                torque[c] += x[a] * f[b] - x[b] * f[a];
            }
        }
        assert!(
            largest(&sum) < 1e-13 && largest(&torque) < 1e-12,
            "{sum:?} {torque:?}"
        );
    }
}

#[test]
fn a_traction_sums_to_its_total_on_curved_faces() {
    for mesh in ["ring-tet10.msh", "ring-tet20.msh"].map(read) {
        let total = [3.0, -2.0, 0.5];
        let group = mesh.group("surface").unwrap();
        let force = fem::load::traction_of_total_force(&mesh, group, total).unwrap();
        for c in 0..3 {
            let sum: f64 = force.iter().skip(c).step_by(3).sum();
            assert!((sum - total[c]).abs() < 1e-13);
        }
        let error = fem::load::pressure(&mesh, mesh.group("body").unwrap(), 1.0).unwrap_err();
        assert_eq!(error, Error::NoFaces("body".to_owned()));
    }
}

/// Two materials: a soft half carries the strain, a stiff half hardly any.
#[test]
fn each_element_has_its_own_material() {
    let mesh = cube(Order::Linear, 2, |x| x);
    let mut of_element = vec![0; mesh.n_elements()];
    for (e, material) in of_element.iter_mut().enumerate() {
        let x: f64 = mesh
            .element_nodes(e)
            .iter()
            .map(|&n| mesh.nodes[n as usize][0])
            .sum();
        *material = u32::from(x > 2.0);
    }
    let materials = [1e6, 1e12].map(|e| Material::new(e, 0.0).unwrap());
    let stiffness =
        fem::assemble_stiffness(&mesh, &materials, &of_element, Quadrature::Fast).unwrap();
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let load = mesh.group("load").unwrap();
    let force = fem::load::traction_of_total_force(&mesh, load, [1.0, 0.0, 0.0]).unwrap();
    let u = factor.solve(&force);
    for &node in &load.nodes {
        // F L / (E A) of the soft half, L = ½ m; its inner face is not plane, so a few per cent.
        assert!(
            (u[3 * node as usize] / 0.5e-6 - 1.0).abs() < 0.1,
            "{}",
            u[3 * node as usize]
        );
    }
}

#[test]
fn a_body_held_everywhere_has_no_compliance() {
    let mesh = cube(Order::Linear, 1, |x| x);
    let all: Vec<u32> = (0..mesh.n_nodes() as u32).collect();
    let supports = hold(&mesh, &all);
    let stiffness = assemble(&mesh, steel(), Quadrature::Fast);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    assert_eq!(factor.n_free(), 0);
    assert!(
        factor
            .solve(&vec![1.0; factor.n_dofs()])
            .iter()
            .all(|u| *u == 0.0)
    );
    let c = Compliance::build(&factor, &all, &all, &Silent).unwrap();
    assert!(c.blocks.iter().all(|v| *v == 0.0));
    c.check(&stiffness, &factor).unwrap();
    let none = Compliance::build(&factor, &[], &[], &Silent).unwrap();
    none.check(&stiffness, &factor).unwrap();
}

/// Says that it is cancelled after some questions.
struct CancelAfter {
    left: usize,
    asked: AtomicUsize,
}

impl CancelAfter {
    fn new(left: usize) -> Self {
        Self {
            left,
            asked: AtomicUsize::new(0),
        }
    }
}

impl Progress for CancelAfter {
    fn advance(&self, _stage: &str, done: usize, total: usize) {
        assert!(done <= total);
    }
    fn is_cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.left
    }
}

#[test]
fn cancelled_work_says_so() {
    let mesh = cube(Order::Quadratic, 2, bend);
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    let stiffness = assemble(&mesh, steel(), Quadrature::Fast);
    for left in 0..2 {
        let error =
            FactoredStiffness::new(&stiffness, &supports, &CancelAfter::new(left)).unwrap_err();
        assert!(error.is_cancelled(), "{error}");
    }
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let surface = mesh.surface_nodes();
    for left in 0..2 {
        let error =
            Compliance::build(&factor, &surface, &surface, &CancelAfter::new(left)).unwrap_err();
        assert_eq!(error, Error::Cancelled);
    }
    Compliance::build(&factor, &surface, &surface, &CancelAfter::new(1000)).unwrap();
}

/// Two cubes that share one edge only: one piece by its nodes, but it folds along that edge.
/// Round-off decides whether a pivot is negative or tiny; one of the two checks must refuse.
#[test]
fn a_hinge_is_not_positive_definite_or_fails_its_check() {
    for order in ORDERS {
        let one = cube(order, 1, |x| x);
        let mut nodes = one.nodes.clone();
        let mut elements = one.elements.clone();
        let second: Vec<u32> = one
            .nodes
            .iter()
            .map(|x| {
                let moved = [x[0] + 1.0, x[1] + 1.0, x[2]];
                let shared = one
                    .nodes
                    .iter()
                    .position(|y| (0..3).all(|c| (y[c] - moved[c]).abs() < 1e-9));
                shared.unwrap_or_else(|| {
                    nodes.push(moved);
                    nodes.len() - 1
                }) as u32
            })
            .collect();
        elements.extend(one.elements.iter().map(|&n| second[n as usize]));
        let tags = (1..=nodes.len() as u64).collect();
        let n_elements = 2 * one.n_elements() as u64;
        let mesh = Mesh::new(
            order,
            nodes,
            tags,
            elements,
            (1..=n_elements).collect(),
            vec![],
        );
        let supports = hold(&mesh, &one.group("fixed").unwrap().nodes);
        let stiffness = assemble(&mesh, steel(), Quadrature::Fast);
        let refused = FactoredStiffness::new(&stiffness, &supports, &Silent).and_then(|factor| {
            let surface = mesh.surface_nodes();
            Compliance::build(&factor, &surface, &surface, &Silent)?.check(&stiffness, &factor)
        });
        assert!(
            matches!(
                refused,
                Err(Error::NotPositiveDefinite { .. } | Error::CheckFailed { .. })
            ),
            "order {order}: {refused:?}"
        );
    }
}

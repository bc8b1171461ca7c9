//! Columns of the compliance, solved for in panels, only where needed and half of them by symmetry:
//! the same as each solved in full and by itself, whatever the order, the units and the threads.

use fem::{Compliance, FactoredStiffness, Mesh, Order, Quadrature, Silent, Supports};

use crate::common::{assemble, bend, block, cube, hold, largest, steel};

/// Surface nodes that are not held, of which the first `n_candidates` can touch.
fn surface(mesh: &Mesh, supports: &Supports, n_candidates: usize) -> (Vec<u32>, Vec<u32>) {
    let mut rows = mesh.surface_nodes();
    rows.sort_by_key(|&node| supports.is_fixed_in_all(node));
    (rows[..n_candidates.min(rows.len())].to_vec(), rows)
}

/// Largest difference to columns solved in full, each column over its largest entry.
fn difference(factor: &FactoredStiffness, c: &Compliance) -> f64 {
    let n = factor.n_dofs();
    let mut forces = vec![0.0; 3 * n * c.candidates.len()];
    for (j, &node) in c.candidates.iter().enumerate() {
        for component in 0..3 {
            forces[(3 * j + component) * n + 3 * node as usize + component] = 1.0;
        }
    }
    let mut worst = 0.0f64;
    for (column, u) in factor.solve_many(&forces).chunks_exact(n).enumerate() {
        let scale = largest(u).max(f64::MIN_POSITIVE);
        for (i, &row) in c.rows.iter().enumerate() {
            let kept = &c.block(i, column / 3)[3 * (column % 3)..][..3];
            for (kept, u) in kept.iter().zip(&u[3 * row as usize..]) {
                worst = worst.max((kept - u).abs() / scale);
            }
        }
    }
    worst
}

/// Rollers on three faces: many nodes are held in one or two directions, and are candidates.
fn on_rollers(mesh: &Mesh) -> Supports {
    let mut supports = Supports::new(mesh.n_nodes());
    for (node, x) in (0..).zip(&mesh.nodes) {
        supports.fix_node(node, x.map(|x| x.abs() < 1e-12));
    }
    supports
}

/// A solid that is best dissected, a strip that is best ordered by degree; all of the surface can
/// touch, some, one node. 1e-12: round-off of parts of this condition.
#[test]
fn columns_are_those_solved_in_full() {
    let solid = block(Order::Quadratic, [5, 5, 5], [1.0; 3]);
    let strip = block(Order::Quadratic, [24, 2, 1], [24.0, 2.0, 1.0]);
    for mesh in [solid, strip] {
        let clamped = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
        for supports in [clamped, on_rollers(&mesh)] {
            let stiffness = assemble(&mesh, steel(), Quadrature::Fast);
            let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
            for n_candidates in [usize::MAX, 100, 1] {
                let (candidates, rows) = surface(&mesh, &supports, n_candidates);
                let c = Compliance::build(&factor, &candidates, &rows, &Silent).unwrap();
                let error = difference(&factor, &c);
                assert!(error < 1e-12, "{n_candidates} candidates: {error:e}");
                c.check(&stiffness, &factor).unwrap();
            }
        }
    }
}

/// Rows inside the body are had as well.
#[test]
fn all_nodes_may_be_candidates() {
    let mesh = cube(Order::Quadratic, 2, bend);
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    let stiffness = assemble(&mesh, steel(), Quadrature::Fast);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let all: Vec<u32> = (0..mesh.n_nodes() as u32).collect();
    let c = Compliance::build(&factor, &all, &all, &Silent).unwrap();
    let error = difference(&factor, &c);
    assert!(error < 1e-13, "{error:e}");
}

fn surface_compliance(mesh: &Mesh, young_modulus: f64) -> Compliance {
    let material = fem::Material::new(young_modulus, 0.31).unwrap();
    let supports = on_rollers(mesh);
    let stiffness = assemble(mesh, material, Quadrature::Fast);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let (candidates, rows) = surface(mesh, &supports, 150);
    Compliance::build(&factor, &candidates, &rows, &Silent).unwrap()
}

#[test]
fn threads_change_no_bit() {
    let mesh = block(Order::Quadratic, [4, 4, 3], [4.0, 4.0, 3.0]);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| surface_compliance(&mesh, 1e9))
    };
    let one = run(1);
    assert!(one == run(2), "two threads change the answer");
    assert!(one == run(5), "five threads change the answer");
}

#[test]
fn units_by_powers_of_two_change_exponents_only() {
    let mesh = block(Order::Quadratic, [4, 4, 3], [4.0, 4.0, 3.0]);
    let base = surface_compliance(&mesh, 1.3e9);
    let mut small = mesh.clone();
    small.scale(1.0 / 1024.0);
    let scaled = surface_compliance(&small, 4.0 * 1.3e9);
    assert_eq!(base.rows, scaled.rows);
    let mut pairs = base.blocks.iter().zip(&scaled.blocks);
    assert!(pairs.all(|(a, b)| a * 256.0 == *b));
}

/// Panels follow the order of elimination, not that of the list.
#[test]
fn the_order_of_the_candidates_changes_no_bit() {
    let mesh = block(Order::Quadratic, [4, 4, 3], [4.0, 4.0, 3.0]);
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    let stiffness = assemble(&mesh, steel(), Quadrature::Fast);
    let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let (candidates, rows) = surface(&mesh, &supports, 120);
    let c = Compliance::build(&factor, &candidates, &rows, &Silent).unwrap();
    let turned: Vec<u32> = candidates.iter().rev().copied().collect();
    let t = Compliance::build(&factor, &turned, &turned, &Silent).unwrap();
    let last = candidates.len() - 1;
    for j in 0..=last {
        for i in 0..=last {
            assert_eq!(c.block(i, j), t.block(last - i, last - j), "{i} {j}");
        }
    }
}

//! The part whose interface nodes follow, and what freeing only the neighbourhood of the load is worth on a bending arm.

use fem::{
    ConstrainedStiffness, FactoredStiffness, Hierarchy, Material, Order, Quadrature, Rule, Silent,
    Stiffness, Supports,
};
use nalgebra::DMatrix;

use crate::common::{assemble, bend, block, cube, hold, largest, steel};

struct Part {
    stiffness: Stiffness,
    supports: Supports,
    hierarchy: Hierarchy,
    candidates: Vec<u32>,
}

/// A curved cube held at one face, touched at the opposite one.
fn part(order: Order, n: usize) -> Part {
    let mesh = cube(order, n, bend);
    let stiffness = assemble(&mesh, steel(), Quadrature::Converged);
    let fixed = &mesh.group("fixed").unwrap().nodes;
    let supports = hold(&mesh, fixed);
    let candidates = mesh.group("load").unwrap().nodes.clone();
    Part {
        hierarchy: Hierarchy::of(&mesh),
        stiffness,
        supports,
        candidates,
    }
}

impl Part {
    /// By assembling and factoring Tᵀ K T anew.
    fn anew(&self, free: &[u32]) -> ConstrainedStiffness {
        let follow: Vec<u32> = self
            .hierarchy
            .interface_nodes()
            .iter()
            .copied()
            .filter(|n| !free.contains(n))
            .collect();
        let constraints = self
            .hierarchy
            .constrain(&follow, &self.supports, Rule::AffineExact);
        ConstrainedStiffness::new(&self.stiffness, &self.supports, &constraints, &Silent).unwrap()
    }

    /// About a third of the interface nodes.
    fn some(&self, seed: usize) -> Vec<u32> {
        let interface = self.hierarchy.interface_nodes().iter();
        let picked = interface
            .enumerate()
            .filter(|(k, _)| (k * 31 + seed * 17) % 7 < 3);
        picked.map(|(_, node)| *node).collect()
    }
}

/// Displacement of the touched nodes under unit forces on them, 3 n by 3 n.
fn touched(part: &Part, solve: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    let dofs: Vec<usize> = part
        .candidates
        .iter()
        .flat_map(|node| (0..3).map(|c| 3 * *node as usize + c))
        .collect();
    let mut dense = DMatrix::zeros(dofs.len(), dofs.len());
    for (k, dof) in dofs.iter().enumerate() {
        let mut force = vec![0.0; part.stiffness.n_dofs()];
        force[*dof] = 1.0;
        let u = solve(&force);
        for (r, dof) in dofs.iter().enumerate() {
            dense[(r, k)] = u[*dof];
        }
    }
    dense
}

#[test]
fn freeing_makes_softer_and_never_stiffer_up_to_the_full_part() {
    for order in [Order::Quadratic, Order::Cubic] {
        let part = part(order, 2);
        let full = FactoredStiffness::new(&part.stiffness, &part.supports, &Silent).unwrap();
        let full = touched(&part, |force| full.solve(force));
        let some = part.some(3);
        let half = &some[..some.len() / 2];
        let all = part.hierarchy.interface_nodes();
        let chain = [&[], half, &some, all].map(|free| {
            let part_of = part.anew(free);
            touched(&part, |force| part_of.solve(force))
        });
        for pair in chain.windows(2) {
            let softer = &pair[1] - &pair[0];
            let eigen = softer.symmetric_eigenvalues();
            let (low, high) = (eigen.min(), eigen.max());
            assert!(high > 0.0 && low > -1e-11 * high, "{order}: {low} {high}");
        }
        let difference = (&chain[3] - &full).amax();
        assert!(difference < 1e-9 * full.amax(), "{order}: {difference}");
    }
}

/// C^ = C - C Aᵀ (A C Aᵀ)⁻¹ A C with A T = 0: the other way to the constrained compliance.
#[test]
fn the_constrained_compliance_is_the_full_one_less_its_projection() {
    let part = part(Order::Quadratic, 1);
    let n = part.stiffness.n_dofs();
    let free_dofs: Vec<usize> = part.supports.free_dofs().collect();
    let at = |dof: usize| free_dofs.iter().position(|d| *d == dof);
    let mut k = DMatrix::zeros(free_dofs.len(), free_dofs.len());
    for (c, dof) in free_dofs.iter().enumerate() {
        let mut unit = vec![0.0; n];
        unit[*dof] = 1.0;
        let column = part.stiffness.multiply(&unit);
        for (r, dof) in free_dofs.iter().enumerate() {
            k[(r, c)] = column[*dof];
        }
    }
    let c = k.try_inverse().unwrap();
    let all = part.hierarchy.interface_nodes();
    let constraints = part
        .hierarchy
        .constrain(all, &part.supports, Rule::AffineExact);
    let mut rows = Vec::new();
    for constraint in constraints.iter() {
        for axis in (0..3).filter(|a| !constraint.held[*a]) {
            let mut row = vec![0.0; free_dofs.len()];
            row[at(3 * constraint.node as usize + axis).unwrap()] = 1.0;
            for (master, weight) in constraint.weights {
                if let Some(place) = at(3 * *master as usize + axis) {
                    row[place] -= weight;
                }
            }
            rows.push(row);
        }
    }
    let a = DMatrix::from_fn(rows.len(), free_dofs.len(), |r, c| rows[r][c]);
    let middle = (&a * &c * a.transpose()).try_inverse().unwrap();
    let projected = &c - &c * a.transpose() * middle * &a * &c;
    let anew = part.anew(&[]);
    let mut force = vec![0.0; n];
    for (i, dof) in free_dofs.iter().enumerate() {
        force[*dof] = ((i * 13) % 7) as f64 - 3.0;
    }
    let u = anew.solve(&force);
    let f = DMatrix::from_fn(free_dofs.len(), 1, |r, _| force[free_dofs[r]]);
    let expected = projected * f;
    let scale = largest(&u);
    for (r, dof) in free_dofs.iter().enumerate() {
        assert!((u[*dof] - expected[(r, 0)]).abs() < 1e-8 * scale);
    }
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let part = part(Order::Quadratic, 2);
    let force: Vec<f64> = (0..part.stiffness.n_dofs())
        .map(|k| ((k * 13) % 7) as f64 - 3.0)
        .collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| part.anew(&part.some(1)).solve(&force))
    };
    assert!(with(1) == with(3));
}

/// A cantilever of 20 x 5 x 3 mm, E 2300 MPa, nu 0.37, held at x = 0 and loaded across its thin side at
/// the end: stiffness with the interface nodes nearest the load free, over that of the full part.
fn stiffness_over_full(cells: [usize; 3]) -> ([f64; 4], f64, f64) {
    let mesh = block(Order::Quadratic, cells, [0.020, 0.005, 0.003]);
    let material = Material::new(2.3e9, 0.37).unwrap();
    let stiffness = assemble(&mesh, material, Quadrature::Fast);
    let supports = hold(&mesh, &mesh.group("fixed").unwrap().nodes);
    let load = mesh.group("load").unwrap();
    let force = fem::load::traction_of_total_force(&mesh, load, [0.0, 0.0, 1.0]).unwrap();
    let full = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
    let work = |u: &[f64]| u.iter().zip(&force).map(|(u, f)| u * f).sum::<f64>();
    let u = full.solve(&force);
    let hierarchy = Hierarchy::of(&mesh);
    let ratios = [0.0, 0.25, 0.5, 0.75].map(|freed: f64| {
        let follow: Vec<u32> = hierarchy
            .interface_nodes()
            .iter()
            .copied()
            .filter(|n| mesh.nodes[*n as usize][0] < 0.020 * (1.0 - freed) + 1e-9)
            .collect();
        let follow = if freed == 0.0 {
            hierarchy.interface_nodes().to_vec()
        } else {
            follow
        };
        let constraints = hierarchy.constrain(&follow, &supports, Rule::AffineExact);
        let part = ConstrainedStiffness::new(&stiffness, &supports, &constraints, &Silent).unwrap();
        work(&u) / work(&part.solve(&force))
    });
    let all = hierarchy.interface_nodes();
    let constraints = hierarchy.constrain(all, &supports, Rule::AffineExact);
    let lost = constraints
        .departures(&u)
        .map(|(_, d)| d)
        .fold(0.0, f64::max);
    (ratios, work(&u), lost / largest(&u))
}

/// Source: the numbers that the seed's claim was checked with (another mesh of as many elements): 4.8, 4.4,
/// 3.1, 1.7 with 96 elements and 2.26, 2.15, 1.87, 1.40 with 432, when 0, 25, 50 and 75 % of the length
/// are freed; tip compliance 0.10292 mm/N with 432, 0.10306 by Euler and Bernoulli. Which way its cells
/// are cut is not known: a fifth. (Ours is 6.1 and 2.5 % stiffer than the beam, and 1.3 % with 1536
/// elements.) What interpolating all interface nodes loses is bounded by l²/8 max|u''|,
/// l the longest edge, u'' = 3 u/L² at the clamp.
#[test]
fn freeing_only_near_the_load_leaves_an_arm_too_stiff() {
    for (cells, published, beam) in [
        ([4, 2, 2], [4.8, 4.4, 3.1, 1.7], 0.07),
        ([8, 3, 3], [2.26, 2.15, 1.87, 1.40], 0.03),
    ] {
        let (ratios, compliance, lost) = stiffness_over_full(cells);
        let n = 6 * cells.iter().product::<usize>();
        eprintln!("{n} elements: {ratios:.3?}, {compliance:.5e} m/N, {lost:.4}");
        for (ratio, published) in ratios.iter().zip(published) {
            assert!(
                (ratio / published - 1.0).abs() < 0.2,
                "{n}: {ratio} {published}"
            );
        }
        assert!(
            ratios.is_sorted_by(|a, b| a > b) && ratios[3] > 1.0,
            "{ratios:?}"
        );
        let edge_squared: f64 = [20.0, 5.0, 3.0]
            .iter()
            .zip(cells)
            .map(|(size, n)| (size / n as f64).powi(2))
            .sum();
        let bound = edge_squared / 8.0 * 3.0 / 400.0;
        assert!(lost < bound && lost > 0.3 * bound, "{n}: {lost} {bound}");
        assert!(
            (compliance / 1.0306e-4 - 1.0).abs() < beam,
            "{n}: {compliance}"
        );
    }
}

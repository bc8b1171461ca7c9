//! Constraints by which interface nodes follow: straight and curved edges, every transition.
//!
//! Source: Duriez et al. 2004, Fig. 2 and section 3.2. A rigid turn of a curved body must make no force
//! through the constraints; with the plain rule of straight edges it does.

use fem::{Constraints, Hierarchy, Mesh, Order, Quadrature, Rule, Supports};

use crate::common::{assemble, bend, cube, interpolate, largest, largest_difference, steel};

fn free(mesh: &Mesh) -> Supports {
    Supports::new(mesh.n_nodes())
}

/// All interface nodes follow their vertices.
fn all_linear(mesh: &Mesh, rule: Rule) -> Constraints {
    let hierarchy = Hierarchy::of(mesh);
    hierarchy.constrain(hierarchy.interface_nodes(), &free(mesh), rule)
}

/// Edges of orders 1, 2 and as they are, in turns: neighbours differ.
fn mixed(mesh: &Mesh, rule: Rule) -> Constraints {
    let hierarchy = Hierarchy::of(mesh);
    let orders: Vec<Order> = (0..hierarchy.edges().len())
        .map(|e| [Order::Linear, Order::Quadratic, mesh.order][e * 7 % 3])
        .collect();
    hierarchy.constrain_edges(&orders, &free(mesh), rule)
}

/// Every edge of a cubic mesh is quadratic.
fn all_quadratic(mesh: &Mesh, rule: Rule) -> Constraints {
    let hierarchy = Hierarchy::of(mesh);
    let orders = vec![Order::Quadratic; hierarchy.edges().len()];
    hierarchy.constrain_edges(&orders, &free(mesh), rule)
}

type Transition = fn(&Mesh, Rule) -> Constraints;

/// 1-2, 1-3, 2-3, and mixtures of them.
const TRANSITIONS: [(Order, Transition); 5] = [
    (Order::Quadratic, all_linear),
    (Order::Cubic, all_linear),
    (Order::Cubic, all_quadratic),
    (Order::Quadratic, mixed),
    (Order::Cubic, mixed),
];

/// Edges of third degree, so that rules exact for parabolas are trapped too.
fn bend_more(x: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = bend(x);
    [a + 0.06 * b * b * b, b, c - 0.05 * a * a * a]
}

fn turn([x, y, z]: [f64; 3]) -> [f64; 3] {
    let w = [0.2, -0.5, 0.4];
    [
        w[1] * z - w[2] * y,
        w[2] * x - w[0] * z,
        w[0] * y - w[1] * x,
    ]
}

fn stretch([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        0.3 + 0.1 * x - 0.2 * y + 0.4 * z,
        -0.1 + 0.5 * x + 0.3 * y,
        0.7 * z - 0.2 * x + 0.13,
    ]
}

#[test]
fn every_node_is_principal_or_interface() {
    for order in [Order::Linear, Order::Quadratic, Order::Cubic] {
        let mesh = cube(order, 2, |x| x);
        let hierarchy = Hierarchy::of(&mesh);
        assert_eq!(hierarchy.principal_nodes().len(), 27);
        assert_eq!(
            hierarchy.principal_nodes().len() + hierarchy.interface_nodes().len(),
            mesh.n_nodes()
        );
        for node in 0..mesh.n_nodes() as u32 {
            assert_ne!(hierarchy.is_principal(node), hierarchy.is_interface(node));
        }
    }
}

#[test]
fn on_straight_edges_the_weights_are_those_of_the_paper() {
    for (order, expected) in [(Order::Quadratic, 0.5), (Order::Cubic, 1.0 / 3.0)] {
        let mesh = cube(order, 2, |x| x);
        for constraint in all_linear(&mesh, Rule::AffineExact).iter() {
            for (_, weight) in constraint.weights {
                let is_expected = [expected, 1.0 - expected]
                    .iter()
                    .any(|w| (weight - w).abs() < 1e-14);
                assert!(is_expected, "{order} {:?}", constraint.weights);
            }
        }
    }
}

#[test]
fn weights_sum_to_one_and_give_the_place_of_the_node() {
    for (order, transition) in TRANSITIONS {
        let mesh = cube(order, 3, bend);
        let places = interpolate(&mesh, |x| x);
        let constraints = transition(&mesh, Rule::AffineExact);
        assert!(!constraints.nodes().is_empty());
        for constraint in constraints.iter() {
            let sum: f64 = constraint.weights.iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-13, "{sum}");
            let place = constraint.interpolate(&places);
            let node = &places[3 * constraint.node as usize..][..3];
            for c in 0..3 {
                assert!(
                    (place[c] - node[c]).abs() < 1e-13,
                    "{order} {place:?} {node:?}"
                );
            }
            // What is followed does not follow.
            for (master, _) in constraint.weights {
                assert!(constraints.of_node(*master).is_none());
            }
        }
    }
}

#[test]
fn a_turned_curved_body_makes_no_force_but_with_the_plain_rule_it_does() {
    for (order, transition) in TRANSITIONS {
        let mesh = cube(order, 2, bend_more);
        let stiffness = assemble(&mesh, steel(), Quadrature::Converged);
        let force_of = |rule: Rule, field: fn([f64; 3]) -> [f64; 3]| {
            let mut u = interpolate(&mesh, field);
            transition(&mesh, rule).apply(&mut u);
            largest(&stiffness.multiply(&u))
        };
        let scale = force_of(Rule::AffineExact, stretch);
        let turned = force_of(Rule::AffineExact, turn);
        assert!(turned < 1e-11 * scale, "{order}: {turned} of {scale}");
        let trapped = force_of(Rule::Plain, turn);
        assert!(
            trapped > 1e-3 * scale,
            "{order}: the trap is {trapped} of {scale}"
        );
    }
}

#[test]
fn linear_fields_pass_through_every_transition_on_curved_elements() {
    for (order, transition) in TRANSITIONS {
        let mesh = cube(order, 2, bend);
        let exact = interpolate(&mesh, stretch);
        let mut u = exact.clone();
        let constraints = transition(&mesh, Rule::AffineExact);
        for node in constraints.nodes() {
            u[3 * *node as usize..][..3].fill(f64::NAN);
        }
        constraints.apply(&mut u);
        assert!(largest_difference(&u, &exact) < 1e-13, "{order}");
    }
}

#[test]
fn quadratic_fields_pass_through_2_3_on_straight_elements() {
    let mesh = cube(Order::Cubic, 2, |x| x);
    let field = |[x, y, z]: [f64; 3]| [x * x - y * z, x * y + z * z, y * y - 2.0 * x * z];
    let exact = interpolate(&mesh, field);
    let mut u = exact.clone();
    all_quadratic(&mesh, Rule::AffineExact).apply(&mut u);
    assert!(largest_difference(&u, &exact) < 1e-13);
    // A cubic field does not: one node of each edge has lost its freedom.
    let exact = interpolate(&mesh, |[x, _, _]| [x * x * x, 0.0, 0.0]);
    let mut u = exact.clone();
    all_quadratic(&mesh, Rule::AffineExact).apply(&mut u);
    assert!(largest_difference(&u, &exact) > 1e-4);
}

#[test]
fn held_components_stay_held() {
    let mesh = cube(Order::Quadratic, 1, |x| x);
    let hierarchy = Hierarchy::of(&mesh);
    let node = hierarchy.interface_nodes()[0];
    let mut supports = free(&mesh);
    supports.fix_node(node, [false, true, false]);
    let constraints = hierarchy.constrain(&[node], &supports, Rule::AffineExact);
    let mut u = interpolate(&mesh, stretch);
    u[3 * node as usize..][..3].fill(0.0);
    constraints.apply(&mut u);
    let after = &u[3 * node as usize..][..3];
    assert!(
        after[0] != 0.0 && after[1] == 0.0 && after[2] != 0.0,
        "{after:?}"
    );
}

#[test]
fn departures_are_what_interpolation_would_lose() {
    let mesh = cube(Order::Quadratic, 2, |x| x);
    let u = interpolate(&mesh, |[x, _, _]| [x * x, 0.0, 0.0]);
    let constraints = all_linear(&mesh, Rule::AffineExact);
    let mut interpolated = u.clone();
    constraints.apply(&mut interpolated);
    for (node, departure) in constraints.departures(&u) {
        let lost = u[3 * node as usize] - interpolated[3 * node as usize];
        assert!((departure - lost.abs()).abs() < 1e-15);
    }
}

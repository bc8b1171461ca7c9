//! What the mesh check refuses and what it lets pass.

use fem::{Error, Mesh, Order, Supports};

use crate::common::{ORDERS, bend, cube, hold, mirror, place, read};

/// One element on the unit tetrahedron, tag 7.
fn single(order: Order) -> Mesh {
    let nodes: Vec<[f64; 3]> = order
        .node_coordinates()
        .iter()
        .map(|l| [l[1], l[2], l[3]])
        .collect();
    let n = nodes.len() as u64;
    Mesh::new(
        order,
        nodes,
        (1..=n).collect(),
        (0..n as u32).collect(),
        vec![7],
        vec![],
    )
}

fn check(mesh: &Mesh) -> Result<Vec<String>, Error> {
    mesh.check(&hold(mesh, &(0..mesh.n_nodes() as u32).collect::<Vec<_>>()))
}

/// det J of an element by central differences of the map: an independent value.
fn determinant(mesh: &Mesh, element: usize, l: [f64; 4]) -> f64 {
    let h = 1e-5;
    let columns: Vec<[f64; 3]> = (1..4)
        .map(|k| {
            let (mut up, mut down) = (l, l);
            (up[k], up[0], down[k], down[0]) = (l[k] + h, l[0] - h, l[k] - h, l[0] + h);
            let (a, b) = (place(mesh, element, up), place(mesh, element, down));
            std::array::from_fn(|c| (a[c] - b[c]) / (2.0 * h))
        })
        .collect();
    let [a, b, c] = [columns[0], columns[1], columns[2]];
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[test]
fn valid_straight_and_curved_meshes_pass_without_warning() {
    for order in ORDERS {
        assert_eq!(check(&single(order)), Ok(vec![]));
        assert!((single(order).smallest_jacobian(0) - 1.0).abs() < 1e-13);
        assert_eq!(check(&cube(order, 2, bend)), Ok(vec![]));
    }
    for name in ["ring-tet10.msh", "ring-tet20.msh"] {
        assert_eq!(check(&read(name)), Ok(vec![]), "{name}");
    }
}

#[test]
fn inverted_elements_are_named_by_their_tag() {
    for order in ORDERS {
        let mut mesh = cube(order, 2, |x| x);
        mesh.element_tags[11] = 4711;
        mirror(&mut mesh, 11);
        let error = check(&mesh).unwrap_err();
        assert!(
            matches!(error, Error::Inverted { tag: 4711, .. }),
            "{error}"
        );
    }
    let mut flat = single(Order::Linear);
    flat.nodes[3] = [0.3, 0.3, 0.0];
    assert!(matches!(check(&flat), Err(Error::Inverted { tag: 7, .. })));
}

/// All mid nodes pulled towards the centre until det J is negative somewhere, while it is still
/// positive at the vertices. Only a bound of the polynomial finds it.
#[test]
fn a_fold_between_the_nodes_is_found() {
    let mut mesh = single(Order::Quadratic);
    let nodes = Order::Quadratic.node_coordinates();
    let mut pull = 0.0;
    let fold = loop {
        pull += 0.005;
        assert!(pull < 1.0, "no fold that hides from the nodes");
        for mid in 4..10 {
            let x = [nodes[mid][1], nodes[mid][2], nodes[mid][3]];
            // Towards the centroid.
            mesh.nodes[mid] = x.map(|c| c + pull * (0.25 - c));
        }
        let inside: Vec<f64> = (0..=20)
            .flat_map(|i| (0..=20 - i).flat_map(move |j| (0..=20 - i - j).map(move |k| [i, j, k])))
            .map(|[i, j, k]| {
                let l = [i, j, k].map(|v| f64::from(v) / 20.0);
                determinant(&mesh, 0, [l[0], l[1], l[2], 1.0 - l[0] - l[1] - l[2]])
            })
            .collect();
        let lowest = inside.iter().copied().fold(f64::INFINITY, f64::min);
        // A bound is below every value.
        assert!(mesh.smallest_jacobian(0) <= lowest + 1e-6);
        if lowest < -1e-6 {
            break lowest;
        }
    };
    assert!(
        (0..4).all(|v| determinant(&mesh, 0, nodes[v]) > 0.0),
        "{fold}"
    );
    assert!(matches!(check(&mesh), Err(Error::Inverted { tag: 7, .. })));
}

/// Moving the mid node of one edge along it: valid up to a quarter of the edge from its middle,
/// where det J is zero at a vertex (the classical quarter-point element).
#[test]
fn mid_node_at_the_quarter_point_is_the_limit() {
    for (shift, is_valid) in [(0.24, true), (0.26, false), (-0.24, true), (-0.26, false)] {
        let mut mesh = single(Order::Quadratic);
        mesh.nodes[4][0] = 0.5 + shift;
        assert_eq!(check(&mesh).is_ok(), is_valid, "{shift}");
    }
}

#[test]
fn a_folded_cubic_element_is_found() {
    let mut mesh = single(Order::Cubic);
    mesh.nodes[4] = [0.8, 0.0, 0.0];
    assert!(matches!(check(&mesh), Err(Error::Inverted { tag: 7, .. })));
}

/// Coordinates so large that determinants overflow are refused, not let through as "not negative".
#[test]
fn coordinates_that_overflow_are_refused() {
    for order in ORDERS {
        let mut mesh = single(order);
        mesh.scale(1e200);
        mesh.nodes[1][1] = 1e200;
        assert!(check(&mesh).is_err(), "order {order}");
    }
}

#[test]
fn a_loose_piece_is_named_with_its_size_and_motion() {
    let one = cube(Order::Quadratic, 1, |x| x);
    let n = one.n_nodes() as u32;
    let mut nodes = one.nodes.clone();
    nodes.extend(one.nodes.iter().map(|x| [x[0] + 3.0, x[1], x[2]]));
    let mut elements = one.elements.clone();
    elements.extend(one.elements.iter().map(|i| i + n));
    let count = 2 * one.n_elements() as u64;
    let tags = (1..=nodes.len() as u64).collect();
    let mesh = Mesh::new(
        Order::Quadratic,
        nodes,
        tags,
        elements,
        (101..101 + count).collect(),
        vec![],
    );
    assert_eq!(mesh.pieces(), [[0; 6], [1; 6]].concat());
    let error = mesh
        .check(&hold(&mesh, &one.group("fixed").unwrap().nodes))
        .unwrap_err();
    let Error::LoosePiece {
        tag,
        elements,
        motions,
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!((*tag, *elements), (107, 6));
    assert_eq!(motions.split(", ").count(), 6, "{motions}");
}

/// Each set of supports leaves exactly the motions that a drawing shows.
#[test]
fn free_motions_are_named() {
    let mesh = cube(Order::Linear, 1, |x| [x[0], 2.0 * x[1], x[2]]);
    let motions = |holds: &dyn Fn([f64; 3]) -> [bool; 3]| {
        let mut supports = Supports::new(mesh.n_nodes());
        for (node, x) in (0..).zip(&mesh.nodes) {
            supports.fix_node(node, holds(*x));
        }
        match mesh.check(&supports) {
            Ok(_) => String::new(),
            Err(Error::FreeRigidMotion { motions }) => motions,
            Err(other) => panic!("{other}"),
        }
    };
    assert_eq!(motions(&|_| [true, true, false]), "shift along z");
    assert_eq!(
        motions(&|x| [x[0] == 0.0 && x[1] == 0.0; 3])
            .matches("turn about z")
            .count(),
        1
    );
    assert_eq!(motions(&|x| [x[2] == 0.0; 3]), "");
    let rollers = motions(&|x| [x[0] == 0.0, x[1] == 0.0, false]);
    assert_eq!(rollers, "shift along z");
}

#[test]
fn a_node_of_no_element_warns_and_is_held() {
    let one = cube(Order::Linear, 1, |x| x);
    let mut nodes = one.nodes.clone();
    nodes.insert(0, [9.0; 3]);
    let elements = one.elements.iter().map(|n| n + 1).collect();
    let tags = (500..500 + nodes.len() as u64).collect();
    let mesh = Mesh::new(
        Order::Linear,
        nodes,
        tags,
        elements,
        one.element_tags.clone(),
        vec![],
    );
    let base: Vec<u32> = one
        .group("fixed")
        .unwrap()
        .nodes
        .iter()
        .map(|n| n + 1)
        .collect();
    let supports = hold(&mesh, &base);
    let warnings = mesh.check(&supports).unwrap();
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("1 node") && warnings[0].contains("node 500"),
        "{warnings:?}"
    );
    let stiffness = crate::common::assemble(&mesh, crate::common::steel(), fem::Quadrature::Fast);
    let factor = fem::FactoredStiffness::new(&stiffness, &supports, &fem::Silent).unwrap();
    assert_eq!(factor.solve(&vec![1.0; factor.n_dofs()])[..3], [0.0; 3]);
}

#[test]
fn an_element_that_is_there_twice_warns() {
    let mut mesh = cube(Order::Quadratic, 2, bend);
    let inner = mesh.element_nodes(20).to_vec();
    mesh.elements.extend(inner);
    mesh.element_tags.push(999);
    let warnings = check(&mesh).unwrap();
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("more than two elements"),
        "{warnings:?}"
    );
}

/// Divergence theorem: the flux of x through a closed surface with outward normals is 3 V. The
/// load of a pressure of -1 Pa is the integral of N n, so Σ x · f is that flux (x is in the space).
#[test]
fn boundary_faces_are_closed_and_point_outward() {
    let cubes = ORDERS.map(|order| (cube(order, 2, |x| x), 1.0, 1e-13));
    // A quarter of a ring of radii 1 and 2: 3π/4; the elements follow the arcs to this much.
    let rings = [
        (read("ring-tet10.msh"), 0.75 * std::f64::consts::PI, 5e-3),
        (read("ring-tet20.msh"), 0.75 * std::f64::consts::PI, 5e-4),
    ];
    for (mesh, volume, tolerance) in cubes.into_iter().chain(rings) {
        let faces = mesh.boundary_faces();
        let mut edges = std::collections::HashMap::new();
        for face in &faces {
            assert_eq!(face.nodes.len(), mesh.order.nodes_per_face());
            for k in 0..3 {
                *edges
                    .entry((face.nodes[k], face.nodes[(k + 1) % 3]))
                    .or_insert(0) += 1;
            }
        }
        // Each edge once in each direction: closed, and turned the same way all over.
        assert!(
            edges
                .iter()
                .all(|(&(a, b), &n)| n == 1 && edges.contains_key(&(b, a)))
        );
        let flux: f64 = faces
            .iter()
            .map(|face| {
                // By the vertices alone, which tells the sign of each face.
                let [a, b, c] = [0, 1, 2].map(|k| mesh.nodes[face.nodes[k] as usize]);
                let cross = |u: [f64; 3], v: [f64; 3]| -> [f64; 3] {
                    std::array::from_fn(|i| {
                        u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]
                    })
                };
                let n = cross(
                    std::array::from_fn(|i| b[i] - a[i]),
                    std::array::from_fn(|i| c[i] - a[i]),
                );
                (0..3)
                    .map(|i| n[i] * (a[i] + b[i] + c[i]) / 6.0)
                    .sum::<f64>()
            })
            .sum();
        assert!(flux > 0.0);
        let force = fem::load::pressure(&mesh, mesh.group("surface").unwrap(), -1.0).unwrap();
        let exact: f64 = mesh
            .nodes
            .iter()
            .flatten()
            .zip(&force)
            .map(|(x, f)| x * f)
            .sum();
        assert!(
            (exact / (3.0 * volume) - 1.0).abs() < tolerance,
            "{exact} {volume}"
        );
    }
}

/// Both nodes of one edge moved towards each other by s: on that edge det J is 1 + 13.5 s
/// (1 - 6 t + 6 t²), lowest at its middle, 1 - 6.75 s, while at the nodes it is no less than
/// 1 - 4.5 s. Zero at s = 4/27 = 0.1481.
#[test]
fn a_fold_of_a_cubic_element_that_samples_miss_is_found() {
    let squeezed = |s: f64| {
        let mut mesh = single(Order::Cubic);
        mesh.nodes[4][0] += s;
        mesh.nodes[5][0] -= s;
        mesh
    };
    let folded = squeezed(0.152);
    assert!(determinant(&folded, 0, [0.5, 0.5, 0.0, 0.0]) < -0.02);
    let samples = Order::Cubic.node_coordinates().into_iter().chain(
        fem::quadrature::tetrahedron(9)
            .into_iter()
            .map(|p| p.coordinates),
    );
    for l in samples {
        assert!(determinant(&folded, 0, l) > 0.05, "{l:?} sees the fold");
    }
    assert!(folded.smallest_jacobian(0) < -0.02);
    assert!(matches!(
        check(&folded),
        Err(Error::Inverted { tag: 7, .. })
    ));
    for s in [-0.05, 0.05, 0.1, 0.14] {
        let bound = squeezed(s).smallest_jacobian(0);
        assert!(bound > 0.0, "valid at {s}, bound {bound}");
        assert!(check(&squeezed(s)).is_ok());
    }
    // By the formula of the edge: the proof holds to 1e-4 before the limit, and none after it.
    let limit = 4.0 / 27.0;
    assert!(squeezed(limit - 1e-4).smallest_jacobian(0) > 0.0);
    assert!(squeezed(limit + 1e-4).smallest_jacobian(0) < 0.0);
}

/// Random bends of tet10 and tet20: the bound is below every value, and so close that an element
/// with a good margin is never refused.
#[test]
fn the_bound_is_below_all_values_and_near_the_smallest() {
    let mut state = 12345u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let (mut valid, mut folded) = (0, 0);
    for order in [Order::Quadratic, Order::Cubic] {
        for round in 0..200 {
            let mut mesh = single(order);
            let size = f64::from(round) / 200.0;
            for x in &mut mesh.nodes {
                *x = x.map(|c| c + size * random() / f64::from(order as u8));
            }
            let n = 16;
            let mut lowest = f64::INFINITY;
            for i in 0..=n {
                for j in 0..=n - i {
                    for k in 0..=n - i - j {
                        let l = [i, j, k, n - i - j - k].map(|v| f64::from(v) / f64::from(n));
                        lowest = lowest.min(determinant(&mesh, 0, l));
                    }
                }
            }
            let bound = mesh.smallest_jacobian(0);
            assert!(bound <= lowest + 1e-8, "{order} {round}: {bound} {lowest}");
            // 1 for the straight element.
            if lowest > 0.005 {
                valid += 1;
                assert!(bound > 0.0, "{order} {round}: {bound} {lowest}");
            }
            if bound <= 0.0 && lowest < 0.0 {
                folded += 1;
            }
        }
    }
    assert!(valid > 100 && folded > 50, "{valid} {folded}");
}

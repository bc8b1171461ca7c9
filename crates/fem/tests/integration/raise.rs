//! The same body at another order and with smaller elements: shape, groups, fields, refusals.

use std::collections::{BTreeMap, BTreeSet};

use fem::{Error, FactoredStiffness, Group, Mesh, Order, Quadrature, Silent};

use crate::common::{
    ORDERS, assemble, bend, cube, hold, interpolate, largest, largest_difference, place, read,
    steel,
};

fn area(mesh: &Mesh, name: &str) -> f64 {
    // The integral of |dA| is the largest total that a traction spreads: by the faces of a plane
    // or curved group with a polynomial area element, exactly; else to the rule's 1e-9.
    let shape = |order: Order, l: [f64; 3]| -> Vec<[f64; 2]> {
        // Derivatives of the triangle's functions by central differences of the tetrahedron's,
        // whose face 0 is the triangle: an independent way to the tangents.
        let h = 1e-5;
        let local = order.face_nodes(0);
        let at = |l: [f64; 3]| {
            let mut full = [0.0; 4];
            for (v, x) in fem::element::FACE_VERTICES[0].into_iter().zip(l) {
                full[v] = x;
            }
            let (mut n, mut d) = ([0.0; 20], [[0.0; 4]; 20]);
            order.shape(full, &mut n, &mut d);
            local.iter().map(|&i| n[i]).collect::<Vec<f64>>()
        };
        let along = |k: usize| {
            let (mut up, mut down) = (l, l);
            (up[k], up[0], down[k], down[0]) = (l[k] + h, l[0] - h, l[k] - h, l[0] + h);
            let (up, down) = (at(up), at(down));
            up.into_iter()
                .zip(down)
                .map(|(a, b)| (a - b) / (2.0 * h))
                .collect::<Vec<f64>>()
        };
        along(1)
            .into_iter()
            .zip(along(2))
            .map(|(a, b)| [a, b])
            .collect()
    };
    let rule = fem::quadrature::triangle(24);
    let shapes: Vec<(f64, Vec<[f64; 2]>)> = rule
        .iter()
        .map(|p| (p.weight, shape(mesh.order, p.coordinates)))
        .collect();
    let mut sum = 0.0;
    for face in &mesh.group(name).unwrap().faces {
        for (weight, d) in &shapes {
            let tangent = |k: usize| -> [f64; 3] {
                std::array::from_fn(|c| {
                    face.nodes
                        .iter()
                        .zip(d)
                        .map(|(&n, d)| d[k] * mesh.nodes[n as usize][c])
                        .sum()
                })
            };
            let (a, b) = (tangent(0), tangent(1));
            let normal: [f64; 3] = std::array::from_fn(|i| {
                a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]
            });
            sum += 0.5 * weight * normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        }
    }
    sum
}

/// Coordinates to 1e-9, as a set.
fn coordinates(mesh: &Mesh, nodes: impl IntoIterator<Item = u32>) -> BTreeSet<[i64; 3]> {
    nodes
        .into_iter()
        .map(|n| mesh.nodes[n as usize].map(|c| (c * 1e9).round() as i64))
        .collect()
}

fn all_coordinates(mesh: &Mesh) -> BTreeSet<[i64; 3]> {
    coordinates(mesh, 0..mesh.n_nodes() as u32)
}

/// Each node is on one place only, and every node belongs to an element.
fn assert_no_node_twice(mesh: &Mesh) {
    assert_eq!(all_coordinates(mesh).len(), mesh.n_nodes());
    let used: BTreeSet<u32> = mesh.elements.iter().copied().collect();
    assert_eq!(used.len(), mesh.n_nodes());
    let tags: BTreeSet<u64> = mesh.node_tags.iter().copied().collect();
    assert_eq!(tags.len(), mesh.n_nodes());
}

/// The mesh as Gmsh would number it if it had no mid nodes: what a way to a higher order and back
/// must give again.
fn assert_same(a: &Mesh, b: &Mesh) {
    assert_eq!(a.elements, b.elements);
    assert_eq!(a.element_tags, b.element_tags);
    assert_eq!(a.node_tags, b.node_tags);
    assert_eq!(a.groups, b.groups);
    for (x, y) in a.nodes.iter().zip(&b.nodes) {
        assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-15), "{x:?} {y:?}");
    }
}

#[test]
fn the_present_order_gives_a_copy() {
    for order in ORDERS {
        let mesh = cube(order, 2, bend);
        assert_eq!(mesh.with_order(order).unwrap(), mesh);
    }
}

#[test]
fn raising_and_lowering_again_gives_the_same_mesh() {
    let linear = cube(Order::Linear, 3, bend);
    for order in [Order::Quadratic, Order::Cubic] {
        let back = linear.with_order(order).unwrap().with_order(Order::Linear);
        assert_same(&back.unwrap(), &linear);
    }
    // The vertices are kept bit by bit, mid nodes come back to round-off, in the same places.
    for mesh in [cube(Order::Quadratic, 3, bend), read("ring-tet10.msh")] {
        let back = mesh
            .with_order(Order::Cubic)
            .unwrap()
            .with_order(Order::Quadratic)
            .unwrap();
        assert_eq!(back.n_nodes(), mesh.n_nodes());
        assert_eq!(back.element_tags, mesh.element_tags);
        for e in 0..mesh.n_elements() {
            let (old, new) = (mesh.element_nodes(e), back.element_nodes(e));
            for (k, (&i, &j)) in old.iter().zip(new).enumerate() {
                let (x, y) = (mesh.nodes[i as usize], back.nodes[j as usize]);
                assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-14), "{x:?} {y:?}");
                if k < 4 {
                    assert_eq!(x, y);
                    assert_eq!(mesh.node_tags[i as usize], back.node_tags[j as usize]);
                }
            }
        }
        for (a, b) in mesh.groups.iter().zip(&back.groups) {
            assert_eq!(
                (&a.name, a.dimension, &a.elements),
                (&b.name, b.dimension, &b.elements)
            );
            assert_eq!(a.faces.len(), b.faces.len());
            for (f, g) in a.faces.iter().zip(&b.faces) {
                for (&i, &j) in f.nodes.iter().zip(&g.nodes) {
                    let (x, y) = (mesh.nodes[i as usize], back.nodes[j as usize]);
                    assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-14));
                }
            }
            assert_eq!(
                coordinates(&mesh, a.nodes.iter().copied()),
                coordinates(&back, b.nodes.iter().copied())
            );
        }
    }
}

/// A straight mesh raised is the mesh that the generator makes at that order, node for node and
/// face for face, in other numbers.
#[test]
fn a_straight_mesh_raised_is_the_one_made_at_that_order() {
    for from in ORDERS {
        for to in ORDERS {
            let made = cube(to, 3, |x| x);
            let raised = cube(from, 3, |x| x).with_order(to).unwrap();
            assert_no_node_twice(&raised);
            assert_eq!(all_coordinates(&raised), all_coordinates(&made));
            for e in 0..made.n_elements() {
                for (&i, &j) in raised.element_nodes(e).iter().zip(made.element_nodes(e)) {
                    let (x, y) = (raised.nodes[i as usize], made.nodes[j as usize]);
                    assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-14), "{from} {to}");
                }
            }
            for (a, b) in raised.groups.iter().zip(&made.groups) {
                assert_eq!(a.name, b.name);
                assert_eq!(
                    coordinates(&raised, a.nodes.iter().copied()),
                    coordinates(&made, b.nodes.iter().copied())
                );
                for (f, g) in a.faces.iter().zip(&b.faces) {
                    for (&i, &j) in f.nodes.iter().zip(&g.nodes) {
                        let (x, y) = (raised.nodes[i as usize], made.nodes[j as usize]);
                        assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-14), "{from} {to}");
                    }
                }
            }
        }
    }
}

/// Vertices first, in their sequence and with their tags; new tags above all old ones.
#[test]
fn vertices_keep_their_sequence_and_tags() {
    let mut mesh = cube(Order::Quadratic, 2, bend);
    for (tag, i) in mesh.node_tags.iter_mut().zip(0..) {
        *tag = 1000 - 3 * i;
    }
    let mesh = Mesh::new(
        mesh.order,
        mesh.nodes,
        mesh.node_tags,
        mesh.elements,
        mesh.element_tags,
        mesh.groups,
    );
    for order in [Order::Linear, Order::Cubic] {
        let other = mesh.with_order(order).unwrap();
        let vertices: BTreeSet<u32> = (0..mesh.n_elements())
            .flat_map(|e| mesh.element_nodes(e)[..4].to_vec())
            .collect();
        assert_eq!(vertices.len(), 27);
        for (new, &old) in vertices.iter().enumerate() {
            assert_eq!(other.node_tags[new], mesh.node_tags[old as usize]);
            assert_eq!(other.nodes[new], mesh.nodes[old as usize]);
            let tag = mesh.node_tags[old as usize];
            assert_eq!(other.node_of_tag(tag), Some(new as u32));
        }
        let expected: Vec<u64> = (1001..).take(other.n_nodes() - 27).collect();
        assert_eq!(other.node_tags[27..], expected);
    }
    let finer = mesh.refined().unwrap();
    assert_eq!(finer.node_tags[..mesh.n_nodes()], mesh.node_tags);
    assert_eq!(finer.nodes[..mesh.n_nodes()], mesh.nodes);
    assert_eq!(finer.node_tags[mesh.n_nodes()], 1001);
}

/// Curved meshes: volume and area to round-off (the areas' tangents are central differences).
#[test]
fn raising_and_refining_keep_the_shape() {
    let check = |name: &str, before: &Mesh, after: &Mesh| {
        assert_no_node_twice(after);
        let (v, w) = (before.volume(), after.volume());
        assert!((v / w - 1.0).abs() < 1e-13, "{name}: volume {v} {w}");
        for group in before.groups.iter().filter(|g| g.dimension == 2) {
            let (a, b) = (area(before, &group.name), area(after, &group.name));
            assert!((a / b - 1.0).abs() < 1e-9, "{name} {}: {a} {b}", group.name);
        }
        assert_eq!(
            before.groups.iter().map(|g| &g.name).collect::<Vec<_>>(),
            after.groups.iter().map(|g| &g.name).collect::<Vec<_>>()
        );
        let surface = after.surface_nodes();
        if let Some(group) = after.group("surface") {
            assert_eq!(group.nodes, surface);
        }
    };
    let curved = [
        cube(Order::Linear, 2, bend),
        cube(Order::Quadratic, 2, bend),
        cube(Order::Cubic, 2, bend),
        read("ring-tet10.msh"),
        read("ring-tet20.msh"),
    ];
    for mesh in &curved {
        for order in ORDERS.into_iter().filter(|o| *o > mesh.order) {
            check("raised", mesh, &mesh.with_order(order).unwrap());
        }
        let finer = mesh.refined().unwrap();
        check("refined", mesh, &finer);
        assert_eq!(finer.n_elements(), 8 * mesh.n_elements());
        assert_eq!(finer.element_tags[..3], [1, 2, 3]);
        for e in 0..mesh.n_elements() {
            let parts: f64 = (8 * e..8 * e + 8).map(|c| finer.element_volume(c)).sum();
            assert!((parts / mesh.element_volume(e) - 1.0).abs() < 1e-12);
        }
    }
}

/// The number of nodes of the refined cube is that of the cube with twice as many cells, and each
/// edge is where it should be: Euler's formula leaves no room for a node too many.
#[test]
fn refining_makes_each_shared_node_once() {
    for order in ORDERS {
        let finer = cube(order, 1, bend).refined().unwrap();
        let p = order as usize;
        assert_eq!(finer.n_nodes(), (2 * p + 1).pow(3));
        let twice = finer.refined().unwrap();
        assert_eq!(twice.n_nodes(), (4 * p + 1).pow(3));
        assert_eq!(
            twice.check(&hold(&twice, &twice.surface_nodes())),
            Ok(vec![])
        );
        // Closed: the boundary is the refined group, each face once.
        let key = |nodes: &[u32]| nodes[..3].iter().copied().collect::<BTreeSet<u32>>();
        let boundary: BTreeSet<_> = twice
            .boundary_faces()
            .iter()
            .map(|f| key(&f.nodes))
            .collect();
        let group = twice.group("surface").unwrap();
        assert_eq!(group.faces.len(), 12 * 16);
        assert_eq!(
            group
                .faces
                .iter()
                .map(|f| key(&f.nodes))
                .collect::<BTreeSet<_>>(),
            boundary
        );
    }
}

/// The group's faces keep their sense of turning and their places: pressure on them is the same.
#[test]
fn a_load_on_a_group_is_the_same_on_the_raised_and_refined_mesh() {
    let moments = |mesh: &Mesh| -> Vec<f64> {
        // Force, and its moments with the coordinates, which are in the space of every order.
        let f = fem::load::pressure(mesh, mesh.group("load").unwrap(), 3.0).unwrap();
        let mut sums = vec![0.0; 12];
        for (x, f) in mesh.nodes.iter().zip(f.chunks_exact(3)) {
            for c in 0..3 {
                sums[c] += f[c];
                for k in 0..3 {
                    sums[3 + 3 * c + k] += f[c] * x[k];
                }
            }
        }
        sums
    };
    for order in ORDERS {
        let mesh = cube(order, 2, bend);
        let mut others = vec![mesh.refined().unwrap()];
        others.extend(
            ORDERS
                .into_iter()
                .filter(|o| *o > order)
                .map(|o| mesh.with_order(o).unwrap()),
        );
        for other in others {
            assert!(largest_difference(&moments(&mesh), &moments(&other)) < 1e-13);
            for group in &other.groups {
                let old = mesh.group(&group.name).unwrap();
                let per_face = group.faces.len() / old.faces.len();
                for (i, face) in group.faces.iter().enumerate() {
                    let normal = |m: &Mesh, f: &fem::Face| -> [f64; 3] {
                        let [a, b, c] = [0, 1, 2].map(|k| m.nodes[f.nodes[k] as usize]);
                        std::array::from_fn(|i| {
                            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                            (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j])
                        })
                    };
                    let parent = normal(&mesh, &old.faces[i / per_face]);
                    let dot: f64 = normal(&other, face)
                        .iter()
                        .zip(parent)
                        .map(|(a, b)| a * b)
                        .sum();
                    assert!(dot > 0.0, "a face of {} is turned", group.name);
                }
            }
        }
    }
}

/// Groups on faces inside the body, of elements, and of nodes alone.
#[test]
fn groups_inside_the_body_are_carried_over() {
    for order in ORDERS {
        let mut mesh = cube(order, 2, |x| x);
        let is_middle = |x: [f64; 3]| (x[0] - 0.5).abs() < 1e-9;
        let mut seen = BTreeSet::new();
        let mut faces = Vec::new();
        for e in 0..mesh.n_elements() {
            for f in 0..4 {
                let local = order.face_nodes(f);
                let nodes: Vec<u32> = local.iter().map(|&i| mesh.element_nodes(e)[i]).collect();
                let sorted: BTreeSet<u32> = nodes.iter().copied().collect();
                // The inner vertex is displaced, so four of the faces in the middle are flat.
                if nodes.iter().all(|&n| is_middle(mesh.nodes[n as usize])) && seen.insert(sorted) {
                    faces.push(fem::Face { nodes });
                }
            }
        }
        assert!(!faces.is_empty());
        let unique = |lists: &mut dyn Iterator<Item = u32>| -> Vec<u32> {
            lists.collect::<BTreeSet<_>>().into_iter().collect()
        };
        let mut group = |name: &str, nodes: Vec<u32>, faces: Vec<fem::Face>, elements: Vec<u32>| {
            mesh.groups.push(Group {
                name: name.to_owned(),
                dimension: if elements.is_empty() { 2 } else { 3 },
                nodes,
                faces,
                elements,
            });
        };
        let of_faces = unique(&mut faces.iter().flat_map(|f| f.nodes.clone()));
        group("middle", of_faces, faces, vec![]);
        let elements = vec![3, 7, 20];
        let of_elements: BTreeSet<u32> = elements
            .iter()
            .flat_map(|&e| {
                let n = order.nodes_per_element();
                cube(order, 2, |x| x).elements[e as usize * n..][..n].to_vec()
            })
            .collect();
        group("some", of_elements.into_iter().collect(), vec![], elements);
        // The first element's first vertex and last node.
        let n = order.nodes_per_element();
        let mut ends = vec![mesh.elements[0], mesh.elements[n - 1]];
        ends.sort_unstable();
        mesh.groups.push(Group {
            name: "points".to_owned(),
            dimension: 2,
            nodes: ends,
            faces: vec![],
            elements: vec![],
        });
        let volume_of = |m: &Mesh| -> f64 {
            let elements = &m.group("some").unwrap().elements;
            elements.iter().map(|&e| m.element_volume(e as usize)).sum()
        };
        let mut others = vec![(mesh.refined().unwrap(), 2)];
        for to in ORDERS {
            others.push((
                mesh.with_order(to).unwrap(),
                if to == order || order == Order::Linear {
                    2
                } else {
                    1
                },
            ));
        }
        for (other, points) in others {
            assert!((area(&other, "middle") / area(&mesh, "middle") - 1.0).abs() < 1e-9);
            let middle = other.group("middle").unwrap();
            assert!(
                middle
                    .nodes
                    .iter()
                    .all(|&n| is_middle(other.nodes[n as usize]))
            );
            assert!((volume_of(&other) / volume_of(&mesh) - 1.0).abs() < 1e-12);
            let some = other.group("some").unwrap();
            assert_eq!(some.dimension, 3);
            let expected = unique(
                &mut some
                    .elements
                    .iter()
                    .flat_map(|&e| other.element_nodes(e as usize).to_vec()),
            );
            assert_eq!(some.nodes, expected);
            let kept = &other.group("points").unwrap().nodes;
            assert_eq!(kept.len(), points, "order {order} to {}", other.order);
            for &n in kept {
                let tag = other.node_tags[n as usize];
                assert!(mesh.node_of_tag(tag).is_some());
            }
        }
    }
}

/// Degree p interpolated on order p is the same field after raising and after refining, at every
/// new node and between them.
#[test]
fn fields_of_the_space_stay_what_they_are() {
    let field =
        |degree: i32| move |x: [f64; 3]| x.map(|c| (0.4 * c + 0.3 * x[0] - x[1]).powi(degree));
    for order in ORDERS {
        let straight = cube(order, 2, |x| x);
        let exact = field(order as i32);
        for to in ORDERS.into_iter().filter(|o| *o >= order) {
            let mesh = straight.with_order(to).unwrap().refined().unwrap();
            let u = interpolate(&mesh, exact);
            assert!(fem::stress::l2_error(&mesh, &u, exact, 8) < 1e-14);
        }
        // Linear on a curved mesh.
        let mesh = cube(order, 2, bend).refined().unwrap();
        let u = interpolate(&mesh, field(1));
        assert!(fem::stress::l2_error(&mesh, &u, field(1), 8) < 1e-14);
    }
}

/// Points of a parent are points of one of its children, at any place of curved elements.
#[test]
fn children_cover_their_parent_and_nothing_else() {
    for mesh in [read("ring-tet10.msh"), read("ring-tet20.msh")] {
        let finer = mesh.refined().unwrap();
        for e in [0, mesh.n_elements() / 2, mesh.n_elements() - 1] {
            for l in [[0.25; 4], [0.6, 0.2, 0.1, 0.1], [0.3, 0.35, 0.15, 0.2]] {
                let (found, _) = fem::stress::locate(&finer, place(&mesh, e, l)).unwrap();
                assert_eq!(found / 8, e);
            }
        }
    }
}

/// The patch test on a refined curved mesh, and the solution of a straight one held by both
/// meshes: a quadratic field given on the boundary comes out inside.
#[test]
fn the_patch_test_holds_on_raised_and_refined_meshes() {
    let linear = |[x, y, z]: [f64; 3]| [0.2 + x - 0.5 * z, 0.3 * y - x, z + 0.25 * y];
    let quadratic = |[x, y, z]: [f64; 3]| [x * x - y * y, -2.0 * x * y + z, y];
    let error = |mesh: &Mesh, field: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let supports = hold(mesh, &mesh.surface_nodes());
        let stiffness = assemble(mesh, steel(), Quadrature::Converged);
        let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
        assert!(factor.n_free() > 0);
        let exact = interpolate(mesh, field);
        let u = factor.solve_prescribed(&stiffness, &vec![0.0; exact.len()], &exact);
        largest_difference(&u, &exact) / largest(&exact)
    };
    for order in ORDERS {
        let mesh = cube(order, 1, bend).refined().unwrap();
        assert!(error(&mesh, &linear) < 1e-13, "order {order}");
    }
    let raised = cube(Order::Linear, 2, |x| x).with_order(Order::Quadratic);
    assert!(error(&raised.unwrap(), &quadratic) < 1e-13);
    let curved = cube(Order::Quadratic, 2, bend).with_order(Order::Cubic);
    assert!(error(&curved.unwrap(), &linear) < 1e-13);
}

/// A valid tet10 whose vertices alone span an inverted tetrahedron: a thin strip along the curve
/// c(t) = (t², t - 1.05 t²), which climbs, turns over and ends below its start. Across it lies
/// 0.1 r normal to c'(t), so det J = 0.1 (|c'|² - 0.2 r), with |c'|² at least 0.47.
///
/// ```text
///   z    .-- --.
///   |   /       \
///   |  |         |
///   +--|---------3-- x      vertex 3 at z = -0.05, below the base 012
/// ```
fn bent_over() -> Mesh {
    let nodes: Vec<[f64; 3]> = Order::Quadratic
        .node_coordinates()
        .iter()
        .map(|l| {
            let (r, y, t) = (0.1 * l[1], l[2], l[3]);
            [
                t * t + r * (1.0 - 2.1 * t),
                y,
                t - 1.05 * t * t - 2.0 * r * t,
            ]
        })
        .collect();
    Mesh::new(
        Order::Quadratic,
        nodes,
        (1..=10).collect(),
        (0..10).collect(),
        vec![12],
        vec![],
    )
}

#[test]
fn an_element_that_turns_over_at_the_order_is_named_with_the_mend() {
    let mesh = bent_over();
    assert!(mesh.smallest_jacobian(0) > 0.0);
    assert!(mesh.with_order(Order::Cubic).is_ok());
    assert!(mesh.refined().is_ok());
    let error = mesh.with_order(Order::Linear).unwrap_err();
    let Error::OrderInvalid {
        tag,
        order,
        from,
        jacobian,
        ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!((tag, order, from), (12, 1, 2));
    // Base 0.1 times 1, height -0.05.
    assert!((jacobian + 0.005).abs() < 1e-15, "{jacobian}");
    assert_eq!(
        error.to_string(),
        "element 12 becomes inverted or flat at order 1 (smallest Jacobian -5.000e-3 m³); \
         ask for order = 2, or make the mesh anew with `gmsh -order 1 -optimize_ho`, \
         finer where it curves"
    );
}

#[test]
fn an_element_that_was_inverted_is_not_blamed_on_the_order() {
    for order in ORDERS {
        let mut mesh = cube(order, 1, |x| x);
        mesh.element_tags[4] = 99;
        mesh.elements.swap(
            4 * order.nodes_per_element(),
            4 * order.nodes_per_element() + 1,
        );
        for to in ORDERS.into_iter().filter(|o| *o != order) {
            let error = mesh.with_order(to).unwrap_err();
            assert!(matches!(error, Error::Inverted { tag: 99, .. }), "{error}");
        }
        let error = mesh.refined().unwrap_err();
        assert!(matches!(error, Error::Inverted { tag: 99, .. }), "{error}");
    }
}

#[test]
fn a_face_of_no_element_is_named() {
    let mut mesh = cube(Order::Linear, 2, |x| x);
    // Three corners of the cube, which no element joins.
    let corner = |x: [f64; 3]| mesh.nodes.iter().position(|n| *n == x).unwrap() as u32;
    let nodes = vec![
        corner([0.0; 3]),
        corner([1.0, 0.0, 0.0]),
        corner([0.0, 1.0, 0.0]),
    ];
    let tags = [0, 1, 2].map(|k| mesh.node_tags[nodes[k] as usize]);
    mesh.groups[1].faces.push(fem::Face { nodes });
    let expected = Error::FaceOfNoElement {
        group: "load".to_owned(),
        tags,
    };
    assert_eq!(mesh.with_order(Order::Quadratic), Err(expected.clone()));
    assert_eq!(mesh.refined(), Err(expected.clone()));
    assert!(
        expected
            .to_string()
            .starts_with("group \"load\": the face with the corner nodes")
    );
}

#[test]
fn nodes_of_no_element_are_left_out() {
    let whole = cube(Order::Quadratic, 1, |x| x);
    let mut nodes = whole.nodes.clone();
    nodes.push([9.0; 3]);
    let mut tags = whole.node_tags.clone();
    tags.push(700);
    let mesh = Mesh::new(
        whole.order,
        nodes,
        tags,
        whole.elements.clone(),
        whole.element_tags.clone(),
        vec![Group {
            name: "loose".to_owned(),
            dimension: 2,
            nodes: vec![whole.n_nodes() as u32],
            faces: vec![],
            elements: vec![],
        }],
    );
    for other in [mesh.with_order(Order::Linear), mesh.refined()] {
        let other = other.unwrap();
        assert_no_node_twice(&other);
        assert_eq!(other.node_of_tag(700), None);
        assert!(other.groups[0].nodes.is_empty());
    }
}

/// The same bits again: nothing hangs on the sequence of a hash map.
#[test]
fn raising_and_refining_are_repeatable() {
    let mesh = read("ring-tet10.msh");
    assert_eq!(mesh.with_order(Order::Cubic), mesh.with_order(Order::Cubic));
    assert_eq!(mesh.refined(), mesh.refined());
}

/// The four inner children share the shortest diagonal, and a shift of the mesh (other round-off,
/// many ties) cuts alike.
#[test]
fn the_octahedron_is_cut_along_its_shortest_diagonal() {
    let map = |x: [f64; 3]| [x[0] + 0.4 * x[1], x[1] + 0.3 * x[2], 2.0 * x[2]];
    let mesh = cube(Order::Linear, 2, map);
    let finer = mesh.refined().unwrap();
    let square = |a: [f64; 3], b: [f64; 3]| -> f64 { (0..3).map(|c| (a[c] - b[c]).powi(2)).sum() };
    let mut chosen = BTreeMap::new();
    for e in 0..mesh.n_elements() {
        let middle = |a: usize, b: usize| {
            let mut l = [0.0; 4];
            (l[a], l[b]) = (0.5, 0.5);
            place(&mesh, e, l)
        };
        let squares = [
            square(middle(0, 1), middle(2, 3)),
            square(middle(0, 2), middle(1, 3)),
            square(middle(0, 3), middle(1, 2)),
        ];
        let shortest = squares.into_iter().fold(f64::INFINITY, f64::min);
        let at = squares.iter().position(|s| *s == shortest).unwrap();
        *chosen.entry(at).or_insert(0) += 1;
        let inner: Vec<&[u32]> = (8 * e + 4..8 * e + 8)
            .map(|c| finer.element_nodes(c))
            .collect();
        let shared: Vec<u32> = (inner[0].iter().copied())
            .filter(|n| inner.iter().all(|child| child.contains(n)))
            .collect();
        assert_eq!(shared.len(), 2);
        let [a, b] = [0, 1].map(|k| finer.nodes[shared[k] as usize]);
        assert!((square(a, b) / shortest - 1.0).abs() < 1e-8);
    }
    assert!(
        chosen.len() > 1,
        "one diagonal is always the shortest: {chosen:?}"
    );
    let regular = cube(Order::Linear, 2, |x| x).refined().unwrap();
    let shifted = cube(Order::Linear, 2, |x| x.map(|c| c + 0.7));
    assert_eq!(regular.elements, shifted.refined().unwrap().elements);
}

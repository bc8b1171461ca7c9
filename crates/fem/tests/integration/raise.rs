//! The same body at another order and with smaller elements: shape, groups, fields.

use std::collections::BTreeSet;

use fem::{FactoredStiffness, Group, Mesh, Order, Quadrature, Silent};

use crate::common::{
    ORDERS, all_coordinates, area, assemble, assert_no_node_twice, bend, coordinates, cube, hold,
    interpolate, largest, largest_difference, read, steel,
};

/// Numbers, tags and groups alike, coordinates to round-off.
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

#[test]
fn new_tags_are_free_even_after_the_largest_number() {
    let mesh = cube(Order::Linear, 1, |x| x);
    let mut tags = mesh.node_tags.clone();
    tags[3] = u64::MAX;
    let mesh = Mesh::new(
        mesh.order,
        mesh.nodes,
        tags,
        mesh.elements,
        mesh.element_tags,
        vec![],
    );
    assert_no_node_twice(&mesh.with_order(Order::Cubic).unwrap());
    assert_no_node_twice(&mesh.refined().unwrap());
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
                lines: Vec::new(),
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
            lines: Vec::new(),
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

/// The same bits again: nothing hangs on the sequence of a hash map.
#[test]
fn raising_and_refining_are_repeatable() {
    let mesh = read("ring-tet10.msh");
    assert_eq!(mesh.with_order(Order::Cubic), mesh.with_order(Order::Cubic));
    assert_eq!(mesh.refined(), mesh.refined());
}

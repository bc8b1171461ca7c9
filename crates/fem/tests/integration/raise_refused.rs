//! What raising and refining refuse, and with which words.

use fem::{Error, Group, Mesh, Order};

use crate::common::{ORDERS, assert_no_node_twice, cube, mirror};

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
        mirror(&mut mesh, 4);
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
            lines: Vec::new(),
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

/// Two elements at an edge with a mid node for each of them: one node for the edge would glue them.
#[test]
fn neighbours_that_do_not_share_nodes_are_refused() {
    let mut mesh = cube(Order::Quadratic, 1, |x| x);
    // The diagonal of the cube is an edge of all six elements.
    let node = mesh.element_nodes(2)[..]
        .iter()
        .position(|&n| mesh.nodes[n as usize] == [0.5; 3])
        .unwrap();
    let mut nodes = mesh.nodes.clone();
    nodes.push([0.5; 3]);
    let mut tags = mesh.node_tags.clone();
    tags.push(500);
    mesh.elements[2 * 10 + node] = mesh.n_nodes() as u32;
    let torn = Mesh::new(
        mesh.order,
        nodes,
        tags,
        mesh.elements,
        mesh.element_tags,
        vec![],
    );
    let expected = Error::NotConforming { tag: 3, node: 500 };
    assert_eq!(torn.with_order(Order::Cubic), Err(expected.clone()));
    assert_eq!(torn.with_order(Order::Linear), Err(expected.clone()));
    assert_eq!(torn.refined(), Err(expected.clone()));
    assert!(
        expected
            .to_string()
            .contains("element 3 does not fit its neighbours: node 500")
    );
}

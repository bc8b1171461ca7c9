//! The mesh reader on files that Gmsh 4.15.2 wrote (tests/data/README.md), whole and damaged, and
//! what the mesh check finds.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use fem::mesh::gmsh;
use fem::{Error, Mesh, Order, Supports};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn read(name: &str) -> Mesh {
    gmsh::read(&data(name)).unwrap()
}

fn volume(mesh: &Mesh) -> f64 {
    (0..mesh.n_elements())
        .map(|e| mesh.smallest_jacobian(e) / 6.0)
        .sum()
}

#[test]
fn ascii_and_binary_files_give_the_same_mesh_of_every_order() {
    for (order, per_element) in [(1u8, 4), (2, 10), (3, 20)] {
        let ascii = read(&format!("box-order{order}-ascii.msh"));
        let binary = read(&format!("box-order{order}-binary.msh"));
        assert_eq!(ascii.order as u8, order);
        assert_eq!(ascii.elements.len(), per_element * ascii.n_elements());
        assert_eq!(ascii.elements, binary.elements);
        assert_eq!(ascii.groups, binary.groups);
        // ASCII rounds to 16 digits.
        for (a, b) in ascii
            .nodes
            .iter()
            .flatten()
            .zip(binary.nodes.iter().flatten())
        {
            assert!((a - b).abs() < 1e-15);
        }
        // Straight elements fill the box.
        assert!((volume(&ascii) - 2.0).abs() < 1e-12, "{}", volume(&ascii));
    }
}

/// The file's coordinates, not a manual, say which node is where.
#[test]
fn nodes_lie_where_the_element_says_they_are() {
    for order in 1..=3 {
        let mesh = read(&format!("box-order{order}-ascii.msh"));
        for e in 0..mesh.n_elements() {
            let nodes = mesh.element_nodes(e);
            for (&node, l) in nodes.iter().zip(mesh.order.node_coordinates()) {
                for c in 0..3 {
                    let expected: f64 = (0..4)
                        .map(|v| l[v] * mesh.nodes[nodes[v] as usize][c])
                        .sum();
                    assert!(
                        (mesh.nodes[node as usize][c] - expected).abs() < 1e-12,
                        "order {order}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_face_may_be_in_several_groups_and_names_may_have_spaces() {
    for order in 1..=3 {
        let mesh = read(&format!("box-order{order}-ascii.msh"));
        let left = mesh.group("left side").unwrap();
        assert!(!left.nodes.is_empty());
        assert!(
            left.nodes
                .iter()
                .all(|&n| mesh.nodes[n as usize][0].abs() < 1e-12)
        );
        let surface = mesh.group("surface").unwrap();
        assert!(left.faces.iter().all(|f| surface.faces.contains(f)));
        assert_eq!(surface.nodes, mesh.surface_nodes());
        assert_eq!(
            mesh.group("body").unwrap().elements.len(),
            mesh.n_elements()
        );
        assert!(mesh.group("lid").is_none());
    }
}

/// The divergence theorem: one third of the flux of x through the surface is the volume.
#[test]
fn boundary_faces_point_out_of_the_body() {
    for order in 1..=3 {
        let mesh = read(&format!("box-order{order}-ascii.msh"));
        let flux: f64 = mesh
            .boundary_faces()
            .iter()
            .map(|face| {
                let [a, b, c] = [0, 1, 2].map(|k| mesh.nodes[face.nodes[k] as usize]);
                let (u, v) = (
                    [0, 1, 2].map(|k| b[k] - a[k]),
                    [0, 1, 2].map(|k| c[k] - a[k]),
                );
                let n = [
                    u[1] * v[2] - u[2] * v[1],
                    u[2] * v[0] - u[0] * v[2],
                    u[0] * v[1] - u[1] * v[0],
                ];
                (0..3)
                    .map(|k| n[k] * (a[k] + b[k] + c[k]) / 6.0)
                    .sum::<f64>()
            })
            .sum();
        assert!((flux / 3.0 - 2.0).abs() < 1e-12, "{flux}");
    }
}

#[test]
fn other_versions_name_the_command_that_converts() {
    for version in ["2.2", "4"] {
        let name = if version == "4" {
            "box-version4.0.msh"
        } else {
            "box-version2.2.msh"
        };
        let error = gmsh::read(&data(name)).unwrap_err();
        assert!(
            matches!(&error, Error::Version { found, .. } if found == version),
            "{error}"
        );
        assert!(
            error.to_string().contains("gmsh") && error.to_string().contains("msh41"),
            "{error}"
        );
    }
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused() {
    for name in ["box-order2-ascii.msh", "box-order2-binary.msh"] {
        let bytes = std::fs::read(data(name)).unwrap();
        for len in (0..bytes.len() - 12).step_by(7) {
            let result = gmsh::read_bytes(&bytes[..len], Path::new(name));
            assert!(result.is_err(), "{name} cut to {len} bytes");
        }
    }
}

/// Seed 42; a flipped bit in a coordinate may go unseen, but nothing may panic or ask for all memory.
#[test]
fn flipped_bits_never_panic() {
    let mut state = 42u64;
    let mut random = |n: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for name in [
        "box-order1-ascii.msh",
        "box-order1-binary.msh",
        "box-order2-binary.msh",
    ] {
        let bytes = std::fs::read(data(name)).unwrap();
        for _ in 0..3000 {
            let mut bad = bytes.clone();
            for _ in 0..1 + random(3) {
                let at = random(bad.len());
                bad[at] ^= 1 << random(8);
            }
            if let Ok(mesh) = gmsh::read_bytes(&bad, Path::new(name)) {
                let _ = mesh.check(&Supports::new(mesh.n_nodes()));
            }
        }
    }
}

#[test]
fn damage_is_named_by_tag_or_line() {
    let text = std::fs::read_to_string(data("box-order1-ascii.msh")).unwrap();
    let refusal = |text: &str| {
        gmsh::read_bytes(text.as_bytes(), Path::new("box.msh"))
            .unwrap_err()
            .to_string()
    };
    assert!(refusal("").contains("empty"));
    let refused = refusal("solid cube\n");
    assert!(refused.contains("line 1"), "{refused}");
    // The first node's coordinates.
    let nodes = text.find("$Nodes").unwrap();
    let first = text[nodes..].lines().nth(4).unwrap();
    let broken = text.replacen(&format!("\n{first}\n"), "\nnan 0 0\n", 1);
    assert!(refusal(&broken).contains("node 1 "), "{}", refusal(&broken));
    let broken = text.replacen(&format!("\n{first}\n"), "\nzero 0 0\n", 1);
    assert!(
        refusal(&broken).contains("\"zero\" is no number"),
        "{}",
        refusal(&broken)
    );
    // The last element names a node that is not there.
    let last = text[..text.find("$EndElements").unwrap()]
        .lines()
        .last()
        .unwrap();
    let mut words: Vec<&str> = last.split_whitespace().collect();
    words[2] = "999999";
    let broken = text.replacen(last, &words.join(" "), 1);
    assert!(refusal(&broken).contains("999999"), "{}", refusal(&broken));
}

#[test]
fn an_element_turned_inside_out_is_named() {
    for order in 1..=3 {
        let mut mesh = read(&format!("box-order{order}-ascii.msh"));
        // Mirroring the body inverts every element.
        for x in &mut mesh.nodes {
            x[0] = -x[0];
        }
        let mut supports = Supports::new(mesh.n_nodes());
        (0..mesh.n_nodes() as u32).for_each(|n| supports.fix_node(n, [true; 3]));
        let error = mesh.check(&supports).unwrap_err();
        assert!(matches!(error, Error::Inverted { .. }), "{error}");
        assert!(error.to_string().contains("more are too"), "{error}");
    }
}

/// A mid node that is pulled far enough folds a curved element, though its vertices are in order.
#[test]
fn a_folded_curved_element_is_found_and_a_bent_one_is_not() {
    let nodes: Vec<[f64; 3]> = Order::Quadratic
        .node_coordinates()
        .into_iter()
        .map(|l| [l[1], l[2], l[3]])
        .collect();
    let with_mid_node_at = |x: f64| {
        let mut nodes = nodes.clone();
        // Node 4 lies in the middle of the edge from the origin along x.
        nodes[4][0] = x;
        let mesh = Mesh::new(
            Order::Quadratic,
            nodes,
            (1..=10).collect(),
            (0..10).collect(),
            vec![7],
            vec![],
        );
        mesh.smallest_jacobian(0)
    };
    assert!((with_mid_node_at(0.5) - 1.0).abs() < 1e-12);
    // A quadratic edge has dx/dr > 0 throughout while its mid node is within the middle half.
    assert!(with_mid_node_at(0.30) > 0.0);
    assert!(with_mid_node_at(0.70) > 0.0);
    assert!(with_mid_node_at(0.20) < 0.0);
    assert!(with_mid_node_at(0.80) < 0.0);
}

#[test]
fn missing_supports_are_named() {
    let mesh = read("box-order2-ascii.msh");
    let error = mesh
        .check(&Supports::new(mesh.n_nodes()))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("not held") && error.contains("turn about z"),
        "{error}"
    );
    let mut supports = Supports::new(mesh.n_nodes());
    for &node in &mesh.group("left side").unwrap().nodes {
        supports.fix_node(node, [true; 3]);
    }
    assert_eq!(mesh.check(&supports), Ok(vec![]));
}

//! The mesh reader on files that Gmsh 4.15.2 wrote (tests/data/README.md), whole and damaged.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use fem::mesh::gmsh;
use fem::{Error, Mesh};

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

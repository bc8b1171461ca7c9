//! The mesh reader on files that Gmsh 4.15.2 wrote (tests/data/README.md), whole and damaged.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use fem::element::Order;
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

/// What a group is, whatever the order of nodes and elements in the file.
fn places(mesh: &Mesh, nodes: &[u32]) -> Vec<[i64; 3]> {
    // 2.2 writes 16 digits.
    let place = |n: &u32| mesh.nodes[*n as usize].map(|x| (1e9 * x).round() as i64);
    let mut places: Vec<_> = nodes.iter().map(place).collect();
    places.sort_unstable();
    places
}

const VERSIONS: [&str; 5] = [
    "2.2-ascii",
    "2.2-binary",
    "4.0-ascii",
    "4.1-ascii",
    "4.1-binary",
];

#[test]
fn all_versions_whole_or_partitioned_hold_the_same_mesh() {
    let expected = read("groups-version4.1-ascii.msh");
    // As meshio 5.3.5 counts.
    assert_eq!((expected.n_nodes(), expected.n_elements()), (107, 44));
    for version in VERSIONS {
        for name in ["groups-version", "groups-partitioned"] {
            let name = format!("{name}{version}.msh");
            let mesh = read(&name);
            assert_eq!((mesh.n_nodes(), mesh.n_elements()), (107, 44), "{name}");
            assert!((volume(&mesh) - 2.0).abs() < 1e-12, "{name}");
            assert_eq!(mesh.groups.len(), expected.groups.len());
            for group in &expected.groups {
                let same = mesh
                    .group(&group.name)
                    .unwrap_or_else(|| panic!("{name}: {}", group.name));
                assert_eq!(same.dimension, group.dimension);
                assert_eq!(
                    places(&mesh, &same.nodes),
                    places(&expected, &group.nodes),
                    "{name}: {}",
                    group.name
                );
                let counts = |g: &fem::Group| (g.lines.len(), g.faces.len(), g.elements.len());
                assert_eq!(counts(same), counts(group), "{name}: {}", group.name);
            }
        }
    }
}

#[test]
fn groups_of_points_and_curves_hold_their_nodes_at_every_order() {
    let mesh = read("groups-version4.1-ascii.msh");
    let rim = mesh.group("rim").unwrap();
    assert_eq!((rim.dimension, rim.lines.len(), rim.nodes.len()), (1, 4, 8));
    let corners = mesh.group("corners").unwrap();
    assert_eq!((corners.dimension, corners.nodes.len()), (0, 2));
    for order in [Order::Linear, Order::Quadratic, Order::Cubic] {
        let other = mesh.with_order(order).unwrap();
        for mesh in [&other, &other.refined().unwrap()] {
            let rim = &mesh.group("rim").unwrap();
            // The four edges of the square at x = 0, and all nodes there.
            let on_edge = |x: f64| x.abs() < 1e-12 || (x - 1.0).abs() < 1e-12;
            let expected: Vec<u32> = (0..mesh.n_nodes() as u32)
                .filter(|n| {
                    let [x, y, z] = mesh.nodes[*n as usize];
                    x.abs() < 1e-12 && (on_edge(y) || on_edge(z))
                })
                .collect();
            assert_eq!(rim.nodes, expected);
            let n_lines = if mesh.n_elements() > 44 { 8 } else { 4 };
            assert_eq!(rim.lines.len(), n_lines);
            assert!(
                rim.lines
                    .iter()
                    .all(|line| line.len() == order as usize + 1)
            );
            assert_eq!(mesh.group("corners").unwrap().nodes.len(), 2);
        }
    }
}

#[test]
fn groups_of_one_name_are_one_and_that_is_said() {
    for version in ["2.2", "4.0", "4.1"] {
        // The face x = 2 has no name in the file: Gmsh writes a name once, other programs and editors do not mind.
        let name = format!("groups-version{version}-ascii.msh");
        let text = std::fs::read_to_string(data(&name)).unwrap();
        assert!(read(&name).group("group-4").is_some());
        assert!(read(&name).shared_names.is_empty());
        let text = text.replacen("\n5\n0 1 ", "\n6\n2 4 \"ends\"\n0 1 ", 1);
        let mesh = gmsh::read_bytes(text.as_bytes(), Path::new(&name)).unwrap();
        let ends = mesh.group("ends").unwrap();
        assert_eq!(ends.faces.len(), 8);
        let at = |x: f64| {
            ends.nodes
                .iter()
                .filter(|n| (mesh.nodes[**n as usize][0] - x).abs() < 1e-12)
                .count()
        };
        assert_eq!((at(0.0), at(2.0)), (13, 13), "{version}");
        assert_eq!(mesh.shared_names, [("ends".to_owned(), 2)]);
        let raised = mesh.with_order(Order::Cubic).unwrap();
        assert_eq!(raised.shared_names, mesh.shared_names);
    }
}

/// A second volume that is in the model and in no group: Gmsh lists it and saves none of its elements.
#[test]
fn a_volume_of_which_the_file_has_no_elements_is_told() {
    let text = std::fs::read_to_string(data("box-order1-ascii.msh")).unwrap();
    let read = |text: &str| gmsh::read_bytes(text.as_bytes(), Path::new("box.msh")).unwrap();
    assert!(read(&text).left_out_volumes.is_empty());
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let counts = 1 + lines.iter().position(|l| l == "$Entities").unwrap();
    let mut numbers: Vec<&str> = lines[counts].split_whitespace().collect();
    assert_eq!(numbers[3], "1");
    numbers[3] = "2";
    lines[counts] = numbers.join(" ");
    let end = lines.iter().position(|l| l == "$EndEntities").unwrap();
    lines.insert(end, "7 5 0 0 6 1 1 0 0 ".to_owned());
    let mesh = read(&(lines.join("\n") + "\n"));
    assert_eq!(mesh.left_out_volumes, [7]);
    assert_eq!(
        mesh.with_order(Order::Quadratic).unwrap().left_out_volumes,
        [7]
    );
}

#[test]
fn white_space_and_remarks_change_nothing() {
    let text = std::fs::read_to_string(data("box-order1-ascii.msh")).unwrap();
    let expected = read("box-order1-ascii.msh");
    let names = "2 1 \"left side\"\n";
    assert!(text.contains(names));
    let remark = "$Comments\nmade by $hand, $Nodes and all\n$EndComments\n";
    for spelled in [
        format!("{remark}{text}"),
        format!("{text}{remark}"),
        format!("\u{feff}\n{text}"),
        text.replace(names, "2\t1\t\"left side\"\n"),
        text.replace(names, "  2   1 \t \"left side\" \t\n"),
        text.replace('\n', "\r\n"),
    ] {
        let mesh = gmsh::read_bytes(spelled.as_bytes(), Path::new("box.msh")).unwrap();
        assert_eq!(mesh, expected);
    }
    // White space in a name is part of it.
    let tab = text.replace("left side", "left\tside");
    let mesh = gmsh::read_bytes(tab.as_bytes(), Path::new("box.msh")).unwrap();
    assert!(mesh.group("left\tside").is_some());
}

#[test]
fn other_versions_name_the_command_that_converts() {
    let text = std::fs::read_to_string(data("box-order1-ascii.msh")).unwrap();
    let version_1 = "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n";
    for (text, version) in [
        (version_1.to_owned(), "1"),
        (text.replace("4.1 0 8", "3 0 8"), "3"),
        (text.replace("4.1 0 8", "5.0 0 8"), "5.0"),
        (text.replace("4.1 0 8", "4 1 8"), "4 in binary"),
    ] {
        let error = gmsh::read_bytes(text.as_bytes(), Path::new("part.msh")).unwrap_err();
        assert!(
            matches!(&error, Error::Version { found, .. } if found == version),
            "{error}"
        );
        let command = "`gmsh part.msh -save -format msh41 -o part.msh`";
        assert!(error.to_string().contains(command), "{error}");
    }
}

#[test]
fn volume_in_no_group_is_named_as_that() {
    for version in ["2.2", "4.0", "4.1"] {
        let name = format!("no-volume-version{version}.msh");
        let error = gmsh::read(&data(&name)).unwrap_err();
        assert!(matches!(error, Error::VolumeInNoGroup { .. }), "{error}");
        let told = error.to_string();
        assert!(told.contains("Physical Volume(\"body\") = {1};"), "{told}");
    }
    // A volume in a group that is not meshed.
    let text = std::fs::read_to_string(data("no-volume-version4.1.msh")).unwrap();
    let volume = text
        .lines()
        .find(|line| line.ends_with(" 0 6 -1 2 -3 4 -5 6 "))
        .unwrap();
    let grouped = text.replace(volume, &volume.replace(" 0 6 -1", " 1 1 6 -1"));
    let error = gmsh::read_bytes(grouped.as_bytes(), Path::new("box.msh")).unwrap_err();
    assert!(matches!(error, Error::NoTetrahedra { .. }), "{error}");
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused() {
    let mut names = vec![
        "box-order2-ascii.msh".to_owned(),
        "box-order2-binary.msh".to_owned(),
    ];
    names.extend(VERSIONS.map(|version| format!("groups-partitioned{version}.msh")));
    for name in names {
        let bytes = std::fs::read(data(&name)).unwrap();
        for len in (0..bytes.len() - 12).step_by(7) {
            let result = gmsh::read_bytes(&bytes[..len], Path::new(&name));
            assert!(result.is_err(), "{name} cut to {len} bytes");
        }
    }
}

/// One byte another: a mesh whose numbers are in range, or a refusal; never a panic and no hang.
#[test]
fn damaged_bytes_are_answered() {
    let mut names = vec!["box-parametric-binary.msh".to_owned()];
    names.extend(VERSIONS.map(|version| format!("groups-partitioned{version}.msh")));
    for name in names {
        let bytes = std::fs::read(data(&name)).unwrap();
        for at in 0..bytes.len() {
            let other = [0, b' ', b'-', b'9', 0x7f, 0xff][at % 6];
            let mut damaged = bytes.clone();
            damaged[at] = other;
            if let Ok(mesh) = gmsh::read_bytes(&damaged, Path::new(&name)) {
                let n = mesh.n_nodes() as u32;
                assert!(mesh.elements.iter().all(|node| *node < n));
                assert!(
                    mesh.groups
                        .iter()
                        .flat_map(|g| &g.nodes)
                        .all(|node| *node < n)
                );
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

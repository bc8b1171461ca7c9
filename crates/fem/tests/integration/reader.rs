//! The reader on files that are unusual but right, and on hand-made files with one thing wrong.

use std::collections::BTreeSet;
use std::path::Path;

use fem::mesh::gmsh;
use fem::{Error, Face, Mesh, Order};

use crate::common::read;

fn parse(text: &str) -> Result<Mesh, Error> {
    gmsh::read_bytes(text.as_bytes(), Path::new("part.msh"))
}

fn refusal(text: &str) -> String {
    parse(text).expect_err("a refusal").to_string()
}

const ENTITIES: &str = "$PhysicalNames\n2\n2 5 \"foot\"\n3 9 \"body\"\n$EndPhysicalNames\n\
    $Entities\n0 0 1 1\n3 0 0 0 1 1 0 1 5 0\n8 0 0 0 1 1 1 1 9 0\n$EndEntities\n";
const NODES: &str = "$Nodes\n1 4 3 1000000\n3 8 0 4\n70\n3\n1000000\n20\n\
    0 0 1\n0 1 0\n0 0 0\n1 0 0\n$EndNodes\n";
const ELEMENTS: &str = "$Elements\n2 2 1 9\n2 3 2 1\n9 1000000 3 20\n3 8 4 1\n1 1000000 20 3 70\n\
    $EndElements\n";

/// One tetrahedron with a foot, tags neither ascending nor dense; sections can be replaced.
fn file(entities: &str, nodes: &str, elements: &str) -> String {
    format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{entities}{nodes}{elements}")
}

#[test]
fn sparse_and_permuted_node_tags_are_followed() {
    let mesh = parse(&file(ENTITIES, NODES, ELEMENTS)).unwrap();
    assert_eq!(mesh.order, Order::Linear);
    assert_eq!(mesh.node_tags, [70, 3, 1_000_000, 20]);
    assert_eq!(mesh.elements, [2, 3, 1, 0]);
    assert_eq!(mesh.node_of_tag(20), Some(3));
    assert_eq!(mesh.node_of_tag(1), None);
    assert!((mesh.smallest_jacobian(0) - 1.0).abs() < 1e-15);
    let foot = mesh.group("foot").unwrap();
    assert_eq!((foot.dimension, &foot.nodes[..]), (2, &[1, 2, 3][..]));
    assert_eq!(foot.faces[0].nodes, [2, 1, 3]);
    assert_eq!(mesh.group("body").unwrap().elements, [0]);
}

#[test]
fn line_ends_of_windows_and_unknown_sections_are_read_over() {
    let text = file(ENTITIES, NODES, ELEMENTS);
    assert_eq!(parse(&text.replace('\n', "\r\n")), parse(&text));
    let extra = "$Comments\nnothing 4.1 $Nodes\n$EndComments\n";
    let more = text.replace("$Entities", &format!("{extra}$Entities"));
    assert_eq!(parse(&more), parse(&text));
    assert!(refusal(&format!("{text}$Comments\nno end")).contains("ends too early"));
}

/// Gmsh writes a negative physical tag where the group reverses the surface.
#[test]
fn a_group_of_a_reversed_surface_keeps_its_name() {
    let reversed = ENTITIES.replace("1 1 0 1 5 0", "1 1 0 1 -5 0");
    assert_ne!(reversed, ENTITIES);
    let mesh = parse(&file(&reversed, NODES, ELEMENTS)).unwrap();
    assert_eq!(mesh.group("foot").unwrap().faces.len(), 1);
}

#[test]
fn a_group_without_a_name_is_called_by_its_number() {
    let nameless = ENTITIES.replace("2\n2 5 \"foot\"", "1");
    let mesh = parse(&file(&nameless, NODES, ELEMENTS)).unwrap();
    assert_eq!(mesh.group("group-5").unwrap().faces.len(), 1);
    assert_eq!(mesh.group("body").unwrap().name, "body");
}

#[test]
fn parametric_coordinates_are_read_over() {
    let plain = read("box-order1-ascii.msh");
    for name in ["box-parametric-ascii.msh", "box-parametric-binary.msh"] {
        let mesh = read(name);
        assert_eq!(mesh.elements, plain.elements);
        assert_eq!(mesh.groups, plain.groups);
        for (a, b) in mesh
            .nodes
            .iter()
            .flatten()
            .zip(plain.nodes.iter().flatten())
        {
            assert!((a - b).abs() < 1e-15);
        }
    }
}

/// Binary or text, old or new: one box of Gmsh's.
#[test]
fn older_versions_hold_the_same_box() {
    let expected = read("box-version2.2.msh");
    assert_eq!((expected.n_nodes(), expected.n_elements()), (22, 44));
    let binary = read("box-version2.2-binary.msh");
    assert_eq!(binary.elements, expected.elements);
    assert_eq!(binary.groups, expected.groups);
    assert_eq!(read("box-version4.0.msh").elements, expected.elements);
}

/// Bytes of a binary file turned around: what a machine of the other byte order writes.
#[test]
fn the_other_byte_order_is_read() {
    let mut bytes = b"$MeshFormat\n4.1 1 8\n".to_vec();
    let int = |bytes: &mut Vec<u8>, v: i32| bytes.extend(v.to_be_bytes());
    let size = |bytes: &mut Vec<u8>, v: u64| bytes.extend(v.to_be_bytes());
    int(&mut bytes, 1);
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n");
    [1, 4, 1, 4].iter().for_each(|v| size(&mut bytes, *v));
    [3, 1, 0].iter().for_each(|v| int(&mut bytes, *v));
    [4, 1, 2, 3, 4].iter().for_each(|v| size(&mut bytes, *v));
    for x in [
        0.0f64, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0,
    ] {
        bytes.extend(x.to_be_bytes());
    }
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    [1, 1, 1, 1].iter().for_each(|v| size(&mut bytes, *v));
    [3, 1, 4].iter().for_each(|v| int(&mut bytes, *v));
    [1, 1, 1, 2, 3, 4].iter().for_each(|v| size(&mut bytes, *v));
    bytes.extend(b"\n$EndElements\n");
    let mesh = gmsh::read_bytes(&bytes, Path::new("part.msh")).unwrap();
    assert_eq!(mesh.smallest_jacobian(0), 8.0);
}

/// Edges with their inner nodes, each from its smaller vertex, in any order; and the centre.
fn edges(order: Order, face: &Face) -> (BTreeSet<Vec<u32>>, Option<&u32>) {
    let inner = order as usize - 1;
    let edges = (0..3)
        .map(|k| {
            let mut edge = vec![face.nodes[k]];
            edge.extend(&face.nodes[3 + k * inner..][..inner]);
            edge.push(face.nodes[(k + 1) % 3]);
            if edge[0] > edge[inner + 1] {
                edge.reverse();
            }
            edge
        })
        .collect();
    (edges, face.nodes.get(9))
}

/// Nodes of every group lie on faces of the boundary, and its faces are boundary faces.
#[test]
fn faces_of_groups_are_faces_of_the_boundary() {
    for name in [
        "ring-tet10.msh",
        "ring-tet20.msh",
        "cantilever-tet10.msh",
        "cantilever-tet20.msh",
    ] {
        let mesh = read(name);
        let sorted = |nodes: &[u32]| {
            let mut nodes = nodes.to_vec();
            nodes.sort_unstable();
            nodes
        };
        let boundary: std::collections::HashSet<Vec<u32>> = mesh
            .boundary_faces()
            .iter()
            .map(|f| sorted(&f.nodes))
            .collect();
        let mut n_groups = 0;
        for group in mesh.groups.iter().filter(|g| g.dimension == 2) {
            assert!(
                group
                    .faces
                    .iter()
                    .all(|f| boundary.contains(&sorted(&f.nodes))),
                "{name}"
            );
            n_groups += 1;
        }
        assert!(n_groups >= 2);
        assert_eq!(
            mesh.group("surface").unwrap().faces.len(),
            boundary.len(),
            "{name}"
        );
        // Edge and face nodes of the file's triangles stand where the element's own faces have them.
        for face in &mesh.group("surface").unwrap().faces {
            let own = mesh
                .boundary_faces()
                .into_iter()
                .find(|f| sorted(&f.nodes) == sorted(&face.nodes))
                .unwrap();
            assert_eq!(edges(mesh.order, face), edges(mesh.order, &own), "{name}");
        }
    }
}

#[test]
fn mistakes_in_the_mesh_are_named_by_tag() {
    let twice = NODES.replace("70\n3\n", "70\n70\n");
    assert_eq!(
        refusal(&file(ENTITIES, &twice, ELEMENTS)),
        "mesh: node 70 is there twice"
    );
    for bad in ["nan", "NaN", "inf", "-inf", "1e999"] {
        let nodes = NODES.replace("0 1 0\n", &format!("0 {bad} 0\n"));
        assert_eq!(
            parse(&file(ENTITIES, &nodes, ELEMENTS)),
            Err(Error::CoordinateNotFinite { tag: 3 })
        );
    }
    let unknown = ELEMENTS.replace("1 1000000 20 3 70", "1 1000000 20 4 70");
    assert_eq!(
        refusal(&file(ENTITIES, NODES, &unknown)),
        "mesh: element 1 names node 4, which is not in the file"
    );
    let unknown = ELEMENTS.replace("9 1000000 3 20", "9 1000000 3 21");
    assert!(refusal(&file(ENTITIES, NODES, &unknown)).contains("element 9 names node 21"));
}

#[test]
fn mistakes_in_the_text_are_named_by_line() {
    let text = file(ENTITIES, NODES, ELEMENTS);
    let line_of = |what: &str| 1 + text[..text.find(what).unwrap()].matches('\n').count();
    for (good, bad, what) in [
        ("0 1 0\n0 0 0", "0 l 0\n0 0 0", "\"l\" is no number"),
        (
            "1000000\n20\n",
            "1000000\n2O\n",
            "\"2O\" is no count or tag",
        ),
        ("3 8 4 1\n", "3 8 four 1\n", "\"four\" is no whole number"),
        ("3 8 4 1\n", "3 8 77 1\n", "element type 77 is not known"),
        ("$EndNodes", "$EndNode", "$EndNodes was expected"),
        (
            "2 5 \"foot\"",
            "2 five \"foot\"",
            "dimension, tag and \"name\"",
        ),
        ("3 8 0 4\n", "3 8 0 4000\n", "announces 4000 entries"),
        ("$Elements", "Elements", "a section such as $Nodes"),
    ] {
        assert!(text.contains(good), "{good}");
        let refused = refusal(&text.replacen(good, bad, 1));
        assert!(refused.contains(what), "{bad}: {refused}");
        // The wrong word may stand in the first or second line of the piece that was replaced.
        let (first, last) = (
            line_of(good),
            line_of(good) + good.trim().matches('\n').count(),
        );
        let is_there = (first..=last).any(|n| refused.starts_with(&format!("line {n}: ")));
        assert!(is_there, "{bad} in line {first} to {last}: {refused}");
    }
}

#[test]
fn other_elements_and_mixed_orders_are_refused() {
    let hexahedron = "$Elements\n1 1 1 1\n3 8 5 1\n1 70 3 20 70 3 20 70 3\n$EndElements\n";
    let refused = refusal(&file(ENTITIES, NODES, hexahedron));
    assert!(
        refused.contains("hexahedra") && refused.contains("tetrahedra"),
        "{refused}"
    );
    let both = "$Elements\n2 2 1 2\n3 8 4 1\n1 1000000 20 3 70\n3 8 6 1\n2 70 3 20 70 3 20\n\
        $EndElements\n";
    assert!(refusal(&file(ENTITIES, NODES, both)).contains("prisms"));
    let mixed = "$Elements\n2 2 1 2\n3 8 4 1\n1 1000000 20 3 70\n3 8 11 1\n\
        2 70 3 20 70 3 20 70 3 20 70\n$EndElements\n";
    assert_eq!(
        parse(&file(ENTITIES, NODES, mixed)),
        Err(Error::MixedOrders(1, 2))
    );
    let shell = "$Elements\n1 1 1 1\n2 3 2 1\n9 1000000 3 20\n$EndElements\n";
    assert_eq!(
        parse(&file(ENTITIES, NODES, shell)),
        Err(Error::NoTetrahedra {
            found: String::new()
        })
    );
    // A block of another kind without elements is no mixture.
    let empty = ELEMENTS.replace("2 2 1 9\n", "3 2 1 9\n3 8 5 0\n");
    assert!(parse(&file(ENTITIES, NODES, &empty)).is_ok());
}

#[test]
fn files_that_are_no_mesh_are_refused() {
    for (text, what) in [
        ("", "empty"),
        (" \n\n", "empty"),
        ("solid part\n", "a section such as $Nodes"),
        ("$Nodes\n0 0 0 0\n$EndNodes\n", "$MeshFormat"),
        ("$MeshFormat\n4.1 0 4\n$EndMeshFormat\n", "64-bit"),
        ("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "no tetrahedra"),
        ("$MeshFormat\n", "ends too early"),
    ] {
        let refused = refusal(text);
        assert!(refused.contains(what), "{text:?}: {refused}");
    }
    let missing = gmsh::read(Path::new("no/such/file.msh")).unwrap_err();
    assert!(
        missing.to_string().contains("opening the file"),
        "{missing}"
    );
}

mod repair;

use proptest::prelude::*;

use super::*;
use crate::tool::{BoxShape, Tool};

fn brick() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let half = DVec3::new(0.3, 0.5, 0.2);
    Tool::Box(BoxShape::new(half).unwrap()).tessellate(1.0)
}

/// A star of eight sharp spikes: vertices and edges both sharply convex and concave.
fn star() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut vertices: Vec<DVec3> = DVec3::AXES
        .iter()
        .flat_map(|&a| [a, -a])
        .map(|v| 0.2 * v)
        .collect();
    let mut triangles = Vec::new();
    for (sx, sy, sz) in [
        (1, 1, 1),
        (1, 1, -1),
        (1, -1, 1),
        (1, -1, -1),
        (-1, 1, 1),
        (-1, 1, -1),
        (-1, -1, 1),
        (-1, -1, -1_i32),
    ] {
        let tip = vertices.len() as u32;
        vertices.push(DVec3::new(sx as f64, sy as f64, sz as f64));
        let foot = |axis: u32, sign: i32| 2 * axis + u32::from(sign < 0);
        let (x, y, z) = (foot(0, sx), foot(1, sy), foot(2, sz));
        let (x, y) = if sx * sy * sz > 0 { (x, y) } else { (y, x) };
        triangles.extend([[x, y, tip], [y, z, tip], [z, x, tip]]);
    }
    (vertices, triangles)
}

/// Solid angle of the surface seen from p over 4 pi: 1 inside, 0 outside. Source: Van Oosterom and Strackee (1983).
fn winding_number(vertices: &[DVec3], triangles: &[[u32; 3]], p: DVec3) -> f64 {
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| vertices[v as usize] - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

proptest! {
    /// Sign against the winding number, which knows nothing of pseudo-normals; the spikes make most nearest points edges
    /// and vertices.
    #[test]
    fn sign_is_that_of_the_winding_number(p in prop::array::uniform3(-1.2..1.2_f64)) {
        let (vertices, triangles) = star();
        let mesh = Mesh::new(&vertices, &triangles).unwrap();
        prop_assert_eq!(mesh.repair(), MeshRepair::default());
        let p = DVec3::from_array(p);
        let contact = mesh.signed_distance_local(p);
        if contact.signed_distance.abs() > 1e-9 {
            let is_inside = winding_number(&vertices, &triangles, p) > 0.5;
            prop_assert_eq!(contact.signed_distance < 0.0, is_inside, "{}", contact.signed_distance);
        }
    }

    /// A brick as a mesh answers as the exact brick, in any unit of length.
    #[test]
    fn mesh_of_a_brick_is_the_brick(p in prop::array::uniform3(-1.0..1.0_f64), exponent in -9..9_i32) {
        let unit = 10.0_f64.powi(exponent);
        let half = DVec3::new(0.3, 0.5, 0.2) * unit;
        let exact = BoxShape::new(half).unwrap();
        let (vertices, triangles) = Tool::Box(exact).tessellate(1.0);
        let mesh = Mesh::new(&vertices, &triangles).unwrap();
        let p = DVec3::from_array(p) * unit;
        let (a, b) = (mesh.signed_distance_local(p), exact.signed_distance_local(p));
        prop_assert!((a.signed_distance - b.signed_distance).abs() < 1e-14 * unit);
        if a.signed_distance > 0.0 {
            prop_assert!((a.normal - b.normal).length() < 1e-9);
        }
    }
}

#[test]
fn sign_is_right_beyond_every_vertex_and_edge() {
    let (vertices, triangles) = star();
    let mesh = Mesh::new(&vertices, &triangles).unwrap();
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|v| vertices[v as usize]);
        for p in [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)] {
            assert!(mesh.signed_distance_local(1.01 * p).signed_distance > 0.0);
            assert!(mesh.signed_distance_local(0.99 * p).signed_distance < 0.0);
            let on = mesh.signed_distance_local(p);
            assert!(on.signed_distance.abs() < 1e-15);
            assert!((on.normal.length() - 1.0).abs() < 1e-12 && on.normal.dot(p) > 0.0);
        }
    }
}

#[test]
fn mesh_inside_out_is_turned_and_says_so() {
    let (vertices, mut triangles) = brick();
    for triangle in &mut triangles {
        triangle.swap(0, 1);
    }
    let mesh = Mesh::new(&vertices, &triangles).unwrap();
    assert_eq!(mesh.repair().n_inverted_pieces, 1);
    assert!(mesh.signed_distance_local(DVec3::ZERO).signed_distance < 0.0);
    assert!(mesh.signed_distance_local(DVec3::X).signed_distance > 0.0);
}

#[test]
fn single_triangles_the_wrong_way_are_turned() {
    let (vertices, mut triangles) = brick();
    triangles[5].swap(0, 1);
    triangles[8].swap(1, 2);
    let mesh = Mesh::new(&vertices, &triangles).unwrap();
    assert_eq!(mesh.repair().n_turned_triangles, 2);
    assert_eq!(mesh.repair().n_inverted_pieces, 0);
    assert!((mesh.signed_distance_local(DVec3::ZERO).signed_distance + 0.2).abs() < 1e-15);
}

#[test]
fn cavity_stays_a_cavity() {
    let (mut vertices, mut triangles) = brick();
    let n = vertices.len() as u32;
    vertices.extend_from_within(..);
    for v in &mut vertices[n as usize..] {
        *v *= 0.5;
    }
    let inner: Vec<_> = triangles
        .iter()
        .map(|&[a, b, c]| [b + n, a + n, c + n])
        .collect();
    triangles.extend(inner);
    let mesh = Mesh::new(&vertices, &triangles).unwrap();
    assert_eq!(mesh.repair(), MeshRepair::default());
    assert!(mesh.signed_distance_local(DVec3::ZERO).signed_distance > 0.0);
    assert!(
        mesh.signed_distance_local(DVec3::new(0.22, 0.0, 0.0))
            .signed_distance
            < 0.0
    );
}

#[test]
fn broken_meshes_are_refused_with_the_place() {
    let (vertices, triangles) = brick();
    let refused = |v: &[DVec3], t: &[[u32; 3]]| Mesh::new(v, t).unwrap_err();

    let open = refused(&vertices, &triangles[1..]);
    let Error::MeshOpen {
        start,
        end,
        n_edges: 3,
        coordinates: Coordinates::Metres,
    } = open
    else {
        panic!("{open}")
    };
    assert!(vertices.contains(&start) && vertices.contains(&end));
    assert!(
        open.to_string().contains("open at the edge from ["),
        "{open}"
    );

    // A fin on an edge: three triangles there, and two open edges.
    let mut fin_vertices = vertices.clone();
    fin_vertices.push(DVec3::new(2.0, 2.0, 2.0));
    let mut fin = triangles.clone();
    fin.push([triangles[0][0], triangles[0][1], 8]);
    assert!(matches!(
        refused(&fin_vertices, &fin),
        Error::MeshEdgeNotManifold { n_triangles: 3, .. } | Error::MeshOpen { .. }
    ));

    // Two bricks that touch in one corner.
    let mut two = vertices.clone();
    two.extend(vertices.iter().map(|v| *v + 2.0 * vertices[7]));
    let mut both = triangles.clone();
    both.extend(triangles.iter().map(|t| t.map(|v| v + 8)));
    let touching = refused(&two, &both);
    assert_eq!(
        touching,
        Error::MeshVertexNotManifold {
            position: vertices[7],
            coordinates: Coordinates::Metres,
        }
    );

    assert_eq!(refused(&vertices, &[]), Error::MeshEmpty);
    assert!(matches!(
        refused(&vertices, &[[0, 1, 99]]),
        Error::MeshIndex { vertex: 99, .. }
    ));
    let mut nan = vertices.clone();
    nan[3].y = f64::NAN;
    assert!(matches!(
        refused(&nan, &triangles),
        Error::NotFinite { index: 3, .. }
    ));
    let flat = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
    assert!(matches!(
        refused(&flat, &[[0, 1, 2], [0, 2, 1]]),
        Error::MeshZeroArea { .. }
    ));
    let pillow = [DVec3::ZERO, DVec3::X, DVec3::Y];
    assert_eq!(
        refused(&pillow, &[[0, 1, 2], [0, 2, 1]]),
        Error::MeshNoVolume
    );
}

#[test]
fn one_sided_surface_is_refused() {
    // The projective plane with six vertices (half an icosahedron): closed, but without an outside. Moved out of the
    // plane so that triangles have area.
    let vertices: Vec<DVec3> = (0..6)
        .map(|k| {
            DVec3::new(
                (k as f64).cos(),
                (2.0 * k as f64).sin(),
                (k * k) as f64 * 0.1,
            )
        })
        .collect();
    let triangles = [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 5],
        [0, 5, 1],
        [1, 2, 4],
        [2, 3, 5],
        [3, 4, 1],
        [4, 5, 2],
        [5, 1, 3],
    ];
    let refused = Mesh::new(&vertices, &triangles).unwrap_err();
    assert!(
        matches!(refused, Error::MeshNotOrientable { .. }),
        "{refused}"
    );
}

#[test]
fn triangle_soup_is_merged() {
    let (vertices, triangles) = brick();
    let soup: Vec<DVec3> = triangles
        .iter()
        .flatten()
        .map(|&v| vertices[v as usize])
        .collect();
    let mut indices: Vec<[u32; 3]> = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    indices.push([0, 0, 1]);
    let mesh = Mesh::new(&soup, &indices).unwrap();
    assert_eq!(mesh.repair().n_merged_vertices, 28);
    assert_eq!(mesh.repair().n_removed_triangles, 1);
    let (merged, kept) = mesh.tessellate();
    assert_eq!((merged.len(), kept.len()), (8, 12));
}

#[test]
fn files_are_read_in_their_unit() {
    let (vertices, triangles) = brick();
    let folder = tempfile::tempdir().unwrap();
    let stl = folder.path().join("brick.stl");
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        bytes.extend([0; 12]);
        for x in triangle
            .map(|v| vertices[v as usize].to_array())
            .as_flattened()
        {
            bytes.extend((*x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    std::fs::write(&stl, bytes).unwrap();
    let obj = folder.path().join("brick.OBJ");
    let mut text = String::from("mtllib colours.mtl\no brick\n");
    for v in &vertices {
        text += &format!("v {} {} {}\n", v.x, v.y, v.z);
    }
    // Four-cornered faces, as most programs write them.
    for pair in triangles.chunks(2) {
        let corners = [pair[0][0], pair[0][1], pair[0][2], pair[1][2]].map(|v| v + 1);
        text += &format!(
            "f {} {} {} {}\n",
            corners[0], corners[1], corners[2], corners[3]
        );
    }
    std::fs::write(&obj, text).unwrap();
    for path in [stl, obj] {
        let mesh = Mesh::read(&path, 0.001).unwrap();
        let contact = mesh.signed_distance_local(DVec3::new(0.0013, 0.0, 0.0));
        // Coordinates passed through f32.
        assert!(
            (contact.signed_distance - 0.001).abs() < 1e-10,
            "{contact:?}"
        );
        assert!((contact.normal - DVec3::X).length() < 1e-6);
    }
}

#[test]
fn unreadable_files_are_errors_that_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none.stl");
    let error = Mesh::read(&missing, 1.0).unwrap_err();
    assert!(error.to_string().contains("none.stl"), "{error}");
    let other = folder.path().join("tool.step");
    assert!(matches!(
        Mesh::read(&other, 1.0),
        Err(Error::MeshFormat { .. })
    ));
    for (name, bytes) in [
        ("empty.stl", &b""[..]),
        ("short.stl", &[255; 90][..]),
        (
            "text.stl",
            b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 q\n",
        ),
        ("bad.obj", b"v 0 0 0\nf 1 2 3\n"),
        ("none.obj", b""),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let error = Mesh::read(&path, 1.0).unwrap_err();
        assert!(
            matches!(error, Error::MeshFile { .. } | Error::MeshEmpty),
            "{name}: {error}"
        );
    }
    assert!(matches!(
        Mesh::read(&missing, 0.0),
        Err(Error::NotPositive { .. })
    ));
}

//! Seams that are joined, and pieces that are turned.

use super::*;

/// A brick as a file has it: three corners of its own for each triangle, each moved by at most `shake` of its own.
fn shaken_brick(offset: DVec3, shake: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (vertices, triangles) = brick();
    let corners = triangles.as_flattened().iter().enumerate();
    let soup = corners.map(|(k, v)| {
        let angle = k as f64;
        let wobble = DVec3::new(angle.sin(), (2.0 * angle).sin(), (3.0 * angle).sin());
        vertices[*v as usize] + offset + 0.5 * shake * wobble
    });
    let soup = soup.collect();
    let indices = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    (soup, indices.collect())
}

#[test]
fn corners_that_differ_by_round_off_are_one_and_are_counted() {
    // Largest extent 1, diagonal 1.23.
    for exponent in [-15, -14, -12, -11, -10, -9, -8, -7, -6] {
        let shake = 10.0_f64.powi(exponent);
        let (vertices, triangles) = shaken_brick(DVec3::ZERO, shake);
        let mesh = Mesh::new(&vertices, &triangles).unwrap();
        let repair = mesh.repair();
        assert_eq!(mesh.tessellate().0.len(), 8, "{shake:e}");
        assert_eq!(repair.n_merged_vertices + repair.n_welded_vertices, 36 - 8);
        assert!(repair.n_welded_vertices > 0 && repair.n_removed_triangles == 0);
        assert!(repair.weld_distance > 0.0 && repair.weld_distance <= shake);
        let distance = mesh
            .signed_distance_local(DVec3::new(1.3, 0.0, 0.0))
            .signed_distance;
        assert!((distance - 1.0).abs() <= shake);
    }
    // What is apart by more is a gap, told where it is.
    for shake in [1e-4, 1e-5] {
        let (vertices, triangles) = shaken_brick(DVec3::ZERO, shake);
        let refusal = Mesh::new(&vertices, &triangles).unwrap_err();
        assert!(matches!(refusal, Error::MeshOpen { .. }), "{refusal}");
    }
    // Far from the origin a 32-bit number has fewer digits of the size.
    let far = DVec3::splat(40.0);
    let (vertices, triangles) = shaken_brick(far, 0.0);
    let nudge = |(k, v): (usize, &DVec3)| {
        let x = v.x as f32;
        let x = if k % 3 == 0 { x.next_up() } else { x };
        DVec3::new(f64::from(x), v.y, v.z)
    };
    let vertices: Vec<DVec3> = vertices.iter().enumerate().map(nudge).collect();
    let mesh = Mesh::new(&vertices, &triangles).unwrap();
    assert_eq!(mesh.tessellate().0.len(), 8);
}

/// Corners are joined where the surface is torn only: a small body with the size of a seam's gap stays.
#[test]
fn details_finer_than_round_off_of_the_size_are_kept_where_the_surface_is_closed() {
    let (mut vertices, mut triangles) = shaken_brick(DVec3::ZERO, 1e-7);
    let n = vertices.len() as u32;
    let (small, small_triangles) = brick();
    vertices.extend(small.iter().map(|v| DVec3::new(5.0, 0.0, 0.0) + 1e-8 * *v));
    triangles.extend(small_triangles.iter().map(|t| t.map(|v| v + n)));
    let mesh = Mesh::new(&vertices, &triangles).unwrap();
    assert_eq!(mesh.tessellate().0.len(), 16);
}

#[test]
fn a_seam_of_round_off_does_not_hide_the_hole_in_the_refusal() {
    let (vertices, triangles) = shaken_brick(DVec3::ZERO, 1e-9);
    let refusal = Mesh::new(&vertices, &triangles[1..]).unwrap_err();
    let Error::MeshOpen { n_edges, .. } = refusal else {
        panic!("{refusal}")
    };
    assert_eq!(n_edges, 3);
}

/// A frame about z: outer sides 4, hole 2, height 1, centre in the origin.
fn frame() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let ring = |half: f64, z: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::new(half * x, half * y, z))
    };
    let rings = [
        ring(2.0, -0.5),
        ring(2.0, 0.5),
        ring(1.0, 0.5),
        ring(1.0, -0.5),
    ];
    let vertices = rings.concat();
    let mut triangles = Vec::new();
    for r in 0..4 {
        for k in 0..4 {
            let (a, b) = (4 * r + k, 4 * r + (k + 1) % 4);
            let (c, d) = (4 * ((r + 1) % 4) + (k + 1) % 4, 4 * ((r + 1) % 4) + k);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (vertices, triangles)
}

fn add(
    to: &mut (Vec<DVec3>, Vec<[u32; 3]>),
    (vertices, triangles): &(Vec<DVec3>, Vec<[u32; 3]>),
    is_inside_out: bool,
    place: impl Fn(DVec3) -> DVec3,
) {
    let n = to.0.len() as u32;
    to.0.extend(vertices.iter().map(|v| place(*v)));
    to.1.extend(triangles.iter().map(|&[a, b, c]| {
        let turned = if is_inside_out { [a, c, b] } else { [a, b, c] };
        turned.map(|v| v + n)
    }));
}

#[test]
fn body_in_the_hole_of_a_frame_is_no_cavity() {
    for (frame_turned, body_turned) in [(false, false), (false, true), (true, false), (true, true)]
    {
        let mut both = Default::default();
        add(&mut both, &frame(), frame_turned, |v| v);
        add(&mut both, &brick(), body_turned, |v| v);
        let mesh = Mesh::new(&both.0, &both.1).unwrap();
        let turned = usize::from(frame_turned) + usize::from(body_turned);
        assert_eq!(mesh.repair().n_inverted_pieces, turned);
        let distance = |x: f64| {
            mesh.signed_distance_local(DVec3::new(x, 0.0, 0.0))
                .signed_distance
        };
        assert!((distance(0.0) + 0.2).abs() < 1e-12);
        assert!((distance(0.4) - 0.1).abs() < 1e-12);
        assert!((distance(0.9) - 0.1).abs() < 1e-12);
        assert!((distance(1.4) + 0.4).abs() < 1e-12);
        assert!((distance(3.0) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn cavities_and_bodies_in_them_are_told_apart_however_a_file_winds_them() {
    let distance = |mesh: &Mesh, x: f64| mesh.signed_distance_local(DVec3::X * x).signed_distance;
    // A hollow brick, as a whole the right way or inside out, with a body in its cavity that is wound either way.
    for (is_inside_out, body_turned) in [(false, false), (false, true), (true, false), (true, true)]
    {
        let mut all = Default::default();
        add(&mut all, &brick(), body_turned, |v| v);
        add(&mut all, &brick(), is_inside_out, |v| 4.0 * v);
        add(&mut all, &brick(), !is_inside_out, |v| 2.0 * v);
        let mesh = Mesh::new(&all.0, &all.1).unwrap();
        assert!(distance(&mesh, 0.0) < 0.0, "in the body");
        assert!((distance(&mesh, 0.4) - 0.1).abs() < 1e-12, "in the cavity");
        assert!((distance(&mesh, 0.7) + 0.1).abs() < 1e-12, "in the wall");
        assert!((distance(&mesh, 1.3) - 0.1).abs() < 1e-12, "outside");
        let n_turned = 2 * usize::from(is_inside_out) + usize::from(body_turned);
        assert_eq!(mesh.repair().n_inverted_pieces, n_turned);
    }
}

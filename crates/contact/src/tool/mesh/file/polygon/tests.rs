use proptest::prelude::*;

use super::*;

/// Polygon in a plane that no axis lies in.
fn tilted(flat: &[[f64; 2]]) -> (Vec<DVec3>, Vec<u32>) {
    let (u, v) = DVec3::new(0.36, 0.48, 0.8).any_orthonormal_pair();
    let vertices = flat.iter().map(|[x, y]| DVec3::ONE + *x * u + *y * v);
    (vertices.collect(), (0..flat.len() as u32).collect())
}

fn doubled_area(vertices: &[DVec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| vertices[v as usize]);
    (b - a).cross(c - a)
}

/// Edges without a partner in the other direction.
fn open_edges(triangles: &[[u32; 3]]) -> BTreeSet<(u32, u32)> {
    let mut edges = BTreeSet::new();
    for t in triangles {
        for k in 0..3 {
            let (from, to) = (t[k], t[(k + 1) % 3]);
            if !edges.remove(&(to, from)) {
                assert!(edges.insert((from, to)), "{from} to {to} twice");
            }
        }
    }
    edges
}

/// The triangles face as the polygon, fill it, and leave its edges as they are.
fn check(flat: &[[f64; 2]]) {
    let (vertices, corners) = tilted(flat);
    let triangles = cut(&vertices, &corners).unwrap();
    let n = flat.len();
    assert_eq!(triangles.len(), n - 2);
    let around = |k: usize| (flat[k], flat[(k + 1) % n]);
    let shoelace: f64 = (0..n)
        .map(around)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum();
    let areas = triangles.iter().map(|t| doubled_area(&vertices, *t));
    let whole: DVec3 = areas.clone().sum();
    assert!((whole.length() - shoelace.abs()).abs() < 1e-12 * shoelace.abs());
    for area in areas {
        assert!(area.dot(whole) > 0.0, "{triangles:?}");
    }
    let edges: BTreeSet<(u32, u32)> = (0..n as u32).map(|k| (k, (k + 1) % n as u32)).collect();
    assert_eq!(open_edges(&triangles), edges);
}

const L_SHAPE: [[f64; 2]; 6] = [
    [-6.0, -4.0],
    [6.0, -4.0],
    [6.0, -3.5],
    [-5.5, -3.5],
    [-5.0, 6.0],
    [-6.0, 6.0],
];

#[test]
fn concave_polygon_is_filled_from_whichever_corner_it_is_counted() {
    for start in 0..6 {
        let mut turned = L_SHAPE;
        turned.rotate_left(start);
        check(&turned);
        turned.reverse();
        check(&turned);
    }
    // An arrowhead: four corners, one of them concave.
    check(&[[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]]);
    // A comb whose teeth see each other.
    let comb = (0..40).map(|k| [f64::from(k), if k % 2 == 0 { 1.0 } else { 9.0 }]);
    let mut comb: Vec<[f64; 2]> = comb.collect();
    comb.extend([[39.0, 0.0], [0.0, 0.0]]);
    check(&comb);
}

#[test]
fn corners_on_a_straight_line_are_kept() {
    // Each side of a square in thirds, which floating-point numbers do not hit.
    let third = |k: f64| k / 3.0;
    let mut square = Vec::new();
    for k in [0.0, 1.0, 2.0] {
        square.push([third(k), 0.0]);
    }
    for k in [0.0, 1.0, 2.0] {
        square.push([1.0, third(k)]);
    }
    for k in [3.0, 2.0, 1.0] {
        square.push([third(k), 1.0]);
    }
    for k in [3.0, 2.0, 1.0] {
        square.push([0.0, third(k)]);
    }
    for start in 0..square.len() {
        let mut turned = square.clone();
        turned.rotate_left(start);
        check(&turned);
    }
}

#[test]
fn hole_joined_by_a_bridge_stays_a_hole() {
    let flat = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
    ];
    let (vertices, _) = tilted(&flat);
    let corners = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4];
    let triangles = cut(&vertices, &corners).unwrap();
    assert_eq!(triangles.len(), 8);
    let areas = triangles.iter().map(|t| doubled_area(&vertices, *t));
    assert!((areas.map(DVec3::length).sum::<f64>() - 24.0).abs() < 1e-12);
    let rim = [
        (0, 1),
        (1, 2),
        (2, 3),
        (3, 0),
        (4, 5),
        (5, 6),
        (6, 7),
        (7, 4),
    ];
    assert_eq!(open_edges(&triangles), BTreeSet::from(rim));
}

#[test]
fn what_is_no_polygon_is_named() {
    let cut_flat = |flat: &[[f64; 2]]| {
        let (vertices, corners) = tilted(flat);
        cut(&vertices, &corners)
    };
    // A bow tie with halves of different size, and a pentagram.
    let tie = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]];
    assert_eq!(cut_flat(&tie), Err(Fault::Crosses));
    let star: Vec<[f64; 2]> = (0..5)
        .map(|k| f64::from(2 * k) * std::f64::consts::TAU / 5.0)
        .map(|angle| [angle.cos(), angle.sin()])
        .collect();
    assert_eq!(cut_flat(&star), Err(Fault::Crosses));
    // A corner that touches an edge.
    let touching = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]];
    // In this plane the touch is exact.
    let touching = touching.map(|[x, y]| DVec3::new(x, y, 0.0));
    assert_eq!(cut(&touching, &[0, 1, 2, 3, 4]), Err(Fault::Crosses));
    let line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]];
    assert_eq!(cut_flat(&line), Err(Fault::NoArea));
    assert_eq!(cut_flat(&line[..2]), Ok(Vec::new()));
    // Corners said twice are one.
    let twice = [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]];
    assert_eq!(cut_flat(&twice).map(|cut| cut.len()), Ok(1));
}

proptest! {
    /// Seen from the middle each corner has its own direction, so the polygon does not cross itself.
    #[test]
    fn any_star_shaped_polygon_is_filled(
        radii in prop::collection::vec(0.05..1.0_f64, 4..40),
        size in -9..9_i32,
    ) {
        let n = radii.len() as f64;
        let flat: Vec<[f64; 2]> = radii
            .iter()
            .enumerate()
            .map(|(k, radius)| (std::f64::consts::TAU * k as f64 / n, radius * 10.0_f64.powi(size)))
            .map(|(angle, radius)| [radius * angle.cos(), radius * angle.sin()])
            .collect();
        // `tilted` puts it one metre away, which smaller ones would not survive.
        let (u, v) = DVec3::new(0.36, 0.48, 0.8).any_orthonormal_pair();
        let vertices: Vec<DVec3> = flat.iter().map(|[x, y]| *x * u + *y * v).collect();
        let corners: Vec<u32> = (0..flat.len() as u32).collect();
        let triangles = cut(&vertices, &corners).unwrap();
        prop_assert_eq!(triangles.len(), flat.len() - 2);
        let areas = triangles.iter().map(|t| doubled_area(&vertices, *t));
        let whole: DVec3 = areas.clone().sum();
        let apart: f64 = areas.map(DVec3::length).sum();
        prop_assert!((whole.length() - apart).abs() < 1e-9 * apart);
    }
}

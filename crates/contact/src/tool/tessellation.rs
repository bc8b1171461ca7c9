//! Triangles of round and square bodies, for drawing.

use glam::DVec3;

/// Sides of a circle; a multiple of 4. 48 sides deviate from the circle by 0.2 % of the radius.
pub(super) const SEGMENTS: usize = 48;

/// Closed body of revolution about z: pole at `bottom`, the rings (radius, z) from bottom to top, pole at `top`.
pub(super) fn revolve(
    bottom: f64,
    top: f64,
    profile: impl Iterator<Item = (f64, f64)>,
) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut vertices = vec![DVec3::new(0.0, 0.0, bottom), DVec3::new(0.0, 0.0, top)];
    let mut n_rings = 0;
    for (radius, z) in profile {
        for k in 0..SEGMENTS {
            let angle = std::f64::consts::TAU * k as f64 / SEGMENTS as f64;
            vertices.push(DVec3::new(radius * angle.cos(), radius * angle.sin(), z));
        }
        n_rings += 1;
    }
    let vertex = |ring: usize, k: usize| (2 + ring * SEGMENTS + k % SEGMENTS) as u32;
    let mut triangles = Vec::new();
    for k in 0..SEGMENTS {
        triangles.push([0, vertex(0, k + 1), vertex(0, k)]);
        for ring in 1..n_rings {
            let (a, b) = (vertex(ring - 1, k), vertex(ring - 1, k + 1));
            let (c, d) = (vertex(ring, k), vertex(ring, k + 1));
            triangles.push([a, b, d]);
            triangles.push([a, d, c]);
        }
        triangles.push([1, vertex(n_rings - 1, k), vertex(n_rings - 1, k + 1)]);
    }
    (vertices, triangles)
}

/// Brick round the origin. Vertex k has the signs of the bits of k (x first).
pub(super) fn brick(half: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let sign = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
    let vertices = (0..8_usize)
        .map(|k| DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4)) * half)
        .collect();
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = faces
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    (vertices, triangles)
}

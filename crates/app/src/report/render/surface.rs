//! Triangles with what drawing needs: smooth normals that stop at creases, and the creases.

use std::collections::HashMap;

use glam::DVec3;

/// Angle between two triangles beyond which their common edge is a crease, degrees. Between the
/// 15 degrees of a coarse round tool and the 90 of a box's edge.
const CREASE_DEG: f64 = 32.0;

/// A triangle surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub(crate) nodes: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Unit normal at each corner of each triangle.
    pub(crate) corner_normals: Vec<[DVec3; 3]>,
    /// Edges where the surface turns sharply or ends.
    pub(crate) creases: Vec<[u32; 2]>,
}

impl Surface {
    pub(crate) fn new(nodes: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        // Twice the area times the unit normal: larger neighbours count more.
        let normals: Vec<DVec3> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|n| nodes[n as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let smooth = CREASE_DEG.to_radians().cos();
        let are_smooth = |a: DVec3, b: DVec3| a.dot(b) >= smooth * a.length() * b.length();

        let mut around: Vec<Vec<u32>> = vec![Vec::new(); nodes.len()];
        for (idx, triangle) in triangles.iter().enumerate() {
            for &n in triangle {
                around[n as usize].push(idx as u32);
            }
        }
        let corner_normals = triangles
            .iter()
            .zip(&normals)
            .map(|(triangle, &own)| {
                triangle.map(|n| {
                    let neighbours = around[n as usize].iter().map(|&t| normals[t as usize]);
                    let sum: DVec3 = neighbours.filter(|&other| are_smooth(own, other)).sum();
                    sum.try_normalize().unwrap_or(DVec3::Z)
                })
            })
            .collect();

        let mut edges: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
        for (idx, &[a, b, c]) in triangles.iter().enumerate() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                edges
                    .entry([p.min(q), p.max(q)])
                    .or_default()
                    .push(idx as u32);
            }
        }
        let mut creases: Vec<[u32; 2]> = edges
            .into_iter()
            .filter(|(_, sides)| match sides[..] {
                [a, b] => !are_smooth(normals[a as usize], normals[b as usize]),
                _ => true,
            })
            .map(|(edge, _)| edge)
            .collect();
        // The map's order is not the same in every run; the picture is.
        creases.sort_unstable();
        Self {
            nodes,
            triangles,
            corner_normals,
            creases,
        }
    }

    /// From loose triangles: corners that coincide become one node.
    pub(crate) fn welded(loose: &[[DVec3; 3]]) -> Self {
        let size = loose
            .iter()
            .flatten()
            .filter(|p| p.is_finite())
            .fold(0.0f64, |size, p| size.max(p.abs().max_element()));
        let grid = if size > 0.0 { 1e6 / size } else { 1.0 };
        let mut seen: HashMap<[i64; 3], u32> = HashMap::new();
        let mut nodes = Vec::new();
        let mut triangles = Vec::new();
        for corners in loose.iter().filter(|t| t.iter().all(|p| p.is_finite())) {
            let triangle = corners.map(|p| {
                let key = (p * grid).round().to_array().map(|v| v as i64);
                *seen.entry(key).or_insert_with(|| {
                    nodes.push(p);
                    nodes.len() as u32 - 1
                })
            });
            let [a, b, c] = triangle;
            if a != b && b != c && c != a {
                triangles.push(triangle);
            }
        }
        Self::new(nodes, triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<[DVec3; 3]> {
        let mut loose = Vec::new();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let at = |u: f64, v: f64| {
                    let mut p = [0.0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u * side, v);
                    DVec3::from_array(p)
                };
                let quad = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
                loose.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
        loose
    }

    #[test]
    fn a_cube_has_twelve_creases_and_flat_faces() {
        let cube = Surface::welded(&cube());
        assert_eq!((cube.nodes.len(), cube.triangles.len()), (8, 12));
        assert_eq!(cube.creases.len(), 12);
        for (triangle, normals) in cube.triangles.iter().zip(&cube.corner_normals) {
            let middle = triangle
                .iter()
                .map(|&n| cube.nodes[n as usize])
                .sum::<DVec3>()
                / 3.0;
            for n in normals {
                assert!((n.abs().max_element() - 1.0).abs() < 1e-12);
                assert!(n.dot(middle) > 0.9);
            }
        }
    }

    #[test]
    fn a_round_tool_is_smooth() {
        let rim = |i: i32, z: f64| {
            let a = f64::from(i % 24) / 24.0 * std::f64::consts::TAU;
            DVec3::new(a.cos(), a.sin(), z)
        };
        let loose: Vec<[DVec3; 3]> = (0..24)
            .flat_map(|i| {
                let (a, b, c, d) = (rim(i, 0.0), rim(i + 1, 0.0), rim(i + 1, 3.0), rim(i, 3.0));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let tube = Surface::welded(&loose);
        // Only the two open ends.
        assert_eq!(tube.creases.len(), 48);
        for (triangle, normals) in tube.triangles.iter().zip(&tube.corner_normals) {
            for (&n, normal) in triangle.iter().zip(normals) {
                let radial = tube.nodes[n as usize].reject_from(DVec3::Z).normalize();
                assert!(normal.dot(radial) > 0.99);
            }
        }
    }
}

//! Edges between the faces of a skin, and how the body turns at them.

use std::collections::HashMap;

use crate::element::{MAX_FACE_NODES, Order, face_shape};
use crate::mesh::{Face, Mesh};

/// An edge of the skin, between two of its faces.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinEdge {
    /// The faces, by number.
    pub faces: [u32; 2],
    /// Its nodes, the ends first.
    pub nodes: Vec<u32>,
    /// Angle from one face's normal to the other's in the middle of the edge, rad: positive where the body is hollow (an
    /// inner edge), negative where it bulges; π where more than two faces meet.
    pub turn: f64,
}

/// All edges between faces that are given as [`Mesh::boundary_faces`] gives them, in a fixed order.
pub fn edges(mesh: &Mesh, faces: &[Face]) -> Vec<SkinEdge> {
    let mut sides: HashMap<[u32; 2], Vec<(u32, u8)>> = HashMap::new();
    for (f, face) in (0..).zip(faces) {
        for k in 0..3 {
            let (a, b) = (face.nodes[k], face.nodes[(k + 1) % 3]);
            let key = [a.min(b), a.max(b)];
            sides.entry(key).or_default().push((f, k as u8));
        }
    }
    let mut edges: Vec<SkinEdge> = sides
        .into_values()
        .filter_map(|sides| {
            let (&first, &second) = (sides.first()?, sides.get(1)?);
            let turn = if sides.len() > 2 {
                std::f64::consts::PI
            } else {
                turn(mesh, faces, first, second)
            };
            Some(SkinEdge {
                faces: [first.0, second.0],
                nodes: nodes_along(mesh.order, &faces[first.0 as usize], first.1 as usize),
                turn,
            })
        })
        .collect();
    edges.sort_unstable_by_key(|e| e.faces);
    edges
}

/// Unit normal out of the body at a point of a face; zero where the face has none.
pub fn normal(mesh: &Mesh, face: &Face, l: [f64; 3]) -> [f64; 3] {
    let [a, b] = tangents(mesh, face, l);
    unit(cross(a, b))
}

/// Nodes of the face along its side `k`: ends, then those between.
fn nodes_along(order: Order, face: &Face, k: usize) -> Vec<u32> {
    let between = order as usize - 1;
    let first = 3 + k * between;
    let mut nodes = vec![face.nodes[k], face.nodes[(k + 1) % 3]];
    nodes.extend(&face.nodes[first..first + between]);
    nodes
}

fn turn(mesh: &Mesh, faces: &[Face], first: (u32, u8), second: (u32, u8)) -> f64 {
    let there = |(f, k): (u32, u8)| {
        let (face, k) = (&faces[f as usize], k as usize);
        let mut l = [0.0; 3];
        (l[k], l[(k + 1) % 3]) = (0.5, 0.5);
        let [a, b] = tangents(mesh, face, l);
        // Along the side: by vertices 0 to 1, 1 to 2, 2 to 0.
        let along: [f64; 3] = match k {
            0 => a,
            1 => [0, 1, 2].map(|c| b[c] - a[c]),
            _ => b.map(|x| -x),
        };
        (unit(cross(a, b)), unit(along))
    };
    let (normal, _) = there(first);
    let (other, along) = there(second);
    // Across the second face, away from the edge.
    let away = cross(other, along);
    dot(normal, away).atan2(dot(normal, other))
}

/// dx/dL_1 and dx/dL_2 with L_0 = 1 - L_1 - L_2.
fn tangents(mesh: &Mesh, face: &Face, l: [f64; 3]) -> [[f64; 3]; 2] {
    let (mut n, mut d) = ([0.0; MAX_FACE_NODES], [[0.0; 3]; MAX_FACE_NODES]);
    face_shape(mesh.order, l, &mut n, &mut d);
    [1, 2].map(|k| {
        [0, 1, 2].map(|c| {
            let nodes = face.nodes.iter().zip(&d);
            nodes
                .map(|(&node, d)| (d[k] - d[0]) * mesh.nodes[node as usize][c])
                .sum()
        })
    })
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 {
        a.map(|x| x / length)
    } else {
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two blocks side by side, one twice as high: an L in section, of 3 cells of six tetrahedra.
    fn step() -> Mesh {
        const CELLS: [[u32; 3]; 3] = [[0, 0, 0], [1, 0, 0], [0, 0, 1]];
        const PATHS: [[usize; 3]; 6] = [
            [0, 1, 2],
            [1, 2, 0],
            [2, 0, 1],
            [0, 2, 1],
            [2, 1, 0],
            [1, 0, 2],
        ];
        let node = |at: [u32; 3]| at[0] + 3 * (at[1] + 2 * at[2]);
        let mut elements = Vec::new();
        for cell in CELLS {
            for (k, path) in PATHS.iter().enumerate() {
                let mut at = cell;
                let mut vertices = [node(at); 4];
                for (i, &axis) in path.iter().enumerate() {
                    at[axis] += 1;
                    vertices[i + 1] = node(at);
                }
                if k >= 3 {
                    vertices.swap(1, 2);
                }
                elements.extend(vertices);
            }
        }
        let nodes: Vec<[f64; 3]> = (0..18u32)
            .map(|i| [i % 3, i / 3 % 2, i / 6].map(f64::from))
            .collect();
        let tags = (1..=18).collect();
        Mesh::new(
            Order::Linear,
            nodes,
            tags,
            elements,
            (1..=18).collect(),
            vec![],
        )
    }

    #[test]
    fn the_one_inner_edge_of_a_step_turns_inwards() {
        let mesh = step();
        let faces = mesh.boundary_faces();
        let edges = edges(&mesh, &faces);
        let right = std::f64::consts::FRAC_PI_2;
        let inner: Vec<&SkinEdge> = edges.iter().filter(|e| e.turn > 1e-9).collect();
        assert_eq!(inner.len(), 1, "{inner:?}");
        assert!((inner[0].turn - right).abs() < 1e-12);
        for &n in &inner[0].nodes {
            let [x, _, z] = mesh.nodes[n as usize];
            assert!(x == 1.0 && z == 1.0);
        }
        let outer = edges.iter().filter(|e| e.turn < -1e-9);
        assert!(outer.clone().all(|e| (e.turn + right).abs() < 1e-12));
        // Of an L in section: 5 outer edges along y and 6 + 6 around its ends, those along two cells twice.
        assert_eq!(outer.count(), 5 + 2 * 8);
        for face in &faces {
            let n = normal(&mesh, face, [1.0 / 3.0; 3]);
            assert!((dot(n, n) - 1.0).abs() < 1e-12);
        }
    }
}

//! Volumes that meet without being one, and cracks: nodes at the same place that are not the same node, and
//! nodes of one piece on the faces of another.

use std::collections::HashMap;

use fem::Mesh;
use glam::{DVec3, I64Vec3};

use super::units::short;
use super::warning;
use crate::report::Warning;
use crate::session::part_extent;

/// Share of the part's diagonal within which two places are the same: coordinates are written with 6 to 16 digits.
const SAME_SHARE: f64 = 1e-6;
/// Nodes of one piece on the faces of another from which the two are said to meet: three span a plane.
const FEWEST_ON_FACES: usize = 3;

/// Nodes of the surface by their place.
struct Surface {
    /// Index in the mesh and place, m.
    nodes: Vec<(u32, DVec3)>,
    /// Corners of boundary faces by their nodes.
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    fn of(mesh: &Mesh) -> Self {
        let faces = mesh.boundary_faces();
        let mut nodes: Vec<u32> = faces.iter().flat_map(|f| f.nodes.iter().copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Self {
            nodes: nodes.into_iter().map(|n| (n, place(mesh, n))).collect(),
            triangles: faces
                .iter()
                .map(|f| std::array::from_fn(|i| f.nodes[i]))
                .collect(),
        }
    }
}

fn place(mesh: &Mesh, node: u32) -> DVec3 {
    DVec3::from_array(mesh.nodes[node as usize])
}

fn cell(x: DVec3, size: f64) -> I64Vec3 {
    (x / size).floor().as_i64vec3()
}

fn neighbours(at: I64Vec3) -> impl Iterator<Item = I64Vec3> {
    (0..27).map(move |k| at + I64Vec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1))
}

/// In mm.
fn at(x: DVec3) -> String {
    let mm = 1e3 * x;
    format!("({}, {}, {}) mm", short(mm.x), short(mm.y), short(mm.z))
}

const MEND: &str = "if they should hold together, make them one in the mesh program (in Gmsh: BooleanFragments or \
                    Coherence before meshing, or Mesh.Tools: remove duplicate nodes); a slit that is meant is right as \
                    it is, but its two sides do not press on each other";

/// Nodes that share their place with another.
pub(super) fn coincident(mesh: &Mesh) -> Option<Warning> {
    let same = SAME_SHARE * part_extent(mesh);
    let surface = Surface::of(mesh);
    let mut by_cell: HashMap<I64Vec3, Vec<usize>> = HashMap::with_capacity(surface.nodes.len());
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for (k, &(node, x)) in surface.nodes.iter().enumerate() {
        let here = cell(x, same);
        for other in neighbours(here).filter_map(|c| by_cell.get(&c)).flatten() {
            let (other, y) = surface.nodes[*other];
            if x.distance(y) <= same {
                pairs.push((other, node));
            }
        }
        by_cell.entry(here).or_default().push(k);
    }
    let &(first, _) = pairs.first()?;
    let (low, high) = pairs.iter().fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(low, high), &(_, node)| (low.min(place(mesh, node)), high.max(place(mesh, node))),
    );
    let what = if are_of_two_pieces(mesh, &pairs) {
        "volumes meet there without sharing nodes"
    } else {
        "the part is cut open there"
    };
    let n = pairs.len();
    let where_from = if n == 1 {
        at(place(mesh, first))
    } else {
        format!("from {} to {}", at(low), at(high))
    };
    Some(warning(
        "double-nodes",
        n as f64,
        format!(
            "{n} pair{} of nodes lie{} at the same place without being one node, {where_from}: {what}; {MEND}",
            if n == 1 { "" } else { "s" },
            if n == 1 { "s" } else { "" },
        ),
    ))
}

fn are_of_two_pieces(mesh: &Mesh, pairs: &[(u32, u32)]) -> bool {
    let of_node = pieces_of_nodes(mesh);
    pairs
        .iter()
        .any(|&(a, b)| of_node[a as usize] != of_node[b as usize])
}

fn pieces_of_nodes(mesh: &Mesh) -> Vec<u32> {
    let mut of_node = vec![u32::MAX; mesh.n_nodes()];
    for (element, piece) in mesh.pieces().into_iter().enumerate() {
        for &node in mesh.element_nodes(element) {
            of_node[node as usize] = piece;
        }
    }
    of_node
}

/// Nodes of one piece that lie on faces of another, where the two do not meet node by node.
pub(super) fn unmatched(mesh: &Mesh) -> Option<Warning> {
    let of_node = pieces_of_nodes(mesh);
    if of_node
        .iter()
        .all(|piece| *piece == 0 || *piece == u32::MAX)
    {
        return None;
    }
    let same = SAME_SHARE * part_extent(mesh);
    let surface = Surface::of(mesh);
    let corners = |t: &[u32; 3]| t.map(|n| place(mesh, n));
    let mean_side = surface
        .triangles
        .iter()
        .map(|t| {
            let [a, b, _] = corners(t);
            a.distance(b)
        })
        .sum::<f64>()
        / surface.triangles.len().max(1) as f64;
    let mut by_cell: HashMap<I64Vec3, Vec<usize>> = HashMap::new();
    for (k, triangle) in surface.triangles.iter().enumerate() {
        let [a, b, c] = corners(triangle);
        let low = cell(a.min(b).min(c) - same, mean_side);
        let high = cell(a.max(b).max(c) + same, mean_side);
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    by_cell.entry(I64Vec3::new(x, y, z)).or_default().push(k);
                }
            }
        }
    }
    let lies_on_another = |&&(node, x): &&(u32, DVec3)| {
        let near = by_cell.get(&cell(x, mean_side));
        near.into_iter().flatten().any(|&k| {
            let triangle = &surface.triangles[k];
            of_node[triangle[0] as usize] != of_node[node as usize]
                && corners(triangle).iter().all(|c| c.distance(x) > same)
                && lies_in(x, &corners(triangle), same)
        })
    };
    let on_faces: Vec<DVec3> = surface
        .nodes
        .iter()
        .filter(lies_on_another)
        .map(|(_, x)| *x)
        .collect();
    let n = on_faces.len();
    if n < FEWEST_ON_FACES {
        return None;
    }
    let low = on_faces.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = on_faces
        .iter()
        .copied()
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    Some(warning(
        "unmatched-faces",
        n as f64,
        format!(
            "{n} nodes of one volume lie on faces of another, from {} to {}: the volumes meet there without sharing \
             nodes; {MEND}",
            at(low),
            at(high),
        ),
    ))
}

/// Whether a point is in a triangle or on its rim.
fn lies_in(x: DVec3, [a, b, c]: &[DVec3; 3], same: f64) -> bool {
    let normal = (b - a).cross(c - a);
    let area = normal.length();
    if area <= 0.0 || (x - a).dot(normal).abs() > same * area {
        return false;
    }
    [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(p, q)| (**q - **p).cross(x - **p).dot(normal) >= -same * (**q - **p).length() * area)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fem::Order;

    /// Two unit cubes of six tetrahedra each, the second moved; nodes at the same place are one if `joined`.
    fn cubes(shift: DVec3, size: f64, joined: bool) -> Mesh {
        let mut nodes: Vec<[f64; 3]> = Vec::new();
        let mut elements = Vec::new();
        for (origin, side) in [(DVec3::ZERO, 1.0), (shift, size)] {
            let index: Vec<u32> = (0..8)
                .map(|k| {
                    let corner =
                        DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
                    let x = (1e-2 * (origin + side * corner)).to_array();
                    let known = nodes.iter().position(|y| *y == x).filter(|_| joined);
                    known.unwrap_or_else(|| {
                        nodes.push(x);
                        nodes.len() - 1
                    }) as u32
                })
                .collect();
            for path in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                elements.extend([0, path[0], path[1], 7].map(|k: usize| index[k]));
            }
        }
        let n = nodes.len() as u64;
        let n_elements = elements.len() / 4;
        Mesh::new(
            Order::Linear,
            nodes,
            (1..=n).collect(),
            elements,
            (1..=n_elements as u64).collect(),
            vec![],
        )
    }

    #[test]
    fn cubes_that_share_nodes_are_one_and_cubes_that_only_meet_are_told_with_number_and_place() {
        let beside = DVec3::new(1.0, 0.0, 0.0);
        assert_eq!(coincident(&cubes(beside, 1.0, true)), None);
        let told = coincident(&cubes(beside, 1.0, false)).unwrap();
        assert_eq!(told.number, Some(4.0));
        assert!(
            told.text
                .contains("from (10.0, 0.0000, 0.0000) mm to (10.0, 10.0, 10.0) mm"),
            "{}",
            told.text
        );
        assert!(told.text.contains("volumes meet"), "{}", told.text);
        assert_eq!(unmatched(&cubes(beside, 1.0, false)), None, "told once");
    }

    #[test]
    fn the_limit_is_a_millionth_of_the_part() {
        let apart = |gap: f64| coincident(&cubes(DVec3::new(1.0 + gap, 0.0, 0.0), 1.0, false));
        assert!(apart(1e-6).is_some());
        assert_eq!(apart(1e-5), None);
    }

    #[test]
    fn faces_that_meet_with_other_nodes_are_told_and_apart_they_are_not() {
        let meets = |x: f64| unmatched(&cubes(DVec3::new(x, 0.2, 0.3), 0.5, false));
        let told = meets(1.0).unwrap();
        assert_eq!(told.number, Some(4.0));
        assert_eq!(meets(1.001), None);
        assert_eq!(
            unmatched(&cubes(DVec3::new(1.0, 0.0, 0.0), 1.0, true)),
            None
        );
    }
}

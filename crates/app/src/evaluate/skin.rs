//! Places of the skin where strain has no limit as the mesh is refined: borders of held regions, inner edges.

use std::f64::consts::{FRAC_PI_2, PI};

use fem::skin::{SkinEdge, edges, normal};
use fem::{Face, Mesh, Supports};

/// Turn of the skin from which an inner edge is sharp, rad (40 degrees): strain grows as r^-0.3 towards it (Williams 1952).
/// A fillet of a right angle in three flat pieces turns by 30 degrees at most; curved elements have no turn there.
const SHARP: f64 = 40.0 * PI / 180.0;

/// How far from a right angle a free face may meet a plane of symmetry before their edge counts as an inner one, rad.
const SQUARE: f64 = 0.2;

/// How a face is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    Free,
    /// Along its normal only, which is an axis: a plane of symmetry.
    Mirror,
    Held,
}

/// Marks by node.
#[derive(Debug)]
pub(super) struct Marks {
    /// Within an element of the border of a held region.
    pub(super) held: Vec<bool>,
    /// Within an element of a sharp inner edge.
    pub(super) inner: Vec<bool>,
}

impl Marks {
    pub(super) fn of(mesh: &Mesh, supports: &Supports, faces: &[Face]) -> Self {
        let holds: Vec<Hold> = faces.iter().map(|f| hold(mesh, supports, f)).collect();
        let (mut held, mut inner) = (vec![false; mesh.n_nodes()], vec![false; mesh.n_nodes()]);
        for edge in edges(mesh, faces) {
            if is_border(&edge, &holds) {
                edge.nodes.iter().for_each(|&n| held[n as usize] = true);
            } else if is_inner(&edge, &holds) {
                edge.nodes.iter().for_each(|&n| inner[n as usize] = true);
            }
        }
        // Points and lines that are held by themselves.
        let mut is_on_held = vec![false; mesh.n_nodes()];
        for (face, _) in faces.iter().zip(&holds).filter(|(_, h)| **h != Hold::Free) {
            face.nodes
                .iter()
                .for_each(|&n| is_on_held[n as usize] = true);
        }
        for &node in faces.iter().flat_map(|f| &f.nodes) {
            let node = node as usize;
            held[node] |= !is_on_held[node] && (0..3).any(|c| supports.is_fixed(3 * node + c));
        }
        Self {
            held: widened(faces, &held),
            inner: widened(faces, &inner),
        }
    }
}

/// Nodes of all faces that have a marked node.
pub(super) fn widened(faces: &[Face], marks: &[bool]) -> Vec<bool> {
    let mut wider = marks.to_vec();
    for face in faces {
        if face.nodes.iter().any(|&n| marks[n as usize]) {
            face.nodes.iter().for_each(|&n| wider[n as usize] = true);
        }
    }
    wider
}

fn hold(mesh: &Mesh, supports: &Supports, face: &Face) -> Hold {
    let is_held = |c: usize| {
        face.nodes
            .iter()
            .all(|&n| supports.is_fixed(3 * n as usize + c))
    };
    let components: Vec<usize> = (0..3).filter(|&c| is_held(c)).collect();
    match components[..] {
        [] => Hold::Free,
        [c] if normal(mesh, face, [1.0 / 3.0; 3])[c].abs() > 0.999 => Hold::Mirror,
        _ => Hold::Held,
    }
}

fn is_border(edge: &SkinEdge, holds: &[Hold]) -> bool {
    match edge.faces.map(|f| holds[f as usize]) {
        [Hold::Free, Hold::Held] | [Hold::Held, Hold::Free] => true,
        // The mirrored body has twice the angle between the two.
        [Hold::Free, Hold::Mirror] | [Hold::Mirror, Hold::Free] => edge.turn > SQUARE - FRAC_PI_2,
        _ => false,
    }
}

fn is_inner(edge: &SkinEdge, holds: &[Hold]) -> bool {
    edge.turn > SHARP && edge.faces.iter().all(|&f| holds[f as usize] == Hold::Free)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fem::Order;

    /// The unit cube in six tetrahedra, its vertices numbered x + 2 y + 4 z.
    fn cube() -> Mesh {
        let nodes = (0..8u32).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from));
        let elements = [
            [0, 1, 3, 7],
            [0, 2, 6, 7],
            [0, 4, 5, 7],
            [0, 3, 2, 7],
            [0, 6, 4, 7],
            [0, 5, 1, 7],
        ];
        Mesh::new(
            Order::Linear,
            nodes.collect(),
            (1..=8).collect(),
            elements.concat(),
            (1..=6).collect(),
            vec![],
        )
    }

    fn held(components: [bool; 3]) -> usize {
        let mesh = cube();
        let mut supports = Supports::new(8);
        for node in [0, 2, 4, 6] {
            supports.fix_node(node, components);
        }
        let marks = Marks::of(&mesh, &supports, &mesh.boundary_faces());
        assert!(marks.inner.iter().all(|m| !m));
        marks.held.iter().filter(|m| **m).count()
    }

    #[test]
    fn a_clamped_face_has_a_border_and_a_plane_of_symmetry_has_none() {
        assert_eq!(held([true, false, false]), 0);
        assert_eq!(held([true; 3]), 8);
        assert_eq!(held([false, true, false]), 8);
        assert_eq!(held([false; 3]), 0);
    }

    /// A line of nodes that is held by itself strains without bound too.
    #[test]
    fn a_held_line_is_a_border() {
        let mesh = cube();
        let mut supports = Supports::new(8);
        supports.fix_node(1, [true; 3]);
        supports.fix_node(3, [true; 3]);
        let marks = Marks::of(&mesh, &supports, &mesh.boundary_faces());
        assert!(marks.held[1] && marks.held[3]);
        assert!(!marks.held[4]);
    }

    /// A free face level with a plane of symmetry: mirrored, the body is hollow there.
    #[test]
    fn a_plane_of_symmetry_that_ends_in_the_middle_of_a_face_has_a_border() {
        let mesh = cube();
        let mut supports = Supports::new(8);
        // Half of the face x = 0, which is two triangles.
        for node in [0, 2, 6] {
            supports.fix_node(node, [true, false, false]);
        }
        let marks = Marks::of(&mesh, &supports, &mesh.boundary_faces());
        assert!(marks.held[0] && marks.held[6]);
    }
}

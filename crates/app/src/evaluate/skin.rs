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

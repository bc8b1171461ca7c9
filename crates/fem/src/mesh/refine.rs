//! Uniform refinement: each tetrahedron into eight.

use super::Mesh;
use super::lattice::{Lattice, face_weights, weights};
use crate::Error;

/// Corners of a child by the weights of the parent's vertices, in halves.
pub(super) type Child = [[u8; 4]; 4];

/// Mid points of opposite edges: the three diagonals of the inner octahedron.
pub(super) const DIAGONALS: [[[u8; 4]; 2]; 3] = [
    [[1, 1, 0, 0], [0, 0, 1, 1]],
    [[1, 0, 1, 0], [0, 1, 0, 1]],
    [[1, 0, 0, 1], [0, 1, 1, 0]],
];

/// Two diagonals count as equally long below this relative difference of their squares, and the
/// first is taken: round-off (1e-15) must not decide, so that a moved mesh is cut alike.
const TIE: f64 = 1e-9;

impl Mesh {
    /// Each element divided into eight of the same order, on the parent's map: the shape is kept
    /// exactly, curved or straight.
    ///
    /// Four children stand in the parent's corners; the octahedron that is left is cut along the
    /// shortest of its three diagonals, which no other element sees. The children of element e are
    /// 8 e to 8 e + 7 (so `material_of_element` repeats each entry eight times), tags from 1.
    ///
    /// All nodes of elements stay, in their sequence and with their tags, and come first; new
    /// nodes have tags from the largest tag + 1. So a node of this mesh is found in the new one by
    /// [`Mesh::node_of_tag`]. Nodes of no element are left out. Each face of a group becomes four.
    ///
    /// ```text
    ///        2
    ///       / \          a face: corners first, then the middle one,
    ///     02---12        all with the parent's sense of turning
    ///     / \ / \
    ///    0---01--1
    /// ```
    ///
    /// # Errors
    /// [`Error::Inverted`] if an element is not valid, [`Error::NotConforming`],
    /// [`Error::FaceOfNoElement`].
    pub fn refined(&self) -> Result<Self, Error> {
        self.check_elements()?;
        let mut lattice = Lattice::new(self, 2 * self.order as u8)?;
        let node_weights = weights(self.order);
        let by_diagonal: Vec<Vec<[u8; 4]>> = DIAGONALS
            .iter()
            .map(|diagonal| {
                children(diagonal)
                    .iter()
                    .flat_map(|child| node_weights.iter().map(|w| combine(w, child)))
                    .collect()
            })
            .collect();
        let mut elements = Vec::with_capacity(8 * self.elements.len());
        for e in 0..self.n_elements() {
            let places = &by_diagonal[self.shortest_diagonal(e)];
            elements.extend(places.iter().map(|place| lattice.node(e, place)));
        }
        let faces: Vec<Vec<[u8; 3]>> = FACE_CHILDREN
            .iter()
            .map(|child| {
                face_weights(self.order)
                    .iter()
                    .map(|w| combine(w, child))
                    .collect()
            })
            .collect();
        let tags = (1..=8 * self.n_elements() as u64).collect();
        lattice.into_mesh(self.order, elements, tags, &faces, 8)
    }

    fn shortest_diagonal(&self, element: usize) -> usize {
        let squares = DIAGONALS.map(|ends| {
            let [a, b] = ends.map(|w| self.point(element, w.map(|x| 0.5 * f64::from(x))));
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>()
        });
        let mut shortest = 0;
        for k in 1..3 {
            if squares[k] < squares[shortest] * (1.0 - TIE) {
                shortest = k;
            }
        }
        shortest
    }
}

/// Corners of the four faces that take the place of one, in halves.
const FACE_CHILDREN: [[[u8; 3]; 3]; 4] = [
    [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
    [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
    [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
    [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
];

/// The four corners' children, then the four around this diagonal of the octahedron, all turned
/// as the parent.
pub(super) fn children(diagonal: &[[u8; 4]; 2]) -> Vec<Child> {
    let mut children: Vec<Child> = (0..4)
        .map(|corner| {
            std::array::from_fn(|v| {
                let mut w = [0; 4];
                w[corner] += 1;
                w[v] += 1;
                w
            })
        })
        .collect();
    // The other two diagonals end at the corners of a quadrilateral around this one.
    let others: Vec<[[u8; 4]; 2]> = DIAGONALS
        .iter()
        .filter(|d| *d != diagonal)
        .copied()
        .collect();
    let around = [others[0][0], others[1][0], others[0][1], others[1][1]];
    for k in 0..4 {
        let mut child = [diagonal[0], diagonal[1], around[k], around[(k + 1) % 4]];
        if determinant_sign(&child) < 0 {
            child.swap(2, 3);
        }
        children.push(child);
    }
    children
}

/// Sign of the volume of a child in the parent's barycentric coordinates.
fn determinant_sign(child: &Child) -> i32 {
    let j: [[i32; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|k| i32::from(child[k + 1][i + 1]) - i32::from(child[0][i + 1]))
    });
    let det = j[0][0] * (j[1][1] * j[2][2] - j[1][2] * j[2][1])
        - j[0][1] * (j[1][0] * j[2][2] - j[1][2] * j[2][0])
        + j[0][2] * (j[1][0] * j[2][1] - j[1][1] * j[2][0]);
    det.signum()
}

/// Weights of the parent's vertices at the place with these weights of a child's corners.
fn combine<const N: usize>(weights: &[u8; N], corners: &[[u8; N]; N]) -> [u8; N] {
    std::array::from_fn(|v| (0..N).map(|c| weights[c] * corners[c][v]).sum())
}

//! Quadratic tetrahedron: `N_a = L_a (2 L_a - 1)`, `N_ab = 4 L_a L_b`.
//!
//! ```text
//!            3                         edges of the mid nodes
//!           /|\                         4: 01   5: 12   6: 02
//!          / | \                        7: 03   8: 23   9: 13
//!         7  |  8
//!        /   9   \                     Gmsh's order; Abaqus and CalculiX swap 8 and 9
//!       /    |    \
//!      0-- 6 |-----2
//!        \   |   /
//!         4  |  5
//!           \|/
//!            1
//! ```

use super::MAX_NODES;

/// Edges of nodes 4 to 9.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];

/// Barycentric coordinates of the nodes.
pub(super) fn nodes() -> Vec<[f64; 4]> {
    let mut nodes = super::vertices();
    nodes.extend(EDGES.map(|e| super::between(&[(e[0], 0.5), (e[1], 0.5)])));
    nodes
}

/// Values and derivatives by L_1..L_4; `derivatives` is zero before.
pub(super) fn shape(
    l: [f64; 4],
    values: &mut [f64; MAX_NODES],
    derivatives: &mut [[f64; 4]; MAX_NODES],
) {
    for v in 0..4 {
        values[v] = l[v] * (2.0 * l[v] - 1.0);
        derivatives[v][v] = 4.0 * l[v] - 1.0;
    }
    for (e, [a, b]) in EDGES.into_iter().enumerate() {
        values[4 + e] = 4.0 * l[a] * l[b];
        derivatives[4 + e][a] = 4.0 * l[b];
        derivatives[4 + e][b] = 4.0 * l[a];
    }
}

//! Cubic tetrahedron: `N_a = L_a (3 L_a - 1)(3 L_a - 2) / 2`; on an edge, at the node nearer to a,
//! `9/2 L_a L_b (3 L_a - 1)`; in the middle of a face `27 L_a L_b L_c`.
//!
//! ```text
//!            3                         edges of the nodes, in the direction written
//!           /|\                         4  5: 01     6  7: 12     8  9: 20
//!         10 | 12                      10 11: 30    12 13: 32    14 15: 31
//!         /  14 \
//!        11  |  13                     faces of the nodes
//!       /    |    \                    16: 012   17: 013   18: 023   19: 123
//!      0--9 -|- 8--2
//!        4   15  7                     Gmsh's order
//!         \  |  /
//!          5 | 6
//!           \|/
//!            1
//! ```

use super::MAX_NODES;

/// Edges of nodes 4 and 5, 6 and 7, ... 14 and 15; the first node is nearer to the first vertex.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]];

/// Faces of nodes 16 to 19.
pub(super) const FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];

/// Barycentric coordinates of the nodes.
pub(super) fn nodes() -> Vec<[f64; 4]> {
    let (near, far) = (2.0 / 3.0, 1.0 / 3.0);
    let mut nodes = super::vertices();
    for [a, b] in EDGES {
        nodes.push(super::between(&[(a, near), (b, far)]));
        nodes.push(super::between(&[(a, far), (b, near)]));
    }
    nodes.extend(FACES.map(|f| super::between(&f.map(|v| (v, far)))));
    nodes
}

/// Values and derivatives by L_1..L_4; `derivatives` is zero before.
pub(super) fn shape(
    l: [f64; 4],
    values: &mut [f64; MAX_NODES],
    derivatives: &mut [[f64; 4]; MAX_NODES],
) {
    for v in 0..4 {
        let x = l[v];
        values[v] = 0.5 * x * (3.0 * x - 1.0) * (3.0 * x - 2.0);
        derivatives[v][v] = 13.5 * x * x - 9.0 * x + 1.0;
    }
    for (e, [a, b]) in EDGES.into_iter().enumerate() {
        for (k, (near, far)) in [(a, b), (b, a)].into_iter().enumerate() {
            let node = 4 + 2 * e + k;
            values[node] = 4.5 * l[near] * l[far] * (3.0 * l[near] - 1.0);
            derivatives[node][near] = 4.5 * l[far] * (6.0 * l[near] - 1.0);
            derivatives[node][far] = 4.5 * l[near] * (3.0 * l[near] - 1.0);
        }
    }
    for (f, [a, b, c]) in FACES.into_iter().enumerate() {
        let node = 16 + f;
        values[node] = 27.0 * l[a] * l[b] * l[c];
        derivatives[node][a] = 27.0 * l[b] * l[c];
        derivatives[node][b] = 27.0 * l[a] * l[c];
        derivatives[node][c] = 27.0 * l[a] * l[b];
    }
}

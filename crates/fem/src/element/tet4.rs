//! Linear tetrahedron: `N_a = L_a`.
//!
//! ```text
//!            3
//!           /|\
//!          / | \            faces: opposite to each vertex
//!         /  |  \           edges: no nodes
//!        0---|---2
//!         \  |  /
//!          \ | /
//!            1
//! ```

use super::MAX_NODES;

/// Values and derivatives by L_1..L_4; `derivatives` is zero before.
pub(super) fn shape(
    l: [f64; 4],
    values: &mut [f64; MAX_NODES],
    derivatives: &mut [[f64; 4]; MAX_NODES],
) {
    for v in 0..4 {
        values[v] = l[v];
        derivatives[v][v] = 1.0;
    }
}

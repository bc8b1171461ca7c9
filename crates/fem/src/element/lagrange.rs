//! Tetrahedra of any order n on the regular lattice: a node has whole numbers a_1 + a_2 + a_3 + a_4 = n, lies at a_k / n, and
//!
//! ```text
//! N = P_a1(L_1) P_a2(L_2) P_a3(L_3) P_a4(L_4)     P_a(x) = Π_{m<a} (n x - m) / (m + 1)
//! ```
//! (Silvester 1969). Nodes: vertices, edges in the order of tet20 from the first vertex on, faces, inside. No mesh file is
//! read with such elements, so that the order within faces is our own.

use std::sync::OnceLock;

use super::tet20::{EDGES, FACES};
use super::{MAX_NODES, Order};

/// Whole numbers of the nodes.
pub(super) fn places(order: Order) -> &'static [[u8; 4]] {
    static PLACES: [OnceLock<Vec<[u8; 4]>>; Order::HIGHEST as usize + 1] =
        [const { OnceLock::new() }; Order::HIGHEST as usize + 1];
    PLACES[order as usize].get_or_init(|| {
        let n = order as u8;
        let mut places = Vec::with_capacity(order.nodes_per_element());
        let at = |weights: &[(usize, u8)]| {
            let mut place = [0; 4];
            for &(vertex, weight) in weights {
                place[vertex] = weight;
            }
            place
        };
        places.extend((0..4).map(|v| at(&[(v, n)])));
        for [a, b] in EDGES {
            places.extend((1..n).map(|k| at(&[(a, n - k), (b, k)])));
        }
        for [a, b, c] in FACES {
            for j in 1..n {
                places.extend((1..n - j).map(|k| at(&[(a, n - j - k), (b, j), (c, k)])));
            }
        }
        for i in 1..n {
            for j in 1..n - i {
                places.extend((1..n - i - j).map(|k| [n - i - j - k, i, j, k]));
            }
        }
        places
    })
}

/// Values and derivatives by L_1..L_4; `derivatives` is zero before.
pub(super) fn shape(
    order: Order,
    l: [f64; 4],
    values: &mut [f64; MAX_NODES],
    derivatives: &mut [[f64; 4]; MAX_NODES],
) {
    // P_a and its derivative for each coordinate and a.
    let table = l.map(|x| polynomials(order as u8, x));
    for (i, place) in places(order).iter().enumerate() {
        let factor = |k: usize| table[k][usize::from(place[k])];
        values[i] = (0..4).map(|k| factor(k).0).product();
        for k in 0..4 {
            let others = (0..4).filter(|m| *m != k).map(|m| factor(m).0);
            derivatives[i][k] = factor(k).1 * others.product::<f64>();
        }
    }
}

/// P_0 to P_n and their derivatives at a coordinate.
fn polynomials(n: u8, x: f64) -> [(f64, f64); Order::HIGHEST as usize + 1] {
    let mut all = [(1.0, 0.0); Order::HIGHEST as usize + 1];
    for m in 0..usize::from(n) {
        let (value, slope) = all[m];
        let (n, m_f) = (f64::from(n), m as f64);
        let factor = (n * x - m_f) / (m_f + 1.0);
        all[m + 1] = (value * factor, slope * factor + value * n / (m_f + 1.0));
    }
    all
}

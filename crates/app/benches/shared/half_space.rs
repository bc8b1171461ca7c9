//! An elastic half-space (silicone, 5 MPa) with a square grid of nodes that can all touch.
//!
//! Displacements by Boussinesq and Cerruti: Johnson, Contact Mechanics, 3.2 and 3.6.

use std::sync::Arc;

use glam::DVec3;
use snapin::engine::ContactPart;
use snapin::stored::{Blocks, Source};

/// m, of a cell.
pub(crate) const CELL: f64 = 1e-3;

const YOUNG_MODULUS: f64 = 5e6;

const NU: f64 = 0.45;

/// side x side nodes, every column.
pub(crate) fn half_space(side: usize) -> Arc<ContactPart> {
    let rest = grid(side);
    let n = rest.len();
    let blocks = (0..n).flat_map(|j| column(&rest, j)).collect();
    Arc::new(ContactPart::new(rest, n, blocks))
}

/// side x side nodes, columns of those nearer to the middle than `reach` (m) along both sides.
pub(crate) fn half_space_near(side: usize, reach: f64) -> Arc<ContactPart> {
    let rest = grid(side);
    let part = ContactPart::with_fetched(rest.clone(), rest.len());
    for (j, x) in rest.iter().enumerate() {
        if x.abs().max_element() < reach {
            let column = column(&rest, j).collect();
            part.insert(j as u32, Blocks::F64(Source::Owned(column)));
        }
    }
    Arc::new(part)
}

fn grid(side: usize) -> Vec<DVec3> {
    let middle = 0.5 * (side as f64 - 1.0);
    (0..side * side)
        .map(|k| CELL * DVec3::new((k % side) as f64 - middle, (k / side) as f64 - middle, 0.0))
        .collect()
}

/// Displacement of every node per unit force on node j, m/N, blocks column-major.
fn column(rest: &[DVec3], j: usize) -> impl Iterator<Item = f64> {
    let at = rest[j];
    rest.iter().flat_map(move |x| block(*x - at))
}

/// At `d` from the force, m/N: displacement under a force in x, in y, in z.
fn block(d: DVec3) -> [f64; 9] {
    let scale = (1.0 + NU) / (std::f64::consts::PI * YOUNG_MODULUS);
    let r = d.length();
    if r == 0.0 {
        // Means over the node's square: of 1/r 3.5255 / CELL, of x²/r² a half.
        let mean = 3.5255 / CELL * scale;
        let (along, normal) = (mean * (1.0 - 0.5 * NU), mean * (1.0 - NU));
        return [along, 0.0, 0.0, 0.0, along, 0.0, 0.0, 0.0, normal];
    }
    let (x, y) = (d.x / r, d.y / r);
    let (shear, skew) = (NU * x * y, 0.5 * (1.0 - 2.0 * NU));
    [
        1.0 - NU + NU * x * x,
        shear,
        skew * x,
        shear,
        1.0 - NU + NU * y * y,
        skew * y,
        -skew * x,
        -skew * y,
        1.0 - NU,
    ]
    .map(|c| c * scale / r)
}

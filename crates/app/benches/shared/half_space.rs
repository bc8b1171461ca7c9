//! An elastic half-space as a part, for benches.

use std::sync::Arc;

use glam::DVec3;
use snapin::engine::ContactPart;

/// m, of a cell.
pub(crate) const CELL: f64 = 1e-3;

/// An elastic half-space (silicone, 5 MPa) with side x side nodes.
pub(crate) fn half_space(side: usize) -> Arc<ContactPart> {
    const YOUNG_MODULUS: f64 = 5e6;
    const NU: f64 = 0.45;
    let middle = 0.5 * (side as f64 - 1.0);
    let rest: Vec<DVec3> = (0..side * side)
        .map(|k| CELL * DVec3::new((k % side) as f64 - middle, (k / side) as f64 - middle, 0.0))
        .collect();
    let scale = (1.0 + NU) / (std::f64::consts::PI * YOUNG_MODULUS);
    let mut blocks = vec![0.0; 9 * rest.len() * rest.len()];
    for (block, k) in blocks.chunks_exact_mut(9).zip(0..) {
        let d = rest[k % rest.len()] - rest[k / rest.len()];
        let r = d.length();
        let entries = if r == 0.0 {
            // Means over the node's square: of 1/r 3.5255 / CELL, of x²/r² a half.
            let mean = 3.5255 / CELL * scale;
            let (along, normal) = (mean * (1.0 - 0.5 * NU), mean * (1.0 - NU));
            [along, 0.0, 0.0, 0.0, along, 0.0, 0.0, 0.0, normal]
        } else {
            let (x, y, s) = (d.x / r, d.y / r, scale / r);
            let (shear, skew) = (NU * x * y, 0.5 * (1.0 - 2.0 * NU));
            // Columns: displacement under a force in x, in y, in z.
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
            .map(|c| c * s)
        };
        block.copy_from_slice(&entries);
    }
    Arc::new(ContactPart::new(rest.clone(), rest.len(), blocks))
}

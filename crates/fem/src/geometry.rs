//! Map of an element: Jacobian, its determinant and inverse.

use crate::element::MAX_NODES;

/// J[i][k] = dx_i / dr_k with r = (L_2, L_3, L_4), from derivatives by L_1..L_4.
pub(crate) fn jacobian(derivatives: &[[f64; 4]], x: &[[f64; 3]; MAX_NODES]) -> [[f64; 3]; 3] {
    let mut j = [[0.0; 3]; 3];
    for (d, x) in derivatives.iter().zip(x) {
        for k in 0..3 {
            let dr = d[k + 1] - d[0];
            for i in 0..3 {
                j[i][k] += x[i] * dr;
            }
        }
    }
    j
}

pub(crate) fn determinant(j: &[[f64; 3]; 3]) -> f64 {
    j[0][0] * (j[1][1] * j[2][2] - j[1][2] * j[2][1])
        - j[0][1] * (j[1][0] * j[2][2] - j[1][2] * j[2][0])
        + j[0][2] * (j[1][0] * j[2][1] - j[1][1] * j[2][0])
}

/// Inverse, dr_k / dx_i at [k][i].
pub(crate) fn inverse(j: &[[f64; 3]; 3], det: f64) -> [[f64; 3]; 3] {
    let mut inv = [[0.0; 3]; 3];
    for k in 0..3 {
        for i in 0..3 {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            let (c, d) = ((k + 1) % 3, (k + 2) % 3);
            inv[k][i] = (j[a][c] * j[b][d] - j[a][d] * j[b][c]) / det;
        }
    }
    inv
}

/// Gradients of the shape functions by x and det J.
pub(crate) fn gradients(
    derivatives: &[[f64; 4]],
    x: &[[f64; 3]; MAX_NODES],
    gradient: &mut [[f64; 3]; MAX_NODES],
) -> f64 {
    let j = jacobian(derivatives, x);
    let det = determinant(&j);
    let inv = inverse(&j, det);
    for (g, d) in gradient.iter_mut().zip(derivatives) {
        let dr = [d[1] - d[0], d[2] - d[0], d[3] - d[0]];
        for i in 0..3 {
            g[i] = dr[0] * inv[0][i] + dr[1] * inv[1][i] + dr[2] * inv[2][i];
        }
    }
    det
}

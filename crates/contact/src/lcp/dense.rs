//! The few dense loops that all methods share. Order of summation is fixed: equal input, equal bits.

use super::Problem;

/// w = q + M z, column by column, skipping the zeros of z.
pub(crate) fn gaps_into(problem: &Problem, z: &[f64], w: &mut [f64]) {
    w.copy_from_slice(problem.q());
    // Eight columns at a time: one load and store of w for eight products.
    let mut columns = [(0.0, 0_usize); 8];
    let mut n = 0;
    for (j, &z) in z.iter().enumerate() {
        if z != 0.0 {
            columns[n] = (z, j);
            n += 1;
            if n == 8 {
                add_eight(problem, &columns, w);
                n = 0;
            }
        }
    }
    for &(z, j) in &columns[..n] {
        add_scaled(w, z, problem.column(j));
    }
}

fn add_eight(problem: &Problem, columns: &[(f64, usize); 8], w: &mut [f64]) {
    let m = w.len();
    let [a, b, c, d, e, f, g, h] = columns.map(|(_, j)| &problem.column(j)[..m]);
    let z = columns.map(|(z, _)| z);
    for (i, w) in w.iter_mut().enumerate() {
        let left = (a[i] * z[0] + b[i] * z[1]) + (c[i] * z[2] + d[i] * z[3]);
        let right = (e[i] * z[4] + f[i] * z[5]) + (g[i] * z[6] + h[i] * z[7]);
        *w += left + right;
    }
}

/// y += a x.
pub(super) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// xᵀ y with eight partial sums, so that it is vectorised.
pub(super) fn dot(x: &[f64], y: &[f64]) -> f64 {
    let (x_chunks, x_rest) = x.as_chunks::<8>();
    let (y_chunks, y_rest) = y.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (x, y) in x_chunks.iter().zip(y_chunks) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest: f64 = x_rest.iter().zip(y_rest).map(|(&x, &y)| x * y).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (b + f)) + ((c + g) + (d + h)) + rest
}

/// Largest absolute value, 0 for an empty slice. In lanes, so that it is vectorised.
pub(super) fn max_abs(values: &[f64]) -> f64 {
    let larger = |max: f64, x: f64| {
        let x = x.abs();
        if x > max { x } else { max }
    };
    let mut lanes = [0.0; 8];
    let (chunks, rest) = values.as_chunks::<8>();
    for chunk in chunks {
        for (lane, &x) in lanes.iter_mut().zip(chunk) {
            *lane = larger(*lane, x);
        }
    }
    lanes.iter().chain(rest).fold(0.0, |max, &x| larger(max, x))
}

/// x ← L⁻¹ x for the leading `n` rows of a unit lower triangle, column-major with leading dimension `ld`.
pub(super) fn solve_unit_lower(l: &[f64], ld: usize, n: usize, x: &mut [f64]) {
    let x = &mut x[..n];
    let mut p = 0;
    // Four columns at a time: a small triangle, then their product with the rest.
    while p + 4 <= n {
        let column = |k: usize| &l[(p + k) * ld..(p + k) * ld + n];
        let (a, b, c, d) = (column(0), column(1), column(2), column(3));
        let x0 = x[p];
        let x1 = x[p + 1] - a[p + 1] * x0;
        let x2 = x[p + 2] - (a[p + 2] * x0 + b[p + 2] * x1);
        let x3 = x[p + 3] - (a[p + 3] * x0 + b[p + 3] * x1 + c[p + 3] * x2);
        (x[p + 1], x[p + 2], x[p + 3]) = (x1, x2, x3);
        let rest = p + 4;
        let tails = a[rest..]
            .iter()
            .zip(&b[rest..])
            .zip(&c[rest..])
            .zip(&d[rest..]);
        for (x, (((&a, &b), &c), &d)) in x[rest..].iter_mut().zip(tails) {
            *x -= (a * x0 + b * x1) + (c * x2 + d * x3);
        }
        p = rest;
    }
    for p in p..n {
        let x_p = x[p];
        for i in p + 1..n {
            x[i] -= l[p * ld + i] * x_p;
        }
    }
}

/// x ← L⁻ᵀ x, as [`solve_unit_lower`].
pub(super) fn solve_unit_lower_transposed(l: &[f64], ld: usize, n: usize, x: &mut [f64]) {
    for p in (0..n).rev() {
        let column = &l[p * ld..p * ld + n];
        let below = dot(&column[p + 1..], &x[p + 1..n]);
        x[p] -= below;
    }
}

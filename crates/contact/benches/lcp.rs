//! Time of one complementarity problem, beside dense Cholesky factors of the same matrix.
//!
//! Measures: a rigid sphere pressed into an elastic half-space with a grid of m nodes
//! (`W_ij = (1 - ν²) / (π E r_ij)`, Boussinesq; the node's own share by its square, Love 1929), about a
//! tenth to a third of them in contact. Cold: no warm start. Warm: from the contacts of the step before, the
//! sphere moved by a twentieth of a cell. Floor: Cholesky of the rows in contact, which any exact method
//! must solve with. `cargo bench -p snapin-contact --bench lcp` runs it on one core.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::time::Instant;

use contact::lcp::{Problem, Scratch, Settings, Solution, Start, solve};
use faer::{Mat, Par, Side};

/// m, of a cell.
const CELL: f64 = 1e-3;

/// Each time is the median of as many runs as fit into this, s.
const BUDGET_S: f64 = 0.25;

struct Pressed {
    side: usize,
    matrix: Vec<f64>,
}

impl Pressed {
    fn new(side: usize) -> Self {
        let m = side * side;
        let at = |k: usize| [(k % side) as f64 * CELL, (k / side) as f64 * CELL];
        let elastic = (1.0 - 0.35f64.powi(2)) / 2.7e9;
        let matrix = (0..m * m)
            .map(|k| {
                let (a, b) = (at(k % m), at(k / m));
                let r = ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
                if r == 0.0 {
                    // Mean pressure on the node's square, at its centre: 4 ln(1 + sqrt 2) / π.
                    1.1222 * elastic / CELL
                } else {
                    elastic / (std::f64::consts::PI * r)
                }
            })
            .collect();
        Self { side, matrix }
    }

    /// Gaps to a sphere of 0.1 m that is pressed in so that about a quarter of the grid's width is
    /// below it, its centre shifted by `shift` cells.
    fn gaps(&self, shift: f64) -> Vec<f64> {
        let middle = 0.5 * (self.side as f64 - 1.0) * CELL;
        let reach = 0.3 * self.side as f64 * CELL;
        let depth = reach * reach / 0.1;
        (0..self.side * self.side)
            .map(|k| {
                let x = (k % self.side) as f64 * CELL - middle - shift * CELL;
                let y = (k / self.side) as f64 * CELL - middle;
                (x * x + y * y) / 0.2 - depth
            })
            .collect()
    }
}

fn main() {
    println!("microseconds, medians; ratios to the Cholesky factor of all rows\n");
    println!(
        "{:>5}{:>8}{:>11}{:>9}{:>11}{:>9}{:>11}{:>9}{:>9}{:>10}{:>13}",
        "m",
        "active",
        "all rows",
        "floor",
        "cold",
        "ratio",
        "warm",
        "ratio",
        "rounds",
        "(warm)",
        "certificate"
    );
    for side in [2, 4, 7, 10, 16, 21, 32] {
        row(side);
    }
}

fn row(side: usize) {
    let pressed = Pressed::new(side);
    let m = side * side;
    let (before, now) = (pressed.gaps(0.0), pressed.gaps(0.05));
    let settings = Settings::default();
    let mut scratch = Scratch::new(m);
    let (mut z, mut w) = (vec![0.0; m], vec![0.0; m]);
    let mut run = |q: &[f64], warm: Option<&[bool]>, z: &mut [f64]| -> Solution {
        let problem = Problem::trusted_symmetric(&pressed.matrix, q).unwrap();
        solve(
            &problem,
            &settings,
            &mut scratch,
            warm.map_or(Start::Cold, Start::Rows),
            z,
            &mut w,
        )
        .unwrap()
    };
    run(&before, None, &mut z);
    let warm: Vec<bool> = z.iter().map(|z| *z > 0.0).collect();
    let cold = run(&now, None, &mut z);
    let warmed = run(&now, Some(&warm), &mut z);
    let active: Vec<usize> = (0..m).filter(|i| z[*i] > 0.0).collect();
    let cold_us = median_us(|| {
        run(&now, None, &mut z);
    });
    let warm_us = median_us(|| {
        run(&now, Some(&warm), &mut z);
    });
    faer::set_global_parallelism(Par::Seq);
    let all = Mat::from_fn(m, m, |r, c| pressed.matrix[c * m + r]);
    let of_active = Mat::from_fn(active.len(), active.len(), |r, c| {
        pressed.matrix[active[c] * m + active[r]]
    });
    let all_us = median_us(|| {
        std::hint::black_box(all.llt(Side::Lower).unwrap());
    });
    let floor_us = median_us(|| {
        std::hint::black_box(of_active.llt(Side::Lower).unwrap());
    });
    println!(
        "{m:>5}{:>8}{all_us:>11.1}{floor_us:>9.1}{cold_us:>11.1}{:>9.2}{warm_us:>11.1}{:>9.2}{:>9}{:>10}{:>13.1e}",
        active.len(),
        cold_us / all_us,
        warm_us / all_us,
        cold.rounds,
        warmed.rounds,
        warmed.certificate.natural_residual,
    );
}

fn median_us(mut run: impl FnMut()) -> f64 {
    run();
    let begun = Instant::now();
    let mut times = Vec::new();
    while times.len() < 5 || begun.elapsed().as_secs_f64() < BUDGET_S {
        let begun = Instant::now();
        run();
        times.push(1e6 * begun.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

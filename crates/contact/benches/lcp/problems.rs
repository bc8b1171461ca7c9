//! The problems that are timed.

use std::path::Path;

/// m, of a cell.
const CELL: f64 = 1e-3;

/// A problem: M and q.
pub(crate) struct Timed {
    pub(crate) matrix: Vec<f64>,
    pub(crate) q: Vec<f64>,
}

/// A rigid sphere in a quadratic elastic block, from `tests/data/lcp`.
pub(crate) fn realistic() -> Vec<Timed> {
    [20, 50, 100, 200, 400]
        .iter()
        .map(|n| {
            let name = format!("block-sphere-{n}");
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/lcp");
            let array = |file: &str| -> Vec<f64> {
                let bytes = std::fs::read(folder.join(&name).join(file)).unwrap();
                let file = npyz::NpyFile::new(&bytes[..]).unwrap();
                file.into_vec::<f64>().unwrap()
            };
            // Symmetric, so that rows are columns.
            let (matrix, q) = (array("M.npy"), array("q.npy"));
            Timed { matrix, q }
        })
        .collect()
}

/// A rigid sphere pressed into an elastic half-space with a square grid of nodes:
/// `W_ij = (1 - ν²) / (π E r_ij)` (Boussinesq), the node's own share by its square (Love 1929).
pub(crate) struct Pressed {
    side: usize,
    pub(crate) matrix: Vec<f64>,
}

impl Pressed {
    pub(crate) fn new(side: usize) -> Self {
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

    pub(crate) fn m(&self) -> usize {
        self.side * self.side
    }

    /// Gaps to a sphere of 0.1 m, its centre shifted by `shift` cells, pressed in until `depth` of the
    /// grid's width (radius) is below it. `roughness`: waves on it, as a share of the depth.
    pub(crate) fn gaps(&self, shift: f64, depth: f64, roughness: f64) -> Vec<f64> {
        let middle = 0.5 * (self.side as f64 - 1.0) * CELL;
        let reach = depth * self.side as f64 * CELL;
        let depth = reach * reach / 0.1;
        (0..self.m())
            .map(|k| {
                let x = (k % self.side) as f64 * CELL - middle - shift * CELL;
                let y = (k / self.side) as f64 * CELL - middle;
                let waves = (2.1e3 * x).sin() * (1.7e3 * y + 0.5).cos();
                (x * x + y * y) / 0.2 - depth * (1.0 + roughness * waves)
            })
            .collect()
    }

    /// 30 haptic steps: the sphere slides by a tenth of a cell a step and bobs.
    pub(crate) fn sequence(&self, roughness: f64) -> Vec<Vec<f64>> {
        (0..30)
            .map(|step| {
                let t = f64::from(step);
                self.gaps(0.1 * t - 1.5, 0.3 + 0.02 * (0.4 * t).sin(), roughness)
            })
            .collect()
    }
}

//! Lemke's method with the lexicographic rule, for any M: an oracle that shares nothing with the solvers of the crate.
//!
//! Adds an artificial variable to all rows, `w = q + M z + d z_0`, which is large enough at first, and pivots along the
//! path on which w_i z_i = 0 until it has left the basis.
//!
//! Source: Cottle, Pang, Stone (1992), section 4.4 (method) and 4.9 (lexicographic rule).

/// z of `w = q + M z`, M column-major. None on a ray, which for a copositive-plus M means that there is no solution, or
/// where the path is of the exponential kind.
pub(crate) fn lemke(matrix: &[f64], q: &[f64]) -> Option<Vec<f64>> {
    /// Times m: a path has 1 to 3 times m pivots.
    const MAX_PIVOTS: usize = 20;
    let m = q.len();
    let scale = scale_of_rows(matrix, m);
    let mut tableau = Tableau::new(matrix, q, &scale);
    let (z_0, mut entering) = (2 * m, 2 * m);
    for _ in 0..=MAX_PIVOTS * m {
        // Starts with no force, which is the answer where no gap is closed.
        let row = match tableau.leaving_row(entering) {
            Some(row) => row,
            None if entering == z_0 => break,
            None => return None,
        };
        let leaving = tableau.exchange(row, entering);
        if leaving == z_0 {
            break;
        }
        // The complement of what left enters.
        entering = (leaving + m) % (2 * m);
    }
    if tableau.basic.contains(&z_0) {
        return None;
    }
    let mut z = vec![0.0; m];
    for (row, &variable) in tableau.rows.iter().zip(&tableau.basic) {
        if variable >= m {
            z[variable - m] = row[2 * m + 1].max(0.0) * scale[variable - m];
        }
    }
    Some(z)
}

/// Powers of two near 1/sqrt of the row's size: the tableau has entries about 1, without round-off.
fn scale_of_rows(matrix: &[f64], m: usize) -> Vec<f64> {
    let size = |i: usize| {
        let diagonal = matrix[i * m + i].abs();
        let others = (0..m).map(|j| matrix[j * m + i].abs().max(matrix[i * m + j].abs()));
        if diagonal > 0.0 {
            diagonal
        } else {
            others.fold(0.0, f64::max)
        }
    };
    (0..m)
        .map(|i| match size(i) {
            0.0 => 1.0,
            size => (-0.5 * size.log2()).round().exp2(),
        })
        .collect()
}

/// Rows of `x_B + T x_N = b` over w (0 to m), z (m to 2m), z_0 (2m) and b (2m + 1).
struct Tableau {
    m: usize,
    rows: Vec<Vec<f64>>,
    /// The variable of each row.
    basic: Vec<usize>,
}

impl Tableau {
    fn new(matrix: &[f64], q: &[f64], scale: &[f64]) -> Self {
        let m = q.len();
        let q: Vec<f64> = q.iter().zip(scale).map(|(q, scale)| q * scale).collect();
        // Weights as large as q, so that z_0 starts at about 1.
        let largest = q.iter().fold(0.0, |max: f64, q| max.max(q.abs()));
        let rows = (0..m).map(|i| {
            let mut row = vec![0.0; 2 * m + 2];
            row[i] = 1.0;
            for j in 0..m {
                row[m + j] = -scale[i] * matrix[j * m + i] * scale[j];
            }
            row[2 * m] = -largest * weight(i);
            row[2 * m + 1] = q[i];
            row
        });
        Self {
            m,
            rows: rows.collect(),
            basic: (0..m).collect(),
        }
    }

    /// The row that reaches zero first when `entering` grows; when z_0 enters, which makes all gaps grow, the one that
    /// reaches it last. Lexicographically least of equals, as if q were q + (ε, ε², ...): nothing cycles.
    fn leaving_row(&self, entering: usize) -> Option<usize> {
        let (m, is_first) = (self.m, entering == 2 * self.m);
        let largest = |column: usize| {
            let entries = self.rows.iter().map(|row| row[column].abs());
            entries.fold(f64::MIN_POSITIVE, f64::max)
        };
        // Smaller entries are the round-off of a zero.
        let least_entry = 1e-11 * largest(entering);
        let round_off = 16.0 * f64::EPSILON * largest(2 * m + 1);
        let ratio = |row: usize| {
            let (entry, b) = (self.rows[row][entering], self.rows[row][2 * m + 1]);
            if is_first {
                (b < 0.0).then(|| b / entry.abs())
            } else {
                (entry > least_entry).then(|| b.max(0.0) / entry)
            }
        };
        let mut least: Option<(usize, f64)> = None;
        for row in 0..m {
            let Some(ratio) = ratio(row) else {
                continue;
            };
            let is_less = least.is_none_or(|(other, least)| {
                let entries = [row, other].map(|row| self.rows[row][entering].abs());
                let noise = round_off * (1.0 / entries[0] + 1.0 / entries[1]);
                let equal = noise.max(1e-12 * ratio.abs().max(least.abs()));
                if (ratio - least).abs() > equal {
                    ratio < least
                } else {
                    self.is_lexicographically_less(row, other, entering)
                }
            });
            if is_less {
                least = Some((row, ratio));
            }
        }
        least.map(|(row, _)| row)
    }

    /// Compares the ratios of two rows for q + (ε, ε², ...). The columns of w are the inverse of the basis.
    fn is_lexicographically_less(&self, row: usize, other: usize, entering: usize) -> bool {
        let z_0 = 2 * self.m;
        // The artificial variable leaves as soon as it can: that ends the path.
        if self.basic[row] == z_0 || self.basic[other] == z_0 {
            return self.basic[row] == z_0;
        }
        for w in 0..self.m {
            let [a, b] = [row, other].map(|row| self.rows[row][w] / self.rows[row][entering].abs());
            if (a - b).abs() > 1e-10 * a.abs().max(b.abs()) {
                return a < b;
            }
        }
        false
    }

    /// `entering` takes the place of the variable of `row`, which is returned.
    fn exchange(&mut self, row: usize, entering: usize) -> usize {
        let pivot = self.rows[row][entering];
        for entry in &mut self.rows[row] {
            *entry /= pivot;
        }
        let pivot_row = self.rows[row].clone();
        for (other, entries) in self.rows.iter_mut().enumerate() {
            let factor = entries[entering];
            if other != row && factor != 0.0 {
                for (entry, pivot) in entries.iter_mut().zip(&pivot_row) {
                    *entry -= factor * pivot;
                }
                entries[entering] = 0.0;
            }
        }
        std::mem::replace(&mut self.basic[row], entering)
    }
}

/// Spread over three decades by the golden ratio: on matrices made to be exponential for even weights (Murty) the path is
/// short.
fn weight(row: usize) -> f64 {
    const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;
    (10.0 * (GOLDEN_RATIO * (row + 1) as f64).fract()).exp2()
}

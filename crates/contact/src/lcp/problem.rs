//! The data of a complementarity problem, checked once.

use crate::error::Error;

/// A complementarity problem, borrowed: column-major `matrix` (m x m) and `q` (m).
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    m: usize,
    matrix: &'a [f64],
    q: &'a [f64],
    is_symmetric: bool,
}

impl<'a> Problem<'a> {
    /// Checks the data and finds out whether M is symmetric (to 1e-10 of the diagonal).
    ///
    /// Does not allocate. Cost: two passes over M.
    ///
    /// # Errors
    /// [`Error::Length`] unless M is square of the size of q; [`Error::NotFinite`].
    pub fn new(matrix: &'a [f64], q: &'a [f64]) -> Result<Self, Error> {
        let mut problem = Self::symmetric(matrix, q)?;
        problem.is_symmetric = is_symmetric(problem.m, matrix);
        Ok(problem)
    }

    /// As [`Problem::new`] for an M that the caller made symmetric, as [`crate::delassus`] does: saves the
    /// slower of the two passes.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn symmetric(matrix: &'a [f64], q: &'a [f64]) -> Result<Self, Error> {
        let m = q.len();
        if matrix.len() != m * m {
            return Err(Error::Length {
                what: "the matrix of the complementarity problem",
                expected: m * m,
                actual: matrix.len(),
            });
        }
        check_finite("q", q)?;
        check_finite("matrix entry", matrix)?;
        Ok(Self {
            m,
            matrix,
            q,
            is_symmetric: true,
        })
    }

    /// Number of rows.
    pub fn m(&self) -> usize {
        self.m
    }

    /// M, column-major.
    pub fn matrix(&self) -> &'a [f64] {
        self.matrix
    }

    /// q.
    pub fn q(&self) -> &'a [f64] {
        self.q
    }

    /// Whether M is treated as symmetric.
    pub fn is_symmetric(&self) -> bool {
        self.is_symmetric
    }

    pub(super) fn column(&self, j: usize) -> &'a [f64] {
        &self.matrix[j * self.m..(j + 1) * self.m]
    }

    pub(super) fn diagonal(&self, i: usize) -> f64 {
        self.matrix[i * self.m + i]
    }
}

fn check_finite(what: &'static str, values: &[f64]) -> Result<(), Error> {
    // Whole chunks without an early exit, so that the loop is vectorised.
    for (chunk_idx, chunk) in values.chunks(64).enumerate() {
        if !chunk.iter().fold(true, |ok, x| ok & x.is_finite()) {
            let inside = chunk.iter().position(|x| !x.is_finite()).unwrap_or(0);
            return Err(Error::NotFinite {
                what,
                index: chunk_idx * 64 + inside,
            });
        }
    }
    Ok(())
}

fn is_symmetric(m: usize, matrix: &[f64]) -> bool {
    /// Of sqrt(M_ii M_jj): above the round-off of a computed compliance, far below any true skewness.
    const TOLERANCE: f64 = 1e-10;
    (0..m).all(|j| {
        (0..j).all(|i| {
            let difference = matrix[j * m + i] - matrix[i * m + j];
            let size = (matrix[i * m + i] * matrix[j * m + j]).abs();
            difference * difference <= TOLERANCE * TOLERANCE * size
        })
    })
}

//! The data of a complementarity problem, checked once.

use crate::error::Error;

/// Of the diagonal: above the round-off of a computed compliance, far below any true skewness.
const SKEW: f64 = 1e-10;

/// A complementarity problem, borrowed: column-major `matrix` (m x m) and `q` (m).
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    m: usize,
    matrix: &'a [f64],
    q: &'a [f64],
    is_symmetric: bool,
}

impl<'a> Problem<'a> {
    /// Any M: checks the data and finds out whether M is symmetric, see [`Problem::symmetric`]. One that is not
    /// can be judged by [`check`](super::check); [`solve`](super::solve) refuses it.
    ///
    /// Does not allocate. Cost: two passes over M.
    ///
    /// # Errors
    /// [`Error::Length`] unless M is square of the size of q; [`Error::NotFinite`].
    pub fn new(matrix: &'a [f64], q: &'a [f64]) -> Result<Self, Error> {
        let mut problem = Self::trusted_symmetric(matrix, q)?;
        problem.is_symmetric = problem.skew_entry().is_none();
        Ok(problem)
    }

    /// An M that must be symmetric (to 1e-10 of the diagonal), as that of frictionless contact is.
    ///
    /// # Errors
    /// As [`Problem::new`], and [`Error::NotSymmetric`] with the first pair of entries that differ by more than round-off.
    pub fn symmetric(matrix: &'a [f64], q: &'a [f64]) -> Result<Self, Error> {
        let problem = Self::trusted_symmetric(matrix, q)?;
        match problem.skew_entry() {
            None => Ok(problem),
            Some((row, column)) => Err(problem.not_symmetric(row, column)),
        }
    }

    /// As [`Problem::symmetric`] for an M that the caller made symmetric, as [`crate::delassus`] does:
    /// saves the slower of the two passes. If M is not symmetric after all, the certificate says so.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn trusted_symmetric(matrix: &'a [f64], q: &'a [f64]) -> Result<Self, Error> {
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

    /// Whether M counts as symmetric.
    pub fn is_symmetric(&self) -> bool {
        self.is_symmetric
    }

    pub(super) fn column(&self, j: usize) -> &'a [f64] {
        &self.matrix[j * self.m..(j + 1) * self.m]
    }

    pub(super) fn diagonal(&self, i: usize) -> f64 {
        self.matrix[i * self.m + i]
    }

    /// For the solvers.
    pub(super) fn require_symmetric(&self) -> Result<(), Error> {
        if self.is_symmetric {
            return Ok(());
        }
        let (row, column) = self.skew_entry().unwrap_or_default();
        Err(self.not_symmetric(row, column))
    }

    fn not_symmetric(&self, row: usize, column: usize) -> Error {
        Error::NotSymmetric {
            row,
            column,
            value: self.column(column)[row],
            mirrored: self.column(row)[column],
        }
    }

    /// The first entry below the diagonal, column by column, that differs from its mirror image.
    fn skew_entry(&self) -> Option<(usize, usize)> {
        (0..self.m).find_map(|column| {
            let rows = column + 1..self.m;
            let mut skew = rows.filter(|&row| self.is_skew(row, column));
            skew.next().map(|row| (row, column))
        })
    }

    fn is_skew(&self, row: usize, column: usize) -> bool {
        let difference = self.column(column)[row] - self.column(row)[column];
        let size = (self.diagonal(row) * self.diagonal(column)).abs();
        difference * difference > SKEW * SKEW * size
    }
}

fn check_finite(what: &'static str, values: &[f64]) -> Result<(), Error> {
    // A sum is finite only if all its terms are: one pass at the speed of memory. A sum that is not may have
    // overflowed; then, and only then, one by one.
    let mut sums = [0.0; 16];
    let (chunks, rest) = values.as_chunks::<16>();
    for chunk in chunks {
        for lane in 0..16 {
            sums[lane] += chunk[lane];
        }
    }
    let sum = sums.iter().chain(rest).copied().sum::<f64>();
    if sum.is_finite() {
        return Ok(());
    }
    match values.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(Error::NotFinite { what, index }),
        None => Ok(()),
    }
}

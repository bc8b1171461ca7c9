//! What can be wrong with a multiply: sizes, indices, numbers.

use thiserror::Error as ThisError;

/// An error of the multiply.
#[derive(Debug, Clone, PartialEq, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// A slice has not the length the sizes ask for.
    #[error("{what} has {found} numbers, {expected} are needed")]
    WrongLength {
        /// The argument.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length needed.
        expected: usize,
    },
    /// A listed column is not a candidate.
    #[error("column {column} is not among the {n_candidates} candidates")]
    NoSuchColumn {
        /// The column asked for.
        column: u32,
        /// Number of candidates.
        n_candidates: usize,
    },
    /// A row that the surface does not have.
    #[error("row {row} is not among the {n_rows} rows of the surface")]
    NoSuchRow {
        /// The row asked for.
        row: usize,
        /// Rows of the surface.
        n_rows: usize,
    },
    /// The compliance holds a number that is not finite.
    #[error("the compliance of row {row} for candidate {candidate} is not finite")]
    NotFinite {
        /// Row of the surface.
        row: usize,
        /// Candidate.
        candidate: usize,
    },
    /// The matrix has more numbers than can be addressed.
    #[error("{n_rows} rows by {n_candidates} candidates is more than can be addressed")]
    TooLarge {
        /// Rows of the surface.
        n_rows: usize,
        /// Candidates.
        n_candidates: usize,
    },
}

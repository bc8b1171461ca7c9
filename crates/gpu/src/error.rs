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
    /// A force is not finite.
    #[error("the force at contact {contact} of the list is not finite")]
    ForceNotFinite {
        /// Place in the list of contacts, through all sets.
        contact: usize,
    },
    /// The surface has no row, so there is nothing to multiply.
    #[error("the surface has no row: there is nothing to multiply")]
    NoRows,
    /// The matrix has more numbers than can be addressed.
    #[error("{n_rows} rows by {n_candidates} candidates is more than can be addressed")]
    TooLarge {
        /// Rows of the surface.
        n_rows: usize,
        /// Candidates.
        n_candidates: usize,
    },
    /// The system has not the memory for the compliance.
    #[error("no memory for a compliance of {bytes} bytes on the processor: {reason}")]
    NoMemory {
        /// Bytes asked for.
        bytes: u64,
        /// What the system said.
        reason: String,
    },
    /// The system gives no threads.
    #[error("no {n_threads} threads for the multiply: {reason}")]
    NoThreads {
        /// So many were asked for.
        n_threads: usize,
        /// What the system said.
        reason: String,
    },
    /// No graphics adapter is there, or none that may be used.
    #[error(
        "no graphics adapter for the multiply: {looked_for}; install a driver for Vulkan, Metal, Direct3D 12 or OpenGL, or use the processor"
    )]
    NoAdapter {
        /// What was looked for, and what was found instead.
        looked_for: String,
    },
    /// The adapter has not the memory for the compliance.
    #[error("{adapter} has no memory for a compliance of {bytes} bytes: {reason}")]
    OutOfMemory {
        /// The adapter.
        adapter: String,
        /// Bytes of the stored compliance.
        bytes: u64,
        /// What the driver said.
        reason: String,
    },
    /// The device was lost: reset, unplugged, or its driver gone.
    #[error("{adapter} was lost: {reason}")]
    DeviceLost {
        /// The adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// The driver, or the layer above it, refused what it was asked for.
    #[error("{adapter} refused the work: {reason}")]
    Refused {
        /// The adapter.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// No answer within the time that a caller waits.
    #[error("{adapter} gave no answer within {milliseconds} ms")]
    TimedOut {
        /// The adapter.
        adapter: String,
        /// Waited so long.
        milliseconds: u64,
    },
    /// The adapter's product differs from the processor's by more than rounding explains.
    #[error(
        "{adapter} gives a wrong product: {error:.1e} of the largest displacement from the processor's"
    )]
    Wrong {
        /// The adapter.
        adapter: String,
        /// Largest difference over the largest displacement.
        error: f64,
    },
}

impl Error {
    /// Whether it is the adapter that failed, rather than what it was given.
    #[must_use]
    pub fn is_of_adapter(&self) -> bool {
        matches!(
            self,
            Self::OutOfMemory { .. }
                | Self::DeviceLost { .. }
                | Self::Refused { .. }
                | Self::TimedOut { .. }
                | Self::Wrong { .. }
        )
    }
}

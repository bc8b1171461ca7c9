//! What a back-end of the multiply offers.

use crate::error::Error;
use crate::layout::Layout;

/// How the compliance is kept for the multiply. Forces, sums and displacements are 64-bit always.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// 32 bits: half the memory to read; see [`Cpu`](crate::Cpu) for the error.
    F32,
    /// 64 bits.
    F64,
}

/// The product of the surface compliance with the forces at some candidates.
pub trait Multiply: Send {
    /// Name of the back-end for people, constant.
    fn name(&self) -> &'static str;

    /// Memory held by the stored compliance, bytes.
    fn bytes(&self) -> u64;

    /// Sizes of the compliance.
    fn layout(&self) -> Layout;

    /// Displacement of the whole surface under forces at the listed candidates.
    ///
    /// ```text
    /// u = Σ_k C[:, columns[k]] forces[k]
    /// ```
    /// - `columns`: candidates that carry force, in any order; one listed twice counts twice.
    /// - `forces`: 3 for each listed candidate, on the part, N.
    /// - `displacement`: 3 for each row, m; overwritten.
    ///
    /// The same input gives the same bits. Real-time: no allocation.
    ///
    /// # Errors
    /// Where a slice has the wrong length or a column is no candidate; nothing is written then.
    fn multiply_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        displacement: &mut [f64],
    ) -> Result<(), Error>;

    /// Displacement of some rows: the first `n_first` and those listed.
    ///
    /// As [`multiply_into`](Self::multiply_into) for these rows; the others are left as they are.
    /// `rows`: at or above `n_first`. Those that follow each other in the list and in number are read as
    /// one stretch; a row that stands alone costs several times as much.
    ///
    /// # Errors
    /// As [`multiply_into`](Self::multiply_into), and where a row does not exist.
    fn multiply_rows_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        n_first: usize,
        rows: &[u32],
        displacement: &mut [f64],
    ) -> Result<(), Error>;
}

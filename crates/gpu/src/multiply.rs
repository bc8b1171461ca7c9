//! What a back-end of the multiply offers.

use crate::error::Error;
use crate::layout::{Layout, check_length};

/// How the processor keeps the compliance. Forces, sums and displacements are 64-bit always.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// 32 bits: half the memory to read; see [`Cpu`](crate::Cpu) for the error.
    F32,
    /// 64 bits.
    F64,
}

/// The product of the surface compliance with the forces at some candidates.
///
/// The compliance is handed over once, when a back-end is made. Only the columns of listed candidates are read
/// (Popescu's observation: Duriez et al. 2004, section 3.1).
pub trait ComplianceMultiply: Send {
    /// Name of the back-end for people.
    fn name(&self) -> &str;

    /// Memory held by the stored compliance, bytes.
    fn bytes(&self) -> u64;

    /// Sizes of the compliance.
    fn layout(&self) -> Layout;

    /// Displacement of the whole surface under forces at the listed candidates; waits for it.
    ///
    /// ```text
    /// u = Σ_k C[:, columns[k]] forces[k]
    /// ```
    /// - `columns`: candidates that carry force, in any order; one listed twice counts twice.
    /// - `forces`: 3 for each listed candidate, on the part, N.
    /// - `displacement`: 3 for each row, m; overwritten.
    ///
    /// The same input gives the same bits.
    ///
    /// # Errors
    /// Where a slice has the wrong length, a column is no candidate or a force is not finite; nothing is written
    /// then. On a GPU also where the device is lost or does not answer in time.
    fn multiply_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        displacement: &mut [f64],
    ) -> Result<(), Error>;

    /// Displacement of some rows: the first `n_first` and those listed; waits for it.
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

    /// Displacements under several sets of forces at the same candidates, for studies and sweeps; waits for them.
    /// Each number of the compliance is read once for several sets.
    ///
    /// - `forces`: sets one after the other, each 3 for each listed candidate, N.
    /// - `displacements`: sets one after the other, each 3 for each row, m; overwritten.
    ///
    /// # Errors
    /// As [`multiply_into`](Self::multiply_into).
    fn multiply_batch_into(
        &mut self,
        n_sets: usize,
        columns: &[u32],
        forces: &[f64],
        displacements: &mut [f64],
    ) -> Result<(), Error>;

    /// Asks for a displacement without waiting for it: the form for a display. A product that was asked for earlier
    /// and has not begun is dropped; the processor does its work in [`newest_into`](Self::newest_into).
    ///
    /// # Errors
    /// As [`multiply_into`](Self::multiply_into).
    fn begin(&mut self, columns: &[u32], forces: &[f64]) -> Result<(), Error>;

    /// Writes the newest displacement asked for by [`begin`](Self::begin) that is ready, if there is one that was not
    /// taken before. Whether it wrote. Does not wait.
    ///
    /// # Errors
    /// As [`multiply_into`](Self::multiply_into).
    fn newest_into(&mut self, displacement: &mut [f64]) -> Result<bool, Error>;

    /// What the user is to be told, once: that this back-end was given up for another.
    fn take_remark(&mut self) -> Option<String> {
        None
    }
}

/// What every back-end refuses, before anything is written.
pub(crate) fn check(
    layout: Layout,
    columns: &[u32],
    forces: &[f64],
    n_sets: usize,
) -> Result<(), Error> {
    check_length("forces", forces.len(), 3 * columns.len() * n_sets)?;
    let n_candidates = layout.n_candidates();
    if let Some(&column) = columns.iter().find(|&&c| c as usize >= n_candidates) {
        return Err(Error::NoSuchColumn {
            column,
            n_candidates,
        });
    }
    match forces.iter().position(|f| !f.is_finite()) {
        Some(at) => Err(Error::ForceNotFinite { contact: at / 3 }),
        None => Ok(()),
    }
}

/// Refuses a displacement that is not one number for each component of each row.
pub(crate) fn check_displacement(layout: Layout, displacement: &[f64]) -> Result<(), Error> {
    let expected = layout.displacement_len();
    check_length("displacement", displacement.len(), expected)
}

/// Refuses rows that do not exist.
pub(crate) fn check_rows(layout: Layout, n_first: usize, rows: &[u32]) -> Result<(), Error> {
    let n_rows = layout.n_rows();
    let largest = rows.iter().map(|r| *r as usize + 1).max().unwrap_or(0);
    if n_first.max(largest) > n_rows {
        let row = n_first.max(largest) - 1;
        return Err(Error::NoSuchRow { row, n_rows });
    }
    Ok(())
}

//! Where each number of the compliance lies: the only place that computes an offset.

use std::ops::Range;

use crate::error::Error;

/// Sizes of a compliance and its two layouts.
///
/// *Blocks*, as it is handed over: in one or more stretches of rows that follow each other, each with, for each
/// candidate, the 3 x 3 blocks of the stretch's rows, each block column-major (displacement of the row per unit
/// force along x, then y, then z):
///
/// ```text
/// candidate 0                                        candidate 1
/// │ row 0: xx yx zx  xy yy zy  xz yz zz │ row 1: ... │ row 0: ...
/// ```
/// *Columns*, as it is kept for the multiply: for each candidate three dense columns, one per axis of
/// the force, each the displacement of all rows:
///
/// ```text
/// candidate 0, force x          candidate 0, force y          candidate 0, force z
/// │ row 0: xx yx zx │ row 1 ... │ row 0: xy yy zy │ row 1 ... │ row 0: xz yz zz │ row 1 ...
/// ```
/// The product then adds long contiguous columns, which fill vector registers whatever the number of
/// rows; blocks would have to be shuffled in threes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    n_rows: usize,
    n_candidates: usize,
}

impl Layout {
    /// Sizes: nodes of the surface and nodes that may be touched.
    ///
    /// # Errors
    /// Where there is no row, or the matrix could not be addressed.
    pub fn new(n_rows: usize, n_candidates: usize) -> Result<Self, Error> {
        if n_rows == 0 {
            return Err(Error::NoRows);
        }
        let n_bytes = n_rows
            .checked_mul(n_candidates)
            .and_then(|n| n.checked_mul(9 * size_of::<f64>()));
        match n_bytes {
            Some(n) if isize::try_from(n).is_ok() => Ok(Self {
                n_rows,
                n_candidates,
            }),
            _ => Err(Error::TooLarge {
                n_rows,
                n_candidates,
            }),
        }
    }

    /// Nodes of the surface.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Nodes that may be touched.
    #[must_use]
    pub fn n_candidates(&self) -> usize {
        self.n_candidates
    }

    /// Numbers of the whole matrix: 9 for each row and candidate.
    #[must_use]
    pub fn n_scalars(&self) -> usize {
        9 * self.n_rows * self.n_candidates
    }

    /// Numbers of a displacement: 3 for each row. Also the length of a column.
    #[must_use]
    pub fn displacement_len(&self) -> usize {
        3 * self.n_rows
    }

    /// First number of the block of a row and a candidate in the layout of blocks.
    #[must_use]
    pub fn block_offset(n_rows: usize, row: usize, candidate: usize) -> usize {
        (candidate * n_rows + row) * 9
    }

    /// The column of a candidate for a force along `axis` (0, 1, 2) in the layout of columns.
    #[must_use]
    pub fn column(&self, candidate: usize, axis: usize) -> Range<usize> {
        let start = (3 * candidate + axis) * self.displacement_len();
        start..start + self.displacement_len()
    }

    /// Writes columns from blocks, each number through `convert`. `blocks`: stretches of rows.
    ///
    /// # Errors
    /// Where a slice has the wrong length.
    pub fn columns_from_blocks<T: Copy>(
        &self,
        blocks: &[&[f64]],
        columns: &mut [T],
        convert: impl Fn(f64) -> T,
    ) -> Result<(), Error> {
        let found = blocks.iter().map(|stretch| stretch.len()).sum();
        for (what, found) in [("blocks", found), ("columns", columns.len())] {
            check_length(what, found, self.n_scalars())?;
        }
        let mut first_row = 0;
        for stretch in blocks {
            let n_rows = self.rows_of(stretch)?;
            let rows = 3 * first_row..3 * (first_row + n_rows);
            for candidate in 0..self.n_candidates {
                for axis in 0..3 {
                    let column = &mut columns[self.column(candidate, axis)][rows.clone()];
                    for (row, displacement) in column.chunks_exact_mut(3).enumerate() {
                        let block = Self::block_offset(n_rows, row, candidate) + 3 * axis;
                        for (to, from) in displacement.iter_mut().zip(&stretch[block..block + 3]) {
                            *to = convert(*from);
                        }
                    }
                }
            }
            first_row += n_rows;
        }
        Ok(())
    }

    /// Refuses blocks of another size, or with a number that is not finite.
    ///
    /// # Errors
    /// Where that is so.
    pub(crate) fn check_blocks(&self, blocks: &[&[f64]]) -> Result<(), Error> {
        let found = blocks.iter().map(|stretch| stretch.len()).sum();
        check_length("blocks", found, self.n_scalars())?;
        let mut first_row = 0;
        for stretch in blocks {
            let n_rows = self.rows_of(stretch)?;
            if let Some(at) = stretch.iter().position(|x| !x.is_finite()) {
                let block = at / 9;
                return Err(Error::NotFinite {
                    row: first_row + block % n_rows,
                    candidate: block / n_rows,
                });
            }
            first_row += n_rows;
        }
        Ok(())
    }

    /// The column of a candidate for a force along `axis`, from blocks that were checked.
    pub(crate) fn column_from_blocks(
        &self,
        blocks: &[&[f64]],
        candidate: usize,
        axis: usize,
    ) -> impl Iterator<Item = f64> {
        let of_row = 9 * self.n_candidates;
        blocks.iter().flat_map(move |stretch| {
            let n_rows = stretch.len() / of_row;
            let first = Self::block_offset(n_rows, 0, candidate);
            let of_candidate = &stretch[first..first + 9 * n_rows];
            of_candidate
                .chunks_exact(9)
                .flat_map(move |block| block[3 * axis..3 * axis + 3].iter().copied())
        })
    }

    /// Rows of a stretch of blocks.
    ///
    /// # Errors
    /// Where it does not hold whole rows.
    pub(crate) fn rows_of(&self, stretch: &[f64]) -> Result<usize, Error> {
        let n_rows = stretch.len() / (9 * self.n_candidates).max(1);
        let whole = 9 * self.n_candidates * n_rows;
        check_length("blocks", stretch.len(), whole).map(|()| n_rows)
    }
}

/// `Ok` if a slice has the expected length.
pub(crate) fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected {
        Ok(())
    } else {
        Err(Error::WrongLength {
            what,
            found,
            expected,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_hold_each_number_of_the_blocks_at_its_place() {
        let layout = Layout::new(4, 3).unwrap();
        let blocks: Vec<f64> = (0_u32..108).map(f64::from).collect();
        let mut columns = vec![f64::NAN; layout.n_scalars()];
        layout
            .columns_from_blocks(&[&blocks], &mut columns, |x| x)
            .unwrap();
        for candidate in 0..3 {
            for row in 0..4 {
                for axis in 0..3 {
                    for component in 0..3 {
                        let from = blocks[(candidate * 4 + row) * 9 + axis * 3 + component];
                        let to = columns[layout.column(candidate, axis)][3 * row + component];
                        assert_eq!(from, to);
                    }
                }
            }
        }
    }

    #[test]
    fn stretches_of_rows_give_the_columns_of_the_whole() {
        let layout = Layout::new(4, 3).unwrap();
        let blocks: Vec<f64> = (0_u32..108).map(f64::from).collect();
        let rows = |range: Range<usize>| -> Vec<f64> {
            blocks
                .chunks_exact(36)
                .flat_map(|column| column[9 * range.start..9 * range.end].to_vec())
                .collect()
        };
        let columns_of = |blocks: &[&[f64]]| {
            let mut columns = vec![f64::NAN; layout.n_scalars()];
            let written = layout.columns_from_blocks(blocks, &mut columns, |x| x);
            written.map(|()| columns)
        };
        let whole = columns_of(&[&blocks]).unwrap();
        let (first, second) = (rows(0..3), rows(3..4));
        assert_eq!(columns_of(&[&first, &second]).unwrap(), whole);
        assert_eq!(columns_of(&[&[], &blocks]).unwrap(), whole);
        for wrong in [
            &[&first[..]][..],
            &[&first, &first],
            &[&first[1..], &second],
        ] {
            assert!(matches!(columns_of(wrong), Err(Error::WrongLength { .. })));
        }
    }

    #[test]
    fn sizes_that_cannot_be_addressed_are_refused() {
        assert!(matches!(
            Layout::new(usize::MAX / 4, 9),
            Err(Error::TooLarge { .. })
        ));
        assert!(matches!(
            Layout::new(1 << 40, 1 << 20),
            Err(Error::TooLarge { .. })
        ));
        assert_eq!(Layout::new(0, 3), Err(Error::NoRows));
        assert!(Layout::new(3, 0).is_ok());
    }

    #[test]
    fn blocks_of_the_wrong_length_are_refused() {
        let layout = Layout::new(2, 2).unwrap();
        let mut columns = vec![0.0; 36];
        assert_eq!(
            layout.columns_from_blocks(&[&[0.0; 35]], &mut columns, |x| x),
            Err(Error::WrongLength {
                what: "blocks",
                found: 35,
                expected: 36
            })
        );
        assert!(
            layout
                .columns_from_blocks(&[&[0.0; 36]], &mut columns[1..], |x| x)
                .is_err()
        );
    }
}

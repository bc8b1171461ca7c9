//! The data of a frictional contact problem, checked once.

use crate::error::Error;
use crate::lcp;

/// A frictional contact problem of n contacts, borrowed: column-major `matrix` W (3n x 3n, m/N), `q` (3n, m) and
/// one friction coefficient per contact. Rows of contact i: 3i normal, 3i + 1 and 3i + 2 tangents.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    rows: lcp::Problem<'a>,
    friction_coefficients: &'a [f64],
}

impl<'a> Problem<'a> {
    /// Checks the data. Does not allocate.
    ///
    /// # Errors
    /// [`Error::Length`] unless W is square of the size of q and three times that of the coefficients;
    /// [`Error::NotFinite`]; [`Error::NotSymmetric`]; [`Error::NegativeFriction`].
    pub fn new(
        matrix: &'a [f64],
        q: &'a [f64],
        friction_coefficients: &'a [f64],
    ) -> Result<Self, Error> {
        Self::check_coefficients(q, friction_coefficients)?;
        Ok(Self {
            rows: lcp::Problem::symmetric(matrix, q)?,
            friction_coefficients,
        })
    }

    /// As [`Problem::new`] for a W that the caller made symmetric: saves a slow pass.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn trusted_symmetric(
        matrix: &'a [f64],
        q: &'a [f64],
        friction_coefficients: &'a [f64],
    ) -> Result<Self, Error> {
        Self::check_coefficients(q, friction_coefficients)?;
        Ok(Self {
            rows: lcp::Problem::trusted_symmetric(matrix, q)?,
            friction_coefficients,
        })
    }

    fn check_coefficients(q: &[f64], coefficients: &[f64]) -> Result<(), Error> {
        if q.len() != 3 * coefficients.len() {
            return Err(Error::Length {
                what: "q of the frictional contact problem",
                expected: 3 * coefficients.len(),
                actual: q.len(),
            });
        }
        for (contact, coefficient) in coefficients.iter().enumerate() {
            if !coefficient.is_finite() || *coefficient < 0.0 {
                return Err(Error::NegativeFriction {
                    contact,
                    value: *coefficient,
                });
            }
        }
        Ok(())
    }

    /// Number of contacts.
    pub fn n_contacts(&self) -> usize {
        self.friction_coefficients.len()
    }

    /// W, column-major.
    pub fn matrix(&self) -> &'a [f64] {
        self.rows.matrix()
    }

    /// Gaps and slips without contact force, m.
    pub fn q(&self) -> &'a [f64] {
        self.rows.q()
    }

    /// μ of each contact.
    pub fn friction_coefficients(&self) -> &'a [f64] {
        self.friction_coefficients
    }

    pub(super) fn rows(&self) -> &lcp::Problem<'a> {
        &self.rows
    }

    pub(super) fn column(&self, j: usize) -> &'a [f64] {
        let n = self.q().len();
        &self.matrix()[j * n..(j + 1) * n]
    }

    pub(super) fn check_length(&self, what: &'static str, actual: usize) -> Result<(), Error> {
        let expected = self.q().len();
        if actual == expected {
            Ok(())
        } else {
            Err(Error::Length {
                what,
                expected,
                actual,
            })
        }
    }
}

//! Sizes of the rows, so that tolerances mean the same in every row and in every unit system.

use super::{Problem, Scalar};

/// What the diagonal says about M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Diagonal<T> {
    /// The power of two below the largest M_ii: scale_i² unit = M_ii.
    pub(super) unit: T,
    /// All M_ii > 0.
    pub(super) is_positive_diagonal: bool,
    /// All M_ii ≥ 0 and rows with M_ii = 0 are zero: necessary for symmetric positive semi-definite M.
    pub(super) is_semidefinite_diagonal: bool,
}

/// `scale`_i = sqrt(M_ii / 2^e), with 2^e the power of two below the largest diagonal entry; 1 for rows without a diagonal.
///
/// With D = diag(scale)⁻¹ the matrix D M D has a unit diagonal (up to 2^e), w_i / scale_i and z_i scale_i
/// compare between rows. The matrix itself is not copied: its factorisation uses no square roots,
/// so that scaling by powers of two would not change a bit of it.
pub(super) fn row_scale_into<T: Scalar>(problem: &Problem<T>, scale: &mut [T]) -> Diagonal<T> {
    let m = problem.m();
    let scale = &mut scale[..m];
    let mut largest = T::zero();
    let mut is_positive_diagonal = true;
    for (i, scale) in scale.iter_mut().enumerate() {
        let diagonal = problem.diagonal(i);
        *scale = diagonal;
        is_positive_diagonal &= diagonal > T::zero();
        largest = num_traits::Float::max(largest, diagonal);
    }
    let unit = power_of_two_below(largest);
    let mut kind = Diagonal {
        unit,
        is_positive_diagonal,
        is_semidefinite_diagonal: true,
    };
    if !is_positive_diagonal {
        for (i, scale) in scale.iter_mut().enumerate() {
            if *scale <= T::zero() {
                let is_zero_row = || problem.column(i).iter().all(|&entry| entry == T::zero());
                kind.is_semidefinite_diagonal &= *scale == T::zero() && is_zero_row();
                *scale = unit;
            }
        }
    }
    // Exact, as the unit is a power of two.
    let per_unit = T::one() / unit;
    for scale in scale.iter_mut() {
        *scale = num_traits::Float::sqrt(*scale * per_unit);
    }
    kind
}

/// Largest 2^e ≤ x, so that x / 2^e is exact and in [1, 2). 1 for x = 0.
fn power_of_two_below<T: Scalar>(x: T) -> T {
    // Where 1 / 2^e would not be a normal number any more, 1 serves as well.
    let range = T::min_positive_value()..=T::one() / T::min_positive_value();
    if !range.contains(&x) {
        return T::one();
    }
    T::of(f64::from_bits(x.wide().to_bits() & (0x7ff << 52)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop")]
    use super::*;

    #[test]
    fn row_scale_does_not_change_with_a_power_of_two() {
        let q = [-1.0; 3];
        let matrix = [4.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1e-9];
        let mut expected = [0.0; 3];
        row_scale_into(&Problem::new(&matrix, &q).unwrap(), &mut expected);
        for exponent in [-61, -3, 1, 40] {
            let scaled = matrix.map(|x| x * 2.0_f64.powi(exponent));
            let mut actual = [0.0; 3];
            row_scale_into(&Problem::new(&scaled, &q).unwrap(), &mut actual);
            assert_eq!(actual, expected);
        }
    }

    #[test]
    fn diagonal_finds_what_cannot_be_semidefinite() {
        let q = [-1.0; 2];
        let mut scale = [0.0; 2];
        let mut kind = |matrix: [f64; 4]| {
            let kind = row_scale_into(&Problem::new(&matrix, &q).unwrap(), &mut scale);
            (kind.is_positive_diagonal, kind.is_semidefinite_diagonal)
        };
        assert_eq!(kind([1.0, 0.0, 0.0, 1.0]), (true, true));
        assert_eq!(kind([1.0, 0.0, 0.0, 0.0]), (false, true));
        assert_eq!(kind([1.0, 0.5, 0.5, 0.0]), (false, false));
        assert_eq!(kind([1.0, 0.0, 0.0, -1.0]), (false, false));
    }

    #[test]
    fn sizes_at_the_ends_of_the_range_stay_finite() {
        for size in [1e-310, 1e-300, 1e300, f64::MAX] {
            let matrix = [size];
            let mut scale = [0.0];
            row_scale_into(&Problem::new(&matrix, &[-1.0]).unwrap(), &mut scale);
            assert!(scale[0].is_finite() && scale[0] > 0.0, "{size}");
        }
    }
}

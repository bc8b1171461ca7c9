//! Sizes of the rows, so that tolerances mean the same in every row and in every unit system.

use super::Problem;

/// What the diagonal says about M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Diagonal {
    /// The power of two below the largest M_ii: scale_i² unit = M_ii.
    pub(super) unit: f64,
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
pub(super) fn row_scale_into(problem: &Problem, scale: &mut [f64]) -> Diagonal {
    let m = problem.m();
    let largest = (0..m).fold(0.0_f64, |max, i| max.max(problem.diagonal(i)));
    let unit = power_of_two_below(largest);
    let mut kind = Diagonal {
        unit,
        is_positive_diagonal: true,
        is_semidefinite_diagonal: true,
    };
    for (i, scale) in scale[..m].iter_mut().enumerate() {
        let diagonal = problem.diagonal(i);
        if diagonal > 0.0 {
            *scale = (diagonal / unit).sqrt();
        } else {
            *scale = 1.0;
            kind.is_positive_diagonal = false;
            if diagonal < 0.0 || problem.column(i).iter().any(|&entry| entry != 0.0) {
                kind.is_semidefinite_diagonal = false;
            }
        }
    }
    kind
}

/// Largest 2^e ≤ x, so that x / 2^e is exact and in [1, 2). 1 for x = 0.
fn power_of_two_below(x: f64) -> f64 {
    if x < f64::MIN_POSITIVE {
        return 1.0;
    }
    f64::from_bits(x.to_bits() & (0x7ff << 52))
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
}

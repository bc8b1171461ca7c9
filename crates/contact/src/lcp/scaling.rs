//! Sizes of the rows, so that tolerances mean the same in every row and in every unit system.

use super::Problem;

/// What the diagonal says about M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Diagonal {
    /// The power of two below the largest M_ii: scale_i² unit = M_ii.
    pub(super) unit: f64,
    /// All M_ii ≥ 0 and rows with M_ii = 0 are zero: necessary for positive semi-definite M.
    pub(super) may_be_semidefinite: bool,
}

/// `scale`_i = sqrt(M_ii / 2^e), with 2^e the power of two below the largest diagonal entry; 1 for rows without a diagonal.
///
/// With D = diag(scale)⁻¹ the matrix D M D has a unit diagonal (up to 2^e), w_i / scale_i and z_i scale_i
/// compare between rows. The matrix itself is not copied: its factorisation uses no square roots,
/// so that scaling by powers of two would not change a bit of it.
pub(super) fn row_scale_into(problem: &Problem, scale: &mut [f64]) -> Diagonal {
    let m = problem.m();
    let scale = &mut scale[..m];
    let mut largest = 0.0_f64;
    for (i, scale) in scale.iter_mut().enumerate() {
        *scale = problem.diagonal(i);
        largest = largest.max(*scale);
    }
    let unit = power_of_two_below(largest);
    let mut may_be_semidefinite = true;
    for (i, scale) in scale.iter_mut().enumerate() {
        if *scale <= 0.0 {
            let is_zero_row = || problem.column(i).iter().all(|&entry| entry == 0.0);
            may_be_semidefinite &= *scale == 0.0 && is_zero_row();
            *scale = unit;
        }
    }
    // Exact, as the unit is a power of two.
    let per_unit = 1.0 / unit;
    for scale in scale.iter_mut() {
        *scale = (*scale * per_unit).sqrt();
    }
    Diagonal {
        unit,
        may_be_semidefinite,
    }
}

/// Largest 2^e ≤ x, so that x / 2^e is exact and in [1, 2). 1 for x = 0.
fn power_of_two_below(x: f64) -> f64 {
    // Where 1 / 2^e would not be a normal number any more, 1 serves as well.
    let range = f64::MIN_POSITIVE..=1.0 / f64::MIN_POSITIVE;
    if !range.contains(&x) {
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
        let mut may_be = |matrix: [f64; 4]| {
            let problem = Problem::new(&matrix, &q).unwrap();
            row_scale_into(&problem, &mut scale).may_be_semidefinite
        };
        assert!(may_be([1.0, 0.0, 0.0, 1.0]));
        assert!(may_be([1.0, 0.0, 0.0, 0.0]));
        assert!(!may_be([1.0, 0.5, 0.5, 0.0]));
        assert!(!may_be([1.0, 0.0, 0.0, -1.0]));
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

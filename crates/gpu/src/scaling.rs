//! Numbers near 1, whatever the unit.

/// The largest power of two not above a positive normal number; 1 for 0. Dividing by it is exact.
pub(crate) fn power_of_two_below(value: f64) -> f64 {
    if value < f64::MIN_POSITIVE {
        // Zero or denormal: nothing physical; kept as it is.
        return 1.0;
    }
    // The exponent bits alone.
    f64::from_bits(value.to_bits() & (0x7ff << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_of_two_is_the_one_below() {
        for (value, expected) in [(1.0, 1.0), (1.99, 1.0), (6.0, 4.0), (0.3, 0.25)] {
            assert_eq!(power_of_two_below(value), expected);
        }
        assert_eq!(power_of_two_below(0.0), 1.0);
        assert_eq!(power_of_two_below(1e-310), 1.0);
    }
}

//! Coulomb's coefficient by how far a contact has slipped.

/// Static and kinetic coefficient, and the way of slip from one to the other (slip weakening):
///
/// ```text
/// μ(d) = μ_k + (μ_s - μ_k) max(0, 1 - d / D)
/// ```
/// d: way slipped since the contact last stuck. Source of the ramp: Ida 1972, J. Geophys. Res. 77(20).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// μ_s >= μ_k: where nothing has slipped yet.
    pub static_coefficient: f64,
    /// μ_k >= 0: once a contact slides.
    pub kinetic_coefficient: f64,
    /// D > 0, m.
    pub weakening_distance: f64,
}

impl Coefficients {
    /// One coefficient, whatever has slipped.
    pub fn constant(coefficient: f64) -> Self {
        Self {
            static_coefficient: coefficient,
            kinetic_coefficient: coefficient,
            weakening_distance: 1.0,
        }
    }

    /// Whether slip changes nothing.
    pub fn is_constant(&self) -> bool {
        self.static_coefficient == self.kinetic_coefficient
    }

    /// After so much slip, m >= 0.
    pub fn after(&self, slip: f64) -> f64 {
        let left = (1.0 - slip / self.weakening_distance).max(0.0);
        self.kinetic_coefficient + (self.static_coefficient - self.kinetic_coefficient) * left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn static_friction_falls_along_a_line_and_stays() {
        let of = Coefficients {
            static_coefficient: 0.5,
            kinetic_coefficient: 0.25,
            weakening_distance: 1e-4,
        };
        assert!(!of.is_constant());
        for (slip, mu) in [(0.0, 0.5), (5e-5, 0.375), (1e-4, 0.25), (1.0, 0.25)] {
            assert!((of.after(slip) - mu).abs() < 1e-15, "{slip}");
        }
        let constant = Coefficients::constant(0.3);
        assert!(constant.is_constant());
        assert_eq!((constant.after(0.0), constant.after(9.0)), (0.3, 0.3));
    }
}

//! Isotropic linear elasticity.

use crate::Error;

/// A material, checked at construction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    young_modulus: f64,
    poisson_ratio: f64,
    density: Option<f64>,
}

impl Material {
    /// `young_modulus`: Pa, positive. `poisson_ratio`: above -1 and below 0.5.
    ///
    /// # Errors
    /// If a constant is out of its range or not a number.
    pub fn new(young_modulus: f64, poisson_ratio: f64) -> Result<Self, Error> {
        if !(young_modulus > 0.0 && young_modulus.is_finite()) {
            return Err(Error::Material {
                name: "young_modulus",
                value: young_modulus,
                rule: "must be positive and finite (Pa)",
            });
        }
        if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
            return Err(Error::Material {
                name: "poisson_ratio",
                value: poisson_ratio,
                rule: "must be above -1 and below 0.5; for rubber-like parts use 0.49 with order = 3",
            });
        }
        Ok(Self {
            young_modulus,
            poisson_ratio,
            density: None,
        })
    }

    /// With a density, kg/m³, positive; only inertia and gravity need one.
    ///
    /// # Errors
    /// If it is not positive and finite.
    pub fn with_density(self, density: f64) -> Result<Self, Error> {
        if !(density > 0.0 && density.is_finite()) {
            return Err(Error::Material {
                name: "density",
                value: density,
                rule: "must be positive and finite (kg/m³)",
            });
        }
        Ok(Self {
            density: Some(density),
            ..self
        })
    }

    /// kg/m³, if given.
    pub fn density(&self) -> Option<f64> {
        self.density
    }

    /// Pa.
    pub fn young_modulus(&self) -> f64 {
        self.young_modulus
    }

    /// No unit.
    pub fn poisson_ratio(&self) -> f64 {
        self.poisson_ratio
    }

    /// E nu / ((1 + nu)(1 - 2 nu)), Pa.
    pub fn lame_lambda(&self) -> f64 {
        let nu = self.poisson_ratio;
        self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }

    /// E / (2 (1 + nu)), Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unphysical_constants_are_refused() {
        for (e, nu) in [
            (0.0, 0.3),
            (-1.0, 0.3),
            (f64::NAN, 0.3),
            (f64::INFINITY, 0.3),
            (1.0, 0.5),
            (1.0, -1.0),
            (1.0, f64::NAN),
        ] {
            assert!(Material::new(e, nu).is_err(), "{e} {nu}");
        }
        let material = Material::new(2.7e9, 0.35).unwrap();
        assert_eq!(material.density(), None);
        for rho in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(material.with_density(rho).is_err(), "{rho}");
        }
        assert_eq!(
            material.with_density(1410.0).unwrap().density(),
            Some(1410.0)
        );
    }
}

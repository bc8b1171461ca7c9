//! What the numbers of a scene file measure, and the factors from its units to SI.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Units of the scene file and of its mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Units {
    /// m, N, s, Pa, kg.
    #[default]
    #[serde(rename = "SI")]
    Si,
    /// mm, N, s, MPa, t (tonne).
    #[serde(rename = "mm-N-MPa")]
    MmNMpa,
}

/// What a number of the scene file measures, in the order of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Length,
    Time,
    Speed,
    Mass,
    Density,
    Pressure,
    Force,
    Stiffness,
    Damping,
    RotationalInertia,
    RotationalStiffness,
    RotationalDamping,
    Angle,
    Number,
}

use Quantity::*;

/// Names as the schema writes them, units in SI, units in mm-N-MPa, factor from the latter.
/// mm-N-MPa is the consistent set that mesh programs use: with mm, N and s the mass is in t.
pub(super) const TABLE: [(Quantity, &str, &str, &str, f64); 14] = [
    (Length, "length", "m", "mm", 1e-3),
    (Time, "time", "s", "s", 1.0),
    (Speed, "speed", "m/s", "mm/s", 1e-3),
    (Mass, "mass", "kg", "t", 1e3),
    (Density, "density", "kg/m³", "t/mm³", 1e12),
    (Pressure, "pressure", "Pa", "MPa", 1e6),
    (Force, "force", "N", "N", 1.0),
    (Stiffness, "stiffness", "N/m", "N/mm", 1e3),
    (Damping, "damping", "N s/m", "N s/mm", 1e3),
    (
        RotationalInertia,
        "rotational_inertia",
        "kg m²",
        "t mm²",
        1e-3,
    ),
    (
        RotationalStiffness,
        "rotational_stiffness",
        "N m/rad",
        "N mm/rad",
        1e-3,
    ),
    (
        RotationalDamping,
        "rotational_damping",
        "N m s/rad",
        "N mm s/rad",
        1e-3,
    ),
    (Angle, "angle", "deg", "deg", 1.0),
    (Number, "number", "1", "1", 1.0),
];

/// Factor from the file's unit of a quantity to SI (angles stay in degrees).
pub(super) fn to_si(units: Units, quantity: Quantity) -> f64 {
    match units {
        Units::Si => 1.0,
        Units::MmNMpa => TABLE[quantity as usize].4,
    }
}

/// Unit of a quantity in the file.
pub(super) fn label(units: Units, quantity: Quantity) -> &'static str {
    let row = &TABLE[quantity as usize];
    match units {
        Units::Si => row.2,
        Units::MmNMpa => row.3,
    }
}

/// Units of a quantity by its name in the schema: SI, mm-N-MPa.
pub(super) fn labels(name: &str) -> Option<(&'static str, &'static str)> {
    TABLE
        .iter()
        .find(|row| row.1 == name)
        .map(|row| (row.2, row.3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_order_of_the_quantities() {
        assert!((0..).zip(TABLE).all(|(row, of)| row == of.0 as usize));
    }

    /// Each factor follows from mm, t, s alone: F = m a, so 1 N = 1 t mm/s² and MPa = N/mm².
    #[test]
    fn factors_follow_from_mm_t_s() {
        let (mm, t) = (1e-3, 1e3);
        let newton: f64 = t * mm;
        assert_eq!(newton, 1.0);
        let expected = [
            (Length, mm),
            (Time, 1.0),
            (Speed, mm),
            (Mass, t),
            (Density, t / mm.powi(3)),
            (Pressure, newton / mm.powi(2)),
            (Force, newton),
            (Stiffness, newton / mm),
            (Damping, newton / mm),
            (RotationalInertia, t * mm.powi(2)),
            (RotationalStiffness, newton * mm),
            (RotationalDamping, newton * mm),
            (Angle, 1.0),
            (Number, 1.0),
        ];
        for (quantity, factor) in expected {
            let ours = to_si(Units::MmNMpa, quantity);
            assert!(
                (ours / factor - 1.0).abs() < 1e-14,
                "{quantity:?}: {ours} {factor}"
            );
            assert_eq!(to_si(Units::Si, quantity), 1.0);
        }
    }
}

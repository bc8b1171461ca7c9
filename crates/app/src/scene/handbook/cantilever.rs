//! The cantilever hook, and joints of several equal arms such as a buckle's.
//!
//! ```text
//! ε = 1.5 h y / L²          strain at the root when the arm is bent by y
//! P = (b h² / 6) E ε / L    force that bends it so
//! W = P (μ + tan α) / (1 − μ tan α)    force along the insertion, on a ramp of angle α
//! ```
//! L length, h thickness, b width, y undercut, μ friction coefficient; beam theory, so a few per
//! cent off for stubby arms (L/h below about 10), and no elasticity of the root.
//!
//! Source: Covestro (formerly Bayer MaterialScience), "Snap-Fit Joints for Plastics: A Design
//! Guide", cantilever snap joints of rectangular constant cross-section.

use super::{Measured, Predicted, Prediction, Section, leaves_ramp};
use crate::scene::SceneError;
use crate::scene::check::Range::NotNegative;

/// Dimensions of a plain cantilever hook.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cantilever {
    /// Root to catch, m, > 0.
    pub length: f64,
    /// In the bending direction, m, > 0.
    pub thickness: f64,
    /// m, > 0.
    pub width: f64,
    /// Deflection that lets the catch pass, m, > 0.
    pub undercut: f64,
    /// Ramp to the direction of insertion, degrees, in (0, 90).
    pub lead_angle_deg: f64,
    /// Coulomb's coefficient, >= 0, with `friction tan(lead_angle) < 1` (else the ramp locks).
    pub friction: f64,
    /// Equal arms that are bent at once, >= 1.
    pub arms: u32,
    /// Which body has the ramp.
    pub ramp: Ramp,
    /// Radius of the edge at which the ramp is left, m, >= 0; 0 is a sharp one.
    pub edge_radius: f64,
    /// Part of the joint that the mesh is, in (0, 1]: 0.5 for half of it.
    pub share: f64,
}

/// Which body has the ramp: one on the bent arm turns with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ramp {
    /// on the arm, so that it gets steeper by the arm's slope.
    #[default]
    Part,
    /// on the tool.
    Tool,
}

impl Cantilever {
    pub(super) fn checked(section: &Section<'_>) -> Result<Self, SceneError> {
        let (keys, check) = (section.keys, section.check);
        let angle = section.required("lead_angle_deg", keys.lead_angle_deg)?;
        let arm = Self {
            length: section.length("length", keys.length)?,
            thickness: section.thickness()?,
            width: section.length("width", keys.width)?,
            undercut: section.length("undercut", keys.undercut)?,
            lead_angle_deg: section.slope("lead_angle_deg", angle)?,
            friction: check.number_or("friction", keys.friction, 0.0, NotNegative)?,
            arms: match keys.arms {
                Some(arms) => check.whole("arms", arms)?,
                None => 1,
            },
            ramp: keys.ramp.map_or_else(Ramp::default, |at| at.value),
            edge_radius: section.edge_radius()?,
            share: section.share()?,
        };
        if let Some(friction) = keys.friction.filter(|_| arm.is_locked()) {
            let what = format!(
                "friction {} locks a ramp of {} degrees",
                arm.friction, arm.lead_angle_deg
            );
            let mend = "friction times tan(lead angle) must be below 1";
            return Err(check.error(friction.offset, what, mend));
        }
        Ok(arm)
    }

    /// Largest strain when the arm is bent by the undercut.
    pub fn strain(&self) -> f64 {
        1.5 * self.thickness * self.undercut / (self.length * self.length)
    }

    /// Force across one arm that bends it by the undercut, N. `young_modulus` in Pa; handbooks
    /// take the secant modulus at the strain.
    pub fn deflection_force(&self, young_modulus: f64) -> f64 {
        bending_force(
            self.width,
            self.thickness,
            self.length,
            young_modulus,
            self.strain(),
        )
    }

    /// Peak force of one arm along the insertion, N, >= 0.
    pub fn mating_force(&self, young_modulus: f64) -> f64 {
        on_ramp(
            self.deflection_force(young_modulus),
            self.lead_angle_deg,
            self.friction,
        )
    }

    /// Travel from first touch to the undercut along the ramp, m.
    pub fn ramp_travel(&self) -> f64 {
        self.undercut / self.lead_angle_deg.to_radians().tan()
    }

    /// Force of one arm along the insertion at a travel from first touch on: grows linearly along the ramp,
    /// then zero (frictionless top). N.
    pub fn force_at(&self, travel: f64, young_modulus: f64) -> f64 {
        let ramp = self.ramp_travel();
        if travel > 0.0 && travel <= ramp {
            self.mating_force(young_modulus) * travel / ramp
        } else {
            0.0
        }
    }

    /// One arm's force-travel curve by its corners, as (travel from first touch in m, force in N): nothing
    /// before the touch, a straight rise, the fall at the edge, and as much again of nothing.
    pub fn curve(&self, young_modulus: f64) -> [(f64, f64); 4] {
        let (ramp, peak) = (self.ramp_travel(), self.mating_force(young_modulus));
        [(0.0, 0.0), (ramp, peak), (ramp, 0.0), (2.0 * ramp, 0.0)]
    }

    /// Whether friction keeps the catch from sliding up the ramp however hard it is pushed.
    pub fn is_locked(&self) -> bool {
        self.friction * self.lead_angle_deg.to_radians().tan() >= 1.0
    }

    /// What the formulas say without friction, and with that which is simulated. `young_modulus` in Pa.
    pub(super) fn predict(&self, young_modulus: f64, friction: f64) -> Prediction {
        let frictionless = Self {
            friction: 0.0,
            ..*self
        };
        let arms = f64::from(self.arms) * self.share;
        let force = |label, what, value: f64| Predicted {
            label,
            what,
            value: arms * value,
        };
        let mut rows = vec![force(
            "mating force",
            Measured::Insertion,
            frictionless.mating_force(young_modulus),
        )];
        if self.arms == 1 {
            // Of several arms, the forces across cancel.
            rows.push(force(
                "largest force across",
                Measured::Across,
                frictionless.deflection_force(young_modulus),
            ));
        }
        if self.edge_radius > 0.0 {
            rows.extend(
                frictionless.rounded(young_modulus).map(|value| {
                    force("mating force of a rounded edge", Measured::Insertion, value)
                }),
            );
        }
        let own = if self.friction > 0.0 {
            self.friction
        } else {
            friction
        };
        let rubbing = Self {
            friction: own,
            ..*self
        };
        if friction > 0.0 && !rubbing.is_locked() {
            let mating = rubbing.mating_force(young_modulus);
            rows.push(force(
                "mating force with friction",
                Measured::InsertionWithFriction,
                mating,
            ));
            if self.edge_radius > 0.0 {
                rows.extend(rubbing.rounded(young_modulus).map(|value| {
                    let label = "with friction, of a rounded edge";
                    force(label, Measured::InsertionWithFriction, value)
                }));
            }
        }
        rows.push(Predicted {
            label: "largest strain",
            what: Measured::Strain,
            value: self.strain(),
        });
        Prediction {
            name: self.name(),
            rows,
            curve: frictionless
                .curve(young_modulus)
                .map(|(travel, force)| (travel, arms * force))
                .to_vec(),
        }
    }

    /// Peak force of one arm where a rounded edge leaves the ramp, N: before the arm is fully bent,
    /// the bottom of the edge being still r (1 - cos α) above the height of its contact. A ramp on
    /// the bent arm has been turned by the slope at its end, 3 y / (2 L). `None`: the edge is too
    /// round to touch the ramp.
    fn rounded(&self, young_modulus: f64) -> Option<f64> {
        let lead = self.lead_angle_deg.to_radians();
        let (bent, angle) = leaves_ramp(self.undercut, self.edge_radius, lead)?;
        let turned = match self.ramp {
            Ramp::Part => angle + 1.5 * bent / self.length,
            Ramp::Tool => angle,
        };
        let across = self.deflection_force(young_modulus) * bent / self.undercut;
        Some(on_ramp(across, turned.to_degrees(), self.friction))
    }

    fn name(&self) -> String {
        let who = match self.arms {
            1 => "cantilever snap hook without friction".to_owned(),
            n => format!("{n} cantilever arms without friction"),
        };
        let turned = match self.ramp {
            Ramp::Part => ", with the ramp turned by the arm's slope 3 y/(2 L)",
            Ramp::Tool => "",
        };
        let each = if self.arms == 1 { "" } else { " each" };
        format!(
            "{who}: P = (b h²/6) E ε/L{each}, ε = 1.5 h y/L², W = P tan α; a rounded edge of radius r \
             leaves the ramp at y - r (1 - cos α){turned}"
        )
    }
}

fn bending_force(width: f64, thickness: f64, length: f64, modulus: f64, strain: f64) -> f64 {
    width * thickness * thickness / 6.0 * modulus * strain / length
}

fn on_ramp(force: f64, angle_deg: f64, friction: f64) -> f64 {
    let slope = angle_deg.to_radians().tan();
    force * (friction + slope) / (1.0 - friction * slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOOK: Cantilever = Cantilever {
        length: 0.02,
        thickness: 0.002,
        width: 0.006,
        undercut: 0.001,
        lead_angle_deg: 30.0,
        friction: 0.25,
        arms: 1,
        ramp: Ramp::Part,
        edge_radius: 0.0,
        share: 1.0,
    };

    /// The design guide's example of a polycarbonate hook that tapers to half its thickness:
    /// L 19, b 9.5, h 3.28 mm, ε 2 %, secant modulus 1815 MPa, α 30°, μ 0.6: P 32.5 N, W 58.5 N.
    /// The guide rounds to three digits, hence 0.5 %.
    #[test]
    fn forces_match_the_design_guides_example() {
        let force = bending_force(9.5e-3, 3.28e-3, 19e-3, 1815e6, 0.02);
        assert!((force / 32.5 - 1.0).abs() < 5e-3, "{force}");
        let mating = on_ramp(force, 30.0, 0.6);
        assert!((mating / 58.5 - 1.0).abs() < 5e-3, "{mating}");
    }

    /// Beam theory: P = 3 E I y / L³ with I = b h³/12, and ε = M (h/2) / (E I) with M = P L.
    #[test]
    fn formulas_are_those_of_the_beam() {
        let (modulus, h) = (1.3e9, HOOK.thickness);
        let inertia = HOOK.width * h.powi(3) / 12.0;
        let force = 3.0 * modulus * inertia * HOOK.undercut / HOOK.length.powi(3);
        assert!((HOOK.deflection_force(modulus) / force - 1.0).abs() < 1e-12);
        let strain = force * HOOK.length * h / 2.0 / (modulus * inertia);
        assert!((HOOK.strain() / strain - 1.0).abs() < 1e-12);
    }

    /// Without friction the work along the ramp is the energy of the bent arm: ½ W s = ½ P y.
    #[test]
    fn curve_without_friction_conserves_energy() {
        let hook = Cantilever {
            friction: 0.0,
            ..HOOK
        };
        let work = 0.5 * hook.mating_force(1.3e9) * hook.ramp_travel();
        let energy = 0.5 * hook.deflection_force(1.3e9) * hook.undercut;
        assert!((work / energy - 1.0).abs() < 1e-12, "{work} {energy}");
    }

    #[test]
    fn curve_is_zero_outside_the_ramp_and_linear_on_it() {
        let (ramp, peak) = (HOOK.ramp_travel(), HOOK.mating_force(1.3e9));
        assert_eq!(HOOK.force_at(-1e-6, 1.3e9), 0.0);
        assert_eq!(HOOK.force_at(1.01 * ramp, 1.3e9), 0.0);
        assert!((HOOK.force_at(0.25 * ramp, 1.3e9) / peak - 0.25).abs() < 1e-12);
        assert_eq!(HOOK.curve(1.3e9)[1], (ramp, peak));
    }

    #[test]
    fn steep_rough_ramp_is_locked() {
        assert!(!HOOK.is_locked());
        assert!(
            Cantilever {
                lead_angle_deg: 80.0,
                ..HOOK
            }
            .is_locked()
        );
    }
}

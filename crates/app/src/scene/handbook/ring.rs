//! The C-shaped ring that a round bar opens: a clip for a cable or a tube.
//!
//! Each arm is a curved beam in bending, clamped where it leaves the foot. Castigliano's theorem gives
//! the displacement of the lip under a force with components along x (sideways) and y (against the
//! insertion), with R the middle radius and m the moment at an angle θ per unit of force:
//! ```text
//! c_ij = R/(E I) ∫ m_i m_j dθ       m_x = −(y_lip + R cos θ)     m_y = x_lip − R sin θ
//! ```
//! (θ from the foot's side, −y, to the lip.) The bar of radius r touches the lip's inner edge at an angle
//! ψ to the insertion and pushes along its own radius, n = (sin ψ, −cos ψ). The lip must lie on the bar:
//! ```text
//! N = (r sin ψ − x_lip) / (c_xx n_x + c_xy n_y)      W = 2 N cos ψ
//! ```
//! from the first touch, sin ψ = x_lip / r, to the crest, ψ = 90°, and beyond.
//!
//! Source: Timoshenko, "Strength of Materials", part I, curved bars of small curvature (deflection by
//! Castigliano's theorem); the contact is geometry. Bending only, exact for R much larger than the wall:
//! about 1 % too stiff at R = 5 h by shear and stretching, and more by what the foot gives way.

use std::f64::consts::PI;

use super::{Measured, Predicted, Prediction, Section};
use crate::scene::SceneError;
use crate::scene::check::Range::{NotNegative, Positive};

/// Dimensions of a ring with an opening, and of the bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Inside of the ring, m, > 0.
    pub radius: f64,
    /// Of the wall, m, > 0.
    pub thickness: f64,
    /// Along the bar, m, > 0.
    pub width: f64,
    /// Lip to lip, seen from the ring's centre, degrees, in (0, 180].
    pub opening_deg: f64,
    /// Where the arm leaves the foot, from the direction opposite to the opening, degrees, >= 0 and
    /// before the lip.
    pub root_angle_deg: f64,
    /// Of the bar, m, larger than half of the opening.
    pub rod_radius: f64,
    /// Part of the joint that the mesh is, in (0, 1]: 0.5 for one of the two arms.
    pub share: f64,
}

/// The bar at one place on its way.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Of the bar from the first touch on, m.
    travel: f64,
    /// Along the insertion, both arms, N.
    force: f64,
}

impl Ring {
    pub(super) fn checked(section: &Section<'_>) -> Result<Self, SceneError> {
        let (keys, check) = (section.keys, section.check);
        let opening = section.required("opening_deg", keys.opening_deg)?;
        let rod = keys.rod_radius.or(section.tool.cylinder_radius());
        let rod = section.required("rod_radius", rod)?;
        let root = keys.root_angle_deg;
        let ring = Self {
            radius: section.length("radius", keys.radius)?,
            thickness: section.thickness()?,
            width: section.length("width", keys.width)?,
            opening_deg: check.number("opening_deg", opening, Positive)?,
            root_angle_deg: check.number_or("root_angle_deg", root, 0.0, NotNegative)?,
            rod_radius: check.number("rod_radius", rod, Positive)?,
            share: section.share()?,
        };
        if ring.opening_deg > 180.0 {
            let what = format!(
                "opening_deg {} is more than half of the ring",
                ring.opening_deg
            );
            let mend = "write 180 or less: a ring that is more open holds nothing";
            return Err(check.error(opening.offset, what, mend));
        }
        let lip = 180.0 - 0.5 * ring.opening_deg;
        if let Some(root) = root.filter(|_| ring.root_angle_deg >= lip) {
            let what = format!(
                "root_angle_deg {} leaves no arm before the lip at {lip}",
                ring.root_angle_deg
            );
            return Err(check.error(root.offset, what, "both count from the foot's middle"));
        }
        if ring.rod_radius <= ring.half_opening() {
            let what = format!("rod_radius {} passes the opening untouched", rod.value.0);
            let mend = "radius sin(opening_deg / 2) must be below it";
            return Err(check.error(rod.offset, what, mend));
        }
        Ok(ring)
    }

    fn lip(&self) -> (f64, f64) {
        let half = 0.5 * self.opening_deg.to_radians();
        (self.radius * half.sin(), self.radius * half.cos())
    }

    /// Half of the opening between the lips, m.
    pub fn half_opening(&self) -> f64 {
        self.lip().0
    }

    fn middle(&self) -> f64 {
        self.radius + 0.5 * self.thickness
    }

    fn bending_stiffness(&self, young_modulus: f64) -> f64 {
        young_modulus * self.width * self.thickness.powi(3) / 12.0
    }

    /// Compliances c_xx, c_xy, c_yy of one lip, m/N.
    fn compliance(&self, young_modulus: f64) -> [f64; 3] {
        let (x, y) = self.lip();
        let r = self.middle();
        let from = self.root_angle_deg.to_radians();
        let to = PI - 0.5 * self.opening_deg.to_radians();
        let arc = to - from;
        let cos = to.sin() - from.sin();
        let sin = from.cos() - to.cos();
        let twice = 0.25 * ((2.0 * to).sin() - (2.0 * from).sin());
        let product = 0.5 * (to.sin().powi(2) - from.sin().powi(2));
        let factor = r / self.bending_stiffness(young_modulus);
        [
            factor * (y * y * arc + 2.0 * y * r * cos + r * r * (0.5 * arc + twice)),
            -factor * (x * y * arc - y * r * sin + x * r * cos - r * r * product),
            factor * (x * x * arc - 2.0 * x * r * sin + r * r * (0.5 * arc - twice)),
        ]
    }

    /// The way from the first touch to where the lips are free behind the bar.
    fn way(&self, young_modulus: f64, steps: u32) -> Vec<Place> {
        let (x, y) = self.lip();
        let [xx, xy, yy] = self.compliance(young_modulus);
        let first = (x / self.rod_radius).clamp(0.0, 1.0).asin();
        let place = |i: u32| {
            let angle = first + (PI - 2.0 * first) * f64::from(i) / f64::from(steps);
            let (nx, ny) = (angle.sin(), -angle.cos());
            let normal = ((self.rod_radius * nx - x) / (xx * nx + xy * ny)).max(0.0);
            let lip = y + normal * (xy * nx + yy * ny);
            (
                lip + self.rod_radius * angle.cos(),
                2.0 * normal * angle.cos(),
            )
        };
        let start = place(0).0;
        (0..=steps)
            .map(|i| {
                let (height, force) = place(i);
                Place {
                    travel: start - height,
                    force: self.share * force,
                }
            })
            .collect()
    }

    /// Strain at the root when the lips are widest.
    pub fn strain(&self) -> f64 {
        let (x, y) = self.lip();
        let [xx, ..] = self.compliance(1.0);
        let normal = (self.rod_radius - x) / xx;
        let arm = y + self.middle() * self.root_angle_deg.to_radians().cos();
        0.5 * self.thickness * normal * arm / self.bending_stiffness(1.0)
    }

    pub(super) fn predict(&self, young_modulus: f64) -> Prediction {
        let fine = self.way(young_modulus, 2000);
        let row = |label, what, value| Predicted { label, what, value };
        let largest = |sign: f64| fine.iter().map(|p| sign * p.force).fold(0.0, f64::max);
        Prediction {
            name: "C-shaped ring without friction: two curved beams clamped at the foot, the lips' displacement \
                   by Castigliano's theorem, W = 2 N cos ψ with the lip's edge on the bar"
                .to_owned(),
            rows: vec![
                row("mating force", Measured::Insertion, largest(1.0)),
                row("removal force", Measured::Removal, largest(-1.0)),
                row("largest strain", Measured::Strain, self.strain()),
            ],
            curve: self
                .way(young_modulus, 48)
                .iter()
                .map(|p| (p.travel, p.force))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLIP: Ring = Ring {
        radius: 6.1e-3,
        thickness: 1.4e-3,
        width: 8e-3,
        opening_deg: 120.0,
        root_angle_deg: 25.0,
        rod_radius: 6e-3,
        share: 1.0,
    };

    /// The integrals against Simpson's rule with 2000 intervals.
    #[test]
    fn compliances_are_the_integrals() {
        let (x, y) = CLIP.lip();
        let r = CLIP.middle();
        let (from, to) = (25f64.to_radians(), 120f64.to_radians());
        let n = 2000;
        let h = (to - from) / f64::from(n);
        let mut sums = [0.0; 3];
        for i in 0..=n {
            let angle = from + h * f64::from(i);
            let weight = match i {
                0 => 1.0,
                i if i == n => 1.0,
                i if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            let (mx, my) = (-(y + r * angle.cos()), x - r * angle.sin());
            for (sum, product) in sums.iter_mut().zip([mx * mx, mx * my, my * my]) {
                *sum += weight * h / 3.0 * product * r / CLIP.bending_stiffness(2.7e9);
            }
        }
        for (closed, sum) in CLIP.compliance(2.7e9).iter().zip(sums) {
            assert!((closed / sum - 1.0).abs() < 1e-9, "{closed} {sum}");
        }
    }

    /// An arm of 90 degrees from the foot, pushed sideways at its middle line: π/4 P R³ / (E I) along
    /// the force (Timoshenko), here with a wall so thin that edge and middle line are one.
    #[test]
    fn quarter_circle_gives_way_as_in_the_textbook() {
        let thin = Ring {
            thickness: 1e-9,
            opening_deg: 180.0,
            root_angle_deg: 0.0,
            ..CLIP
        };
        let [xx, xy, yy] = thin.compliance(1e9);
        let unit = thin.middle().powi(3) / thin.bending_stiffness(1e9);
        assert!((xx / unit / (PI / 4.0) - 1.0).abs() < 1e-6);
        // Across: ∫ (1 − sin θ)² = 3π/4 − 2, and ∫ −cos θ (1 − sin θ) = −1/2.
        assert!((yy / unit - (0.75 * PI - 2.0)).abs() < 1e-6);
        assert!((xy / unit + 0.5).abs() < 1e-6);
    }

    /// Without the coupling of the two directions the peak is at x³ = w₀ r²; what the coupling
    /// changes here is below 10 %.
    #[test]
    fn peak_is_near_that_of_lips_that_move_sideways_only() {
        let (w, r) = (CLIP.half_opening(), CLIP.rod_radius);
        let x = (w * r * r).cbrt();
        let [xx, ..] = CLIP.compliance(2.7e9);
        let plain = 2.0 / xx * (x - w) * (r * r - x * x).sqrt() / x;
        let full = CLIP.predict(2.7e9).rows[0].value;
        assert!((full / plain - 1.0).abs() < 0.1, "{full} {plain}");
    }

    /// Without friction nothing is lost: what the bar puts in to the crest comes back behind it.
    #[test]
    fn work_to_the_crest_comes_back() {
        let way = CLIP.way(2.7e9, 20_000);
        let work = |from: usize, to: usize| -> f64 {
            way[from..=to]
                .windows(2)
                .map(|w| 0.5 * (w[0].force + w[1].force) * (w[1].travel - w[0].travel))
                .sum()
        };
        let (up, down) = (work(0, 10_000), work(10_000, 20_000));
        assert!(up > 0.0 && (down / up + 1.0).abs() < 1e-3, "{up} {down}");
        // Energy at the crest, both arms: (r − w)² / c_xx.
        let [xx, ..] = CLIP.compliance(2.7e9);
        let energy = (CLIP.rod_radius - CLIP.half_opening()).powi(2) / xx;
        assert!((up / energy - 1.0).abs() < 1e-3, "{up} {energy}");
    }
}

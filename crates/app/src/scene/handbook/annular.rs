//! The annular joint: a round wall with a bead inside is widened by a rigid spigot.
//!
//! The handbook's estimate, with y the undercut on the diameter, d and d₀ the wall's inner and outer
//! diameter, α the ramp's angle:
//! ```text
//! W = y d E X tan α          bead at the wall's open end; 3 to 4 times as much far from it
//! X = 0.62 √((d₀/d − 1)/(d₀/d + 1)) / ((d₀²/d² + 1)/(d₀²/d² − 1) + ν)
//! ```
//! Source: Bayer, "Snap-Fit Joints for Plastics: A Design Guide", annular snap joints, pages 21 and
//! 22 (far: at least 1.8 √(d t) from the end; four times in theory, rarely more than three in tests).
//!
//! Shell theory, with q the ring load per length and u the widening at the bead, both on the middle
//! radius a of a wall of thickness t:
//! ```text
//! β = (3 (1 − ν²))^¼ / √(a t)     k = E t / a²     ξ = β s,  s from the open end to the bead
//! u = q [β/2 (1 + 2 D² + C²) − 2 β² c D² tan α] / k
//! C = e^−ξ (cos ξ − sin ξ)        D = e^−ξ cos ξ
//! W = 2 π a q tan α
//! ```
//! The first term is a semi-infinite beam on an elastic foundation under a load at a distance from its
//! free end, 4 times as soft at the end (ξ = 0) as far from it; the second the moment q tan α c of the
//! force along the axis, which acts c inside the wall's middle. On the way out that force points the
//! other way. The wall is taken as long: at least about 3/β.
//! Source: Hetényi, "Beams on Elastic Foundation", 1946, chapter II (infinite beam, and free end by
//! superposition of end conditioning forces); Timoshenko and Woinowsky-Krieger, "Theory of Plates and
//! Shells", 1959, section 114 (a wall under a load round its axis is such a beam).

use super::{Measured, Predicted, Prediction, Section, leaves_ramp};
use crate::scene::check::Range::NotNegative;
use crate::scene::{Material, SceneError};

/// Dimensions of a round wall with a bead, and of the spigot's bead, which has the ramps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Annular {
    /// Inside of the wall, m, > 0.
    pub diameter: f64,
    /// Of the wall, m, > 0.
    pub thickness: f64,
    /// By how much the bead's radius must grow, m, > 0.
    pub undercut: f64,
    /// Of the bead above the wall's inside, m, >= 0 and less than half of the diameter.
    pub bead_height: f64,
    /// Open end to the bead's crest, m, >= 0.
    pub from_end: f64,
    /// Ramp to the axis, degrees, in (0, 90).
    pub lead_angle_deg: f64,
    /// Slope behind the crest, degrees, in (0, 90).
    pub return_angle_deg: Option<f64>,
    /// Radius of the spigot's crest between the two, m, >= 0.
    pub edge_radius: f64,
    /// Part of the joint that the mesh is, in (0, 1]: 0.25 for a quarter.
    pub share: f64,
}

/// Which way the spigot goes.
#[derive(Clone, Copy)]
enum Way {
    In,
    Out,
}

impl Annular {
    pub(super) fn checked(section: &Section<'_>, material: &Material) -> Result<Self, SceneError> {
        let (keys, check) = (section.keys, section.check);
        let lead = section.required("lead_angle_deg", keys.lead_angle_deg)?;
        let back = keys.return_angle_deg;
        let cap = Self {
            diameter: section.length("diameter", keys.diameter)?,
            thickness: section.thickness()?,
            undercut: section.length("undercut", keys.undercut)?,
            bead_height: check.number_or("bead_height", keys.bead_height, 0.0, NotNegative)?,
            from_end: check.number_or("from_end", keys.from_end, 0.0, NotNegative)?,
            lead_angle_deg: section.slope("lead_angle_deg", lead)?,
            return_angle_deg: back
                .map(|back| section.slope("return_angle_deg", back))
                .transpose()?,
            edge_radius: section.edge_radius()?,
            share: section.share()?,
        };
        if let Some(bead) = keys.bead_height
            && cap.bead_height >= 0.5 * cap.diameter
        {
            let what = format!("bead_height {} fills the wall's inside", bead.value.0);
            let mend = "it counts from the wall's inside to the bead's crest";
            return Err(check.error(bead.offset, what, mend));
        }
        if cap.is_locked(material.poisson_ratio) {
            let what = format!("a ramp of {} degrees closes this bead", cap.lead_angle_deg);
            let mend = "the formula has no answer for so high a bead on so steep a ramp: lower one of them";
            return Err(check.error(lead.offset, what, mend));
        }
        Ok(cap)
    }

    /// The handbook's peak force for a bead at the wall's open end, N.
    pub fn handbook_force(&self, young_modulus: f64, poisson_ratio: f64) -> f64 {
        let ratio = 1.0 + 2.0 * self.thickness / self.diameter;
        let square = ratio * ratio;
        let factor = 0.62 * ((ratio - 1.0) / (ratio + 1.0)).sqrt()
            / ((square + 1.0) / (square - 1.0) + poisson_ratio);
        let across = 2.0 * self.undercut * self.diameter * young_modulus * factor;
        self.share * across * self.lead_angle_deg.to_radians().tan()
    }

    /// Strain round the axis when the bead is widened by the undercut.
    pub fn hoop_strain(&self) -> f64 {
        self.undercut / (0.5 * self.diameter - self.bead_height)
    }

    /// Force along the axis at a widening u (m) with the contact at an angle (rad), N.
    fn shell_force(&self, modulus: f64, poisson: f64, widening: f64, angle: f64, way: Way) -> f64 {
        let middle = 0.5 * (self.diameter + self.thickness);
        let beta = (3.0 * (1.0 - poisson * poisson)).powf(0.25) / (middle * self.thickness).sqrt();
        let foundation = modulus * self.thickness / (middle * middle);
        let end = beta * self.from_end;
        let decay = (-end).exp();
        let d = decay * end.cos();
        let c = decay * (end.cos() - end.sin());
        let inside = 0.5 * self.thickness + self.bead_height;
        let moment = 2.0 * beta * beta * inside * d * d * angle.tan();
        let sign = match way {
            Way::In => -1.0,
            Way::Out => 1.0,
        };
        let softness = 0.5 * beta * (1.0 + 2.0 * d * d + c * c) + sign * moment;
        let load = widening * foundation / softness;
        self.share * 2.0 * std::f64::consts::PI * middle * load * angle.tan()
    }

    /// Whether the axial force's moment closes the bead as fast as its radial force opens it, so
    /// that the formula has no answer: a thick bead on a steep ramp.
    pub fn is_locked(&self, poisson_ratio: f64) -> bool {
        let angle = self.lead_angle_deg.to_radians();
        self.shell_force(1.0, poisson_ratio, 1.0, angle, Way::In) <= 0.0
    }

    pub(super) fn predict(&self, modulus: f64, poisson: f64) -> Prediction {
        let near = self.handbook_force(modulus, poisson);
        let row = |label, what, value| Predicted { label, what, value };
        let mut rows = vec![
            row(
                "mating force, handbook, bead at the end",
                Measured::Insertion,
                near,
            ),
            row(
                "mating force, handbook, bead far from the end (3 times)",
                Measured::Insertion,
                3.0 * near,
            ),
        ];
        let lead = self.lead_angle_deg.to_radians();
        if let Some((y, a)) = leaves_ramp(self.undercut, self.edge_radius, lead) {
            let force = self.shell_force(modulus, poisson, y, a, Way::In);
            rows.push(row(
                "mating force, shell theory",
                Measured::Insertion,
                force,
            ));
        }
        if let Some((y, a)) = self
            .return_angle_deg
            .and_then(|back| leaves_ramp(self.undercut, self.edge_radius, back.to_radians()))
        {
            let force = self.shell_force(modulus, poisson, y, a, Way::Out);
            rows.push(row("removal force, shell theory", Measured::Removal, force));
        }
        rows.push(row(
            "strain round the axis",
            Measured::Strain,
            self.hoop_strain(),
        ));
        Prediction {
            name: "annular joint without friction: handbook W = y d E X tan α with y on the diameter; shell \
                   theory: a long wall under a ring load at the bead's distance from the open end, with the \
                   moment of the force along the axis, where the spigot's round edge of radius r leaves its \
                   ramp, at a widening of u - r (1 - cos α)"
                .to_owned(),
            rows,
            curve: self.curve(modulus, poisson),
        }
    }

    /// Shell theory's force over the travel from the first touch on, to where the bead is free
    /// again or, without a return angle, at the crest: the ramp, the round, the return.
    fn curve(&self, modulus: f64, poisson: f64) -> Vec<(f64, f64)> {
        let (u, r) = (self.undercut, self.edge_radius);
        let widening = |a: f64| u - r * (1.0 - a.cos());
        let lead = self.lead_angle_deg.to_radians();
        // A round that stands out by less than the undercut is first touched on the ramp.
        let touch = |slope: f64| match widening(slope) {
            y if y > 0.0 => (slope, y / slope.tan()),
            _ => ((1.0 - u / r).acos(), 0.0),
        };
        let (first, straight) = touch(lead);
        let crest = straight + r * first.sin();
        let mut curve = vec![(0.0, 0.0)];
        let mut add = |travel: f64, y: f64, a: f64, sign: f64| {
            // The moment's sign follows the force along the axis, which pulls the cap home here.
            let way = if sign > 0.0 { Way::In } else { Way::Out };
            curve.push((travel, sign * self.shell_force(modulus, poisson, y, a, way)));
        };
        const STEPS: u32 = 12;
        for i in 0..=STEPS {
            let a = first * f64::from(STEPS - i) / f64::from(STEPS);
            add(crest - r * a.sin(), widening(a).max(0.0), a, 1.0);
        }
        if let Some(back) = self.return_angle_deg {
            let (last, straight) = touch(back.to_radians());
            for i in 0..=STEPS {
                let a = last * f64::from(i) / f64::from(STEPS);
                add(crest + r * a.sin(), widening(a).max(0.0), a, -1.0);
            }
            curve.push((crest + r * last.sin() + straight, 0.0));
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAP: Annular = Annular {
        diameter: 25.2e-3,
        thickness: 1e-3,
        undercut: 0.2e-3,
        bead_height: 0.0,
        from_end: 0.0,
        lead_angle_deg: 25.0,
        return_angle_deg: Some(45.0),
        edge_radius: 0.0,
        share: 1.0,
    };

    /// Far from the end and without the moment: Timoshenko's u = q a² β / (2 E t); at the end, by a
    /// load across alone, u = 2 q a² β / (E t), four times as much.
    #[test]
    fn wall_is_four_times_as_soft_at_its_end() {
        let (modulus, nu) = (1e9, 0.4f64);
        let far = Annular {
            from_end: 1.0,
            ..CAP
        };
        // So flat a ramp that the moment is nothing.
        let angle = 1e-9;
        let load = |cap: &Annular| {
            let middle = 0.5 * (cap.diameter + cap.thickness);
            cap.shell_force(modulus, nu, 1e-4, angle, Way::In)
                / (2.0 * std::f64::consts::PI * middle * angle)
        };
        let middle = 13.1e-3f64;
        let beta = (3.0 * (1.0 - nu * nu)).powf(0.25) / (middle * 1e-3).sqrt();
        let expected = 2.0 * modulus * 1e-3 * 1e-4 / (middle * middle * beta);
        assert!((load(&far) / expected - 1.0).abs() < 1e-6);
        assert!((load(&far) / load(&CAP) - 4.0).abs() < 1e-6);
    }

    /// The beam itself, solved by differences: E I u'''' + k u = load and couple at the bead, free
    /// ends, a wall of 12/β. 1 %: 1500 cells, with the couple as a pair of loads.
    #[test]
    fn bead_at_a_distance_agrees_with_the_solved_beam() {
        let cap = Annular {
            from_end: 1e-3,
            bead_height: 0.6e-3,
            ..CAP
        };
        let (modulus, nu, u) = (1.3e9, 0.42f64, 1e-4);
        let (middle, t) = (13.1e-3f64, 1e-3f64);
        let beta = (3.0 * (1.0 - nu * nu)).powf(0.25) / (middle * t).sqrt();
        let plate = modulus * t.powi(3) / (12.0 * (1.0 - nu * nu));
        let foundation = modulus * t / (middle * middle);
        let angle = cap.lead_angle_deg.to_radians();
        // Energy of cubic-free form: curvature at inner nodes by second differences.
        let n = 1500u32;
        let h = 12.0 / beta / f64::from(n);
        let n = n as usize;
        let mut band = vec![[0.0; 5]; n + 1];
        for i in 1..n {
            let s = [1.0, -2.0, 1.0];
            for (a, sa) in s.iter().enumerate() {
                for (b, sb) in s.iter().enumerate() {
                    band[i - 1 + a][b + 2 - a] += plate / h.powi(3) * sa * sb;
                }
            }
        }
        for (i, row) in band.iter_mut().enumerate() {
            row[2] += foundation * if i == 0 || i == n { 0.5 * h } else { h };
        }
        let at = (cap.from_end / h).round() as usize;
        let couple = (0.5 * t + cap.bead_height) * angle.tan();
        let mut load = vec![0.0; n + 1];
        load[at] += 1.0;
        // The inward push turns the end outwards less: it lifts the side away from the end.
        load[at - 1] -= couple / (2.0 * h);
        load[at + 1] += couple / (2.0 * h);
        // Elimination of the band without pivoting: the matrix is positive definite.
        for i in 0..=n {
            for k in 1..=2usize.min(n - i) {
                let factor = band[i + k][2 - k] / band[i][2];
                for j in 0..=2usize.min(n - i) {
                    band[i + k][2 + j - k] -= factor * band[i][2 + j];
                }
                load[i + k] -= factor * load[i];
            }
        }
        let mut x = vec![0.0; n + 1];
        for i in (0..=n).rev() {
            let known: f64 = (1..=2usize.min(n - i))
                .map(|j| band[i][2 + j] * x[i + j])
                .sum();
            x[i] = (load[i] - known) / band[i][2];
        }
        let expected = 2.0 * std::f64::consts::PI * middle * u / x[at] * angle.tan();
        let force = cap.shell_force(modulus, nu, u, angle, Way::In);
        assert!((force / expected - 1.0).abs() < 0.01, "{force} {expected}");
    }

    /// Bayer's factor for d₀/d = 1.08 and ν = 0.4 by hand: (0.08/2.08)^½ = 0.19612; (1.1664 + 1) /
    /// 0.1664 = 13.0192; X = 0.62 · 0.19612 / 13.4192 = 0.0090611.
    #[test]
    fn handbook_force_is_that_by_hand() {
        let cap = Annular {
            diameter: 25e-3,
            ..CAP
        };
        let expected = 0.4e-3 * 25e-3 * 1e9 * 0.0090611 * 25f64.to_radians().tan();
        assert!((cap.handbook_force(1e9, 0.4) / expected - 1.0).abs() < 1e-4);
    }

    /// A quarter has a quarter of the force; the curve peaks at the formula's force, and is nothing
    /// at both ends.
    #[test]
    fn curve_peaks_at_the_formulas_force() {
        let cap = Annular {
            edge_radius: 0.5e-3,
            bead_height: 0.6e-3,
            from_end: 1e-3,
            ..CAP
        };
        let whole = cap.predict(1.3e9, 0.42);
        let quarter = Annular { share: 0.25, ..cap }.predict(1.3e9, 0.42);
        let peak = |p: &Prediction| p.curve.iter().map(|c| c.1).fold(0.0, f64::max);
        let mating = whole.rows[2];
        assert_eq!(mating.label, "mating force, shell theory");
        assert!((peak(&whole) / mating.value - 1.0).abs() < 1e-9);
        assert!((peak(&whole) / peak(&quarter) - 4.0).abs() < 1e-9);
        assert_eq!(whole.curve[0], (0.0, 0.0));
        assert_eq!(whole.curve.last().unwrap().1, 0.0);
        assert!(whole.curve.windows(2).all(|w| w[0].0 <= w[1].0 + 1e-15));
        let pull = whole.curve.iter().map(|c| -c.1).fold(0.0, f64::max);
        // The removal peak lies between two of the drawn points.
        assert!((pull / whole.rows[3].value - 1.0).abs() < 0.02);
    }
}

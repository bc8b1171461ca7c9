//! `[hand]`: a scripted hand that feels the part.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::Check;
use super::check::Range::{NotNegative, Positive};
use super::device::Device;
use super::drive::Way;
use super::keys::{
    Damping, Direction, Length, Mass, RotationalDamping, RotationalInertia, RotationalStiffness,
    Speed, Stiffness, Time,
};

/// kg.
pub(super) const MASS: f64 = 0.5;
/// N/m.
const STIFFNESS: f64 = 2000.0;
/// kg m².
const ROTATIONAL_INERTIA: f64 = 1e-3;
/// N m/rad.
const ROTATIONAL_STIFFNESS: f64 = 20.0;

/// Servo periods in one run: 10 000 s at 1 kHz. More is a slip of the units, and would fill disks.
const MOST_STEPS: f64 = 1e7;

/// Digits of a damping that is not written.
const DIGITS: i32 = 2;

/// The scripted hand: a mass on a spring and a damper, whose other end follows the script.
#[derive(Clone, Debug, PartialEq)]
pub struct Hand {
    /// Unit vector in the world: where the held body goes.
    pub direction: DVec3,
    /// m/s, > 0.
    pub speed: f64,
    /// m, > 0.
    pub travel: f64,
    /// Rest at full travel, s, >= 0.
    pub hold: f64,
    /// Whether the hand pulls back to the start afterwards.
    pub retract: bool,
    /// kg, > 0.
    pub mass: f64,
    /// N/m, > 0.
    pub stiffness: f64,
    /// N s/m, >= 0.
    pub damping: f64,
    /// kg m², > 0.
    pub rotational_inertia: f64,
    /// N m/rad, > 0.
    pub rotational_stiffness: f64,
    /// N m s/rad, >= 0.
    pub rotational_damping: f64,
}

impl Hand {
    /// Time of the whole script, s.
    pub fn duration(&self) -> f64 {
        let way = self.travel / self.speed;
        way + self.hold + if self.retract { way } else { 0.0 }
    }
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct HandKeys {
    /// Where the held body goes, in the part's frame at the start; any length but 0.
    #[schemars(extend("x-default" = "that of [drive]"))]
    direction: Option<Direction>,
    /// Speed of the target, above 0.
    speed: Speed,
    /// Way of the target, above 0.
    #[schemars(extend("x-default" = "that of [drive]"))]
    travel: Option<Length>,
    /// Rest at full travel.
    #[schemars(extend("default" = 0.0))]
    hold: Option<Time>,
    /// Whether the hand pulls back to the start afterwards.
    #[serde(default)]
    retract: bool,
    /// Mass of handle and hand, above 0.
    #[schemars(extend("default" = MASS))]
    mass: Option<Mass>,
    /// Stiffness of the grip, above 0. A grip stiffer than the clip's falling branch traces the
    /// whole force-travel curve; a softer one jumps, which is the snap that a hand feels.
    #[schemars(extend("default" = STIFFNESS))]
    stiffness: Option<Stiffness>,
    /// Damping of the grip. The default is critical, 2 sqrt(mass stiffness), to two digits.
    #[schemars(extend("x-default" = "critical"))]
    damping: Option<Damping>,
    /// Moment of inertia of handle and hand, the same about all axes, above 0.
    #[schemars(extend("default" = ROTATIONAL_INERTIA))]
    rotational_inertia: Option<RotationalInertia>,
    /// Stiffness of the wrist, above 0.
    #[schemars(extend("default" = ROTATIONAL_STIFFNESS))]
    rotational_stiffness: Option<RotationalStiffness>,
    /// Damping of the wrist. The default is critical, as for the grip.
    #[schemars(extend("x-default" = "critical"))]
    rotational_damping: Option<RotationalDamping>,
}

impl HandKeys {
    pub(super) fn way(&self) -> Way {
        Way {
            direction: self.direction,
            travel: self.travel,
        }
    }

    pub(super) fn checked(
        &self,
        (direction, travel): (DVec3, f64),
        device: &Device,
        check: &Check<'_>,
    ) -> Result<Hand, SceneError> {
        let mass = check.number_or("mass", self.mass, MASS, Positive)?;
        let stiffness = check.number_or("stiffness", self.stiffness, STIFFNESS, Positive)?;
        let rotational_inertia = check.number_or(
            "rotational_inertia",
            self.rotational_inertia,
            ROTATIONAL_INERTIA,
            Positive,
        )?;
        let rotational_stiffness = check.number_or(
            "rotational_stiffness",
            self.rotational_stiffness,
            ROTATIONAL_STIFFNESS,
            Positive,
        )?;
        let hand = Hand {
            direction,
            travel,
            speed: check.number("speed", self.speed, Positive)?,
            hold: check.number_or("hold", self.hold, 0.0, NotNegative)?,
            retract: self.retract,
            mass,
            stiffness,
            damping: check.number_or(
                "damping",
                self.damping,
                critical(mass, stiffness),
                NotNegative,
            )?,
            rotational_inertia,
            rotational_stiffness,
            rotational_damping: check.number_or(
                "rotational_damping",
                self.rotational_damping,
                critical(rotational_inertia, rotational_stiffness),
                NotNegative,
            )?,
        };
        let period = device.servo_period;
        let steps = hand.duration() / period;
        if steps > MOST_STEPS {
            let what = format!(
                "travel, speed and hold make {steps:.1e} steps of {period} s, more than {MOST_STEPS:e}"
            );
            return Err(check.error(self.speed.offset, what, "move faster or hold for less"));
        }
        Ok(hand)
    }
}

/// 2 sqrt(m k), to some digits: a hand is not known better.
fn critical(inertia: f64, stiffness: f64) -> f64 {
    let exact = 2.0 * inertia.sqrt() * stiffness.sqrt();
    let unit = 10f64.powi(exact.log10().floor() as i32 + 1 - DIGITS);
    let rounded = (exact / unit).round() * unit;
    if rounded.is_finite() { rounded } else { exact }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damping_that_is_not_written_is_critical() {
        assert_eq!(critical(0.5, 2000.0), 63.0);
        assert!((critical(1e-3, 20.0) - 0.28).abs() < 1e-15);
        assert!((critical(0.3, 6000.0) - 85.0).abs() < 1e-12);
        for (m, k) in [(1e-300, 1e-300), (1e300, 1e300), (1e-12, 1e12)] {
            let damping = critical(m, k);
            let ratio = damping / (2.0 * m.sqrt() * k.sqrt());
            assert!(
                (ratio - 1.0).abs() < 0.06 || !ratio.is_finite(),
                "{m} {k}: {damping}"
            );
        }
    }
}

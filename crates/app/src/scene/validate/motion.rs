//! How the held body moves: the drive, the hand, where it is held, and what the curve has to keep.

use glam::DVec3;

use super::super::raw::{self, At, Vector, default};
use super::super::units::Quantity;
use super::super::{Device, Drive, Hand, Limits, SceneError};
use super::{Check, MOST_STEPS, Range};

/// Places of one drive before the bends are made finer. More is a slip of the units.
const MOST_PLACES: f64 = 1e5;

/// Digits of a damping that is not written.
const DIGITS: i32 = 2;

/// Direction and travel as one section has them.
struct Way<'a> {
    direction: Option<&'a At<Vector<3>>>,
    travel: Option<&'a At<f64>>,
}

impl Check<'_> {
    /// The drive, the hand if there is one; each lends the other direction and travel.
    pub(super) fn motion(
        &self,
        drive: Option<&At<raw::DriveRaw>>,
        hand: Option<&At<raw::HandRaw>>,
        device: &Device,
    ) -> Result<(Drive, Option<Hand>), SceneError> {
        let of_drive = drive.map(|at| Way {
            direction: at.value.direction.as_ref(),
            travel: at.value.travel.as_ref(),
        });
        let of_hand = hand.map(|at| Way {
            direction: at.value.direction.as_ref(),
            travel: at.value.travel.as_ref(),
        });
        let Some(offset) = drive.map(|at| at.offset).or(hand.map(|at| at.offset)) else {
            return Err(SceneError::Missing {
                path: self.path.to_path_buf(),
                line: 1,
                what: "section [drive] is missing: nothing says where the held body goes"
                    .to_owned(),
                mend: "add `[drive]` with `direction = [0.0, -1.0, 0.0]` and `travel = ...`"
                    .to_owned(),
            });
        };
        let (direction, travel) = self.way(offset, of_drive.as_ref(), of_hand.as_ref())?;
        let drive = self.drive(drive, direction, travel)?;
        let hand = hand.map(|hand| {
            let (direction, travel) = self.way(hand.offset, of_hand.as_ref(), of_drive.as_ref())?;
            self.hand(&hand.value, direction, travel, device)
        });
        Ok((drive, hand.transpose()?))
    }

    /// Direction and travel of one section, or what the other one lends.
    fn way(
        &self,
        offset: usize,
        own: Option<&Way<'_>>,
        other: Option<&Way<'_>>,
    ) -> Result<(DVec3, f64), SceneError> {
        let missing = |key: &str| SceneError::Missing {
            path: self.path.to_path_buf(),
            line: super::line_of(self.source, offset),
            what: format!("key `{key}` is missing in [drive] or [hand]"),
            mend: format!("add `{key} = ...` under [drive]"),
        };
        let both = || [own, other].into_iter().flatten();
        let direction = both().find_map(|way| way.direction);
        let travel = both().find_map(|way| way.travel);
        let direction = direction.ok_or_else(|| missing("direction"))?;
        let travel = travel.ok_or_else(|| missing("travel"))?;
        Ok((
            self.direction("direction", direction)?,
            self.number("travel", travel, Quantity::Length, Range::Positive)?,
        ))
    }

    fn drive(
        &self,
        at: Option<&At<raw::DriveRaw>>,
        direction: DVec3,
        travel: f64,
    ) -> Result<Drive, SceneError> {
        let raw = at.map(|at| &at.value);
        let step = match raw.and_then(|raw| raw.step.as_ref()) {
            None => travel / default::DRIVE_STEPS,
            Some(at) => {
                let step = self.number("step", at, Quantity::Length, Range::Positive)?;
                let places = travel / step;
                if !(1.0..=MOST_PLACES).contains(&places) {
                    let what = format!(
                        "step {} makes {places:.1e} places of the whole travel",
                        at.value
                    );
                    let mend = format!("write one that makes 1 to {MOST_PLACES:e} of them");
                    return Err(self.error(at.offset, what, mend));
                }
                step
            }
        };
        Ok(Drive {
            direction,
            travel,
            step,
            guide: raw.map_or_else(Default::default, |raw| raw.guide),
            retract: raw.and_then(|raw| raw.retract).unwrap_or(true),
        })
    }

    fn hand(
        &self,
        raw: &raw::HandRaw,
        direction: DVec3,
        travel: f64,
        device: &Device,
    ) -> Result<Hand, SceneError> {
        use Range::{NotNegative, Positive};
        let or = |key, at: &Option<At<f64>>, default, quantity, range| {
            self.number_or(key, at.as_ref(), default, quantity, range)
        };
        let positive = |key, at, default, quantity| or(key, at, default, quantity, Positive);
        let mass = positive("mass", &raw.mass, default::HAND_MASS, Quantity::Mass)?;
        let stiffness = positive(
            "stiffness",
            &raw.stiffness,
            default::HAND_STIFFNESS,
            Quantity::Stiffness,
        )?;
        let rotational_inertia = positive(
            "rotational_inertia",
            &raw.rotational_inertia,
            default::HAND_ROTATIONAL_INERTIA,
            Quantity::RotationalInertia,
        )?;
        let rotational_stiffness = positive(
            "rotational_stiffness",
            &raw.rotational_stiffness,
            default::HAND_ROTATIONAL_STIFFNESS,
            Quantity::RotationalStiffness,
        )?;
        let hand = Hand {
            direction,
            travel,
            speed: self.number("speed", &raw.speed, Quantity::Speed, Positive)?,
            hold: or("hold", &raw.hold, 0.0, Quantity::Time, NotNegative)?,
            retract: raw.retract,
            mass,
            stiffness,
            damping: or(
                "damping",
                &raw.damping,
                critical(mass, stiffness),
                Quantity::Damping,
                NotNegative,
            )?,
            rotational_inertia,
            rotational_stiffness,
            rotational_damping: or(
                "rotational_damping",
                &raw.rotational_damping,
                critical(rotational_inertia, rotational_stiffness),
                Quantity::RotationalDamping,
                NotNegative,
            )?,
        };
        let steps = hand.duration() / device.servo_period;
        if steps > MOST_STEPS {
            let what = format!(
                "travel, speed and hold make {steps:.1e} steps of {} s, more than {MOST_STEPS:e}",
                device.servo_period
            );
            return Err(self.error(raw.speed.offset, what, "move faster or hold for less"));
        }
        Ok(hand)
    }

    pub(super) fn grip(&self, raw: &raw::HoldsRaw) -> Result<Option<DVec3>, SceneError> {
        let grip = raw.grip.as_ref().map(|at| {
            let point = self.vector("grip", at, Quantity::Length, Range::Any)?;
            Ok(DVec3::from_array(point))
        });
        grip.transpose()
    }

    pub(super) fn limits(&self, raw: Option<&raw::LimitsRaw>) -> Result<Limits, SceneError> {
        let Some(raw) = raw else {
            return Ok(Limits::default());
        };
        let positive = |key: &str, at: &Option<At<f64>>, quantity| {
            at.as_ref()
                .map(|at| self.number(key, at, quantity, Range::Positive))
                .transpose()
        };
        Ok(Limits {
            insertion_below: positive("insertion_below", &raw.insertion_below, Quantity::Force)?,
            removal_above: positive("removal_above", &raw.removal_above, Quantity::Force)?,
            strain_below: positive("strain_below", &raw.strain_below, Quantity::Number)?,
            strain_use: raw.strain_use,
        })
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

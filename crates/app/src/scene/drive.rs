//! `[drive]`: the way of the held body in the part's own curve.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SceneError;
use super::check::{Check, Range::Positive};
use super::device::Device;
use super::hand::{Hand, HandKeys};
use super::keys::{At, Direction, Length};

/// Steps of a drive that says none.
const STEPS: f64 = 300.0;

/// Places of one drive before the bends are made finer. More is a slip of the units.
const MOST_PLACES: f64 = 1e5;

/// The way that the held body is driven, rigidly, as by a testing machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Unit vector in the world: where the held body goes.
    pub direction: DVec3,
    /// m, > 0.
    pub travel: f64,
    /// m between two places, > 0, at most `travel`; finer where the force bends.
    pub step: f64,
    /// What the body does across the direction.
    pub guide: Guide,
    /// Whether it is pulled out again.
    pub retract: bool,
}

/// What the driven body does across its direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Guide {
    /// it goes along `direction` only and does not turn; models with planes of symmetry need this.
    #[default]
    Axis,
    /// it gives way across `direction` and turns, against the springs of `[coupling]`.
    Free,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveKeys {
    /// Where the held body goes, in the part's frame at the start; any length but 0.
    #[schemars(extend("x-default" = "that of [hand]"))]
    direction: Option<Direction>,
    /// How far, above 0.
    #[schemars(extend("x-default" = "that of [hand]"))]
    travel: Option<Length>,
    /// Way between two places at which the force is solved for, above 0; it is halved up to six times where
    /// the force bends.
    #[schemars(extend("x-default" = "travel / 300"))]
    step: Option<Length>,
    /// What the body does across `direction`.
    #[serde(default)]
    guide: Guide,
    /// Whether it is pulled out again afterwards.
    #[schemars(extend("default" = true))]
    retract: Option<bool>,
}

/// Direction and travel as one section has them, or the other lends them.
#[derive(Clone, Copy, Default)]
pub(super) struct Way {
    pub(super) direction: Option<Direction>,
    pub(super) travel: Option<Length>,
}

/// The drive, and the hand if there is one; each lends the other direction and travel.
pub(super) fn motion(
    drive: Option<&At<DriveKeys>>,
    hand: Option<&At<HandKeys>>,
    device: &Device,
    check: &Check<'_>,
) -> Result<(Drive, Option<Hand>), SceneError> {
    let of_drive = drive.map_or_else(Way::default, |at| Way {
        direction: at.value.direction,
        travel: at.value.travel,
    });
    let of_hand = hand.map_or_else(Way::default, |at| at.value.way());
    let Some(offset) = drive.map(|at| at.offset).or(hand.map(|at| at.offset)) else {
        let what = "section [drive] is missing: nothing says where the held body goes";
        let mend = "add `[drive]` with `direction = [0.0, -1.0, 0.0]` and `travel = ...`";
        return Err(check.missing(0, what, mend));
    };
    let (direction, travel) = of_drive.or(of_hand).checked(offset, check)?;
    let keys = drive.map(|at| &at.value);
    let drive = Drive {
        direction,
        travel,
        step: step(keys.and_then(|keys| keys.step), travel, check)?,
        guide: keys.map_or_else(Default::default, |keys| keys.guide),
        retract: keys.and_then(|keys| keys.retract).unwrap_or(true),
    };
    let hand = hand.map(|hand| {
        let way = of_hand.or(of_drive).checked(hand.offset, check)?;
        hand.value.checked(way, device, check)
    });
    Ok((drive, hand.transpose()?))
}

fn step(written: Option<Length>, travel: f64, check: &Check<'_>) -> Result<f64, SceneError> {
    let Some(written) = written else {
        return Ok(travel / STEPS);
    };
    let step = check.number("step", written, Positive)?;
    let places = travel / step;
    if !(1.0..=MOST_PLACES).contains(&places) {
        let what = format!(
            "step {} makes {places:.1e} places of the whole travel",
            written.value.0
        );
        let mend = format!("write one that makes 1 to {MOST_PLACES:e} of them");
        return Err(check.error(written.offset, what, mend));
    }
    Ok(step)
}

impl Way {
    fn or(self, other: Self) -> Self {
        Self {
            direction: self.direction.or(other.direction),
            travel: self.travel.or(other.travel),
        }
    }

    /// Unit vector and m; `offset` is that of the section.
    fn checked(self, offset: usize, check: &Check<'_>) -> Result<(DVec3, f64), SceneError> {
        let missing = |key: &str| {
            let what = format!("key `{key}` is missing in [drive] or [hand]");
            check.missing(offset, what, format!("add `{key} = ...` under [drive]"))
        };
        let direction = self.direction.ok_or_else(|| missing("direction"))?;
        let travel = self.travel.ok_or_else(|| missing("travel"))?;
        Ok((
            check.direction("direction", direction)?,
            check.number("travel", travel, Positive)?,
        ))
    }
}

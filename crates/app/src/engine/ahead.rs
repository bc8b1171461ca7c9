//! Where a stride starts from: forces and the tool's deviation go on as they went, in proportion to the target's way.
//!
//! Passes that start near their end are fewer, and places are sought where the part will be. What passes end at does not
//! depend on it, but where there are several equilibria: tools with edges or facets start from where the part is.

use glamx::DPose3;

/// Of the way of the last stride, what is gone on by at most.
const FARTHEST: f64 = 2.0;

/// The ways of the last two strides.
#[derive(Debug, Default)]
pub(super) struct Ahead {
    /// Translation, m, and rotation vector times the tool's reach, m; of the last stride, where there was one.
    way: Option<[f64; 6]>,
    last: Option<DPose3>,
    deviation_before: [f64; 6],
}

impl Ahead {
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// A stride to `target` begins: which share of the way of the last stride it goes on by; 0 where it turns back.
    /// `reach` (m): what a turn by one radian moves.
    pub(super) fn share(&mut self, target: &DPose3, reach: f64) -> f64 {
        let way = self.last.map(|last| {
            let translation = target.translation - last.translation;
            let turn = reach * (target.rotation * last.rotation.inverse()).to_scaled_axis();
            [
                translation.x,
                translation.y,
                translation.z,
                turn.x,
                turn.y,
                turn.z,
            ]
        });
        let dot = |a: &[f64; 6], b: &[f64; 6]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let share = match (&way, &self.way) {
            (Some(way), Some(before)) => dot(way, before) / dot(before, before),
            _ => 0.0,
        };
        self.last = Some(*target);
        if way.is_some_and(|way| dot(&way, &way) > 0.0) {
            self.way = way;
        }
        if share.is_finite() {
            share.clamp(0.0, FARTHEST)
        } else {
            0.0
        }
    }

    /// The tool's deviation ahead, in place of the one at the end of the last stride.
    pub(super) fn deviation(&mut self, now: &[f64; 6], share: f64) -> [f64; 6] {
        let before = std::mem::replace(&mut self.deviation_before, *now);
        std::array::from_fn(|i| now[i] + share * (now[i] - before[i]))
    }
}

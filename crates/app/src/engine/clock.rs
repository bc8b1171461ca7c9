//! Times of the stages.

use std::time::Instant;

use super::{Stage, StepReport};

/// Adds the time between laps to the stages. It is never read by the computation.
pub(super) struct StageClock {
    last: Instant,
}

impl StageClock {
    pub(super) fn start() -> Self {
        Self {
            last: Instant::now(),
        }
    }

    pub(super) fn lap(&mut self, stage: Stage, report: &mut StepReport) {
        let now = Instant::now();
        report.stage_ns[stage as usize] += (now - self.last).as_nanos() as u64;
        self.last = now;
    }
}

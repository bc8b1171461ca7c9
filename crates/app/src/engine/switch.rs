//! Switching free nodes without a step of the hand's force: choose, build, ramp.

use glamx::DPose3;

use super::{Engine, Stage, StageClock, StepReport};

/// Largest rise of the blend in one step: a ramp takes 20 steps or more.
const MAX_RISE: f64 = 0.05;

/// Least rise; below it a change above the bound is let pass and reported, else a ramp could hang at
/// a jump of the true solution.
const MIN_RISE: f64 = 1e-3;

/// Rises tried in one step, each at the cost of a solve.
const MAX_TRIES: u32 = 4;

/// Share of the force that a switch may change in a step: human fingers resolve 7 % at best.
const SHARE_OF_FORCE: f64 = 0.03;

/// N, at most: half of what the coarsest supported device resolves.
const MOST_CHANGE: f64 = 0.1;

/// N, never less is asked for: a hundredth of [`MOST_CHANGE`], below what any device renders.
const LEAST_CHANGE: f64 = 1e-3;

/// N: bound on the change of the wrench in one step by switching free nodes, at a force of this size
/// (torques divided by the tool's reach count as forces).
pub fn switch_bound(force: f64) -> f64 {
    (SHARE_OF_FORCE * force).clamp(LEAST_CHANGE, MOST_CHANGE)
}

impl Engine {
    /// Chooses free nodes and moves an operator in the making one step on. Where nothing is
    /// constrained it does nothing.
    pub(super) fn switch_free_nodes(&mut self, report: &mut StepReport) {
        let Some(constrained) = &mut self.constrained else {
            return;
        };
        let mut clock = StageClock::start();
        let rest = self.part.rest_positions();
        let state = super::state_of(
            &self.part,
            &self.tool,
            self.last_target.as_ref().unwrap_or(&DPose3::IDENTITY),
            &self.scratch,
            Some(constrained),
        );
        let near = self.watch.watched(state);
        let scratch = &mut self.scratch;
        scratch.centres.clear();
        let touching = scratch.active.iter().map(|c| rest[c.candidate as usize]);
        scratch.centres.extend(touching);
        if scratch.centres.is_empty() {
            // What will soon touch is freed before it does.
            scratch
                .centres
                .extend(near.iter().map(|c| rest[*c as usize]));
        }
        let deformed = super::Deformed {
            part: &self.part,
            active: &scratch.active,
            constrained: Some(constrained),
            pairs: &scratch.pairs,
        };
        let largest = scratch
            .active
            .iter()
            .map(|c| deformed.displacement(c.candidate as usize).length())
            .fold(0.0, f64::max);
        constrained.advance(&scratch.centres, near, &scratch.active, largest);
        clock.lap(Stage::FreeNodes, report);
        if constrained.is_ramping() {
            self.ramp(report);
        }
        if let Some(constrained) = &self.constrained {
            report.free_nodes = constrained.n_free() as u32;
        }
    }

    /// Raises the blend as far as the wrench at the last target changes by no more than its bound.
    fn ramp(&mut self, report: &mut StepReport) {
        let (Some(target), false) = (self.last_target, self.scratch.active.is_empty()) else {
            // Nothing is deformed: nothing can change.
            self.set_blend(1.0);
            self.finish_ramp();
            return;
        };
        let from = self.constrained.as_ref().map_or(1.0, |c| c.blend());
        let deviation = self.deviation;
        self.scratch.save_contacts();
        if !matches!(
            self.settings.contact_iterations,
            super::ContactIterations::Converged
        ) {
            // Planes that were not converged move by themselves; that is no change by switching.
            self.solve_at(&target, report);
            self.last_wrench = report.contact_wrench_on_tool;
        }
        let before = self.last_wrench;
        let bound = switch_bound(self.size(&before));
        let mut rise = MAX_RISE.min(1.0 - from);
        for attempt in 1..=MAX_TRIES {
            self.set_blend(from + rise);
            self.solve_at(&target, report);
            let after = report.contact_wrench_on_tool;
            let change = self.size(&std::array::from_fn(|i| after[i] - before[i]));
            let is_least = rise <= MIN_RISE || attempt == MAX_TRIES;
            if change <= bound || is_least {
                report.switch_change = change;
                report.switch_forced = change > bound;
                break;
            }
            self.scratch.restore_contacts();
            self.deviation = deviation;
            // The change is nearly proportional to the rise; a tenth of it in the last try.
            let share = if attempt + 1 == MAX_TRIES { 0.1 } else { 0.8 };
            rise = (rise * share * bound / change).max(MIN_RISE);
        }
        if from + rise >= 1.0 - 1e-12 {
            self.finish_ramp();
        }
    }

    /// N, of a wrench about the tool's origin.
    fn size(&self, wrench: &[f64; 6]) -> f64 {
        let norm = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>().sqrt();
        norm(&wrench[..3]).max(norm(&wrench[3..]) / self.reach_of_rotation)
    }

    fn set_blend(&mut self, blend: f64) {
        if let Some(constrained) = &mut self.constrained {
            constrained.set_blend(blend, &self.part);
        }
    }

    fn finish_ramp(&mut self) {
        if let Some(constrained) = &mut self.constrained {
            constrained.finish_ramp();
        }
    }
}

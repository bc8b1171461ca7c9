//! One haptic step: handle pose in, wrench out. Deterministic, no I/O, no allocation, no lock.
//!
//! The step is a list of stages (`Engine::settle`), repeated until the contact planes stand still: which places of the
//! part the tool is near, the tool's surface seen from them, gaps and operator, forces, and what they move. Each stage is
//! a file. The tool sits in the same problem as the part: its virtual coupling is one more compliance (methods:
//! `W = H_d C H_dᵀ + H_t K_c⁻¹ H_tᵀ`), so tool pose and contact forces come out of one problem, at equilibrium.
//!
//! Everything here is in the part's frame; the session converts from and to the world. What a scene does not call for is
//! not in the [`Plan`] and is not built.

mod ahead;
mod appointments;
mod build;
mod clock;
mod clusters;
mod features;
mod fetched;
mod forces;
mod frozen;
mod held;
mod late;
mod law;
mod near;
mod pairs;
mod part;
mod places;
mod plan;
mod report;
mod rigid;
mod rows;
mod share;
mod sites;
mod standing;
mod watch;

use std::sync::Arc;

use contact::tool::Tool;
use contact::wrench_on_tool;
use device::VirtualCoupling;
use glam::DVec3;
use glamx::DPose3;

use ahead::Ahead;
pub use build::NEAR_PER_ROW;
use clock::StageClock;
use forces::Forces;
pub use frozen::{FrozenProblem, Prediction};
pub use held::Grip;
use held::Held;
use late::Late;
use law::{Carried, Coulomb, Given, Law};
use near::{Look, Near};
pub use part::ContactPart;
use places::Places;
pub use plan::{ContactIterations, ContactPlaces, EngineSettings, Plan};
pub use report::{ActiveContact, N_STAGES, Stage, StepReport};
use rows::{Bodies, Rows};
use share::{GOOD_ENOUGH, MOST_ROUNDS};
use standing::Standing;

/// Passes after which [`ContactIterations::Converged`] gives up and says so in the report.
/// Nearby states need 3 to 7; more than 60 means that two sets of planes alternate.
const MAX_PASSES: u32 = 60;

/// Passes in all strides of one step together: a step is bounded in time, and its answer flagged where that is not enough.
const MOST_PASSES_OF_STEP: u32 = 4 * MAX_PASSES;

/// Strides in one step; at 1 kHz and a stride of 0.2 mm this follows a hand at 6.4 m/s.
const MAX_STRIDES: f64 = 32.0;

/// The part, the tool and the state that a step starts from.
#[derive(Debug)]
pub struct Engine {
    part: Arc<ContactPart>,
    tool: Tool,
    held: Held,
    settings: EngineSettings,
    reach_of_rotation: f64,
    near: Near,
    places: Places,
    rows: Rows,
    law: Law,
    forces: Forces,
    /// Where columns are fetched.
    late: Option<Late>,
    last_target: Option<DPose3>,
    /// Where passes go to their end under a tool that is round all over.
    ahead: Option<Ahead>,
    /// Deviation of the tool from its target: position (m) and rotation vector (rad).
    deviation: [f64; 6],
    /// m, point of the tool's rows in the last pass.
    reference: DVec3,
}

impl Engine {
    /// The part that steps act on.
    pub fn part(&self) -> &ContactPart {
        &self.part
    }

    /// What a step is allowed and asked to do.
    pub fn settings(&self) -> &EngineSettings {
        &self.settings
    }

    /// The virtual coupling between handle and tool, if there is one.
    pub fn coupling(&self) -> Option<&VirtualCoupling> {
        self.held.coupling()
    }

    /// Where the tool is after the last step, part's frame; None before the first.
    pub fn tool_pose(&self) -> Option<DPose3> {
        let target = self.last_target.as_ref()?;
        Some(self.held.pose(target, &self.deviation))
    }

    /// Whether corners and edges of the tool touch the part between its nodes.
    pub fn has_features(&self) -> bool {
        self.near.features.is_some()
    }

    /// Whether contact acts at places that move with the tool.
    pub fn has_moving_places(&self) -> bool {
        self.near.sites.is_some()
    }

    /// Whether there is friction between part and tool.
    pub fn has_friction(&self) -> bool {
        matches!(self.law, Law::Coulomb(_))
    }

    /// Bytes that are reserved for friction alone; pages that no problem was large enough for are never touched.
    pub fn friction_bytes(&self) -> usize {
        match &self.law {
            Law::Frictionless(_) => 0,
            Law::Coulomb(coulomb) => coulomb.bytes(),
        }
    }

    /// Whether friction is so large that other forces than those of the last step may obey its law as well.
    pub fn may_have_other_answers(&self) -> bool {
        let coulomb = self.answered_with_friction();
        coulomb.is_some_and(|coulomb| coulomb.may_have_others(&self.rows))
    }

    /// What such forces would add to the force on the tool, N, part's frame: the most of those that were found, `None` where none
    /// were. Allocates and takes up to some tenths of a second; not for the haptic step.
    pub fn other_answer(&self) -> Option<DVec3> {
        self.answered_with_friction()?.other_force(&self.rows)
    }

    /// Where there was a contact in the last step, so that its problem stands.
    fn answered_with_friction(&self) -> Option<&Coulomb> {
        match &self.law {
            Law::Coulomb(coulomb) if !self.forces.carried().is_empty() => Some(coulomb),
            _ => None,
        }
    }

    /// m: nodes farther from the tool than this, beyond those that get a contact, can carry none of its force.
    pub fn reach_between_nodes(&self) -> f64 {
        let of_sites = self.near.sites.as_ref().map_or(0.0, |s| s.largest_face());
        let features = self.near.features.as_ref();
        features.map_or(0.0, |f| f.largest_face()).max(of_sites)
    }

    /// The rigid tool.
    pub fn tool(&self) -> &Tool {
        &self.tool
    }

    /// m, how far a point of the tool that is near the part goes between two poses.
    pub fn motion(&self, from: &DPose3, to: &DPose3) -> f64 {
        (to.translation - from.translation).length()
            + self.reach_of_rotation * from.rotation.angle_between(to.rotation)
    }

    /// J, in the springs that hold the tool across an imposed direction, or on all sides, under a wrench on the tool (N, N m
    /// about the grip). 0 for an imposed pose.
    pub fn energy_of_guide(&self, wrench: &[f64; 6]) -> f64 {
        self.held.energy_under(wrench)
    }

    /// Forgets all contact: undeformed part, tool at its next target.
    pub fn reset(&mut self) {
        self.forces.clear();
        self.places.clear();
        self.rows.share.clear();
        if let Some(coulomb) = self.law.coulomb_mut() {
            coulomb.clear();
        }
        self.near.reset();
        self.last_target = None;
        if let Some(ahead) = &mut self.ahead {
            ahead.forget();
        }
        self.deviation = [0.0; 6];
        if let Some(late) = &mut self.late {
            late.clear();
        }
    }

    /// Nodes that carry force after the last step.
    pub fn active_contacts(&self) -> &[ActiveContact] {
        self.forces.active()
    }

    /// Displacement of candidate `candidate_idx` under the contact forces of the last step, m.
    pub fn displacement(&self, candidate_idx: usize) -> DVec3 {
        self.forces.deformed(&self.part).displacement(candidate_idx)
    }

    /// One step. `target`: pose of the tool that the handle asks for, in the part's frame.
    ///
    /// Does not allocate, lock, log or block. A target that is not finite leaves the state as it
    /// was and is flagged in the report.
    pub fn step(&mut self, target: &DPose3) -> StepReport {
        let mut report = StepReport::at(target);
        let valid = target.translation.is_finite()
            && target.rotation.is_finite()
            && (target.rotation.length_squared() - 1.0).abs() < 1e-6;
        if !valid {
            report.rejected = true;
            report.tool_pose = self.last_target.unwrap_or(DPose3::IDENTITY);
            return report;
        }
        if let Some(late) = &mut self.late {
            if let Some(part) = Arc::get_mut(&mut self.part) {
                part.take_in();
            }
            late.begin_step(&self.part);
        }
        let from = self.last_target.unwrap_or(*target);
        let tool_pose = self.held.pose(&from, &self.deviation);
        if let Some(coulomb) = self.law.coulomb_mut() {
            coulomb.begin_step(&self.forces, tool_pose);
        }
        let motion = self.motion(&from, target);
        let n_strides = (motion / self.settings.max_stride)
            .ceil()
            .clamp(1.0, MAX_STRIDES);
        report.strides = n_strides as u32;
        let mut passes_left = MOST_PASSES_OF_STEP;
        for stride in 1..=report.strides {
            let t = f64::from(stride) / n_strides;
            let waypoint = if stride == report.strides {
                *target
            } else {
                DPose3 {
                    translation: from.translation.lerp(target.translation, t),
                    rotation: from.rotation.slerp(target.rotation, t),
                }
            };
            // Each stride to come may make one pass at least.
            let to_come = report.strides - stride;
            self.settle(&waypoint, passes_left.saturating_sub(to_come), &mut report);
            passes_left = passes_left.saturating_sub(report.passes);
        }
        self.last_target = Some(*target);
        report
    }

    /// Equilibrium of part and tool for one target, warm-started from the state: the stages, until planes stand still.
    fn settle(&mut self, target: &DPose3, most_passes: u32, report: &mut StepReport) {
        let (max_passes, tolerance) = match self.settings.contact_iterations {
            ContactIterations::Converged => (MAX_PASSES, self.settings.displacement_tolerance),
            ContactIterations::Fixed(n) => (n.max(1), 0.0),
        };
        let is_fixed = matches!(
            self.settings.contact_iterations,
            ContactIterations::Fixed(_)
        );
        let max_passes = max_passes.min(most_passes.max(1));
        self.go_ahead(target);
        self.begin_search();
        self.rows.share.begin_round();
        (report.passes, report.converged) = (0, false);
        let deepest_before = report.rigid_depth;
        let mut tool_pose = self.held.pose(target, &self.deviation);
        let mut standing = Standing::new(self.settings.near_distance, tolerance);
        // m, how far the part may move after places were sought: they are off by its square over the tool's diameter.
        let reach_of_search = (2.0 * tolerance * self.tool.characteristic_size()).sqrt();
        let mut moved = 0.0;
        let mut may_seek_again = self.has_moving_places() && !is_fixed;
        let mut rounds = 0;
        let mut clock = StageClock::start();
        while report.passes < max_passes {
            report.passes += 1;
            self.reference = self.held.reference(target, &self.deviation);
            self.look(&tool_pose, report);
            clock.lap(Stage::Proximity, report);
            self.draw(&tool_pose, report);
            clock.lap(Stage::Planes, report);
            let is_open = self.assemble(&tool_pose);
            clock.lap(Stage::Delassus, report);
            self.solve(is_open, report);
            clock.lap(Stage::Lcp, report);
            let change = self.update(target, &mut tool_pose, is_open, report);
            clock.lap(Stage::Update, report);
            moved += change;
            if !standing.is_reached(change) {
                continue;
            }
            if may_seek_again && moved > reach_of_search {
                // Once more, where the part is now.
                may_seek_again = false;
                self.begin_search();
            } else if !self.begins_round(&mut rounds, report) {
                report.converged = true;
                break;
            }
        }
        report.converged |= is_fixed;
        // In any stride of the step.
        report.rigid_depth = report.rigid_depth.max(deepest_before);
        report.tool_pose = tool_pose;
        report.contacts = self.forces.carried().len() as u32;
        let from_contact = &report.contact_wrench_on_tool;
        report.coupling_wrench_on_tool = self.held.wrench_on_tool(target, &tool_pose, from_contact);
    }

    /// Forces and tool go on as they went: what passes start from.
    fn go_ahead(&mut self, target: &DPose3) {
        if let Some(ahead) = &mut self.ahead {
            let share = ahead.share(target, self.reach_of_rotation);
            self.forces.go_ahead(share);
            self.deviation = ahead.deviation(&self.deviation, share);
        }
    }

    /// No place is held any more.
    fn begin_search(&mut self) {
        self.near.begin_stride(&self.forces);
        self.places.clear();
    }

    /// Which places the tool is near.
    fn look(&mut self, tool_pose: &DPose3, report: &mut StepReport) {
        let mut look = Look {
            part: &self.part,
            tool: &self.tool,
            tool_pose,
            near_distance: self.settings.near_distance,
            forces: &mut self.forces,
            places: &mut self.places,
            late: self.late.as_mut(),
            report,
        };
        self.near.look(&mut look);
    }

    /// The tool's surface seen from the places (paper, Fig. 3), and rows of it.
    fn draw(&mut self, tool_pose: &DPose3, report: &mut StepReport) {
        self.places.draw(&self.tool, tool_pose);
        let bodies = Bodies {
            part: &self.part,
            held: &self.held,
            reference: self.reference,
            deviation: &self.deviation,
        };
        let (places, forces, late) = (&self.places, &self.forces, self.late.as_ref());
        let length = self.reach_of_rotation;
        self.rows
            .gather(places, forces, &bodies, late, length, report);
    }

    /// Gaps without force, and where some are closed, what closes them gives way. Whether all are open: then no force is
    /// the exact answer.
    fn assemble(&mut self, tool_pose: &DPose3) -> bool {
        let bodies = Bodies {
            part: &self.part,
            held: &self.held,
            reference: self.reference,
            deviation: &self.deviation,
        };
        let is_open = self.rows.open_gaps(&self.places, &bodies);
        if !is_open {
            self.places.fetch(&mut self.forces.pairs, &self.part);
            let given = Given {
                places: &self.places,
                forces: &self.forces,
                bodies: &bodies,
                tool_pose,
            };
            self.law.assemble(&mut self.rows, &given);
        }
        is_open
    }

    /// Forces of the contacts.
    fn solve(&mut self, is_open: bool, report: &mut StepReport) {
        if is_open {
            self.law.rest(self.rows.contacts.len(), report);
            return;
        }
        let carried = Carried {
            places: &self.places,
            forces: &self.forces,
            settings: &self.settings.lcp,
        };
        self.law.solve(&mut self.rows, &carried, report);
    }

    /// Forces become the state; places and tool go where they balance. The largest change of either, m.
    fn update(
        &mut self,
        target: &DPose3,
        tool_pose: &mut DPose3,
        is_open: bool,
        report: &mut StepReport,
    ) -> f64 {
        let Self {
            part,
            places,
            rows,
            forces,
            held,
            reference,
            ..
        } = self;
        let by_contact = self.law.forces();
        let of_places = places.move_under(&rows.contacts, by_contact, &forces.pairs, part);
        forces.adopt(places.list(), &rows.contacts, by_contact);
        let (force, torque) = wrench_on_tool(&rows.contacts, &by_contact.on_part, *reference);
        let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        report.contact_wrench_on_tool = wrench;
        self.deviation = held.deviation_under(&wrench);
        let moved = held.pose(target, &self.deviation);
        let bodies = Bodies {
            part,
            held,
            reference: *reference,
            deviation: &self.deviation,
        };
        rows.weigh(places, &by_contact.normal, &bodies, is_open, report);
        report.merged_badly = report.merge_error > self.settings.merge_tolerance;
        let of_tool = (moved.translation - tool_pose.translation).length()
            + self.reach_of_rotation * moved.rotation.angle_between(tool_pose.rotation);
        *tool_pose = moved;
        of_places.max(of_tool)
    }

    /// Whether contacts that share rows try better shares once more, now that planes stand still.
    fn begins_round(&mut self, rounds: &mut u32, report: &StepReport) -> bool {
        let is_good = report.merge_error <= GOOD_ENOUGH * self.settings.merge_tolerance;
        // As many passes again are left for the last round.
        if is_good || *rounds == MOST_ROUNDS || 2 * report.passes > MAX_PASSES {
            return false;
        }
        *rounds += 1;
        self.rows.share.begin_round();
        true
    }
}

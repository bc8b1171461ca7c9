//! One haptic step: handle pose in, wrench out. Deterministic, no I/O, no allocation, no lock.
//!
//! The step is a list of stages (see [`Stage`]), repeated until the contact planes stand still:
//! proximity, planes, Delassus operator, LCP, update. The tool sits in the same problem as the
//! part: its virtual coupling is one more compliance (methods: `W = H_d C H_dᵀ + H_t K_c⁻¹ H_tᵀ`),
//! so tool pose and contact forces come out of one LCP, at equilibrium.
//!
//! Everything here is in the part's frame; the session converts from and to the world.

mod clock;
mod clusters;
mod edges;
mod fetched;
mod frozen;
mod held;
mod late;
mod pairs;
mod part;
mod pass;
mod prune;
mod report;
mod rigid;
mod scratch;
mod watch;

use std::sync::Arc;

use contact::lcp;
use contact::surface::Surface;
use contact::tool::{Features, Tool};
use device::VirtualCoupling;
use glam::DVec3;
use glamx::DPose3;

use edges::Edges;
pub use frozen::{FrozenProblem, Prediction};
pub use held::Grip;
use held::Held;
use late::Late;
pub use part::ContactPart;
use part::Deformed;
use prune::{GOOD_ENOUGH, MOST_ROUNDS};
pub use report::{ActiveContact, N_STAGES, Stage, StepReport};
use scratch::Scratch;
use watch::{State, Watch};

/// How often the contact planes are drawn anew within one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactIterations {
    /// Until the displacement of every near node changes by less than
    /// [`EngineSettings::displacement_tolerance`].
    Converged,
    /// This many passes; 1 is the single pass of the paper.
    Fixed(u32),
}

/// What a step is allowed and asked to do.
#[derive(Clone, Debug)]
pub struct EngineSettings {
    /// Passes over the contact planes in a step.
    pub contact_iterations: ContactIterations,
    /// m. With [`ContactIterations::Converged`], the change of displacement and tool position
    /// below which the planes stand still. 1e-9 m is 1e-5 N on a part of 10 kN/m.
    pub displacement_tolerance: f64,
    /// m. Nodes nearer to the tool than this get a plane. Does not change a converged result:
    /// a node that comes in from farther away gets its plane in the next pass.
    pub near_distance: f64,
    /// Rows of the LCP. More near nodes than that share rows in patches, up to [`NEAR_PER_ROW`] times as many; beyond
    /// it the deepest gaps are kept. A solution takes a time that grows with the cube of the rows, W with the square of
    /// the near nodes.
    pub max_contacts: usize,
    /// Of the resultant's relative error where rows are shared, as [`StepReport::merge_error`] estimates it: above it
    /// a step says so. Human fingers resolve 7 % of a force at best.
    pub merge_tolerance: f64,
    /// Settings of the LCP solver.
    pub lcp: lcp::Settings,
    /// m. Tool motion in one go; a faster handle is followed in several strides of the same step,
    /// so that a jump cannot pick another branch or pass through the part unseen.
    pub max_stride: f64,
}

/// Near nodes that memory is reserved for, in rows of the LCP.
pub const NEAR_PER_ROW: usize = 8;

/// Passes after which [`ContactIterations::Converged`] gives up and says so in the report.
/// Nearby states need 3 to 7; more than 60 means that two sets of planes alternate.
const MAX_PASSES: u32 = 60;

/// Distance beyond which a node is not watched any more, in distances at which nodes get a plane.
const WATCH_SLACK: f64 = 3.0;

/// Of the change of the last pass over that of the one before, below which passes are taken to shrink steadily.
const STEADY: f64 = 0.25;

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
    watch: Watch,
    scratch: Scratch,
    last_target: Option<DPose3>,
    /// Deviation of the tool from its target: position (m) and rotation vector (rad).
    deviation: [f64; 6],
    /// On the tool, from the contacts, at the end of the last step.
    last_wrench: [f64; 6],
    /// m, point of the tool's rows in the last pass.
    reference: DVec3,
    /// Where columns are fetched.
    late: Option<Late>,
    /// Corners and edges of the tool between the nodes, where it has some.
    edges: Option<Box<Edges>>,
}

impl Engine {
    /// Sizes all memory that steps will use.
    ///
    /// `coupling`: the virtual coupling between handle and tool, or `None` to impose the tool's
    /// pose (no coupling compliance in the LCP; what reference cases ask for).
    ///
    /// # Errors
    /// Settings that the LCP scratch refuses.
    pub fn new(
        part: Arc<ContactPart>,
        tool: Tool,
        coupling: Option<VirtualCoupling>,
        settings: EngineSettings,
    ) -> Result<Self, contact::Error> {
        // Where columns come one by one, those that were taken in are the engine's own reckoning.
        let part = part.view().map_or(part, Arc::new);
        let max_contacts = settings.max_contacts.min(part.n_candidates()).max(1);
        let max_near = NEAR_PER_ROW.saturating_mul(max_contacts);
        let max_near = max_near.min(part.n_candidates()).max(max_contacts);
        let scratch = Scratch::new(part.n_candidates(), max_near, max_contacts);
        Ok(Self {
            reach_of_rotation: reach_of_rotation(&tool, &part),
            held: Held::by(coupling),
            settings: EngineSettings {
                max_contacts,
                ..settings
            },
            watch: Watch::new(
                &part,
                // Distances of two looks may each be wrong.
                settings.near_distance + 2.0 * tool.error_bound(),
                WATCH_SLACK * settings.near_distance,
            )?,
            scratch,
            last_target: None,
            deviation: [0.0; 6],
            last_wrench: [0.0; 6],
            reference: DVec3::ZERO,
            late: part.is_fetched().then(|| Late::new(max_contacts)),
            edges: None,
            part,
            tool,
        })
    }

    /// Fastens the coupling at another point than the tool's origin. Deviation and wrenches are about that point then.
    pub fn held_at(mut self, grip: Grip) -> Self {
        self.held = self.held.at(grip);
        self
    }

    /// Imposes the tool's place along a direction (unit vector, part's frame), whatever the coupling does across it.
    pub fn guided_along(mut self, direction: DVec3) -> Self {
        self.held = self.held.guided_along(direction);
        self
    }

    /// J, in the springs that hold the tool across an imposed direction, or on all sides, under a wrench on the tool (N, N m
    /// about the grip). 0 for an imposed pose.
    pub fn energy_of_guide(&self, wrench: &[f64; 6]) -> f64 {
        self.held.energy_under(wrench)
    }

    /// Has the tool's corners and edges touch the faces of the part between its nodes, too.
    ///
    /// The tool then moves in one go by no more than a quarter of the least height of an element behind a face.
    pub fn with_edges(mut self, surface: Surface, features: Features) -> Self {
        let n_candidates = self.part.n_candidates();
        let stride = Edges::max_stride(&surface);
        self.settings.max_stride = self.settings.max_stride.min(stride);
        // Nodes share no rows then: those of the edges stand beside.
        let max_contacts = self.settings.max_contacts;
        self.scratch = Scratch::new(n_candidates, max_contacts, max_contacts);
        self.scratch.reserve_contacts(n_candidates);
        let max_rows = self.scratch.max_rows();
        let near_distance = self.settings.near_distance;
        let clusters = self.part.clusters();
        let edges = Edges::new(
            surface,
            features,
            clusters,
            near_distance,
            n_candidates,
            max_rows,
        );
        self.edges = Some(Box::new(edges));
        self
    }

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
    pub fn has_edges(&self) -> bool {
        self.edges.is_some()
    }

    /// m: nodes farther from the tool than this, beyond those that get a plane, can carry none of its force.
    pub fn reach_between_nodes(&self) -> f64 {
        self.edges
            .as_ref()
            .map_or(0.0, |edges| edges.largest_face())
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

    /// Forgets all contact: undeformed part, tool at its next target.
    pub fn reset(&mut self) {
        self.scratch.clear_contacts();
        self.watch.forget();
        self.last_target = None;
        self.deviation = [0.0; 6];
        self.last_wrench = [0.0; 6];
        if let Some(late) = &mut self.late {
            late.clear();
        }
        if let Some(edges) = &mut self.edges {
            edges.reset();
        }
    }

    /// Contacts that carry force after the last step.
    pub fn active_contacts(&self) -> &[ActiveContact] {
        &self.scratch.active
    }

    /// Displacement of candidate `candidate_idx` under the contact forces of the last step, m.
    pub fn displacement(&self, candidate_idx: usize) -> DVec3 {
        self.deformed().displacement(candidate_idx)
    }

    fn deformed(&self) -> Deformed<'_> {
        Deformed {
            part: &self.part,
            active: &self.scratch.active,
            pairs: &self.scratch.pairs,
        }
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
        let motion = self.motion(&from, target);
        let n_strides = (motion / self.settings.max_stride)
            .ceil()
            .clamp(1.0, MAX_STRIDES);
        report.strides = n_strides as u32;
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
            self.solve_at(&waypoint, &mut report);
        }
        self.last_target = Some(*target);
        self.last_wrench = report.contact_wrench_on_tool;
        report
    }

    /// Equilibrium of part and tool for one target, warm-started from the state.
    fn solve_at(&mut self, target: &DPose3, report: &mut StepReport) {
        let (max_passes, tolerance) = match self.settings.contact_iterations {
            ContactIterations::Converged => (MAX_PASSES, self.settings.displacement_tolerance),
            ContactIterations::Fixed(n) => (n.max(1), 0.0),
        };
        self.scratch.begin_stride();
        if let Some(edges) = &mut self.edges {
            edges.begin_stride();
        }
        report.passes = 0;
        report.converged = false;
        let rigid_before = report.rigid_depth;
        let mut tool_pose = self.held.pose(target, &self.deviation);
        let mut change_before = f64::INFINITY;
        let mut rounds = 0;
        while report.passes < max_passes {
            report.passes += 1;
            let change = self.pass(&mut tool_pose, target, report);
            // What further passes would change: a geometric series, twice over. Only once all that moves is far
            // smaller than the distance at which nodes get a plane, so that no other node can come in. The first pass
            // has none before it, so that nothing is known of how passes shrink.
            let ratio = change / change_before;
            let is_steady =
                report.passes > 1 && ratio < STEADY && change < 0.01 * self.settings.near_distance;
            let left = 2.0 * change * ratio / (1.0 - ratio);
            let stand_still = change <= tolerance || (is_steady && left <= tolerance);
            if stand_still && !self.begins_round(&mut rounds, report) {
                report.converged = true;
                break;
            }
            change_before = change;
        }
        if matches!(
            self.settings.contact_iterations,
            ContactIterations::Fixed(_)
        ) {
            report.converged = true;
        }
        // In any stride of the step.
        report.rigid_depth = report.rigid_depth.max(rigid_before);
        report.tool_pose = tool_pose;
        let on_faces = self.edges.as_ref().map_or(0, |edges| edges.n_carried());
        report.contacts = (self.scratch.n_own + on_faces) as u32;
        self.balance(target, report);
    }

    /// Whether nodes that share rows try better shares once more, now that planes stand still.
    fn begins_round(&mut self, rounds: &mut u32, report: &StepReport) -> bool {
        let is_good = report.merge_error <= GOOD_ENOUGH * self.settings.merge_tolerance;
        // As many passes again are left for the last round.
        if is_good || *rounds == MOST_ROUNDS || 2 * report.passes > MAX_PASSES {
            return false;
        }
        *rounds += 1;
        self.scratch.prune.begin_round();
        true
    }

    /// Fills in both sides of the tool's equilibrium.
    fn balance(&self, target: &DPose3, report: &mut StepReport) {
        let from_contact = &report.contact_wrench_on_tool;
        report.coupling_wrench_on_tool =
            self.held
                .wrench_on_tool(target, &report.tool_pose, from_contact);
    }
}

fn state_of<'a>(
    part: &'a ContactPart,
    tool: &'a Tool,
    tool_pose: &'a DPose3,
    scratch: &'a Scratch,
) -> State<'a> {
    State {
        deformed: Deformed {
            part,
            active: &scratch.active,
            pairs: &scratch.pairs,
        },
        tool,
        tool_pose,
        is_active: &scratch.was_active,
    }
}

/// m, lever with which a turn of the tool counts as motion: its size, or the part's where the tool
/// has none or is larger.
fn reach_of_rotation(tool: &Tool, part: &ContactPart) -> f64 {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for &x in part.rest_positions() {
        low = low.min(x);
        high = high.max(x);
    }
    tool.characteristic_size().min((high - low).length())
}

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
mod constrained;
mod pairs;
mod part;
mod prune;
mod report;
mod scratch;
mod switch;
mod watch;

use std::sync::Arc;

use contact::delassus::{ComplianceBlocks, CouplingCompliance, delassus_into};
use contact::lcp;
use contact::patch::Patches;
use contact::plane::{Plane, planes_and_rest_into, planes_into, wrench_on_tool};
use contact::tool::Tool;
use device::VirtualCoupling;
use glam::DVec3;
use glamx::DPose3;

use crate::free_nodes::LOOSE_RADIUS;

use clock::StageClock;
use constrained::Constrained;
pub use constrained::{BubbleData, FreeSettings, MOST_FREE};
pub use part::ContactPart;
use part::Deformed;
pub use report::{ActiveContact, N_STAGES, Stage, StepReport};
use scratch::Scratch;
pub use switch::switch_bound;
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
    coupling: Option<VirtualCoupling>,
    coupling_compliance: Option<[[f64; 6]; 6]>,
    settings: EngineSettings,
    reach_of_rotation: f64,
    watch: Watch,
    scratch: Scratch,
    last_target: Option<DPose3>,
    /// Deviation of the tool from its target: position (m) and rotation vector (rad).
    deviation: [f64; 6],
    /// On the tool, from the contacts, at the end of the last step.
    last_wrench: [f64; 6],
    /// The p-method by Galerkin, where the scene asks for it.
    constrained: Option<Box<Constrained>>,
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
        Self::with_room(part, tool, coupling, settings, usize::MAX)
    }

    /// As [`Engine::new`], for at most `max_near` near nodes, or as many as there are rows.
    fn with_room(
        part: Arc<ContactPart>,
        tool: Tool,
        coupling: Option<VirtualCoupling>,
        settings: EngineSettings,
        max_near: usize,
    ) -> Result<Self, contact::Error> {
        let max_contacts = settings.max_contacts.min(part.n_candidates()).max(1);
        let max_near = NEAR_PER_ROW.saturating_mul(max_contacts).min(max_near);
        let max_near = max_near.min(part.n_candidates()).max(max_contacts);
        let scratch = Scratch::new(part.n_candidates(), max_near, max_contacts);
        Ok(Self {
            reach_of_rotation: reach_of_rotation(&tool, &part),
            coupling_compliance: coupling.as_ref().map(VirtualCoupling::compliance),
            coupling,
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
            constrained: None,
            part,
            tool,
        })
    }

    /// An engine whose part has constrained interface nodes, some of which are freed on the way.
    ///
    /// `rest`, `n_rows`, `coarse`: as for [`ContactPart::new`], the compliance with all interface nodes
    /// constrained. `bubbles`: what freeing them adds.
    ///
    /// # Errors
    /// As [`Engine::new`].
    pub fn constrained(
        part: ContactPart,
        bubbles: BubbleData,
        free: FreeSettings,
        tool: Tool,
        coupling: Option<VirtualCoupling>,
        settings: EngineSettings,
    ) -> Result<Self, contact::Error> {
        let part = Arc::new(part.bounded_by(&bubbles.bounds));
        let mut engine = Self::with_room(part, tool, coupling, settings, constrained::MOST_KNOWN)?;
        let n_candidates = engine.part.n_candidates();
        let max_near = engine.scratch.max_near();
        let constrained = Constrained::new(bubbles, free, n_candidates, max_near);
        engine.constrained = Some(Box::new(constrained));
        // Its own operator keeps its own blocks.
        engine.scratch.pairs = pairs::Pairs::new(n_candidates, 0);
        Ok(engine)
    }

    /// m, how far from a node that can touch a node may be that is free under
    /// [`FreeSettings::within`] this radius.
    pub fn reach_of_free(radius: f64) -> f64 {
        LOOSE_RADIUS * radius
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
        self.coupling.as_ref()
    }

    /// The rigid tool.
    pub fn tool(&self) -> &Tool {
        &self.tool
    }

    /// Forgets all contact: undeformed part, tool at its next target.
    pub fn reset(&mut self) {
        self.scratch.clear_contacts();
        self.watch.forget();
        self.last_target = None;
        self.deviation = [0.0; 6];
        self.last_wrench = [0.0; 6];
        if let Some(constrained) = &mut self.constrained {
            constrained.reset();
        }
    }

    /// Contacts that carry force after the last step.
    pub fn active_contacts(&self) -> &[ActiveContact] {
        &self.scratch.active
    }

    /// Displacement of candidate `candidate_idx` under the contact forces of the last step, m.
    pub fn displacement(&mut self, candidate_idx: usize) -> DVec3 {
        if let Some(constrained) = &mut self.constrained {
            constrained.make_terms(&self.scratch.active);
        }
        self.deformed().displacement(candidate_idx)
    }

    /// In a constrained part, free interface nodes by their number among the bubbles, and how far each
    /// is from where it would follow (m), after the last step; empty otherwise.
    pub fn bubble_amplitudes(&mut self) -> &[(u32, DVec3)] {
        match &mut self.constrained {
            None => &[],
            Some(constrained) => {
                constrained.make_terms(&self.scratch.active);
                constrained.terms()
            }
        }
    }

    fn deformed(&self) -> Deformed<'_> {
        Deformed {
            part: &self.part,
            active: &self.scratch.active,
            constrained: self.constrained.as_deref(),
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
        self.switch_free_nodes(&mut report);
        let from = self.last_target.unwrap_or(*target);
        let motion = (target.translation - from.translation).length()
            + self.reach_of_rotation * from.rotation.angle_between(target.rotation);
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
        report.passes = 0;
        report.converged = false;
        let mut tool_pose = VirtualCoupling::pose_from_deviation(target, &self.deviation);
        let mut change_before = f64::INFINITY;
        while report.passes < max_passes {
            report.passes += 1;
            let change = self.pass(&mut tool_pose, target, report);
            // What further passes would change: a geometric series, twice over. Only once all that moves is far
            // smaller than the distance at which nodes get a plane, so that no other node can come in.
            let ratio = change / change_before;
            let is_steady = ratio < STEADY && change < 0.01 * self.settings.near_distance;
            let left = 2.0 * change * ratio / (1.0 - ratio);
            if change <= tolerance || (is_steady && left <= tolerance) {
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
        report.tool_pose = tool_pose;
        report.contacts = self.scratch.active.len() as u32;
        self.balance(target, report);
    }

    /// One round of proximity, planes, Delassus, LCP and update.
    /// Returns the largest change of a near node's displacement or of the tool's pose, m.
    fn pass(&mut self, tool_pose: &mut DPose3, target: &DPose3, report: &mut StepReport) -> f64 {
        let mut clock = StageClock::start();
        let reference = tool_pose.translation;
        let part = self.part.as_ref();
        let tool = &self.tool;
        let pose = *tool_pose;
        let near_distance = self.settings.near_distance;

        // Which candidates can be near.
        let constrained = self.constrained.as_deref();
        let state = state_of(part, tool, tool_pose, &self.scratch, constrained);
        let asks = self.watch.advance(state);
        if let (true, Some(constrained)) = (asks, &mut self.constrained) {
            constrained.make_terms(&self.scratch.active);
        }
        let constrained = self.constrained.as_deref();
        let state = state_of(part, tool, tool_pose, &self.scratch, constrained);
        self.watch.look(state);
        let candidates = self.watch.take_due();
        if let Some(constrained) = &mut self.constrained {
            let active = &self.scratch.active;
            if !constrained.ensure(candidates.iter().copied(), active, part) {
                constrained.make_terms(active);
            }
        }
        clock.lap(Stage::Proximity, report);

        // One plane per near node, at its displaced position (paper, Fig. 3).
        let constrained = self.constrained.as_deref();
        let Scratch {
            planes,
            active,
            known,
            pairs,
            ..
        } = &mut self.scratch;
        let deformed = Deformed {
            part,
            active,
            constrained,
            pairs,
        };
        let position_of = |candidate: u32| {
            let i = candidate as usize;
            let displacement = known.get(i).unwrap_or_else(|| deformed.displacement(i));
            part.rest_positions()[i] + displacement
        };
        let watch = &mut self.watch;
        let left_out = planes_and_rest_into(
            tool,
            &pose,
            &candidates,
            position_of,
            near_distance,
            planes,
            |candidate, distance, at| watch.postpone(part.clusters(), candidate, distance, at),
        );
        watch.give_back(candidates);
        report.dropped = (left_out.n_beyond_capacity + left_out.n_invalid) as u32;
        self.scratch.find_missing();
        let Scratch {
            active,
            known,
            missing,
            extra,
            pairs,
            ..
        } = &mut self.scratch;
        if !missing.is_empty() {
            let deformed = Deformed {
                part,
                active,
                constrained,
                pairs,
            };
            let position_of = |candidate: u32| {
                let i = candidate as usize;
                let displacement = known.get(i).unwrap_or_else(|| deformed.displacement(i));
                part.rest_positions()[i] + displacement
            };
            planes_into(tool, &pose, missing, position_of, f64::INFINITY, extra);
        }
        self.scratch.keep_seen();
        let m = self.scratch.gather(part.clusters(), self.reach_of_rotation);
        let Scratch {
            planes,
            u_before,
            prune,
            w_matrix,
            q,
            pairs,
            ..
        } = &mut self.scratch;
        (report.near, report.rows) = (planes.len() as u32, m as u32);
        u_before.clear();
        u_before.extend(
            planes
                .iter()
                .map(|p| p.point - part.rest_positions()[p.candidate as usize]),
        );
        clock.lap(Stage::Planes, report);

        // q: the gap that remains at zero contact force.
        for ((q, plane), u) in q.iter_mut().zip(planes.iter()).zip(u_before.iter()) {
            let along: f64 = plane
                .tool_row(reference)
                .iter()
                .zip(&self.deviation)
                .map(|(h, e)| h * e)
                .sum();
            *q = plane.gap - plane.normal.dot(*u) + along;
        }
        if prune.patches().is_some() {
            prune.reduce(planes.len(), q);
        }
        // W: compliance of part and coupling seen along the contact normals. Not needed where all
        // gaps are open without force: then z = 0 is the exact answer.
        let is_open = q[..m].iter().all(|q| *q >= 0.0);
        if !is_open {
            let coupling = self
                .coupling_compliance
                .as_ref()
                .map(|matrix| CouplingCompliance { matrix, reference });
            let w = &mut w_matrix[..m * m];
            let patches = prune.patches();
            let candidates = planes.iter().map(|plane| plane.candidate);
            let assembled = match &mut self.constrained {
                None if pairs.ensure(candidates.clone(), part) => {
                    assemble(&*pairs, planes, patches, coupling, w)
                }
                None => assemble(part, planes, patches, coupling, w),
                Some(constrained) => {
                    constrained.ensure(candidates, &[], part);
                    assemble(constrained.blocks(), planes, patches, coupling, w)
                }
            };
            debug_assert!(assembled.is_ok(), "the matrix has the size of the planes");
        }
        clock.lap(Stage::Delassus, report);

        if is_open {
            self.scratch.z[..m].fill(0.0);
            (report.certificate, report.lcp_solved) = (0.0, true);
        } else {
            self.scratch.solve(m, &self.settings.lcp, report);
        }
        clock.lap(Stage::Lcp, report);

        // Forces of the near nodes become the state; the tool goes where its coupling balances.
        self.scratch.adopt_forces();
        if let Some(constrained) = &mut self.constrained {
            constrained.forget_terms();
        }
        let (force, torque) = wrench_on_tool(&self.scratch.planes, &self.scratch.z, reference);
        report.contact_wrench_on_tool = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        if let Some(compliance) = &self.coupling_compliance {
            self.deviation = compliance.map(|row| {
                row.iter()
                    .zip(&report.contact_wrench_on_tool)
                    .map(|(c, f)| c * f)
                    .sum()
            });
        }
        let moved = VirtualCoupling::pose_from_deviation(target, &self.deviation);
        let mut change = (moved.translation - tool_pose.translation).length()
            + self.reach_of_rotation * moved.rotation.angle_between(tool_pose.rotation);
        *tool_pose = moved;
        let Scratch {
            planes,
            u_before,
            active,
            known,
            pairs,
            ..
        } = &mut self.scratch;
        let deformed = Deformed {
            part,
            active,
            constrained: self.constrained.as_deref(),
            pairs,
        };
        known.forget();
        for (plane, before) in planes.iter().zip(u_before.iter()) {
            let u = deformed.displacement(plane.candidate as usize);
            if deformed.constrained.is_none() {
                known.set(plane.candidate as usize, u);
            }
            change = change.max((u - *before).length());
        }
        (report.merge_error, report.merged_penetration) = (0.0, 0.0);
        report.merged_badly = false;
        if self.scratch.prune.patches().is_some() {
            self.weigh_patches(reference, report);
        }
        clock.lap(Stage::Update, report);
        change
    }

    /// What the rows that nodes share have cost, and better shares for the next time.
    fn weigh_patches(&mut self, reference: DVec3, report: &mut StepReport) {
        let stride = self.scratch.stride();
        let Scratch {
            planes,
            prune,
            active,
            known,
            pairs,
            z,
            ..
        } = &mut self.scratch;
        let (part, constrained) = (self.part.as_ref(), self.constrained.as_deref());
        let deformed = Deformed {
            part,
            active,
            constrained,
            pairs,
        };
        let motion_of = |plane: &Plane| {
            let i = plane.candidate as usize;
            let displacement = known.get(i).unwrap_or_else(|| deformed.displacement(i));
            let row = plane.tool_row(reference);
            let along = row.iter().zip(&self.deviation).map(|(h, e)| h * e).sum();
            (displacement, along)
        };
        let own_of = |plane: &Plane| {
            let i = plane.candidate as usize;
            let block = match constrained {
                None => part.block(i, i),
                Some(constrained) => constrained.blocks().block(i, i),
            };
            plane.normal.dot(*block * plane.normal)
        };
        let loss = prune.learn(planes, z, motion_of, own_of, stride);
        report.merged_penetration = loss.penetration;
        report.merge_error = loss.force_rel;
        report.merged_badly = loss.force_rel > self.settings.merge_tolerance;
    }

    /// Fills in both sides of the tool's equilibrium.
    fn balance(&self, target: &DPose3, report: &mut StepReport) {
        report.coupling_wrench_on_tool = match &self.coupling {
            Some(coupling) => {
                let e = VirtualCoupling::deviation(target, &report.tool_pose);
                coupling.wrench_on_tool(&e).to_array()
            }
            // An imposed pose carries whatever the contact asks for.
            None => report.contact_wrench_on_tool.map(|x| -x),
        };
    }
}

/// W of the planes, or of the patches they are gathered in.
fn assemble(
    compliance: &impl ComplianceBlocks,
    planes: &[Plane],
    patches: Option<&Patches>,
    coupling: Option<CouplingCompliance>,
    w: &mut [f64],
) -> Result<(), contact::Error> {
    match patches {
        None => delassus_into(compliance, planes, coupling, w),
        Some(patches) => patches.delassus_into(compliance, planes, coupling, w),
    }
}

fn state_of<'a>(
    part: &'a ContactPart,
    tool: &'a Tool,
    tool_pose: &'a DPose3,
    scratch: &'a Scratch,
    constrained: Option<&'a Constrained>,
) -> State<'a> {
    State {
        deformed: Deformed {
            part,
            active: &scratch.active,
            constrained,
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

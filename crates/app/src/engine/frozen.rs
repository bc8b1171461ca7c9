//! The contact problem of one step, frozen, to be solved again for other targets where whole steps take longer than
//! a period.
//!
//! The rows are those of the step's last pass, and the nodes that may come near before the next step ends. The
//! operator is kept, and so is its factor: a solve changes it by the rows that come and go, in some m² operations.
//! What changes is the gaps. They are measured anew, at the places where the last answer has the nodes and the tool:
//!
//! ```text
//! w = g(ξ, u) + W (z - z_last)      u = C f_last      W = H_d C H_dᵀ + H_t K_c⁻¹ H_tᵀ, kept
//! ```
//!
//! so that where solves stand still, they stand at the solution of a whole step (a modified Newton's method). Where
//! that reads too much of C for a tick, the planes themselves are kept, and move with the target:
//!
//! ```text
//! w = q₀ - H_t (ξ* - ξ*₀) + W z
//! ```
//!
//! which costs m² in all, and leaves out that loaded planes turn as the tool slides over the part: an error of first
//! order in the way since the step, in force times way over the tool's radius.
//!
//! With friction each solve is an increment of its own, from the answer before ([`law::Coulomb`]).

mod freeze;
mod law;

use bytemuck::cast_slice;
use contact::tool::Tool;
use contact::{Contact, Place, wrench_on_tool};
use glam::{DMat3, DVec3};
use glamx::DPose3;
use std::time::Instant;

use super::forces::Loads;
use super::held::Held;
use super::law::ByContact;
use super::{ActiveContact, StepReport};
use law::{Law, Measured};

/// Passes in a tick whose gaps are measured, at most; and the change of the wrench, relative, from which on no further
/// one is made. Each pass leaves a tenth to a third of the change before it.
const MOST_PASSES: u32 = 4;
const LEAST_CHANGE: f64 = 1e-4;

/// A frozen contact problem with all memory to make and solve it, sized once.
#[derive(Debug)]
pub struct FrozenProblem {
    /// The step it is from.
    step: StepReport,
    target: DPose3,
    reference: DVec3,
    held: Held,
    reach_of_rotation: f64,
    /// m, that part and tool may move before a place without a row can touch.
    margin: f64,
    tool: Tool,
    /// Passes of a tick at most; with none the planes are kept.
    most_passes: u32,
    /// As frozen, or as the last answer has them.
    contacts: Vec<Contact>,
    /// By row.
    places: Vec<Place>,
    /// m, by row: where the last answer has it.
    positions: Vec<DVec3>,
    /// C between rows, 3x3 column-major inside, block of rows i and j at j m + i; for gaps that are measured.
    blocks: Vec<f64>,
    /// m/N by row: no other candidate moves by more than this for a change of the row's force.
    yields: Vec<f64>,
    q_frozen: Vec<f64>,
    law: Law,
    /// When an answer with friction ends as it is then.
    deadline: Option<Instant>,
    /// N, by row, on the part, at the step's own target.
    forces_frozen: Vec<DVec3>,
    /// Of the last answer, by row.
    forces: ByContact,
    /// (m, rad), of the tool from its target in the last answer.
    deviation: [f64; 6],
    /// On the tool in the last answer.
    wrench: [f64; 6],
    loads: Loads,
    last_tool_pose: DPose3,
    // What making it needs.
    candidates: Vec<u32>,
    extra: Vec<Contact>,
}

/// Answer of a frozen problem.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    /// The report of the step it was frozen from, with pose, wrenches, contacts and certificate of the answer and no
    /// times.
    pub report: StepReport,
    /// Whether no node without a row can have come into contact (a bound, normals held).
    pub is_within: bool,
}

impl FrozenProblem {
    /// Rows of the problem.
    pub fn n_rows(&self) -> usize {
        self.contacts.len()
    }

    /// m, that part and tool may move together before a node that has no row can touch.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The target of the step it was frozen from, in the part's frame.
    pub fn target(&self) -> &DPose3 {
        &self.target
    }

    /// Nodes that carry force in the last answer.
    pub fn active_contacts(&self) -> &[ActiveContact] {
        &self.loads.active
    }

    /// Whether gaps are measured anew in every solve, or the planes kept.
    pub fn is_renewed(&self) -> bool {
        self.most_passes > 0
    }

    /// Keeps the planes of the step in the solves that follow, whatever their number.
    pub fn keep_planes(&mut self) {
        self.most_passes = 0;
    }

    /// From now on an answer with friction that is not found by then is the best one found, flagged. `None`: without an
    /// end, and the same each time.
    pub fn answer_by(&mut self, deadline: Option<Instant>) {
        self.deadline = deadline;
    }

    /// Equilibrium for a target (part's frame), from the answer before.
    ///
    /// Does not allocate, lock, log or block, and reads no clock. A target that is not finite is flagged, and the
    /// answer is that of the step.
    pub fn solve(&mut self, target: &DPose3) -> Prediction {
        if !(target.translation.is_finite() && target.rotation.is_finite()) {
            let mut report = self.step;
            report.rejected = true;
            report.tool_pose = self.last_tool_pose;
            let is_within = false;
            return Prediction { report, is_within };
        }
        if self.most_passes > 0 {
            self.solve_renewed(target)
        } else {
            let moved = self.held.deviation(&self.target, target);
            self.law.move_gaps(&self.q_frozen, &moved, &self.forces);
            self.answer(target)
        }
    }

    /// Passes over gaps that are measured, until they change little.
    fn solve_renewed(&mut self, target: &DPose3) -> Prediction {
        let mut wrench = self.wrench;
        let mut pivots = 0;
        let mut pass = 0;
        loop {
            pass += 1;
            self.measure_gaps(target, pass == 1);
            let mut answer = self.answer(target);
            pivots += answer.report.pivots;
            let (change, size) = (0..6)
                .map(|i| (self.wrench[i] - wrench[i], self.wrench[i]))
                .fold((0.0, 0.0), |sum: (f64, f64), (d, w)| {
                    (sum.0 + d * d, sum.1 + w * w)
                });
            if pass == self.most_passes || change <= LEAST_CHANGE * LEAST_CHANGE * size {
                answer.report.passes = pass;
                answer.report.pivots = pivots;
                return answer;
            }
            wrench = self.wrench;
        }
    }

    /// Planes and gaps at the places of the last answer, with the tool as far from this target as from the last.
    fn measure_gaps(&mut self, target: &DPose3, is_first: bool) {
        let m = self.contacts.len();
        let pose = self.held.pose(target, &self.deviation);
        self.reference = self.held.reference(target, &self.deviation);
        let blocks: &[DMat3] = cast_slice(&self.blocks[..9 * m * m]);
        // By contact: columns lie side by side.
        self.positions.clear();
        self.positions
            .extend(self.places.iter().map(|place| place.rest));
        for (j, on_part) in self.forces.on_part[..m].iter().enumerate() {
            if *on_part != DVec3::ZERO {
                for (x, block) in self.positions.iter_mut().zip(&blocks[j * m..]) {
                    *x += *block * *on_part;
                }
            }
        }
        if is_first {
            self.law.begin_tick(&self.positions, &self.last_tool_pose);
        }
        for (k, (place, x)) in self.places.iter().zip(&self.positions).enumerate() {
            // What is not finite shows in the certificate.
            self.contacts[k] = place.contact(k as u32, &self.tool, &pose, *x);
        }
        let measured = Measured {
            contacts: &self.contacts,
            positions: &self.positions,
            tool_pose: &pose,
        };
        self.law.measure_gaps(&measured, &self.forces);
    }

    fn answer(&mut self, target: &DPose3) -> Prediction {
        let mut report = StepReport {
            stage_ns: Default::default(),
            passes: 1,
            strides: 1,
            pivots: 0,
            certificate: 0.0,
            lcp_solved: true,
            near: self.contacts.len() as u32,
            ..self.step
        };
        self.law
            .solve(&self.contacts, &mut self.forces, &mut report, self.deadline);
        self.conclude(target, report)
    }

    /// What the forces do.
    fn conclude(&mut self, target: &DPose3, mut report: StepReport) -> Prediction {
        let m = self.contacts.len();
        self.loads.clear();
        report.contacts = 0;
        for (row, place) in self.places.iter().enumerate() {
            let force = self.forces.normal[row];
            if force > 0.0 {
                report.contacts += 1;
                let (on_part, sticks) = (self.forces.on_part[row], self.forces.sticks[row]);
                self.loads.add(place, force, on_part, sticks);
            }
        }
        let on_part = &self.forces.on_part[..m];
        let (force, torque) = wrench_on_tool(&self.contacts, on_part, self.reference);
        let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        self.deviation = self.held.deviation_under(&wrench);
        self.wrench = wrench;
        report.contact_wrench_on_tool = wrench;
        report.tool_pose = self.held.pose(target, &self.deviation);
        report.coupling_wrench_on_tool =
            self.held.wrench_on_tool(target, &report.tool_pose, &wrench);
        self.last_tool_pose = report.tool_pose;
        let of_rows = on_part.iter().zip(&self.forces_frozen).zip(&self.yields);
        let by_part: f64 = of_rows
            .map(|((force, then), yields)| yields * (*force - *then).length())
            .sum();
        let (from, to) = (&self.step.tool_pose, &report.tool_pose);
        let by_tool = (to.translation - from.translation).length()
            + self.reach_of_rotation * to.rotation.angle_between(from.rotation);
        Prediction {
            report,
            is_within: by_tool + by_part <= self.margin,
        }
    }
}

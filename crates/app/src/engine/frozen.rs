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

use bytemuck::cast_slice;
use contact::delassus::{ComplianceBlocks, CouplingCompliance, delassus_into};
use contact::lcp;
use contact::plane::{Plane, planes_and_rest_into, wrench_on_tool};
use contact::tool::Tool;
use device::VirtualCoupling;
use glam::{DMat3, DVec3};
use glamx::DPose3;

use super::part::Deformed;
use super::{ActiveContact, Engine, StepReport, state_of};

/// Rows of nodes that are not near yet: half as many as there are near ones, so that W costs twice that of a pass at
/// most, and no fewer than this.
const FEWEST_EXTRA: usize = 32;

/// Blocks of C that a tick reads to measure its gaps, at most: some 0.3 ms. As many passes are made as that allows.
const MOST_BLOCKS: usize = 160_000;

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
    coupling: Option<VirtualCoupling>,
    compliance: Option<[[f64; 6]; 6]>,
    reach_of_rotation: f64,
    /// m, that part and tool may move before a node without a row can touch.
    margin: f64,
    tool: Tool,
    /// Passes of a tick at most; with none the planes are kept.
    most_passes: u32,
    /// As frozen, or as the last answer has them.
    planes: Vec<Plane>,
    /// m, by row, of the node at rest.
    rest: Vec<DVec3>,
    /// C between rows, 3x3 column-major inside, block of rows i and j at j m + i; for gaps that are measured.
    blocks: Vec<f64>,
    /// h by row, of the frozen planes.
    tool_rows: Vec<[f64; 6]>,
    /// m/N by row: no other candidate moves by more than this for a change of the row's force.
    yields: Vec<f64>,
    q_frozen: Vec<f64>,
    w_matrix: Vec<f64>,
    /// N, by row, on the part, at the step's own target.
    forces_frozen: Vec<DVec3>,
    q: Vec<f64>,
    /// N, by row, of the last answer.
    forces: Vec<f64>,
    /// (m, rad), of the tool from its target in the last answer.
    deviation: [f64; 6],
    /// On the tool in the last answer.
    wrench: [f64; 6],
    gaps: Vec<f64>,
    active: Vec<ActiveContact>,
    lcp: lcp::Scratch,
    settings: lcp::Settings,
    warm: Vec<bool>,
    last_tool_pose: DPose3,
    // What making it needs.
    candidates: Vec<u32>,
    is_row: Vec<bool>,
    extra: Vec<Plane>,
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
        self.planes.len()
    }

    /// m, that part and tool may move together before a node that has no row can touch.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The target of the step it was frozen from, in the part's frame.
    pub fn target(&self) -> &DPose3 {
        &self.target
    }

    /// Contacts that carry force in the last answer.
    pub fn active_contacts(&self) -> &[ActiveContact] {
        &self.active
    }

    /// Whether gaps are measured anew in every solve, or the planes kept.
    pub fn is_renewed(&self) -> bool {
        self.most_passes > 0
    }

    /// Keeps the planes of the step in the solves that follow, whatever their number.
    pub fn keep_planes(&mut self) {
        self.most_passes = 0;
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
            self.move_gaps(target);
            self.answer(target, lcp::Start::Kept)
        }
    }

    /// Passes over gaps that are measured, until they change little.
    fn solve_renewed(&mut self, target: &DPose3) -> Prediction {
        let mut wrench = self.wrench;
        let mut pivots = 0;
        let mut pass = 0;
        loop {
            pass += 1;
            self.measure_gaps(target);
            let mut answer = self.answer(target, lcp::Start::Kept);
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

    /// q where the planes move with the target.
    fn move_gaps(&mut self, target: &DPose3) {
        let moved = VirtualCoupling::deviation(&self.target, target);
        let of_rows = self.q_frozen.iter().zip(&self.tool_rows);
        for (q, (q_frozen, h)) in self.q.iter_mut().zip(of_rows) {
            *q = q_frozen - dot(h, &moved);
        }
    }

    /// Planes and q at the places of the last answer, with the tool as far from this target as from the last.
    fn measure_gaps(&mut self, target: &DPose3) {
        let m = self.planes.len();
        let pose = VirtualCoupling::pose_from_deviation(target, &self.deviation);
        self.reference = pose.translation;
        let blocks: &[DMat3] = cast_slice(&self.blocks[..9 * m * m]);
        // By contact: columns lie side by side. First the places, in the planes' points.
        for (plane, rest) in self.planes.iter_mut().zip(&self.rest) {
            plane.point = *rest;
        }
        self.q[..m].fill(0.0);
        for j in 0..m {
            let force = self.forces[j];
            if force == 0.0 {
                continue;
            }
            // The normal of the last answer: it is renewed below, after all places are known.
            let on_part = force * self.planes[j].normal;
            let columns = blocks[j * m..][..m].iter();
            let columns = columns.zip(&self.w_matrix[j * m..][..m]);
            for ((plane, q), (block, w)) in self.planes.iter_mut().zip(&mut self.q).zip(columns) {
                plane.point += *block * on_part;
                *q -= w * force;
            }
        }
        for (plane, q) in self.planes.iter_mut().zip(&mut self.q) {
            let contact = self.tool.signed_distance(&pose, plane.point);
            // What is not finite shows in the certificate.
            plane.gap = contact.signed_distance;
            plane.normal = contact.normal;
            *q += contact.signed_distance;
        }
    }

    fn answer(&mut self, target: &DPose3, start: lcp::Start<'_>) -> Prediction {
        let m = self.planes.len();
        let mut report = StepReport {
            stage_ns: Default::default(),
            passes: 1,
            strides: 1,
            pivots: 0,
            certificate: 0.0,
            lcp_solved: true,
            near: m as u32,
            ..self.step
        };
        let (q, forces) = (&self.q[..m], &mut self.forces[..m]);
        if q.iter().all(|q| *q >= 0.0) {
            forces.fill(0.0);
        } else {
            let solution =
                lcp::Problem::trusted_symmetric(&self.w_matrix[..m * m], q).and_then(|problem| {
                    lcp::solve(
                        &problem,
                        &self.settings,
                        &mut self.lcp,
                        start,
                        forces,
                        &mut self.gaps[..m],
                    )
                });
            match solution {
                Ok(solution) => {
                    report.pivots = (solution.rounds + solution.pivots) as u32;
                    report.certificate = solution.certificate.natural_residual;
                    report.lcp_solved = solution.status == lcp::Status::Solved;
                }
                // Only data that are not finite: no force, and the report says so.
                Err(_) => {
                    forces.fill(0.0);
                    (report.certificate, report.lcp_solved) = (f64::INFINITY, false);
                }
            }
        }
        self.active.clear();
        for (plane, &force) in self.planes.iter().zip(&*forces) {
            if force > 0.0 {
                self.active.push(ActiveContact {
                    candidate: plane.candidate,
                    normal_force: force,
                    force_on_part: force * plane.normal,
                });
            }
        }
        report.contacts = self.active.len() as u32;
        let (force, torque) = wrench_on_tool(&self.planes, forces, self.reference);
        let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        self.deviation = match &self.compliance {
            Some(compliance) => compliance.map(|row| dot(&row, &wrench)),
            None => [0.0; 6],
        };
        self.wrench = wrench;
        report.contact_wrench_on_tool = wrench;
        report.tool_pose = VirtualCoupling::pose_from_deviation(target, &self.deviation);
        report.coupling_wrench_on_tool = match &self.coupling {
            Some(coupling) => {
                let deviation = VirtualCoupling::deviation(target, &report.tool_pose);
                coupling.wrench_on_tool(&deviation).to_array()
            }
            None => wrench.map(|x| -x),
        };
        self.last_tool_pose = report.tool_pose;
        let of_rows = self.planes.iter().zip(&self.forces[..m]);
        let by_part: f64 = of_rows
            .zip(self.forces_frozen.iter().zip(&self.yields))
            .map(|((plane, force), (then, yields))| {
                yields * (*force * plane.normal - *then).length()
            })
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

impl Engine {
    /// Memory for frozen problems of this engine, empty: no contact, and nowhere valid.
    ///
    /// # Panics
    /// For a constrained part, whose operator changes while free nodes are switched (a scene that asks for both is
    /// refused).
    pub fn frozen_problem(&self) -> FrozenProblem {
        assert!(
            self.constrained.is_none(),
            "the operator of a constrained part is not frozen"
        );
        let rows = self.scratch.max_rows();
        let n = self.part.n_candidates();
        let identity = DPose3::IDENTITY;
        FrozenProblem {
            step: StepReport::at(&identity),
            target: identity,
            reference: DVec3::ZERO,
            coupling: self.coupling,
            compliance: self.coupling_compliance,
            reach_of_rotation: self.reach_of_rotation,
            margin: 0.0,
            tool: self.tool.clone(),
            most_passes: 0,
            planes: Vec::with_capacity(rows),
            rest: Vec::with_capacity(rows),
            blocks: vec![0.0; 9 * rows * rows],
            tool_rows: Vec::with_capacity(rows),
            yields: Vec::with_capacity(rows),
            q_frozen: Vec::with_capacity(rows),
            w_matrix: vec![0.0; rows * rows],
            forces_frozen: vec![DVec3::ZERO; rows],
            q: vec![0.0; rows],
            forces: vec![0.0; rows],
            deviation: [0.0; 6],
            wrench: [0.0; 6],
            gaps: vec![0.0; rows],
            active: Vec::with_capacity(rows),
            lcp: lcp::Scratch::new(rows),
            settings: self.settings.lcp.clone(),
            warm: vec![false; rows],
            last_tool_pose: identity,
            candidates: Vec::with_capacity(n),
            is_row: vec![false; n],
            extra: Vec::with_capacity(n),
        }
    }

    /// Freezes what the last step solved. `report`: of that step. `reach` (m): nodes nearer to the tool than this get
    /// a row, the nearest first, as many again as there are near ones, so that they can come into contact later.
    ///
    /// Solves the problem at the step's own target, so that the next solve finds its factor. Does not allocate, lock
    /// or log.
    pub fn freeze_into(&mut self, report: &StepReport, reach: f64, problem: &mut FrozenProblem) {
        let Some(target) = self.last_target else {
            return;
        };
        problem.step = *report;
        problem.target = target;
        problem.reference = self.reference;
        self.choose_rows(report, reach, problem);
        self.fill_rows(problem);
        let m = problem.planes.len();
        let (q, q_frozen) = (&mut problem.q, &problem.q_frozen);
        q[..m].copy_from_slice(q_frozen);
        let warm = std::mem::take(&mut problem.warm);
        problem.answer(&target, lcp::Start::Rows(&warm[..m]));
        problem.warm = warm;
        let of_rows = problem.planes.iter().zip(&problem.forces);
        for (frozen, (plane, force)) in problem.forces_frozen.iter_mut().zip(of_rows) {
            *frozen = *force * plane.normal;
        }
        let per_pass = (m * problem.active.len().max(m / 8)).max(1);
        problem.most_passes = ((MOST_BLOCKS / per_pass) as u32).min(MOST_PASSES);
        if problem.most_passes > 0 {
            self.copy_blocks(problem);
        }
    }

    /// The planes of the last pass, and of the nodes within reach besides, the nearest first.
    fn choose_rows(&mut self, report: &StepReport, reach: f64, problem: &mut FrozenProblem) {
        let part = self.part.as_ref();
        let near_distance = self.settings.near_distance;
        let reach = reach.max(near_distance);
        let FrozenProblem {
            planes,
            candidates,
            is_row,
            extra,
            ..
        } = problem;
        planes.clear();
        planes.extend_from_slice(&self.scratch.planes);
        for plane in &*planes {
            is_row[plane.candidate as usize] = true;
        }
        let pose = report.tool_pose;
        self.watch
            .look(state_of(part, &self.tool, &pose, &self.scratch, None));
        candidates.clear();
        candidates.extend(self.watch.within(reach).filter(|c| !is_row[*c as usize]));
        for plane in &*planes {
            is_row[plane.candidate as usize] = false;
        }
        let deformed = Deformed {
            part,
            active: &self.scratch.active,
            constrained: None,
            pairs: &self.scratch.pairs,
        };
        let position_of = |candidate: u32| {
            let i = candidate as usize;
            part.rest_positions()[i] + deformed.displacement(i)
        };
        let seen = planes_and_rest_into(
            &self.tool,
            &pose,
            candidates,
            position_of,
            reach,
            extra,
            |_, _| (),
        );
        extra.sort_unstable_by(|a, b| a.gap.total_cmp(&b.gap));
        let room = self.scratch.max_rows() - planes.len();
        let most = room.min((planes.len() / 2).max(FEWEST_EXTRA));
        let margin = extra.get(most).map_or(reach, |left_out| left_out.gap);
        planes.extend(extra.iter().take(most));
        problem.margin = if report.dropped > 0 || seen.n_invalid > 0 {
            0.0
        } else {
            (margin - 2.0 * self.tool.error_bound()).max(0.0)
        };
    }

    /// q, W and what else goes by rows.
    fn fill_rows(&mut self, problem: &mut FrozenProblem) {
        let part = self.part.as_ref();
        let reference = self.reference;
        let FrozenProblem {
            planes,
            tool_rows,
            yields,
            q_frozen,
            w_matrix,
            warm,
            ..
        } = problem;
        let m_of_pass = self.scratch.planes.len();
        tool_rows.clear();
        tool_rows.extend(planes.iter().map(|plane| plane.tool_row(reference)));
        yields.clear();
        yields.extend(
            planes
                .iter()
                .map(|plane| part.largest_block(plane.candidate)),
        );
        q_frozen.clear();
        q_frozen.extend_from_slice(&self.scratch.q[..m_of_pass]);
        for (plane, h) in planes.iter().zip(&*tool_rows).skip(m_of_pass) {
            let u = plane.point - part.rest_positions()[plane.candidate as usize];
            q_frozen.push(plane.gap - plane.normal.dot(u) + dot(h, &self.deviation));
        }
        for (warm, plane) in warm.iter_mut().zip(&*planes) {
            *warm = self.scratch.was_active[plane.candidate as usize];
        }
        let coupling = self
            .coupling_compliance
            .as_ref()
            .map(|matrix| CouplingCompliance { matrix, reference });
        let m = planes.len();
        let w = &mut w_matrix[..m * m];
        let pairs = &mut self.scratch.pairs;
        let assembled = if pairs.ensure(planes.iter().map(|plane| plane.candidate), part) {
            delassus_into(&*pairs, planes, coupling, w)
        } else {
            delassus_into(part, planes, coupling, w)
        };
        debug_assert!(assembled.is_ok(), "the matrix has the size of the planes");
    }
}

impl Engine {
    /// C between the rows, side by side.
    fn copy_blocks(&self, problem: &mut FrozenProblem) {
        let part = self.part.as_ref();
        let pairs = &self.scratch.pairs;
        let FrozenProblem {
            planes,
            rest,
            blocks,
            ..
        } = problem;
        rest.clear();
        rest.extend(
            planes
                .iter()
                .map(|plane| part.rest_positions()[plane.candidate as usize]),
        );
        let m = planes.len();
        let is_kept = planes
            .iter()
            .all(|plane| pairs.slot(plane.candidate).is_some());
        for (j, of_column) in planes.iter().enumerate() {
            let column = &mut blocks[9 * j * m..][..9 * m];
            for (out, of_row) in column.chunks_exact_mut(9).zip(&*planes) {
                let (row, col) = (of_row.candidate as usize, of_column.candidate as usize);
                let block = if is_kept {
                    pairs.block(row, col)
                } else {
                    part.block(row, col)
                };
                out.copy_from_slice(&block.to_cols_array());
            }
        }
    }
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

//! From a step to its frozen problem: rows, gaps, operator and its factor.

use contact::delassus::{ComplianceBlocks, delassus_into};
use contact::lcp;
use contact::plane::planes_and_rest_into;
use glam::DVec3;
use glamx::DPose3;

use super::super::part::Deformed;
use super::super::{Engine, StepReport, state_of};
use super::{FrozenProblem, MOST_PASSES, dot};

/// Rows of nodes that are not near yet: half as many as there are near ones, so that W costs twice that of a pass at
/// most, and no fewer than this.
const FEWEST_EXTRA: usize = 32;

/// Blocks of C that a tick reads to measure its gaps, at most: some 0.3 ms. As many passes are made as that allows.
const MOST_BLOCKS: usize = 160_000;

impl Engine {
    /// Memory for frozen problems of this engine, empty: no contact, and nowhere valid.
    ///
    /// # Panics
    /// For a tool whose edges touch (scenes that ask for it are refused).
    pub fn frozen_problem(&self) -> FrozenProblem {
        assert!(
            self.edges.is_none(),
            "rows between the nodes are not frozen"
        );
        let rows = self.scratch.max_rows();
        let n = self.part.n_candidates();
        let identity = DPose3::IDENTITY;
        FrozenProblem {
            step: StepReport::at(&identity),
            target: identity,
            reference: DVec3::ZERO,
            held: self.held,
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
        let of_pass = &self.scratch.planes;
        let max_rows = self.scratch.max_rows();
        let shares_rows = of_pass.len() > max_rows;
        if shares_rows {
            // Rows of their own for those that carry force, and the deepest: an answer, but not within its margin.
            let was_active = &self.scratch.was_active;
            extra.clear();
            extra.extend_from_slice(of_pass);
            extra.sort_unstable_by(|a, b| {
                let [x, y] = [a, b].map(|plane| was_active[plane.candidate as usize]);
                y.cmp(&x).then(a.gap.total_cmp(&b.gap))
            });
            planes.extend_from_slice(&extra[..max_rows]);
        } else {
            planes.extend_from_slice(of_pass);
        }
        for plane in &*planes {
            is_row[plane.candidate as usize] = true;
        }
        let pose = report.tool_pose;
        let state = state_of(part, &self.tool, &pose, &self.scratch);
        self.watch.advance(state);
        self.watch.look(state);
        self.watch.within(part.clusters(), reach, candidates);
        candidates.retain(|c| !is_row[*c as usize] && part.is_taken_in(*c));
        for plane in &*planes {
            is_row[plane.candidate as usize] = false;
        }
        let deformed = Deformed {
            part,
            active: &self.scratch.active,
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
            |_, _, _| (),
        );
        extra.sort_unstable_by(|a, b| a.gap.total_cmp(&b.gap));
        let room = max_rows - planes.len();
        let most = room.min((planes.len() / 2).max(FEWEST_EXTRA));
        let margin = extra.get(most).map_or(reach, |left_out| left_out.gap);
        planes.extend(extra.iter().take(most));
        problem.margin = if shares_rows || report.dropped > 0 || seen.n_invalid > 0 {
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
        // Where nodes share rows, q is that of the patches.
        let shares_rows = self.scratch.prune.patches().is_some();
        let m_of_pass = if shares_rows {
            0
        } else {
            self.scratch.planes.len()
        };
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
        let coupling = self.held.compliance_about(reference);
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

//! From a step to its frozen problem: rows, gaps, operator and its factor.

use contact::delassus::{ComplianceBlocks, delassus_into};
use contact::{Contact, lcp};
use glam::DVec3;
use glamx::DPose3;

use super::super::forces::Loads;
use super::super::near::Look;
use super::super::{Engine, StepReport};
use super::{FrozenProblem, MOST_PASSES, dot};

/// Rows of places that are not near yet: half as many as there are near ones, so that W costs twice that of a pass at
/// most, and no fewer than this.
const FEWEST_EXTRA: usize = 32;

/// Blocks of C that a tick reads to measure its gaps, at most: some 0.3 ms. As many passes are made as that allows.
const MOST_BLOCKS: usize = 160_000;

impl Engine {
    /// Memory for frozen problems of this engine, empty: no contact, and nowhere valid.
    pub fn frozen_problem(&self) -> FrozenProblem {
        let rows = self.rows.max_rows();
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
            contacts: Vec::with_capacity(rows),
            places: Vec::with_capacity(rows),
            positions: Vec::with_capacity(rows),
            blocks: vec![0.0; 9 * rows * rows],
            tool_rows: Vec::with_capacity(rows),
            yields: Vec::with_capacity(rows),
            q_frozen: Vec::with_capacity(rows),
            w_matrix: vec![0.0; rows * rows],
            forces_frozen: vec![DVec3::ZERO; rows],
            q: vec![0.0; rows],
            forces: vec![0.0; rows],
            on_part: Vec::with_capacity(rows),
            deviation: [0.0; 6],
            wrench: [0.0; 6],
            gaps: vec![0.0; rows],
            loads: Loads::new(n),
            lcp: lcp::Scratch::new(rows),
            settings: self.settings.lcp.clone(),
            warm: vec![false; rows],
            last_tool_pose: identity,
            candidates: Vec::with_capacity(n),
            extra: Vec::with_capacity(self.places.capacity()),
        }
    }

    /// Freezes what the last step solved. `report`: of that step. `reach` (m): places nearer to the tool than this get
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
        let m = problem.contacts.len();
        let (q, q_frozen) = (&mut problem.q, &problem.q_frozen);
        q[..m].copy_from_slice(q_frozen);
        let warm = std::mem::take(&mut problem.warm);
        problem.answer(&target, lcp::Start::Rows(&warm[..m]));
        problem.warm = warm;
        let of_rows = problem.contacts.iter().zip(&problem.forces);
        for (frozen, (contact, force)) in problem.forces_frozen.iter_mut().zip(of_rows) {
            *frozen = *force * contact.normal;
        }
        let per_pass = (m * (report.contacts as usize).max(m / 8)).max(1);
        problem.most_passes = ((MOST_BLOCKS / per_pass) as u32).min(MOST_PASSES);
    }

    /// The contacts of the last pass, and of the places within reach besides, the nearest first, by the engine's places.
    fn choose_rows(&mut self, report: &StepReport, reach: f64, problem: &mut FrozenProblem) {
        let near_distance = self.settings.near_distance;
        let reach = reach.max(near_distance);
        let max_rows = self.rows.max_rows();
        let FrozenProblem {
            contacts,
            extra,
            candidates,
            ..
        } = problem;
        contacts.clear();
        extra.clear();
        extra.extend_from_slice(&self.rows.contacts);
        let shares_rows = extra.len() > max_rows;
        if shares_rows {
            // Rows of their own for those that carry force, and the deepest: an answer, but not within its margin.
            let carries = |contact: &Contact| {
                let place = &self.places.list()[contact.place as usize];
                self.forces.is_carried(place.key)
            };
            extra.sort_unstable_by(|a, b| {
                let [x, y] = [a, b].map(carries);
                y.cmp(&x).then(a.gap.total_cmp(&b.gap))
            });
            extra.truncate(max_rows);
        }
        contacts.extend_from_slice(extra);
        let n_before = self.places.list().len();
        let mut seen = *report;
        (seen.dropped, seen.without_column) = (0, 0);
        let tool_pose = report.tool_pose;
        self.places.hold_all();
        let mut look = Look {
            part: &self.part,
            tool: &self.tool,
            tool_pose: &tool_pose,
            near_distance: reach,
            forces: &mut self.forces,
            places: &mut self.places,
            late: None,
            report: &mut seen,
        };
        self.near.look_further(near_distance, candidates, &mut look);
        extra.clear();
        extra.extend_from_slice(&self.places.drawn()[n_before..]);
        extra.sort_unstable_by(|a, b| a.gap.total_cmp(&b.gap));
        let room = max_rows - contacts.len();
        let most = room.min((contacts.len() / 2).max(FEWEST_EXTRA));
        let margin = extra.get(most).map_or(reach, |left_out| left_out.gap);
        // Beyond it points of the tool's edges are not looked for.
        let margin = if self.has_features() {
            margin.min(near_distance)
        } else {
            margin
        };
        contacts.extend(extra.iter().take(most));
        problem.margin = if shares_rows || report.dropped > 0 || seen.dropped > 0 {
            0.0
        } else {
            (margin - 2.0 * self.tool.error_bound()).max(0.0)
        };
    }

    /// q, W and what else goes by rows, which from here on are numbered by themselves.
    fn fill_rows(&mut self, problem: &mut FrozenProblem) {
        let part = self.part.as_ref();
        let reference = self.reference;
        let FrozenProblem {
            contacts,
            places,
            blocks,
            tool_rows,
            yields,
            q_frozen,
            w_matrix,
            warm,
            ..
        } = problem;
        // Where contacts share rows, q is that of the patches.
        let m_of_pass = match self.rows.share.patches() {
            Some(_) => 0,
            None => self.rows.contacts.len(),
        };
        let list = self.places.list();
        places.clear();
        places.extend(contacts.iter().map(|contact| list[contact.place as usize]));
        tool_rows.clear();
        tool_rows.extend(contacts.iter().map(|contact| contact.tool_row(reference)));
        yields.clear();
        yields.extend(places.iter().map(|place| {
            let shares = place.shares().iter();
            let by_share = shares.map(|(node, w)| w.abs() * part.largest_block(*node));
            by_share.sum::<f64>()
        }));
        q_frozen.clear();
        q_frozen.extend_from_slice(&self.rows.q[..m_of_pass]);
        for (contact, h) in contacts.iter().zip(&*tool_rows).skip(m_of_pass) {
            let u = self.places.displacement_when_drawn(contact.place as usize);
            q_frozen.push(contact.gap - contact.normal.dot(u) + dot(h, &self.deviation));
        }
        for (warm, place) in warm.iter_mut().zip(&*places) {
            *warm = self.forces.is_carried(place.key);
        }
        self.places.fetch(&mut self.forces.pairs, part);
        let compliance = self.places.compliance(&self.forces.pairs, part);
        let coupling = self.held.compliance_about(reference);
        let m = contacts.len();
        let assembled = delassus_into(&compliance, contacts, coupling, &mut w_matrix[..m * m]);
        debug_assert!(assembled.is_ok(), "the matrix has the size of the rows");
        for (j, of_column) in contacts.iter().enumerate() {
            let column = &mut blocks[9 * j * m..][..9 * m];
            for (out, of_row) in column.chunks_exact_mut(9).zip(&*contacts) {
                let block = compliance.block(of_row.place as usize, of_column.place as usize);
                out.copy_from_slice(&block.to_cols_array());
            }
        }
        for (row, contact) in contacts.iter_mut().enumerate() {
            contact.place = row as u32;
        }
    }
}

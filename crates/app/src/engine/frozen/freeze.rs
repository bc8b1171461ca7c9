//! From a step to its frozen problem: rows, gaps, operator and its factor.

use contact::Contact;
use contact::delassus::ComplianceBlocks;
use glam::DVec3;
use glamx::DPose3;

use super::super::forces::Loads;
use super::super::law::{self, ByContact};
use super::super::near::Look;
use super::super::rows::Bodies;
use super::super::{Engine, StepReport};
use super::law::Law;
use super::{FrozenProblem, MOST_PASSES};

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
            deadline: None,
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
            yields: Vec::with_capacity(rows),
            q_frozen: Vec::with_capacity(rows),
            law: Law::of(self),
            forces_frozen: vec![DVec3::ZERO; rows],
            forces: ByContact::new(rows),
            deviation: [0.0; 6],
            wrench: [0.0; 6],
            loads: Loads::new(n),
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
        if let Some(coulomb) = self.law.coulomb_mut() {
            coulomb.end_step();
        }
        problem.answer_by(None);
        problem.step = *report;
        problem.target = target;
        problem.reference = self.reference;
        self.choose_rows(report, reach, problem);
        self.fill_rows(problem);
        let m = problem.contacts.len();
        self.answer_as_the_step(&target, problem);
        problem.forces_frozen[..m].copy_from_slice(&problem.forces.on_part[..m]);
        let per_pass = (m * (report.contacts as usize).max(m / 8)).max(1);
        problem.most_passes = ((MOST_BLOCKS / per_pass) as u32).min(MOST_PASSES);
    }

    /// Forces at the step's own target: those of the step where friction holds them, else solved for, which leaves a factor.
    fn answer_as_the_step(&self, target: &DPose3, problem: &mut FrozenProblem) {
        if let (law::Law::Coulomb(coulomb), Law::Coulomb(frozen)) = (&self.law, &mut problem.law) {
            frozen.coefficients.clear();
            for (row, (contact, place)) in problem.contacts.iter().zip(&problem.places).enumerate()
            {
                let on_part = coulomb.last_force(place.key);
                problem.forces.normal[row] = contact.normal.dot(on_part);
                problem.forces.on_part[row] = on_part;
                problem.forces.sticks[row] = false;
                frozen.coefficients.push(coulomb.coefficient(place.key));
            }
            problem.conclude(target, problem.step);
        } else {
            problem
                .law
                .move_gaps(&problem.q_frozen, &[0.0; 6], &problem.forces);
            problem.answer(target);
        }
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
            yields,
            q_frozen,
            law,
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
        yields.clear();
        yields.extend(places.iter().map(|place| {
            let shares = place.shares().iter();
            let by_share = shares.map(|(node, w)| w.abs() * part.largest_block(*node));
            by_share.sum::<f64>()
        }));
        q_frozen.clear();
        q_frozen.extend_from_slice(&self.rows.q[..m_of_pass]);
        let bodies = Bodies {
            part,
            held: &self.held,
            reference,
            deviation: &self.deviation,
        };
        for contact in &contacts[m_of_pass..] {
            let u = self.places.displacement_when_drawn(contact.place as usize);
            let of_tool = bodies.along(contact, contact.normal);
            q_frozen.push(contact.gap - contact.normal.dot(u) + of_tool);
        }
        if let Law::Frictionless(law) = law {
            law.warm.clear();
            law.warm
                .extend(places.iter().map(|place| self.forces.is_carried(place.key)));
        }
        self.places.fetch(&mut self.forces.pairs, part);
        let compliance = self.places.compliance(&self.forces.pairs, part);
        let coupling = self.held.compliance_about(reference);
        let m = contacts.len();
        law.assemble(&compliance, contacts, coupling, reference);
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

//! Coulomb's law: what slips counts from tick to tick, from the state that the step left on.
//!
//! ```text
//! q_n = g - (W λ)_n      q_t = T·(x - M x⁰) - (W λ)_t      M = X X⁰⁻¹
//! ```
//! λ: forces of the last answer along the frames as they are now; x and X: where it has the place and the tool, x⁰ and X⁰:
//! where they were when the tick began. Where planes are kept, q_t = -(W λ⁰)_t - h_t·(motion of the target in the tick).

use std::time::Instant;

use contact::Contact;
use contact::delassus::{
    ComplianceBlocks, CouplingCompliance, Frame, delassus_frames_into, frame, frame_along,
};
use contact::friction::{Problem, Scratch, Settings, State};
use glam::DVec3;
use glamx::DPose3;

use super::super::super::StepReport;
use super::super::super::law::{ByContact, solve_cones};
use super::{Measured, dot};

#[derive(Debug)]
pub(in super::super) struct Coulomb {
    /// By row, as last measured.
    frames: Vec<Frame>,
    /// [h, h_t1, h_t2] by row, of the frozen planes.
    tool_rows: Vec<[[f64; 6]; 3]>,
    /// By row of three.
    w_matrix: Vec<f64>,
    q: Vec<f64>,
    force: Vec<f64>,
    motion: Vec<f64>,
    /// By row.
    pub(in super::super) coefficients: Vec<f64>,
    /// m, by row, and the tool: when the tick began.
    positions: Vec<DVec3>,
    tool_pose: DPose3,
    /// (m, rad), of the target since the step, in the last tick.
    moved: [f64; 6],
    scratch: Scratch,
}

impl Coulomb {
    pub(super) fn new(rows: usize) -> Self {
        let n = 3 * rows;
        Self {
            frames: Vec::with_capacity(rows),
            tool_rows: Vec::with_capacity(rows),
            w_matrix: vec![0.0; n * n],
            q: vec![0.0; n],
            force: vec![0.0; n],
            motion: vec![0.0; n],
            coefficients: Vec::with_capacity(rows),
            positions: Vec::with_capacity(rows),
            tool_pose: DPose3::IDENTITY,
            moved: [0.0; 6],
            scratch: Scratch::new(rows),
        }
    }

    pub(super) fn assemble(
        &mut self,
        compliance: &impl ComplianceBlocks,
        contacts: &[Contact],
        coupling: Option<CouplingCompliance<'_>>,
        reference: DVec3,
    ) {
        self.frames.clear();
        self.frames
            .extend(contacts.iter().map(|contact| frame(contact.normal)));
        self.tool_rows.clear();
        let of_rows = contacts.iter().zip(&self.frames);
        self.tool_rows.extend(
            of_rows.map(|(contact, frame)| frame.map(|d| contact.tool_row_along(d, reference))),
        );
        let n = 3 * contacts.len();
        let w = &mut self.w_matrix[..n * n];
        let assembled = delassus_frames_into(compliance, contacts, &self.frames, coupling, w);
        debug_assert!(assembled.is_ok(), "the matrix has the size of the rows");
        self.moved = [0.0; 6];
    }

    pub(super) fn begin_tick(&mut self, positions: &[DVec3], tool_pose: &DPose3) {
        self.positions.clear();
        self.positions.extend_from_slice(positions);
        self.tool_pose = *tool_pose;
    }

    pub(super) fn move_gaps(&mut self, q_frozen: &[f64], moved: &[f64; 6], forces: &ByContact) {
        self.take_off(forces);
        let in_tick = std::array::from_fn(|i| moved[i] - self.moved[i]);
        self.moved = *moved;
        let of_rows = q_frozen.iter().zip(&self.tool_rows);
        for (q, (q_frozen, [h, h_1, h_2])) in self.q.chunks_exact_mut(3).zip(of_rows) {
            q[0] = q_frozen - dot(h, moved);
            q[1] -= dot(h_1, &in_tick);
            q[2] -= dot(h_2, &in_tick);
        }
    }

    pub(super) fn measure_gaps(&mut self, measured: &Measured<'_>, forces: &ByContact) {
        for (frame, contact) in self.frames.iter_mut().zip(measured.contacts) {
            // Its tangents go along as the normal turns.
            *frame = frame_along(contact.normal, frame[1]);
        }
        self.take_off(forces);
        let carried = measured.tool_pose * self.tool_pose.inverse();
        let of_rows = measured.contacts.iter().zip(measured.positions);
        let of_rows = of_rows.zip(self.positions.iter().zip(&self.frames));
        for (q, ((contact, now), (then, [_, t1, t2]))) in self.q.chunks_exact_mut(3).zip(of_rows) {
            let slip = *now - carried * *then;
            q[0] += contact.gap;
            q[1] += t1.dot(slip);
            q[2] += t2.dot(slip);
        }
    }

    /// Forces along the frames, and q = -W λ.
    fn take_off(&mut self, forces: &ByContact) {
        let n = 3 * self.frames.len();
        let of_rows = self.frames.iter().zip(&forces.on_part);
        for (force, (frame, on_part)) in self.force.chunks_exact_mut(3).zip(of_rows) {
            force.copy_from_slice(&frame.map(|d| d.dot(*on_part)));
        }
        self.q[..n].fill(0.0);
        let columns = self.w_matrix.chunks_exact(n.max(1)).zip(&self.force[..n]);
        for (column, force) in columns.filter(|(_, force)| **force != 0.0) {
            for (q, w) in self.q.iter_mut().zip(column) {
                *q -= w * force;
            }
        }
    }

    pub(super) fn solve(
        &mut self,
        forces: &mut ByContact,
        report: &mut StepReport,
        deadline: Option<Instant>,
    ) {
        let m = self.frames.len();
        let n = 3 * m;
        (report.dissipated, report.sticking) = (0.0, 0);
        if self.q[..n].chunks_exact(3).all(|q| q[0] >= 0.0) {
            forces.clear(m);
            return;
        }
        let (force, motion) = (&mut self.force[..n], &mut self.motion[..n]);
        let is_warm = force.iter().any(|force| *force != 0.0);
        let (w, q) = (&self.w_matrix[..n * n], &self.q[..n]);
        let problem = Problem::trusted_symmetric(w, q, &self.coefficients[..m]);
        let settings = Settings {
            deadline,
            ..Settings::default()
        };
        solve_cones(
            problem,
            &settings,
            &mut self.scratch,
            is_warm,
            force,
            motion,
            report,
        );
        let states = self.scratch.states();
        let of_rows = force.chunks_exact(3).zip(motion.chunks_exact(3));
        for (row, ((force, motion), frame)) in of_rows.zip(&self.frames).enumerate() {
            let along = force[0] * frame[0] + force[1] * frame[1] + force[2] * frame[2];
            let sticks = states.get(row) == Some(&State::Stick);
            forces.normal[row] = force[0];
            forces.on_part[row] = along;
            forces.sticks[row] = sticks;
            report.dissipated -= force[1] * motion[1] + force[2] * motion[2];
            report.sticking += u32::from(sticks && force[0] > 0.0);
        }
    }
}

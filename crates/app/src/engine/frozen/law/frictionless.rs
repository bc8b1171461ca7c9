//! Signorini's conditions alone, with the factor kept from solve to solve.

use contact::delassus::{ComplianceBlocks, CouplingCompliance, delassus_into};
use contact::{Contact, lcp};
use glam::DVec3;

use super::super::super::StepReport;
use super::super::super::law::ByContact;
use super::{Measured, dot};

#[derive(Debug)]
pub(in super::super) struct Frictionless {
    /// By row.
    w_matrix: Vec<f64>,
    q: Vec<f64>,
    gaps: Vec<f64>,
    /// h by row, of the frozen planes.
    tool_rows: Vec<[f64; 6]>,
    /// Rows that the first solve starts from; those after it start from the factor it leaves.
    pub(in super::super) warm: Vec<bool>,
    is_new: bool,
    lcp: lcp::Scratch,
    settings: lcp::Settings,
}

impl Frictionless {
    pub(super) fn new(rows: usize, settings: lcp::Settings) -> Self {
        Self {
            w_matrix: vec![0.0; rows * rows],
            q: vec![0.0; rows],
            gaps: vec![0.0; rows],
            tool_rows: Vec::with_capacity(rows),
            warm: Vec::with_capacity(rows),
            is_new: true,
            lcp: lcp::Scratch::new(rows),
            settings,
        }
    }

    pub(super) fn assemble(
        &mut self,
        compliance: &impl ComplianceBlocks,
        contacts: &[Contact],
        coupling: Option<CouplingCompliance<'_>>,
        reference: DVec3,
    ) {
        let m = contacts.len();
        self.tool_rows.clear();
        self.tool_rows
            .extend(contacts.iter().map(|contact| contact.tool_row(reference)));
        let assembled = delassus_into(compliance, contacts, coupling, &mut self.w_matrix[..m * m]);
        debug_assert!(assembled.is_ok(), "the matrix has the size of the rows");
        self.is_new = true;
    }

    pub(super) fn move_gaps(&mut self, q_frozen: &[f64], moved: &[f64; 6]) {
        let of_rows = q_frozen.iter().zip(&self.tool_rows);
        for (q, (q_frozen, h)) in self.q.iter_mut().zip(of_rows) {
            *q = q_frozen - dot(h, moved);
        }
    }

    pub(super) fn measure_gaps(&mut self, measured: &Measured<'_>, forces: &ByContact) {
        let m = measured.contacts.len();
        for (q, contact) in self.q.iter_mut().zip(measured.contacts) {
            *q = contact.gap;
        }
        let columns = self.w_matrix.chunks_exact(m.max(1));
        for (column, force) in columns.zip(&forces.normal[..m]) {
            if *force != 0.0 {
                for (q, w) in self.q.iter_mut().zip(column) {
                    *q -= w * force;
                }
            }
        }
    }

    pub(super) fn solve(
        &mut self,
        contacts: &[Contact],
        forces: &mut ByContact,
        report: &mut StepReport,
    ) {
        let m = contacts.len();
        let (q, normal) = (&self.q[..m], &mut forces.normal[..m]);
        if q.iter().all(|q| *q >= 0.0) {
            normal.fill(0.0);
        } else {
            let start = match std::mem::take(&mut self.is_new) {
                true => lcp::Start::Rows(&self.warm),
                false => lcp::Start::Kept,
            };
            let solution =
                lcp::Problem::trusted_symmetric(&self.w_matrix[..m * m], q).and_then(|problem| {
                    let gaps = &mut self.gaps[..m];
                    lcp::solve(&problem, &self.settings, &mut self.lcp, start, normal, gaps)
                });
            match solution {
                Ok(solution) => {
                    report.pivots = (solution.rounds + solution.pivots) as u32;
                    report.certificate = solution.certificate.natural_residual;
                    report.lcp_solved = solution.status == lcp::Status::Solved;
                }
                // Only data that are not finite: no force, and the report says so.
                Err(_) => {
                    normal.fill(0.0);
                    (report.certificate, report.lcp_solved) = (f64::INFINITY, false);
                }
            }
        }
        let on_part = forces.on_part.iter_mut().zip(contacts);
        for ((on_part, contact), force) in on_part.zip(&forces.normal) {
            *on_part = *force * contact.normal;
        }
    }
}

//! Signorini's conditions alone: a linear complementarity problem.

use contact::lcp;

use super::super::StepReport;
use super::super::rows::Rows;
use super::{ByContact, Carried};

/// Of each row's own compliance, what is added to it where no forces could hold a wedged tool: it then sinks in by this
/// share of what it would give way alone.
const GIVE: f64 = 1e-3;

/// `w = q + W z, w >= 0, z >= 0, wᵀz = 0`, with its memory.
#[derive(Debug)]
pub(in super::super) struct Frictionless {
    /// Normal ones by row, then by contact.
    pub(super) forces: ByContact,
    w: Vec<f64>,
    warm: Vec<bool>,
    scratch: lcp::Scratch,
}

impl Frictionless {
    /// As [`Rows::new`].
    pub(super) fn new(max_near: usize, max_rows: usize) -> Self {
        Self {
            forces: ByContact::new(max_near),
            w: vec![0.0; max_rows],
            warm: vec![false; max_rows],
            scratch: lcp::Scratch::new(max_rows),
        }
    }

    /// Finds the forces, warm-started from the contacts that carried some.
    pub(super) fn solve(
        &mut self,
        rows: &mut Rows,
        carried: &Carried<'_>,
        report: &mut StepReport,
    ) {
        let Carried {
            places,
            forces,
            settings,
        } = *carried;
        let m = rows.m;
        let list = places.list();
        let carries =
            |contact: &contact::Contact| forces.is_carried(list[contact.place as usize].key);
        match rows.share.patches() {
            None => {
                for (warm, contact) in self.warm.iter_mut().zip(&rows.contacts) {
                    *warm = carries(contact);
                }
            }
            Some(patches) => {
                for (patch, warm) in self.warm.iter_mut().take(m).enumerate() {
                    *warm = rows.contacts[patches.range(patch)].iter().any(carries);
                }
            }
        }
        let mut solution = self.solve_rows(rows, settings);
        if let Ok(first) = &solution
            && matches!(
                first.status,
                lcp::Status::NoSolution | lcp::Status::Indefinite
            )
        {
            // Wedged between what does not give way, or W spoilt by rounding: felt as nearly rigid, where no force at all
            // would be an answer.
            report.pivots += (first.rounds + first.pivots) as u32;
            for i in 0..m {
                rows.w_matrix[i * m + i] *= 1.0 + GIVE;
            }
            solution = self
                .solve_rows(rows, settings)
                .map(|solution| lcp::Solution {
                    status: lcp::Status::NoSolution,
                    ..solution
                });
        }
        match solution {
            Ok(solution) => {
                report.pivots += (solution.rounds + solution.pivots) as u32;
                report.certificate = solution.certificate.natural_residual;
                report.lcp_solved = solution.status == lcp::Status::Solved;
            }
            // Only data that are not finite: no force, and the report says so.
            Err(_) => {
                self.forces.normal[..m].fill(0.0);
                report.certificate = f64::INFINITY;
                report.lcp_solved = false;
            }
        }
        if let Some(patches) = rows.share.patches() {
            patches.spread(&mut self.forces.normal);
        }
        let ByContact {
            normal, on_part, ..
        } = &mut self.forces;
        for ((on_part, contact), z) in on_part.iter_mut().zip(&rows.contacts).zip(normal) {
            *on_part = *z * contact.normal;
        }
    }

    fn solve_rows(
        &mut self,
        rows: &Rows,
        settings: &lcp::Settings,
    ) -> Result<lcp::Solution, contact::Error> {
        let m = rows.m;
        let problem = lcp::Problem::trusted_symmetric(&rows.w_matrix[..m * m], &rows.q[..m])?;
        lcp::solve(
            &problem,
            settings,
            &mut self.scratch,
            lcp::Start::Rows(&self.warm[..m]),
            &mut self.forces.normal[..m],
            &mut self.w[..m],
        )
    }
}

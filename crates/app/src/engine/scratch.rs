//! All memory of a step, sized once.

use contact::lcp;
use contact::plane::Plane;
use glam::DVec3;

use super::{ActiveContact, StepReport};

#[derive(Debug)]
pub(super) struct Scratch {
    /// Planes of this pass; its capacity is the largest number of rows.
    pub(super) planes: Vec<Plane>,
    /// Displacement of the planes' nodes before the pass, m.
    pub(super) u_before: Vec<DVec3>,
    pub(super) w_matrix: Vec<f64>,
    pub(super) q: Vec<f64>,
    pub(super) z: Vec<f64>,
    w: Vec<f64>,
    warm: Vec<bool>,
    /// By candidate: carried force after the last pass.
    pub(super) was_active: Vec<bool>,
    /// Contacts that carry force: the state between passes and steps.
    pub(super) active: Vec<ActiveContact>,
    lcp: lcp::Scratch,
}

impl Scratch {
    pub(super) fn new(n_candidates: usize, max_contacts: usize) -> Self {
        let planes = Vec::with_capacity(max_contacts);
        // Planes are made up to their capacity, which may be more than was asked for.
        let rows = planes.capacity();
        Self {
            u_before: Vec::with_capacity(rows),
            w_matrix: vec![0.0; rows * rows],
            q: vec![0.0; rows],
            z: vec![0.0; rows],
            w: vec![0.0; rows],
            warm: vec![false; rows],
            was_active: vec![false; n_candidates],
            active: Vec::with_capacity(rows),
            lcp: lcp::Scratch::new(rows),
            planes,
        }
    }

    pub(super) fn clear_contacts(&mut self) {
        self.active.clear();
        self.was_active.fill(false);
    }

    /// Solves `w = q + W z` for the `m` planes, warm-started from the nodes that carried force.
    pub(super) fn solve(&mut self, m: usize, settings: &lcp::Settings, report: &mut StepReport) {
        for (warm, plane) in self.warm.iter_mut().zip(&self.planes) {
            *warm = self.was_active[plane.candidate as usize];
        }
        let z = &mut self.z[..m];
        let solution =
            lcp::Problem::symmetric(&self.w_matrix[..m * m], &self.q[..m]).and_then(|problem| {
                lcp::solve(
                    &problem,
                    settings,
                    &mut self.lcp,
                    Some(&self.warm[..m]),
                    z,
                    &mut self.w[..m],
                )
            });
        match solution {
            Ok(solution) => {
                report.pivots += (solution.rounds + solution.pivots) as u32;
                report.certificate = solution.certificate.natural_residual;
                report.lcp_solved = solution.status == lcp::Status::Solved;
            }
            // Only data that are not finite: no force, and the report says so.
            Err(_) => {
                z.fill(0.0);
                report.certificate = f64::INFINITY;
                report.lcp_solved = false;
            }
        }
    }

    /// Makes the LCP's answer the contact state. Nodes without a plane carry no force.
    pub(super) fn adopt_forces(&mut self, m: usize) {
        for contact in &self.active {
            self.was_active[contact.candidate as usize] = false;
        }
        self.active.clear();
        for (plane, &z) in self.planes[..m].iter().zip(&self.z) {
            if z > 0.0 {
                self.was_active[plane.candidate as usize] = true;
                self.active.push(ActiveContact {
                    candidate: plane.candidate,
                    normal_force: z,
                    force_on_part: z * plane.normal,
                });
            }
        }
    }
}

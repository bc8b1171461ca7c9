//! The law of contact: rows to forces. Frictionless, or Coulomb's; a scene that calls for no friction has nothing of it.

mod coulomb;
mod frictionless;
mod weakening;

use contact::friction::Coefficients;
use contact::lcp;
use glam::DVec3;
use glamx::DPose3;

use super::StepReport;
use super::forces::Forces;
use super::places::Places;
use super::rows::{Bodies, Rows};
pub(super) use coulomb::{Coulomb, solve_cones};
pub(super) use frictionless::Frictionless;

/// Forces of the contacts, N.
#[derive(Debug)]
pub(super) struct ByContact {
    /// Along the normals, >= 0.
    pub(super) normal: Vec<f64>,
    /// On the part, part's frame.
    pub(super) on_part: Vec<DVec3>,
    /// Whether each sticks; with friction only.
    pub(super) sticks: Vec<bool>,
}

impl ByContact {
    pub(super) fn new(max_near: usize) -> Self {
        Self {
            normal: vec![0.0; max_near],
            on_part: vec![DVec3::ZERO; max_near],
            sticks: vec![false; max_near],
        }
    }

    pub(super) fn clear(&mut self, n_contacts: usize) {
        self.normal[..n_contacts].fill(0.0);
        self.on_part[..n_contacts].fill(DVec3::ZERO);
    }
}

/// What turns gaps into forces.
#[derive(Debug)]
pub(super) enum Law {
    Frictionless(Box<Frictionless>),
    Coulomb(Box<Coulomb>),
}

/// What rows are assembled from.
pub(super) struct Given<'a> {
    pub(super) places: &'a Places,
    pub(super) forces: &'a Forces,
    pub(super) bodies: &'a Bodies<'a>,
    pub(super) tool_pose: &'a DPose3,
}

/// What a solution starts from.
pub(super) struct Carried<'a> {
    pub(super) places: &'a Places,
    pub(super) forces: &'a Forces,
    pub(super) settings: &'a lcp::Settings,
}

impl Law {
    /// As [`Rows::new`]. `friction`: where there is friction.
    pub(super) fn new(
        friction: Option<Coefficients>,
        n_candidates: usize,
        n_keys: usize,
        max_near: usize,
        max_rows: usize,
    ) -> Self {
        match friction {
            None => Self::Frictionless(Box::new(Frictionless::new(max_near, max_rows))),
            Some(coefficients) => {
                let law = Coulomb::new(coefficients, n_candidates, n_keys, max_near, max_rows);
                Self::Coulomb(Box::new(law))
            }
        }
    }

    pub(super) fn coulomb_mut(&mut self) -> Option<&mut Coulomb> {
        match self {
            Self::Frictionless(_) => None,
            Self::Coulomb(coulomb) => Some(coulomb),
        }
    }

    /// By contact.
    pub(super) fn forces(&self) -> &ByContact {
        match self {
            Self::Frictionless(law) => &law.forces,
            Self::Coulomb(law) => &law.forces,
        }
    }

    /// No contact carries force: the exact answer where all gaps are open.
    pub(super) fn rest(&mut self, n_contacts: usize, report: &mut StepReport) {
        match self {
            Self::Frictionless(law) => law.forces.clear(n_contacts),
            Self::Coulomb(law) => law.rest(n_contacts, report),
        }
        (report.certificate, report.lcp_solved) = (0.0, true);
    }

    /// What gives way, by rows: W, and where there is friction the slips without force.
    pub(super) fn assemble(&mut self, rows: &mut Rows, given: &Given<'_>) {
        match self {
            Self::Frictionless(_) => rows.assemble(given.places, given.forces, given.bodies),
            Self::Coulomb(law) => law.assemble(rows, given),
        }
    }

    /// Finds the forces, warm-started from the contacts that carried some.
    pub(super) fn solve(
        &mut self,
        rows: &mut Rows,
        carried: &Carried<'_>,
        report: &mut StepReport,
    ) {
        match self {
            Self::Frictionless(law) => law.solve(rows, carried, report),
            Self::Coulomb(law) => law.solve(rows, carried.places, report),
        }
    }
}

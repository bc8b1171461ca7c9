//! The law of the step that a problem is from, with the operator that is kept.

mod coulomb;
mod frictionless;

use std::time::Instant;

use contact::Contact;
use contact::delassus::{ComplianceBlocks, CouplingCompliance};
use glam::DVec3;
use glamx::DPose3;

use super::super::law::ByContact;
use super::super::{Engine, StepReport, law};
pub(super) use coulomb::Coulomb;
pub(super) use frictionless::Frictionless;

/// What turns gaps into forces.
#[derive(Debug)]
pub(super) enum Law {
    Frictionless(Box<Frictionless>),
    Coulomb(Box<Coulomb>),
}

/// Rows where the last answer has part and tool.
pub(super) struct Measured<'a> {
    pub(super) contacts: &'a [Contact],
    /// m, by row.
    pub(super) positions: &'a [DVec3],
    pub(super) tool_pose: &'a DPose3,
}

impl Law {
    /// Memory for the law of an engine.
    pub(super) fn of(engine: &Engine) -> Self {
        let rows = engine.rows.max_rows();
        match engine.law {
            law::Law::Frictionless(_) => {
                let settings = engine.settings.lcp.clone();
                Self::Frictionless(Box::new(Frictionless::new(rows, settings)))
            }
            law::Law::Coulomb(_) => Self::Coulomb(Box::new(Coulomb::new(rows))),
        }
    }

    /// The operator of these contacts, by the numbers that `compliance` knows their places under.
    pub(super) fn assemble(
        &mut self,
        compliance: &impl ComplianceBlocks,
        contacts: &[Contact],
        coupling: Option<CouplingCompliance<'_>>,
        reference: DVec3,
    ) {
        match self {
            Self::Frictionless(law) => law.assemble(compliance, contacts, coupling, reference),
            Self::Coulomb(law) => law.assemble(compliance, contacts, coupling, reference),
        }
    }

    /// What slips in the tick that begins counts from where the last answer has part and tool.
    pub(super) fn begin_tick(&mut self, positions: &[DVec3], tool_pose: &DPose3) {
        if let Self::Coulomb(law) = self {
            law.begin_tick(positions, tool_pose);
        }
    }

    /// Gaps without force for planes that move with the target. `q_frozen` (m, by row): at the step's own target; `moved`
    /// (m, rad): the target since.
    pub(super) fn move_gaps(&mut self, q_frozen: &[f64], moved: &[f64; 6], forces: &ByContact) {
        match self {
            Self::Frictionless(law) => law.move_gaps(q_frozen, moved),
            Self::Coulomb(law) => law.move_gaps(q_frozen, moved, forces),
        }
    }

    /// Gaps without force from those that are measured under the forces of the last answer.
    pub(super) fn measure_gaps(&mut self, measured: &Measured<'_>, forces: &ByContact) {
        match self {
            Self::Frictionless(law) => law.measure_gaps(measured, forces),
            Self::Coulomb(law) => law.measure_gaps(measured, forces),
        }
    }

    /// Forces by row.
    pub(super) fn solve(
        &mut self,
        contacts: &[Contact],
        forces: &mut ByContact,
        report: &mut StepReport,
        deadline: Option<Instant>,
    ) {
        match self {
            Self::Frictionless(law) => law.solve(contacts, forces, report),
            Self::Coulomb(law) => law.solve(forces, report, deadline),
        }
    }
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

//! From places to rows of the contact problem: which of them count in this pass, and which share a row.

use contact::Contact;
use contact::delassus::delassus_into;
use glam::DVec3;

use super::forces::Forces;
use super::held::Held;
use super::late::Late;
use super::places::Places;
use super::share::Share;
use super::{ContactPart, StepReport, rigid};

/// Part and tool as they are in a pass.
pub(super) struct Bodies<'a> {
    pub(super) part: &'a ContactPart,
    pub(super) held: &'a Held,
    /// m, point of the tool's rows.
    pub(super) reference: DVec3,
    /// Of the tool from its target: m, and rotation vector, rad.
    pub(super) deviation: &'a [f64; 6],
}

impl Bodies<'_> {
    /// m, how far the tool comes towards a contact along a unit direction by its deviation.
    pub(super) fn along(&self, contact: &Contact, direction: DVec3) -> f64 {
        let row = contact.tool_row_along(direction, self.reference);
        row.iter().zip(self.deviation).map(|(h, e)| h * e).sum()
    }
}

/// Contacts of the pass and what their rows are made of.
#[derive(Debug)]
pub(super) struct Rows {
    /// In the order of the rows; where some share a row, in that of their patches.
    pub(super) contacts: Vec<Contact>,
    /// Rows that contacts share where there are more of them.
    pub(super) share: Share,
    max_rows: usize,
    /// W, column-major, m/N.
    pub(super) w_matrix: Vec<f64>,
    /// By row: gap without contact force, m.
    pub(super) q: Vec<f64>,
    /// Rows of this pass.
    pub(super) m: usize,
}

impl Rows {
    /// `max_near`: contacts at most; `max_rows`: rows of the contact problem at most.
    pub(super) fn new(n_keys: usize, max_near: usize, max_rows: usize) -> Self {
        Self {
            contacts: Vec::with_capacity(max_near),
            share: Share::new(n_keys, max_near),
            max_rows,
            w_matrix: vec![0.0; max_rows * max_rows],
            q: vec![0.0; max_near],
            m: 0,
        }
    }

    /// Rows of the contact problem that there is memory for.
    pub(super) fn max_rows(&self) -> usize {
        self.max_rows
    }

    /// Takes the contacts of the pass from the places. `length` (m): what a turn of a normal by one radian is compared
    /// with where contacts share rows.
    pub(super) fn gather(
        &mut self,
        places: &Places,
        forces: &Forces,
        bodies: &Bodies<'_>,
        late: Option<&Late>,
        length: f64,
        report: &mut StepReport,
    ) {
        self.contacts.clear();
        self.contacts.extend_from_slice(places.drawn());
        let list = places.list();
        if let Some(late) = late {
            late.open(list, &mut self.contacts);
        }
        report.rigid_depth = 0.0;
        if bodies.held.is_imposed() {
            report.rigid_depth = rigid::leave_out(&mut self.contacts, list, bodies);
        }
        self.m = self.share.gather(
            &mut self.contacts,
            list,
            self.max_rows,
            forces,
            bodies.part.clusters(),
            length,
        );
        (report.near, report.rows) = (self.contacts.len() as u32, self.m as u32);
    }

    /// Writes q, the gaps that remain at zero contact force; whether they are all open.
    pub(super) fn open_gaps(&mut self, places: &Places, bodies: &Bodies<'_>) -> bool {
        let u = places.displacements();
        for (q, contact) in self.q.iter_mut().zip(&self.contacts) {
            let by_part = contact.normal.dot(u[contact.place as usize]);
            *q = contact.gap - by_part + bodies.along(contact, contact.normal);
        }
        let n = self.contacts.len();
        let is_open = self.q[..n].iter().all(|q| *q >= 0.0);
        if self.share.patches().is_some() {
            self.share.reduce(n, &mut self.q);
        }
        is_open
    }

    /// Writes W: compliance of part and coupling seen along the contacts' normals.
    pub(super) fn assemble(&mut self, places: &Places, forces: &Forces, bodies: &Bodies<'_>) {
        let compliance = places.compliance(&forces.pairs, bodies.part);
        let coupling = bodies.held.compliance_about(bodies.reference);
        let (m, contacts) = (self.m, &self.contacts);
        let w = &mut self.w_matrix[..m * m];
        let assembled = match self.share.patches_mut() {
            None => delassus_into(&compliance, contacts, coupling, w),
            Some(patches) => patches.delassus_into(&compliance, contacts, coupling, w),
        };
        debug_assert!(assembled.is_ok(), "the matrix has the size of the rows");
    }

    /// What rows that contacts share have cost, and better shares for the next time. `normal_forces`: by contact, N;
    /// `is_open`: no gap was closed without force.
    pub(super) fn weigh(
        &mut self,
        places: &Places,
        normal_forces: &[f64],
        bodies: &Bodies<'_>,
        is_open: bool,
        report: &mut StepReport,
    ) {
        (report.merge_error, report.merged_penetration) = (0.0, 0.0);
        if self.share.patches().is_none() {
            return;
        }
        let u = places.displacements();
        let motion_of = |contact: &Contact| {
            (
                u[contact.place as usize],
                bodies.along(contact, contact.normal),
            )
        };
        let key_of = |contact: &Contact| places.list()[contact.place as usize].key;
        let contacts = &self.contacts;
        let loss = self
            .share
            .learn(contacts, normal_forces, is_open, motion_of, key_of);
        (report.merge_error, report.merged_penetration) = (loss.force_rel, loss.penetration);
    }
}

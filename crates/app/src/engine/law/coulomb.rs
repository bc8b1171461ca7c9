//! Signorini's conditions with Coulomb's law of friction: quasi-static increments, one for each step.
//!
//! ```text
//! s_i = T_iᵀ (x_i + u_i - M (x_i + u⁰_i))      M = X X⁰⁻¹
//! |t_i| <= μ z_i,    s_i = 0 inside the cone,    t_i = -μ z_i s_i / |s_i| on it
//! ```
//! s: slip of the part's material point over the tool in the tangent plane at the end of the step; u⁰ and X⁰:
//! displacement and pose of the tool at its start; M carries what was there along with the tool. The whole step counts,
//! over all its strides and passes, also where a contact closed on the way. Nothing else is remembered, no stick flag and no
//! anchor, but the way slipped where static friction differs from kinetic ([`Weakening`]). Forces and the tool's virtual
//! coupling are in one problem, as without friction. Sources: Moreau 1988 and Jean 1999 for the implicit increment, de Saxcé
//! and Feng 1998 for the cone.

mod others;

use contact::Contact;
use contact::delassus::{Frame, delassus_frames_into, frame, frame_along};
use contact::friction::{Coefficients, Problem, Scratch, Settings, State, Status, solve};
use glam::DVec3;
use glamx::DPose3;

use super::super::StepReport;
use super::super::forces::{Forces, State as OfForces};
use super::super::places::Places;
use super::super::rows::Rows;
use super::weakening::Weakening;
use super::{ByContact, Given};

/// Part and tool when the step began.
#[derive(Debug)]
pub(in super::super) struct Start {
    forces: OfForces,
    tool_pose: DPose3,
}

/// The law with its memory.
#[derive(Debug)]
pub(in super::super) struct Coulomb {
    pub(super) forces: ByContact,
    start: Start,
    /// By contact.
    frames: Vec<Frame>,
    /// By contact: along the tangents without force, m.
    slips: Vec<[f64; 2]>,
    /// By row of three.
    w_matrix: Vec<f64>,
    q: Vec<f64>,
    force: Vec<f64>,
    motion: Vec<f64>,
    /// By row.
    coefficients: Vec<f64>,
    /// That of sliding.
    kinetic: f64,
    /// Where static friction differs from it.
    weakening: Option<Weakening>,
    /// By key: force on the part in the last pass, N, where it is among `carrying`.
    kept: Vec<DVec3>,
    carrying: Vec<u32>,
    scratch: Scratch,
}

impl Coulomb {
    /// As [`Rows::new`].
    pub(super) fn new(
        coefficients: Coefficients,
        n_candidates: usize,
        n_keys: usize,
        max_near: usize,
        max_rows: usize,
    ) -> Self {
        let n = 3 * max_rows;
        Self {
            forces: ByContact::new(max_near),
            start: Start {
                forces: OfForces::new(n_candidates),
                tool_pose: DPose3::IDENTITY,
            },
            frames: Vec::with_capacity(max_near),
            slips: Vec::with_capacity(max_near),
            w_matrix: vec![0.0; n * n],
            q: vec![0.0; n],
            force: vec![0.0; n],
            motion: vec![0.0; n],
            coefficients: vec![coefficients.kinetic_coefficient; max_rows],
            kinetic: coefficients.kinetic_coefficient,
            weakening: (!coefficients.is_constant())
                .then(|| Weakening::new(coefficients, n_keys, max_near)),
            kept: vec![DVec3::ZERO; n_keys],
            carrying: Vec::with_capacity(max_near),
            scratch: Scratch::new(max_rows),
        }
    }

    /// That are reserved.
    pub(in super::super) fn bytes(&self) -> usize {
        let numbers = self.w_matrix.len() + 4 * self.q.len() + 3 * self.kept.len();
        8 * (numbers + self.scratch.n_numbers())
    }

    /// Slip counts from here.
    pub(in super::super) fn begin_step(&mut self, forces: &Forces, tool_pose: DPose3) {
        self.start.forces.copy_from(forces);
        self.start.tool_pose = tool_pose;
        self.end_step();
    }

    /// What slipped in the step that is over counts from here on; asked twice it does nothing.
    pub(in super::super) fn end_step(&mut self) {
        if let Some(weakening) = &mut self.weakening {
            weakening.end_step();
        }
    }

    /// Forgets what passes started from.
    pub(in super::super) fn clear(&mut self) {
        for key in self.carrying.drain(..) {
            self.kept[key as usize] = DVec3::ZERO;
        }
        if let Some(weakening) = &mut self.weakening {
            weakening.begin_pass();
        }
    }

    /// On the part in the last pass, N.
    pub(in super::super) fn last_force(&self, key: u32) -> DVec3 {
        self.kept[key as usize]
    }

    /// Of a contact now.
    pub(in super::super) fn coefficient(&self, key: u32) -> f64 {
        let weakening = self.weakening.as_ref();
        weakening.map_or(self.kinetic, |weakening| weakening.coefficient(key))
    }

    pub(super) fn rest(&mut self, n_contacts: usize, report: &mut StepReport) {
        self.clear();
        self.forces.clear(n_contacts);
        (report.dissipated, report.sticking) = (0.0, 0);
    }

    /// W and q along normals and tangents.
    pub(super) fn assemble(&mut self, rows: &mut Rows, given: &Given<'_>) {
        self.orient(rows);
        self.measure_slips(rows, given);
        let compliance = given
            .places
            .compliance(&given.forces.pairs, given.bodies.part);
        let coupling = given.bodies.held.compliance_about(given.bodies.reference);
        let n = 3 * rows.m;
        let w = &mut self.w_matrix[..n * n];
        let (contacts, frames) = (&rows.contacts, &self.frames);
        let assembled = match rows.share.patches_mut() {
            None => delassus_frames_into(&compliance, contacts, frames, coupling, w),
            Some(patches) => {
                patches.delassus_frames_into(&compliance, contacts, frames, coupling, w)
            }
        };
        debug_assert!(assembled.is_ok(), "the matrix has the size of the rows");
        self.write_q(rows);
        self.write_coefficients(rows, given.places);
    }

    /// Tangents of each contact; like ones where contacts share a row.
    fn orient(&mut self, rows: &Rows) {
        self.frames.clear();
        let Some(patches) = rows.share.patches() else {
            self.frames
                .extend(rows.contacts.iter().map(|contact| frame(contact.normal)));
            return;
        };
        for patch in 0..patches.len() {
            let members = &rows.contacts[patches.range(patch)];
            let first = members
                .first()
                .map_or(DVec3::X, |contact| frame(contact.normal)[1]);
            self.frames.extend(
                members
                    .iter()
                    .map(|contact| frame_along(contact.normal, first)),
            );
        }
    }

    /// By contact: how far it slips without force, with the tool as far from its target as without force.
    fn measure_slips(&mut self, rows: &Rows, given: &Given<'_>) {
        let Self {
            start,
            slips,
            frames,
            ..
        } = self;
        let bodies = given.bodies;
        let carried = given.tool_pose * start.tool_pose.inverse();
        slips.clear();
        for (contact, frame) in rows.contacts.iter().zip(frames) {
            let place = &given.places.list()[contact.place as usize];
            let then = place.displacement(|node| {
                start
                    .forces
                    .displacement(bodies.part, &given.forces.pairs, node)
            });
            let without_force = place.rest - carried * (place.rest + then);
            slips.push([1, 2].map(|axis: usize| {
                frame[axis].dot(without_force) + bodies.along(contact, frame[axis])
            }));
        }
    }

    fn write_q(&mut self, rows: &Rows) {
        for (row, q) in self.q.chunks_exact_mut(3).take(rows.m).enumerate() {
            let slip = match rows.share.patches() {
                None => self.slips[row],
                Some(patches) => patches.range(row).fold([0.0; 2], |sum, i| {
                    let (_, share) = patches.share_of(i);
                    [0, 1].map(|axis: usize| sum[axis] + share * self.slips[i][axis])
                }),
            };
            q.copy_from_slice(&[rows.q[row], slip[0], slip[1]]);
        }
    }

    /// Of the way slipped until the step began; contacts that share a row by their shares of it.
    fn write_coefficients(&mut self, rows: &Rows, places: &Places) {
        let Some(weakening) = &self.weakening else {
            return;
        };
        let of =
            |contact: &Contact| weakening.coefficient(places.list()[contact.place as usize].key);
        for (row, coefficient) in self.coefficients.iter_mut().take(rows.m).enumerate() {
            *coefficient = match rows.share.patches() {
                None => of(&rows.contacts[row]),
                Some(patches) => {
                    let shares = patches.range(row).map(|i| {
                        let (_, share) = patches.share_of(i);
                        (share * of(&rows.contacts[i]), share)
                    });
                    let (sum, all) = shares.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
                    sum / all
                }
            };
        }
    }

    /// Forces of all contacts, from those of the last pass or step.
    pub(super) fn solve(&mut self, rows: &Rows, places: &Places, report: &mut StepReport) {
        let m = rows.m;
        let is_warm = self.start_from_kept(rows, places);
        let n = 3 * m;
        let Self {
            w_matrix,
            q,
            force,
            motion,
            coefficients,
            scratch,
            ..
        } = self;
        let (q, force) = (&q[..n], &mut force[..n]);
        let problem = Problem::trusted_symmetric(&w_matrix[..n * n], q, &coefficients[..m]);
        let motion = &mut motion[..n];
        let settings = Settings::default();
        solve_cones(problem, &settings, scratch, is_warm, force, motion, report);
        self.spread(rows, places, report);
    }

    /// Writes what the rows carried in the last pass, by key. Whether there is any.
    fn start_from_kept(&mut self, rows: &Rows, places: &Places) -> bool {
        let Self {
            force,
            frames,
            kept,
            carrying,
            ..
        } = self;
        force[..3 * rows.m].fill(0.0);
        for (i, (contact, frame)) in rows.contacts.iter().zip(frames).enumerate() {
            let row = rows.share.patches().map_or(i, |p| p.share_of(i).0);
            let before = kept[places.list()[contact.place as usize].key as usize];
            for (axis, direction) in frame.iter().enumerate() {
                force[3 * row + axis] += direction.dot(before);
            }
        }
        !carrying.is_empty()
    }

    /// Forces of the rows to forces of the contacts, and what they say.
    fn spread(&mut self, rows: &Rows, places: &Places, report: &mut StepReport) {
        self.clear();
        let states = self.scratch.states();
        (report.dissipated, report.sticking) = (0.0, 0);
        let of_rows = self.force.chunks_exact(3).zip(self.motion.chunks_exact(3));
        for (force, motion) in of_rows.take(rows.m) {
            report.dissipated -= force[1] * motion[1] + force[2] * motion[2];
        }
        for (i, (contact, frame)) in rows.contacts.iter().zip(&self.frames).enumerate() {
            let (row, share) = rows.share.patches().map_or((i, 1.0), |p| p.share_of(i));
            let force = &self.force[3 * row..3 * row + 3];
            let along = [0, 1, 2].map(|axis: usize| share * force[axis]);
            let on_part = along[0] * frame[0] + along[1] * frame[1] + along[2] * frame[2];
            self.forces.normal[i] = along[0];
            self.forces.on_part[i] = on_part;
            let sticks = states.get(row) == Some(&State::Stick);
            self.forces.sticks[i] = sticks;
            if along[0] > 0.0 {
                let key = places.list()[contact.place as usize].key;
                self.kept[key as usize] = on_part;
                self.carrying.push(key);
                if let Some(weakening) = &mut self.weakening {
                    let motion = &self.motion[3 * row..3 * row + 3];
                    let slip = if sticks {
                        None
                    } else {
                        Some(motion[1].hypot(motion[2]))
                    };
                    weakening.end_pass(key, along[0], slip);
                }
                report.sticking += u32::from(sticks);
            }
        }
    }
}

/// Forces and motions of rows of three, and what the report says of them.
pub(in super::super) fn solve_cones(
    problem: Result<Problem<'_>, contact::Error>,
    settings: &Settings,
    scratch: &mut Scratch,
    is_warm: bool,
    force: &mut [f64],
    motion: &mut [f64],
    report: &mut StepReport,
) {
    let solution =
        problem.and_then(|problem| solve(&problem, settings, scratch, is_warm, force, motion));
    match solution {
        Ok(solution) => {
            report.pivots += (solution.sweeps + solution.newton_steps) as u32;
            report.certificate = solution.certificate.natural_residual;
            report.lcp_solved = solution.status == Status::Solved;
        }
        // Only data that are not finite: no force, and the report says so.
        Err(_) => {
            force.fill(0.0);
            motion.fill(0.0);
            (report.certificate, report.lcp_solved) = (f64::INFINITY, false);
        }
    }
}

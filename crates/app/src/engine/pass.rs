//! One pass of a step: near nodes, planes, Delassus operator, contact problem, update.

use contact::delassus::{ComplianceBlocks, CouplingCompliance, delassus_into};
use contact::patch::Patches;
use contact::plane::{Plane, planes_and_rest_into, planes_into, wrench_on_tool};
use glam::DVec3;
use glamx::DPose3;

use super::clock::StageClock;
use super::edges::{Body, Positions};
use super::part::Deformed;
use super::scratch::Scratch;
use super::{Engine, Stage, StepReport, rigid, state_of};

impl Engine {
    /// One round of proximity, planes, Delassus, LCP and update.
    /// Returns the largest change of a near node's displacement or of the tool's pose, m.
    pub(super) fn pass(
        &mut self,
        tool_pose: &mut DPose3,
        target: &DPose3,
        report: &mut StepReport,
    ) -> f64 {
        let mut clock = StageClock::start();
        let reference = self.held.reference(target, &self.deviation);
        self.reference = reference;
        let part = self.part.as_ref();
        let tool = &self.tool;
        let pose = *tool_pose;
        let near_distance = self.settings.near_distance;

        // Which candidates can be near.
        let state = state_of(part, tool, tool_pose, &self.scratch);
        self.watch.advance(state);
        self.watch.look(state);
        let candidates = self.watch.take_due();
        clock.lap(Stage::Proximity, report);

        // One plane per near node, at its displaced position (paper, Fig. 3).
        let Scratch {
            planes,
            active,
            known,
            pairs,
            ..
        } = &mut self.scratch;
        let deformed = Deformed {
            part,
            active,
            pairs,
        };
        let position_of = |candidate: u32| {
            let i = candidate as usize;
            let displacement = known.get(i).unwrap_or_else(|| deformed.displacement(i));
            part.rest_positions()[i] + displacement
        };
        let watch = &mut self.watch;
        let left_out = planes_and_rest_into(
            tool,
            &pose,
            &candidates,
            position_of,
            near_distance,
            planes,
            |candidate, distance, at| watch.postpone(part.clusters(), candidate, distance, at),
        );
        watch.give_back(candidates);
        report.dropped = (left_out.n_beyond_capacity + left_out.n_invalid) as u32;
        self.scratch.find_missing();
        let Scratch {
            active,
            known,
            missing,
            extra,
            pairs,
            ..
        } = &mut self.scratch;
        if !missing.is_empty() {
            let deformed = Deformed {
                part,
                active,
                pairs,
            };
            let position_of = |candidate: u32| {
                let i = candidate as usize;
                let displacement = known.get(i).unwrap_or_else(|| deformed.displacement(i));
                part.rest_positions()[i] + displacement
            };
            planes_into(tool, &pose, missing, position_of, f64::INFINITY, extra);
        }
        self.scratch.keep_seen();
        if let Some(late) = &mut self.late {
            report.without_column = late.sort_out(&mut self.scratch.planes, part) as u32;
        }
        report.rigid_depth = 0.0;
        let held = self.held;
        if held.is_imposed() {
            let planes = &mut self.scratch.planes;
            report.rigid_depth = rigid::leave_out_planes(planes, part, &held, reference);
        }
        let n_rows = self.scratch.gather(part.clusters(), self.reach_of_rotation);
        // One row for each point of the tool's edges at a face.
        if let Some(edges) = &mut self.edges {
            let room = self.scratch.max_rows() - self.scratch.planes.len();
            let Scratch {
                planes,
                active,
                known,
                pairs,
                ..
            } = &mut self.scratch;
            let deformed = Deformed {
                part,
                active,
                pairs,
            };
            let mut positions = Positions { deformed, known };
            let sums = self.watch.sums();
            let body = Body {
                pose,
                held: &held,
                reference,
            };
            report.dropped += edges.find(&mut positions, &body, sums, planes, room) as u32;
            report.rigid_depth = report.rigid_depth.max(edges.rigid_depth());
        }
        let Scratch {
            planes,
            u_before,
            prune,
            w_matrix,
            q,
            pairs,
            ..
        } = &mut self.scratch;
        // With points of the tool's edges nodes share no rows: there is one for each plane.
        let n_of_edges = self.edges.as_ref().map_or(0, |edges| edges.rows().len());
        let m = n_rows + n_of_edges;
        (report.near, report.rows) = ((planes.len() + n_of_edges) as u32, m as u32);
        u_before.clear();
        u_before.extend(
            planes
                .iter()
                .map(|p| p.point - part.rest_positions()[p.candidate as usize]),
        );
        clock.lap(Stage::Planes, report);

        // q: the gap that remains at zero contact force.
        for ((q, plane), u) in q.iter_mut().zip(planes.iter()).zip(u_before.iter()) {
            let along: f64 = plane
                .tool_row(reference)
                .iter()
                .zip(&self.deviation)
                .map(|(h, e)| h * e)
                .sum();
            *q = plane.gap - plane.normal.dot(*u) + along;
        }
        let are_open = |q: &[f64]| q.iter().all(|q| *q >= 0.0);
        let nodes_are_open = are_open(&q[..planes.len()]);
        if prune.patches().is_some() {
            prune.reduce(planes.len(), q);
        }
        if let Some(edges) = &self.edges {
            edges.gaps_into(reference, &self.deviation, &mut q[n_rows..]);
        }
        // W: compliance of part and coupling seen along the contact normals. Not needed where all
        // gaps are open without force: then z = 0 is the exact answer.
        let is_open = nodes_are_open && are_open(&q[n_rows..m]);
        if !is_open {
            let coupling = held.compliance_about(reference);
            let w = &mut w_matrix[..m * m];
            let patches = prune.patches_mut();
            let candidates = planes.iter().map(|plane| plane.candidate);
            let assembled = match &mut self.edges {
                Some(edges) => edges.delassus_into(pairs, part, planes, coupling, w),
                None if pairs.ensure(candidates.clone(), part) => {
                    assemble(&*pairs, planes, patches, coupling, w)
                }
                None => assemble(part, planes, patches, coupling, w),
            };
            debug_assert!(assembled.is_ok(), "the matrix has the size of the planes");
        }
        clock.lap(Stage::Delassus, report);

        if is_open {
            self.scratch.z[..m].fill(0.0);
            (report.certificate, report.lcp_solved) = (0.0, true);
        } else {
            let edges = self.edges.as_deref();
            self.scratch.solve(m, edges, &self.settings.lcp, report);
        }
        clock.lap(Stage::Lcp, report);

        // Forces of the near nodes become the state; the tool goes where its coupling balances.
        self.scratch.adopt_forces();
        let Scratch { planes, z, .. } = &self.scratch;
        let (mut force, mut torque) = wrench_on_tool(planes, z, reference);
        if let Some(edges) = &mut self.edges {
            let Scratch {
                z,
                active,
                was_active,
                ..
            } = &mut self.scratch;
            let z = &z[n_rows..m];
            edges.adopt_forces(z, active, was_active);
            let on_tool = edges.wrench_on_tool(z, reference);
            (force, torque) = (force + on_tool.0, torque + on_tool.1);
        }
        report.contact_wrench_on_tool = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        self.deviation = held.deviation_under(&report.contact_wrench_on_tool);
        let moved = held.pose(target, &self.deviation);
        let mut change = (moved.translation - tool_pose.translation).length()
            + self.reach_of_rotation * moved.rotation.angle_between(tool_pose.rotation);
        *tool_pose = moved;
        let Scratch {
            planes,
            u_before,
            active,
            known,
            pairs,
            ..
        } = &mut self.scratch;
        let deformed = Deformed {
            part,
            active,
            pairs,
        };
        known.forget();
        for (plane, before) in planes.iter().zip(u_before.iter()) {
            let u = deformed.displacement(plane.candidate as usize);
            known.set(plane.candidate as usize, u);
            change = change.max((u - *before).length());
        }
        if let Some(edges) = &self.edges {
            let mut positions = Positions { deformed, known };
            change = change.max(edges.largest_change(&mut positions));
        }
        (report.merge_error, report.merged_penetration) = (0.0, 0.0);
        report.merged_badly = false;
        if self.scratch.prune.patches().is_some() {
            self.weigh_patches(reference, is_open, report);
        }
        clock.lap(Stage::Update, report);
        change
    }

    /// What the rows that nodes share have cost, and better shares for the next time.
    fn weigh_patches(&mut self, reference: DVec3, is_open: bool, report: &mut StepReport) {
        let Scratch {
            planes,
            prune,
            active,
            known,
            pairs,
            z,
            ..
        } = &mut self.scratch;
        let deformed = Deformed {
            part: self.part.as_ref(),
            active,
            pairs,
        };
        let motion_of = |plane: &Plane| {
            let i = plane.candidate as usize;
            let displacement = known.get(i).unwrap_or_else(|| deformed.displacement(i));
            let row = plane.tool_row(reference);
            let along = row.iter().zip(&self.deviation).map(|(h, e)| h * e).sum();
            (displacement, along)
        };
        let loss = prune.learn(planes, z, is_open, motion_of);
        report.merged_penetration = loss.penetration;
        report.merge_error = loss.force_rel;
        report.merged_badly = loss.force_rel > self.settings.merge_tolerance;
    }
}

/// W of the planes, or of the patches they are gathered in.
fn assemble(
    compliance: &impl ComplianceBlocks,
    planes: &[Plane],
    patches: Option<&mut Patches>,
    coupling: Option<CouplingCompliance>,
    w: &mut [f64],
) -> Result<(), contact::Error> {
    match patches {
        None => delassus_into(compliance, planes, coupling, w),
        Some(patches) => patches.delassus_into(compliance, planes, coupling, w),
    }
}

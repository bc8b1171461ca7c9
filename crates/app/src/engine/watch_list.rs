//! Candidates that are worth evaluating, kept over many steps.
//!
//! A list made at one state of tool and forces holds every candidate whose displaced distance to
//! the tool was below `reach + slack`. It misses none that is nearer than `reach` as long as
//!
//! ```text
//! |motion of the tool's surface near the part| + Σ_j max_i ‖C_ij‖ |f_j - f_j,then| <= slack
//! ```
//! because a signed distance changes by no more than the point and the surface move. Both terms
//! are bounds, not estimates; the second costs one norm per contact.

use contact::proximity::NodeTree;
use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use super::{ActiveContact, ContactPart};

#[derive(Debug)]
pub(super) struct WatchList {
    tree: NodeTree,
    /// Candidate indices, ascending.
    watched: Vec<u32>,
    near: Vec<u32>,
    pose: Option<DPose3>,
    /// By candidate: force when the list was made, N.
    force_then: Vec<DVec3>,
    active_then: Vec<u32>,
    slack: f64,
    centre: DVec3,
    radius: f64,
}

impl WatchList {
    /// `slack` (m): how far tool and part may move before the list is made anew.
    ///
    /// # Errors
    /// Rest positions that are not finite.
    pub(super) fn new(part: &ContactPart, slack: f64) -> Result<Self, contact::Error> {
        let n = part.n_candidates();
        let centre = part.rest_positions().iter().sum::<DVec3>() / n.max(1) as f64;
        let radius = part
            .rest_positions()
            .iter()
            .map(|x| (*x - centre).length())
            .fold(0.0, f64::max);
        Ok(Self {
            tree: NodeTree::new(part.rest_positions())?,
            watched: Vec::with_capacity(n),
            near: Vec::with_capacity(n),
            pose: None,
            force_then: vec![DVec3::ZERO; n],
            active_then: Vec::with_capacity(n),
            slack,
            centre,
            radius,
        })
    }

    /// Makes the next [`Self::update`] look anew.
    pub(super) fn forget(&mut self) {
        self.pose = None;
    }

    /// The candidates that may be nearer than `reach` (m) to the tool. `is_active` tells whether a
    /// candidate carries force now. Does not allocate.
    pub(super) fn update(
        &mut self,
        part: &ContactPart,
        tool: &Tool,
        tool_pose: &DPose3,
        active: &[ActiveContact],
        is_active: &[bool],
        reach: f64,
    ) -> &[u32] {
        let moved = self.pose.map_or(f64::INFINITY, |then| {
            self.motion_bound(&then, tool_pose, part, active)
                + self.change_bound(part, active, is_active)
        });
        if moved > self.slack {
            self.make(part, tool, tool_pose, active, reach + self.slack);
        }
        &self.watched
    }

    /// Bound on how far any point of the tool that is near the part has moved, m.
    fn motion_bound(
        &self,
        then: &DPose3,
        now: &DPose3,
        part: &ContactPart,
        active: &[ActiveContact],
    ) -> f64 {
        let shift = (now.translation - then.translation).length();
        let turn = now.rotation.angle_between(then.rotation);
        if turn == 0.0 {
            return shift;
        }
        let lever = (now.translation - self.centre).length()
            + self.radius
            + part.displacement_bound(active)
            + self.slack;
        shift + turn * lever
    }

    /// Bound on the change of any candidate's displacement since the list was made, m.
    fn change_bound(
        &self,
        part: &ContactPart,
        active: &[ActiveContact],
        is_active: &[bool],
    ) -> f64 {
        let changed: f64 = active
            .iter()
            .map(|c| {
                let then = self.force_then[c.candidate as usize];
                part.largest_block(c.candidate) * (c.force_on_part - then).length()
            })
            .sum();
        let gone: f64 = self
            .active_then
            .iter()
            .filter(|c| !is_active[**c as usize])
            .map(|c| part.largest_block(*c) * self.force_then[*c as usize].length())
            .sum();
        changed + gone
    }

    fn make(
        &mut self,
        part: &ContactPart,
        tool: &Tool,
        tool_pose: &DPose3,
        active: &[ActiveContact],
        reach: f64,
    ) {
        self.tree.near_into(
            tool,
            tool_pose,
            reach + part.displacement_bound(active),
            &mut self.near,
        );
        self.watched.clear();
        for &candidate in &self.near {
            let i = candidate as usize;
            let position = part.rest_positions()[i] + part.displacement(i, active);
            // A position that is not finite stays on the list, to be counted where planes are made.
            let is_far = tool.signed_distance(tool_pose, position).signed_distance > reach;
            if !is_far {
                self.watched.push(candidate);
            }
        }
        for candidate in self.active_then.drain(..) {
            self.force_then[candidate as usize] = DVec3::ZERO;
        }
        for contact in active {
            self.force_then[contact.candidate as usize] = contact.force_on_part;
            self.active_then.push(contact.candidate);
        }
        self.pose = Some(*tool_pose);
    }
}

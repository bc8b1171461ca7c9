//! Candidates that are worth evaluating, kept over many passes and steps.
//!
//! A list made at one state of tool and forces holds every candidate whose displaced distance to
//! the tool was below `reach + slack`. It misses none that is nearer than `reach` as long as
//!
//! ```text
//! |motion of the tool's surface near the part| + Σ_j max_i ‖C_ij‖ |f_j - f_j,then| <= slack
//! ```
//! because a signed distance changes by no more than the point and the surface move. Both terms
//! are bounds, not estimates; the second costs one norm per contact. Two lists are nested: a wide
//! one, made from the tree of all candidates every few tens of steps, and a narrow one, made from
//! the wide one every few steps; only the narrow one is evaluated in each pass.

use contact::proximity::NodeTree;
use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use super::ContactPart;
use super::part::Deformed;

/// Slack of the narrow list over that of the wide one.
const NARROW_SHARE: f64 = 0.1;

#[derive(Debug)]
pub(super) struct WatchList {
    tree: NodeTree,
    found: Vec<u32>,
    wide: List,
    narrow: List,
}

/// What a list is judged by: the state of now.
#[derive(Clone, Copy)]
pub(super) struct State<'a> {
    pub(super) deformed: Deformed<'a>,
    pub(super) tool: &'a Tool,
    pub(super) tool_pose: &'a DPose3,
    /// By candidate: carries force.
    pub(super) is_active: &'a [bool],
}

impl WatchList {
    /// `slack` (m): how far tool and part may move before the wide list is made anew.
    ///
    /// # Errors
    /// Rest positions that are not finite.
    pub(super) fn new(part: &ContactPart, slack: f64) -> Result<Self, contact::Error> {
        Ok(Self {
            tree: NodeTree::new(part.rest_positions())?,
            found: Vec::with_capacity(part.n_candidates()),
            wide: List::new(part, slack),
            narrow: List::new(part, NARROW_SHARE * slack),
        })
    }

    /// Candidates of the last [`Self::update`].
    pub(super) fn watched(&self) -> &[u32] {
        &self.narrow.watched
    }

    /// Makes the next [`Self::update`] look anew.
    pub(super) fn forget(&mut self) {
        self.wide.pose = None;
        self.narrow.pose = None;
    }

    /// Whether the next [`Self::update`] will ask for the displacement of candidates that are far.
    pub(super) fn is_stale(&self, state: State<'_>) -> bool {
        self.narrow.is_stale(state)
    }

    /// The candidates that may be nearer than `reach` (m) to the tool. Does not allocate.
    pub(super) fn update(&mut self, state: State<'_>, reach: f64) -> &[u32] {
        if self.narrow.is_stale(state) {
            // The narrow list is made from the wide one, which must reach as far as it looks.
            let narrow_reach = reach + self.narrow.slack;
            if self.wide.is_stale(state) {
                let wide_reach = narrow_reach + self.wide.slack;
                let inflate = wide_reach + state.deformed.displacement_bound();
                self.tree
                    .near_into(state.tool, state.tool_pose, inflate, &mut self.found);
                self.wide.make(state, &self.found, wide_reach);
            }
            self.narrow.make(state, &self.wide.watched, narrow_reach);
        }
        &self.narrow.watched
    }
}

#[derive(Debug)]
struct List {
    /// Candidate indices, ascending.
    watched: Vec<u32>,
    pose: Option<DPose3>,
    /// By candidate: force when the list was made, N.
    force_then: Vec<DVec3>,
    active_then: Vec<u32>,
    switched_then: f64,
    slack: f64,
    centre: DVec3,
    radius: f64,
}

impl List {
    fn new(part: &ContactPart, slack: f64) -> Self {
        let rest = part.rest_positions();
        let centre = rest.iter().sum::<DVec3>() / rest.len().max(1) as f64;
        Self {
            watched: Vec::with_capacity(rest.len()),
            pose: None,
            force_then: vec![DVec3::ZERO; rest.len()],
            active_then: Vec::with_capacity(rest.len()),
            switched_then: 0.0,
            slack,
            centre,
            radius: rest
                .iter()
                .map(|x| (*x - centre).length())
                .fold(0.0, f64::max),
        }
    }

    /// Whether tool and part may have moved by more than the slack.
    fn is_stale(&self, state: State<'_>) -> bool {
        let Some(then) = self.pose else { return true };
        let moved = self.motion_bound(&then, state) + self.change_bound(state);
        // A state that is not finite is looked at anew.
        moved.is_nan() || moved > self.slack
    }

    /// Bound on how far any point of the tool that is near the part has moved, m.
    fn motion_bound(&self, then: &DPose3, state: State<'_>) -> f64 {
        let now = state.tool_pose;
        let shift = (now.translation - then.translation).length();
        let turn = now.rotation.angle_between(then.rotation);
        if turn == 0.0 {
            return shift;
        }
        let lever = (now.translation - self.centre).length()
            + self.radius
            + state.deformed.displacement_bound()
            + self.slack;
        shift + turn * lever
    }

    /// Bound on the change of any candidate's displacement since the list was made, m.
    fn change_bound(&self, state: State<'_>) -> f64 {
        let Deformed { part, active, .. } = state.deformed;
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
            .filter(|c| !state.is_active[**c as usize])
            .map(|c| part.largest_block(*c) * self.force_then[*c as usize].length())
            .sum();
        // The compliance itself changes by no more than all of it while free nodes are switched.
        let switched = (state.deformed.switched() - self.switched_then).min(1.0);
        let by_switch: f64 = if switched > 0.0 {
            let then = self.active_then.iter();
            then.map(|c| part.largest_block(*c) * self.force_then[*c as usize].length())
                .sum::<f64>()
                * switched
        } else {
            0.0
        };
        changed + gone + by_switch
    }

    /// Keeps those of `from` that are nearer than `reach` now.
    fn make(&mut self, state: State<'_>, from: &[u32], reach: f64) {
        self.watched.clear();
        for &candidate in from {
            let i = candidate as usize;
            let position = state.deformed.part.rest_positions()[i] + state.deformed.displacement(i);
            // A position that is not finite stays on the list, to be counted where planes are made.
            let distance = state.tool.signed_distance(state.tool_pose, position);
            let is_far = distance.signed_distance > reach;
            if !is_far {
                self.watched.push(candidate);
            }
        }
        for candidate in self.active_then.drain(..) {
            self.force_then[candidate as usize] = DVec3::ZERO;
        }
        for contact in state.deformed.active {
            self.force_then[contact.candidate as usize] = contact.force_on_part;
            self.active_then.push(contact.candidate);
        }
        self.pose = Some(*state.tool_pose);
        self.switched_then = state.deformed.switched();
    }
}

#[cfg(test)]
mod tests {
    use contact::tool::Sphere;

    use super::super::ActiveContact;
    use super::*;

    /// Nodes on a grid, each on its own spring of 1000 N/m; a sphere and forces wander at random.
    #[test]
    fn no_near_candidate_is_ever_missed() {
        let side = 12usize;
        let rest: Vec<DVec3> = (0..side * side)
            .map(|k| 1e-3 * DVec3::new((k % side) as f64, (k / side) as f64, 0.0))
            .collect();
        let n = rest.len();
        let mut blocks = vec![0.0; 9 * n * n];
        for j in 0..n {
            for c in 0..3 {
                blocks[9 * (j * n + j) + 4 * c] = 1e-3;
            }
        }
        let part = ContactPart::new(rest, n, blocks);
        let tool = Tool::Sphere(Sphere::new(3e-3).unwrap());
        let (reach, slack) = (2e-4, 2e-3);
        let mut list = WatchList::new(&part, slack).unwrap();
        let mut seed = 0x1234_5678_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let mut pose = DPose3::from_translation(DVec3::new(5e-3, 5e-3, 2.5e-3));
        let mut near_seen = 0;
        for _ in 0..3000 {
            pose.translation += 4e-4 * DVec3::new(random(), random(), 0.2 * random());
            pose.translation = pose
                .translation
                .clamp(DVec3::new(0.0, 0.0, 1e-3), DVec3::splat(11e-3));
            let mut is_active = vec![false; n];
            let mut active = Vec::new();
            for candidate in 0..n as u32 {
                if random() > 0.45 {
                    is_active[candidate as usize] = true;
                    let force_on_part = DVec3::new(0.1 * random(), 0.1 * random(), random());
                    let normal_force = force_on_part.length();
                    active.push(ActiveContact {
                        candidate,
                        normal_force,
                        force_on_part,
                    });
                }
            }
            let state = State {
                deformed: Deformed {
                    part: &part,
                    active: &active,
                    constrained: None,
                },
                tool: &tool,
                tool_pose: &pose,
                is_active: &is_active,
            };
            let watched = list.update(state, reach).to_vec();
            for candidate in 0..n {
                let position =
                    part.rest_positions()[candidate] + part.displacement(candidate, &active);
                if tool.signed_distance(&pose, position).signed_distance < reach {
                    near_seen += 1;
                    assert!(
                        watched.contains(&(candidate as u32)),
                        "{candidate} at {position}"
                    );
                }
            }
        }
        assert!(near_seen > 1000, "the walk met {near_seen} near nodes only");
    }
}

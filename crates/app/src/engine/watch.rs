//! Candidates that are worth evaluating now; each of the others has an appointment.
//!
//! The engine adds up how far tool and part have moved at most since the start,
//!
//! ```text
//! S += |motion of the tool's surface near the part| + Σ_j max_i≠j ‖C_ij‖ |f_j - f_j,then|
//! ```
//! both of them bounds, not estimates. Any node but those whose own force changes, which are always looked
//! at, found at a distance d > reach cannot be nearer than `reach` before S has grown by d - reach, because a
//! signed distance changes by no more than point and surface move: that is when it is looked at again. Those that
//! are far wait in a heap; those that may come near within some steps are kept in a list of their own. The cost of
//! a step then goes with the candidates near the tool, not with their number, and no step looks at many at once,
//! but the first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use super::ContactPart;
use super::part::Deformed;

/// Share of a mesh tool's size from which on its box stands in for it: a mesh answers slowly.
const FAR_SHARE: f64 = 0.25;

#[derive(Debug)]
pub(super) struct Watch {
    /// How far tool and part have moved at most since the start, m, and what rounding left of it.
    moved: f64,
    moved_rest: f64,
    /// Candidates that are far, by when they may come within [`Self::watch_distance`]; the bits of a positive number
    /// are in its order.
    far: BinaryHeap<Reverse<(u64, u32)>>,
    /// By candidate: its appointment, the key in the heap.
    far_until: Vec<u64>,
    watched: Vec<u32>,
    is_watched: Vec<bool>,
    /// By candidate that is watched: nearer than reach not before this, m of [`Self::moved`].
    due_at: Vec<f64>,
    due: Vec<u32>,
    /// m, beyond reach: candidates nearer than that are watched.
    slack: f64,
    reach: f64,
    pose_then: Option<DPose3>,
    /// By candidate: force at the last look, N.
    force_then: Vec<DVec3>,
    active_then: Vec<u32>,
    switched_then: f64,
    centre: DVec3,
    radius: f64,
}

/// What a look is judged by: the state of now.
#[derive(Clone, Copy)]
pub(super) struct State<'a> {
    pub(super) deformed: Deformed<'a>,
    pub(super) tool: &'a Tool,
    pub(super) tool_pose: &'a DPose3,
    /// By candidate: carries force.
    pub(super) is_active: &'a [bool],
}

impl Watch {
    /// `reach` (m): candidates nearer than this are wanted. `slack` (m): beyond it, what is watched.
    ///
    /// # Errors
    /// Rest positions that are not finite.
    pub(super) fn new(part: &ContactPart, reach: f64, slack: f64) -> Result<Self, contact::Error> {
        let rest = part.rest_positions();
        if let Some(index) = rest.iter().position(|x| !x.is_finite()) {
            return Err(contact::Error::NotFinite {
                what: "rest position of candidate node",
                index,
            });
        }
        let centre = rest.iter().sum::<DVec3>() / rest.len().max(1) as f64;
        let distances = rest.iter().map(|x| (*x - centre).length());
        Ok(Self {
            moved: 0.0,
            moved_rest: 0.0,
            // Twice as many: appointments may be void.
            far: BinaryHeap::with_capacity(2 * rest.len()),
            far_until: vec![0; rest.len()],
            watched: Vec::with_capacity(rest.len()),
            is_watched: vec![false; rest.len()],
            due_at: vec![0.0; rest.len()],
            due: Vec::with_capacity(rest.len()),
            slack,
            reach,
            pose_then: None,
            force_then: vec![DVec3::ZERO; rest.len()],
            active_then: Vec::with_capacity(rest.len()),
            switched_then: 0.0,
            radius: distances.fold(0.0, f64::max),
            centre,
        })
    }

    /// Candidates that may come near within some steps: those that are near, and more.
    pub(super) fn watched(&self) -> &[u32] {
        &self.watched
    }

    /// Candidates that may be nearer than `distance` (m, at least the reach), by the appointments of the last look.
    pub(super) fn within(&self, distance: f64) -> impl Iterator<Item = u32> {
        let (reach, slack) = (self.reach, self.slack);
        (0..self.is_watched.len()).filter_map(move |i| {
            let at_least = if self.is_watched[i] {
                self.due_at[i] - self.moved + reach
            } else {
                f64::from_bits(self.far_until[i]) - self.moved + reach + slack
            };
            // Also what is not a number.
            let is_beyond = at_least >= distance;
            (!is_beyond).then_some(i as u32)
        })
    }

    /// Makes the next [`Self::look`] begin anew.
    pub(super) fn forget(&mut self) {
        self.pose_then = None;
    }

    /// Whether the next [`Self::look`] will ask for the displacement of candidates that are far.
    pub(super) fn is_far_due(&self, state: State<'_>) -> bool {
        let Some(then) = self.pose_then else {
            return true;
        };
        let moved = self.moved + self.motion_bound(&then, state) + self.change_bound(state);
        let next = self.far.peek();
        next.is_some_and(|Reverse((at, _))| f64::from_bits(*at) <= moved) || moved.is_nan()
    }

    /// Finds the candidates that may be nearer than reach: [`Self::take_due`]. Does not allocate.
    pub(super) fn look(&mut self, state: State<'_>) {
        // First those that were sent away, so that none is called in twice.
        let is_watched = &self.is_watched;
        self.watched.retain(|c| is_watched[*c as usize]);
        match self.pose_then {
            Some(then) => {
                let step = self.motion_bound(&then, state) + self.change_bound(state);
                self.add_motion(step);
            }
            None => self.begin(),
        }
        self.remember(state);
        while let Some(&Reverse((at, candidate))) = self.far.peek() {
            // Also where the motion is not a number any more.
            let is_early = f64::from_bits(at) > self.moved;
            if is_early {
                break;
            }
            self.far.pop();
            if self.is_watched[candidate as usize] || self.far_until[candidate as usize] != at {
                // Void: it was called in the meantime.
                continue;
            }
            let distance = distance_bound(state, candidate as usize);
            self.arrange(candidate, distance);
        }
        let (due_at, moved) = (&self.due_at, self.moved);
        self.due.clear();
        let is_due = |c: &u32| {
            let is_early = due_at[*c as usize] > moved;
            !is_early
        };
        self.due.extend(self.watched.iter().copied().filter(is_due));
    }

    /// What the last look found, to be given back; each is to be answered with [`Self::postpone`] if it is not
    /// nearer than reach after all.
    pub(super) fn take_due(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.due)
    }

    /// The memory of [`Self::take_due`].
    pub(super) fn give_back(&mut self, due: Vec<u32>) {
        self.due = due;
    }

    /// A candidate that was due is at this distance from the tool, m, beyond reach.
    pub(super) fn postpone(&mut self, candidate: u32, distance: f64) {
        let i = candidate as usize;
        if distance > self.reach + 2.0 * self.slack && self.far.len() < self.far.capacity() {
            self.send_away(candidate, distance);
        } else {
            self.due_at[i] = self.moved + (distance - self.reach);
        }
    }

    /// A far candidate found at this distance is watched or waits again.
    fn arrange(&mut self, candidate: u32, distance: f64) {
        let i = candidate as usize;
        // Half a slack more, so that it does not come back at once.
        let is_far = distance > self.reach + 1.5 * self.slack;
        if is_far {
            self.send_away(candidate, distance);
            return;
        }
        self.is_watched[i] = true;
        self.watched.push(candidate);
        // A distance that is not finite is due now, to be counted where planes are made.
        self.due_at[i] = self.moved + (distance - self.reach).max(0.0);
    }

    /// All candidates are to be looked at now.
    fn begin(&mut self) {
        (self.moved, self.moved_rest) = (0.0, 0.0);
        self.watched.clear();
        self.is_watched.fill(false);
        self.far.clear();
        let now = 0.0_f64.to_bits();
        self.far_until.fill(now);
        self.far
            .extend((0..self.is_watched.len() as u32).map(|candidate| Reverse((now, candidate))));
    }

    /// Adds without losing small steps to a large sum (Kahan).
    fn add_motion(&mut self, step: f64) {
        let step = step - self.moved_rest;
        let sum = self.moved + step;
        self.moved_rest = (sum - self.moved) - step;
        self.moved = sum;
    }

    /// Keeps what the next look compares with. Candidates that carry force, or did, are due.
    fn remember(&mut self, state: State<'_>) {
        for k in 0..self.active_then.len() {
            let candidate = self.active_then[k];
            self.force_then[candidate as usize] = DVec3::ZERO;
            self.call(candidate);
        }
        self.active_then.clear();
        for contact in state.deformed.active {
            self.force_then[contact.candidate as usize] = contact.force_on_part;
            self.active_then.push(contact.candidate);
            self.call(contact.candidate);
        }
        self.pose_then = Some(*state.tool_pose);
        self.switched_then = state.deformed.switched();
    }

    /// Makes a candidate due.
    fn call(&mut self, candidate: u32) {
        let i = candidate as usize;
        self.due_at[i] = 0.0;
        if !self.is_watched[i] {
            // Its appointment in the heap is void then.
            self.is_watched[i] = true;
            self.watched.push(candidate);
        }
    }

    /// Sends a candidate away until it may come within the slack.
    fn send_away(&mut self, candidate: u32, distance: f64) {
        let at = (self.moved + (distance - self.reach - self.slack)).to_bits();
        self.far_until[candidate as usize] = at;
        self.is_watched[candidate as usize] = false;
        self.far.push(Reverse((at, candidate)));
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
            + state.deformed.displacement_bound();
        shift + turn * lever
    }

    /// Bound on the change of displacement since the last look, m, of any candidate whose own force has not changed.
    fn change_bound(&self, state: State<'_>) -> f64 {
        let Deformed { part, active, .. } = state.deformed;
        let changed: f64 = active
            .iter()
            .map(|c| {
                let then = self.force_then[c.candidate as usize];
                part.largest_other(c.candidate) * (c.force_on_part - then).length()
            })
            .sum();
        let gone: f64 = self
            .active_then
            .iter()
            .filter(|c| !state.is_active[**c as usize])
            .map(|c| part.largest_other(*c) * self.force_then[*c as usize].length())
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
}

/// The distance of a displaced candidate from the tool, or something less, m.
fn distance_bound(state: State<'_>, candidate: usize) -> f64 {
    let rest = state.deformed.part.rest_positions()[candidate];
    let position = rest + state.deformed.displacement(candidate);
    if let Tool::Mesh(_) | Tool::Field(_) = state.tool
        && let Some((min, max)) = state.tool.aabb(state.tool_pose)
    {
        let outside = (min - position)
            .max(position - max)
            .max(DVec3::ZERO)
            .length();
        if outside > FAR_SHARE * state.tool.characteristic_size() {
            return outside;
        }
    }
    state
        .tool
        .signed_distance(state.tool_pose, position)
        .signed_distance
}

#[cfg(test)]
mod tests {
    use contact::tool::Sphere;

    use super::super::ActiveContact;
    use super::super::pairs::Pairs;
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
        let mut watch = Watch::new(&part, reach, slack).unwrap();
        let mut seed = 0x1234_5678_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let mut pose = DPose3::from_translation(DVec3::new(5e-3, 5e-3, 2.5e-3));
        let (mut near_seen, mut n_looks) = (0, 0);
        let mut forces = vec![DVec3::ZERO; n];
        let pairs = Pairs::new(n, 0);
        for _ in 0..3000 {
            pose.translation += 4e-4 * DVec3::new(random(), random(), 0.2 * random());
            pose.translation = pose
                .translation
                .clamp(DVec3::new(0.0, 0.0, 1e-3), DVec3::splat(11e-3));
            let mut is_active = vec![false; n];
            let mut active = Vec::new();
            for candidate in 0..n as u32 {
                // Few at a time, that come, change and go.
                let force = &mut forces[candidate as usize];
                if random() > 0.49 {
                    *force = if *force == DVec3::ZERO {
                        DVec3::new(0.1 * random(), 0.1 * random(), random())
                    } else {
                        DVec3::ZERO
                    };
                }
                if *force != DVec3::ZERO && candidate % 5 == 0 {
                    *force += 0.001 * DVec3::new(random(), random(), random());
                    is_active[candidate as usize] = true;
                    active.push(ActiveContact {
                        candidate,
                        normal_force: force.length(),
                        force_on_part: *force,
                    });
                }
            }
            let state = State {
                deformed: Deformed {
                    part: &part,
                    active: &active,
                    constrained: None,
                    pairs: &pairs,
                },
                tool: &tool,
                tool_pose: &pose,
                is_active: &is_active,
            };
            watch.look(state);
            let due = watch.take_due();
            n_looks += due.len();
            for candidate in 0..n {
                let position =
                    part.rest_positions()[candidate] + part.displacement(candidate, &active);
                let distance = tool.signed_distance(&pose, position).signed_distance;
                if distance >= reach {
                    if due.contains(&(candidate as u32)) {
                        watch.postpone(candidate as u32, distance);
                    }
                } else {
                    near_seen += 1;
                    assert!(
                        due.contains(&(candidate as u32)),
                        "{candidate} at {position}"
                    );
                }
            }
            watch.give_back(due);
        }
        assert!(near_seen > 1000, "the walk met {near_seen} near nodes only");
        assert!(n_looks < 3000 * n / 2, "{n_looks} looks spare nothing");
    }
}

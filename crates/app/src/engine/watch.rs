//! Candidates that are worth evaluating now; each of the others has an appointment, alone or with its neighbours.
//!
//! For each cluster of neighbouring candidates the engine adds up how far the tool and any node of the cluster have
//! moved at most since the start,
//!
//! ```text
//! S_c += |motion of the tool's surface near the part|
//!      + Σ_b min( L_cb Σ_j |Δf_j| ,  L_cb |Σ_j Δf_j| + K_cb Σ_j |Δf_j| )       j in cluster b
//! ```
//! (norms L, K between clusters: see [`Clusters`]), all of it bounds, not estimates. A force that wanders from node to
//! node thus hardly counts far away. Any node but those whose own force changes, which are always looked at, found at
//! a distance d > reach cannot be nearer than `reach` before S_c has grown by d - reach, because a signed distance
//! changes by no more than point and surface move: that is when it is looked at again.
//!
//! A look goes from cheap to dear. A cluster all of whose nodes are due is judged by its middle node first: where that
//! is displaced to, less the cluster's radius and what the others may move differently. A node that is due is asked
//! for its distance where it was seen last, less what forces may have moved it since. Only what still may be near is
//! handed on to be displaced exactly. The cost of a step then goes with the nodes near the tool; far clusters cost
//! one sum each.

use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use super::ContactPart;
use super::clusters::Clusters;
use super::forces::Loads;
use super::part::Deformed;

/// Share of a mesh tool's size from which on its box stands in for it: a mesh answers slowly.
const FAR_SHARE: f64 = 0.25;

/// Nodes of a cluster that are due together from which on the cluster is judged as a whole first: that costs as much
/// as one exact look, and a distance for each.
const WHOLE: usize = 3;

/// Units in the last place that a sum grows by in each addition beside what is added, so that what rounding loses is
/// made up for.
const ROUNDING: f64 = 2.3e-16;

#[derive(Debug)]
pub(super) struct Watch {
    /// How far the tool has moved at most since the start, m.
    by_tool: f64,
    /// By cluster: how far forces have moved any of its nodes at most since the start, m.
    by_force: Vec<f64>,
    /// Starts of the sums from nothing.
    n_starts: u64,
    /// By cluster: the sum of both at which it is visited again, m. No later than any of its members is due.
    visit_at: Vec<f64>,
    /// By place among the members: nearer than reach not before this sum, m.
    due_at: Vec<f64>,
    /// By place, and of the middle node by cluster: where the node was seen last.
    seen: Vec<Seen>,
    middle_seen: Vec<Seen>,
    /// Clusters to visit in this look.
    visits: Vec<u32>,
    due: Vec<u32>,
    /// m, beyond reach: what may come near within some steps.
    slack: f64,
    reach: f64,
    pose_then: Option<DPose3>,
    /// By candidate: force at the last look, N.
    force_then: Vec<DVec3>,
    active_then: Vec<u32>,
    /// By cluster: what the forces on its members do in this look; zero but for those in `loaded`.
    loads: Vec<Load>,
    loaded: Vec<u32>,
    /// Candidates whose own force changed since the last look, and by how much, N.
    changed: Vec<(u32, f64)>,
    centre: DVec3,
    radius: f64,
}

/// Forces on the nodes of one cluster.
#[derive(Debug, Clone, Copy, Default)]
struct Load {
    /// N, change since the last look, and the sum of the sizes of its parts.
    change: DVec3,
    changes: f64,
    /// N, sum of the sizes of now.
    size: f64,
    is_listed: bool,
}

/// Where a node was, surely.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// m.
    at: DVec3,
    /// m: less [`Watch::by_force`] of now, how far it may be from there.
    sure_at: f64,
}

impl Seen {
    /// Its force has changed: nothing is known.
    const NEVER: Self = Self {
        at: DVec3::ZERO,
        sure_at: f64::NEG_INFINITY,
    };
}

/// How far tool and part have moved at most, each sum since the same start. None grows by less than what moved.
#[derive(Clone, Copy)]
pub(super) struct Sums<'a> {
    /// m, of the tool.
    pub(super) by_tool: f64,
    /// m, by cluster, of any node but those whose own force changed.
    pub(super) by_force: &'a [f64],
    /// Changes when the sums begin anew: what was reckoned with them is void then.
    pub(super) n_starts: u64,
}

/// What a look is judged by: the state of now.
#[derive(Clone, Copy)]
pub(super) struct State<'a> {
    pub(super) deformed: Deformed<'a>,
    pub(super) tool: &'a Tool,
    pub(super) tool_pose: &'a DPose3,
    /// Nodes that carry force.
    pub(super) loads: &'a Loads,
}

impl Watch {
    /// `reach` (m): candidates nearer than this are wanted. `slack` (m): beyond it, what may come near soon.
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
        let n_clusters = part.clusters().len();
        Ok(Self {
            by_tool: 0.0,
            by_force: vec![0.0; n_clusters],
            n_starts: 0,
            visit_at: vec![0.0; n_clusters],
            due_at: vec![0.0; rest.len()],
            seen: vec![Seen::NEVER; rest.len()],
            middle_seen: vec![Seen::NEVER; n_clusters],
            visits: Vec::with_capacity(n_clusters),
            due: Vec::with_capacity(rest.len()),
            slack,
            reach,
            pose_then: None,
            force_then: vec![DVec3::ZERO; rest.len()],
            active_then: Vec::with_capacity(rest.len()),
            loads: vec![Load::default(); n_clusters],
            loaded: Vec::with_capacity(n_clusters),
            changed: Vec::with_capacity(2 * rest.len()),
            radius: distances.fold(0.0, f64::max),
            centre,
        })
    }

    /// Makes the next look begin anew.
    pub(super) fn forget(&mut self) {
        self.pose_then = None;
    }

    /// Adds up the motion since the last look; [`Self::look`] or [`Self::pass_over`] has to follow.
    pub(super) fn advance(&mut self, state: State<'_>) {
        self.sum_loads(state);
        match self.pose_then {
            Some(then) => self.add_motion(&then, state),
            None => self.begin(),
        }
        self.remember(state);
    }

    /// Finds the candidates that may be nearer than reach: [`Self::take_due`]. Does not allocate.
    pub(super) fn look(&mut self, state: State<'_>) {
        self.visits.clear();
        let by_tool = self.by_tool;
        let sums = self.by_force.iter().zip(&self.visit_at).enumerate();
        let is_due = |by_force: f64, at: f64| {
            // Also where a sum is not a number any more.
            let is_early = at > by_tool + by_force;
            !is_early
        };
        self.visits.extend(
            sums.filter(|(_, (by_force, at))| is_due(**by_force, **at))
                .map(|(c, _)| c as u32),
        );
        self.due.clear();
        for k in 0..self.visits.len() {
            self.visit(self.visits[k] as usize, state);
        }
        self.pass_over();
    }

    /// In place of a look: only the sums are wanted.
    pub(super) fn pass_over(&mut self) {
        for &b in &self.loaded {
            self.loads[b as usize] = Load::default();
        }
        self.loaded.clear();
    }

    /// Candidates whose own force changed before the last look, and by how much, N.
    pub(super) fn changed(&self) -> &[(u32, f64)] {
        &self.changed
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

    /// A candidate that was due is at this point, at this distance from the tool, m, beyond reach.
    pub(super) fn postpone(
        &mut self,
        clusters: &Clusters,
        candidate: u32,
        distance: f64,
        at: DVec3,
    ) {
        let (place, c) = (clusters.place_of(candidate), clusters.cluster_of(candidate));
        let sure_at = self.by_force[c];
        self.due_at[place] = self.by_tool + self.by_force[c] + (distance - self.reach);
        self.seen[place] = Seen { at, sure_at };
    }

    /// Candidates that may be nearer than `distance` (m, at least the reach), by the appointments of the last look;
    /// replaces `found`.
    pub(super) fn within(&self, clusters: &Clusters, distance: f64, found: &mut Vec<u32>) {
        found.clear();
        for c in 0..clusters.len() {
            let limit = self.by_tool + self.by_force[c] + (distance - self.reach);
            // Also what is not a number.
            let is_beyond = |at: f64| at >= limit;
            if is_beyond(self.visit_at[c]) {
                continue;
            }
            let members = clusters
                .range(c)
                .filter(|place| !is_beyond(self.due_at[*place]));
            found.extend(members.map(|place| clusters.members()[place]));
        }
    }

    /// How far tool and part have moved at most since the start.
    pub(super) fn sums(&self) -> Sums<'_> {
        Sums {
            by_tool: self.by_tool,
            by_force: &self.by_force,
            n_starts: self.n_starts,
        }
    }

    /// Everything is to be looked at now.
    fn begin(&mut self) {
        self.n_starts += 1;
        self.by_tool = 0.0;
        self.by_force.fill(0.0);
        self.visit_at.fill(0.0);
        self.due_at.fill(0.0);
        self.seen.fill(Seen::NEVER);
        self.middle_seen.fill(Seen::NEVER);
    }

    /// Sums up forces and their changes by cluster.
    fn sum_loads(&mut self, state: State<'_>) {
        let Deformed { part, active, .. } = state.deformed;
        let clusters = part.clusters();
        let (loads, loaded) = (&mut self.loads, &mut self.loaded);
        let changed = &mut self.changed;
        changed.clear();
        let mut add = |candidate: u32, change: DVec3, size: f64| {
            let b = clusters.cluster_of(candidate);
            let load = &mut loads[b];
            if !load.is_listed {
                load.is_listed = true;
                loaded.push(b as u32);
            }
            changed.push((candidate, change.length()));
            load.change += change;
            load.changes += change.length();
            load.size += size;
        };
        for contact in active {
            let change = contact.force_on_part - self.force_then[contact.candidate as usize];
            add(contact.candidate, change, contact.force_on_part.length());
        }
        for &candidate in &self.active_then {
            if !state.loads.is_loaded(candidate) {
                add(candidate, -self.force_then[candidate as usize], 0.0);
            }
        }
    }

    /// Adds the motion of tool and part since the last look.
    fn add_motion(&mut self, then: &DPose3, state: State<'_>) {
        let clusters = state.deformed.part.clusters();
        let by_tool = self.motion_bound(then, state);
        let changes: f64 = self
            .loaded
            .iter()
            .map(|b| self.loads[*b as usize].changes)
            .sum();
        if !(by_tool + changes).is_finite() {
            self.begin();
            return;
        }
        self.by_tool += by_tool + ROUNDING * self.by_tool;
        for &b in &self.loaded {
            let Load {
                change, changes, ..
            } = self.loads[b as usize];
            if changes == 0.0 {
                continue;
            }
            let change = change.length();
            let norms = clusters.largest(b as usize).iter();
            let norms = norms.zip(clusters.columns(b as usize));
            for (sum, (largest, columns)) in self.by_force.iter_mut().zip(norms) {
                let (largest, columns) = (f64::from(*largest), f64::from(*columns));
                let each = largest * changes;
                let all = largest * change + columns * changes;
                let least = if each < all { each } else { all };
                *sum += least + ROUNDING * *sum;
            }
        }
    }

    /// Keeps what the next look compares with. Candidates that carry force, or did, are due.
    fn remember(&mut self, state: State<'_>) {
        let clusters = state.deformed.part.clusters();
        for k in 0..self.active_then.len() {
            let candidate = self.active_then[k];
            self.force_then[candidate as usize] = DVec3::ZERO;
            self.call(clusters, candidate);
        }
        self.active_then.clear();
        for contact in state.deformed.active {
            self.force_then[contact.candidate as usize] = contact.force_on_part;
            self.active_then.push(contact.candidate);
            self.call(clusters, contact.candidate);
        }
        self.pose_then = Some(*state.tool_pose);
    }

    /// Makes a candidate due.
    fn call(&mut self, clusters: &Clusters, candidate: u32) {
        let (place, c) = (clusters.place_of(candidate), clusters.cluster_of(candidate));
        self.due_at[place] = 0.0;
        self.seen[place] = Seen::NEVER;
        self.middle_seen[c] = Seen::NEVER;
        self.visit_at[c] = 0.0;
    }

    /// Whether a cluster is to be judged by its middle node first. Where forces act that would tell nothing.
    fn is_whole(&self, c: usize, due_at: &[f64]) -> bool {
        let sum = self.by_tool + self.by_force[c];
        let n_early = due_at.iter().filter(|at| **at > sum).count();
        !self.loads[c].is_listed && due_at.len() - n_early >= WHOLE.min(due_at.len())
    }

    /// Looks at the members of a cluster that are due.
    fn visit(&mut self, c: usize, state: State<'_>) {
        let clusters = state.deformed.part.clusters();
        let range = clusters.range(c);
        let sum = self.by_tool + self.by_force[c];
        if self.is_whole(c, &self.due_at[range.clone()]) && self.judge(c, state) {
            return;
        }
        // Once more in the next look, if any is handed on.
        let mut next = f64::INFINITY;
        for place in range {
            if self.due_at[place] > sum {
                next = next.min(self.due_at[place]);
                continue;
            }
            let Seen { at, sure_at } = self.seen[place];
            let doubt = self.by_force[c] - sure_at;
            if doubt <= self.slack {
                let beyond = distance_bound(state, at) - doubt - self.reach;
                if beyond > 0.0 {
                    self.due_at[place] = sum + beyond;
                    next = next.min(sum + beyond);
                    continue;
                }
            }
            self.due.push(clusters.members()[place]);
            next = 0.0;
        }
        self.visit_at[c] = next;
    }

    /// Whether all members of a cluster are far, by its middle node; their appointments then, and otherwise where they
    /// surely are.
    fn judge(&mut self, c: usize, state: State<'_>) -> bool {
        let Deformed { part, .. } = state.deformed;
        let (clusters, rest) = (part.clusters(), part.rest_positions());
        let (radius, middle) = (clusters.radius(c), clusters.middle(c) as usize);
        let (sum, by_force) = (self.by_tool + self.by_force[c], self.by_force[c]);
        let mut displacement = None;
        loop {
            let Seen { at, sure_at } = self.middle_seen[c];
            let doubt = by_force - sure_at;
            if doubt.is_finite() {
                let beyond = distance_bound(state, at) - radius - doubt - self.reach;
                if beyond > self.slack {
                    for at in &mut self.due_at[clusters.range(c)] {
                        *at = at.max(sum + beyond);
                    }
                    self.visit_at[c] = sum + beyond;
                    return true;
                }
            }
            if displacement.is_some() {
                break;
            }
            let moved = state.deformed.displacement(middle);
            let load = |b: &u32| self.loads[*b as usize].size;
            let spread = self.loaded.iter().map(|b| {
                let norm = clusters.rows(*b as usize)[c];
                f64::from(norm) * load(b)
            });
            displacement = Some(moved);
            self.middle_seen[c] = Seen {
                at: rest[middle] + moved,
                sure_at: by_force - spread.sum::<f64>(),
            };
        }
        let sure_at = self.middle_seen[c].sure_at;
        for place in clusters.range(c) {
            let seen = &mut self.seen[place];
            if seen.sure_at < sure_at {
                let candidate = clusters.members()[place] as usize;
                let at = rest[candidate] + displacement.unwrap_or_default();
                *seen = Seen { at, sure_at };
            }
        }
        false
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
}

/// Distance of a point from the tool, or something less, m.
fn distance_bound(state: State<'_>, position: DVec3) -> f64 {
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
    let contact = state.tool.signed_distance(state.tool_pose, position);
    contact.signed_distance
}

#[cfg(test)]
mod tests;

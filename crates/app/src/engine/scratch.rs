//! All memory of a step, sized once.

use contact::lcp;
use contact::plane::Plane;
use glam::DVec3;

use super::clusters::Clusters;
use super::edges::Edges;
use super::pairs::Pairs;
use super::prune::Prune;
use super::{ActiveContact, StepReport};

/// Nodes whose compliance blocks are kept side by side: 42 MB of them, touched only as far as they are used.
const MOST_PAIRS: usize = 768;

/// Of each row's own compliance, what is added to it where no forces could hold a wedged tool: it then sinks in by this
/// share of what it would give way alone.
const GIVE: f64 = 1e-3;

#[derive(Debug)]
pub(super) struct Scratch {
    /// Planes of this pass; its capacity is the largest number of near nodes.
    pub(super) planes: Vec<Plane>,
    /// Planes of nodes that had one earlier in the step and are farther away now.
    pub(super) extra: Vec<Plane>,
    /// Candidates that had a plane in this step: each keeps it to the step's end.
    seen: Vec<u32>,
    pub(super) missing: Vec<u32>,
    /// By candidate: number of the pass in which it last had a plane, and of the step.
    pass_of: Vec<u64>,
    stride_of: Vec<u64>,
    pass: u64,
    stride: u64,
    /// Displacement of nodes under the forces of now, as far as it is known.
    pub(super) known: Known,
    /// Compliance between nodes that are or were near.
    pub(super) pairs: Pairs,
    /// Displacement of the planes' nodes before the pass, m.
    pub(super) u_before: Vec<DVec3>,
    /// Rows that near nodes share where there are more of them.
    pub(super) prune: Prune,
    max_rows: usize,
    pub(super) w_matrix: Vec<f64>,
    pub(super) q: Vec<f64>,
    pub(super) z: Vec<f64>,
    w: Vec<f64>,
    warm: Vec<bool>,
    /// By candidate: carried force after the last pass.
    pub(super) was_active: Vec<bool>,
    /// Contacts that carry force: the state between passes and steps.
    pub(super) active: Vec<ActiveContact>,
    /// The first of them carry force of a plane of their own.
    pub(super) n_own: usize,
    lcp: lcp::Scratch,
}

impl Scratch {
    /// `max_near`: planes at most; `max_rows`: rows of the contact problem at most.
    pub(super) fn new(n_candidates: usize, max_near: usize, max_rows: usize) -> Self {
        let planes = Vec::with_capacity(max_near);
        // Planes are made up to their capacity, which may be more than was asked for.
        let near = planes.capacity();
        let max_rows = if max_rows == max_near { near } else { max_rows };
        Self {
            extra: Vec::with_capacity(near),
            seen: Vec::with_capacity(n_candidates),
            missing: Vec::with_capacity(n_candidates),
            pass_of: vec![0; n_candidates],
            stride_of: vec![0; n_candidates],
            pass: 0,
            stride: 0,
            known: Known::new(n_candidates),
            pairs: Pairs::new(n_candidates, n_candidates.min(2 * near).min(MOST_PAIRS)),
            u_before: Vec::with_capacity(near),
            prune: Prune::new(n_candidates, near),
            max_rows,
            w_matrix: vec![0.0; max_rows * max_rows],
            q: vec![0.0; near],
            z: vec![0.0; near],
            w: vec![0.0; max_rows],
            warm: vec![false; max_rows],
            was_active: vec![false; n_candidates],
            active: Vec::with_capacity(near),
            n_own: 0,
            lcp: lcp::Scratch::new(max_rows),
            planes,
        }
    }

    /// Rows of the contact problem that there is memory for.
    pub(super) fn max_rows(&self) -> usize {
        self.max_rows
    }

    /// Rows of the contact problem of these planes, which are put in the order of their patches where they share rows.
    pub(super) fn gather(&mut self, clusters: &Clusters, length: f64) -> usize {
        self.prune.gather(
            &mut self.planes,
            self.max_rows,
            &self.active,
            clusters,
            length,
        )
    }

    pub(super) fn clear_contacts(&mut self) {
        self.known.forget();
        self.active.clear();
        self.n_own = 0;
        self.was_active.fill(false);
        self.prune.clear();
        self.pairs.reset();
    }

    /// Begins a search for equilibrium: only nodes that carry force have had a plane.
    pub(super) fn begin_stride(&mut self) {
        self.stride += 1;
        self.prune.begin_round();
        self.seen.clear();
        for contact in &self.active[..self.n_own] {
            self.stride_of[contact.candidate as usize] = self.stride;
            self.seen.push(contact.candidate);
        }
    }

    /// Finds the nodes that had a plane earlier in this stride and were not near enough for one now.
    pub(super) fn find_missing(&mut self) {
        self.pass += 1;
        for plane in &self.planes {
            self.pass_of[plane.candidate as usize] = self.pass;
        }
        let (pass, pass_of) = (self.pass, &self.pass_of);
        self.missing.clear();
        let seen = self.seen.iter().copied();
        self.missing
            .extend(seen.filter(|c| pass_of[*c as usize] != pass));
        self.extra.clear();
    }

    /// Adds the planes of [`Self::find_missing`], which are in `extra`, whatever their gap. Without them two sets of
    /// nodes can take turns: each lifts off while the other is pressed, loses its plane, and sinks in
    /// again. With them the set only grows, and passes end.
    pub(super) fn keep_seen(&mut self) {
        let room = self.planes.capacity() - self.planes.len();
        self.planes.extend(self.extra.drain(..).take(room));
        for plane in &self.planes {
            let stride_of = &mut self.stride_of[plane.candidate as usize];
            if *stride_of != self.stride {
                *stride_of = self.stride;
                self.seen.push(plane.candidate);
            }
        }
    }

    /// Solves `w = q + W z` for the `m` rows, those of the planes first, warm-started from the nodes, and the points of
    /// `edges`, that carried force.
    pub(super) fn solve(
        &mut self,
        m: usize,
        edges: Option<&Edges>,
        settings: &lcp::Settings,
        report: &mut StepReport,
    ) {
        let was_active = |plane: &Plane| self.was_active[plane.candidate as usize];
        match self.prune.patches() {
            None => {
                for (warm, plane) in self.warm.iter_mut().zip(&self.planes) {
                    *warm = was_active(plane);
                }
            }
            Some(patches) => {
                for (patch, warm) in self.warm.iter_mut().take(m).enumerate() {
                    *warm = self.planes[patches.range(patch)].iter().any(was_active);
                }
            }
        }
        if let Some(edges) = edges {
            let warm = self.warm[self.planes.len()..].iter_mut();
            for (warm, row) in warm.zip(edges.rows()) {
                *warm = edges.is_carried(row);
            }
        }
        let mut solution = self.solve_rows(m, settings);
        if let Ok(first) = &solution
            && matches!(first.status, lcp::Status::NoSolution | lcp::Status::Ray)
        {
            // Wedged between what does not give way: felt as nearly rigid, where no force at all would be an answer.
            let is_counted = first.rounds + first.pivots;
            report.pivots += is_counted as u32;
            for i in 0..m {
                self.w_matrix[i * m + i] *= 1.0 + GIVE;
            }
            solution = self.solve_rows(m, settings).map(|solution| lcp::Solution {
                status: lcp::Status::NoSolution,
                ..solution
            });
        }
        match solution {
            Ok(solution) => {
                report.pivots += (solution.rounds + solution.pivots) as u32;
                report.certificate = solution.certificate.natural_residual;
                report.lcp_solved = solution.status == lcp::Status::Solved;
            }
            // Only data that are not finite: no force, and the report says so.
            Err(_) => {
                self.z[..m].fill(0.0);
                report.certificate = f64::INFINITY;
                report.lcp_solved = false;
            }
        }
    }

    fn solve_rows(
        &mut self,
        m: usize,
        settings: &lcp::Settings,
    ) -> Result<lcp::Solution, contact::Error> {
        let problem = lcp::Problem::trusted_symmetric(&self.w_matrix[..m * m], &self.q[..m])?;
        lcp::solve(
            &problem,
            settings,
            &mut self.lcp,
            lcp::Start::Rows(&self.warm[..m]),
            &mut self.z[..m],
            &mut self.w[..m],
        )
    }

    /// Makes the LCP's answer the contact state. Nodes without a plane carry no force.
    pub(super) fn adopt_forces(&mut self) {
        if let Some(patches) = self.prune.patches() {
            patches.spread(&mut self.z);
        }
        for contact in &self.active {
            self.was_active[contact.candidate as usize] = false;
        }
        self.active.clear();
        for (plane, &z) in self.planes.iter().zip(&self.z) {
            if z > 0.0 {
                self.was_active[plane.candidate as usize] = true;
                self.active.push(ActiveContact {
                    candidate: plane.candidate,
                    normal_force: z,
                    force_on_part: z * plane.normal,
                });
            }
        }
        self.n_own = self.active.len();
    }

    /// Makes room for contacts on all candidates, as faces load many for one row.
    pub(super) fn reserve_contacts(&mut self, n_candidates: usize) {
        self.active.reserve(n_candidates);
    }
}

/// Displacements that need not be summed again until the forces change.
#[derive(Debug)]
pub(super) struct Known {
    /// By candidate, m.
    displacement: Vec<DVec3>,
    /// By candidate: the state its displacement belongs to.
    state_of: Vec<u64>,
    state: u64,
}

impl Known {
    fn new(n_candidates: usize) -> Self {
        Self {
            displacement: vec![DVec3::ZERO; n_candidates],
            state_of: vec![0; n_candidates],
            state: 1,
        }
    }

    /// The forces have changed.
    pub(super) fn forget(&mut self) {
        self.state += 1;
    }

    pub(super) fn set(&mut self, candidate: usize, displacement: DVec3) {
        self.displacement[candidate] = displacement;
        self.state_of[candidate] = self.state;
    }

    #[inline]
    pub(super) fn get(&self, candidate: usize) -> Option<DVec3> {
        (self.state_of[candidate] == self.state).then(|| self.displacement[candidate])
    }
}

//! When edges or faces of the part can come near: not before their nodes and the tool have moved far enough.
//!
//! The sums of motions are kept by cluster of nodes (`watch`). From look to look a site is moved by no more than that of
//! the clusters of its nodes which moves most, and by what the forces on its own nodes do to these; sites of the same
//! clusters wait as a group.

use std::collections::BTreeMap;

use super::ContactPart;
use super::clusters::Clusters;
use super::watch::{Sums, Watch};

/// By group of sites with the same clusters, and by site.
#[derive(Debug, Default)]
pub(super) struct Appointments {
    /// Clusters of each group.
    clusters: Vec<Vec<u32>>,
    /// Sites of each group.
    sites: Vec<Vec<u32>>,
    /// By group: its sum of motions, m, up to the sums that were taken in.
    moved: Vec<f64>,
    /// Those, by cluster, and of the tool.
    taken_in: Vec<f64>,
    taken_in_of_tool: f64,
    /// By group: none of its sites is due before this, m of its sum of motions.
    next: Vec<f64>,
    group_of: Vec<u32>,
    /// By site: not to be reached before this, m of its group's sum of motions.
    due_at: Vec<f64>,
    /// Sites of candidate c: `sites_of[first_of[c]..first_of[c + 1]]`.
    first_of: Vec<u32>,
    sites_of: Vec<u32>,
    /// The sums that this belongs to.
    n_starts: u64,
}

impl Appointments {
    /// `nodes_of`: nodes of each site; those beyond the candidates never move.
    pub(super) fn new<'a>(
        nodes_of: impl Iterator<Item = &'a [u32]> + Clone,
        n_candidates: usize,
        of_nodes: &Clusters,
    ) -> Self {
        let mut groups: BTreeMap<Vec<u32>, Vec<u32>> = BTreeMap::new();
        let mut first_of = vec![0; n_candidates + 1];
        let is_candidate = |node: &&u32| (**node as usize) < n_candidates;
        for (site, nodes) in nodes_of.clone().enumerate() {
            let candidates = nodes.iter().filter(is_candidate);
            let mut clusters: Vec<u32> = candidates
                .clone()
                .map(|node| of_nodes.cluster_of(*node) as u32)
                .collect();
            clusters.sort_unstable();
            clusters.dedup();
            groups.entry(clusters).or_default().push(site as u32);
            for node in candidates {
                first_of[*node as usize + 1] += 1;
            }
        }
        for c in 0..n_candidates {
            first_of[c + 1] += first_of[c];
        }
        let mut next = first_of.clone();
        let mut sites_of = vec![0; first_of[n_candidates] as usize];
        let mut n_sites = 0;
        for (site, nodes) in nodes_of.enumerate() {
            for node in nodes.iter().filter(is_candidate) {
                let at = &mut next[*node as usize];
                sites_of[*at as usize] = site as u32;
                *at += 1;
            }
            n_sites += 1;
        }
        let mut group_of = vec![0; n_sites];
        for (group, sites) in groups.values().enumerate() {
            for site in sites {
                group_of[*site as usize] = group as u32;
            }
        }
        let (clusters, sites): (Vec<_>, Vec<_>) = groups.into_iter().unzip();
        Self {
            moved: vec![0.0; sites.len()],
            taken_in: vec![0.0; of_nodes.len()],
            taken_in_of_tool: 0.0,
            next: vec![0.0; sites.len()],
            due_at: vec![0.0; n_sites],
            n_starts: 0,
            clusters,
            sites,
            group_of,
            first_of,
            sites_of,
        }
    }

    /// All sites are due, and sums of motions begin anew.
    pub(super) fn begin(&mut self) {
        self.moved.fill(0.0);
        self.taken_in.fill(0.0);
        self.taken_in_of_tool = 0.0;
        self.next.fill(0.0);
        self.due_at.fill(0.0);
    }

    /// Takes in what has moved since the last look.
    pub(super) fn take_in(&mut self, watch: &Watch, part: &ContactPart) {
        let sums = watch.sums();
        if std::mem::replace(&mut self.n_starts, sums.n_starts) != sums.n_starts {
            self.begin();
        }
        for group in 0..self.sites.len() {
            self.moved[group] = self.moved(group, sums);
        }
        self.taken_in.copy_from_slice(sums.by_force);
        self.taken_in_of_tool = sums.by_tool;
        // Beside the sums: nodes under their own forces.
        for &(candidate, change) in watch.changed() {
            let moved = part.largest_block(candidate) * change;
            let range = self.first_of[candidate as usize]..self.first_of[candidate as usize + 1];
            for k in range {
                let site = self.sites_of[k as usize] as usize;
                let due_at = &mut self.due_at[site];
                *due_at -= moved;
                let next = &mut self.next[self.group_of[site] as usize];
                *next = next.min(*due_at);
            }
        }
    }

    /// Looks at the sites that are due. `look` is told of a site and how far it and the tool have moved (m), and gives
    /// the sum at which it is due again.
    pub(super) fn visit(&mut self, sums: Sums<'_>, mut look: impl FnMut(usize, f64) -> f64) {
        for group in 0..self.sites.len() {
            let moved = self.moved(group, sums);
            // Also where a sum is not a number any more.
            let is_early = self.next[group] > moved;
            if is_early {
                continue;
            }
            let mut next = f64::INFINITY;
            for &site in &self.sites[group] {
                let due_at = &mut self.due_at[site as usize];
                let is_early = *due_at > moved;
                if !is_early {
                    *due_at = look(site as usize, moved);
                }
                next = next.min(*due_at);
            }
            self.next[group] = next;
        }
    }

    /// m, how far the sites of a group and the tool have moved at most.
    #[inline]
    fn moved(&self, group: usize, sums: Sums<'_>) -> f64 {
        let since = |c: &u32| sums.by_force[*c as usize] - self.taken_in[*c as usize];
        // What is not a number stays seen: then all are looked at.
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        let of_nodes = self.clusters[group].iter().map(since).fold(0.0, larger);
        self.moved[group] + (sums.by_tool - self.taken_in_of_tool) + of_nodes
    }

    /// Tells of all sites that may be nearer than they are waited for by `distance` (m).
    pub(super) fn within(&self, sums: Sums<'_>, distance: f64, mut tell: impl FnMut(usize)) {
        for group in 0..self.sites.len() {
            let limit = self.moved(group, sums) + distance;
            if self.next[group] > limit {
                continue;
            }
            let sites = self.sites[group].iter();
            sites
                .filter(|site| self.due_at[**site as usize] <= limit)
                .for_each(|site| tell(*site as usize));
        }
    }
}

//! Candidates in clusters of neighbours, and what is known of the compliance between whole clusters.
//!
//! What forces in one cluster do to all nodes of another is bounded by three norms for each pair of clusters, so that
//! the proximity stage can judge a far cluster by one of its nodes:
//!
//! ```text
//! largest   max ‖C_ij‖                 i ≠ j    how far a force moves any node
//! rows      max ‖C_ij - C_mj‖                   how differently from the middle node m of its own cluster
//! columns   max ‖C_ij - C_ik‖                   and how that depends on where in its cluster the force acts
//! ```
//! over the nodes i of one cluster and the forces j of the other, k one of these. Norms are Frobenius', rounded up.

mod build;

use glam::{DMat3, DVec3};

/// Nodes in a cluster at most, unless that would make more than [`MOST_CLUSTERS`].
const MOST_MEMBERS: usize = 64;

/// A thousand clusters of norms are 12 MB, and are gone through in a microsecond or two.
const MOST_CLUSTERS: usize = 1024;

/// Clusters of candidates and the norms of the compliance between them.
#[derive(Debug, Clone)]
pub(super) struct Clusters {
    /// Candidates, cluster by cluster.
    members: Vec<u32>,
    /// Where each cluster begins in `members`, and the end.
    starts: Vec<u32>,
    /// By candidate: its place in `members`, and its cluster.
    place_of: Vec<u32>,
    cluster_of: Vec<u32>,
    /// By cluster: the candidate nearest to its middle, and the largest distance of the others from it at rest, m.
    middles: Vec<u32>,
    radii: Vec<f64>,
    /// m/N, at `b * len + c`: forces in b, nodes of c.
    largest: Vec<f32>,
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl Clusters {
    /// Splits at the median along the longest side until clusters are small. `rest`: rest positions, m.
    pub(super) fn new(rest: &[DVec3]) -> Self {
        let n = rest.len();
        let most = MOST_MEMBERS.max(n.div_ceil(MOST_CLUSTERS));
        let mut members: Vec<u32> = (0..n as u32).collect();
        let mut starts = Vec::new();
        split(rest, &mut members, 0, most, &mut starts);
        let n_clusters = starts.len();
        starts.push(n as u32);
        let mut clusters = Self {
            place_of: vec![0; n],
            cluster_of: vec![0; n],
            middles: Vec::with_capacity(n_clusters),
            radii: Vec::with_capacity(n_clusters),
            largest: vec![0.0; n_clusters * n_clusters],
            rows: vec![0.0; n_clusters * n_clusters],
            columns: vec![0.0; n_clusters * n_clusters],
            members,
            starts,
        };
        for c in 0..n_clusters {
            let first = clusters.starts[c] as usize;
            for (k, &candidate) in clusters.members_of(c).to_vec().iter().enumerate() {
                clusters.place_of[candidate as usize] = (first + k) as u32;
                clusters.cluster_of[candidate as usize] = c as u32;
            }
            let (low, high) = bounds(rest, clusters.members_of(c));
            let centre = 0.5 * (low + high);
            let distance = |i: u32, x: DVec3| (rest[i as usize] - x).length();
            let members = clusters.members_of(c).iter().copied();
            let by_distance = |a: &u32, b: &u32| {
                let (a, b) = (distance(*a, centre), distance(*b, centre));
                a.total_cmp(&b)
            };
            // No cluster is empty.
            let middle = members.clone().min_by(by_distance).unwrap_or_default();
            let radius = members.map(|i| distance(i, rest[middle as usize]));
            let radius = radius.fold(0.0, f64::max);
            clusters.middles.push(middle);
            clusters.radii.push(radius);
        }
        clusters
    }

    /// What the column of one candidate adds to the norms of its cluster, `[largest, rows, columns]` by cluster, to be
    /// [raised](Self::raise) before a force acts there. `column(i)` is C_ij, `reference(i)` C_ik for a candidate k of
    /// the same cluster, the same for all, whose column was the first.
    pub(super) fn norms_of(
        &self,
        j: u32,
        column: impl Fn(usize) -> DMat3,
        reference: impl Fn(usize) -> DMat3,
    ) -> [Vec<f32>; 3] {
        let mut norms = std::array::from_fn(|_| vec![0.0; self.len()]);
        let [largest, rows, columns] = &mut norms;
        self.fold(j, column, reference, [largest, rows, columns]);
        norms
    }

    /// Takes in the norms of one candidate's column. Does not allocate.
    pub(super) fn raise(&mut self, j: u32, norms: &[Vec<f32>; 3]) {
        let (n, b) = (self.len(), self.cluster_of(j));
        let kept = [&mut self.largest, &mut self.rows, &mut self.columns];
        for (kept, norms) in kept.into_iter().zip(norms) {
            for (kept, norm) in kept[b * n..][..n].iter_mut().zip(norms) {
                *kept = kept.max(*norm);
            }
        }
    }

    /// Raises the norms of a cluster of forces, `[largest, rows, columns]` by cluster, by one column.
    fn fold(
        &self,
        j: u32,
        column: impl Fn(usize) -> DMat3,
        reference: impl Fn(usize) -> DMat3,
        [largest, rows, columns]: [&mut [f32]; 3],
    ) {
        let own = self.cluster_of(j);
        for c in 0..self.len() {
            let of_middle = column(self.middles[c] as usize);
            let (mut l, mut r, mut k) = (0.0_f64, 0.0_f64, 0.0_f64);
            for &i in self.members_of(c) {
                let block = column(i as usize);
                r = r.max(norm_squared(&(block - of_middle)));
                if i != j {
                    l = l.max(norm_squared(&block));
                }
                if c != own {
                    k = k.max(norm_squared(&(block - reference(i as usize))));
                }
            }
            // Within a cluster nothing is gained by a difference: a node's own column is far larger than others.
            let k = if c == own { l } else { k };
            for (norm, squared) in [
                (&mut largest[c], l),
                (&mut rows[c], r),
                (&mut columns[c], k),
            ] {
                *norm = norm.max(rounded_up(squared.sqrt()));
            }
        }
    }

    /// Number of clusters.
    pub(super) fn len(&self) -> usize {
        self.middles.len()
    }

    /// Candidates, cluster by cluster.
    pub(super) fn members(&self) -> &[u32] {
        &self.members
    }

    /// Where the members of a cluster are in [`Self::members`].
    #[inline]
    pub(super) fn range(&self, cluster: usize) -> std::ops::Range<usize> {
        self.starts[cluster] as usize..self.starts[cluster + 1] as usize
    }

    fn members_of(&self, cluster: usize) -> &[u32] {
        &self.members[self.range(cluster)]
    }

    /// Place of a candidate in [`Self::members`].
    #[inline]
    pub(super) fn place_of(&self, candidate: u32) -> usize {
        self.place_of[candidate as usize] as usize
    }

    #[inline]
    pub(super) fn cluster_of(&self, candidate: u32) -> usize {
        self.cluster_of[candidate as usize] as usize
    }

    /// The node that a cluster is judged by.
    pub(super) fn middle(&self, cluster: usize) -> u32 {
        self.middles[cluster]
    }

    /// m, largest distance of a member from the middle node at rest.
    pub(super) fn radius(&self, cluster: usize) -> f64 {
        self.radii[cluster]
    }

    /// m/N, by cluster: how far a force in cluster `b` moves any node at most but the loaded one.
    #[inline]
    pub(super) fn largest(&self, b: usize) -> &[f32] {
        &self.largest[b * self.len()..][..self.len()]
    }

    /// m/N, by cluster: by how much more or less than its middle node a force in `b` moves any node.
    #[inline]
    pub(super) fn rows(&self, b: usize) -> &[f32] {
        &self.rows[b * self.len()..][..self.len()]
    }

    /// m/N, by cluster: by how much the motion of any node differs for forces at two nodes of `b`, one of them fixed.
    #[inline]
    pub(super) fn columns(&self, b: usize) -> &[f32] {
        &self.columns[b * self.len()..][..self.len()]
    }
}

/// Splits `members`, whose first is at `start` of all, into clusters of at most `most`, and these on down to single
/// nodes, so that neighbours stand side by side.
fn split(rest: &[DVec3], members: &mut [u32], start: u32, most: usize, starts: &mut Vec<u32>) {
    let is_cluster = members.len() <= most;
    if is_cluster && !members.is_empty() && most > 0 {
        starts.push(start);
    }
    if members.len() < 2 {
        return;
    }
    // Below a cluster none is begun.
    let most = if is_cluster { 0 } else { most };
    let (low, high) = bounds(rest, members);
    let axis = (high - low).max_position();
    let half = members.len() / 2;
    // By number where places are equal, so that the order is the same everywhere.
    members.select_nth_unstable_by(half, |a, b| {
        let [x, y] = [a, b].map(|i| rest[*i as usize][axis]);
        x.total_cmp(&y).then(a.cmp(b))
    });
    let (first, second) = members.split_at_mut(half);
    split(rest, first, start, most, starts);
    split(rest, second, start + half as u32, most, starts);
}

/// Lowest and highest coordinates, m.
fn bounds(rest: &[DVec3], members: &[u32]) -> (DVec3, DVec3) {
    let positions = members.iter().map(|i| rest[*i as usize]);
    positions.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    })
}

fn norm_squared(c: &DMat3) -> f64 {
    c.x_axis.length_squared() + c.y_axis.length_squared() + c.z_axis.length_squared()
}

/// No less than the number, in 32 bits.
fn rounded_up(x: f64) -> f32 {
    (x as f32).next_up()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks that look random, C_ij = C_jiᵀ.
    fn block(i: usize, j: usize) -> DMat3 {
        let entry = |a: usize, b: usize| {
            let (p, q) = ((3 * i + a) as f64, (3 * j + b) as f64);
            (p * 12.9898 + q * 78.233).sin() + (q * 12.9898 + p * 78.233).sin()
        };
        DMat3::from_cols_array_2d(&std::array::from_fn(|b| {
            std::array::from_fn(|a| entry(a, b))
        }))
    }

    fn places(n: usize) -> Vec<DVec3> {
        (0..n)
            .map(|k| DVec3::new((k % 13) as f64, (k % 7) as f64, (k % 3) as f64))
            .collect()
    }

    #[test]
    fn every_candidate_is_in_one_small_cluster() {
        for n in [0, 1, 2, 64, 65, 1000] {
            let rest = places(n);
            let clusters = Clusters::new(&rest);
            let mut seen = vec![0; n];
            for c in 0..clusters.len() {
                assert!((1..=MOST_MEMBERS).contains(&clusters.range(c).len()));
                let middle = rest[clusters.middle(c) as usize];
                for place in clusters.range(c) {
                    let candidate = clusters.members()[place];
                    seen[candidate as usize] += 1;
                    assert_eq!(clusters.place_of(candidate), place);
                    assert_eq!(clusters.cluster_of(candidate), c);
                    let distance = (rest[candidate as usize] - middle).length();
                    assert!(distance <= clusters.radius(c));
                }
            }
            assert!(seen.iter().all(|count| *count == 1));
        }
    }

    /// Against all pairs of nodes; all columns at once, and some one after the other.
    #[test]
    fn norms_between_clusters_are_the_largest_of_their_nodes() {
        let rest = places(300);
        let mut at_once = Clusters::new(&rest);
        at_once.add_all(block);
        let mut by_column = Clusters::new(&rest);
        let some: Vec<u32> = (0..300).filter(|j| j % 7 != 2).rev().collect();
        let mut references = vec![usize::MAX; by_column.len()];
        for &j in &some {
            let b = by_column.cluster_of(j);
            if references[b] == usize::MAX {
                references[b] = j as usize;
            }
            let column = |i| block(i, j as usize);
            let norms = by_column.norms_of(j, column, |i| block(i, references[b]));
            by_column.raise(j, &norms);
        }
        let all: Vec<u32> = (0..300).collect();
        let firsts: Vec<usize> = (0..at_once.len())
            .map(|b| at_once.members_of(b)[0] as usize)
            .collect();
        let cases = [(&at_once, &all, &firsts), (&by_column, &some, &references)];
        for (clusters, columns, references) in cases {
            let norm = |c: DMat3| norm_squared(&c).sqrt();
            for b in 0..clusters.len() {
                let k = references[b];
                for c in 0..clusters.len() {
                    let middle = clusters.middle(c) as usize;
                    let mut expected = [0.0_f64; 3];
                    for &j in columns.iter().filter(|j| clusters.cluster_of(**j) == b) {
                        for place in clusters.range(c) {
                            let (i, j) = (clusters.members()[place] as usize, j as usize);
                            let own = if i == j { 0.0 } else { norm(block(i, j)) };
                            let by_row = norm(block(i, j) - block(middle, j));
                            let by_column = match b == c {
                                true => own,
                                false => norm(block(i, j) - block(i, k)),
                            };
                            for (most, x) in expected.iter_mut().zip([own, by_row, by_column]) {
                                *most = most.max(x);
                            }
                        }
                    }
                    let norms = [
                        clusters.largest(b)[c],
                        clusters.rows(b)[c],
                        clusters.columns(b)[c],
                    ];
                    for (norm, expected) in norms.map(f64::from).into_iter().zip(expected) {
                        assert!(norm >= expected && norm <= expected * (1.0 + 3e-7) + 1e-30);
                    }
                }
            }
        }
    }
}

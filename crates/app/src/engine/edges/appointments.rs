//! When the tool's features can be at a face: not before its nodes and the tool have moved far enough.
//!
//! The sums of motions are kept by cluster of nodes (`watch`). A face is moved by no more than all the clusters that
//! its nodes are in together; faces of the same clusters wait as a group.

use std::collections::BTreeMap;

use contact::surface::Surface;

use super::super::clusters::Clusters;
use super::super::watch::Sums;

/// By group of faces with the same clusters, and by face.
#[derive(Debug)]
pub(super) struct Appointments {
    /// Clusters of each group.
    clusters: Vec<Vec<u32>>,
    /// Faces of each group.
    pub(super) faces: Vec<Vec<u32>>,
    /// By group: none of its faces is due before this, m of its sum of motions.
    pub(super) next: Vec<f64>,
    group_of: Vec<u32>,
    /// By face: not to be reached before this, m of its group's sum of motions.
    pub(super) due_at: Vec<f64>,
    /// The sums that this belongs to.
    pub(super) n_starts: u64,
}

impl Appointments {
    pub(super) fn new(surface: &Surface, of_nodes: &Clusters) -> Self {
        let mut groups: BTreeMap<Vec<u32>, Vec<u32>> = BTreeMap::new();
        for face in 0..surface.n_faces() {
            let nodes = surface.nodes_of(face).iter();
            let candidates = nodes.filter(|node| surface.is_candidate(**node));
            let mut clusters: Vec<u32> = candidates
                .map(|node| of_nodes.cluster_of(*node) as u32)
                .collect();
            clusters.sort_unstable();
            clusters.dedup();
            groups.entry(clusters).or_default().push(face as u32);
        }
        let mut group_of = vec![0; surface.n_faces()];
        for (group, faces) in groups.values().enumerate() {
            for face in faces {
                group_of[*face as usize] = group as u32;
            }
        }
        let (clusters, faces): (Vec<_>, Vec<_>) = groups.into_iter().unzip();
        Self {
            next: vec![0.0; faces.len()],
            due_at: vec![0.0; group_of.len()],
            n_starts: 0,
            clusters,
            faces,
            group_of,
        }
    }

    pub(super) fn n_groups(&self) -> usize {
        self.faces.len()
    }

    /// All faces are due, by sums that have begun anew.
    pub(super) fn begin(&mut self, n_starts: u64) {
        self.next.fill(0.0);
        self.due_at.fill(0.0);
        self.n_starts = n_starts;
    }

    /// A face is due.
    pub(super) fn call(&mut self, face: usize) {
        self.due_at[face] = 0.0;
        self.next[self.group_of[face] as usize] = 0.0;
    }

    /// m, how far the faces of a group and the tool have moved at most.
    #[inline]
    pub(super) fn moved(&self, group: usize, sums: Sums<'_>) -> f64 {
        let of_nodes = self.clusters[group].iter();
        sums.by_tool + of_nodes.map(|c| sums.by_force[*c as usize]).sum::<f64>()
    }
}

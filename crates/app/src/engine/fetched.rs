//! Columns of the compliance that come one by one: written by one thread, read by the step without waiting.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};

use glam::DMat3;
use once_cell::race::OnceBox;

use super::clusters::Clusters;
use crate::stored::Blocks;

/// No candidate.
const NONE: u32 = u32::MAX;

/// Columns by candidate, written once each.
#[derive(Debug)]
pub(super) struct FetchedColumns {
    columns: Box<[OnceBox<Column>]>,
    /// Candidates in the order in which their columns came; the first [`Self::n_arrived`] of them are there.
    arrived: Box<[AtomicU32]>,
    n_arrived: AtomicUsize,
    /// By cluster: the candidate whose column the others of the cluster are compared with.
    references: Box<[AtomicU32]>,
    /// Whether one is being written. Writers take turns; the step is none.
    is_writing: AtomicBool,
}

/// One candidate's column: displacement of every row per unit force on it.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) blocks: Blocks,
    /// m/N, largest Frobenius norm of a block of the candidates.
    pub(super) largest: f64,
    /// What it adds to the norms between clusters.
    pub(super) norms: [Vec<f32>; 3],
}

impl FetchedColumns {
    /// Room for `capacity` columns of `n` candidates; the clusters may have further members, which never move.
    pub(super) fn new(n: usize, clusters: &Clusters, capacity: usize) -> Self {
        let none = |n: usize| (0..n).map(|_| AtomicU32::new(NONE)).collect();
        Self {
            columns: (0..n).map(|_| OnceBox::new()).collect(),
            arrived: none(capacity.min(n)),
            n_arrived: AtomicUsize::new(0),
            references: none(clusters.len()),
            is_writing: AtomicBool::new(false),
        }
    }

    #[inline]
    pub(super) fn get(&self, candidate: usize) -> Option<&Column> {
        self.columns[candidate].get()
    }

    pub(super) fn n_arrived(&self) -> usize {
        self.n_arrived.load(Ordering::Acquire)
    }

    /// The candidate whose column came as number `k`, below [`Self::n_arrived`].
    pub(super) fn arrived(&self, k: usize) -> u32 {
        self.arrived[k].load(Ordering::Relaxed)
    }

    /// Writes a candidate's column; false if there is no room or it is there already.
    pub(super) fn insert(&self, clusters: &Clusters, candidate: u32, blocks: Blocks) -> bool {
        while self.is_writing.swap(true, Ordering::Acquire) {
            std::hint::spin_loop();
        }
        let is_new = self.write(clusters, candidate, blocks);
        self.is_writing.store(false, Ordering::Release);
        is_new
    }

    fn write(&self, clusters: &Clusters, candidate: u32, blocks: Blocks) -> bool {
        let n = self.n_arrived.load(Ordering::Relaxed);
        if n == self.arrived.len() || self.get(candidate as usize).is_some() {
            return false;
        }
        let cluster = clusters.cluster_of(candidate);
        let reference = self.references[cluster].load(Ordering::Relaxed);
        let compared_with = self.columns.get(reference as usize).and_then(OnceBox::get);
        let compared_with = compared_with.map_or(&blocks, |column| &column.blocks);
        let n_compliant = self.columns.len();
        let of = |blocks: &Blocks, i: usize| {
            if i < n_compliant {
                blocks.get(i)
            } else {
                DMat3::ZERO
            }
        };
        let norms = clusters.norms_of(candidate, |i| of(&blocks, i), |i| of(compared_with, i));
        let largest = (0..self.columns.len())
            .map(|i| norm_squared(&blocks.get(i)))
            .fold(0.0, f64::max)
            .sqrt();
        if reference == NONE {
            self.references[cluster].store(candidate, Ordering::Relaxed);
        }
        let column = Column {
            blocks,
            largest,
            norms,
        };
        let is_new = self.columns[candidate as usize]
            .set(Box::new(column))
            .is_ok();
        self.arrived[n].store(candidate, Ordering::Relaxed);
        self.n_arrived.store(n + 1, Ordering::Release);
        is_new
    }
}

pub(super) fn norm_squared(c: &DMat3) -> f64 {
    c.to_cols_array().iter().map(|x| x * x).sum()
}

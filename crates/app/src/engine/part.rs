//! What the step needs of a prepared part: candidates at rest and the compliance between them.

use bytemuck::cast_slice;
use contact::delassus::ComplianceBlocks;
use glam::{DMat3, DVec3};

use super::ActiveContact;
use super::clusters::Clusters;
use super::constrained::Constrained;
use super::pairs::Pairs;

/// Candidate nodes and the compliance of the part as the step reads it.
#[derive(Debug)]
pub struct ContactPart {
    rest: Vec<DVec3>,
    n_rows: usize,
    blocks: Vec<f64>,
    /// m/N, by candidate j: bound on the norm of C_ij for all candidates i.
    largest_block: Vec<f64>,
    clusters: Clusters,
}

impl ContactPart {
    /// `rest`: rest positions of the candidates, m. `blocks`: 3x3 blocks of C, column-major
    /// inside, block of row i and candidate j at `j * n_rows + i`; the first rows are the
    /// candidates themselves, in the same order.
    ///
    /// # Panics
    /// If the lengths do not fit together (a programmer's mistake).
    pub fn new(rest: Vec<DVec3>, n_rows: usize, blocks: Vec<f64>) -> Self {
        assert_eq!(
            blocks.len(),
            9 * n_rows * rest.len(),
            "compliance blocks do not fit the candidates"
        );
        assert!(n_rows >= rest.len(), "the candidates are the first rows");
        let column = |j: usize| &cast_slice::<f64, DMat3>(&blocks)[j * n_rows..][..rest.len()];
        let largest_block = (0..rest.len())
            .map(|j| {
                let squared = column(j).iter().map(norm_squared);
                squared.fold(0.0, f64::max).sqrt()
            })
            .collect();
        let mut clusters = Clusters::new(&rest);
        clusters.add_all(|i, j| column(j)[i]);
        Self {
            rest,
            n_rows,
            blocks,
            largest_block,
            clusters,
        }
    }

    /// Takes other bounds on the norms of the blocks, m/N by candidate: those of a compliance that
    /// this one is only a share of.
    pub(super) fn bounded_by(mut self, bounds: &[f64]) -> Self {
        assert_eq!(
            bounds.len(),
            self.rest.len(),
            "one bound for each candidate"
        );
        self.largest_block.copy_from_slice(bounds);
        self.clusters.bound_by(bounds);
        self
    }

    /// Number of candidate nodes.
    pub fn n_candidates(&self) -> usize {
        self.rest.len()
    }

    /// Rest positions of the candidates, m, part frame.
    pub fn rest_positions(&self) -> &[DVec3] {
        &self.rest
    }

    /// All blocks, in the layout of [`ContactPart::new`].
    pub fn blocks(&self) -> &[f64] {
        &self.blocks
    }

    /// Displacement of candidate `i` under the given contact forces, m: sum of C_ij f_j.
    #[inline]
    pub fn displacement(&self, i: usize, active: &[ActiveContact]) -> DVec3 {
        // C_ij is C_jiᵀ: one column is read, not one place in each of many.
        let column = &cast_slice::<f64, DMat3>(&self.blocks)[i * self.n_rows..][..self.rest.len()];
        let mut u = DVec3::ZERO;
        for contact in active {
            u += column[contact.candidate as usize].mul_transpose_vec3(contact.force_on_part);
        }
        u
    }

    /// Largest Frobenius norm of a 3x3 block of a candidate's column, m/N: no candidate moves by
    /// more than this times the force on it.
    pub(super) fn largest_block(&self, candidate: u32) -> f64 {
        self.largest_block[candidate as usize]
    }

    /// The candidates in clusters of neighbours.
    pub(super) fn clusters(&self) -> &Clusters {
        &self.clusters
    }

    /// Upper bound on the displacement of any candidate, m.
    pub fn displacement_bound(&self, active: &[ActiveContact]) -> f64 {
        active
            .iter()
            .map(|c| self.largest_block[c.candidate as usize] * c.normal_force.abs())
            .sum()
    }
}

/// The part under contact forces: what every stage asks for displacements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deformed<'a> {
    pub(super) part: &'a ContactPart,
    pub(super) active: &'a [ActiveContact],
    /// Where interface nodes are constrained, `part` is the coarse one.
    pub(super) constrained: Option<&'a Constrained>,
    /// Blocks that lie side by side; of the part alone, not used where it is constrained.
    pub(super) pairs: &'a Pairs,
}

impl Deformed<'_> {
    /// Displacement of candidate `i`, m.
    #[inline]
    pub(super) fn displacement(&self, i: usize) -> DVec3 {
        match self.constrained {
            None => {
                let kept = self.pairs.slot(i as u32);
                kept.and_then(|slot| self.pairs.displacement(slot, self.active))
                    .unwrap_or_else(|| self.part.displacement(i, self.active))
            }
            Some(constrained) => constrained.displacement(i, self.part, self.active),
        }
    }

    /// Upper bound on the displacement of any candidate, m.
    pub(super) fn displacement_bound(&self) -> f64 {
        self.part.displacement_bound(self.active)
    }

    /// Full switches of the compliance since the start, each no more than all of it.
    pub(super) fn switched(&self) -> f64 {
        self.constrained.map_or(0.0, Constrained::switched)
    }
}

impl ComplianceBlocks for ContactPart {
    #[inline]
    fn block(&self, row: usize, col: usize) -> &DMat3 {
        &cast_slice::<f64, DMat3>(&self.blocks)[col * self.n_rows + row]
    }
}

fn norm_squared(c: &DMat3) -> f64 {
    c.to_cols_array().iter().map(|x| x * x).sum()
}

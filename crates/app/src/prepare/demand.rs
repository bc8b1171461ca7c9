//! Columns on demand: a part of more candidates than memory has room for keeps its factor, and a candidate gets its
//! column when the tool comes near it.
//!
//! Some columns, spread over the part, are there from the start, so that a tool meets the part wherever it comes down.
//! The others are fetched ahead of the tool, nearest first, while steps go on (see
//! [`ContactPart::insert`]).

use std::sync::Arc;

use contact::tool::Tool;
use fem::FactoredStiffness;
use glam::DVec3;
use glamx::DPose3;
use gpu::Scalar;

use crate::engine::{ActiveContact, ContactPart};
use crate::stored::{Blocks, Source};

use super::LoadedPart;

/// Columns that are there from the start, at most.
const SEEDS: usize = 64;

/// Nodes whose columns are solved for at a time, three right-hand sides each: as fast per column as any more.
const PANEL: usize = 16;

/// Nodes asked for in one go: what comes near next is asked for then, not after the whole part.
const BATCH: usize = 64;

/// A part whose columns are fetched when they are wanted.
#[derive(Debug)]
pub struct Demand {
    factor: FactoredStiffness,
    /// Nodes of the mesh that is solved on.
    candidates: Vec<u32>,
    rows: Vec<u32>,
    part: Arc<ContactPart>,
    scalar: Scalar,
}

/// Memory of one column, bytes.
pub(super) fn column_bytes(n_rows: usize, scalar: Scalar) -> f64 {
    let of_number = match scalar {
        Scalar::F64 => 8.0,
        Scalar::F32 => 4.0,
    };
    9.0 * of_number * n_rows as f64
}

impl Demand {
    /// `capacity`: columns that memory is to be spent on. Fetches those that are there from the start.
    pub(super) fn new(
        loaded: &LoadedPart,
        factor: FactoredStiffness,
        capacity: usize,
        scalar: Scalar,
    ) -> Self {
        let rest: Vec<DVec3> = loaded
            .candidates
            .iter()
            .map(|&node| DVec3::from_array(loaded.mesh.nodes[node as usize]))
            .collect();
        let seeds = spread(&rest, SEEDS.min(capacity));
        let demand = Self {
            factor,
            candidates: loaded.solved_nodes(&loaded.candidates).into_owned(),
            rows: loaded.solved_nodes(&loaded.rows).into_owned(),
            part: Arc::new(ContactPart::with_fetched_and_held(
                rest,
                &loaded.held_positions(),
                capacity,
            )),
            scalar,
        };
        demand.fetch(&seeds);
        demand
    }

    /// The part that steps act on.
    pub fn part(&self) -> &Arc<ContactPart> {
        &self.part
    }

    /// Memory of the columns that are there, and of the factor, bytes.
    pub fn bytes(&self) -> f64 {
        self.part.n_columns() as f64 * column_bytes(self.rows.len(), self.scalar)
            + 8.0 * self.factor.n_factor_entries() as f64
    }

    /// Solves for the columns of these candidates that are not there yet; allocates, takes a while.
    pub fn fetch(&self, wanted: &[u32]) {
        let n = self.factor.n_dofs();
        let missing: Vec<u32> = wanted
            .iter()
            .copied()
            .filter(|&c| !self.part.has_column(c))
            .collect();
        for panel in missing.chunks(PANEL) {
            let mut forces = vec![0.0; 3 * n * panel.len()];
            for (k, &candidate) in panel.iter().enumerate() {
                for c in 0..3 {
                    let dof = 3 * self.candidates[candidate as usize] as usize + c;
                    forces[(3 * k + c) * n + dof] = 1.0;
                }
            }
            let displacements = self.factor.solve_many(&forces);
            for (&candidate, u) in panel.iter().zip(displacements.chunks_exact(3 * n)) {
                let mut column = vec![0.0; 9 * self.rows.len()];
                for (block, &node) in column.chunks_exact_mut(9).zip(&self.rows) {
                    for c in 0..3 {
                        block[3 * c..3 * c + 3]
                            .copy_from_slice(&u[c * n + 3 * node as usize..][..3]);
                    }
                }
                let column = match self.scalar {
                    Scalar::F64 => Blocks::F64(Source::Owned(column)),
                    Scalar::F32 => Blocks::rounded(&column),
                };
                // No room is no error: the step leaves the candidate out and says so.
                self.part.insert(candidate, column);
            }
        }
    }

    /// Candidates without a column that are nearer to the tool than `within` (m), nearest first, some at a time.
    /// `drawn`: displacement of every row, m, 3 numbers each.
    pub fn wanted(&self, tool: &Tool, pose: &DPose3, drawn: &[f64], within: f64) -> Vec<u32> {
        let reach = DVec3::splat(within);
        let bounds = tool.aabb(pose).map(|(min, max)| (min - reach, max + reach));
        let mut near: Vec<(f64, u32)> = (0..)
            .zip(self.part.rest_positions())
            .zip(drawn.chunks_exact(3))
            .filter(|((candidate, _), _)| !self.part.has_column(*candidate))
            .map(|((candidate, rest), u)| (candidate, *rest + DVec3::from_slice(u)))
            .filter(|(_, x)| {
                bounds.is_none_or(|(min, max)| x.cmpge(min).all() && x.cmple(max).all())
            })
            .map(|(candidate, x)| (tool.signed_distance(pose, x).signed_distance, candidate))
            .filter(|(distance, _)| *distance < within)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(BATCH);
        near.into_iter().map(|(_, candidate)| candidate).collect()
    }

    /// Displacement of every row under the contact forces, m, 3 numbers each; overwritten. Does not allocate.
    pub fn draw_into(&self, active: &[ActiveContact], drawn: &mut [f64]) {
        for (row, u) in drawn.chunks_exact_mut(3).enumerate() {
            let displacement = self.part.row_displacement(row, active);
            u.copy_from_slice(&displacement.to_array());
        }
    }
}

/// Up to `n` of the points, each as far from those before it as any.
fn spread(points: &[DVec3], n: usize) -> Vec<u32> {
    let mut distance = vec![f64::INFINITY; points.len()];
    let mut chosen = Vec::new();
    let mut next = 0;
    for _ in 0..n.min(points.len()) {
        chosen.push(next as u32);
        let at = points[next];
        for (d, x) in distance.iter_mut().zip(points) {
            *d = d.min((*x - at).length_squared());
        }
        let farthest = (0..points.len()).max_by(|&a, &b| distance[a].total_cmp(&distance[b]));
        match farthest {
            Some(farthest) if distance[farthest] > 0.0 => next = farthest,
            _ => break,
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_spread_over_the_part() {
        let points: Vec<DVec3> = (0..101).map(|k| f64::from(k) * DVec3::X).collect();
        let mut seeds = spread(&points, 5);
        seeds.sort_unstable();
        assert_eq!(seeds, [0, 25, 50, 75, 100]);
        assert_eq!(spread(&points[..2], 9).len(), 2);
        assert_eq!(spread(&[DVec3::ZERO; 3], 9), [0]);
        assert!(spread(&[], 9).is_empty());
    }
}

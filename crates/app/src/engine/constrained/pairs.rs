//! Compliance blocks between candidates that were near, kept until the free set changes.

use contact::delassus::ComplianceBlocks;
use glam::DMat3;

/// No slot.
const NONE: u32 = u32::MAX;

/// Blocks between up to `capacity` candidates, each with a slot.
#[derive(Debug)]
pub(super) struct Pairs {
    slot_of: Vec<u32>,
    known: Vec<u32>,
    capacity: usize,
    /// Block of the candidates in slots i and j at `j capacity + i`.
    blocks: Vec<DMat3>,
}

impl Pairs {
    pub(super) fn new(n_candidates: usize, capacity: usize) -> Self {
        Self {
            slot_of: vec![NONE; n_candidates],
            known: Vec::with_capacity(capacity),
            capacity,
            blocks: vec![DMat3::ZERO; capacity * capacity],
        }
    }

    pub(super) fn clear(&mut self) {
        for candidate in self.known.drain(..) {
            self.slot_of[candidate as usize] = NONE;
        }
    }

    /// Candidates by slot.
    pub(super) fn known(&self) -> &[u32] {
        &self.known
    }

    pub(super) fn slot(&self, candidate: u32) -> Option<usize> {
        let slot = self.slot_of[candidate as usize];
        (slot != NONE).then_some(slot as usize)
    }

    /// Room for more.
    pub(super) fn n_left(&self) -> usize {
        self.capacity - self.known.len()
    }

    /// Adds a candidate; `block_with(slot, i)` is the block of a known candidate, or itself, and it.
    pub(super) fn push(&mut self, candidate: u32, block_with: impl Fn(usize, u32) -> DMat3) {
        let slot = self.known.len();
        self.slot_of[candidate as usize] = slot as u32;
        self.known.push(candidate);
        for (k, i) in self.known.iter().enumerate() {
            let block = block_with(k, *i);
            self.blocks[slot * self.capacity + k] = block;
            self.blocks[k * self.capacity + slot] = block.transpose();
        }
    }

    /// Block of the candidates in slots i and j.
    #[inline]
    pub(super) fn at(&self, i: usize, j: usize) -> &DMat3 {
        &self.blocks[j * self.capacity + i]
    }

    /// Makes all blocks anew.
    pub(super) fn refill(&mut self, block: impl Fn(u32, u32) -> DMat3) {
        for j in 0..self.known.len() {
            for i in 0..=j {
                let block = block(self.known[i], self.known[j]);
                self.blocks[j * self.capacity + i] = block;
                self.blocks[i * self.capacity + j] = block.transpose();
            }
        }
    }
}

impl ComplianceBlocks for Pairs {
    #[inline]
    fn block(&self, row: usize, col: usize) -> &DMat3 {
        self.at(self.slot_of[row] as usize, self.slot_of[col] as usize)
    }
}

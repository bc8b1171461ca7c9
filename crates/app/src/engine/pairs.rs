//! Compliance blocks between candidates that are or were near, side by side: each is fetched once from the large
//! matrix, where every one lies on another page, and kept while there is room.

use contact::delassus::ComplianceBlocks;
use glam::{DMat3, DVec3};

use super::{ActiveContact, ContactPart};

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
    /// By slot, and by candidate: when it was last asked for, in calls of [`Self::ensure`].
    asked_at: Vec<u64>,
    counted_at: Vec<u64>,
    now: u64,
    /// Where the search for a slot to give away goes on.
    hand: usize,
}

impl Pairs {
    pub(super) fn new(n_candidates: usize, capacity: usize) -> Self {
        Self {
            slot_of: vec![NONE; n_candidates],
            known: Vec::with_capacity(capacity),
            capacity,
            blocks: vec![DMat3::ZERO; capacity * capacity],
            asked_at: vec![0; capacity],
            counted_at: vec![0; n_candidates],
            now: 0,
            hand: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        for candidate in self.known.drain(..) {
            self.slot_of[candidate as usize] = NONE;
        }
    }

    /// As new: what was known before decides which of C_ij and C_jiᵀ is read, and they differ by round-off.
    pub(super) fn reset(&mut self) {
        self.clear();
        self.hand = 0;
    }

    pub(super) fn slot(&self, candidate: u32) -> Option<usize> {
        let slot = self.slot_of[candidate as usize];
        (slot != NONE).then_some(slot as usize)
    }

    /// Slot of a candidate that was asked for last.
    pub(super) fn slot_or_first(&self, candidate: u32) -> u32 {
        self.slot(candidate).unwrap_or(0) as u32
    }

    /// Room for more.
    fn n_left(&self) -> usize {
        self.capacity - self.known.len()
    }

    fn put(&mut self, slot: usize, candidate: u32, part: &ContactPart) {
        self.slot_of[candidate as usize] = slot as u32;
        for (k, i) in self.known.iter().enumerate() {
            let block = part.block(*i as usize, candidate as usize);
            self.blocks[slot * self.capacity + k] = block;
            self.blocks[k * self.capacity + slot] = block.transpose();
        }
    }

    /// Fetches the blocks between these candidates that are not known yet; those asked for longest ago make room.
    /// False, and nothing is known, if there are more than fit.
    pub(super) fn ensure(
        &mut self,
        candidates: impl Iterator<Item = u32> + Clone,
        part: &ContactPart,
    ) -> bool {
        self.now += 1;
        let mut n_asked = 0;
        for candidate in candidates.clone() {
            let counted_at = &mut self.counted_at[candidate as usize];
            if std::mem::replace(counted_at, self.now) != self.now {
                n_asked += 1;
            }
            if let Some(slot) = self.slot(candidate) {
                self.asked_at[slot] = self.now;
            }
        }
        if n_asked > self.capacity {
            self.clear();
            return false;
        }
        for candidate in candidates {
            if self.slot(candidate).is_some() {
                continue;
            }
            let slot = if self.n_left() > 0 {
                self.known.push(candidate);
                self.known.len() - 1
            } else {
                // There is one: no more are asked for than fit.
                while self.asked_at[self.hand] == self.now {
                    self.hand = (self.hand + 1) % self.capacity;
                }
                self.slot_of[self.known[self.hand] as usize] = NONE;
                self.known[self.hand] = candidate;
                self.hand
            };
            self.asked_at[slot] = self.now;
            self.put(slot, candidate, part);
        }
        true
    }

    /// Displacement of the candidate in a slot, m, if all that carry force are known.
    #[inline]
    pub(super) fn displacement(&self, slot: usize, active: &[ActiveContact]) -> Option<DVec3> {
        let column = &self.blocks[slot * self.capacity..][..self.capacity];
        let mut u = DVec3::ZERO;
        for contact in active {
            let of_contact = self.slot_of[contact.candidate as usize];
            // C_ij is C_jiᵀ: the blocks with one candidate lie side by side.
            u += column
                .get(of_contact as usize)?
                .mul_transpose_vec3(contact.force_on_part);
        }
        Some(u)
    }

    /// Block of the candidates in slots i and j.
    #[inline]
    pub(super) fn at(&self, i: usize, j: usize) -> &DMat3 {
        &self.blocks[j * self.capacity + i]
    }
}

impl ComplianceBlocks for Pairs {
    #[inline]
    fn block(&self, row: usize, col: usize) -> DMat3 {
        *self.at(self.slot_of[row] as usize, self.slot_of[col] as usize)
    }
}

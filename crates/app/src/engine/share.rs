//! More near nodes than rows: patches of neighbours share a row each, and learn how.
//!
//! The shares in which a patch's nodes carry its force are corrected by the gaps that they leave (one step of Jacobi's
//! method in what the patches cannot do, projected to pushes):
//!
//! ```text
//! ẑ_i = max(0, z_i - α r_i / s_i)     r = q + W z     s_i = (e_i - p)ᵀ W (e_i - p) / (1 - p_i)
//! ```
//! The contact problem closes a patch's mean gap; s_i is what a node gives way beyond that, which on a slender arm is far
//! less than its own compliance. A step begins with the shares of the step before, and goes on in rounds, each with
//! better shares, until the estimated error is small: a tool that moves is felt as one at rest. A node that comes near
//! has no share yet, and patches that change hands change nothing where shares are right: the force stays continuous.

use contact::patch::{Loss, Patches, loss};
use contact::{Contact, Place};
use glam::DVec3;

use super::clusters::Clusters;
use super::forces::Forces;

/// α: neighbours add to what a node's own force does, so that a full step would overshoot.
const DAMPING: f64 = 0.7;

/// Rounds for better shares in one search for equilibrium, each with some passes.
pub(super) const MOST_ROUNDS: u32 = 8;

/// Of the tolerance of the resultant, the estimate above which shares are made better.
pub(super) const GOOD_ENOUGH: f64 = 0.5;

/// Patches of the near nodes where they do not fit the rows, and all memory for them.
#[derive(Debug)]
pub(super) struct Share {
    pub(super) patches: Patches,
    is_on: bool,
    /// q by contact, m; the contact problem has that by patch.
    q: Vec<f64>,
    /// Gaps of the contacts after the solution, m.
    gaps: Vec<f64>,
    /// Number of the search for shares, from 1.
    round: u64,
    /// By key: force that it will carry about, N, in this round; zero but for those in `hinted`.
    hints: Vec<f64>,
    hinted: Vec<u32>,
    hinted_in: u64,
    /// By contact of the last pass with patches: better forces, N, and the round that they were found in.
    better: Vec<f64>,
    better_of: Vec<u32>,
    better_in: u64,
}

impl Share {
    pub(super) fn new(n_keys: usize, max_near: usize) -> Self {
        Self {
            patches: Patches::new(max_near),
            is_on: false,
            q: Vec::with_capacity(max_near),
            gaps: Vec::with_capacity(max_near),
            round: 0,
            hints: vec![0.0; n_keys],
            hinted: Vec::with_capacity(n_keys),
            hinted_in: 0,
            better: Vec::with_capacity(max_near),
            better_of: Vec::with_capacity(max_near),
            better_in: 0,
        }
    }

    /// Forgets what was learnt.
    pub(super) fn clear(&mut self) {
        (self.hinted_in, self.better_in) = (0, 0);
    }

    /// From here on patches take the better shares that the passes until now have found.
    pub(super) fn begin_round(&mut self) {
        self.round += 1;
    }

    /// The patches of this pass, if there are any, for its Delassus operator.
    pub(super) fn patches_mut(&mut self) -> Option<&mut Patches> {
        self.is_on.then_some(&mut self.patches)
    }

    /// The patches of this pass, if there are any.
    pub(super) fn patches(&self) -> Option<&Patches> {
        self.is_on.then_some(&self.patches)
    }

    /// Sorts the contacts into patches where they are more than `max_rows`; the number of rows. `length` (m): what a turn
    /// of a normal by one radian is compared with.
    pub(super) fn gather(
        &mut self,
        contacts: &mut [Contact],
        places: &[Place],
        max_rows: usize,
        forces: &Forces,
        clusters: &Clusters,
        length: f64,
    ) -> usize {
        self.is_on = contacts.len() > max_rows;
        if !self.is_on {
            return contacts.len();
        }
        // Shares stay as they are until the planes stand still.
        let is_begun = self.hinted_in == self.round;
        if !is_begun {
            self.hinted_in = self.round;
            self.hint(forces);
        }
        let key_of = |place: u32| places[place as usize].key;
        // A place stands where the first of its nodes does.
        let rank_of = |place: u32| {
            let node = places[place as usize].shares().first();
            node.map_or(0, |(node, _)| clusters.place_of(*node) as u32)
        };
        self.patches.gather(
            contacts,
            rank_of,
            clusters.members().len() as u32,
            max_rows,
            length,
            |place| self.hints[key_of(place) as usize],
            is_begun,
        );
        self.patches.len()
    }

    fn hint(&mut self, forces: &Forces) {
        for key in self.hinted.drain(..) {
            self.hints[key as usize] = 0.0;
        }
        if self.better_in != 0 && self.better_in + 1 == self.round {
            for (key, force) in self.better_of.iter().zip(&self.better) {
                self.hints[*key as usize] = *force;
                self.hinted.push(*key);
            }
        } else {
            // Until now there were rows enough: these forces are the true ones.
            for (key, force) in forces.carried() {
                self.hints[*key as usize] += *force;
                self.hinted.push(*key);
            }
        }
    }

    /// q by contact becomes q by patch.
    pub(super) fn reduce(&mut self, n_contacts: usize, q: &mut [f64]) {
        self.q.clear();
        self.q.extend_from_slice(&q[..n_contacts]);
        self.patches.reduce_into(&self.q, q);
    }

    /// What the solution lost, and better shares for the next round. `z`: forces of the contacts, N; `motion_of`: the
    /// displacement of a contact's place and how far the tool comes towards it, m; `is_open`: no gap was closed without
    /// force, so that there is none.
    pub(super) fn learn(
        &mut self,
        contacts: &[Contact],
        z: &[f64],
        is_open: bool,
        motion_of: impl Fn(&Contact) -> (DVec3, f64),
        key_of: impl Fn(&Contact) -> u32,
    ) -> Loss {
        self.gaps.clear();
        self.better.clear();
        self.better_of.clear();
        for (i, ((contact, z), q)) in contacts.iter().zip(z).zip(&self.q).enumerate() {
            let (displacement, tool) = motion_of(contact);
            let gap = q + contact.normal.dot(displacement) - tool;
            self.gaps.push(gap);
            let shift = if is_open { None } else { self.patches.shift(i) };
            let better = shift.map_or(*z, |shift| z - DAMPING * gap / shift);
            self.better.push(better.max(0.0));
            self.better_of.push(key_of(contact));
        }
        self.better_in = self.round;
        loss(&z[..contacts.len()], &self.better, &self.q, &self.gaps)
    }
}

#[cfg(test)]
mod tests;

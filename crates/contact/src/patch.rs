//! More near nodes than the contact problem may have rows: neighbours with like normals share one.
//!
//! The forces of the nodes of a patch g rise and fall together, in shares p_i that are given:
//!
//! ```text
//! z = P y,  P_ig = p_i >= 0, Σ_i p_i = 1     W_r = Pᵀ W P,  q_r = Pᵀ q
//! ```
//! Galerkin's method on the space of forces: W_r is symmetric and positive semi-definite with W, forces stay pushes, and
//! they balance exactly. Only the gap of a patch is a weighted mean of its nodes' gaps. Where the shares are those of
//! the true forces, so is the answer, whatever the patches.
//!
//! How much is lost is known afterwards. With r = q + W z the gaps of all nodes, and because yᵀ(q_r + W_r y) = 0, the
//! energy E(z) = ½ zᵀ W z + qᵀ z lies above that of the true forces z* by
//!
//! ```text
//! 0 <= E(z) - E(z*) <= -rᵀ z* <= Σ z*_i max(-r_i, 0)
//! ```
//! by convexity. With d = z* - z and w* z >= 0 that energy is also at least ½ dᵀ W d, and so what a force c·z along a
//! row c of the tool lacks is bounded (Cauchy and Schwarz in the norm of W): for a tool that is pressed in along c,
//!
//! ```text
//! (c·d)² <= (cᵀ W⁻¹ c) dᵀ W d      |c·d| / c·z <= sqrt(s K / K_h)
//! ```
//! where s is the lost share of the energy, K = cᵀ W⁻¹ c the stiffness of all contacts held together and K_h that of the
//! patches. Neither z* nor K is known: [`Loss`] takes [`SAFETY`] sqrt(s), with an estimate of z* in s.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::contacts::Contact;
use crate::delassus::{
    ComplianceBlocks, CouplingCompliance, Frame, check_frames, check_size, for_each_block,
    for_each_entry,
};
use crate::error::Error;

/// Estimated error of the resultant over sqrt(s). Once, a tube that slides over the nodes of the clip is underestimated in
/// one step of four; at six times, in none that is wrong by more than a thousandth, with 4 to 12 rows for 16 nodes.
pub const SAFETY: f64 = 6.0;

/// Of what a node gives way in all, the least that it gives way against its patch: less is rounding.
const LEAST_SHIFT: f64 = 1e-9;

/// Patches of contacts, with all memory to make them.
#[derive(Debug)]
pub struct Patches {
    /// By contact: its place.
    places: Vec<u32>,
    /// By patch: its first contact; and the end.
    starts: Vec<u32>,
    /// By contact: its patch.
    patch_of: Vec<u32>,
    /// By contact: its share p_i of the patch's force.
    shares: Vec<f64>,
    /// By contact: how far its own gap opens when a unit of its patch's force is shifted to it, see [`Self::shift`], m/N.
    shifts: Vec<f64>,
    /// By contact: W_ii, m/N.
    own: Vec<f64>,
    /// What may be split further, by how unlike its contacts are; the bits of a positive number are in its order.
    queue: BinaryHeap<(u64, Reverse<Part>)>,
    /// What is not worth a split.
    done: Vec<Part>,
}

/// Contacts from `first` to `last` in a range of ranks that is halved at each split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Part {
    first: u32,
    last: u32,
    from: u32,
    to: u32,
}

/// What sharing rows cost, see the [module](self).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Loss {
    /// m, deepest that a place penetrates after the solution.
    pub penetration: f64,
    /// Estimate of the resultant's relative error, [`SAFETY`] times the root of the bound on the lost share of the
    /// contact energy, with an estimate of the true forces in place of these. Without unit.
    pub force_rel: f64,
}

impl Patches {
    /// `max_contacts`: contacts that memory is reserved for.
    pub fn new(max_contacts: usize) -> Self {
        Self {
            places: Vec::with_capacity(max_contacts),
            starts: Vec::with_capacity(max_contacts + 1),
            patch_of: Vec::with_capacity(max_contacts),
            shares: Vec::with_capacity(max_contacts),
            shifts: Vec::with_capacity(max_contacts),
            own: Vec::with_capacity(max_contacts),
            queue: BinaryHeap::with_capacity(max_contacts),
            done: Vec::with_capacity(max_contacts),
        }
    }

    /// Sorts the contacts into at most `most` patches, and by them.
    ///
    /// `rank_of`: rank of a place, below `n_ranks`, in an order in which neighbours stand side by side at every
    /// scale: the leaves of a tree that halves. Patches are halves of halves; the one whose contacts differ most, in
    /// place (in units of `length`, m) and normal, is split first. `hint_of`: force that a place will carry about,
    /// N, for the shares; equal ones where a patch has none.
    /// `keeps`: patches and shares stay as they are if the places are those of the last time, so that passes over
    /// the same contacts end where two splits are nearly as good.
    /// Does not allocate for up to `max_contacts` contacts.
    #[expect(clippy::too_many_arguments, reason = "each is another thing")]
    pub fn gather(
        &mut self,
        contacts: &mut [Contact],
        rank_of: impl Fn(u32) -> u32,
        n_ranks: u32,
        most: usize,
        length: f64,
        hint_of: impl Fn(u32) -> f64,
        keeps: bool,
    ) {
        contacts.sort_unstable_by_key(|contact| rank_of(contact.place));
        let places = contacts.iter().map(|contact| contact.place);
        if keeps && places.clone().eq(self.places.iter().copied()) {
            return;
        }
        self.places.clear();
        self.places.extend(places);
        self.queue.clear();
        self.done.clear();
        self.put(
            contacts,
            Part {
                first: 0,
                last: contacts.len() as u32,
                from: 0,
                to: n_ranks,
            },
            length,
        );
        while self.queue.len() + self.done.len() < most {
            let Some((_, Reverse(part))) = self.queue.pop() else {
                break;
            };
            let [lower, upper] = part.halves(contacts, &rank_of);
            self.put(contacts, lower, length);
            self.put(contacts, upper, length);
        }
        let parts = self.queue.drain().map(|(_, Reverse(part))| part);
        self.starts.clear();
        self.starts
            .extend(parts.chain(self.done.drain(..)).map(|part| part.first));
        self.starts.sort_unstable();
        self.starts.push(contacts.len() as u32);
        self.weigh(contacts, hint_of);
    }

    fn put(&mut self, contacts: &[Contact], part: Part, length: f64) {
        let members = &contacts[part.first as usize..part.last as usize];
        let unlike = unlikeness(members, length);
        if members.len() > 1 && unlike > 0.0 {
            self.queue.push((unlike.to_bits(), Reverse(part)));
        } else {
            self.done.push(part);
        }
    }

    fn weigh(&mut self, contacts: &[Contact], hint_of: impl Fn(u32) -> f64) {
        self.shares.clear();
        self.patch_of.clear();
        let hints = contacts
            .iter()
            .map(|contact| hint_of(contact.place).max(0.0));
        self.shares.extend(hints);
        for (patch, ends) in self.starts.windows(2).enumerate() {
            let shares = &mut self.shares[ends[0] as usize..ends[1] as usize];
            let sum: f64 = shares.iter().sum();
            if sum > 0.0 && sum.is_finite() {
                shares.iter_mut().for_each(|share| *share /= sum);
            } else {
                let n = shares.len() as f64;
                shares.fill(1.0 / n);
            }
            self.patch_of
                .extend(std::iter::repeat_n(patch as u32, shares.len()));
        }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the contacts of a patch are.
    pub fn range(&self, patch: usize) -> std::ops::Range<usize> {
        self.starts[patch] as usize..self.starts[patch + 1] as usize
    }

    /// W_r of the contacts that were gathered, as by [`crate::delassus::delassus_into`], column-major, m/N.
    /// Does not allocate. Cost: about 20 multiply-adds for each pair of contacts.
    ///
    /// # Errors
    /// [`Error::Length`] unless `w` has the number of patches squared entries.
    pub fn delassus_into(
        &mut self,
        compliance: &impl ComplianceBlocks,
        contacts: &[Contact],
        coupling: Option<CouplingCompliance>,
        w: &mut [f64],
    ) -> Result<(), Error> {
        let m = self.len();
        check_size(w, m)?;
        w.fill(0.0);
        self.begin_shifts(contacts.len());
        let Self {
            patch_of,
            shares,
            shifts,
            own,
            ..
        } = self;
        for_each_entry(compliance, contacts, coupling, |i, j, entry| {
            let (g, h) = (patch_of[i] as usize, patch_of[j] as usize);
            let share = shares[i] * shares[j] * entry;
            if g != h {
                w[h * m + g] += share;
            } else if i != j {
                // Both triangles are meant.
                w[h * m + g] += 2.0 * share;
                shifts[i] += shares[j] * entry;
                shifts[j] += shares[i] * entry;
            } else {
                w[h * m + g] += share;
                shifts[i] += shares[i] * entry;
                own[i] = entry;
            }
        });
        self.finish(w, m, 1);
        Ok(())
    }

    /// The same along normals and tangents, as by [`crate::delassus::delassus_frames_into`], column-major, 3 rows a patch.
    /// The forces of a patch then rise, fall and turn together, so its contacts must have like tangents.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a frame for each contact and `w` has nine times the patches squared entries.
    pub fn delassus_frames_into(
        &mut self,
        compliance: &impl ComplianceBlocks,
        contacts: &[Contact],
        frames: &[Frame],
        coupling: Option<CouplingCompliance>,
        w: &mut [f64],
    ) -> Result<(), Error> {
        let n = 3 * self.len();
        check_frames(frames, contacts.len())?;
        check_size(w, n)?;
        w.fill(0.0);
        self.begin_shifts(contacts.len());
        let Self {
            patch_of,
            shares,
            shifts,
            own,
            ..
        } = self;
        for_each_block(compliance, contacts, frames, coupling, |i, j, block| {
            let (g, h) = (patch_of[i] as usize, patch_of[j] as usize);
            let share = shares[i] * shares[j];
            for (b, column) in block.iter().enumerate() {
                for (a, entry) in column.iter().enumerate() {
                    w[(3 * h + b) * n + 3 * g + a] += share * entry;
                    if i != j && g == h {
                        w[(3 * h + a) * n + 3 * g + b] += share * entry;
                    }
                }
            }
            let entry = block[0][0];
            if i == j {
                shifts[i] += shares[i] * entry;
                own[i] = entry;
            } else if g == h {
                shifts[i] += shares[j] * entry;
                shifts[j] += shares[i] * entry;
            }
        });
        self.finish(w, n, 3);
        Ok(())
    }

    fn begin_shifts(&mut self, n_contacts: usize) {
        for values in [&mut self.shifts, &mut self.own] {
            values.clear();
            values.resize(n_contacts, 0.0);
        }
    }

    /// From sums to [`Self::shift`], and the lower triangle of W_r of `n` rows, `each` a patch, of which the first is normal.
    fn finish(&mut self, w: &mut [f64], n: usize, each: usize) {
        for (i, shift) in self.shifts.iter_mut().enumerate() {
            let g = each * self.patch_of[i] as usize;
            let away = self.own[i] - 2.0 * *shift + w[g * n + g];
            *shift = away / (1.0 - self.shares[i]);
        }
        for column in 0..n {
            for row in 0..column {
                w[row * n + column] = w[column * n + row];
            }
        }
    }

    /// How far the gap of contact `i` opens when a unit of force is shifted to it from its patch as a whole, m/N:
    /// (e_i - p)ᵀ W (e_i - p) / (1 - p_i), of the last [`Self::delassus_into`]. In a patch of equal nodes that is what
    /// each of them gives way alone, without what all of them do together. `None` where there is nothing to shift, as
    /// in a patch of one.
    pub fn shift(&self, i: usize) -> Option<f64> {
        let shift = self.shifts[i];
        (shift > LEAST_SHIFT * self.own[i]).then_some(shift)
    }

    /// Weighted means of one number for each contact, e.g. q_r of q.
    pub fn reduce_into(&self, of_contacts: &[f64], of_patches: &mut [f64]) {
        for (patch, mean) in of_patches.iter_mut().take(self.len()).enumerate() {
            let members = self.range(patch).map(|i| self.shares[i] * of_contacts[i]);
            *mean = members.sum();
        }
    }

    /// Forces of the patches, which come first, to forces of the contacts: z = P y, in place.
    pub fn spread(&self, z: &mut [f64]) {
        // From the last: the patches' own are still needed until then.
        for i in (0..self.shares.len()).rev() {
            let (patch, share) = self.share_of(i);
            z[i] = share * z[patch];
        }
    }

    /// The patch of contact `i`, and which share of its force the contact carries.
    pub fn share_of(&self, i: usize) -> (usize, f64) {
        (self.patch_of[i] as usize, self.shares[i])
    }
}

impl Part {
    /// The two halves of the ranks in which there are contacts.
    fn halves(self, contacts: &[Contact], rank_of: &impl Fn(u32) -> u32) -> [Self; 2] {
        let Self {
            first,
            last,
            mut from,
            mut to,
        } = self;
        let members = &contacts[first as usize..last as usize];
        let (at, middle) = loop {
            let middle = from + (to - from) / 2;
            let n_lower = members.partition_point(|contact| rank_of(contact.place) < middle);
            match first + n_lower as u32 {
                // Several contacts of one rank.
                _ if to - from < 2 => break (first + (last - first) / 2, middle),
                at if at == last => to = middle,
                at if at == first => from = middle,
                at => break (at, middle),
            }
        };
        let lower = Self {
            first,
            last: at,
            from,
            to: middle,
        };
        let upper = Self {
            first: at,
            last,
            from: middle,
            to,
        };
        [lower, upper]
    }
}

/// Sum of squared deviations from the mean, of places in units of `length` and of normals.
fn unlikeness(contacts: &[Contact], length: f64) -> f64 {
    let n = contacts.len() as f64;
    let middle = contacts.iter().map(|contact| contact.point).sum::<DVec3>() / n;
    let normal = contacts.iter().map(|contact| contact.normal).sum::<DVec3>() / n;
    let deviation = |contact: &Contact| {
        ((contact.point - middle) / length).length_squared()
            + (contact.normal - normal).length_squared()
    };
    contacts.iter().map(deviation).sum()
}

/// What was lost, all by contact: `z` forces and `better` an estimate of the true ones (N), `q` and `gaps` the gaps
/// without and with `z` (m).
pub fn loss(z: &[f64], better: &[f64], q: &[f64], gaps: &[f64]) -> Loss {
    let penetration = gaps.iter().fold(0.0, |most, gap| f64::max(most, -gap));
    let beyond = better.iter().zip(gaps).map(|(z, gap)| z * (-gap).max(0.0));
    let beyond: f64 = beyond.sum();
    let energy = -0.5 * z.iter().zip(q).map(|(z, q)| z * q).sum::<f64>();
    let force_rel = if beyond > 0.0 {
        SAFETY * (beyond / energy.max(0.0)).sqrt()
    } else {
        0.0
    };
    Loss {
        penetration,
        force_rel,
    }
}

#[cfg(test)]
mod tests;

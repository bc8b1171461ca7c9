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
//! where s is the lost share of the energy, K = cᵀ W⁻¹ c the stiffness of all planes held together and K_h that of the
//! patches. Neither z* nor K is known: [`Loss`] takes [`SAFETY`] sqrt(s), with an estimate of z* in s.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::delassus::{ComplianceBlocks, CouplingCompliance, check_size, for_each_entry};
use crate::error::Error;
use crate::plane::Plane;

/// Estimated error of the resultant over sqrt(s). Once, a tube that slides over the nodes of the clip is underestimated in
/// one step of four; at six times, in none that is wrong by more than a thousandth, with 4 to 12 rows for 16 nodes.
pub const SAFETY: f64 = 6.0;

/// Of what a node gives way in all, the least that it gives way against its patch: less is rounding.
const LEAST_SHIFT: f64 = 1e-9;

/// Patches of planes, with all memory to make them.
#[derive(Debug)]
pub struct Patches {
    /// By plane: the candidate.
    candidates: Vec<u32>,
    /// By patch: its first plane; and the end.
    starts: Vec<u32>,
    /// By plane: its patch.
    patch_of: Vec<u32>,
    /// By plane: its share p_i of the patch's force.
    shares: Vec<f64>,
    /// By plane: how far its own gap opens when a unit of its patch's force is shifted to it, see [`Self::shift`], m/N.
    shifts: Vec<f64>,
    /// By plane: W_ii, m/N.
    own: Vec<f64>,
    /// What may be split further, by how unlike its planes are; the bits of a positive number are in its order.
    queue: BinaryHeap<(u64, Reverse<Part>)>,
    /// What is not worth a split.
    done: Vec<Part>,
}

/// Planes from `first` to `last` in a range of places that is halved at each split.
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
    /// m, deepest that a node penetrates its plane after the solution.
    pub penetration: f64,
    /// Estimate of the resultant's relative error, [`SAFETY`] times the root of the bound on the lost share of the
    /// contact energy, with an estimate of the true forces in place of these. Without unit.
    pub force_rel: f64,
}

impl Patches {
    /// `max_planes`: planes that memory is reserved for.
    pub fn new(max_planes: usize) -> Self {
        Self {
            candidates: Vec::with_capacity(max_planes),
            starts: Vec::with_capacity(max_planes + 1),
            patch_of: Vec::with_capacity(max_planes),
            shares: Vec::with_capacity(max_planes),
            shifts: Vec::with_capacity(max_planes),
            own: Vec::with_capacity(max_planes),
            queue: BinaryHeap::with_capacity(max_planes),
            done: Vec::with_capacity(max_planes),
        }
    }

    /// Sorts the planes into at most `most` patches, and by them.
    ///
    /// `place_of`: place of a candidate, below `n_places`, in an order in which neighbours stand side by side at every
    /// scale: the leaves of a tree that halves. Patches are halves of halves; the one whose planes differ most, in
    /// place (in units of `length`, m) and normal, is split first. `hint_of`: force that a candidate will carry about,
    /// N, for the shares; equal ones where a patch has none.
    /// `keeps`: patches and shares stay as they are if the candidates are those of the last time, so that passes over
    /// the same planes end where two splits are nearly as good.
    /// Does not allocate for up to `max_planes` planes.
    #[expect(clippy::too_many_arguments, reason = "each is another thing")]
    pub fn gather(
        &mut self,
        planes: &mut [Plane],
        place_of: impl Fn(u32) -> u32,
        n_places: u32,
        most: usize,
        length: f64,
        hint_of: impl Fn(u32) -> f64,
        keeps: bool,
    ) {
        planes.sort_unstable_by_key(|plane| place_of(plane.candidate));
        let candidates = planes.iter().map(|plane| plane.candidate);
        if keeps && candidates.clone().eq(self.candidates.iter().copied()) {
            return;
        }
        self.candidates.clear();
        self.candidates.extend(candidates);
        self.queue.clear();
        self.done.clear();
        self.put(
            planes,
            Part {
                first: 0,
                last: planes.len() as u32,
                from: 0,
                to: n_places,
            },
            length,
        );
        while self.queue.len() + self.done.len() < most {
            let Some((_, Reverse(part))) = self.queue.pop() else {
                break;
            };
            let [lower, upper] = part.halves(planes, &place_of);
            self.put(planes, lower, length);
            self.put(planes, upper, length);
        }
        let parts = self.queue.drain().map(|(_, Reverse(part))| part);
        self.starts.clear();
        self.starts
            .extend(parts.chain(self.done.drain(..)).map(|part| part.first));
        self.starts.sort_unstable();
        self.starts.push(planes.len() as u32);
        self.weigh(planes, hint_of);
    }

    fn put(&mut self, planes: &[Plane], part: Part, length: f64) {
        let members = &planes[part.first as usize..part.last as usize];
        let unlike = unlikeness(members, length);
        if members.len() > 1 && unlike > 0.0 {
            self.queue.push((unlike.to_bits(), Reverse(part)));
        } else {
            self.done.push(part);
        }
    }

    fn weigh(&mut self, planes: &[Plane], hint_of: impl Fn(u32) -> f64) {
        self.shares.clear();
        self.patch_of.clear();
        let hints = planes.iter().map(|plane| hint_of(plane.candidate).max(0.0));
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

    /// Where the planes of a patch are.
    pub fn range(&self, patch: usize) -> std::ops::Range<usize> {
        self.starts[patch] as usize..self.starts[patch + 1] as usize
    }

    /// W_r of the planes that were gathered, as by [`crate::delassus::delassus_into`], column-major, m/N.
    /// Does not allocate. Cost: about 20 multiply-adds for each pair of planes.
    ///
    /// # Errors
    /// [`Error::Length`] unless `w` has the number of patches squared entries.
    pub fn delassus_into(
        &mut self,
        compliance: &impl ComplianceBlocks,
        planes: &[Plane],
        coupling: Option<CouplingCompliance>,
        w: &mut [f64],
    ) -> Result<(), Error> {
        let m = self.len();
        check_size(w, m)?;
        w.fill(0.0);
        let Self {
            patch_of,
            shares,
            shifts,
            own,
            ..
        } = self;
        shifts.clear();
        shifts.resize(planes.len(), 0.0);
        own.clear();
        own.resize(planes.len(), 0.0);
        for_each_entry(compliance, planes, coupling, |i, j, entry| {
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
        for (i, shift) in shifts.iter_mut().enumerate() {
            let g = patch_of[i] as usize;
            let away = own[i] - 2.0 * *shift + w[g * m + g];
            *shift = away / (1.0 - shares[i]);
        }
        for h in 0..m {
            for g in 0..h {
                w[g * m + h] = w[h * m + g];
            }
        }
        Ok(())
    }

    /// How far the gap of plane `i` opens when a unit of force is shifted to it from its patch as a whole, m/N:
    /// (e_i - p)ᵀ W (e_i - p) / (1 - p_i), of the last [`Self::delassus_into`]. In a patch of equal nodes that is what
    /// each of them gives way alone, without what all of them do together. `None` where there is nothing to shift, as
    /// in a patch of one.
    pub fn shift(&self, i: usize) -> Option<f64> {
        let shift = self.shifts[i];
        (shift > LEAST_SHIFT * self.own[i]).then_some(shift)
    }

    /// Weighted means of one number for each plane, e.g. q_r of q.
    pub fn reduce_into(&self, of_planes: &[f64], of_patches: &mut [f64]) {
        for (patch, mean) in of_patches.iter_mut().take(self.len()).enumerate() {
            let members = self.range(patch).map(|i| self.shares[i] * of_planes[i]);
            *mean = members.sum();
        }
    }

    /// Forces of the patches, which come first, to forces of the planes: z = P y, in place.
    pub fn spread(&self, z: &mut [f64]) {
        // From the last: the patches' own are still needed until then.
        for i in (0..self.shares.len()).rev() {
            z[i] = self.shares[i] * z[self.patch_of[i] as usize];
        }
    }
}

impl Part {
    /// The two halves of the places in which there are planes.
    fn halves(self, planes: &[Plane], place_of: &impl Fn(u32) -> u32) -> [Self; 2] {
        let Self {
            first,
            last,
            mut from,
            mut to,
        } = self;
        let members = &planes[first as usize..last as usize];
        let (at, middle) = loop {
            let middle = from + (to - from) / 2;
            let n_lower = members.partition_point(|plane| place_of(plane.candidate) < middle);
            match first + n_lower as u32 {
                // Several planes at one place.
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
fn unlikeness(planes: &[Plane], length: f64) -> f64 {
    let n = planes.len() as f64;
    let place = planes.iter().map(|plane| plane.point).sum::<DVec3>() / n;
    let normal = planes.iter().map(|plane| plane.normal).sum::<DVec3>() / n;
    let deviation = |plane: &Plane| {
        ((plane.point - place) / length).length_squared() + (plane.normal - normal).length_squared()
    };
    planes.iter().map(deviation).sum()
}

/// What was lost, all by plane: `z` forces and `better` an estimate of the true ones (N), `q` and `gaps` the gaps
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
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::delassus::delassus_into;

    struct Blocks;
    static NEAR: DMat3 = DMat3::from_cols_array(&[2.0, 0.1, 0.0, 0.1, 3.0, 0.2, 0.0, 0.2, 4.0]);
    static FAR: DMat3 = DMat3::from_cols_array(&[0.5, 0.1, 0.0, 0.1, 0.4, 0.0, 0.0, 0.0, 0.3]);
    impl ComplianceBlocks for Blocks {
        fn block(&self, row: usize, col: usize) -> DMat3 {
            if row == col { NEAR } else { FAR }
        }
    }

    /// Two heaps of nodes, far apart, and one node with the opposite normal amid the first.
    fn planes() -> Vec<Plane> {
        (0..41)
            .rev()
            .map(|k: u32| {
                let side = if k < 20 || k == 40 { 0.0 } else { 30.0 };
                let at = f64::from(k % 20);
                let normal = if k == 40 { -DVec3::Z } else { DVec3::Z };
                Plane {
                    candidate: k,
                    gap: 0.0,
                    normal,
                    point: DVec3::new(side + 0.1 * at, 0.02 * at * at, 0.0),
                }
            })
            .collect()
    }

    /// Neighbours side by side: the odd one in the middle of the first heap.
    fn place_of(candidate: u32) -> u32 {
        match candidate {
            40 => 10,
            0..10 => candidate,
            _ => candidate + 1,
        }
    }

    fn gathered(most: usize) -> (Patches, Vec<Plane>) {
        let mut planes = planes();
        let mut patches = Patches::new(planes.len());
        let hint = |candidate: u32| f64::from(candidate % 3);
        patches.gather(&mut planes, place_of, 42, most, 10.0, hint, false);
        (patches, planes)
    }

    #[test]
    fn patches_keep_the_budget_and_split_what_differs_first() {
        for most in [1, 2, 3, 7, 20, 41, 100] {
            let (patches, planes) = gathered(most);
            assert_eq!(patches.len(), most.min(41));
            assert_eq!(patches.range(patches.len() - 1).end, planes.len());
            for patch in 0..patches.len() {
                assert!(!patches.range(patch).is_empty());
                let sum: f64 = patches.shares[patches.range(patch)].iter().sum();
                assert!((sum - 1.0).abs() < 1e-12);
            }
        }
        // Places apart by most of the length, then the opposite normal.
        let (patches, planes) = gathered(8);
        let of_odd = planes
            .iter()
            .position(|plane| plane.candidate == 40)
            .unwrap();
        let mixed = (0..8).filter(|patch| {
            let members = &planes[patches.range(*patch)];
            members.iter().any(|p| p.point.x < 15.0) && members.iter().any(|p| p.point.x > 15.0)
        });
        assert_eq!(mixed.count(), 0);
        assert_eq!(patches.range(patches.patch_of[of_odd] as usize).len(), 1);
    }

    /// W_r = Pᵀ W P by the whole matrices, with forces and gaps to match.
    #[test]
    fn shared_rows_are_the_galerkin_product() {
        let (mut patches, planes) = gathered(7);
        let (n, m) = (planes.len(), patches.len());
        let identity: [[f64; 6]; 6] =
            std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        let coupling = CouplingCompliance {
            matrix: &identity,
            reference: DVec3::new(1.0, -2.0, 0.5),
        };
        let (mut w, mut w_r) = (vec![0.0; n * n], vec![0.0; m * m]);
        delassus_into(&Blocks, &planes, Some(coupling), &mut w).unwrap();
        patches
            .delassus_into(&Blocks, &planes, Some(coupling), &mut w_r)
            .unwrap();
        for g in 0..m {
            for h in 0..m {
                let mut expected = 0.0;
                for i in patches.range(g) {
                    for j in patches.range(h) {
                        expected += patches.shares[i] * w[j * n + i] * patches.shares[j];
                    }
                }
                assert!((w_r[h * m + g] - expected).abs() < 1e-9 * expected.abs().max(1.0));
                assert_eq!(w_r[h * m + g].to_bits(), w_r[g * m + h].to_bits());
            }
        }
        let q: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut z: Vec<f64> = (0..n).map(|g| 1.0 + g as f64).collect();
        let mut q_r = vec![0.0; m];
        patches.reduce_into(&q, &mut q_r);
        let work: f64 = q_r.iter().zip(&z).map(|(q, y)| q * y).sum();
        patches.spread(&mut z);
        let expected: f64 = q.iter().zip(&z).map(|(q, z)| q * z).sum();
        assert!((work - expected).abs() < 1e-12);
        assert!(
            patches
                .delassus_into(&Blocks, &planes, None, &mut w)
                .is_err()
        );
    }

    /// (e_i - p)ᵀ W (e_i - p) / (1 - p_i) by the whole matrix.
    #[test]
    fn a_shift_is_what_a_node_gives_way_against_its_patch() {
        let (mut patches, planes) = gathered(7);
        let (n, m) = (planes.len(), patches.len());
        let (mut w, mut w_r) = (vec![0.0; n * n], vec![0.0; m * m]);
        delassus_into(&Blocks, &planes, None, &mut w).unwrap();
        patches
            .delassus_into(&Blocks, &planes, None, &mut w_r)
            .unwrap();
        for g in 0..m {
            for i in patches.range(g) {
                let mut d = vec![0.0; n];
                for j in patches.range(g) {
                    d[j] = -patches.shares[j];
                }
                d[i] += 1.0;
                let away = (0..n).map(|j| d[j] * (0..n).map(|k| w[k * n + j] * d[k]).sum::<f64>());
                let expected = away.sum::<f64>() / (1.0 - patches.shares[i]);
                match patches.shift(i) {
                    Some(shift) => assert!((shift / expected - 1.0).abs() < 1e-9),
                    None => assert!(patches.range(g).len() == 1 || patches.shares[i] == 1.0),
                }
            }
        }
    }

    /// Two springs of 1 N/m, pressed 1 m and 3 m, in equal shares: 4 N, gaps -1 m and 1 m.
    #[test]
    fn loss_bounds_the_energy_that_was_left() {
        let (q, z, gaps) = ([-1.0, -3.0], [2.0, 2.0], [1.0, -1.0]);
        let loss = loss(&z, &[1.0, 3.0], &q, &gaps);
        assert_eq!(loss.penetration, 1.0);
        // -½ (1 + 9) = -5 J in truth, -4 J so: 1 J lost, bounded by 3 of 4 J.
        assert_eq!(loss.force_rel, SAFETY * (3.0f64 / 4.0).sqrt());
    }
}

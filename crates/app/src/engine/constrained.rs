//! The p-method by Galerkin: a part whose constrained interface nodes really follow their principal
//! nodes, with free nodes switched while it is touched.
//!
//! The compliance with free bubbles F, from the coarse side, without inverting anything anew:
//!
//! ```text
//! G(F) = G_0 + R_F Σ_FF⁻¹ R_Fᵀ
//! ```
//! G_0: all interface nodes constrained. R: displacement of candidates per bubble amplitude. Σ:
//! stiffness of the bubbles on the elastic coarse part. A switch to another F needs one Cholesky of
//! 3 n_f rows, made over [`BUILD_STEPS`] steps or more, and is then blended in,
//!
//! ```text
//! G = (1 - s) G(F_now) + s G(F_next),   s from 0 to 1
//! ```
//! which is symmetric and positive definite for every s. The engine chooses each rise of s so that
//! the wrench changes by no more than its bound (see `Engine::ramp`).
//!
//! Source: Duriez et al. 2004, section 3.2 (which nodes are free); the Schur complement with respect to
//! the coarse space is the usual one of hierarchical bases (Szabo and Babuska 1991).

mod operator;

use std::time::Instant;

use contact::delassus::ComplianceBlocks;
use glam::{DMat3, DVec3};

use super::pairs::Pairs;
use super::{ActiveContact, ContactPart};
use crate::free_nodes::{FreeNodes, Rule};
use operator::{FreeOperator, dot};

/// Steps in which every bubble is looked at once: at 1 kHz one picture of the display.
const SWEEP: usize = 16;

/// Steps over which the factor and the columns of a new free set are made.
const BUILD_STEPS: usize = 20;

/// Least work in a step of building, multiply-adds: a few microseconds.
const LEAST_WORK: usize = 20_000;

/// Most work in a step of building, multiply-adds, about 100 µs; larger sets take more steps.
const MOST_WORK: usize = 400_000;

/// Candidates whose blocks are kept, unless there are more rows.
pub(super) const MOST_KNOWN: usize = 512;

/// What the step needs to know of the bubbles of a part. Blocks are 3 x 3, column-major inside.
#[derive(Clone, Debug)]
pub struct BubbleData {
    /// Rest positions of the bubbles' nodes, m.
    pub positions: Vec<DVec3>,
    /// R: block of candidate i and bubble j at `9 (i n_bubbles + j)`, without unit.
    pub coupling: Vec<f64>,
    /// Σ, 3 n_bubbles x 3 n_bubbles, symmetric, N/m.
    pub sigma: Vec<f64>,
    /// By candidate j: bound on the norm of C_ij for all candidates i with all bubbles free, m/N.
    pub bounds: Vec<f64>,
}

/// How the free bubbles are chosen.
#[derive(Clone, Copy, Debug)]
pub struct FreeSettings {
    rule: Rule,
    /// Free nodes that memory is reserved for; beyond it nodes stay constrained.
    pub max_free: usize,
}

/// Free nodes at most, unless more are asked for: a factor of 1200 rows is 12 MB, and its columns fill
/// the memory of a part that is large already. A run that reaches it says so.
pub const MOST_FREE: usize = 400;

/// Near candidates that a time budget is reckoned with.
const TYPICAL_ROWS: usize = 32;

impl FreeSettings {
    /// Those within this distance of a contact at rest, m.
    pub fn within(radius: f64) -> Self {
        Self {
            rule: Rule::Radius(radius),
            max_free: MOST_FREE,
        }
    }

    /// Those that would move by more than this share of the largest displacement.
    pub fn bent_beyond(share: f64) -> Self {
        Self {
            rule: Rule::Indicator(share),
            max_free: MOST_FREE,
        }
    }

    /// The nearest ones, as many as the step can have in `budget_us` beside what it takes anyway.
    /// Measured here and now, so that no choice depends on the clock later.
    pub fn affordable(budget_us: f64, data: &BubbleData) -> Self {
        let sample: Vec<f64> = (0..3000).map(|k| f64::from(k % 7)).collect();
        let mut times = [0.0; 31];
        let mut sum = 0.0;
        for time in &mut times {
            let begun = Instant::now();
            for start in 0..100 {
                sum += dot(
                    &sample[start..start + 1000],
                    &sample[1000 + start..2000 + start],
                );
            }
            *time = 1e6 * begun.elapsed().as_secs_f64() / 1e5;
        }
        std::hint::black_box(sum);
        times.sort_by(f64::total_cmp);
        let affordable = (budget_us / times[15]).max(0.0);
        let most = MOST_FREE.min(data.positions.len());
        Self {
            rule: Rule::Nearest,
            max_free: (0..=most)
                .rev()
                .find(|n_free| work_of_step(*n_free) <= affordable)
                .unwrap_or(0),
        }
    }
}

/// Multiply-adds of a step with so many free nodes, the building of another set included.
fn work_of_step(n_free: usize) -> f64 {
    let rows = 3.0 * n_free as f64;
    let m = TYPICAL_ROWS as f64;
    // Two candidates that come near, the amplitudes for a new watch list and its displacements, and
    // another set in the making.
    let comes_near = 2.0 * (3.0 * rows * rows / 2.0 + 9.0 * m * rows);
    let watch_list = rows * rows + 3.0 * 4.0 * m * rows;
    let build = (rows * rows * rows / 6.0 + 3.0 * m * rows * rows / 2.0) / BUILD_STEPS as f64;
    comes_near + watch_list + build.clamp(LEAST_WORK as f64, MOST_WORK as f64)
}

/// What happens with the free set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The operator is that of the chosen set.
    Steady,
    /// The next operator is in the making.
    Build,
    /// The next operator is being blended in.
    Ramp,
}

/// Constrained part with its free nodes, and all memory to switch them.
#[derive(Debug)]
pub(super) struct Constrained {
    data: BubbleData,
    free: FreeNodes,
    stage: Stage,
    now: FreeOperator,
    next: FreeOperator,
    /// Blocks of the blended compliance, G_0 included, between candidates that are or were near.
    blended: Pairs,
    /// Bubbles that are free in either operator, and their amplitudes in the last state, m.
    terms: Vec<(u32, DVec3)>,
    has_terms: bool,
    /// By bubble: its place in `terms`, or `u32::MAX`.
    term_of: Vec<u32>,
    blend: f64,
    /// Full switches since the start.
    switched: f64,
    wanted: Vec<u32>,
    /// Candidates whose columns the next operator will need at once.
    needed: Vec<u32>,
    work_per_step: usize,
}

impl Constrained {
    pub(super) fn new(
        data: BubbleData,
        settings: FreeSettings,
        n_candidates: usize,
        max_near: usize,
    ) -> Self {
        let n_bubbles = data.positions.len();
        let max_free = settings.max_free.min(n_bubbles);
        let capacity = n_candidates.min(MOST_KNOWN.max(max_near));
        let operator = || FreeOperator::new(n_candidates, capacity, n_bubbles, max_free);
        Self {
            free: FreeNodes::new(settings.rule, max_free, data.positions.clone(), SWEEP),
            stage: Stage::Steady,
            now: operator(),
            next: operator(),
            blended: Pairs::new(n_candidates, capacity),
            terms: Vec::with_capacity(n_bubbles),
            has_terms: true,
            term_of: vec![u32::MAX; n_bubbles],
            blend: 0.0,
            switched: 0.0,
            wanted: Vec::with_capacity(n_bubbles),
            needed: Vec::with_capacity(n_candidates),
            work_per_step: LEAST_WORK,
            data,
        }
    }

    /// Everything constrained, no switch under way.
    pub(super) fn reset(&mut self) {
        self.free.reset();
        self.stage = Stage::Steady;
        self.now.clear();
        self.next.clear();
        self.blended.clear();
        self.has_terms = true;
        self.terms.clear();
        self.term_of.fill(u32::MAX);
        self.blend = 0.0;
        // A later value than any that a list was made at.
        self.switched += 1.0;
    }

    /// Nodes that are free in the operator, the one being blended in included.
    pub(super) fn n_free(&self) -> usize {
        match self.stage {
            Stage::Ramp => self.next.n_free(),
            _ => self.now.n_free(),
        }
    }

    pub(super) fn is_ramping(&self) -> bool {
        self.stage == Stage::Ramp
    }

    pub(super) fn blend(&self) -> f64 {
        self.blend
    }

    /// Moves the blend; at 1 the next operator is the one of now.
    pub(super) fn set_blend(&mut self, blend: f64, part: &ContactPart) {
        self.switched += (blend - self.blend).abs();
        self.blend = blend;
        for &candidate in self.blended.known() {
            self.next.ensure(&self.data, candidate);
        }
        let (now, next) = (&self.now, &self.next);
        self.blended.refill(|i, j| {
            part.block(i as usize, j as usize)
                + (1.0 - blend) * now.block(i, j)
                + blend * next.block(i, j)
        });
        self.has_terms = false;
    }

    /// Ends a ramp whose blend is 1.
    pub(super) fn finish_ramp(&mut self) {
        std::mem::swap(&mut self.now, &mut self.next);
        self.blend = 0.0;
        self.stage = Stage::Steady;
    }

    /// Full switches of the operator since the start, each no more than the whole compliance.
    pub(super) fn switched(&self) -> f64 {
        self.switched
    }

    /// Displacement of candidate `i` under contacts whose candidates are known, m.
    #[inline]
    pub(super) fn displacement(
        &self,
        i: usize,
        part: &ContactPart,
        active: &[ActiveContact],
    ) -> DVec3 {
        if let Some(row) = self.blended.slot(i as u32) {
            let of_contact = |c: &ActiveContact| {
                let slot = self.blended.slot(c.candidate).unwrap_or(row);
                *self.blended.at(row, slot) * c.force_on_part
            };
            return active.iter().map(of_contact).sum();
        }
        debug_assert!(self.has_terms, "amplitudes are made before they are used");
        let mut u = part.displacement(i, active);
        let n_bubbles = self.data.positions.len();
        for &(bubble, amplitude) in &self.terms {
            let at = 9 * (i * n_bubbles + bubble as usize);
            u += DMat3::from_cols_slice(&self.data.coupling[at..at + 9]) * amplitude;
        }
        u
    }

    /// Compliance between candidates that are known.
    pub(super) fn blocks(&self) -> &impl ComplianceBlocks {
        &self.blended
    }

    /// Bubbles and their amplitudes after [`Self::make_terms`], m.
    pub(super) fn terms(&self) -> &[(u32, DVec3)] {
        &self.terms
    }

    /// One step of choosing and building. `contacts`: rest positions of what is (nearly) in contact;
    /// `near`: candidates that are watched; `active`: forces of the last step.
    pub(super) fn advance(
        &mut self,
        contacts: &[DVec3],
        near: &[u32],
        active: &[ActiveContact],
        largest: f64,
    ) {
        let data = &self.data;
        let n_bubbles = data.positions.len();
        // Amplitude that a bubble would have if it alone were freed now.
        let bend = |j: usize| {
            let force: DVec3 = active
                .iter()
                .map(|c| {
                    let at = 9 * (c.candidate as usize * n_bubbles + j);
                    let block = DMat3::from_cols_slice(&data.coupling[at..at + 9]);
                    block.transpose() * c.force_on_part
                })
                .sum();
            let n = 3 * n_bubbles;
            let own = DMat3::from_cols_array_2d(&std::array::from_fn(|c| {
                std::array::from_fn(|r| data.sigma[(3 * j + c) * n + 3 * j + r])
            }));
            (own.inverse() * force).length()
        };
        self.free.sweep(contacts, bend, largest);
        match self.stage {
            Stage::Steady => self.begin_build(near),
            Stage::Build => {
                let is_built = self
                    .next
                    .build(&self.data, &self.needed, self.work_per_step);
                if is_built && !self.need_more(near) {
                    self.stage = Stage::Ramp;
                    self.blend = 0.0;
                    // Only what is near now will be blended.
                    self.blended.clear();
                }
            }
            Stage::Ramp => {}
        }
    }

    /// Lists candidates that came near while the next operator was made; false if there are none.
    fn need_more(&mut self, near: &[u32]) -> bool {
        let next = &mut self.next;
        self.needed.clear();
        let missing = near.iter().copied().filter(|c| !next.has_columns(*c));
        self.needed.extend(missing.take(next.n_left()));
        next.begin_columns();
        !self.needed.is_empty()
    }

    /// Begins a switch if the chosen set is another one than the operator's.
    fn begin_build(&mut self, near: &[u32]) {
        let is_free = self.free.is_free();
        let same = self.now.n_free() == self.free.n_free()
            && self.now.bubbles().iter().all(|b| is_free[*b as usize]);
        if same {
            return;
        }
        // Those that stay come first, in the order of the factor, which is kept as far as it holds.
        self.wanted.clear();
        let stay = self.now.bubbles().iter().copied();
        self.wanted.extend(stay.filter(|b| is_free[*b as usize]));
        let n_stay = self.wanted.len();
        self.wanted.extend(
            (0..is_free.len() as u32).filter(|b| is_free[*b as usize] && !self.now.has(*b)),
        );
        self.needed.clear();
        self.needed.extend_from_slice(near);
        let kept = self.next.begin(&self.now, &self.wanted);
        debug_assert!(kept <= n_stay);
        let rows = 3 * self.wanted.len();
        let factor = (rows * rows * rows - (3 * kept).pow(3)) / 6;
        let columns = self.needed.len() * 3 * rows * rows / 2;
        let work = (factor + columns) / BUILD_STEPS;
        self.work_per_step = work.clamp(LEAST_WORK, MOST_WORK);
        self.stage = Stage::Build;
    }

    /// Makes the blocks between these candidates, those in contact and those that are known: some tens
    /// of microseconds for one that was far until now. False if there was no room for all; the
    /// displacement of the others needs [`Self::make_terms`].
    pub(super) fn ensure(
        &mut self,
        candidates: impl Iterator<Item = u32> + Clone,
        active: &[ActiveContact],
        part: &ContactPart,
    ) -> bool {
        let all = active.iter().map(|c| c.candidate).chain(candidates);
        let is_new = |c: &u32| self.blended.slot(*c).is_none();
        let n_new = all.clone().filter(is_new).count();
        if n_new == 0 {
            return true;
        }
        let has_room = n_new <= self.blended.n_left();
        if !has_room {
            // A long way was slid: what was near then makes room.
            self.blended.clear();
            self.now.clear_columns();
            self.next.clear_columns();
        }
        let is_ramp = self.stage == Stage::Ramp;
        for j in all {
            if self.blended.slot(j).is_some() || self.blended.n_left() == 0 {
                continue;
            }
            self.now.ensure(&self.data, j);
            if is_ramp {
                self.next.ensure(&self.data, j);
            }
            let (now, next, blend) = (&self.now, &self.next, self.blend);
            self.blended.push(j, |_, i| {
                let of_next = if is_ramp {
                    blend * next.block(i, j)
                } else {
                    DMat3::ZERO
                };
                part.block(i as usize, j as usize) + (1.0 - blend) * now.block(i, j) + of_next
            });
        }
        has_room
    }

    /// Notes that forces have changed.
    pub(super) fn forget_terms(&mut self) {
        self.has_terms = false;
    }

    /// Amplitudes of the bubbles under these contacts.
    pub(super) fn make_terms(&mut self, active: &[ActiveContact]) {
        if self.has_terms {
            return;
        }
        self.has_terms = true;
        for (bubble, _) in self.terms.drain(..) {
            self.term_of[bubble as usize] = u32::MAX;
        }
        if active.is_empty() {
            return;
        }
        let operators = [
            (1.0 - self.blend, &mut self.now, true),
            (self.blend, &mut self.next, self.stage == Stage::Ramp),
        ];
        for (share, operator, counts) in operators {
            if !counts || share == 0.0 {
                continue;
            }
            operator.solve(&self.data, active);
            for (k, &bubble) in operator.bubbles().iter().enumerate() {
                let amplitude = share * operator.amplitude(k);
                match self.term_of[bubble as usize] {
                    u32::MAX => {
                        self.term_of[bubble as usize] = self.terms.len() as u32;
                        self.terms.push((bubble, amplitude));
                    }
                    at => self.terms[at as usize].1 += amplitude,
                }
            }
        }
    }
}

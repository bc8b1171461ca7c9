//! The p-method by Galerkin: a part whose constrained interface nodes really follow their principal
//! nodes, with free nodes switched while it is touched.
//!
//! The compliance with free bubbles F, from the coarse side, without inverting anything anew:
//!
//! ```text
//! G(F) = G_0 + R_F Σ_FF⁻¹ R_Fᵀ
//! ```
//! G_0: all interface nodes constrained. R: displacement of candidates per bubble amplitude. Σ:
//! stiffness of the bubbles on the elastic coarse part. A switch to another F needs one Cholesky of 3 n_f rows,
//! made over [`BUILD_STEPS`] steps, and is then blended in,
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

use bytemuck::cast_slice;
use contact::plane::Plane;
use glam::{DMat3, DVec3};

use super::ActiveContact;
use super::part::Bubbles;
use crate::free_nodes::{FreeNodes, Rule};
use operator::{FreeOperator, dot};

/// Steps in which every bubble is looked at once: at 1 kHz one picture of the display.
const SWEEP: usize = 16;

/// Steps over which the factor and the columns of a new free set are made.
const BUILD_STEPS: usize = 20;

/// Least work in a step of building, multiply-adds: a few microseconds.
const LEAST_WORK: usize = 20_000;

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
    /// Free nodes that memory is reserved for; the nearest are freed, the rest stays constrained.
    pub max_free: usize,
}

/// Free nodes at most: a factor of 1200 rows is 12 MB, and its columns fill the memory of a part
/// that is large already. The nearest are freed.
const MOST_FREE: usize = 400;

/// Rows and passes that a time budget is reckoned with.
const TYPICAL_ROWS: usize = 32;
const TYPICAL_PASSES: usize = 3;

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
    let pass = rows * rows / 2.0 + m * m * rows / 2.0 + 9.0 * m * rows;
    let build = (rows * rows * rows / 6.0 + 3.0 * m * rows * rows / 2.0) / BUILD_STEPS as f64;
    TYPICAL_PASSES as f64 * pass + build
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
    /// Bubbles that are free in either operator, and their amplitudes in the last state, m.
    terms: Vec<(u32, DVec3)>,
    /// By bubble: its place in `terms`, or `u32::MAX`.
    term_of: Vec<u32>,
    blend: f64,
    /// Full switches since the start.
    switched: f64,
    wanted: Vec<u32>,
    /// Candidates whose columns the next operator will need at once.
    needed: Vec<u32>,
    work_per_step: usize,
    /// By row of the LCP: L⁻¹ Rᵀ n of both operators, one after the other.
    seen: Vec<f64>,
}

impl Constrained {
    pub(super) fn new(
        data: BubbleData,
        settings: FreeSettings,
        n_candidates: usize,
        max_rows: usize,
    ) -> Self {
        let n_bubbles = data.positions.len();
        let max_free = settings.max_free.min(n_bubbles);
        let operator = || FreeOperator::new(n_candidates, n_bubbles, max_free);
        Self {
            free: FreeNodes::new(settings.rule, max_free, data.positions.clone(), SWEEP),
            stage: Stage::Steady,
            now: operator(),
            next: operator(),
            terms: Vec::with_capacity(n_bubbles),
            term_of: vec![u32::MAX; n_bubbles],
            blend: 0.0,
            switched: 0.0,
            wanted: Vec::with_capacity(n_bubbles),
            needed: Vec::with_capacity(n_candidates),
            work_per_step: LEAST_WORK,
            seen: vec![0.0; max_rows * 6 * max_free],
            data,
        }
    }

    /// Everything constrained, no switch under way.
    pub(super) fn reset(&mut self) {
        self.free.reset();
        self.stage = Stage::Steady;
        self.now.clear();
        self.next.clear();
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
    pub(super) fn set_blend(&mut self, blend: f64) {
        self.switched += (blend - self.blend).abs();
        self.blend = blend;
    }

    /// Ends a ramp whose blend is 1.
    pub(super) fn finish_ramp(&mut self) {
        std::mem::swap(&mut self.now, &mut self.next);
        self.blend = 0.0;
        self.stage = Stage::Steady;
    }

    /// The bubbles of the last state.
    pub(super) fn bubbles(&self) -> Bubbles<'_> {
        Bubbles {
            coupling: cast_slice::<f64, DMat3>(&self.data.coupling),
            n_bubbles: self.data.positions.len(),
            terms: &self.terms,
            switched: self.switched,
        }
    }

    /// One step of choosing and building. `contacts`: rest positions of what is (nearly) in contact;
    /// `near`: candidates that have a plane; `active`: forces of the last step.
    pub(super) fn advance(
        &mut self,
        contacts: &[DVec3],
        near: impl Iterator<Item = u32>,
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
                if self
                    .next
                    .build(&self.data, &self.needed, self.work_per_step)
                {
                    self.stage = Stage::Ramp;
                    self.blend = 0.0;
                }
            }
            Stage::Ramp => {}
        }
    }

    /// Begins a switch if the chosen set is another one than the operator's.
    fn begin_build(&mut self, near: impl Iterator<Item = u32>) {
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
        self.needed.extend(near);
        let kept = self.next.begin(&self.now, &self.wanted);
        debug_assert!(kept <= n_stay);
        let rows = 3 * self.wanted.len();
        let factor = (rows * rows * rows - (3 * kept).pow(3)) / 6;
        let columns = self.needed.len() * 3 * rows * rows / 2;
        self.work_per_step = ((factor + columns) / BUILD_STEPS).max(LEAST_WORK);
        self.stage = Stage::Build;
    }

    /// Makes what planes of these candidates need: columns of the operators, a few microseconds each
    /// for a candidate that was far until now.
    pub(super) fn ensure(&mut self, planes: &[Plane]) {
        for plane in planes {
            self.now.ensure(&self.data, plane.candidate);
            if self.stage == Stage::Ramp {
                self.next.ensure(&self.data, plane.candidate);
            }
        }
    }

    /// Adds the bubbles' share to the Delassus operator of the planes, m x m, both triangles.
    pub(super) fn add_to_delassus(&mut self, planes: &[Plane], w: &mut [f64]) {
        let m = planes.len();
        let (n_now, n_next) = (3 * self.now.n_free(), self.n_next());
        let stride = n_now + n_next;
        let (share_now, share_next) = ((1.0 - self.blend).sqrt(), self.blend.sqrt());
        for (plane, seen) in planes.iter().zip(self.seen.chunks_exact_mut(stride.max(1))) {
            let (of_now, of_next) = seen.split_at_mut(n_now);
            self.now
                .column_along(plane.candidate, share_now * plane.normal, of_now);
            if n_next > 0 {
                self.next
                    .column_along(plane.candidate, share_next * plane.normal, of_next);
            }
        }
        if stride == 0 {
            return;
        }
        for j in 0..m {
            let of_j = &self.seen[j * stride..][..stride];
            for i in 0..=j {
                let entry = w[j * m + i] + dot(&self.seen[i * stride..][..stride], of_j);
                w[j * m + i] = entry;
                w[i * m + j] = entry;
            }
        }
    }

    /// Rows of the next operator that count: none before its ramp.
    fn n_next(&self) -> usize {
        if self.stage == Stage::Ramp {
            3 * self.next.n_free()
        } else {
            0
        }
    }

    /// Amplitudes of the bubbles under these contacts. Every contact's candidate had a plane.
    pub(super) fn adopt_forces(&mut self, active: &[ActiveContact]) {
        for (bubble, _) in self.terms.drain(..) {
            self.term_of[bubble as usize] = u32::MAX;
        }
        if active.is_empty() {
            return;
        }
        let share = 1.0 - self.blend;
        let operators = [
            (share, &mut self.now, true),
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

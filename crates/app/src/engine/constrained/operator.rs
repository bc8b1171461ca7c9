//! One set of free bubbles: the Cholesky factor of its Σ, the columns L⁻¹ Rᵀ of candidates that were
//! near, and the blocks R Σ⁻¹ Rᵀ between them.

use glam::{DMat3, DVec3};

use super::super::pairs::Pairs;
use super::BubbleData;
use crate::engine::ActiveContact;

/// Σ_FF = L Lᵀ for the free bubbles F, appended row by row; memory for `max_free` of them.
#[derive(Debug)]
pub(super) struct FreeOperator {
    bubbles: Vec<u32>,
    is_in: Vec<bool>,
    /// The set that is being built; `bubbles` is its beginning.
    target: Vec<u32>,
    /// L by rows, each `stride` long.
    factor: Vec<f64>,
    stride: usize,
    /// By slot and axis: L⁻¹ R_Fᵀ e, `stride` long.
    columns: Vec<f64>,
    /// R_F Σ_FF⁻¹ R_Fᵀ between the candidates that have columns.
    pairs: Pairs,
    next_needed: usize,
    /// Σ_FF⁻¹ R_Fᵀ f of the last state, m.
    amplitude: Vec<f64>,
}

impl FreeOperator {
    /// `capacity`: candidates that can have columns.
    pub(super) fn new(
        n_candidates: usize,
        capacity: usize,
        n_bubbles: usize,
        max_free: usize,
    ) -> Self {
        let stride = 3 * max_free;
        Self {
            bubbles: Vec::with_capacity(max_free),
            is_in: vec![false; n_bubbles],
            target: Vec::with_capacity(max_free),
            factor: vec![0.0; stride * stride],
            stride,
            columns: vec![0.0; 3 * capacity * stride],
            pairs: Pairs::new(n_candidates, capacity),
            next_needed: 0,
            amplitude: vec![0.0; stride],
        }
    }

    pub(super) fn clear(&mut self) {
        for bubble in self.bubbles.drain(..) {
            self.is_in[bubble as usize] = false;
        }
        self.target.clear();
        self.pairs.clear();
        self.next_needed = 0;
    }

    pub(super) fn has_columns(&self, candidate: u32) -> bool {
        self.pairs.slot(candidate).is_some()
    }

    /// Candidates that can still have columns.
    pub(super) fn n_left(&self) -> usize {
        self.pairs.n_left()
    }

    /// Makes the next [`Self::build`] begin its list of candidates.
    pub(super) fn begin_columns(&mut self) {
        self.next_needed = 0;
    }

    /// Forgets the columns, not the factor.
    pub(super) fn clear_columns(&mut self) {
        self.pairs.clear();
    }

    /// R_F Σ_FF⁻¹ R_Fᵀ of two candidates that have columns.
    pub(super) fn block(&self, i: u32, j: u32) -> DMat3 {
        match (self.pairs.slot(i), self.pairs.slot(j)) {
            (Some(i), Some(j)) => *self.pairs.at(i, j),
            _ => DMat3::ZERO,
        }
    }

    pub(super) fn n_free(&self) -> usize {
        self.bubbles.len()
    }

    pub(super) fn bubbles(&self) -> &[u32] {
        &self.bubbles
    }

    pub(super) fn has(&self, bubble: u32) -> bool {
        self.is_in[bubble as usize]
    }

    /// Begins to build `target`; takes over the rows of `from` as far as the sets begin alike.
    /// Returns how many bubbles that is.
    pub(super) fn begin(&mut self, from: &Self, target: &[u32]) -> usize {
        self.clear();
        self.target.extend_from_slice(target);
        let alike = from.bubbles.iter().zip(target);
        let kept = alike.take_while(|(a, b)| a == b).count();
        for &bubble in &target[..kept] {
            self.bubbles.push(bubble);
            self.is_in[bubble as usize] = true;
        }
        for row in 0..3 * kept {
            let at = row * self.stride;
            self.factor[at..=at + row].copy_from_slice(&from.factor[at..=at + row]);
        }
        kept
    }

    /// Works for about `work` multiply-adds at the target's factor and the columns of `needed`;
    /// true once all is there.
    pub(super) fn build(&mut self, data: &BubbleData, needed: &[u32], work: usize) -> bool {
        let mut done = 0;
        while done < work {
            let rows = 3 * self.bubbles.len();
            if let Some(&bubble) = self.target.get(self.bubbles.len()) {
                self.append_rows(data, bubble);
                self.bubbles.push(bubble);
                self.is_in[bubble as usize] = true;
                done += 3 * rows * rows / 2 + 1;
            } else if let Some(&candidate) = needed.get(self.next_needed) {
                self.next_needed += 1;
                self.ensure(data, candidate);
                done += 3 * rows * rows / 2 + 1;
            } else {
                return true;
            }
        }
        false
    }

    /// The next three rows of L: L x = Σ[F, row], diagonal by what is left.
    fn append_rows(&mut self, data: &BubbleData, bubble: u32) {
        let n = 3 * data.positions.len();
        let first = 3 * self.bubbles.len();
        let (above, below) = self.factor.split_at_mut(first * self.stride);
        let mut rows = below.chunks_exact_mut(self.stride);
        let (Some(x), Some(y), Some(z)) = (rows.next(), rows.next(), rows.next()) else {
            return;
        };
        let mut rows = [x, y, z];
        for (axis, row) in rows.iter_mut().enumerate() {
            let column = &data.sigma[(3 * bubble as usize + axis) * n..][..n];
            for (k, &other) in self.bubbles.iter().chain([&bubble]).enumerate() {
                row[3 * k..3 * k + 3].copy_from_slice(&column[3 * other as usize..][..3]);
            }
        }
        let [x, y, z] = &mut rows;
        forward(
            above,
            self.stride,
            [&mut x[..first], &mut y[..first], &mut z[..first]],
        );
        // The last three columns, 3 x 3. Σ is positive definite; round-off may not leave that of a
        // bubble that follows others.
        for i in 0..3 {
            for j in 0..=i {
                let (of_i, of_j) = (&rows[i], &rows[j]);
                let left = of_i[first + j] - dot(&of_i[..first + j], &of_j[..first + j]);
                let entry = if i == j {
                    let own = 3 * bubble as usize + i;
                    left.max(f64::EPSILON * data.sigma[own * n + own]).sqrt()
                } else {
                    left / of_j[first + j]
                };
                rows[i][first + j] = entry;
            }
        }
    }

    /// Makes the columns of a candidate, and its blocks with those that have theirs.
    pub(super) fn ensure(&mut self, data: &BubbleData, candidate: u32) {
        if self.pairs.slot(candidate).is_some() {
            return;
        }
        let rows = 3 * self.bubbles.len();
        let n_bubbles = data.positions.len();
        let slot = self.pairs.known().len();
        let mut columns = self.columns[3 * slot * self.stride..].chunks_exact_mut(self.stride);
        let (Some(x), Some(y), Some(z)) = (columns.next(), columns.next(), columns.next()) else {
            return;
        };
        let mut columns = [&mut x[..rows], &mut y[..rows], &mut z[..rows]];
        for (axis, z) in columns.iter_mut().enumerate() {
            for (z, &bubble) in z.chunks_exact_mut(3).zip(&self.bubbles) {
                // Rᵀ e: row `axis` of R.
                let block =
                    &data.coupling[9 * (candidate as usize * n_bubbles + bubble as usize)..][..9];
                for (c, z) in z.iter_mut().enumerate() {
                    *z = block[3 * c + axis];
                }
            }
        }
        forward(&self.factor, self.stride, columns);
        let (columns, stride) = (&self.columns, self.stride);
        let column = |slot: usize, axis: usize| &columns[(3 * slot + axis) * stride..][..rows];
        self.pairs.push(candidate, |k, _| {
            DMat3::from_cols_array_2d(&std::array::from_fn(|c| {
                std::array::from_fn(|r| dot(column(k, r), column(slot, c)))
            }))
        });
    }

    /// Bubble amplitudes Σ_FF⁻¹ R_Fᵀ f.
    pub(super) fn solve(&mut self, data: &BubbleData, active: &[ActiveContact]) {
        let rows = 3 * self.bubbles.len();
        let n_bubbles = data.positions.len();
        let amplitude = &mut self.amplitude[..rows];
        amplitude.fill(0.0);
        for contact in active {
            let of_candidate = &data.coupling[9 * contact.candidate as usize * n_bubbles..];
            for (k, &bubble) in self.bubbles.iter().enumerate() {
                let block = DMat3::from_cols_slice(&of_candidate[9 * bubble as usize..][..9]);
                let load = block.transpose() * contact.force_on_part;
                for (sum, f) in amplitude[3 * k..3 * k + 3].iter_mut().zip(load.to_array()) {
                    *sum += f;
                }
            }
        }
        forward(&self.factor, self.stride, [amplitude]);
        // Lᵀ x = y from the last row on.
        for k in (0..rows).rev() {
            let row = &self.factor[k * self.stride..][..=k];
            let x = amplitude[k] / row[k];
            amplitude[k] = x;
            for (left, l) in amplitude[..k].iter_mut().zip(row) {
                *left -= x * l;
            }
        }
    }

    /// Amplitude of the k-th free bubble after [`Self::solve`], m.
    pub(super) fn amplitude(&self, k: usize) -> DVec3 {
        DVec3::from_slice(&self.amplitude[3 * k..3 * k + 3])
    }
}

/// L x = b in place, L by rows, for some right-hand sides at once: L is read once.
fn forward<const N: usize>(factor: &[f64], stride: usize, mut x: [&mut [f64]; N]) {
    let n = x.first().map_or(0, |x| x.len());
    for k in 0..n {
        let row = &factor[k * stride..][..=k];
        for x in &mut x {
            x[k] = (x[k] - dot(&row[..k], &x[..k])) / row[k];
        }
    }
}

/// Sum of products, in eight sums so that the compiler can keep them in one or two registers.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_parts, b_parts) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_parts
        .remainder()
        .iter()
        .zip(b_parts.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a_parts.zip(b_parts) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three bubbles, two candidates; Σ diagonally dominant, R arbitrary.
    fn data() -> BubbleData {
        let n = 9;
        let mut sigma = vec![0.0; n * n];
        for c in 0..n {
            for r in 0..n {
                let value = if r == c {
                    20.0 + c as f64
                } else {
                    1.0 / (1 + r + c) as f64
                };
                sigma[c * n + r] = value;
            }
        }
        BubbleData {
            positions: vec![DVec3::ZERO; 3],
            coupling: (0..54).map(|k| f64::from((k * 7) % 11) - 5.0).collect(),
            sigma,
            bounds: vec![1.0; 2],
        }
    }

    fn built(data: &BubbleData, from: &FreeOperator, target: &[u32], work: usize) -> FreeOperator {
        let mut operator = FreeOperator::new(2, 2, 3, 3);
        operator.begin(from, target);
        while !operator.build(data, &[0, 1], work) {}
        operator
    }

    /// Largest |Σ_FF x - R_Fᵀ f| of the operator's answer x.
    fn residual(data: &BubbleData, operator: &FreeOperator, active: &[ActiveContact]) -> f64 {
        let free = operator.bubbles();
        let mut worst = 0.0f64;
        for &row_bubble in free {
            for r in 0..3 {
                let mut left = 0.0;
                for (k, &bubble) in free.iter().enumerate() {
                    for (c, x) in operator.amplitude(k).to_array().into_iter().enumerate() {
                        left += data.sigma
                            [(3 * bubble as usize + c) * 9 + 3 * row_bubble as usize + r]
                            * x;
                    }
                }
                for contact in active {
                    let at = 9 * (contact.candidate as usize * 3 + row_bubble as usize);
                    let block = &data.coupling[at..at + 9];
                    for (axis, f) in contact.force_on_part.to_array().into_iter().enumerate() {
                        left -= block[3 * r + axis] * f;
                    }
                }
                worst = worst.max(left.abs());
            }
        }
        worst
    }

    #[test]
    fn bubble_amplitudes_are_those_of_the_inverse_for_any_order_of_building() {
        let data = data();
        let active: Vec<ActiveContact> = [(0, DVec3::new(1.0, -2.0, 0.5)), (1, DVec3::X)]
            .map(|(candidate, force_on_part)| ActiveContact {
                candidate,
                normal_force: 1.0,
                force_on_part,
            })
            .to_vec();
        let empty = FreeOperator::new(2, 2, 3, 3);
        let first = built(&data, &empty, &[2, 0], 1);
        for (from, target) in [
            (&empty, &[0u32, 1, 2][..]),
            (&first, &[2, 0, 1]),
            (&first, &[2]),
            (&first, &[0, 1]),
            (&first, &[]),
        ] {
            let mut operator = built(&data, from, target, 10_000);
            operator.solve(&data, &active);
            assert_eq!(operator.bubbles(), target);
            // Rᵀ of both candidates by the blocks, which are made by the columns.
            let share: DVec3 = active
                .iter()
                .map(|c| operator.block(0, c.candidate) * c.force_on_part)
                .sum();
            let by_amplitude: DVec3 = (0..target.len())
                .map(|k| {
                    let block = &data.coupling[9 * target[k] as usize..][..9];
                    DMat3::from_cols_slice(block) * operator.amplitude(k)
                })
                .sum();
            assert!((share - by_amplitude).length() < 1e-13, "{target:?}");
            let residual = residual(&data, &operator, &active);
            assert!(residual < 1e-13, "{target:?} {residual}");
        }
    }
}

//! Lemke's method with the lexicographic rule, for any M.
//!
//! Adds an artificial variable to all rows, `w = q + M z + d z_0`, which is large enough at first, and
//! pivots along the path on which w_i z_i = 0 until it has left the basis. Ends with a solution or on a ray. On a
//! ray the z-part of its direction is, for copositive-plus M, the proof that there is no solution.
//!
//! Source: Cottle, Pang, Stone (1992), section 4.4 (method) and 4.9 (lexicographic rule).

use super::{Problem, Scalar, Settings, dense};

/// Entries of the tableau for up to `capacity` rows: m x (m + 1) and its constant column.
pub(super) fn tableau_len(capacity: usize) -> usize {
    capacity * (capacity + 2)
}

/// Integers for up to `capacity` rows: variables of rows and columns, places of variables.
pub(super) fn n_integers(capacity: usize) -> usize {
    capacity + (capacity + 1) + (2 * capacity + 1)
}

/// How Lemke's method ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// z is a complementary solution.
    Complementary,
    /// z is the z-part of the direction of a ray.
    Ray,
    /// The budget ended; z is not a solution.
    Budget,
}

/// End and cost.
pub(super) struct Outcome {
    pub(super) end: End,
    pub(super) pivots: usize,
}

/// Memory: a tableau of [`tableau_len`], [`n_integers`], and m + 1 numbers.
pub(super) struct Memory<'a, T> {
    pub(super) tableau: &'a mut [T],
    pub(super) integers: &'a mut [u32],
    pub(super) scale: &'a mut [T],
}

/// Where the path starts: the weights d of the artificial variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weights {
    /// All rows alike.
    Even,
    /// Weights spread over three decades by the golden ratio. On matrices made to be exponential for even weights
    /// (Murty) the path is short.
    Spread,
}

/// Solves from the artificial start. Writes z.
pub(super) fn solve<T: Scalar>(
    problem: &Problem<T>,
    weights: Weights,
    max_pivots: usize,
    settings: &Settings,
    memory: Memory<T>,
    z: &mut [T],
) -> Outcome {
    let m = problem.m();
    let scale = memory.scale;
    column_scale_into(problem, scale);
    let mut tableau = Tableau::new(problem, weights, memory.tableau, memory.integers, scale);
    let outcome = tableau.run(max_pivots, settings);
    match outcome.end {
        End::Complementary => tableau.forces_into(z),
        End::Ray => tableau.ray_into(z),
        End::Budget => z.fill(T::zero()),
    }
    for (z, &scale) in z.iter_mut().zip(&scale[..m]) {
        *z *= scale;
    }
    outcome
}

/// Powers of two near 1/sqrt of the row's size: the tableau is D M D with entries about 1, without round-off.
fn column_scale_into<T: Scalar>(problem: &Problem<T>, scale: &mut [T]) {
    let m = problem.m();
    for (i, scale) in scale[..m].iter_mut().enumerate() {
        let mut size = problem.diagonal(i).wide().abs();
        if size == 0.0 {
            size = (0..m).fold(0.0, |max: f64, j| {
                max.max(problem.column(j)[i].wide().abs())
                    .max(problem.column(i)[j].wide().abs())
            });
        }
        let exponent = if size > 0.0 { -0.5 * size.log2() } else { 0.0 };
        // Within the range of T, with room for the products.
        let limit = -0.49 * T::min_positive_value().wide().log2();
        *scale = T::of(exponent.round().clamp(-limit, limit).floor().exp2());
    }
}

const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

/// Each basic variable as an affine function of the others: x_B = b + T x_N.
///
/// Variables: 0..m are w, m..2m are z, 2m is z_0.
struct Tableau<'a, T> {
    m: usize,
    /// T, column-major m x (m + 1).
    t: &'a mut [T],
    b: &'a mut [T],
    basic: &'a mut [u32],
    non_basic: &'a mut [u32],
    /// Row of a basic variable, m + column of another.
    place: &'a mut [u32],
}

impl<'a, T: Scalar> Tableau<'a, T> {
    fn new(
        problem: &Problem<T>,
        weights: Weights,
        memory: &'a mut [T],
        integers: &'a mut [u32],
        scale: &[T],
    ) -> Self {
        let m = problem.m();
        let (t, b) = memory.split_at_mut(m * (m + 1));
        let (basic, rest) = integers.split_at_mut(m);
        let (non_basic, place) = rest.split_at_mut(m + 1);
        let tableau = Self {
            m,
            t,
            b: &mut b[..m],
            basic,
            non_basic,
            place: &mut place[..2 * m + 1],
        };
        for j in 0..m {
            for (i, &entry) in problem.column(j).iter().enumerate() {
                tableau.t[j * m + i] = scale[i] * entry * scale[j];
            }
            tableau.non_basic[j] = (m + j) as u32;
            tableau.place[m + j] = (m + j) as u32;
            tableau.basic[j] = j as u32;
            tableau.place[j] = j as u32;
            tableau.b[j] = scale[j] * problem.q()[j];
        }
        // Weights as large as q, so that z_0 starts at about 1 and tolerances stay simple.
        let size = dense::max_abs(tableau.b);
        let size = if size > T::zero() { size } else { T::one() };
        for i in 0..m {
            let spread = match weights {
                Weights::Even => 1.0,
                Weights::Spread => (10.0 * (GOLDEN_RATIO * (i + 1) as f64).fract()).exp2(),
            };
            tableau.t[m * m + i] = size * T::of(spread);
        }
        tableau.non_basic[m] = (2 * m) as u32;
        tableau.place[2 * m] = (2 * m) as u32;
        tableau
    }

    fn run(&mut self, max_pivots: usize, settings: &Settings) -> Outcome {
        let m = self.m;
        let artificial = (2 * m) as u32;
        // The most negative row makes room for z_0.
        let Some(mut row) = self.leaving_row(m, true) else {
            return Outcome {
                end: End::Complementary,
                pivots: 0,
            };
        };
        let mut column = m;
        for pivots in 1..=max_pivots {
            if settings.is_over() {
                return Outcome {
                    end: End::Budget,
                    pivots: pivots - 1,
                };
            }
            let leaving = self.basic[row];
            self.exchange(row, column);
            if leaving == artificial {
                return Outcome {
                    end: End::Complementary,
                    pivots,
                };
            }
            // The complement of what left enters.
            let entering = (leaving + m as u32) % (2 * m as u32);
            column = self.place[entering as usize] as usize - m;
            match self.leaving_row(column, false) {
                Some(next) => row = next,
                None => {
                    // The column is kept in front for `ray_into`.
                    self.place[artificial as usize] = column as u32;
                    return Outcome {
                        end: End::Ray,
                        pivots,
                    };
                }
            }
        }
        Outcome {
            end: End::Budget,
            pivots: max_pivots,
        }
    }

    /// The row that reaches zero first when the variable of `column` grows, lexicographically least of equals; for the
    /// first pivot the row that is most negative.
    fn leaving_row(&self, column: usize, is_first: bool) -> Option<usize> {
        let m = self.m;
        let entries = &self.t[column * m..(column + 1) * m];
        let largest = dense::max_abs(entries).wide();
        let threshold = T::TABLEAU_ZERO * largest.max(f64::MIN_POSITIVE);
        let round_off = 16.0 * T::epsilon().wide() * dense::max_abs(self.b).wide();
        let mut least: Option<(usize, f64)> = None;
        for (row, (b, t)) in self.b.iter().zip(entries).enumerate() {
            let (b, t) = (b.wide(), t.wide());
            let ratio = if is_first {
                if b >= 0.0 {
                    continue;
                }
                b / t
            } else {
                if t >= -threshold {
                    continue;
                }
                b.max(0.0) / -t
            };
            let is_less = match least {
                None => true,
                Some((other, other_ratio)) => {
                    // A constant that should be zero is round-off of the largest one.
                    let other_weight = entries[other].wide().abs();
                    let noise = round_off * (1.0 / t.abs() + 1.0 / other_weight);
                    let equal = T::TABLEAU_EQUAL * ratio.abs().max(other_ratio.abs());
                    let equal = equal.max(noise) + f64::MIN_POSITIVE;
                    if (ratio - other_ratio).abs() > equal {
                        ratio < other_ratio
                    } else {
                        self.is_lexicographically_less(row, other, column)
                    }
                }
            };
            if is_less {
                least = Some((row, ratio));
            }
        }
        least.map(|(row, _)| row)
    }

    /// Compares the ratios of two rows for q + (ε, ε², ...): what breaks ties consistently, so nothing cycles.
    fn is_lexicographically_less(&self, row: usize, other: usize, column: usize) -> bool {
        let m = self.m;
        let artificial = (2 * m) as u32;
        // The artificial variable leaves as soon as it can: that ends the path.
        if self.basic[row] == artificial || self.basic[other] == artificial {
            return self.basic[row] == artificial;
        }
        let weight = self.t[column * m + row].wide().abs();
        let other_weight = self.t[column * m + other].wide().abs();
        for w in 0..m {
            let a = self.perturbation(row, w) / weight;
            let b = self.perturbation(other, w) / other_weight;
            if (a - b).abs() > T::TOLERANCE * a.abs().max(b.abs()) {
                return a < b;
            }
        }
        false
    }

    /// How basic variable `row` changes with q_w.
    fn perturbation(&self, row: usize, w: usize) -> f64 {
        let place = self.place[w] as usize;
        if place < self.m {
            if place == row { 1.0 } else { 0.0 }
        } else {
            -self.t[(place - self.m) * self.m + row].wide()
        }
    }

    /// The variables of `row` and `column` change places.
    fn exchange(&mut self, row: usize, column: usize) {
        let m = self.m;
        let pivot = self.t[column * m + row];
        // The old column stays where it is while all others are updated with it.
        for other in 0..=m {
            if other == column {
                continue;
            }
            let factor = -self.t[other * m + row] / pivot;
            if factor != T::zero() {
                let (source, target) = two_columns(self.t, m, column, other);
                dense::add_scaled(target, factor, source);
            }
            self.t[other * m + row] = factor;
        }
        let step = -self.b[row] / pivot;
        let entries = &mut self.t[column * m..(column + 1) * m];
        dense::add_scaled(self.b, step, entries);
        self.b[row] = step;
        for entry in entries.iter_mut() {
            *entry /= pivot;
        }
        entries[row] = T::one() / pivot;
        std::mem::swap(&mut self.basic[row], &mut self.non_basic[column]);
        self.place[self.basic[row] as usize] = row as u32;
        self.place[self.non_basic[column] as usize] = (m + column) as u32;
    }

    fn forces_into(&self, z: &mut [T]) {
        for (i, z) in z.iter_mut().enumerate() {
            let place = self.place[self.m + i] as usize;
            *z = if place < self.m {
                num_traits::Float::max(self.b[place], T::zero())
            } else {
                T::zero()
            };
        }
    }

    fn ray_into(&self, z: &mut [T]) {
        let column = self.place[2 * self.m] as usize;
        for (i, z) in z.iter_mut().enumerate() {
            let place = self.place[self.m + i] as usize;
            *z = if place < self.m {
                num_traits::Float::max(self.t[column * self.m + place], T::zero())
            } else if place - self.m == column {
                T::one()
            } else {
                T::zero()
            };
        }
    }
}

fn two_columns<T>(t: &mut [T], m: usize, source: usize, target: usize) -> (&[T], &mut [T]) {
    if source < target {
        let (left, right) = t.split_at_mut(target * m);
        (&left[source * m..(source + 1) * m], &mut right[..m])
    } else {
        let (left, right) = t.split_at_mut(source * m);
        (&right[..m], &mut left[target * m..(target + 1) * m])
    }
}

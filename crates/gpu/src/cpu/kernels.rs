//! The sums of the product, written so that they wait for nothing but memory.
//!
//! Every displacement is formed by the same operations in the same order, whatever the stretch of rows, the number
//! of sets, the thread or the width of the vectors: the bits are the same. No multiply and add are fused, because not
//! every processor can.

use std::ops::Range;

use super::Stored;
use crate::layout::Layout;

/// Candidates whose columns are added in one pass over the sums: 6 columns.
///
/// Measured on AMD Zen 5 with the look ahead, matrix beyond the cache: 3, 6 and 12 columns reach some 75, 87 and 66 % of
/// the read bandwidth in 32 bits, 82, 89 and 89 % in 64 bits. Fewer load and store the sums more often, more
/// need more vectors than the processor has names for.
const CANDIDATES: usize = 2;

/// Of each column read between two looks ahead, bytes: 2 lines of the cache. 4 lose some per cent, 8 a quarter.
const BLOCK: usize = 128;

/// Distance in bytes to what is asked from memory. The sums fill the processor's window of instructions before
/// enough loads are under way, and its own prediction begins anew in each page and column; without this a third of the
/// bandwidth is lost in 32 bits. 1 KB and 4 KB are slower by a tenth.
const AHEAD: usize = 2048;

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// Numbers of a column that are widened to 64 bits at once and then added to each set. 128 is slower by a third.
const SET_BLOCK: usize = 64;

/// Sets of forces for which a number is read once. Measured: 16 gain a tenth to a third over 8, and those over 4.
pub(super) const SETS: usize = 16;

/// Numbers of each set whose sums stay in the cache beside each other (16 sets: 128 KB).
const SET_TILE: usize = 1024;

/// The vectors of this processor.
#[derive(Debug, Clone, Copy)]
pub(super) enum Vectors {
    /// 256 bits. AVX-512 gained nothing beyond the cache.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    /// What the program was compiled for, without a look ahead.
    Compiled,
}

impl Vectors {
    /// The widest that this processor has.
    pub(super) fn of_this_processor() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(v3) = pulp::x86::V3::try_new() {
            return Self::Avx2(v3);
        }
        Self::Compiled
    }
}

/// Runs with the vectors that the program was compiled for.
fn run_compiled(op: impl pulp::WithSimd<Output = ()>) {
    // Elsewhere than on x86-64 these are the widest.
    #[cfg(target_arch = "x86_64")]
    pulp::Simd::vectorize(pulp::Scalar::new(), op);
    #[cfg(not(target_arch = "x86_64"))]
    pulp::Arch::new().dispatch(op);
}

/// The stored compliance with forces at some candidates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Product<'a, T> {
    pub(super) layout: Layout,
    /// Columns of all candidates.
    pub(super) compliance: &'a [T],
    /// A stored number times this is in m/N.
    pub(super) unit: f64,
    /// Candidates that carry force.
    pub(super) columns: &'a [u32],
    /// 3 for each of them; where there are several sets, one after the other.
    pub(super) forces: &'a [f64],
}

impl<T: Stored> Product<'_, T> {
    /// Displacement of a stretch of rows, from number `first` of the columns on.
    pub(super) fn stretch_into(self, vectors: Vectors, first: usize, displacement: &mut [f64]) {
        let product = self;
        match vectors {
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2(v3) => pulp::Simd::vectorize(
                v3,
                Stretch {
                    product,
                    first,
                    displacement,
                    ahead: v3,
                },
            ),
            Vectors::Compiled => run_compiled(Stretch {
                product,
                first,
                displacement,
                ahead: NotAhead,
            }),
        }
    }

    /// Displacements of all rows under [`SETS`] or fewer sets of forces, one after the other.
    pub(super) fn sets_into(self, vectors: Vectors, displacements: &mut [f64]) {
        let product = self;
        match vectors {
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2(v3) => pulp::Simd::vectorize(
                v3,
                Sets {
                    product,
                    displacements,
                    ahead: v3,
                },
            ),
            Vectors::Compiled => run_compiled(Sets {
                product,
                displacements,
                ahead: NotAhead,
            }),
        }
    }

    // From here on everything is inlined into the function that is compiled for the wider vectors; what is not
    // would be compiled for the narrow ones.

    #[inline(always)]
    fn sum_stretch(&self, ahead: impl Ahead, first: usize, sums: &mut [f64]) {
        sums.fill(0.0);
        let n = sums.len();
        for (group, at) in self
            .columns
            .chunks(CANDIDATES)
            .zip((0..).step_by(CANDIDATES))
        {
            let (next, n_next) = self.starts_after(at, first);
            let next = &next[..n_next];
            match *group {
                [a, b] => {
                    let starts = self.starts([a, b], first);
                    let f = self.forces_of::<6>(3 * at);
                    self.add_columns(ahead, starts, next, f, &mut sums[..n]);
                }
                [a] => {
                    let [x, y, z, ..] = self.starts([a, a], first);
                    let f = self.forces_of::<3>(3 * at);
                    self.add_columns(ahead, [x, y, z], next, f, &mut sums[..n]);
                }
                _ => {}
            }
        }
    }

    /// sums += Σ columns f, where the columns of the stretch begin at `starts` and those to be read next at `next`.
    #[inline(always)]
    fn add_columns<const N: usize>(
        &self,
        ahead: impl Ahead,
        starts: [usize; N],
        next: &[usize],
        f: [f64; N],
        sums: &mut [f64],
    ) {
        let n = sums.len();
        let block = BLOCK / size_of::<T>();
        let whole = n - n % block;
        let mut at = 0;
        while at < whole {
            self.look_ahead::<N>(ahead, &starts, next, at, n, block);
            let columns = self.columns_from(starts, at..at + block);
            add(&mut sums[at..at + block], columns, f);
            at += block;
        }
        add(&mut sums[whole..], self.columns_from(starts, whole..n), f);
    }

    #[inline(always)]
    fn sum_sets<S: pulp::Simd>(&self, simd: S, ahead: impl Ahead, displacements: &mut [f64]) {
        displacements.fill(0.0);
        let n = self.layout.displacement_len();
        for first in (0..n).step_by(SET_TILE) {
            let mut tiles: [&mut [f64]; SETS] = Default::default();
            let n_sets = displacements.len() / n;
            for (tile, u) in tiles.iter_mut().zip(displacements.chunks_exact_mut(n)) {
                *tile = &mut u[first..n.min(first + SET_TILE)];
            }
            let tiles = &mut tiles[..n_sets];
            for (group, at) in self
                .columns
                .chunks(CANDIDATES)
                .zip((0..).step_by(CANDIDATES))
            {
                let (next, n_next) = self.starts_after(at, first);
                let next = &next[..n_next];
                match *group {
                    [a, b] => {
                        let starts = self.starts([a, b], first);
                        self.add_to_sets(simd, ahead, starts, next, at, tiles);
                    }
                    [a] => {
                        let [x, y, z, ..] = self.starts([a, a], first);
                        self.add_to_sets(simd, ahead, [x, y, z], next, at, tiles);
                    }
                    _ => {}
                }
            }
        }
    }

    /// As [`add_columns`](Self::add_columns), to the same rows of each set; `listed`: place of the first candidate in
    /// the list.
    #[inline(always)]
    fn add_to_sets<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        ahead: impl Ahead,
        starts: [usize; N],
        next: &[usize],
        listed: usize,
        tiles: &mut [&mut [f64]],
    ) {
        let n = tiles[0].len();
        let per_set = 3 * self.columns.len();
        let mut f = [[0.0; N]; SETS];
        let mut f_all = [[simd.splat_f64s(0.0); N]; SETS];
        for set in 0..tiles.len() {
            f[set] = self.forces_of::<N>(set * per_set + 3 * listed);
            for k in 0..N {
                f_all[set][k] = simd.splat_f64s(f[set][k]);
            }
        }
        let mut wide = [[0.0; SET_BLOCK]; N];
        for at in (0..n).step_by(SET_BLOCK) {
            let len = SET_BLOCK.min(n - at);
            self.look_ahead::<N>(ahead, &starts, next, at, n, SET_BLOCK);
            let stored = self.columns_from(starts, at..at + len);
            for (wide, stored) in wide.iter_mut().zip(stored) {
                for (wide, stored) in wide.iter_mut().zip(stored) {
                    *wide = stored.to_f64();
                }
            }
            if len == SET_BLOCK {
                add_block_to_sets(simd, tiles, at, &wide, &f_all);
            } else {
                let mut columns = [&[][..]; N];
                for (column, wide) in columns.iter_mut().zip(&wide) {
                    *column = &wide[..len];
                }
                for (tile, f) in tiles.iter_mut().zip(f) {
                    add(&mut tile[at..], columns, f);
                }
            }
        }
    }

    /// Asks memory for what will be read [`AHEAD`] bytes later, in these columns or in the next.
    #[inline(always)]
    fn look_ahead<const N: usize>(
        &self,
        ahead: impl Ahead,
        starts: &[usize; N],
        next: &[usize],
        at: usize,
        n: usize,
        block: usize,
    ) {
        let line = LINE / size_of::<T>();
        let then = at + AHEAD / size_of::<T>();
        if then < n {
            for start in starts {
                for k in (0..block).step_by(line) {
                    ahead.fetch(self.compliance, start + then + k);
                }
            }
        } else {
            for start in next {
                for k in (0..block).step_by(line) {
                    ahead.fetch(self.compliance, start + then - n + k);
                }
            }
        }
    }

    /// Some numbers of each column.
    // Written as a loop here and below: `map` of an array is not always inlined.
    #[inline(always)]
    fn columns_from<const N: usize>(&self, starts: [usize; N], range: Range<usize>) -> [&[T]; N] {
        let mut columns = [&self.compliance[..0]; N];
        for (column, start) in columns.iter_mut().zip(starts) {
            *column = &self.compliance[start + range.start..start + range.end];
        }
        columns
    }

    /// Where the columns of two candidates begin.
    #[inline(always)]
    fn starts(&self, [a, b]: [u32; 2], first: usize) -> [usize; 6] {
        let start =
            |candidate: u32, axis| self.layout.column(candidate as usize, axis).start + first;
        [
            start(a, 0),
            start(a, 1),
            start(a, 2),
            start(b, 0),
            start(b, 1),
            start(b, 2),
        ]
    }

    /// Where the columns begin that follow those at place `at` of the list, and how many there are.
    #[inline(always)]
    fn starts_after(&self, at: usize, first: usize) -> ([usize; 6], usize) {
        match self.columns.get(at + CANDIDATES..) {
            Some(&[a, b, ..]) => (self.starts([a, b], first), 6),
            Some(&[a]) => (self.starts([a, a], first), 3),
            _ => ([0; 6], 0),
        }
    }

    /// Forces from place `at` on, so that stored numbers times these are displacements in m.
    #[inline(always)]
    fn forces_of<const N: usize>(&self, at: usize) -> [f64; N] {
        let mut f = [0.0; N];
        for (f, force) in f.iter_mut().zip(&self.forces[at..at + N]) {
            *f = force * self.unit;
        }
        f
    }
}

/// sums += Σ columns f, element by element. All slices have the length of `sums`.
#[inline(always)]
fn add<T: Stored, const N: usize>(sums: &mut [f64], columns: [&[T]; N], f: [f64; N]) {
    // Equal lengths known to the compiler: no bounds check is left in the loop and it vectorises.
    let n = sums.len();
    let mut columns = columns;
    for column in &mut columns {
        *column = &column[..n];
    }
    for i in 0..n {
        let mut sum = columns[0][i].to_f64() * f[0];
        for k in 1..N {
            sum += columns[k][i].to_f64() * f[k];
        }
        sums[i] += sum;
    }
}

/// The same for a block of each set, two vectors at a time: a column stays in its vector through all sets, and a force
/// serves both. `N` is 6 at the most, so that the columns fit the 16 vectors of AVX2.
#[inline(always)]
fn add_block_to_sets<S: pulp::Simd, const N: usize>(
    simd: S,
    tiles: &mut [&mut [f64]],
    at: usize,
    columns: &[[f64; SET_BLOCK]; N],
    f: &[[S::f64s; N]; SETS],
) {
    for pair in 0..SET_BLOCK / S::F64_LANES / 2 {
        let start = 2 * pair * S::F64_LANES;
        let zero = simd.splat_f64s(0.0);
        let (mut first, mut second) = ([zero; N], [zero; N]);
        for k in 0..N {
            let (column, _) = S::as_simd_f64s(&columns[k][start..start + 2 * S::F64_LANES]);
            (first[k], second[k]) = (column[0], column[1]);
        }
        let from = at + start;
        for (tile, f) in tiles.iter_mut().zip(f) {
            let mut sums = [
                simd.mul_f64s(first[0], f[0]),
                simd.mul_f64s(second[0], f[0]),
            ];
            for k in 1..N {
                sums[0] = simd.add_f64s(sums[0], simd.mul_f64s(first[k], f[k]));
                sums[1] = simd.add_f64s(sums[1], simd.mul_f64s(second[k], f[k]));
            }
            let (u, _) = S::as_mut_simd_f64s(&mut tile[from..from + 2 * S::F64_LANES]);
            u[0] = simd.add_f64s(u[0], sums[0]);
            u[1] = simd.add_f64s(u[1], sums[1]);
        }
    }
}

/// A way to ask for memory before it is read.
trait Ahead: Copy {
    /// `at` may lie beyond the end: nothing is read then.
    fn fetch<T>(self, numbers: &[T], at: usize);
}

#[derive(Clone, Copy)]
struct NotAhead;

impl Ahead for NotAhead {
    #[inline(always)]
    fn fetch<T>(self, _: &[T], _: usize) {}
}

#[cfg(target_arch = "x86_64")]
impl Ahead for pulp::x86::V3 {
    #[inline(always)]
    fn fetch<T>(self, numbers: &[T], at: usize) {
        // A hint that cannot fault. Each number is used once, so it need not stay in the cache.
        let place = numbers.as_ptr().wrapping_add(at).cast();
        self.sse
            ._mm_prefetch::<{ std::arch::x86_64::_MM_HINT_NTA }>(place);
    }
}

struct Stretch<'a, T, A> {
    product: Product<'a, T>,
    first: usize,
    displacement: &'a mut [f64],
    ahead: A,
}

impl<T: Stored, A: Ahead> pulp::WithSimd for Stretch<'_, T, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.product
            .sum_stretch(self.ahead, self.first, self.displacement);
    }
}

struct Sets<'a, T, A> {
    product: Product<'a, T>,
    displacements: &'a mut [f64],
    ahead: A,
}

impl<T: Stored, A: Ahead> pulp::WithSimd for Sets<'_, T, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        self.product.sum_sets(simd, self.ahead, self.displacements);
    }
}

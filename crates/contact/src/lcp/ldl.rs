//! L D Lᵀ of the active rows of a symmetric M, kept up to date while rows come and go.
//!
//! Rows that come are appended, k of them for O(k n²); rows that go are taken out by rank-k updates, for
//! O(k n²) as well (Gill, Golub, Murray and Saunders 1974). The heavy work is faer's; a few rows are
//! done here, where a call would cost more than the work.

use std::mem::MaybeUninit;

use faer::diag::DiagRef;
use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::ldlt;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::{Accum, MatMut, Par, Spec};

use super::{Problem, dense};

/// E / diag(M), added before factorising an active block that is singular to round-off: a thousand times the
/// round-off of a factorisation of a few hundred rows, so that rank-deficient active sets stay
/// solvable; small enough that one proximal step removes it up to condition 1e8.
const REGULARISATION: f64 = 1e-12;

/// A pivot below this times M_ii has lost its digits to the rows before it: the block is treated as singular.
const SINGULAR: f64 = 1e-9;

/// A pivot below minus this times M_ii is no round-off, so M is indefinite.
const INDEFINITE: f64 = 1e-8;

/// Fewer new rows than this are appended one by one.
const BLOCK_ROWS: usize = 16;

/// More rows than this are not taken out of a factor: what follows the first of them is made anew.
const MAX_REMOVED: usize = 32;

/// The active block has no inverse: M is not what the method needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Singular;

/// What is known about the factor in the memory beside it. Lives as long as the scratch.
#[derive(Debug, Clone)]
pub(super) struct LdlState {
    /// Rows of M in the order of the factor.
    rows: Vec<u32>,
    is_in: Vec<bool>,
    removed: Vec<usize>,
    work: Vec<f64>,
    stack: Vec<MaybeUninit<u8>>,
    /// Rows of the problem the factor belongs to.
    m: usize,
    is_regularised: bool,
}

/// Entries of memory for up to `capacity` rows.
pub(super) fn memory_len(capacity: usize) -> usize {
    capacity * leading_dimension(capacity)
}

/// Columns start 64 bytes apart from a multiple of 4096, so that they do not fall into the same lines of the cache.
fn leading_dimension(m: usize) -> usize {
    m.next_multiple_of(8) + 8
}

impl LdlState {
    pub(super) fn new(capacity: usize) -> Self {
        let factor =
            ldlt::factor::cholesky_in_place_scratch::<f64>(capacity, Par::Seq, Spec::default());
        let n_removed = MAX_REMOVED.min(capacity);
        let update = ldlt::update::delete_rows_and_cols_clobber_scratch::<f64>(capacity, n_removed);
        Self {
            rows: Vec::with_capacity(capacity),
            is_in: Vec::with_capacity(capacity),
            removed: Vec::with_capacity(capacity),
            work: vec![0.0; capacity],
            stack: vec![MaybeUninit::uninit(); factor.or(update).unaligned_bytes_required()],
            m: 0,
            is_regularised: false,
        }
    }

    /// Whether a factor of a problem of m rows is there.
    pub(super) fn holds(&self, m: usize) -> bool {
        self.m == m && m > 0
    }

    /// The memory beside it goes to somebody else.
    pub(super) fn forget(&mut self) {
        self.m = 0;
    }
}

/// `M_FF = L D Lᵀ`, or `M_FF + E` with E = [`REGULARISATION`] diag(M) once a pivot shows that M_FF is singular to
/// round-off.
///
/// No square roots: rows and columns scaled by powers of two give the same bits.
pub(super) struct Ldl<'a> {
    /// Column-major: L below the diagonal, D on it, work above.
    memory: &'a mut [f64],
    state: &'a mut LdlState,
    ld: usize,
}

impl<'a> Ldl<'a> {
    /// Without rows.
    pub(super) fn new(memory: &'a mut [f64], state: &'a mut LdlState, m: usize) -> Self {
        let mut ldl = Self::kept(memory, state, m);
        ldl.restart(m);
        ldl
    }

    /// Takes out all rows, for a problem of m rows, and E with them.
    pub(super) fn restart(&mut self, m: usize) {
        let state = &mut *self.state;
        state.m = m;
        state.is_in.clear();
        state.is_in.resize(m, false);
        state.rows.clear();
        state.is_regularised = false;
    }

    /// With the factor that is there, see [`LdlState::holds`].
    pub(super) fn kept(memory: &'a mut [f64], state: &'a mut LdlState, m: usize) -> Self {
        Self {
            memory,
            state,
            ld: leading_dimension(m),
        }
    }

    /// E / diag(M), added before factorising.
    pub(super) fn regularisation(&self) -> f64 {
        if self.state.is_regularised {
            REGULARISATION
        } else {
            0.0
        }
    }

    /// The rows of the factor, in its order.
    pub(super) fn rows(&self) -> &[u32] {
        &self.state.rows
    }

    /// Makes it the factor of the active rows.
    pub(super) fn update(&mut self, problem: &Problem, is_active: &[bool]) -> Result<(), Singular> {
        self.remove(is_active);
        let outcome = self.append(problem, is_active);
        if outcome.is_err() {
            self.state.forget();
        }
        outcome
    }

    /// x ← (M_FF + E)⁻¹ x, in the order of [`Ldl::rows`].
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        let (ld, n) = (self.ld, self.state.rows.len());
        dense::solve_unit_lower(self.memory, ld, n, x);
        for (p, x) in x.iter_mut().enumerate() {
            *x /= self.memory[p * ld + p];
        }
        dense::solve_unit_lower_transposed(self.memory, ld, n, x);
    }

    /// Takes out the rows that are not active any more.
    fn remove(&mut self, is_active: &[bool]) {
        let state = &mut *self.state;
        let n = state.rows.len();
        state.removed.clear();
        for (position, &row) in state.rows.iter().enumerate() {
            if !is_active[row as usize] {
                state.removed.push(position);
                state.is_in[row as usize] = false;
            }
        }
        let Some(&first) = state.removed.first() else {
            return;
        };
        let (n_removed, n_behind) = (state.removed.len(), n - first);
        if n < BLOCK_ROWS || n_removed > MAX_REMOVED || 4 * n_removed > n_behind {
            for &row in &state.rows[first..] {
                state.is_in[row as usize] = false;
            }
            state.rows.truncate(first);
            return;
        }
        let factor = MatMut::from_column_major_slice_with_stride_mut(self.memory, n, n, self.ld);
        ldlt::update::delete_rows_and_cols_clobber(
            factor,
            &mut state.removed,
            Par::Seq,
            MemStack::new(&mut state.stack),
        );
        state.rows.retain(|&row| is_active[row as usize]);
    }

    /// Appends the active rows that are not in yet.
    fn append(&mut self, problem: &Problem, is_active: &[bool]) -> Result<(), Singular> {
        let n = self.state.rows.len();
        for (row, &is_active) in is_active.iter().enumerate() {
            if is_active && !self.state.is_in[row] {
                self.state.rows.push(row as u32);
                self.state.is_in[row] = true;
            }
        }
        let n_all = self.state.rows.len();
        if !self.state.is_regularised {
            if n_all - n < BLOCK_ROWS {
                if (n..n_all).all(|position| self.push(problem, position).is_ok()) {
                    return Ok(());
                }
            } else if self.append_block(problem, n).is_ok() {
                return Ok(());
            }
            // All anew, with E.
            self.state.is_regularised = true;
            return (0..n_all).try_for_each(|position| self.push(problem, position));
        }
        (n..n_all).try_for_each(|position| self.push(problem, position))
    }

    /// Appends one row behind `n` others.
    fn push(&mut self, problem: &Problem, n: usize) -> Result<(), Singular> {
        let ld = self.ld;
        let state = &mut *self.state;
        let factor = &mut *self.memory;
        let work = &mut state.work[..n];
        let row = state.rows[n] as usize;
        let column = problem.column(row);
        for (work, &other) in work.iter_mut().zip(&state.rows) {
            *work = column[other as usize];
        }
        // The new row of L D, then of L, and what remains on the diagonal.
        dense::solve_unit_lower(factor, ld, n, work);
        let diagonal = column[row];
        let mut removed = 0.0;
        for (p, &x) in work.iter().enumerate() {
            let l = x / factor[p * ld + p];
            factor[p * ld + n] = l;
            removed += l * x;
        }
        let mut pivot = diagonal - removed;
        if state.is_regularised {
            let regularisation = REGULARISATION * diagonal;
            pivot += regularisation;
            if pivot.is_nan() || pivot <= -INDEFINITE * diagonal {
                return Err(Singular);
            }
            // A row that depends on the others leaves round-off of either sign.
            pivot = pivot.max(regularisation);
        } else if !has_digits(pivot, diagonal) {
            return Err(Singular);
        }
        factor[n * ld + n] = pivot;
        Ok(())
    }

    /// Appends all rows behind the first `n` at once.
    fn append_block(&mut self, problem: &Problem, n: usize) -> Result<(), Singular> {
        let ld = self.ld;
        let state = &mut *self.state;
        let n_all = state.rows.len();
        // The new columns: above the diagonal block the rows of the factor, in it its lower half.
        for (position, &row) in state.rows.iter().enumerate().skip(n) {
            let source = problem.column(row as usize);
            let target = &mut self.memory[position * ld..position * ld + n_all];
            for (target, &other) in target[..n].iter_mut().zip(&state.rows) {
                *target = source[other as usize];
            }
            let below = target[position..].iter_mut().zip(&state.rows[position..]);
            for (target, &other) in below {
                *target = source[other as usize];
            }
        }
        let all = MatMut::from_column_major_slice_with_stride_mut(self.memory, n_all, n_all, ld);
        let (top_left, mut top_right, mut bottom_left, mut bottom_right) = all.split_at_mut(n, n);
        if n > 0 {
            // L X = M_12 gives X = D L_21ᵀ.
            let factor = top_left.as_ref();
            solve_unit_lower_triangular_in_place(factor, top_right.as_mut(), Par::Seq);
            let pivots: DiagRef<f64> = factor.diagonal();
            for p in 0..n {
                let pivot = pivots[p];
                for j in 0..n_all - n {
                    bottom_left[(j, p)] = top_right[(p, j)] / pivot;
                }
            }
            triangular::matmul(
                bottom_right.as_mut(),
                BlockStructure::TriangularLower,
                Accum::Add,
                bottom_left.as_ref(),
                BlockStructure::Rectangular,
                top_right.as_ref(),
                BlockStructure::Rectangular,
                -1.0,
                Par::Seq,
            );
        }
        ldlt::factor::cholesky_in_place(
            bottom_right,
            ldlt::factor::LdltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut state.stack),
            Spec::default(),
        )
        .map_err(|_| Singular)?;
        let keep_digits =
            state.rows.iter().enumerate().skip(n).all(|(p, &row)| {
                has_digits(self.memory[p * ld + p], problem.diagonal(row as usize))
            });
        if keep_digits { Ok(()) } else { Err(Singular) }
    }
}

/// Whether a pivot is more than what round-off left of the diagonal entry. False for NaN.
fn has_digits(pivot: f64, diagonal: f64) -> bool {
    pivot > SINGULAR * diagonal
}

//! What the step needs of a prepared part: candidates at rest and the compliance between them.

use std::sync::atomic::{AtomicUsize, Ordering};

use contact::delassus::ComplianceBlocks;
use glam::{DMat3, DVec3};
use once_cell::race::OnceBox;

use super::ActiveContact;
use super::constrained::Constrained;
use super::pairs::Pairs;
use crate::stored::{Blocks, Source};

/// Candidate nodes and the compliance of the part as the step reads it.
#[derive(Debug)]
pub struct ContactPart {
    rest: Vec<DVec3>,
    columns: Columns,
}

/// Which columns of the compliance are there.
#[derive(Debug)]
enum Columns {
    /// All: block of row i and candidate j at `j stride + i`.
    All {
        blocks: Blocks,
        stride: usize,
        bounds: Vec<Bounds>,
    },
    /// By candidate those that were fetched; written once each, by another thread if need be, and read without
    /// waiting.
    Fetched {
        columns: Box<[OnceBox<Column>]>,
        n_fetched: AtomicUsize,
        capacity: usize,
    },
}

/// One candidate's column: displacement of every row per unit force on it.
#[derive(Debug)]
struct Column {
    blocks: Blocks,
    bounds: Bounds,
}

/// Largest Frobenius norms of the 3x3 blocks in a candidate's column, m/N.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    /// Of all candidates.
    any: f64,
    /// Of all but the candidate itself.
    other: f64,
}

impl Bounds {
    /// Of candidate `own`, whose column's blocks of the candidates are these.
    fn new(own: usize, blocks: impl Iterator<Item = DMat3>) -> Self {
        let (mut other, mut of_itself) = (0.0_f64, 0.0);
        for (i, block) in blocks.enumerate() {
            let norm = norm_squared(&block);
            if i == own {
                of_itself = norm;
            } else {
                other = other.max(norm);
            }
        }
        Self {
            any: other.max(of_itself).sqrt(),
            other: other.sqrt(),
        }
    }
}

impl ContactPart {
    /// `rest`: rest positions of the candidates, m. `blocks`: 3x3 blocks of C, column-major
    /// inside, block of row i and candidate j at `j * n_rows + i`; the first rows are the
    /// candidates themselves, in the same order.
    ///
    /// # Panics
    /// If the lengths do not fit together (a programmer's mistake).
    pub fn new(rest: Vec<DVec3>, n_rows: usize, blocks: Vec<f64>) -> Self {
        Self::with_all(rest, n_rows, Blocks::F64(Source::Owned(blocks)))
    }

    /// As [`Self::new`] for a compliance that is kept elsewhere or in 32 bits.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn with_all(rest: Vec<DVec3>, n_rows: usize, blocks: Blocks) -> Self {
        assert_eq!(
            blocks.len(),
            n_rows * rest.len(),
            "compliance blocks do not fit the candidates"
        );
        assert!(n_rows >= rest.len(), "the candidates are the first rows");
        let column = |j: usize| (j * n_rows..j * n_rows + rest.len()).map(|k| blocks.get(k));
        let bounds = (0..rest.len()).map(|j| Bounds::new(j, column(j))).collect();
        Self {
            columns: Columns::All {
                blocks,
                stride: n_rows,
                bounds,
            },
            rest,
        }
    }

    /// A part whose columns come one by one, [`Self::insert`], `capacity` of them at most. A candidate without a column
    /// cannot be touched: the step leaves it out and says so.
    pub fn with_fetched(rest: Vec<DVec3>, capacity: usize) -> Self {
        Self {
            columns: Columns::Fetched {
                columns: rest.iter().map(|_| OnceBox::new()).collect(),
                n_fetched: AtomicUsize::new(0),
                capacity,
            },
            rest,
        }
    }

    /// Gives a candidate its column: blocks of every row, the candidates first. From any thread, while steps are made;
    /// the step sees it at once. False if there is no room or it is there already.
    ///
    /// # Panics
    /// If the column is shorter than the candidates, or the part was made with all of them (a programmer's mistake).
    pub fn insert(&self, candidate: u32, blocks: Blocks) -> bool {
        let Columns::Fetched {
            columns,
            n_fetched,
            capacity,
        } = &self.columns
        else {
            panic!("this part has all its columns");
        };
        assert!(blocks.len() >= self.rest.len(), "a column has every row");
        if n_fetched.fetch_add(1, Ordering::Relaxed) >= *capacity {
            n_fetched.fetch_sub(1, Ordering::Relaxed);
            return false;
        }
        let own = candidate as usize;
        let bounds = Bounds::new(own, (0..self.rest.len()).map(|i| blocks.get(i)));
        let column = Box::new(Column { blocks, bounds });
        let is_new = columns[own].set(column).is_ok();
        if !is_new {
            n_fetched.fetch_sub(1, Ordering::Relaxed);
        }
        is_new
    }

    /// Whether the candidate can be touched.
    #[inline]
    pub fn has_column(&self, candidate: u32) -> bool {
        match &self.columns {
            Columns::All { .. } => true,
            Columns::Fetched { columns, .. } => columns[candidate as usize].get().is_some(),
        }
    }

    /// Number of columns that are there.
    pub fn n_columns(&self) -> usize {
        match &self.columns {
            Columns::All { .. } => self.rest.len(),
            Columns::Fetched { n_fetched, .. } => n_fetched.load(Ordering::Relaxed),
        }
    }

    /// Whether columns come one by one.
    pub fn is_fetched(&self) -> bool {
        matches!(self.columns, Columns::Fetched { .. })
    }

    /// Takes other bounds on the norms of the blocks, m/N by candidate: those of a compliance that
    /// this one is only a share of.
    pub(super) fn bounded_by(mut self, others: &[f64]) -> Self {
        assert_eq!(
            others.len(),
            self.rest.len(),
            "one bound for each candidate"
        );
        if let Columns::All { bounds, .. } = &mut self.columns {
            for (bounds, &other) in bounds.iter_mut().zip(others) {
                (bounds.any, bounds.other) = (other, other);
            }
        }
        self
    }

    /// Number of candidate nodes.
    pub fn n_candidates(&self) -> usize {
        self.rest.len()
    }

    /// Rest positions of the candidates, m, part frame.
    pub fn rest_positions(&self) -> &[DVec3] {
        &self.rest
    }

    /// Displacement of candidate `i` under the given contact forces, m: sum of C_ij f_j.
    #[inline]
    pub fn displacement(&self, i: usize, active: &[ActiveContact]) -> DVec3 {
        // C_ij is C_jiᵀ: one column is read, not one place in each of many.
        let terms = || {
            active
                .iter()
                .map(|c| (c.candidate as usize, c.force_on_part))
        };
        match &self.columns {
            Columns::All { blocks, stride, .. } => blocks.sum_transposed(i * stride, terms()),
            Columns::Fetched { columns, .. } => match columns[i].get() {
                Some(column) => column.blocks.sum_transposed(0, terms()),
                None => self.row_displacement(i, active),
            },
        }
    }

    /// Displacement of row `i`, which need not be a candidate's, from the columns of those that carry force, m.
    pub fn row_displacement(&self, i: usize, active: &[ActiveContact]) -> DVec3 {
        active
            .iter()
            .map(|c| self.at(i, c.candidate as usize) * c.force_on_part)
            .sum()
    }

    /// C of row i and candidate j; zero without the column.
    #[inline]
    fn at(&self, i: usize, j: usize) -> DMat3 {
        match &self.columns {
            Columns::All { blocks, stride, .. } => blocks.get(j * stride + i),
            Columns::Fetched { columns, .. } => columns[j]
                .get()
                .map_or(DMat3::ZERO, |column| column.blocks.get(i)),
        }
    }

    fn bounds(&self, candidate: u32) -> Bounds {
        match &self.columns {
            Columns::All { bounds, .. } => bounds[candidate as usize],
            Columns::Fetched { columns, .. } => {
                let column = columns[candidate as usize].get();
                // Without a column it carries no force.
                column.map_or(
                    Bounds {
                        any: 0.0,
                        other: 0.0,
                    },
                    |column| column.bounds,
                )
            }
        }
    }

    /// Largest Frobenius norm of a 3x3 block of a candidate's column, m/N: no candidate moves by
    /// more than this times the force on it.
    pub(super) fn largest_block(&self, candidate: u32) -> f64 {
        self.bounds(candidate).any
    }

    /// As [`Self::largest_block`], for all candidates but this one.
    pub(super) fn largest_other(&self, candidate: u32) -> f64 {
        self.bounds(candidate).other
    }

    /// Upper bound on the displacement of any candidate, m.
    pub fn displacement_bound(&self, active: &[ActiveContact]) -> f64 {
        active
            .iter()
            .map(|c| self.largest_block(c.candidate) * c.normal_force.abs())
            .sum()
    }
}

/// The part under contact forces: what every stage asks for displacements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deformed<'a> {
    pub(super) part: &'a ContactPart,
    pub(super) active: &'a [ActiveContact],
    /// Where interface nodes are constrained, `part` is the coarse one.
    pub(super) constrained: Option<&'a Constrained>,
    /// Blocks that lie side by side; of the part alone, not used where it is constrained.
    pub(super) pairs: &'a Pairs,
}

impl Deformed<'_> {
    /// Displacement of candidate `i`, m.
    #[inline]
    pub(super) fn displacement(&self, i: usize) -> DVec3 {
        match self.constrained {
            None => {
                let kept = self.pairs.slot(i as u32);
                kept.and_then(|slot| self.pairs.displacement(slot, self.active))
                    .unwrap_or_else(|| self.part.displacement(i, self.active))
            }
            Some(constrained) => constrained.displacement(i, self.part, self.active),
        }
    }

    /// Upper bound on the displacement of any candidate, m.
    pub(super) fn displacement_bound(&self) -> f64 {
        self.part.displacement_bound(self.active)
    }

    /// Full switches of the compliance since the start, each no more than all of it.
    pub(super) fn switched(&self) -> f64 {
        self.constrained.map_or(0.0, Constrained::switched)
    }
}

impl ComplianceBlocks for ContactPart {
    #[inline]
    fn block(&self, row: usize, col: usize) -> DMat3 {
        self.at(row, col)
    }
}

fn norm_squared(c: &DMat3) -> f64 {
    c.to_cols_array().iter().map(|x| x * x).sum()
}

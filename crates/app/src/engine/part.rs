//! What the step needs of a prepared part: candidates at rest and the compliance between them.
//!
//! Candidates that are held in all directions come last. They have no column: forces on them move nothing, and nothing
//! moves them, but the tool meets them all the same.

use std::sync::Arc;

use contact::delassus::ComplianceBlocks;
use glam::{DMat3, DVec3};

use super::ActiveContact;
use super::clusters::Clusters;
use super::fetched::{FetchedColumns, norm_squared};
use super::pairs::Pairs;
use crate::stored::{Blocks, Source};

/// Candidate nodes and the compliance of the part as the step reads it.
#[derive(Debug)]
pub struct ContactPart {
    rest: Vec<DVec3>,
    /// Candidates with columns; those after them never move.
    n_compliant: usize,
    columns: Columns,
    clusters: Clusters,
}

/// Which columns of the compliance are there.
#[derive(Debug)]
enum Columns {
    All {
        /// Of row i and candidate j at `j stride + i`.
        blocks: Blocks,
        stride: usize,
        /// m/N, by candidate j: bound on the norm of C_ij for all candidates i.
        largest: Vec<f64>,
    },
    Fetched {
        columns: Arc<FetchedColumns>,
        /// By candidate: its column is there and counted in the clusters' norms.
        is_taken_in: Vec<bool>,
        /// Columns that are.
        n_taken_in: usize,
    },
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
        Self::with_all_and_held(rest, &[], n_rows, blocks)
    }

    /// As [`Self::with_all`], with further candidates at `held` (m) that never move; they have no columns, and come
    /// after the others.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn with_all_and_held(
        mut rest: Vec<DVec3>,
        held: &[DVec3],
        n_rows: usize,
        blocks: Blocks,
    ) -> Self {
        assert_eq!(
            blocks.len(),
            n_rows * rest.len(),
            "compliance blocks do not fit the candidates"
        );
        assert!(n_rows >= rest.len(), "the candidates are the first rows");
        let n_compliant = rest.len();
        let column = |j: usize| (j * n_rows..j * n_rows + n_compliant).map(|k| blocks.get(k));
        let largest = (0..n_compliant)
            .map(|j| column(j).map(|c| norm_squared(&c)).fold(0.0, f64::max))
            .map(f64::sqrt)
            .collect();
        rest.extend_from_slice(held);
        let mut clusters = Clusters::new(&rest);
        clusters.add_all(|i, j| {
            if i.max(j) < n_compliant {
                blocks.get(j * n_rows + i)
            } else {
                DMat3::ZERO
            }
        });
        Self {
            columns: Columns::All {
                blocks,
                stride: n_rows,
                largest,
            },
            clusters,
            rest,
            n_compliant,
        }
    }

    /// A part whose columns come one by one, [`Self::insert`], `capacity` of them at most. A candidate without a column
    /// cannot be touched: the step leaves it out and says so.
    pub fn with_fetched(rest: Vec<DVec3>, capacity: usize) -> Self {
        Self::with_fetched_and_held(rest, &[], capacity)
    }

    /// As [`Self::with_fetched`], with further candidates at `held` (m) that never move and need no column.
    pub fn with_fetched_and_held(mut rest: Vec<DVec3>, held: &[DVec3], capacity: usize) -> Self {
        let n_compliant = rest.len();
        rest.extend_from_slice(held);
        let clusters = Clusters::new(&rest);
        let columns = FetchedColumns::new(n_compliant, &clusters, capacity);
        Self::of_fetched(rest, n_compliant, clusters, Arc::new(columns))
    }

    fn of_fetched(
        rest: Vec<DVec3>,
        n_compliant: usize,
        clusters: Clusters,
        columns: Arc<FetchedColumns>,
    ) -> Self {
        Self {
            columns: Columns::Fetched {
                columns,
                is_taken_in: vec![false; n_compliant],
                n_taken_in: 0,
            },
            clusters,
            rest,
            n_compliant,
        }
    }

    /// Where columns come one by one: the same columns, with a reckoning of their own of those that were taken in.
    pub(super) fn view(&self) -> Option<Self> {
        let Columns::Fetched { columns, .. } = &self.columns else {
            return None;
        };
        let clusters = Clusters::new(&self.rest);
        let columns = Arc::clone(columns);
        let rest = self.rest.clone();
        Some(Self::of_fetched(rest, self.n_compliant, clusters, columns))
    }

    /// Gives a candidate its column: blocks of every row, the candidates first. From any thread, while steps are made;
    /// the next step sees it. False if there is no room or it is there already.
    ///
    /// # Panics
    /// If the column is shorter than the candidates, or the part was made with all of them (a programmer's mistake).
    pub fn insert(&self, candidate: u32, blocks: Blocks) -> bool {
        let Columns::Fetched { columns, .. } = &self.columns else {
            panic!("this part has all its columns");
        };
        assert!(blocks.len() >= self.n_compliant, "a column has every row");
        columns.insert(&self.clusters, candidate, blocks)
    }

    /// Takes in the columns that have come: once in a step, so that all of it sees the same. Does not allocate.
    pub(super) fn take_in(&mut self) {
        if let Columns::Fetched {
            columns,
            is_taken_in,
            n_taken_in,
        } = &mut self.columns
        {
            let n_arrived = columns.n_arrived();
            for candidate in (*n_taken_in..n_arrived).map(|k| columns.arrived(k)) {
                if let Some(column) = columns.get(candidate as usize) {
                    self.clusters.raise(candidate, &column.norms);
                    is_taken_in[candidate as usize] = true;
                }
            }
            *n_taken_in = n_arrived;
        }
    }

    /// Whether the candidate's column is there, or it needs none.
    pub fn has_column(&self, candidate: u32) -> bool {
        match &self.columns {
            Columns::Fetched { columns, .. } if !self.is_held(candidate) => {
                columns.get(candidate as usize).is_some()
            }
            _ => true,
        }
    }

    /// Whether the candidate never moves.
    #[inline]
    pub fn is_held(&self, candidate: u32) -> bool {
        candidate as usize >= self.n_compliant
    }

    /// Number of candidates that may move; those after them are held.
    pub fn n_compliant(&self) -> usize {
        self.n_compliant
    }

    /// Whether the candidate can be touched in this step.
    #[inline]
    pub(super) fn is_taken_in(&self, candidate: u32) -> bool {
        match &self.columns {
            Columns::Fetched { is_taken_in, .. } if !self.is_held(candidate) => {
                is_taken_in[candidate as usize]
            }
            _ => true,
        }
    }

    /// Number of columns that are there.
    pub fn n_columns(&self) -> usize {
        match &self.columns {
            Columns::All { .. } => self.n_compliant,
            Columns::Fetched { columns, .. } => columns.n_arrived(),
        }
    }

    /// Whether columns come one by one.
    pub fn is_fetched(&self) -> bool {
        matches!(self.columns, Columns::Fetched { .. })
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
        if i >= self.n_compliant {
            return DVec3::ZERO;
        }
        // C_ij is C_jiᵀ: one column is read, not one place in each of many.
        let terms = || {
            let moving = active.iter().filter(|c| !self.is_held(c.candidate));
            moving.map(|c| (c.candidate as usize, c.force_on_part))
        };
        match &self.columns {
            Columns::All { blocks, stride, .. } => blocks.sum_transposed(i * stride, terms()),
            Columns::Fetched { columns, .. } => match columns.get(i) {
                Some(column) => column.blocks.sum_transposed(0, terms()),
                None => self.row_displacement(i, active),
            },
        }
    }

    /// Displacement of row `i`, which need not be a candidate's, from the columns of those that carry force, m.
    pub fn row_displacement(&self, i: usize, active: &[ActiveContact]) -> DVec3 {
        let moving = active.iter().filter(|c| !self.is_held(c.candidate));
        moving
            .map(|c| self.at(i, c.candidate as usize) * c.force_on_part)
            .sum()
    }

    /// C of row i, which need not be a candidate's, and candidate j that may move; zero without the column.
    #[inline]
    fn at(&self, i: usize, j: usize) -> DMat3 {
        match &self.columns {
            Columns::All { blocks, stride, .. } => blocks.get(j * stride + i),
            Columns::Fetched { columns, .. } => columns
                .get(j)
                .map_or(DMat3::ZERO, |column| column.blocks.get(i)),
        }
    }

    /// Largest Frobenius norm of a 3x3 block of a candidate's column, m/N: no candidate moves by
    /// more than this times the force on it.
    pub(super) fn largest_block(&self, candidate: u32) -> f64 {
        if self.is_held(candidate) {
            return 0.0;
        }
        match &self.columns {
            Columns::All { largest, .. } => largest[candidate as usize],
            // Without a column it carries no force.
            Columns::Fetched { columns, .. } => columns
                .get(candidate as usize)
                .map_or(0.0, |column| column.largest),
        }
    }

    /// The candidates in clusters of neighbours.
    pub(super) fn clusters(&self) -> &Clusters {
        &self.clusters
    }

    /// Upper bound on the displacement of any candidate, m.
    pub fn displacement_bound(&self, active: &[ActiveContact]) -> f64 {
        active
            .iter()
            .map(|c| self.largest_block(c.candidate) * c.force_on_part.length())
            .sum()
    }
}

/// The part under contact forces: what every stage asks for displacements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deformed<'a> {
    pub(super) part: &'a ContactPart,
    pub(super) active: &'a [ActiveContact],
    /// Blocks that lie side by side.
    pub(super) pairs: &'a Pairs,
}

impl Deformed<'_> {
    /// Displacement of candidate `i`, m.
    #[inline]
    pub(super) fn displacement(&self, i: usize) -> DVec3 {
        let kept = self.pairs.slot(i as u32);
        kept.and_then(|slot| self.pairs.displacement(slot, self.active))
            .unwrap_or_else(|| self.part.displacement(i, self.active))
    }

    /// Upper bound on the displacement of any candidate, m.
    pub(super) fn displacement_bound(&self) -> f64 {
        self.part.displacement_bound(self.active)
    }
}

impl ComplianceBlocks for ContactPart {
    #[inline]
    fn block(&self, row: usize, col: usize) -> DMat3 {
        if row.max(col) >= self.n_compliant {
            return DMat3::ZERO;
        }
        self.at(row, col)
    }
}

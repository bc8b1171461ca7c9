//! The free part of a stiffness, with the order in which its unknowns are to be eliminated.

use faer::Side;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use rayon::prelude::*;

use crate::Error;
use crate::assembly::Stiffness;
use crate::factor::FactoredStiffness;
use crate::ordering::{BALANCES, Graph};
use crate::progress::Progress;
use crate::supports::Supports;

/// Degree of freedom that is held.
pub(crate) const HELD: u32 = u32::MAX;

/// s K_ff of the free degrees of freedom f, and what its factor will look like.
#[derive(Debug)]
pub struct OrderedStiffness {
    pub(crate) symbolic: SymbolicCholesky<u32>,
    pub(crate) lower: SparseColMat<u32, f64>,
    pub(crate) free_of_dof: Vec<u32>,
    pub(crate) dof_of_free: Vec<u32>,
    pub(crate) scale: f64,
}

impl OrderedStiffness {
    /// Leaves out the held degrees of freedom (and nodes of no element) and orders the others by
    /// minimum degree or by nested dissection, whichever leaves fewer entries in the factor.
    ///
    /// # Errors
    /// [`Error::TooLarge`], [`Error::Cancelled`].
    pub fn new(
        stiffness: &Stiffness,
        supports: &Supports,
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        progress.advance("order the unknowns", 0, 1);
        let n = stiffness.n_dofs();
        let mut free_of_dof = vec![HELD; n];
        let mut dof_of_free = Vec::new();
        for dof in 0..n {
            let has_stiffness = stiffness.column(dof).any(|(i, v)| i == dof && v != 0.0);
            if !supports.is_fixed(dof) && has_stiffness {
                free_of_dof[dof] = dof_of_free.len() as u32;
                dof_of_free.push(dof as u32);
            }
        }
        let scale = power_of_two_scale(stiffness, &dof_of_free);
        let lower = lower_triangle(stiffness, &free_of_dof, &dof_of_free, scale);
        let symbolic = order(stiffness, &lower, &free_of_dof, &dof_of_free)?;
        if progress.is_cancelled() {
            return Err(Error::Cancelled);
        }
        Ok(Self {
            symbolic,
            lower,
            free_of_dof,
            dof_of_free,
            scale,
        })
    }

    /// Entries that L will have.
    pub fn n_factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Factors.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`], [`Error::TooLarge`], [`Error::Cancelled`].
    pub fn factor(self, progress: &dyn Progress) -> Result<FactoredStiffness, Error> {
        FactoredStiffness::of(self, progress)
    }
}

/// Symbolic factor by the order that leaves the fewest entries.
fn order(
    stiffness: &Stiffness,
    lower: &SparseColMat<u32, f64>,
    free_of_dof: &[u32],
    dof_of_free: &[u32],
) -> Result<SymbolicCholesky<u32>, Error> {
    let (graph, nodes) = node_graph(stiffness, free_of_dof);
    let balances = [None].into_iter().chain(BALANCES.map(Some));
    let tried: Vec<Result<_, Error>> = balances
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|balance| {
            let order = match balance {
                None => graph.minimum_degree()?,
                Some(balance) => graph.dissection(balance)?,
            };
            let forward: Vec<u32> = order
                .into_iter()
                .map(|vertex| 3 * nodes[vertex as usize] as usize)
                .flat_map(|dof| dof..dof + 3)
                .map(|dof| free_of_dof[dof])
                .filter(|&free| free != HELD)
                .collect();
            let mut inverse = vec![0; dof_of_free.len()];
            for (position, &free) in forward.iter().enumerate() {
                inverse[free as usize] = position as u32;
            }
            let params = CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            };
            factorize_symbolic_cholesky(
                lower.symbolic(),
                Side::Lower,
                SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, forward.len())),
                params,
            )
            .map_err(|e| Error::TooLarge(format!("{e:?}")))
        })
        .collect();
    let mut best: Option<SymbolicCholesky<u32>> = None;
    for symbolic in tried {
        let symbolic = symbolic?;
        if best
            .as_ref()
            .is_none_or(|b| symbolic.len_val() < b.len_val())
        {
            best = Some(symbolic);
        }
    }
    best.ok_or_else(|| Error::TooLarge("no order of the unknowns".to_owned()))
}

/// Graph of the nodes that have a free degree of freedom, and their numbers.
fn node_graph(stiffness: &Stiffness, free_of_dof: &[u32]) -> (Graph, Vec<u32>) {
    let is_free = |dof: &usize| free_of_dof[*dof] != HELD;
    let n_nodes = free_of_dof.len() / 3;
    let mut vertex_of_node = vec![HELD; n_nodes];
    let mut nodes = Vec::new();
    for node in 0..n_nodes {
        if (3 * node..3 * node + 3).any(|dof| is_free(&dof)) {
            vertex_of_node[node] = nodes.len() as u32;
            nodes.push(node as u32);
        }
    }
    let lists: Vec<Vec<u32>> = nodes
        .par_iter()
        .map(|&node| {
            let dofs = 3 * node as usize..3 * node as usize + 3;
            let mut list: Vec<u32> = dofs
                .filter(is_free)
                .flat_map(|dof| stiffness.column(dof))
                .filter(|(i, _)| is_free(i) && i / 3 != node as usize)
                .map(|(i, _)| vertex_of_node[i / 3])
                .collect();
            list.sort_unstable();
            list.dedup();
            list
        })
        .collect();
    (Graph::new(lists), nodes)
}

/// Power of two that brings the largest diagonal entry of the free part between 1 and 2.
fn power_of_two_scale(stiffness: &Stiffness, dof_of_free: &[u32]) -> f64 {
    let diagonal = dof_of_free.iter().flat_map(|&dof| {
        stiffness
            .column(dof as usize)
            .filter(move |(i, _)| *i == dof as usize)
            .map(|(_, v)| v)
    });
    let largest = diagonal.fold(0.0, f64::max);
    if largest.is_normal() {
        // The exponent's bits alone are the power of two below.
        1.0 / f64::from_bits(largest.to_bits() & (0x7ff << 52))
    } else {
        1.0
    }
}

fn lower_triangle(
    stiffness: &Stiffness,
    free_of_dof: &[u32],
    dof_of_free: &[u32],
    scale: f64,
) -> SparseColMat<u32, f64> {
    let n = dof_of_free.len();
    let mut starts = vec![0u32];
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for (j, &dof) in dof_of_free.iter().enumerate() {
        for (i, v) in stiffness.column(dof as usize) {
            let free = free_of_dof[i];
            if free != HELD && free as usize >= j {
                rows.push(free);
                values.push(scale * v);
            }
        }
        starts.push(rows.len() as u32);
    }
    SparseColMat::new(
        SymbolicSparseColMat::new_checked(n, n, starts, None, rows),
        values,
    )
}

//! The same columns by faer's sparse Cholesky as its documentation uses it.

use std::time::Instant;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LltRef, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};
use fem::{Stiffness, Supports};
use rayon::prelude::*;

/// Degree of freedom that is held.
const HELD: u32 = u32::MAX;

/// Nodes of a panel, three columns each.
const PANEL: usize = 32;

pub(crate) struct Plain {
    pub(crate) entries: usize,
    /// Order and factor; columns.
    pub(crate) seconds: [f64; 2],
    /// As `fem::Compliance::blocks`.
    pub(crate) blocks: Vec<f64>,
}

pub(crate) fn solve(
    stiffness: &Stiffness,
    supports: &Supports,
    candidates: &[u32],
    rows: &[u32],
) -> Plain {
    let (matrix, free) = free_part(stiffness, supports);
    let n = matrix.ncols();
    let begun = Instant::now();
    let order = SymmetricOrdering::Amd;
    let symbolic =
        factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, order, Default::default())
            .unwrap();
    let mut values = vec![0.0; symbolic.len_val()];
    let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
    symbolic
        .factorize_numeric_llt::<f64>(
            &mut values,
            matrix.as_ref(),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        )
        .unwrap();
    let factored = begun.elapsed().as_secs_f64();

    let begun = Instant::now();
    let places: Vec<[u32; 3]> = rows
        .iter()
        .map(|&node| std::array::from_fn(|c| free[3 * node as usize + c]))
        .collect();
    let column = 9 * rows.len();
    let mut blocks = vec![0.0; column * candidates.len()];
    let panels = blocks.par_chunks_mut(column * PANEL);
    panels
        .zip(places[..candidates.len()].par_chunks(PANEL))
        .for_each(|(blocks, nodes)| {
            let width = 3 * nodes.len();
            let mut panel = vec![0.0; n * width];
            for (j, &place) in nodes.as_flattened().iter().enumerate() {
                if place != HELD {
                    panel[j * n + place as usize] = 1.0;
                }
            }
            let mut memory =
                MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(width, Par::Seq));
            LltRef::<u32, f64>::new(&symbolic, &values).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(&mut panel, n, width),
                Par::Seq,
                MemStack::new(&mut memory),
            );
            for (j, blocks) in blocks.chunks_exact_mut(column).enumerate() {
                for (block, places) in blocks.chunks_exact_mut(9).zip(&places) {
                    for c in 0..3 {
                        for (r, &place) in places.iter().enumerate().filter(|(_, p)| **p != HELD) {
                            block[3 * c + r] = panel[(3 * j + c) * n + place as usize];
                        }
                    }
                }
            }
        });
    Plain {
        entries: symbolic.len_val(),
        seconds: [factored, begun.elapsed().as_secs_f64()],
        blocks,
    }
}

/// Lower triangle of the free part, and the place of each degree of freedom in it.
fn free_part(stiffness: &Stiffness, supports: &Supports) -> (SparseColMat<u32, f64>, Vec<u32>) {
    let k = stiffness.matrix();
    let mut free = vec![HELD; k.ncols()];
    let dofs: Vec<usize> = supports.free_dofs().collect();
    for (place, &dof) in dofs.iter().enumerate() {
        free[dof] = place as u32;
    }
    let (mut starts, mut rows, mut values) = (vec![0], vec![], vec![]);
    for (j, &dof) in dofs.iter().enumerate() {
        let range = k.symbolic().col_range(dof);
        let of_column = &k.symbolic().row_idx()[range.clone()];
        for (&i, &value) in of_column.iter().zip(&k.val()[range]) {
            let row = free[i as usize];
            if row != HELD && row as usize >= j {
                rows.push(row);
                values.push(value);
            }
        }
        starts.push(rows.len() as u32);
    }
    let n = dofs.len();
    let symbolic = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
    (SparseColMat::new(symbolic, values), free)
}

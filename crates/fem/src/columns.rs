//! Chosen columns of the inverse of a factored stiffness, at chosen rows only.
//!
//! ```text
//! K = L Lᵀ, unknowns in the order of elimination, supernodes a tree with the last one at its root
//!
//!            root            forward:   L y = e_j    only on the way from j to the root
//!           /    \           backward:  Lᵀ x = y     only towards wanted rows
//!         a        b         symmetry:  of x_i(j) = x_j(i) the one is solved for whose
//!        / \      / \                   row is not before its column
//!       .   .    .   .
//! ```
//!
//! Columns are solved in panels of neighbours in the order of elimination, which share most of
//! their way. A panel is stored by rows, so that the rows which a supernode touches are gathered
//! and scattered as whole stretches of memory. Each panel is independent of all others and of the
//! number of threads.
//!
//! Sparse right-hand sides: Gilbert and Peierls 1988; only some entries of an inverse: Amestoy et
//! al. 2012 (SIAM J. Sci. Comput. 34(4)).

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::{Accum, MatMut, MatRef, Par};

/// No supernode: a root's parent.
const NONE: u32 = u32::MAX;

/// The tree of supernodes of a factor.
#[derive(Debug)]
pub(crate) struct SupernodeTree {
    parent: Vec<u32>,
    of_position: Vec<u32>,
    /// Most rows below the diagonal of a supernode.
    largest_pattern: usize,
}

impl SupernodeTree {
    pub(crate) fn new(llt: SupernodalLltRef<'_, u32, f64>) -> Self {
        let symbolic = llt.symbolic();
        let mut of_position = vec![0; symbolic.nrows()];
        let ends = symbolic.supernode_end();
        for (s, (&start, &end)) in symbolic.supernode_begin().iter().zip(ends).enumerate() {
            of_position[start as usize..end as usize].fill(s as u32);
        }
        let patterns = (0..symbolic.n_supernodes()).map(|s| symbolic.supernode(s).pattern());
        // The first row below a supernode is in its parent.
        let parent = patterns
            .clone()
            .map(|p| {
                p.iter()
                    .min()
                    .map_or(NONE, |&row| of_position[row as usize])
            })
            .collect();
        Self {
            parent,
            of_position,
            largest_pattern: patterns.map(<[u32]>::len).max().unwrap_or(0),
        }
    }

    pub(crate) fn n_supernodes(&self) -> usize {
        self.parent.len()
    }

    /// Supernode of a position in the order of elimination.
    pub(crate) fn of_position(&self, position: usize) -> usize {
        self.of_position[position] as usize
    }

    /// Marks all ancestors of what is marked.
    pub(crate) fn close_upwards(&self, marked: &mut [bool]) {
        for s in 0..marked.len() {
            if marked[s] && self.parent[s] != NONE {
                marked[self.parent[s] as usize] = true;
            }
        }
    }
}

/// Some right-hand sides, by rows: entry of position `i` and column `j` at `i width + j`.
#[derive(Debug)]
pub(crate) struct Panel {
    pub(crate) x: Vec<f64>,
    width: usize,
    gathered: Vec<f64>,
}

impl Panel {
    pub(crate) fn new(tree: &SupernodeTree, width: usize) -> Self {
        Self {
            x: vec![0.0; tree.of_position.len() * width],
            width,
            gathered: vec![0.0; tree.largest_pattern * width],
        }
    }

    /// Columns.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Zeroes the rows of a supernode.
    pub(crate) fn clear(&mut self, llt: SupernodalLltRef<'_, u32, f64>, s: usize) {
        let (begin, end) = range(llt, s);
        self.x[begin * self.width..end * self.width].fill(0.0);
    }

    /// One supernode of L y = b: its rows of y, and what they take from the rows below.
    pub(crate) fn forward(&mut self, llt: SupernodalLltRef<'_, u32, f64>, s: usize) {
        let (begin, end) = range(llt, s);
        let (w, size) = (self.width, end - begin);
        let supernode = llt.supernode(s);
        let (top, below) = supernode.val().split_at_row(size);
        let y = &mut self.x[begin * w..end * w];
        let mut y = MatMut::from_row_major_slice_mut(y, size, w);
        solve_lower_triangular_in_place(top, y.as_mut(), Par::Seq);
        let pattern = supernode.pattern();
        let product = &mut self.gathered[..pattern.len() * w];
        matmul(
            MatMut::from_row_major_slice_mut(product, pattern.len(), w),
            Accum::Replace,
            below,
            y.as_ref(),
            1.0,
            Par::Seq,
        );
        for (product, &row) in product.chunks_exact(w).zip(pattern) {
            let x = &mut self.x[row as usize * w..][..w];
            x.iter_mut().zip(product).for_each(|(x, p)| *x -= p);
        }
    }

    /// One supernode of Lᵀ x = y: its rows of x from those below.
    pub(crate) fn backward(&mut self, llt: SupernodalLltRef<'_, u32, f64>, s: usize) {
        let (begin, end) = range(llt, s);
        let (w, size) = (self.width, end - begin);
        let supernode = llt.supernode(s);
        let (top, below) = supernode.val().split_at_row(size);
        let pattern = supernode.pattern();
        let gathered = &mut self.gathered[..pattern.len() * w];
        for (gathered, &row) in gathered.chunks_exact_mut(w).zip(pattern) {
            gathered.copy_from_slice(&self.x[row as usize * w..][..w]);
        }
        let x = &mut self.x[begin * w..end * w];
        let mut x = MatMut::from_row_major_slice_mut(x, size, w);
        matmul(
            x.as_mut(),
            Accum::Add,
            below.transpose(),
            MatRef::from_row_major_slice(gathered, pattern.len(), w),
            -1.0,
            Par::Seq,
        );
        solve_upper_triangular_in_place(top.transpose(), x, Par::Seq);
    }
}

/// Positions of a supernode.
fn range(llt: SupernodalLltRef<'_, u32, f64>, s: usize) -> (usize, usize) {
    let symbolic = llt.symbolic();
    (
        symbolic.supernode_begin()[s] as usize,
        symbolic.supernode_end()[s] as usize,
    )
}

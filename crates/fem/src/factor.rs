//! Sparse Cholesky factor of the free degrees of freedom.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::prelude::ReborrowMut;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymbolicCholeskyRaw};
use faer::{Conj, MatMut, Par, Side};
use rayon::prelude::*;

use crate::Error;
use crate::assembly::Stiffness;
use crate::ordered::{HELD, OrderedStiffness};
use crate::progress::Progress;
use crate::supports::Supports;

/// s K_ff = L Lᵀ for the free degrees of freedom f; s is a power of two.
#[derive(Debug)]
pub struct FactoredStiffness {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    /// Place of each degree of freedom among the free ones, or [`HELD`].
    free_of_dof: Vec<u32>,
    dof_of_free: Vec<u32>,
    /// s: brings the largest diagonal entry between 1 and 2. The square roots of L then have the
    /// same bits in any system of units that differs by powers of two.
    scale: f64,
}

impl FactoredStiffness {
    /// Eliminates the held degrees of freedom (and nodes of no element), orders the others and
    /// factors: [`OrderedStiffness::new`] and [`OrderedStiffness::factor`].
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`], [`Error::TooLarge`], [`Error::Cancelled`].
    pub fn new(
        stiffness: &Stiffness,
        supports: &Supports,
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        OrderedStiffness::new(stiffness, supports, progress)?.factor(progress)
    }

    pub(crate) fn of(ordered: OrderedStiffness, progress: &dyn Progress) -> Result<Self, Error> {
        let OrderedStiffness {
            symbolic,
            lower,
            free_of_dof,
            dof_of_free,
            scale,
        } = ordered;
        progress.advance("factor", 0, 1);
        let mut values = vec![0.0; symbolic.len_val()];
        // One thread: the factor is the same bits on every machine with the same instructions.
        let par = Par::Seq;
        let mut memory = MemBuffer::try_new(
            symbolic.factorize_numeric_llt_scratch::<f64>(par, Default::default()),
        )
        .map_err(|_| Error::TooLarge("no memory for the factorisation".to_owned()))?;
        symbolic
            .factorize_numeric_llt::<f64>(
                &mut values,
                lower.as_ref(),
                Side::Lower,
                LltRegularization::default(),
                par,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(
                |LltError::NonPositivePivot { index }| Error::NotPositiveDefinite { pivot: index },
            )?;
        if progress.is_cancelled() {
            return Err(Error::Cancelled);
        }
        progress.advance("factor", 1, 1);
        Ok(Self {
            symbolic,
            values,
            free_of_dof,
            dof_of_free,
            scale,
        })
    }

    /// Number of degrees of freedom, held ones included.
    pub fn n_dofs(&self) -> usize {
        self.free_of_dof.len()
    }

    /// Number of free degrees of freedom.
    pub fn n_free(&self) -> usize {
        self.dof_of_free.len()
    }

    /// Entries of L.
    pub fn n_factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Place among the free degrees of freedom, if free.
    pub(crate) fn free_of(&self, dof: usize) -> Option<usize> {
        let free = self.free_of_dof[dof];
        (free != HELD).then_some(free as usize)
    }

    /// L by supernodes.
    ///
    /// # Panics
    /// If nothing is free: a matrix without rows has none.
    pub(crate) fn supernodes(&self) -> SupernodalLltRef<'_, u32, f64> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                SupernodalLltRef::new(symbolic, &self.values)
            }
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the supernodal form was asked for"),
        }
    }

    /// Place of a degree of freedom in the order of elimination, if free.
    pub(crate) fn position_of(&self, dof: usize) -> Option<usize> {
        let free = self.free_of(dof)?;
        let perm = self.symbolic.perm();
        Some(perm.map_or(free, |perm| perm.arrays().1[free] as usize))
    }

    /// Power of two by which the factored matrix is larger than the stiffness.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Solves for several right-hand sides in place, one column each, in free degrees of freedom.
    pub(crate) fn solve_in_place(&self, mut rhs: MatMut<'_, f64>, memory: &mut MemBuffer) {
        for column in rhs.rb_mut().col_iter_mut() {
            column.iter_mut().for_each(|f| *f *= self.scale);
        }
        LltRef::<u32, f64>::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            rhs,
            Par::Seq,
            MemStack::new(memory),
        );
    }

    /// Memory for [`Self::solve_in_place`].
    pub(crate) fn solve_memory(&self, n_rhs: usize) -> MemBuffer {
        MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(n_rhs, Par::Seq))
    }

    /// Displacement of all degrees of freedom (zero where held) under forces on all of them
    /// (ignored where held), m and N.
    pub fn solve(&self, force: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = self
            .dof_of_free
            .iter()
            .map(|&dof| force[dof as usize])
            .collect();
        let mut memory = self.solve_memory(1);
        let n = x.len();
        self.solve_in_place(
            MatMut::from_column_major_slice_mut(&mut x, n, 1),
            &mut memory,
        );
        let mut u = vec![0.0; self.n_dofs()];
        for (&dof, x) in self.dof_of_free.iter().zip(x) {
            u[dof as usize] = x;
        }
        u
    }

    /// As [`Self::solve`] for several forces, one after the other in `forces`, in parallel.
    pub fn solve_many(&self, forces: &[f64]) -> Vec<f64> {
        /// Columns of a panel; from 24 to 126 the cost of a column differs by 5 % at most.
        const PANEL: usize = 48;
        let (n, n_free) = (self.n_dofs(), self.n_free());
        let mut u = vec![0.0; forces.len()];
        u.par_chunks_mut((PANEL * n).max(1))
            .zip(forces.par_chunks((PANEL * n).max(1)))
            .for_each(|(u, forces)| {
                let width = forces.len() / n;
                let mut panel = Vec::with_capacity(n_free * width);
                for force in forces.chunks_exact(n) {
                    panel.extend(self.dof_of_free.iter().map(|&dof| force[dof as usize]));
                }
                let mut memory = self.solve_memory(width);
                self.solve_in_place(
                    MatMut::from_column_major_slice_mut(&mut panel, n_free, width),
                    &mut memory,
                );
                for (j, u) in u.chunks_exact_mut(n).enumerate() {
                    for (i, &dof) in self.dof_of_free.iter().enumerate() {
                        u[dof as usize] = panel[j * n_free + i];
                    }
                }
            });
        u
    }

    /// As [`Self::solve`], with the held degrees of freedom displaced as prescribed.
    pub fn solve_prescribed(
        &self,
        stiffness: &Stiffness,
        force: &[f64],
        prescribed: &[f64],
    ) -> Vec<f64> {
        let mut held = vec![0.0; self.n_dofs()];
        for (dof, value) in held.iter_mut().enumerate() {
            if self.free_of_dof[dof] == HELD {
                *value = prescribed[dof];
            }
        }
        let reaction = stiffness.multiply(&held);
        let rhs: Vec<f64> = force.iter().zip(reaction).map(|(f, r)| f - r).collect();
        let mut u = self.solve(&rhs);
        for (u, held) in u.iter_mut().zip(held) {
            *u += held;
        }
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Order;
    use crate::progress::Silent;
    use crate::{Material, Mesh, Quadrature, assemble_stiffness};

    /// More forces than fit into one panel; each answer is that of the force alone. Panels of
    /// other widths sum in another order, hence round-off and not bits.
    #[test]
    fn many_forces_are_solved_like_one() {
        let nodes = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let mesh = Mesh::new(
            Order::Linear,
            nodes,
            vec![1, 2, 3, 4],
            vec![0, 1, 2, 3],
            vec![1],
            vec![],
        );
        let mut supports = Supports::new(4);
        for (node, components) in [
            (0, [true; 3]),
            (1, [false, true, true]),
            (2, [false, false, true]),
        ] {
            supports.fix_node(node, components);
        }
        assert_eq!(supports.free_dofs().count(), 6);
        assert!(supports.free_rigid_motions(&mesh).is_empty());
        let material = Material::new(2e9, 0.3).unwrap();
        let stiffness = assemble_stiffness(&mesh, &[material], &[0], Quadrature::Fast).unwrap();
        let factor = FactoredStiffness::new(&stiffness, &supports, &Silent).unwrap();
        let forces: Vec<f64> = (0..101 * 12)
            .map(|i| f64::from((i * 37) % 23) - 11.0)
            .collect();
        let many = factor.solve_many(&forces);
        for (force, u) in forces.chunks(12).zip(many.chunks(12)) {
            let one = factor.solve(force);
            let largest = one.iter().fold(0.0f64, |a, x| a.max(x.abs()));
            for (a, b) in one.iter().zip(u) {
                assert!((a - b).abs() <= 1e-13 * largest);
            }
        }
        assert!(factor.solve_many(&[]).is_empty());
    }
}

//! Newton's method on all closed contacts together.
//!
//! Sticking contacts keep u = 0, slipping ones u_n = 0 and λ_t = μ λ_n s / |s| with s = λ_t - ρ u_t (Alart and Curnier).

use std::mem::MaybeUninit;

use faer::dyn_stack::MemStack;
use faer::linalg::lu::partial_pivoting as lu;
use faer::{MatMut, MatRef, Par, Spec};

use super::{Problem, State};

/// Memory for up to `capacity` rows.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    rows: Vec<u32>,
    jacobian: Vec<f64>,
    right: Vec<f64>,
    permutation: Vec<u32>,
    inverse: Vec<u32>,
    stack: Vec<MaybeUninit<u8>>,
}

impl Scratch {
    pub(super) fn new(capacity: usize) -> Self {
        let n = capacity;
        let factor = lu::factor::lu_in_place_scratch::<u32, f64>(n, n, Par::Seq, Spec::default());
        let solve = lu::solve::solve_in_place_scratch::<u32, f64>(n, 1, Par::Seq);
        Self {
            rows: Vec::with_capacity(n),
            jacobian: vec![0.0; n * n],
            right: vec![0.0; n],
            permutation: vec![0; n],
            inverse: vec![0; n],
            stack: vec![MaybeUninit::uninit(); factor.or(solve).unaligned_bytes_required()],
        }
    }

    /// Adds one Newton step to `forces`, for contacts that do what `states` says; open ones are without force.
    /// `u` = q + W λ.
    ///
    /// False if there is nothing to solve or the system is singular; `forces` are as before then.
    pub(super) fn step(
        &mut self,
        problem: &Problem,
        states: &[State],
        u: &[f64],
        forces: &mut [f64],
    ) -> bool {
        self.rows.clear();
        for (contact, state) in states.iter().enumerate() {
            if *state != State::Open {
                let first = 3 * contact as u32;
                self.rows.extend([first, first + 1, first + 2]);
            }
        }
        let n = self.rows.len();
        if n == 0 {
            return false;
        }
        self.assemble(problem, states, u, forces);
        let jacobian = MatMut::from_column_major_slice_mut(&mut self.jacobian[..n * n], n, n);
        let stack = MemStack::new(&mut self.stack);
        let (_, permutation) = lu::factor::lu_in_place(
            jacobian,
            &mut self.permutation[..n],
            &mut self.inverse[..n],
            Par::Seq,
            stack,
            Spec::default(),
        );
        let factor = MatRef::from_column_major_slice(&self.jacobian[..n * n], n, n);
        let right = MatMut::from_column_major_slice_mut(&mut self.right[..n], n, 1);
        lu::solve::solve_in_place(factor, factor, permutation, right, Par::Seq, stack);
        let right = &self.right[..n];
        if !right.iter().all(|x| x.is_finite()) {
            return false;
        }
        for (&row, &step) in self.rows.iter().zip(right) {
            forces[row as usize] += step;
        }
        true
    }

    /// The rows of the linearised conditions, each by its own size, and minus their values.
    fn assemble(&mut self, problem: &Problem, states: &[State], u: &[f64], forces: &[f64]) {
        let n = self.rows.len();
        for (column, &j) in self.rows.iter().enumerate() {
            let source = problem.column(j as usize);
            let target = &mut self.jacobian[column * n..(column + 1) * n];
            for (target, &i) in target.iter_mut().zip(&self.rows) {
                *target = source[i as usize];
            }
        }
        for (right, &row) in self.right.iter_mut().zip(&self.rows) {
            *right = -u[row as usize];
        }
        for position in (0..n).step_by(3) {
            let row = self.rows[position] as usize;
            let contact = row / 3;
            if states[contact] == State::Slip {
                let mu = problem.friction_coefficients()[contact];
                self.slip_rows(position, mu, &triple(u, row), &triple(forces, row));
            }
        }
    }

    /// Replaces the tangential rows of a slipping contact, whose W rows stand at `position` + 1 and + 2, by
    ///
    /// ```text
    /// δλ_t - μ e δλ_n - (μ λ_n / |s|) (I - e eᵀ) (δλ_t - ρ W_t δλ) = μ λ_n e - λ_t,   e = s / |s|
    /// ```
    fn slip_rows(&mut self, position: usize, mu: f64, u: &[f64; 3], force: &[f64; 3]) {
        let n = self.rows.len();
        let at = |row: usize, column: usize| (position + column) * n + position + row;
        // ρ of the size of a stiffness, so that force and slip weigh alike; the rows are scaled back to compliances.
        let compliance = 0.5 * (self.jacobian[at(1, 1)] + self.jacobian[at(2, 2)]);
        let rho = 1.0 / compliance;
        let s = [force[1] - rho * u[1], force[2] - rho * u[2]];
        let length = s[0].hypot(s[1]);
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let e = [s[0] / length, s[1] / length];
        let bend = mu * force[0] / length;
        let across = [-e[1], e[0]];
        for column in 0..n {
            let entry = column * n + position;
            let w = [self.jacobian[entry + 1], self.jacobian[entry + 2]];
            let unit = |axis: usize| {
                if column == position + axis {
                    compliance
                } else {
                    0.0
                }
            };
            let moved = [unit(1) - w[0], unit(2) - w[1]];
            let turned = bend * (across[0] * moved[0] + across[1] * moved[1]);
            for axis in 0..2 {
                self.jacobian[entry + 1 + axis] =
                    unit(axis + 1) - mu * e[axis] * unit(0) - turned * across[axis];
            }
        }
        for axis in 0..2 {
            self.right[position + 1 + axis] =
                compliance * (mu * force[0] * e[axis] - force[axis + 1]);
        }
    }
}

fn triple(values: &[f64], row: usize) -> [f64; 3] {
    [values[row], values[row + 1], values[row + 2]]
}

//! The linear system of one Newton step on all closed contacts together.
//!
//! A sticking contact has three unknowns, its force, and u = 0. A slipping one has two: its force is λ_n (1, -μ d) + τ d⊥, d the
//! direction of slip and d⊥ across it; its gap stays closed and u_t stays along d,
//!
//! ```text
//! n · δu = -u_n          d⊥ · δu_t + s / (μ λ_n) τ = -d⊥ · u_t,   s = d · u_t
//! ```
//!
//! That is Alart and Curnier's linearisation with the force along d taken out. All but the columns of the slipping contacts'
//! normal forces is symmetric, so the rest is factorised first, by Cholesky, and what is left of them by LU:
//!
//! ```text
//! | A  G | |z₁|   |r₁|      A = L Lᵀ        A: sticking rows and d⊥, positive definite
//! | Bᵀ D | |z₂| = |r₂|      S = D - Bᵀ A⁻¹ G
//! ```

use std::mem::MaybeUninit;

use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt;
use faer::linalg::lu::partial_pivoting as lu;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::perm::PermRef;
use faer::{Accum, MatMut, MatRef, Par, Spec};

use super::contacts::Contacts;
use super::{Problem, State, cone};

/// Of the diagonal entry: a pivot below has no digits left, as when two rows are the same.
const SINGULAR: f64 = 1e-11;

/// Of the diagonal, added where a pivot has no digits. Equal rows then share a step; what it changes in the step is
/// taken back by the steps that follow, a factor of 1e-9 over the smallest eigenvalue each.
const REGULARISATION: f64 = 1e-9;

/// A force along two neighbouring rows of W: `along[0]` of row `row` and `along[1]` of the one behind.
#[derive(Debug, Clone, Copy)]
struct Unknown {
    row: u32,
    along: [f64; 2],
    /// s / (μ λ_n) of a direction across the slip, 0 otherwise.
    turning: f64,
    is_across: bool,
}

/// The normal force of a slipping contact, with the friction it brings along.
#[derive(Debug, Clone, Copy)]
struct Normal {
    row: u32,
    friction_coefficient: f64,
    /// -μ d.
    drag: [f64; 2],
}

/// Memory for up to `capacity` contacts.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    unknowns: Vec<Unknown>,
    normals: Vec<Normal>,
    /// A, then L.
    symmetric: Vec<f64>,
    /// L⁻¹ B and L⁻¹ G, side by side.
    coupling: Vec<f64>,
    /// S, then its factors.
    rest: Vec<f64>,
    diagonal: Vec<f64>,
    /// A combination of columns of W.
    column: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
    permutation: Vec<u32>,
    inverse: Vec<u32>,
    stack: Vec<MaybeUninit<u8>>,
    pub(super) is_regularised: bool,
    /// Whether the directions of slip are held.
    pub(super) is_straight: bool,
}

impl Scratch {
    pub(super) fn new(capacity: usize) -> Self {
        let n = 3 * capacity;
        let cholesky = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default());
        let factor = lu::factor::lu_in_place_scratch::<u32, f64>(
            capacity,
            capacity,
            Par::Seq,
            Spec::default(),
        );
        let solve = lu::solve::solve_in_place_scratch::<u32, f64>(capacity, 1, Par::Seq);
        let bytes = cholesky.or(factor).or(solve).unaligned_bytes_required();
        Self {
            unknowns: Vec::with_capacity(n),
            normals: Vec::with_capacity(capacity),
            symmetric: vec![0.0; n * n],
            // (3 n - 2 k) 2 k for k slipping contacts, at its largest.
            coupling: vec![0.0; n * n / 4 + 1],
            rest: vec![0.0; capacity * capacity],
            diagonal: vec![0.0; n],
            column: vec![0.0; n],
            first: vec![0.0; n],
            second: vec![0.0; capacity],
            permutation: vec![0; capacity],
            inverse: vec![0; capacity],
            stack: vec![MaybeUninit::uninit(); bytes],
            is_regularised: false,
            is_straight: false,
        }
    }

    /// Factorises the system for contacts that do what `contacts` says, at `forces` and `u` = q + W λ.
    ///
    /// False if there is nothing to solve, or no factor.
    pub(super) fn factorise(
        &mut self,
        problem: &Problem,
        contacts: &Contacts,
        u: &[f64],
        forces: &[f64],
    ) -> bool {
        self.choose_unknowns(problem, contacts, u, forces);
        if self.unknowns.is_empty() && self.normals.is_empty() {
            return false;
        }
        if self.is_regularised {
            return self.try_factorise(problem);
        }
        if self.try_factorise(problem) {
            return true;
        }
        self.is_regularised = true;
        self.try_factorise(problem)
    }

    fn choose_unknowns(
        &mut self,
        problem: &Problem,
        contacts: &Contacts,
        u: &[f64],
        forces: &[f64],
    ) {
        self.unknowns.clear();
        self.normals.clear();
        for (contact, state) in contacts.states.iter().enumerate() {
            let first = 3 * contact as u32;
            let mut add = |row: u32, along: [f64; 2]| {
                self.unknowns.push(Unknown {
                    row,
                    along,
                    turning: 0.0,
                    is_across: false,
                });
            };
            match state {
                State::Open => {}
                State::Stick => {
                    add(first, [1.0, 0.0]);
                    for along in contacts.tangents(contact) {
                        add(first + 1, *along);
                    }
                }
                State::Slip => {
                    let mu = problem.friction_coefficients()[contact];
                    if mu <= 0.0 {
                        add(first, [1.0, 0.0]);
                        continue;
                    }
                    let row = 3 * contact;
                    let d = contacts.directions[contact];
                    let slip = (d[0] * u[row + 1] + d[1] * u[row + 2]).max(0.0);
                    let normal = forces[row].max(forces[row] - contacts.rho(contact)[0] * u[row]);
                    let turning = slip / (mu * normal);
                    let holds = turning + contacts.compliance(contact, across(d));
                    // Without a force yet the direction stays, and where nothing gives way across there is nothing to find.
                    if !self.is_straight
                        && turning.is_finite()
                        && holds > contacts.no_compliance(contact)
                    {
                        self.unknowns.push(Unknown {
                            row: first + 1,
                            along: across(d),
                            turning,
                            is_across: true,
                        });
                    }
                    self.normals.push(Normal {
                        row: first,
                        friction_coefficient: mu,
                        drag: d.map(|d| -mu * d),
                    });
                }
            }
        }
    }

    fn try_factorise(&mut self, problem: &Problem) -> bool {
        self.assemble(problem);
        let (n, k) = (self.unknowns.len(), self.normals.len());
        let stack = MemStack::new(&mut self.stack);
        let symmetric = MatMut::from_column_major_slice_mut(&mut self.symmetric[..n * n], n, n);
        let no_change = llt::factor::LltRegularization::default();
        if n > 0
            && llt::factor::cholesky_in_place(
                symmetric,
                no_change,
                Par::Seq,
                stack,
                Spec::default(),
            )
            .is_err()
        {
            return false;
        }
        let has_digits = |pivot: f64, diagonal: f64| pivot > SINGULAR * diagonal;
        let keep = (0..n).all(|i| has_digits(self.symmetric[i * n + i].powi(2), self.diagonal[i]));
        if !keep {
            return false;
        }
        if k == 0 {
            return true;
        }
        let lower = MatRef::from_column_major_slice(&self.symmetric[..n * n], n, n);
        let mut coupling =
            MatMut::from_column_major_slice_mut(&mut self.coupling[..2 * n * k], n, 2 * k);
        solve_lower_triangular_in_place(lower, coupling.as_mut(), Par::Seq);
        let (b, g) = coupling.as_ref().split_at_col(k);
        let mut rest = MatMut::from_column_major_slice_mut(&mut self.rest[..k * k], k, k);
        matmul(rest.as_mut(), Accum::Add, b.transpose(), g, -1.0, Par::Seq);
        lu::factor::lu_in_place(
            rest,
            &mut self.permutation[..k],
            &mut self.inverse[..k],
            Par::Seq,
            stack,
            Spec::default(),
        );
        let diagonal = |i: usize| {
            let row = self.normals[i].row as usize;
            problem.column(row)[row]
        };
        // Rows were exchanged: the smallest entry of any is the one to compare with.
        (0..k).all(|i| has_digits(self.rest[i * k + i].abs(), diagonal(i)))
    }

    /// Writes the lower half of A, B and G side by side, and D.
    fn assemble(&mut self, problem: &Problem) {
        let (n, k) = (self.unknowns.len(), self.normals.len());
        let raise = if self.is_regularised {
            1.0 + REGULARISATION
        } else {
            1.0
        };
        for (j, unknown) in self.unknowns.iter().enumerate() {
            let row = unknown.row as usize;
            let columns = [problem.column(row), problem.column(row + 1)];
            let source = match unknown.along {
                [a, b] if a == 1.0 && b == 0.0 => columns[0],
                [a, b] if a == 0.0 && b == 1.0 => columns[1],
                [a, b] => {
                    let pairs = columns[0].iter().zip(columns[1]);
                    for (target, (x, y)) in self.column.iter_mut().zip(pairs) {
                        *target = a * x + b * y;
                    }
                    &self.column[..]
                }
            };
            let target = &mut self.symmetric[j * n + j..(j + 1) * n];
            gather(source, &self.unknowns[j..], target);
            target[0] = target[0] * raise + unknown.turning;
            self.diagonal[j] = target[0];
        }
        let (b, g) = self.coupling[..2 * n * k].split_at_mut(n * k);
        for (j, normal) in self.normals.iter().enumerate() {
            let row = normal.row as usize;
            let columns = [0, 1, 2].map(|axis| problem.column(row + axis));
            gather(columns[0], &self.unknowns, &mut b[j * n..(j + 1) * n]);
            let [d, e] = normal.drag;
            let along = columns[0].iter().zip(columns[1]).zip(columns[2]);
            for (target, ((x, y), z)) in self.column.iter_mut().zip(along) {
                *target = x + (d * y + e * z);
            }
            gather(&self.column, &self.unknowns, &mut g[j * n..(j + 1) * n]);
            let target = &mut self.rest[j * k..(j + 1) * k];
            for (target, other) in target.iter_mut().zip(&self.normals) {
                *target = self.column[other.row as usize];
            }
            target[j] += (raise - 1.0) * columns[0][row];
        }
    }

    /// The step from `u`, by the last factor, along the slips as they are now. False if it is not finite.
    pub(super) fn solve(&mut self, contacts: &Contacts, u: &[f64]) -> bool {
        let (n, k) = (self.unknowns.len(), self.normals.len());
        for unknown in self.unknowns.iter_mut().filter(|x| x.is_across) {
            unknown.along = across(contacts.directions[unknown.row as usize / 3]);
        }
        for normal in &mut self.normals {
            let d = contacts.directions[normal.row as usize / 3];
            normal.drag = d.map(|d| -normal.friction_coefficient * d);
        }
        for (target, unknown) in self.first.iter_mut().zip(&self.unknowns) {
            let row = unknown.row as usize;
            *target = -(unknown.along[0] * u[row] + unknown.along[1] * u[row + 1]);
        }
        for (target, normal) in self.second.iter_mut().zip(&self.normals) {
            *target = -u[normal.row as usize];
        }
        let lower = MatRef::from_column_major_slice(&self.symmetric[..n * n], n, n);
        let mut first = MatMut::from_column_major_slice_mut(&mut self.first[..n], n, 1);
        solve_lower_triangular_in_place(lower, first.as_mut(), Par::Seq);
        if k > 0 {
            let coupling = MatRef::from_column_major_slice(&self.coupling[..2 * n * k], n, 2 * k);
            let (b, g) = coupling.split_at_col(k);
            let mut second = MatMut::from_column_major_slice_mut(&mut self.second[..k], k, 1);
            let first_ref = first.as_ref();
            matmul(
                second.as_mut(),
                Accum::Add,
                b.transpose(),
                first_ref,
                -1.0,
                Par::Seq,
            );
            let factor = MatRef::from_column_major_slice(&self.rest[..k * k], k, k);
            let permutation = PermRef::new_checked(&self.permutation[..k], &self.inverse[..k], k);
            let stack = MemStack::new(&mut self.stack);
            lu::solve::solve_in_place(
                factor,
                factor,
                permutation,
                second.as_mut(),
                Par::Seq,
                stack,
            );
            matmul(
                first.as_mut(),
                Accum::Add,
                g,
                second.as_ref(),
                -1.0,
                Par::Seq,
            );
        }
        solve_upper_triangular_in_place(lower.transpose(), first, Par::Seq);
        let mut steps = self.first[..n].iter().chain(&self.second[..k]);
        steps.all(|x| x.is_finite())
    }

    /// Adds the step to `forces`. Those of slipping contacts turn on the cone by what is across the slip.
    pub(super) fn add_to(&self, forces: &mut [f64]) {
        self.add_unknowns_to(forces);
        for (normal, step) in self.normals.iter().zip(&self.second) {
            let row = normal.row as usize;
            forces[row] += step;
            forces[row + 1] += normal.drag[0] * step;
            forces[row + 2] += normal.drag[1] * step;
            let most = normal.friction_coefficient * forces[row].max(0.0);
            let length = cone::tangential(&[0.0, forces[row + 1], forces[row + 2]]);
            let scale = if length > 0.0 { most / length } else { 0.0 };
            forces[row + 1] *= scale;
            forces[row + 2] *= scale;
        }
    }

    /// Adds what is not the normal force of a slipping contact.
    pub(super) fn add_unknowns_to(&self, forces: &mut [f64]) {
        for (unknown, step) in self.unknowns.iter().zip(&self.first) {
            let row = unknown.row as usize;
            forces[row] += unknown.along[0] * step;
            forces[row + 1] += unknown.along[1] * step;
        }
    }

    /// Of slipping contacts: row of the normal force, what it drags along, and its step.
    pub(super) fn normal_steps(&self) -> impl Iterator<Item = (usize, [f64; 2], f64)> {
        let steps = self.normals.iter().zip(&self.second);
        steps.map(|(normal, step)| (normal.row as usize, normal.drag, *step))
    }
}

fn across(d: [f64; 2]) -> [f64; 2] {
    [-d[1], d[0]]
}

/// The entries of a column of W that the unknowns see.
fn gather(column: &[f64], unknowns: &[Unknown], target: &mut [f64]) {
    for (target, unknown) in target.iter_mut().zip(unknowns) {
        // One check of bounds for both.
        let pair = &column[unknown.row as usize..][..2];
        *target = unknown.along[0] * pair[0] + unknown.along[1] * pair[1];
    }
}

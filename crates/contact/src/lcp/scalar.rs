//! The two kinds of numbers the solvers work in, and what round-off means in each.

use super::run::{self, Request};
use super::{Solution, Start};
use crate::error::Error;
use crate::friction;

/// A number the solvers work in: `f64` or `f32`.
///
/// `f64` is the default everywhere. `f32` halves the memory that is read; its answers are good to about 1e-6 of
/// the largest gap and force, and so is what their certificate can see.
pub trait Scalar: sealed::Number {}

impl Scalar for f64 {}
impl Scalar for f32 {}

pub(super) mod sealed {
    use super::{Error, Request, Solution, Start, friction};

    /// What [`super::Scalar`] promises inside this crate.
    pub trait Number:
        num_traits::Float + num_traits::NumAssign + std::iter::Sum + faer::traits::RealField
    {
        /// E / diag(M), added before factorising an active block that is singular to round-off: a thousand times the
        /// round-off of a factorisation of a few hundred rows, so that rank-deficient active sets stay
        /// solvable; small enough that one proximal step removes it up to condition 1e8 (f64).
        const REGULARISATION: f64;
        /// A pivot below this times M_ii has lost its digits to the rows before it: the block is treated as singular.
        const SINGULAR: f64;
        /// A pivot below minus this times M_ii is no round-off, so M is indefinite.
        const INDEFINITE: f64;
        /// What counts as a wrong sign, of the largest value: above the round-off of well-conditioned rows, far below the
        /// default tolerance of an answer.
        const WRONG: f64;
        /// A natural residual that needs no further step: a few hundred roundings.
        const GOAL: f64;
        /// [`super::super::Settings::tolerance`] unless set.
        const TOLERANCE: f64;
        /// Of the largest entry of a column of Lemke's tableau: smaller ones are round-off of a zero.
        const TABLEAU_ZERO: f64;
        /// Of a ratio in Lemke's method: closer ones are equal.
        const TABLEAU_EQUAL: f64;
        /// [`friction::Settings::tolerance`] unless set.
        const FRICTION_TOLERANCE: f64;
        /// Of the sum of absolute terms in a proof that there is no solution.
        const PROOF: f64;

        fn of(value: f64) -> Self;
        fn wide(self) -> f64;
        /// [`run::solve`], compiled in this crate, whose level of optimisation is that of numerics.
        fn solve(
            request: &mut Request<Self>,
            start: Start,
            z: &mut [Self],
            w: &mut [Self],
        ) -> Result<Solution, Error>
        where
            Self: super::Scalar;
        /// [`friction::solve`], likewise.
        fn solve_friction(
            problem: &friction::Problem<Self>,
            settings: &friction::Settings,
            scratch: &mut friction::Scratch<Self>,
            is_warm: bool,
            forces: &mut [Self],
            slip: &mut [Self],
        ) -> Result<friction::Solution, Error>
        where
            Self: super::Scalar;
    }
}

impl sealed::Number for f64 {
    const REGULARISATION: f64 = 1e-12;
    const SINGULAR: f64 = 1e-9;
    const INDEFINITE: f64 = 1e-8;
    const WRONG: f64 = 1e-13;
    const GOAL: f64 = 5e-14;
    const TOLERANCE: f64 = 1e-10;
    const TABLEAU_ZERO: f64 = 1e-11;
    const TABLEAU_EQUAL: f64 = 1e-12;
    const FRICTION_TOLERANCE: f64 = 1e-8;
    const PROOF: f64 = 1e-9;

    fn of(value: f64) -> Self {
        value
    }
    fn wide(self) -> f64 {
        self
    }
    fn solve(
        request: &mut Request<Self>,
        start: Start,
        z: &mut [Self],
        w: &mut [Self],
    ) -> Result<Solution, Error> {
        run::solve(request, start, z, w)
    }
    fn solve_friction(
        problem: &friction::Problem<Self>,
        settings: &friction::Settings,
        scratch: &mut friction::Scratch<Self>,
        is_warm: bool,
        forces: &mut [Self],
        slip: &mut [Self],
    ) -> Result<friction::Solution, Error> {
        friction::run(problem, settings, scratch, is_warm, forces, slip)
    }
}

impl sealed::Number for f32 {
    const REGULARISATION: f64 = 1e-5;
    const SINGULAR: f64 = 1e-3;
    const INDEFINITE: f64 = 1e-3;
    const WRONG: f64 = 1e-6;
    const GOAL: f64 = 1e-6;
    const TOLERANCE: f64 = 1e-5;
    const TABLEAU_ZERO: f64 = 1e-5;
    const TABLEAU_EQUAL: f64 = 1e-6;
    const FRICTION_TOLERANCE: f64 = 1e-4;
    const PROOF: f64 = 1e-4;

    fn of(value: f64) -> Self {
        value as f32
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
    fn solve(
        request: &mut Request<Self>,
        start: Start,
        z: &mut [Self],
        w: &mut [Self],
    ) -> Result<Solution, Error> {
        run::solve(request, start, z, w)
    }
    fn solve_friction(
        problem: &friction::Problem<Self>,
        settings: &friction::Settings,
        scratch: &mut friction::Scratch<Self>,
        is_warm: bool,
        forces: &mut [Self],
        slip: &mut [Self],
    ) -> Result<friction::Solution, Error> {
        friction::run(problem, settings, scratch, is_warm, forces, slip)
    }
}

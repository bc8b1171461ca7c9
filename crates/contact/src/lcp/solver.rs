//! The methods by name, behind one trait.

use super::run::{self, Request};
use super::{Method, Problem, Scratch, Settings, Solution, Start};
use crate::error::Error;

/// A method for linear complementarity problems with a symmetric positive semi-definite M.
///
/// ```
/// use contact::lcp::{ActiveSet, Automatic, BlockPivoting, Problem, Scratch, Settings, Solver, Start};
///
/// # fn main() -> Result<(), contact::Error> {
/// let problem = Problem::symmetric(&[2.0, 1.0, 1.0, 2.0], &[-1.0, 0.2])?;
/// let mut scratch = Scratch::new(2);
/// let methods: [&dyn Solver; 3] = [&Automatic, &BlockPivoting, &ActiveSet];
/// for method in methods {
///     let (mut z, mut w) = ([0.0; 2], [0.0; 2]);
///     method.solve(&problem, &Settings::default(), &mut scratch, Start::Cold, &mut z, &mut w)?;
///     assert!((z[0] - 0.5).abs() < 1e-14 && z[1] == 0.0, "{}", method.name());
/// }
/// # Ok(())
/// # }
/// ```
pub trait Solver {
    /// What it is called in tables.
    fn name(&self) -> &'static str;

    /// Solves `problem`, writes `z` and `w` = q + M z.
    ///
    /// Does not allocate, lock or log.
    ///
    /// # Errors
    /// [`Error::NotSymmetric`]; [`Error::Capacity`]; [`Error::Length`] if the start, `z` or `w` do not have m entries.
    fn solve(
        &self,
        problem: &Problem,
        settings: &Settings,
        scratch: &mut Scratch,
        start: Start,
        z: &mut [f64],
        w: &mut [f64],
    ) -> Result<Solution, Error>;
}

/// The chain of methods that fits the problem, see [the module](super): the one to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Automatic;

/// Block principal pivoting and nothing else; ends with [`Status::Budget`](super::Status::Budget) where that fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BlockPivoting;

/// Single pivots, downhill in energy; starts from no force, whatever the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ActiveSet;

/// Projected Gauss-Seidel sweeps from no force, whatever the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GaussSeidel;

macro_rules! solver {
    ($type:ident, $name:literal, $only:expr) => {
        impl Solver for $type {
            fn name(&self) -> &'static str {
                $name
            }

            fn solve(
                &self,
                problem: &Problem,
                settings: &Settings,
                scratch: &mut Scratch,
                start: Start,
                z: &mut [f64],
                w: &mut [f64],
            ) -> Result<Solution, Error> {
                let mut request = Request {
                    problem,
                    settings,
                    scratch,
                    only: $only,
                };
                run::solve(&mut request, start, z, w)
            }
        }
    };
}

solver!(Automatic, "automatic", None);
solver!(BlockPivoting, "block pivoting", Some(Method::BlockPivoting));
solver!(ActiveSet, "active set", Some(Method::ActiveSet));
solver!(GaussSeidel, "Gauss-Seidel", Some(Method::GaussSeidel));

//! The methods by name, behind one trait.

use super::run::Request;
use super::{Method, Problem, Scalar, Scratch, Settings, Solution, Start};
use crate::error::Error;

/// A method for linear complementarity problems.
///
/// ```
/// use contact::lcp::{ActiveSet, BlockPivoting, Lemke, Problem, Scratch, Settings, Solver, Start};
///
/// # fn main() -> Result<(), contact::Error> {
/// let problem = Problem::symmetric(&[2.0, 1.0, 1.0, 2.0], &[-1.0, 0.2])?;
/// let mut scratch = Scratch::new(2);
/// let methods: [&dyn Solver<f64>; 3] = [&BlockPivoting, &ActiveSet, &Lemke];
/// for method in methods {
///     let (mut z, mut w) = ([0.0; 2], [0.0; 2]);
///     method.solve(&problem, &Settings::default(), &mut scratch, Start::Cold, &mut z, &mut w)?;
///     assert!((z[0] - 0.5).abs() < 1e-14 && z[1] == 0.0, "{}", method.name());
/// }
/// # Ok(())
/// # }
/// ```
pub trait Solver<T: Scalar> {
    /// What it is called in tables.
    fn name(&self) -> &'static str;

    /// Solves `problem`, writes `z` and `w` = q + M z.
    ///
    /// Does not allocate, lock or log.
    ///
    /// # Errors
    /// [`Error::Capacity`]; [`Error::Length`] if the start, `z` or `w` do not have m entries;
    /// [`Error::NotSymmetric`] from methods for symmetric M.
    fn solve(
        &self,
        problem: &Problem<T>,
        settings: &Settings,
        scratch: &mut Scratch<T>,
        start: Start,
        z: &mut [T],
        w: &mut [T],
    ) -> Result<Solution, Error>;
}

/// The chain of methods that fits the problem, see [the module](super): the one to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Automatic;

/// Block principal pivoting and nothing else; ends with [`Status::Budget`](super::Status::Budget) where that fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BlockPivoting;

/// Single pivots, downhill in energy. Symmetric positive semidefinite M; starts from no force, whatever the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ActiveSet;

/// Lemke's method with the lexicographic rule. Any M; has no use for a warm start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lemke;

/// Projected Gauss-Seidel sweeps from no force. Symmetric positive semidefinite M.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GaussSeidel;

macro_rules! solver {
    ($type:ident, $name:literal, $only:expr) => {
        impl<T: Scalar> Solver<T> for $type {
            fn name(&self) -> &'static str {
                $name
            }

            fn solve(
                &self,
                problem: &Problem<T>,
                settings: &Settings,
                scratch: &mut Scratch<T>,
                start: Start,
                z: &mut [T],
                w: &mut [T],
            ) -> Result<Solution, Error> {
                let mut request = Request {
                    problem,
                    settings,
                    scratch,
                    only: $only,
                };
                T::solve(&mut request, start, z, w)
            }
        }
    };
}

solver!(Automatic, "automatic", None);
solver!(BlockPivoting, "block pivoting", Some(Method::BlockPivoting));
solver!(ActiveSet, "active set", Some(Method::ActiveSet));
solver!(Lemke, "Lemke", Some(Method::Lemke));
solver!(GaussSeidel, "Gauss-Seidel", Some(Method::GaussSeidel));

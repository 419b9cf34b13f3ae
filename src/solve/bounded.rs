//! Bounded linear least squares: min ½‖W(Ax − b)‖² + ½ Σ (ridge · ‖W aⱼ‖ · xⱼ)² with
//! lower ≤ x ≤ upper, for tall systems with many columns of which few end up between their
//! bounds, and with columns that are nearly equal.
//!
//! The method is an active-set method (Lawson and Hanson 1974, chapter 23; Stark and Parker 1995
//! for two-sided bounds) by column generation:
//!
//! 1. a *pass* over `A` gives the exact gradient Aᵀ W² (b − A x) of every column, in parallel;
//! 2. the columns that violate the optimality conditions most join a *working set*, for which
//!    the Gram matrix is kept;
//! 3. the problem is solved on the working set alone (`exchange`), as a correction of the
//!    present `x` starting from the exact gradient of step 1, so that the error of the Gram
//!    matrix only slows convergence, as in iterative refinement, and never limits it;
//! 4. repeat until the gradient of step 1 meets the optimality conditions.
//!
//! Step 3 lowers the objective strictly and the working set only grows, so the loop ends; a few
//! passes over `A` suffice because each brings many columns. Where the Gram matrix is too
//! inaccurate to make progress (it squares the condition number), step 3 works on an
//! orthogonal factor of the working columns instead.
//!
//! Everything is column-scaled: a column times its own weighted norm is one unknown, so units
//! of the columns do not matter. Sums have a fixed order: any number of threads gives the same
//! bytes.

mod cholesky;
mod exchange;
mod model;
mod passes;
mod quadratic;
mod system;
mod working;

use crate::watch::{Cancelled, Watch};

pub use quadratic::bounded_quadratic;

/// One problem: `matrix` is m × n, any strides (with rows not contiguous within a column, one
/// column-major copy is made).
#[derive(Clone, Copy, Debug)]
pub struct BoundedProblem<'a> {
    pub matrix: faer::MatRef<'a, f64>,
    /// Right side, length m.
    pub target: &'a [f64],
    /// Row weights ≥ 0, length m; `None` is 1 everywhere.
    pub weights: Option<&'a [f64]>,
    pub bounds: Bounds<'a>,
    /// Adds ½ (ridge · ‖W aⱼ‖ · xⱼ)² to the objective for every column; 0 is none. Dimensionless.
    pub ridge: f64,
}

/// The box that `x` lies in.
#[derive(Clone, Copy, Debug)]
pub enum Bounds<'a> {
    /// x ≥ 0.
    NonNegative,
    /// lower ≤ x ≤ upper, each of length n; −∞ and +∞ are allowed, equal bounds fix a column.
    Between { lower: &'a [f64], upper: &'a [f64] },
}

/// Which columns' inner products are formed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathChoice {
    /// All at once for few columns, else as columns are wanted.
    #[default]
    Auto,
    /// The full Gram matrix before the first exchange: m n² operations, n² memory.
    Gram,
    /// Only those of columns that came into question.
    Columns,
}

/// Which way a solution was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    Gram,
    Columns,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundedOptions {
    /// Ends when `kkt_residual <= tolerance` (see [`BoundedSolution::kkt_residual`]).
    /// Dimensionless, > 0; below about 1e-15 rounding makes it unreachable. Default 1e-12.
    pub tolerance: f64,
    /// Most solutions of a subspace (exchanges of columns) over all passes. Default 100 000.
    pub max_iterations: usize,
    /// Default [`PathChoice::Auto`].
    pub choice: PathChoice,
}

impl Default for BoundedOptions {
    fn default() -> Self {
        Self { tolerance: 1e-12, max_iterations: 100_000, choice: PathChoice::Auto }
    }
}

impl BoundedOptions {
    pub fn check(&self) -> Result<(), BoundedError> {
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return Err(BoundedError::Option {
                name: "tolerance",
                wanted: "between 0 and 1",
                found: self.tolerance,
            });
        }
        if self.max_iterations == 0 {
            return Err(BoundedError::Option {
                name: "max_iterations",
                wanted: "at least 1",
                found: 0.0,
            });
        }
        Ok(())
    }
}

/// The answer and how good it is.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundedSolution {
    /// Length n, within the bounds.
    pub x: Vec<f64>,
    /// ‖W(Ax − b)‖, without the ridge.
    pub residual_norm: f64,
    /// The largest |pⱼ| / (‖W aⱼ‖ · s), where p is the gradient AᵀW²(b − Ax) − ridge² ‖W aⱼ‖² xⱼ
    /// computed from `A`, projected (0 where it points out of the box at a bound), and s is the
    /// larger of ‖Wb‖ and ‖W A x₀‖, x₀ being the point of the box nearest to 0. Dimensionless:
    /// the cosine between residual and column where the residual is as large as the target.
    pub kkt_residual: f64,
    /// The largest |pⱼ| itself, in the units of WA · Wb; what SciPy users compute from Aᵀ(Ax − b).
    pub kkt_absolute: f64,
    /// How many columns lie strictly between their bounds.
    pub active: usize,
    /// Solutions of a subspace.
    pub iterations: usize,
    /// Passes over the whole of `A`.
    pub passes: usize,
    pub path: Path,
    /// Whether `kkt_residual <= tolerance`. If not, `x` is the best point that was reached.
    pub converged: bool,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoundedError {
    #[error("{what} has length {found}, but the matrix asks for {wanted}")]
    Dimension { what: &'static str, wanted: usize, found: usize },
    #[error("matrix entry at row {row}, column {column} is {value}, not a finite number")]
    MatrixEntry { row: usize, column: usize, value: f64 },
    #[error("squares of column {column} overflow: give the system in other units")]
    ColumnTooLarge { column: usize },
    #[error("target at row {row} is {value}, too large or not a finite number")]
    TargetEntry { row: usize, value: f64 },
    #[error("weight of row {row} is {value}, not a finite number ≥ 0")]
    Weight { row: usize, value: f64 },
    #[error("bounds of column {column} leave nothing: {lower} ..= {upper}")]
    Bounds { column: usize, lower: f64, upper: f64 },
    #[error("start at column {column} is {value}, not a finite number")]
    Start { column: usize, value: f64 },
    #[error("ridge is {0}, not a finite number ≥ 0")]
    Ridge(f64),
    #[error("option {name} is {found}, wanted {wanted}")]
    Option { name: &'static str, wanted: &'static str, found: f64 },
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Solves `problem` from `start` (length n, projected onto the bounds; `None` is the point of
/// the box nearest to 0). A start near the answer saves most of the work. Where the answer is
/// not unique (dependent columns), which one comes out may depend on the start.
///
/// Memory beyond `A`: the working columns once (often a few hundred; all of them, so as much
/// as `A`, with [`PathChoice::Gram`]) and their Gram matrix. Polls `watch` for
/// cancellation and leaves its progress alone.
pub fn bounded_least_squares(
    problem: &BoundedProblem,
    start: Option<&[f64]>,
    options: &BoundedOptions,
    watch: &Watch,
) -> Result<BoundedSolution, BoundedError> {
    options.check()?;
    watch.check()?;
    let (system, point) = system::System::new(problem, start)?;
    passes::solve(&system, point, start, options, watch)
}

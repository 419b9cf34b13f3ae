//! A checked problem with weighted, unit-length columns: the only file that reads `A`.

use faer::{Mat, MatRef};
use rayon::prelude::*;

use super::{BoundedError, BoundedProblem, Bounds};
use crate::solve::kernels::{add_scaled, dot, dot_and_square, vectorised};

/// Rows of the residual that one job computes; fixed, so that sums have one order.
const ROW_BLOCK: usize = 1024;
/// Columns whose gradient one job computes.
const COLUMN_BLOCK: usize = 8;
/// Reading fewer entries is not worth waking other threads.
pub const PARALLEL_ENTRIES: usize = 300_000;

/// Unknown j is yⱼ = xⱼ ‖W aⱼ‖, so that every column has unit length.
pub struct System<'a> {
    store: Store<'a>,
    pub rows: usize,
    pub columns: usize,
    target: &'a [f64],
    weights: Option<&'a [f64]>,
    bounds: Bounds<'a>,
    /// ‖W aⱼ‖; a column of norm 0 keeps its start value and has no gradient.
    norms: Vec<f64>,
    pub ridge: f64,
    /// What gradients are compared with: the larger of ‖Wb‖ and ‖W A x₀‖, or 1 if both are 0.
    pub scale: f64,
}

enum Store<'a> {
    Borrowed(MatRef<'a, f64>),
    Copied(Mat<f64>),
}

/// A point and what `A` says about it.
#[derive(Clone, Debug)]
pub struct Point {
    /// Scaled unknowns, length n.
    pub y: Vec<f64>,
    /// W(b − Ax), length m.
    pub residual: Vec<f64>,
    /// Scaled steepest descent, length n.
    pub gradient: Vec<f64>,
}

impl<'a> System<'a> {
    /// Checks the problem and evaluates the start: one pass over `A`.
    pub fn new(
        problem: &BoundedProblem<'a>,
        start: Option<&[f64]>,
    ) -> Result<(Self, Point), BoundedError> {
        let (rows, columns) = (problem.matrix.nrows(), problem.matrix.ncols());
        check(problem, start)?;
        let contiguous = problem.matrix.row_stride() == 1;
        let store = if contiguous {
            Store::Borrowed(problem.matrix)
        } else {
            Store::Copied(problem.matrix.to_owned())
        };
        let mut system = Self {
            store,
            rows,
            columns,
            target: problem.target,
            weights: problem.weights,
            bounds: problem.bounds,
            norms: vec![1.0; columns],
            ridge: problem.ridge,
            scale: 0.0,
        };
        let origin: Vec<f64> = (0..columns).map(|j| system.clamp(j, 0.0)).collect();
        let x: Vec<f64> = match start {
            Some(start) => start.iter().enumerate().map(|(j, &x)| system.clamp(j, x)).collect(),
            None => origin.clone(),
        };

        let residual = system.residual(&x);
        let weighted = system.weighted(&residual);
        let mut sums = vec![(0.0, 0.0); columns];
        system.for_each_column(&mut sums, |j, sum| {
            let column = system.column(j);
            *sum = vectorised!(dot_and_square(column, &weighted, system.weights));
        });
        for (j, &(_, square)) in sums.iter().enumerate() {
            if !square.is_finite() {
                return Err(system.blame_column(j));
            }
        }
        system.norms = sums.iter().map(|&(_, square)| square.sqrt()).collect();

        let target_norm = norm(&system.weighted(system.target));
        let origin_norm = if origin.iter().all(|&x| x == 0.0) {
            0.0
        } else {
            let at_origin = system.residual(&origin);
            let target = system.weighted(system.target);
            norm(&target.iter().zip(&at_origin).map(|(b, r)| b - r).collect::<Vec<_>>())
        };
        system.scale = target_norm.max(origin_norm);
        if system.scale == 0.0 {
            system.scale = 1.0;
        }

        let y: Vec<f64> = x.iter().zip(&system.norms).map(|(x, norm)| x * norm).collect();
        let gradient = (0..columns).map(|j| system.scaled_gradient(j, sums[j].0, y[j])).collect();
        Ok((system, Point { y, residual, gradient }))
    }

    /// The bounds of scaled unknown j; a column of zeros counts as fixed.
    pub fn scaled_bounds(&self, j: usize) -> (f64, f64) {
        let (lower, upper) = self.bounds_of(j);
        (lower * self.norms[j], upper * self.norms[j])
    }

    pub fn is_zero(&self, j: usize) -> bool {
        self.norms[j] == 0.0
    }

    pub fn norm(&self, j: usize) -> f64 {
        self.norms[j]
    }

    /// The unknowns in the caller's units. `start` gives the values of columns of zeros.
    pub fn unscaled(&self, y: &[f64], start: Option<&[f64]>) -> Vec<f64> {
        (0..self.columns)
            .map(|j| {
                let (lower, upper) = self.bounds_of(j);
                if self.is_zero(j) {
                    return self.clamp(j, start.map_or(0.0, |start| start[j]));
                }
                // A bound is given back exactly, not as a rounded product and quotient.
                match y[j] {
                    y if y == lower * self.norms[j] => lower,
                    y if y == upper * self.norms[j] => upper,
                    y => (y / self.norms[j]).clamp(lower, upper),
                }
            })
            .collect()
    }

    /// Brings the residual of `point` up to date with its `y`, and its gradient for these
    /// columns (ascending), or all: one pass over them.
    pub fn evaluate(&self, point: &mut Point, columns: Option<&[usize]>) {
        let x: Vec<f64> = (0..self.columns)
            .map(|j| if self.is_zero(j) { 0.0 } else { point.y[j] / self.norms[j] })
            .collect();
        point.residual = self.residual(&x);
        let weighted = self.weighted(&point.residual);
        let price = |j: usize| {
            let product = vectorised!(dot(self.column(j), &weighted));
            self.scaled_gradient(j, product, point.y[j])
        };
        match columns {
            None => self.for_each_column(&mut point.gradient, |j, gradient| *gradient = price(j)),
            Some(columns) => {
                let mut prices = vec![0.0; columns.len()];
                self.for_each_column(&mut prices, |i, out| *out = price(columns[i]));
                for (&j, price) in columns.iter().zip(prices) {
                    point.gradient[j] = price;
                }
            }
        }
    }

    /// Writes column j, weighted and of unit length, to `out` (length m).
    pub fn copy_column(&self, j: usize, out: &mut [f64]) {
        let factor = 1.0 / self.norms[j];
        match self.weights {
            Some(weights) => {
                for ((out, a), w) in out.iter_mut().zip(self.column(j)).zip(weights) {
                    *out = a * w * factor;
                }
            }
            None => {
                for (out, a) in out.iter_mut().zip(self.column(j)) {
                    *out = a * factor;
                }
            }
        }
    }

    /// W(b − Ax).
    fn residual(&self, x: &[f64]) -> Vec<f64> {
        let support: Vec<usize> = (0..self.columns).filter(|&j| x[j] != 0.0).collect();
        let mut residual = self.target.to_vec();
        let block = |(index, part): (usize, &mut [f64])| {
            let rows = index * ROW_BLOCK..index * ROW_BLOCK + part.len();
            vectorised!({
                for &j in &support {
                    add_scaled(part, -x[j], &self.column(j)[rows.clone()]);
                }
            });
        };
        if self.rows * support.len() < PARALLEL_ENTRIES {
            residual.chunks_mut(ROW_BLOCK).enumerate().for_each(block);
        } else {
            residual.par_chunks_mut(ROW_BLOCK).enumerate().for_each(block);
        }
        self.weighted(&residual)
    }

    fn weighted(&self, values: &[f64]) -> Vec<f64> {
        match self.weights {
            Some(weights) => values.iter().zip(weights).map(|(v, w)| v * w).collect(),
            None => values.to_vec(),
        }
    }

    fn scaled_gradient(&self, j: usize, product: f64, y: f64) -> f64 {
        if self.is_zero(j) { 0.0 } else { product / self.norms[j] - self.ridge * self.ridge * y }
    }

    fn for_each_column<T: Send>(&self, out: &mut [T], job: impl Fn(usize, &mut T) + Sync) {
        let block = |(index, part): (usize, &mut [T])| {
            for (offset, out) in part.iter_mut().enumerate() {
                job(index * COLUMN_BLOCK + offset, out);
            }
        };
        if self.rows * out.len() < PARALLEL_ENTRIES {
            out.chunks_mut(COLUMN_BLOCK).enumerate().for_each(block);
        } else {
            out.par_chunks_mut(COLUMN_BLOCK).enumerate().for_each(block);
        }
    }

    fn column(&self, j: usize) -> &[f64] {
        let matrix = match &self.store {
            Store::Borrowed(matrix) => *matrix,
            Store::Copied(matrix) => matrix.as_ref(),
        };
        let column = matrix.col(j).try_as_col_major();
        column.expect("the store is column-major").as_slice()
    }

    fn bounds_of(&self, j: usize) -> (f64, f64) {
        match self.bounds {
            Bounds::NonNegative => (0.0, f64::INFINITY),
            Bounds::Between { lower, upper } => (lower[j], upper[j]),
        }
    }

    fn clamp(&self, j: usize, x: f64) -> f64 {
        let (lower, upper) = self.bounds_of(j);
        x.clamp(lower, upper)
    }

    fn blame_column(&self, j: usize) -> BoundedError {
        match self.column(j).iter().position(|value| !value.is_finite()) {
            Some(row) => BoundedError::MatrixEntry { row, column: j, value: self.column(j)[row] },
            None => BoundedError::ColumnTooLarge { column: j },
        }
    }
}

pub fn norm(values: &[f64]) -> f64 {
    dot(values, values).sqrt()
}

fn check(problem: &BoundedProblem, start: Option<&[f64]>) -> Result<(), BoundedError> {
    let (rows, columns) = (problem.matrix.nrows(), problem.matrix.ncols());
    let length = |what, found, wanted| {
        if found == wanted { Ok(()) } else { Err(BoundedError::Dimension { what, wanted, found }) }
    };
    length("target", problem.target.len(), rows)?;
    if let Some(weights) = problem.weights {
        length("weights", weights.len(), rows)?;
        for (row, &value) in weights.iter().enumerate() {
            if !(value.is_finite() && value >= 0.0) {
                return Err(BoundedError::Weight { row, value });
            }
        }
    }
    for (row, &value) in problem.target.iter().enumerate() {
        let weight = problem.weights.map_or(1.0, |weights| weights[row]);
        if !((weight * value) * (weight * value) * rows as f64).is_finite() || !value.is_finite() {
            return Err(BoundedError::TargetEntry { row, value });
        }
    }
    if let Bounds::Between { lower, upper } = problem.bounds {
        length("lower", lower.len(), columns)?;
        length("upper", upper.len(), columns)?;
        for (column, (&lower, &upper)) in lower.iter().zip(upper).enumerate() {
            // Written so that NaN fails too.
            let some_number = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !some_number {
                return Err(BoundedError::Bounds { column, lower, upper });
            }
        }
    }
    if let Some(start) = start {
        length("start", start.len(), columns)?;
        for (column, &value) in start.iter().enumerate() {
            if !value.is_finite() {
                return Err(BoundedError::Start { column, value });
            }
        }
    }
    if !(problem.ridge.is_finite() && problem.ridge >= 0.0) {
        return Err(BoundedError::Ridge(problem.ridge));
    }
    Ok(())
}

//! The problem on the working columns alone, as a correction of the present point: an exact
//! gradient to start from and, for how it changes, either inner products or an orthogonal factor.

use faer::{Mat, MatRef};

use super::cholesky::ActiveCholesky;
use super::system::{Point, System};
use crate::solve::kernels::{add_scaled, column_of, column_of_mut, dot, vectorised};

/// A quadratic over the working columns with a list of free ones, over which it can be solved.
pub trait Model {
    /// The free columns in order of entry.
    fn free(&self) -> &[usize];
    /// Frees a column; refuses (false) one that depends on those already free.
    fn enter(&mut self, column: usize) -> bool;
    /// Frees these columns and no others, where that is faster at once than one after the other and
    /// none of them depends on the others; else (false) nothing is changed.
    fn replace(&mut self, _columns: &[usize]) -> bool {
        false
    }
    /// Takes the columns at these ascending positions of `free()` out of it.
    fn leave(&mut self, positions: &[usize]);
    /// Steepest descent at the present point, for every working column.
    fn gradient(&self) -> &[f64];
    /// The step, per free column, to the minimum over the free columns.
    fn newton_step(&self) -> Vec<f64>;
    /// Moves the present point by `step`, per free column.
    fn advance(&mut self, step: &[f64]);
}

/// What the square of a unit column must keep beyond the free columns to be freed with them. The
/// Gram matrix has that part to about 1e-15, so its relative error, by which each pass
/// reduces the error of the point, stays below 1e-4.
const GRAM_THRESHOLD: f64 = 1e-11;
/// The same for the length, with an orthogonal factor, which has it to about 1e-15.
const FACTOR_THRESHOLD: f64 = 1e-13;

/// The Gram matrix, and the Cholesky factor of its free part.
pub struct GramModel<'a> {
    gram: MatRef<'a, f64>,
    gradient: Vec<f64>,
    free: Vec<usize>,
    factor: ActiveCholesky,
}

impl<'a> GramModel<'a> {
    /// `gram` is symmetric, w × w, column-major, with the ridge on its diagonal.
    pub fn new(gram: MatRef<'a, f64>, gradient: Vec<f64>) -> Self {
        Self { gram, gradient, free: Vec::new(), factor: ActiveCholesky::default() }
    }
}

/// Columns from which on their factor is made at once, rather than one after the other.
const MANY: usize = 32;

impl Model for GramModel<'_> {
    fn free(&self) -> &[usize] {
        &self.free
    }

    fn enter(&mut self, column: usize) -> bool {
        let inner = column_of(self.gram, column);
        let products = self.free.iter().map(|&other| inner[other]).collect();
        let entered = self.factor.append(products, inner[column], GRAM_THRESHOLD);
        if entered {
            self.free.push(column);
        }
        entered
    }

    fn replace(&mut self, columns: &[usize]) -> bool {
        let (count, gram) = (columns.len(), self.gram);
        if count < MANY {
            return false;
        }
        let mut some = Mat::zeros(count, count);
        for (j, &column) in columns.iter().enumerate() {
            let inner = column_of(gram, column);
            for (value, &other) in column_of_mut(&mut some, j).iter_mut().zip(columns) {
                *value = inner[other];
            }
        }
        let Some(factor) = ActiveCholesky::of(&some, GRAM_THRESHOLD) else { return false };
        (self.factor, self.free) = (factor, columns.to_vec());
        true
    }

    fn leave(&mut self, positions: &[usize]) {
        let Some(&first) = positions.first() else { return };
        // Removing one costs about three times what entering one costs, per later column.
        if positions.len() <= 3 {
            for &position in positions.iter().rev() {
                self.factor.remove(position);
                self.free.remove(position);
            }
            return;
        }
        let later = self.free.split_off(first);
        if later.len() - positions.len() >= MANY {
            let kept = later.iter().enumerate();
            let kept = kept.filter(|(i, _)| positions.binary_search(&(first + i)).is_err());
            let mut all = self.free.clone();
            all.extend(kept.map(|(_, &column)| column));
            if self.replace(&all) {
                return;
            }
        }
        self.factor.truncate(first);
        for (offset, &column) in later.iter().enumerate() {
            if positions.binary_search(&(first + offset)).is_err() {
                // A column refused here, by rounding, stays where it is and may come back.
                self.enter(column);
            }
        }
    }

    fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    fn newton_step(&self) -> Vec<f64> {
        let mut step: Vec<f64> = self.free.iter().map(|&j| self.gradient[j]).collect();
        self.factor.solve(&mut step);
        step
    }

    fn advance(&mut self, step: &[f64]) {
        vectorised!({
            for (&column, &step) in self.free.iter().zip(step) {
                if step != 0.0 {
                    add_scaled(&mut self.gradient, -step, column_of(self.gram, column));
                }
            }
        });
    }
}

/// Columns themselves (or the triangle of their QR factors, which has the same inner products
/// without having squared anything), and an orthonormal basis of the free ones.
pub struct FactorModel {
    columns: Mat<f64>,
    residual: Vec<f64>,
    gradient: Vec<f64>,
    free: Vec<usize>,
    basis: Vec<Vec<f64>>,
    /// Column i of the triangle that makes the i-th free column out of the basis.
    triangle: Vec<Vec<f64>>,
}

impl FactorModel {
    /// The working columns without their squares: themselves, or, when there are more rows than
    /// columns, the triangle of their QR factors and the residual in that basis.
    pub fn of(system: &System, members: &[usize], point: &Point) -> Self {
        let count = members.len();
        // A ridge is as many rows more, with residual 0 − ridge y.
        let extra = if system.ridge > 0.0 { count } else { 0 };
        let rows = system.rows + extra;
        let mut all = Mat::zeros(rows, count + 1);
        for (position, &j) in members.iter().enumerate() {
            let column = all.col_mut(position).try_as_col_major_mut().expect("column-major");
            system.copy_column(j, &mut column.as_slice_mut()[..system.rows]);
            if extra > 0 {
                all[(system.rows + position, position)] = system.ridge;
                all[(system.rows + position, count)] = -system.ridge * point.y[j];
            }
        }
        for (row, &value) in point.residual.iter().enumerate() {
            all[(row, count)] = value;
        }
        let small = if rows > count + 1 { all.qr().thin_R().to_owned() } else { all };
        let columns = small.subcols(0, count).to_owned();
        let residual = small.col(count).iter().copied().collect();
        Self::new(columns, residual)
    }

    fn new(columns: Mat<f64>, residual: Vec<f64>) -> Self {
        let gradient = vec![0.0; columns.ncols()];
        let (free, basis, triangle) = (Vec::new(), Vec::new(), Vec::new());
        let mut model = Self { columns, residual, gradient, free, basis, triangle };
        model.renew_gradient();
        model
    }

    fn renew_gradient(&mut self) {
        for (j, gradient) in self.gradient.iter_mut().enumerate() {
            *gradient = dot(column_of(self.columns.as_ref(), j), &self.residual);
        }
    }
}

impl Model for FactorModel {
    fn free(&self) -> &[usize] {
        &self.free
    }

    fn enter(&mut self, column: usize) -> bool {
        let mut rest = column_of(self.columns.as_ref(), column).to_vec();
        let length = dot(&rest, &rest).sqrt();
        let mut parts = vec![0.0; self.basis.len()];
        // Gram-Schmidt twice is orthogonal to rounding (Giraud, Langou, Rozložník 2005).
        for _ in 0..2 {
            for (part, basis) in parts.iter_mut().zip(&self.basis) {
                let product = dot(basis, &rest);
                add_scaled(&mut rest, -product, basis);
                *part += product;
            }
        }
        let left = dot(&rest, &rest).sqrt();
        if left.is_nan() || left <= FACTOR_THRESHOLD * length {
            return false;
        }
        rest.iter_mut().for_each(|value| *value /= left);
        parts.push(left);
        self.basis.push(rest);
        self.triangle.push(parts);
        self.free.push(column);
        true
    }

    fn leave(&mut self, positions: &[usize]) {
        let Some(&first) = positions.first() else { return };
        let later = self.free.split_off(first);
        self.basis.truncate(first);
        self.triangle.truncate(first);
        for (offset, &column) in later.iter().enumerate() {
            if positions.binary_search(&(first + offset)).is_err() {
                self.enter(column);
            }
        }
    }

    fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    fn newton_step(&self) -> Vec<f64> {
        let mut step: Vec<f64> =
            self.basis.iter().map(|basis| dot(basis, &self.residual)).collect();
        for (i, column) in self.triangle.iter().enumerate().rev() {
            step[i] /= column[i];
            let value = step[i];
            add_scaled(&mut step[..i], -value, &column[..i]);
        }
        step
    }

    fn advance(&mut self, step: &[f64]) {
        for (&column, &step) in self.free.iter().zip(step) {
            add_scaled(&mut self.residual, -step, column_of(self.columns.as_ref(), column));
        }
        self.renew_gradient();
    }
}

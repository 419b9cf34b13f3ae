//! By how much a lamp would lower the sum of squared residuals, if the rest of the model were
//! fitted again with it.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use crate::reconstruct::joint::linearised::Residue;
use crate::solve::bounded::bounded_quadratic;
use crate::solve::kernels::{column_of, dot, vectorised};
use crate::watch::Watch;

/// The columns of some lamps in one channel's linearised problem.
pub struct Scaled {
    columns: Vec<f32>,
    /// Their parts along the basis, basis × columns.
    parts: Mat<f32>,
}

impl Scaled {
    /// `columns` has those of one lamp after the other, `lobes` π f/ρ_s at each
    /// row for each.
    pub fn new(columns: &[f32], lobes: &[f32], residue: &Residue) -> Self {
        let rows = residue.residual.len();
        let mut scaled = columns.to_vec();
        let size = columns.len() / lobes.len() * rows;
        let lamps = scaled.chunks_exact_mut(size).zip(lobes.chunks_exact(rows));
        for (lamp, lobes) in lamps {
            let factors: Vec<f32> = residue
                .scale
                .iter()
                .zip(&residue.gloss)
                .zip(lobes)
                .map(|((scale, gloss), lobe)| scale + gloss * lobe)
                .collect();
            for column in lamp.chunks_exact_mut(rows) {
                for (value, factor) in column.iter_mut().zip(&factors) {
                    *value *= factor;
                }
            }
        }
        let count = scaled.len() / rows;
        let mut parts = Mat::zeros(residue.basis.ncols(), count);
        let matrix = MatRef::from_column_major_slice(&scaled, rows, count);
        let basis = residue.basis.transpose();
        matmul(parts.as_mut(), Accum::Replace, basis, matrix, 1.0, Par::Seq);
        Self { columns: scaled, parts }
    }

    fn column(&self, index: usize) -> &[f32] {
        let rows = self.columns.len() / self.parts.ncols();
        &self.columns[index * rows..(index + 1) * rows]
    }

    fn parts(&self, index: usize) -> &[f32] {
        column_of(self.parts.as_ref(), index)
    }

    /// Adds to the gain of each column by how much the column alone lowers the sum of squared
    /// residuals; nothing if the basis already spans it.
    pub fn add_gains(&self, residue: &Residue, gains: &mut [f32]) {
        vectorised!({
            for (k, gain) in gains.iter_mut().enumerate() {
                let (column, parts) = (self.column(k), self.parts(k));
                let square = dot(column, column);
                let towards = -dot(column, &residue.residual);
                let kept = square - dot(parts, parts);
                if towards > 0.0 && kept > 1e-3 * square {
                    *gain += towards * towards / kept;
                }
            }
        });
    }

    /// By how much the columns of one lamp together lower the sum of squared residuals, with
    /// emissions of at least 0.
    pub fn explained(&self, residue: &Residue) -> f64 {
        let count = self.parts.ncols();
        let mut gram = Mat::zeros(count, count);
        let mut linear = vec![0.0; count];
        vectorised!({
            for i in 0..count {
                linear[i] = -f64::from(dot(self.column(i), &residue.residual));
                for j in 0..=i {
                    let both = dot(self.parts(i), self.parts(j));
                    let left = f64::from(dot(self.column(i), self.column(j)) - both);
                    gram[(i, j)] = left;
                    gram[(j, i)] = left;
                }
            }
        });
        explained_by(&gram, &linear)
    }
}

/// max 2 bᵀx − xᵀHx over x ≥ 0.
fn explained_by(gram: &Mat<f64>, linear: &[f64]) -> f64 {
    let count = linear.len();
    // What is left of a column after projection in single precision is noise below this.
    let hessian =
        Mat::from_fn(count, count, |i, j| gram[(i, j)] * if i == j { 1.0 + 1e-4 } else { 1.0 });
    let unbounded = vec![f64::INFINITY; count];
    let zero = vec![0.0; count];
    let watch = Watch::new();
    let Ok(x) = bounded_quadratic(hessian.as_ref(), linear, &zero, &unbounded, &zero, &watch)
    else {
        return 0.0;
    };
    let mut value = 0.0;
    for i in 0..count {
        value += 2.0 * linear[i] * x[i];
        for j in 0..count {
            value -= x[i] * hessian[(i, j)] * x[j];
        }
    }
    value
}

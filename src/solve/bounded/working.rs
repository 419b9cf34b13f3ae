//! The working columns: copies that are weighted and of unit length, and their Gram matrix,
//! both of which grow by a few columns at a time.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use super::system::System;

/// Columns stored, and multiplied, together. Fixed, so that products have one order of sums.
const CHUNK: usize = 64;

pub struct Working {
    /// The columns' numbers in `A`, in order of entry.
    pub members: Vec<usize>,
    is_member: Vec<bool>,
    rows: usize,
    /// m × CHUNK each.
    chunks: Vec<Mat<f64>>,
    /// Symmetric; the leading w × w part is in use.
    gram: Mat<f64>,
}

impl Working {
    pub fn new(system: &System) -> Self {
        Self {
            members: Vec::new(),
            is_member: vec![false; system.columns],
            rows: system.rows,
            chunks: Vec::new(),
            gram: Mat::zeros(0, 0),
        }
    }

    pub fn contains(&self, column: usize) -> bool {
        self.is_member[column]
    }

    pub fn gram(&self) -> MatRef<'_, f64> {
        self.gram.submatrix(0, 0, self.members.len(), self.members.len())
    }

    /// Adds columns that are not yet members.
    pub fn extend(&mut self, system: &System, columns: &[usize]) {
        let (before, after) = (self.members.len(), self.members.len() + columns.len());
        self.members.extend_from_slice(columns);
        columns.iter().for_each(|&column| self.is_member[column] = true);
        self.chunks.resize_with(after.div_ceil(CHUNK), || Mat::zeros(self.rows, CHUNK));
        self.copy_columns(system, before);
        self.reserve(before, after);
        self.multiply(before, system.ridge);
    }

    fn copy_columns(&mut self, system: &System, before: usize) {
        let members = &self.members;
        let jobs: Vec<_> = self
            .chunks
            .iter_mut()
            .flat_map(|chunk| chunk.col_iter_mut())
            .zip(members)
            .skip(before)
            .collect();
        jobs.into_par_iter().for_each(|(out, &column)| {
            let out = out.try_as_col_major_mut().expect("chunks are column-major");
            system.copy_column(column, out.as_slice_mut());
        });
    }

    /// Makes room for `size` columns, keeping the products of the first `used`.
    fn reserve(&mut self, used: usize, size: usize) {
        if size > self.gram.nrows() {
            let capacity = size.max((2 * used).min(self.is_member.len()));
            let mut gram = Mat::zeros(capacity, capacity);
            gram.submatrix_mut(0, 0, used, used).copy_from(self.gram.submatrix(0, 0, used, used));
            self.gram = gram;
        }
    }

    /// Fills in the products of the columns from `before` on with all.
    fn multiply(&mut self, before: usize, ridge: f64) {
        let after = self.members.len();
        let range =
            |chunk: usize, from: usize| (chunk * CHUNK).max(from)..((chunk + 1) * CHUNK).min(after);
        let first = before / CHUNK;
        let pairs: Vec<(usize, usize)> = (first..self.chunks.len())
            .flat_map(|new| (0..=new).map(move |other| (other, new)))
            .collect();
        let tiles: Vec<Mat<f64>> = pairs
            .par_iter()
            .map(|&(other, new)| {
                let (left, right) = (range(other, 0), range(new, before));
                let mut tile = Mat::zeros(left.len(), right.len());
                let part = |chunk: usize, range: &std::ops::Range<usize>| {
                    self.chunks[chunk].subcols(range.start - chunk * CHUNK, range.len())
                };
                let (a, b) = (part(other, &left), part(new, &right));
                matmul(&mut tile, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
                tile
            })
            .collect();
        for (&(other, new), tile) in pairs.iter().zip(&tiles) {
            for (j, column) in range(new, before).enumerate() {
                for (i, row) in range(other, 0).enumerate() {
                    self.gram[(row, column)] = tile[(i, j)];
                    self.gram[(column, row)] = tile[(i, j)];
                }
            }
        }
        for column in before..after {
            self.gram[(column, column)] = 1.0 + ridge * ridge;
        }
    }
}

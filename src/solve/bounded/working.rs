//! The working columns: copies that are weighted and of unit length, and their Gram matrix.
//! Columns enter a few at a time, in the places of ones no longer wanted where there are such.

use faer::linalg::matmul::matmul;
use faer::{Accum, ColMut, Mat, MatRef, Par};
use rayon::prelude::*;

use super::system::{PARALLEL_ENTRIES, System};

/// Columns stored, and multiplied, together. Fixed, so that products have one order of sums.
const CHUNK: usize = 64;
/// New columns that one job multiplies a chunk with.
const STRIP: usize = 32;

pub struct Working {
    /// The columns' numbers in `A`, by place.
    members: Vec<usize>,
    is_member: Vec<bool>,
    /// m × CHUNK each; place p is column p % CHUNK of chunk p / CHUNK.
    chunks: Vec<Mat<f64>>,
    /// The newest columns side by side, m × CHUNK, to multiply all others with.
    fresh: Mat<f64>,
    /// Symmetric; the leading w × w part is in use.
    gram: Mat<f64>,
}

impl Working {
    pub fn new(system: &System) -> Self {
        Self {
            members: Vec::new(),
            is_member: vec![false; system.columns],
            chunks: Vec::new(),
            fresh: Mat::zeros(system.rows, CHUNK.min(system.columns)),
            gram: Mat::zeros(0, 0),
        }
    }

    pub fn members(&self) -> &[usize] {
        &self.members
    }

    pub fn contains(&self, column: usize) -> bool {
        self.is_member[column]
    }

    pub fn gram(&self) -> MatRef<'_, f64> {
        self.gram.submatrix(0, 0, self.members.len(), self.members.len())
    }

    /// Adds columns that are not yet members, first in the places `spare`, whose members leave;
    /// places beyond the number of columns are left alone.
    pub fn extend(&mut self, system: &System, columns: &[usize], spare: &[usize]) {
        let before = self.members.len();
        let reused = spare.len().min(columns.len());
        let after = before + columns.len() - reused;
        self.reserve(system.rows, before, after);
        let places: Vec<usize> = spare[..reused].iter().copied().chain(before..after).collect();
        for (columns, places) in columns.chunks(CHUNK).zip(places.chunks(CHUNK)) {
            self.admit(system, columns, places);
        }
    }

    /// Makes room for `size` columns, keeping the products of the first `used`.
    fn reserve(&mut self, rows: usize, used: usize, size: usize) {
        self.chunks.resize_with(size.div_ceil(CHUNK), || Mat::zeros(rows, CHUNK));
        if size > self.gram.nrows() {
            let capacity = size.max((2 * used).min(self.is_member.len()));
            let mut gram = Mat::zeros(capacity, capacity);
            gram.submatrix_mut(0, 0, used, used).copy_from(self.gram.submatrix(0, 0, used, used));
            self.gram = gram;
        }
    }

    /// Puts at most CHUNK columns in `places`, those beyond the present end in order.
    fn admit(&mut self, system: &System, columns: &[usize], places: &[usize]) {
        let copy = |(out, &column): (ColMut<f64>, &usize)| {
            let out = out.try_as_col_major_mut().expect("matrices are column-major");
            system.copy_column(column, out.as_slice_mut());
        };
        let jobs: Vec<_> = self.fresh.col_iter_mut().zip(columns).collect();
        if system.rows * columns.len() < PARALLEL_ENTRIES {
            jobs.into_iter().for_each(copy);
        } else {
            jobs.into_par_iter().for_each(copy);
        }
        for (i, (&column, &place)) in columns.iter().zip(places).enumerate() {
            if place == self.members.len() {
                self.members.push(column);
            } else {
                self.is_member[self.members[place]] = false;
                self.members[place] = column;
            }
            self.is_member[column] = true;
            self.chunks[place / CHUNK].col_mut(place % CHUNK).copy_from(self.fresh.col(i));
        }

        let used = self.members.len();
        let pairs: Vec<(usize, usize)> = (0..used.div_ceil(CHUNK))
            .flat_map(|chunk| (0..columns.len()).step_by(STRIP).map(move |first| (chunk, first)))
            .collect();
        let products: Vec<Mat<f64>> = pairs
            .par_iter()
            .map(|&(chunk, first)| {
                let old = self.chunks[chunk].subcols(0, CHUNK.min(used - chunk * CHUNK));
                let new = self.fresh.subcols(first, STRIP.min(columns.len() - first));
                let mut product = Mat::zeros(old.ncols(), new.ncols());
                matmul(&mut product, Accum::Replace, old.transpose(), new, 1.0, Par::Seq);
                product
            })
            .collect();
        for (&(chunk, first), product) in pairs.iter().zip(&products) {
            for j in 0..product.ncols() {
                let place = places[first + j];
                for i in 0..product.nrows() {
                    let other = chunk * CHUNK + i;
                    self.gram[(other, place)] = product[(i, j)];
                    self.gram[(place, other)] = product[(i, j)];
                }
            }
        }
        for &place in places {
            self.gram[(place, place)] = 1.0 + system.ridge * system.ridge;
        }
    }
}

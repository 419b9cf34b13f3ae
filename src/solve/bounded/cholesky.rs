//! The Cholesky factor of the Gram matrix of a changing list of columns.

use faer::{Mat, Side};

use crate::solve::kernels::{add_scaled, dot, vectorised};

/// L with L Lᵀ = H restricted to the columns entered so far, in order of entry. Row i is stored
/// with its i + 1 entries.
#[derive(Debug, Default)]
pub struct ActiveCholesky {
    rows: Vec<Vec<f64>>,
}

/// As many numbers as a line of the cache has.
const COLUMNS_AT_ONCE: usize = 8;

impl ActiveCholesky {
    /// Of a whole Gram matrix in blocks, several times as fast as column after column. `None` where
    /// [`append`](Self::append) would refuse a column.
    pub fn of(gram: &Mat<f64>, threshold: f64) -> Option<Self> {
        let factor = gram.llt(Side::Lower).ok()?;
        let factor = factor.L();
        let is_free = |i: usize| factor[(i, i)].powi(2) > threshold * gram[(i, i)];
        let count = gram.nrows();
        if !(0..count).all(is_free) {
            return None;
        }
        let mut rows: Vec<Vec<f64>> = (0..count).map(|i| Vec::with_capacity(i + 1)).collect();
        // A few columns at a time, so that what is read of each stays in the cache from row to row.
        for first in (0..count).step_by(COLUMNS_AT_ONCE) {
            for (i, row) in rows.iter_mut().enumerate().skip(first) {
                let columns = first..(first + COLUMNS_AT_ONCE).min(i + 1);
                row.extend(columns.map(|j| factor[(i, j)]));
            }
        }
        Some(Self { rows })
    }

    /// Appends a column with inner products `products` with the columns before it and `square`
    /// with itself. Refuses (false, nothing changed) when what is left of the square beyond
    /// the earlier columns is at most `threshold · square`: the column depends on those.
    pub fn append(&mut self, mut products: Vec<f64>, square: f64, threshold: f64) -> bool {
        vectorised!(self.forward(&mut products));
        let pivot = square - dot(&products, &products);
        if pivot.is_nan() || pivot <= threshold * square {
            return false;
        }
        products.push(pivot.sqrt());
        self.rows.push(products);
        true
    }

    /// Removes the column at `position`; the later ones move up.
    pub fn remove(&mut self, position: usize) {
        self.rows.remove(position);
        // The rows below now have one entry too many; rotations of neighbouring columns fold
        // it back into the triangle.
        let mut rotations: Vec<(f64, f64)> = Vec::with_capacity(self.rows.len() - position);
        for row in &mut self.rows[position..] {
            for (offset, &(cosine, sine)) in rotations.iter().enumerate() {
                let column = position + offset;
                let (left, right) = (row[column], row[column + 1]);
                row[column] = cosine * left + sine * right;
                row[column + 1] = cosine * right - sine * left;
            }
            let column = position + rotations.len();
            let (left, right) = (row[column], row[column + 1]);
            let length = left.hypot(right);
            rotations.push((left / length, right / length));
            row[column] = length;
            row.truncate(column + 1);
        }
    }

    /// Forgets all but the first `count` columns.
    pub fn truncate(&mut self, count: usize) {
        self.rows.truncate(count);
    }

    /// Solves L Lᵀ z = `right` in place.
    pub fn solve(&self, right: &mut [f64]) {
        vectorised!({
            self.forward(right);
            for (i, row) in self.rows.iter().enumerate().rev() {
                let value = right[i] / row[i];
                right[i] = value;
                add_scaled(&mut right[..i], -value, &row[..i]);
            }
        });
    }

    #[inline(always)]
    fn forward(&self, right: &mut [f64]) {
        for (i, row) in self.rows.iter().enumerate() {
            right[i] = (right[i] - dot(&row[..i], &right[..i])) / row[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::Random;

    #[test]
    fn solves_after_insertions_and_removals() {
        let (rows, columns) = (30, 12);
        let mut random = Random::new(1, 0, 0);
        let a: Vec<Vec<f64>> = (0..columns)
            .map(|_| (0..rows).map(|_| f64::from(random.uniform())).collect())
            .collect();
        let mut factor = ActiveCholesky::default();
        let mut list: Vec<usize> = Vec::new();
        let enter = |factor: &mut ActiveCholesky, list: &mut Vec<usize>, j: usize| {
            let products = list.iter().map(|&i| dot(&a[i], &a[j])).collect();
            assert!(factor.append(products, dot(&a[j], &a[j]), 1e-10));
            list.push(j);
        };
        for j in 0..8 {
            enter(&mut factor, &mut list, j);
        }
        for position in [7, 0, 3] {
            factor.remove(position);
            list.remove(position);
        }
        for j in 8..12 {
            enter(&mut factor, &mut list, j);
        }
        let mut z: Vec<f64> = (0..list.len()).map(|i| 1.0 + i as f64).collect();
        factor.solve(&mut z);
        for (position, &i) in list.iter().enumerate() {
            let product: f64 = list.iter().zip(&z).map(|(&j, z)| dot(&a[i], &a[j]) * z).sum();
            assert!((product - (1.0 + position as f64)).abs() < 1e-10);
        }
        // The same list at once.
        let gram = Mat::from_fn(list.len(), list.len(), |i, j| dot(&a[list[i]], &a[list[j]]));
        let at_once = ActiveCholesky::of(&gram, 1e-10).unwrap();
        let mut same: Vec<f64> = (0..list.len()).map(|i| 1.0 + i as f64).collect();
        at_once.solve(&mut same);
        for (z, same) in z.iter().zip(&same) {
            assert!((z - same).abs() < 1e-10 * (1.0 + z.abs()));
        }
        let dependent = Mat::from_fn(3, 3, |i, j| dot(&a[list[i % 2]], &a[list[j % 2]]));
        assert!(ActiveCholesky::of(&dependent, 1e-10).is_none());

        let twice = list.iter().map(|&i| dot(&a[i], &a[list[0]])).collect();
        assert!(!factor.append(twice, dot(&a[list[0]], &a[list[0]]), 1e-10));
    }
}

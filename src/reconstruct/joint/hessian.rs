//! The second derivatives of the joint problem, kept while the computed radiance changes little.
//!
//! They take most of a large solve's time and memory traffic, while the gradient, which decides
//! where it ends, takes little: near the minimum, steps with the second derivatives of some steps
//! before arrive at the same place (Shamanskii 1967, on Newton's method with a matrix that is kept
//! for several steps).

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, MatMut, Par};

use crate::reconstruct::joint::system::{Channel, RowScales};
use crate::solve::kernels::{column_of, column_of_mut};

/// Jᵀ J, J being the Jacobian of the weighted residuals with the slopes of some state, over as
/// many columns of emission as were asked for, and the reflectances.
pub struct Hessian {
    pub row_scales: RowScales,
    /// Where each column of emission is in `products`; `OUTSIDE` for those not asked for.
    place: Vec<usize>,
    /// J's columns of emission in blocks, in the order they came in.
    blocks: Vec<Mat<f64>>,
    products: Mat<f64>,
}

const OUTSIDE: usize = usize::MAX;
/// The change of the slopes, as a part of what they are, up to which they are kept: a step then
/// leaves about twice this part of the way to the minimum.
const NEAR: f64 = 0.03;

impl Hessian {
    /// Over no columns of emission yet.
    pub fn new(row_scales: RowScales, columns: usize) -> Self {
        Self {
            row_scales,
            place: vec![OUTSIDE; columns],
            blocks: Vec::new(),
            products: Mat::zeros(0, 0),
        }
    }

    /// Whether slopes have changed so little that this is of use.
    pub fn is_near(&self, now: &RowScales) -> bool {
        self.row_scales.change(now) <= NEAR
    }

    /// Takes in those of the columns of emission that it has not.
    pub fn extend(&mut self, channel: &Channel, columns: &[usize]) {
        let fresh: Vec<usize> =
            columns.iter().copied().filter(|&column| self.place[column] == OUTSIDE).collect();
        if fresh.is_empty() {
            return;
        }
        let before = self.products.ncols();
        let block = channel.of_emissions(&self.row_scales, &fresh);
        let mut products = Mat::zeros(before + fresh.len(), before + fresh.len());
        products.submatrix_mut(0, 0, before, before).copy_from(&self.products);
        self.times(&block, products.submatrix_mut(before, 0, fresh.len(), before));
        lower_gram(products.submatrix_mut(before, before, fresh.len(), fresh.len()), &block);
        mirror(&mut products);
        for (offset, column) in fresh.into_iter().enumerate() {
            self.place[column] = before + offset;
        }
        self.products = products;
        self.blocks.push(block);
    }

    /// BᵀJ over the columns of emission.
    fn times(&self, block: &Mat<f64>, mut out: MatMut<'_, f64>) {
        let mut first = 0;
        for own in &self.blocks {
            let out = out.as_mut().subcols_mut(first, own.ncols());
            matmul(out, Accum::Replace, block.transpose(), own, 1.0, Par::Seq);
            first += own.ncols();
        }
    }

    /// Over some columns of emission that it has, then the reflectances, whose columns of J are
    /// given. These are of the present state always: what is least certain, all reflectances
    /// larger and all light weaker, is a small difference between theirs and the emissions'.
    pub fn over(&self, columns: &[usize], reflectances: &Mat<f64>) -> Mat<f64> {
        let count = reflectances.ncols();
        let mut mixed = Mat::zeros(count, self.products.ncols());
        self.times(reflectances, mixed.as_mut());
        let own = gram(reflectances);
        let lit = columns.len();
        let place: Vec<usize> = columns.iter().map(|&column| self.place[column]).collect();
        let mut over = Mat::zeros(lit + count, lit + count);
        for j in 0..lit + count {
            let (of_emissions, of_reflectances) = column_of_mut(&mut over, j).split_at_mut(lit);
            if let Some(&of) = place.get(j) {
                let inner = column_of(self.products.as_ref(), of);
                of_emissions.iter_mut().zip(&place).for_each(|(value, &i)| *value = inner[i]);
                of_reflectances.copy_from_slice(column_of(mixed.as_ref(), of));
            } else {
                let of = j - lit;
                let mixed =
                    of_emissions.iter_mut().zip(&place).map(|(value, &i)| (value, mixed[(of, i)]));
                mixed.for_each(|(value, product)| *value = product);
                of_reflectances.copy_from_slice(column_of(own.as_ref(), of));
            }
        }
        over
    }
}

/// MᵀM.
pub fn gram(matrix: &Mat<f64>) -> Mat<f64> {
    let mut gram = Mat::zeros(matrix.ncols(), matrix.ncols());
    lower_gram(gram.as_mut(), matrix);
    mirror(&mut gram);
    gram
}

fn lower_gram(out: MatMut<'_, f64>, matrix: &Mat<f64>) {
    // On one thread: channels and light sets are what runs side by side, and sums keep their
    // order.
    triangular::matmul(
        out,
        BlockStructure::TriangularLower,
        Accum::Replace,
        matrix.transpose(),
        BlockStructure::Rectangular,
        matrix,
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

fn mirror(lower: &mut Mat<f64>) {
    for column in 0..lower.ncols() {
        for row in 0..column {
            lower[(row, column)] = lower[(column, row)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::Random;
    use crate::reconstruct::joint::system::{Design, Rows};

    /// Columns that came in one after another, against sums over the rows.
    #[test]
    fn products_are_those_of_the_columns_asked_for() {
        let mut random = Random::new(5, 0, 0);
        let mut draw = || f64::from(random.uniform());
        let (count, columns) = (20, 6);
        // Every third row is glossy.
        let glossy: Vec<Option<usize>> =
            (0..count).map(|r| (r % 3 == 0).then_some(r / 3)).collect();
        let diffuse = Mat::from_fn(count, columns, |_, _| draw());
        let specular = Mat::from_fn(count.div_ceil(3), columns, |_, _| draw());
        let by_diffuse: Vec<f64> = (0..count).map(|_| draw()).collect();
        let by_specular: Vec<f64> = (0..count).map(|_| draw()).collect();
        let reflectances = Mat::from_fn(count, 2, |_, _| draw());
        let design = Design {
            diffuse: diffuse.clone(),
            base: Default::default(),
            specular: specular.clone(),
            specular_base: Default::default(),
        };
        let rows = Rows { glossy: glossy.clone(), ..Rows::default() };
        let channel = Channel { rows: &rows, design: &design, channel: 0 };
        let row_scales = RowScales {
            scale: vec![1.0; count],
            diffuse: by_diffuse.clone(),
            specular: (0..count)
                .filter_map(|row| Some((row, glossy[row]?, by_specular[row])))
                .collect(),
        };
        let mut hessian = Hessian::new(row_scales, columns);
        hessian.extend(&channel, &[1, 4]);
        hessian.extend(&channel, &[0, 1, 5]);
        let asked = [0, 4, 5];
        let products = hessian.over(&asked, &reflectances);

        let entry = |row: usize, column: usize| match asked.get(column) {
            Some(&column) => {
                let gloss = glossy[row].map_or(0.0, |g| by_specular[row] * specular[(g, column)]);
                by_diffuse[row] * diffuse[(row, column)] + gloss
            }
            None => reflectances[(row, column - asked.len())],
        };
        assert_eq!((products.nrows(), products.ncols()), (5, 5));
        for i in 0..5 {
            for j in 0..5 {
                let sum: f64 = (0..count).map(|row| entry(row, i) * entry(row, j)).sum();
                assert!((products[(i, j)] - sum).abs() < 1e-12 * sum, "{i}, {j}");
            }
        }
    }
}

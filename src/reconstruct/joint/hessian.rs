//! The second derivatives of the joint problem, taken over from step to step and from fit to fit.
//!
//! They take most of a large solve's time, while the gradient, which decides where it ends, takes
//! little: near the minimum, steps with the second derivatives of some steps before arrive at the same
//! place (Shamanskii 1967, on Newton's method with a matrix that is kept for several steps). They are a
//! sum over rows. Where another state, other weights, or another lobe of a material change the part of
//! some rows, these rows are taken out of the sum and put in anew.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, MatMut, MatRef, Par};

use crate::reconstruct::joint::rows::Run;
use crate::reconstruct::joint::system::Channel;
use crate::solve::kernels::{
    TOGETHER, column_of, column_of_mut, dot, dots_single, groups, vectorised,
};

/// Jᵀ J, J being the Jacobian of the weighted residuals with the slopes of some state, over as
/// many columns of emission as were asked for.
#[derive(Clone, Debug)]
pub struct Hessian {
    /// What the part of each row was made with.
    pub row_scales: RowScales,
    /// Where each column of emission is in `products`; `OUTSIDE` for those not asked for.
    place: Vec<usize>,
    /// The columns of emission in `products`.
    columns: Vec<usize>,
    products: Mat<f64>,
}

/// What the columns of emission in the Jacobian of the weighted residuals are multiplied by.
#[derive(Clone, Debug)]
pub struct RowScales {
    /// Per row the root of the second derivative by π L̂.
    pub scale: Vec<f64>,
    /// Per row that times ρ_d: the factor of k.
    pub diffuse: Vec<f64>,
    /// Per glossy row that times ρ_s: the factor of (n+2)/2 cosⁿγ k.
    pub specular: Vec<f64>,
}

/// The Jacobian's columns of the reflectances. Each row has entries for its own material only.
pub struct ByReflectances {
    /// Per row the entry in the column of log ρ_d.
    pub diffuse: Vec<f64>,
    /// Per glossy row the entry in the column of ρ_s.
    pub specular: Vec<f64>,
}

const OUTSIDE: usize = usize::MAX;
/// The change of a row's slopes, as a part of what they are, up to which its part is kept: a step then
/// leaves at most about twice this part of the way to the minimum.
const NEAR: f64 = 0.01;
/// A column whose products have become this small a part of what they were, because rows were taken
/// out, has none: what is left is rounding.
const ROUNDING: f64 = 1e-12;
/// Rows of the Jacobian that are made at a time, so that they stay in the cache.
const PANEL: usize = 256;

impl Hessian {
    /// Over no columns of emission yet.
    pub fn new(row_scales: RowScales, columns: usize) -> Self {
        Self {
            row_scales,
            place: vec![OUTSIDE; columns],
            columns: Vec::new(),
            products: Mat::zeros(0, 0),
        }
    }

    /// Puts the parts of rows whose slopes have changed in anew. Returns whether all parts are those of
    /// these slopes now.
    pub fn refresh(&mut self, channel: &Channel, now: RowScales) -> bool {
        let change = |row: usize| {
            let diffuse = relative_change(self.row_scales.diffuse[row], now.diffuse[row]);
            channel.rows.glossy[row].map_or(diffuse, |glossy| {
                let before = self.row_scales.specular[glossy];
                diffuse.max(relative_change(before, now.specular[glossy]))
            })
        };
        let changes: Vec<f64> = (0..now.scale.len()).map(change).collect();
        let changed: Vec<usize> = (0..changes.len()).filter(|&row| changes[row] > NEAR).collect();
        let is_exact = changes.iter().all(|&change| change == 0.0 || change > NEAR);
        // A row that is exchanged costs as much as two that are put in.
        if self.columns.is_empty() || 2 * changed.len() > changes.len() {
            *self = Self::new(now, self.place.len());
            return true;
        }
        self.take_out(channel, &changed);
        let row_scales = &mut self.row_scales;
        for &row in &changed {
            row_scales.scale[row] = now.scale[row];
            row_scales.diffuse[row] = now.diffuse[row];
            if let Some(glossy) = channel.rows.glossy[row] {
                row_scales.specular[glossy] = now.specular[glossy];
            }
        }
        self.add(channel, &changed, 1.0);
        is_exact
    }

    /// Takes the parts of some rows out, so that these have none.
    pub fn take_out(&mut self, channel: &Channel, rows: &[usize]) {
        let diagonal = |products: &Mat<f64>| -> Vec<f64> {
            (0..products.ncols()).map(|place| products[(place, place)]).collect()
        };
        let before = diagonal(&self.products);
        self.add(channel, rows, -1.0);
        let after = diagonal(&self.products);
        for (place, (before, after)) in before.into_iter().zip(after).enumerate() {
            if after <= ROUNDING * before {
                self.products.row_mut(place).fill(0.0);
                self.products.col_mut(place).fill(0.0);
            }
        }
        for &row in rows {
            self.row_scales.scale[row] = 0.0;
            self.row_scales.diffuse[row] = 0.0;
            if let Some(glossy) = channel.rows.glossy[row] {
                self.row_scales.specular[glossy] = 0.0;
            }
        }
    }

    /// Whether a column of emission is among those asked for.
    pub fn has(&self, column: usize) -> bool {
        self.place[column] != OUTSIDE
    }

    /// Adds the parts of some rows times a factor.
    fn add(&mut self, channel: &Channel, rows: &[usize], factor: f64) {
        let rows = self.row_scales.lit(channel, rows);
        if rows.is_empty() {
            return;
        }
        let mut panel = Mat::zeros(PANEL.min(rows.len()), self.columns.len());
        for rows in rows.chunks(PANEL) {
            let part = panel.subrows_mut(0, rows.len());
            channel.panel(&self.row_scales, rows, &self.columns, part);
            add_lower_gram(self.products.as_mut(), panel.subrows(0, rows.len()), factor);
        }
        mirror(&mut self.products);
    }

    /// Takes in those of the columns of emission that it has not.
    pub fn extend(&mut self, channel: &Channel, columns: &[usize]) {
        let is_fresh = |column: &&usize| !self.has(**column);
        let fresh: Vec<usize> = columns.iter().filter(is_fresh).copied().collect();
        if fresh.is_empty() {
            return;
        }
        let before = self.columns.len();
        let count = before + fresh.len();
        for column in fresh {
            self.place[column] = self.columns.len();
            self.columns.push(column);
        }
        let mut products = Mat::zeros(count, count);
        products.submatrix_mut(0, 0, before, before).copy_from(&self.products);
        let rows: Vec<usize> = (0..self.row_scales.scale.len()).collect();
        let rows = self.row_scales.lit(channel, &rows);
        let mut panel = Mat::zeros(PANEL.min(rows.len()), count);
        for rows in rows.chunks(PANEL) {
            let part = panel.subrows_mut(0, rows.len());
            channel.panel(&self.row_scales, rows, &self.columns, part);
            let (old, fresh) = panel.subrows(0, rows.len()).split_at_col(before);
            let mixed = products.submatrix_mut(before, 0, count - before, before);
            matmul(mixed, Accum::Add, fresh.transpose(), old, 1.0, Par::Seq);
            let own = products.submatrix_mut(before, before, count - before, count - before);
            add_lower_gram(own, fresh, 1.0);
        }
        mirror(&mut products);
        self.products = products;
    }

    /// The same for other columns of emission: `earlier` has for each the one here whose couplings are
    /// its own.
    pub fn carried(&self, earlier: &[Option<usize>]) -> Self {
        let is_here = |column: &usize| self.place[*column] != OUTSIDE;
        let columns: Vec<usize> = (0..earlier.len())
            .filter(|&column| earlier[column].is_some_and(|e| is_here(&e)))
            .collect();
        let mut place = vec![OUTSIDE; earlier.len()];
        columns.iter().enumerate().for_each(|(index, &column)| place[column] = index);
        let from: Vec<usize> =
            columns.iter().filter_map(|&column| Some(self.place[earlier[column]?])).collect();
        let mut products = Mat::zeros(from.len(), from.len());
        for (j, &of) in from.iter().enumerate() {
            let own = column_of(self.products.as_ref(), of);
            let to = column_of_mut(&mut products, j);
            to.iter_mut().zip(&from).for_each(|(value, &i)| *value = own[i]);
        }
        Self { row_scales: self.row_scales.clone(), place, columns, products }
    }

    /// Over some columns of emission that it has, then some reflectances, by their position among log ρ_d
    /// and ρ_s of every material. The columns of J of these are given, of the present state always: what
    /// is least certain, all reflectances larger and all light weaker, is a small difference between
    /// theirs and the emissions'.
    pub fn over(
        &self,
        channel: &Channel,
        columns: &[usize],
        reflectances: &[usize],
        jacobian: &ByReflectances,
    ) -> Mat<f64> {
        let lit = columns.len();
        let mut over = Mat::zeros(lit + reflectances.len(), lit + reflectances.len());
        let inner: Vec<usize> = columns.iter().map(|&column| self.place[column]).collect();
        for (j, &of) in inner.iter().enumerate() {
            let from = column_of(self.products.as_ref(), of);
            let to = &mut column_of_mut(&mut over, j)[..lit];
            to.iter_mut().zip(&inner).for_each(|(value, &i)| *value = from[i]);
        }
        let by_diffuse = self.row_scales.weighted(channel, |row, _| jacobian.diffuse[row]);
        let by_specular = self
            .row_scales
            .weighted(channel, |_, glossy| glossy.map_or(0.0, |glossy| jacobian.specular[glossy]));
        let runs = placed_runs(channel, reflectances, lit);
        let mut sums = vec![[[0.0; 2]; TOGETHER]; runs.len()];
        for (group, columns) in groups(columns).enumerate() {
            let diffuse = columns.map(|column| channel.design.diffuse_of(column));
            let specular = columns.map(|column| channel.design.specular_of(column));
            vectorised!({
                for (sums, (run, _)) in sums.iter_mut().zip(&runs) {
                    let rows = run.rows.clone();
                    let diffuse = diffuse.map(|column| &column[rows.clone()]);
                    let weights = [&by_diffuse.diffuse[rows.clone()], &by_specular.diffuse[rows]];
                    let Some(glossy) = run.glossy.clone() else {
                        *sums = dots_single(diffuse, [weights[0]]).map(|[sum]| [sum, 0.0]);
                        continue;
                    };
                    *sums = dots_single(diffuse, weights);
                    let specular = specular.map(|column| &column[glossy.clone()]);
                    let weights =
                        [&by_diffuse.specular[glossy.clone()], &by_specular.specular[glossy]];
                    let more = dots_single(specular, weights);
                    for (sums, more) in sums.iter_mut().zip(more) {
                        sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
                    }
                }
            });
            let first = group * TOGETHER;
            for ((_, slots), sums) in runs.iter().zip(&sums) {
                for (j, sums) in (first..lit).zip(sums) {
                    for (slot, sum) in slots.iter().zip(sums) {
                        slot.iter().for_each(|&slot| over[(slot, j)] += sum);
                    }
                }
            }
        }
        for (run, slots) in runs {
            jacobian.add_squares(&mut over, run, slots);
        }
        mirror(&mut over);
        over
    }

    /// A matrix with the diagonal of [`Self::over`]. Its other elements are not those of `over`.
    pub fn diagonal_over(
        &self,
        channel: &Channel,
        columns: &[usize],
        reflectances: &[usize],
        jacobian: &ByReflectances,
    ) -> Mat<f64> {
        let count = columns.len() + reflectances.len();
        let mut over = Mat::zeros(count, count);
        for (position, &column) in columns.iter().enumerate() {
            let place = self.place[column];
            over[(position, position)] = self.products[(place, place)];
        }
        for (run, slots) in placed_runs(channel, reflectances, columns.len()) {
            jacobian.add_squares(&mut over, run, slots);
        }
        over
    }
}

/// The runs of rows whose material has log ρ_d or ρ_s among `reflectances`, with the positions of the two
/// among the unknowns, which come after `lit` emissions.
fn placed_runs(
    channel: &Channel,
    reflectances: &[usize],
    lit: usize,
) -> Vec<(Run, [Option<usize>; 2])> {
    let materials = channel.rows.materials;
    let mut place_of = vec![None; 2 * materials];
    for (position, &index) in reflectances.iter().enumerate() {
        place_of[index] = Some(lit + position);
    }
    let places = |run: &Run| [place_of[run.material], place_of[materials + run.material]];
    let runs = channel.rows.runs().map(|run| (places(&run), run));
    runs.filter(|(places, _)| *places != [None; 2]).map(|(places, run)| (run, places)).collect()
}

impl ByReflectances {
    /// Adds the products of the columns of one material's reflectances over some of its rows, at the places
    /// of log ρ_d and ρ_s among the unknowns.
    fn add_squares(
        &self,
        products: &mut Mat<f64>,
        run: Run,
        [of_diffuse, of_specular]: [Option<usize>; 2],
    ) {
        let diffuse = &self.diffuse[run.rows];
        if let Some(d) = of_diffuse {
            products[(d, d)] += dot(diffuse, diffuse);
        }
        if let (Some(s), Some(glossy)) = (of_specular, run.glossy) {
            let specular = &self.specular[glossy];
            products[(s, s)] += dot(specular, specular);
            if let Some(d) = of_diffuse {
                products[(s, d)] += dot(diffuse, specular);
            }
        }
    }
}

/// What k and (n+2)/2 cosⁿγ k are multiplied by.
struct Weighted {
    /// Per row.
    diffuse: Vec<f64>,
    /// Per glossy row.
    specular: Vec<f64>,
}

impl RowScales {
    /// These times a factor of each row.
    fn weighted(
        &self,
        channel: &Channel,
        factor: impl Fn(usize, Option<usize>) -> f64,
    ) -> Weighted {
        let mut weighted = Weighted { diffuse: Vec::new(), specular: Vec::new() };
        for (row, (&glossy, scale)) in channel.rows.glossy.iter().zip(&self.diffuse).enumerate() {
            let factor = factor(row, glossy);
            weighted.diffuse.push(factor * scale);
            weighted.specular.extend(glossy.map(|glossy| factor * self.specular[glossy]));
        }
        weighted
    }

    /// Those of some rows that have a part.
    fn lit(&self, channel: &Channel, rows: &[usize]) -> Vec<usize> {
        let is_lit = |&row: &usize| {
            let specular = channel.rows.glossy[row].map_or(0.0, |glossy| self.specular[glossy]);
            self.diffuse[row] != 0.0 || specular != 0.0
        };
        rows.iter().copied().filter(is_lit).collect()
    }
}

/// By what part of itself a value has changed; infinite from 0, and where either is not a number.
fn relative_change(before: f64, after: f64) -> f64 {
    let change = if before == after { 0.0 } else { (after / before - 1.0).abs() };
    if change.is_nan() { f64::INFINITY } else { change }
}

/// MᵀM.
pub fn gram(matrix: &Mat<f64>) -> Mat<f64> {
    let mut gram = Mat::zeros(matrix.ncols(), matrix.ncols());
    add_lower_gram(gram.as_mut(), matrix.as_ref(), 1.0);
    mirror(&mut gram);
    gram
}

/// Adds the lower half of MᵀM times a factor.
fn add_lower_gram(out: MatMut<'_, f64>, matrix: MatRef<'_, f64>, factor: f64) {
    // On one thread: channels and light sets are what runs side by side, and sums keep their
    // order.
    triangular::matmul(
        out,
        BlockStructure::TriangularLower,
        Accum::Add,
        matrix.transpose(),
        BlockStructure::Rectangular,
        matrix,
        BlockStructure::Rectangular,
        factor,
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
mod tests;

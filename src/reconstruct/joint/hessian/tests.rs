use super::*;
use crate::math::sampling::Random;
use crate::reconstruct::joint::system::{Design, Rows};

const ROWS: usize = 700;
const COLUMNS: usize = 6;

/// Rows of three materials, the last of which is glossy.
struct Example {
    rows: Rows,
    design: Design,
    random: Random,
}

impl Example {
    fn new() -> Self {
        let mut random = Random::new(5, 0, 0);
        let material: Vec<usize> = (0..ROWS).map(|row| (3 * row / ROWS).min(2)).collect();
        let first = material.iter().filter(|material| **material < 2).count();
        let glossy = (0..ROWS).map(|row| row.checked_sub(first)).collect();
        let mut draw = |rows, columns| Mat::from_fn(rows, columns, |_, _| random.uniform());
        let design = Design {
            diffuse: draw(ROWS, COLUMNS).into(),
            base: Default::default(),
            specular: draw(ROWS - first, COLUMNS).into(),
            specular_base: Default::default(),
            patches: Default::default(),
        };
        Self { rows: Rows { material, glossy, materials: 3, ..Rows::default() }, design, random }
    }

    fn channel(&self) -> Channel<'_> {
        Channel { rows: &self.rows, design: &self.design, channel: 0 }
    }

    fn draw(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| 0.5 + f64::from(self.random.uniform())).collect()
    }

    fn row_scales(&mut self) -> RowScales {
        let glossy = self.design.specular.nrows();
        RowScales { scale: self.draw(ROWS), diffuse: self.draw(ROWS), specular: self.draw(glossy) }
    }

    /// The sums over the rows, one by one.
    fn expected(
        &self,
        scales: &RowScales,
        columns: &[usize],
        reflectances: &[usize],
        by: &ByReflectances,
    ) -> Mat<f64> {
        let entry = |row: usize, place: usize| -> f64 {
            let glossy = self.rows.glossy[row];
            if let Some(&column) = columns.get(place) {
                let lobe = glossy.map_or(0.0, |g| {
                    scales.specular[g] * f64::from(self.design.specular[(g, column)])
                });
                return scales.diffuse[row] * f64::from(self.design.diffuse[(row, column)]) + lobe;
            }
            match reflectances[place - columns.len()] {
                m if m == self.rows.material[row] => by.diffuse[row],
                m if m == 3 + self.rows.material[row] => glossy.map_or(0.0, |g| by.specular[g]),
                _ => 0.0,
            }
        };
        let count = columns.len() + reflectances.len();
        Mat::from_fn(count, count, |i, j| (0..ROWS).map(|row| entry(row, i) * entry(row, j)).sum())
    }
}

/// Reflectances of which no column is asked for.
fn nothing() -> ByReflectances {
    ByReflectances { diffuse: vec![0.0; ROWS], specular: vec![0.0; ROWS] }
}

fn assert_alike(found: &Mat<f64>, expected: &Mat<f64>) {
    assert_eq!((found.nrows(), found.ncols()), (expected.nrows(), expected.ncols()));
    for i in 0..expected.nrows() {
        for j in 0..expected.ncols() {
            let limit = 1e-11 * (expected[(i, i)] * expected[(j, j)]).sqrt();
            let error = (found[(i, j)] - expected[(i, j)]).abs();
            assert!(error <= limit, "{i}, {j}: {} {}", found[(i, j)], expected[(i, j)]);
        }
    }
}

/// Columns that came in one after another, over light and reflectances.
#[test]
fn products_are_sums_over_the_rows() {
    let mut example = Example::new();
    let scales = example.row_scales();
    let glossy = example.design.specular.nrows();
    let by = ByReflectances { diffuse: example.draw(ROWS), specular: example.draw(glossy) };
    let channel = example.channel();
    let mut hessian = Hessian::new(scales.clone(), COLUMNS);
    hessian.extend(&channel, &[1, 4]);
    hessian.extend(&channel, &[0, 1, 5]);
    let (columns, reflectances) = ([0, 4, 5], [0, 2, 5]);
    let found = hessian.over(&channel, &columns, &reflectances, &by);
    assert_alike(&found, &example.expected(&scales, &columns, &reflectances, &by));
}

/// Rows that changed, that were taken out and that came in are exchanged; those that hardly changed stay.
#[test]
fn rows_that_changed_are_exchanged() {
    let mut example = Example::new();
    let before = example.row_scales();
    let mut now = before.clone();
    for row in (0..ROWS).step_by(5) {
        now.diffuse[row] = if row % 2 == 0 { 0.0 } else { 1.5 * before.diffuse[row] };
    }
    now.specular[3] *= 0.8;
    let channel = example.channel();
    let columns = [0, 2, 3];
    let mut hessian = Hessian::new(before.clone(), COLUMNS);
    hessian.extend(&channel, &columns);
    assert!(hessian.refresh(&channel, now.clone()));
    let found = hessian.over(&channel, &columns, &[], &nothing());
    assert_alike(&found, &example.expected(&now, &columns, &[], &nothing()));
    // Back again, and one row by less than matters.
    let mut nearly = before.clone();
    nearly.diffuse[1] *= 1.0 + 0.5 * NEAR;
    assert!(!hessian.refresh(&channel, nearly));
    let found = hessian.over(&channel, &columns, &[], &nothing());
    assert_alike(&found, &example.expected(&before, &columns, &[], &nothing()));
    // All of them: what was there is of no use.
    let others = example.row_scales();
    let channel = example.channel();
    assert!(hessian.refresh(&channel, others.clone()));
    hessian.extend(&channel, &columns);
    let found = hessian.over(&channel, &columns, &[], &nothing());
    assert_alike(&found, &example.expected(&others, &columns, &[], &nothing()));
}

#[test]
fn columns_are_found_again_in_another_model() {
    let mut example = Example::new();
    let scales = example.row_scales();
    let mut hessian = Hessian::new(scales.clone(), COLUMNS);
    hessian.extend(&example.channel(), &[0, 2, 3]);
    // Another order, one column that is new, one that the products lack.
    let carried = hessian.carried(&[Some(3), None, Some(0), Some(1)]);
    let order = [3, 5, 0, 1];
    let own = example.design.clone();
    let glossy = own.specular.nrows();
    example.design.diffuse = Mat::from_fn(ROWS, 4, |i, j| own.diffuse[(i, order[j])]).into();
    example.design.specular = Mat::from_fn(glossy, 4, |i, j| own.specular[(i, order[j])]).into();
    let channel = example.channel();
    let columns = [0, 1, 2, 3];
    let mut carried = carried;
    carried.extend(&channel, &columns);
    let found = carried.over(&channel, &columns, &[], &nothing());
    assert_alike(&found, &example.expected(&scales, &columns, &[], &nothing()));
}

/// A column that only rows which are taken out are lit by is 0 then, not a remainder of rounding.
#[test]
fn nothing_is_left_of_rows_that_are_taken_out() {
    let mut example = Example::new();
    let scales = example.row_scales();
    let own = example.design.clone();
    let is_kept = |row: usize, column: usize| column != 2 || row.is_multiple_of(3);
    let kept = |row, column| if is_kept(row, column) { own.diffuse[(row, column)] } else { 0.0 };
    example.design.diffuse = Mat::from_fn(ROWS, COLUMNS, kept).into();
    example.design.specular = Mat::zeros(own.specular.nrows(), COLUMNS).into();
    let channel = example.channel();
    let mut hessian = Hessian::new(scales, COLUMNS);
    hessian.extend(&channel, &[0, 2]);
    let rows: Vec<usize> = (0..ROWS).step_by(3).collect();
    hessian.take_out(&channel, &rows);
    let found = hessian.over(&channel, &[0, 2], &[], &nothing());
    assert_eq!((found[(1, 1)], found[(0, 1)], found[(1, 0)]), (0.0, 0.0, 0.0));
    assert!(found[(0, 0)] > 1.0);
}

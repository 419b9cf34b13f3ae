//! A light model with how it reaches every row.

use faer::Mat;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::Options;
use crate::reconstruct::equations::Equations;
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::joint::system::{Design, Rows};
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::lobes::Lobe;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::transport::{self, Transport};
use crate::scene::Views;
use crate::solve::kernels::{self, add_scaled, column_of_mut};
use crate::watch::{Cancelled, Watch};

/// What the joint solve works on; no light model yet.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    pub views: &'a Views<'a>,
    pub cloud: &'a SampleCloud,
    /// I_s and radiance records; its coupling is not used.
    pub transport: &'a Transport,
    /// Rows and their radiance; its virtual lights are not used.
    pub equations: &'a Equations,
    pub options: &'a Options,
    pub watch: &'a Watch,
}

/// Lights, their columns, and what is known of their emissions.
#[derive(Clone, Debug)]
pub struct Model {
    pub set: LightSet,
    pub design: Design,
    /// Per column whether the ridge applies: to a background's, not to lamps, sun, known lights.
    pub ridged: Vec<bool>,
    /// Per column and channel what the ridge draws the emission to.
    pub centre: Vec<Rgb>,
    /// Whether what it draws them to is that plus a value common to the background.
    pub floating: bool,
    /// Columns whose emissions are known.
    pub fixed: Vec<Fixed>,
}

/// Lights with their columns, to be put beside those of a model.
#[derive(Clone, Debug)]
pub struct Part {
    set: LightSet,
    diffuse: Mat<f64>,
    specular: Mat<f64>,
}

/// A light of known emission: part of the design's base, its column there zero.
#[derive(Clone, Debug)]
pub struct Fixed {
    pub column: usize,
    pub emission: Rgb,
    pub coupling: Vec<f64>,
}

impl Data<'_> {
    pub fn rows(&self) -> Rows {
        let equations = self.equations;
        let log = |c: usize| -> Vec<f64> {
            let dark = equations.dark(c);
            let of = |radiance: &Rgb| (std::f64::consts::PI * radiance[c].max(dark)).ln();
            equations.rows.iter().map(|row| of(&row.radiance)).collect()
        };
        Rows {
            sample: equations.rows.iter().map(|row| row.sample).collect(),
            material: equations.rows.iter().map(|row| row.material).collect(),
            glossy: equations.rows.iter().map(|row| row.glossy).collect(),
            log_radiance: [log(0), log(1), log(2)],
            materials: self.views.capture.materials.len(),
        }
    }

    /// k_ij, rows × lobes.
    fn couple(&self, rows: &Rows, set: &LightSet) -> Result<Mat<f64>, Cancelled> {
        let seed = self.options.general.seed as u64;
        let options = &self.options.transport;
        let (lights, lobes) = (&set.lights, &set.lobes);
        let coupling =
            transport::couple(self.views, self.cloud, lights, lobes, options, seed, self.watch)?;
        if rows.sample.iter().copied().eq(0..coupling.nrows()) {
            return Ok(coupling);
        }
        Ok(Mat::from_fn(rows.sample.len(), coupling.ncols(), |row, column| {
            coupling[(rows.sample[row], column)]
        }))
    }

    /// (n+2)/2 cosⁿγ times the coupling, glossy rows × lobes.
    fn specular(
        &self,
        rows: &Rows,
        set: &LightSet,
        exponents: &[f64],
        diffuse: &Mat<f64>,
    ) -> Mat<f64> {
        let glossy: Vec<(usize, usize)> =
            rows.glossy.iter().enumerate().filter_map(|(row, g)| Some((row, (*g)?))).collect();
        let factors: Vec<Vec<f64>> = glossy
            .par_iter()
            .map(|&(row, index)| {
                let mirror = self.equations.glossy[index].mirror;
                let position = self.cloud.samples[rows.sample[row]].position;
                let exponent = exponents[rows.material[row]];
                let lights = &set.lights.lights;
                lights.iter().map(|light| light.lobe(position, mirror, exponent)).collect()
            })
            .collect();
        Mat::from_fn(glossy.len(), diffuse.ncols(), |row, column| {
            factors[row][set.lobes.lobes[column].light] * diffuse[(glossy[row].0, column)]
        })
    }

    /// (n+2)/2 times the records' specular integral, per channel and glossy row.
    fn specular_base(&self, rows: &Rows, exponents: &[f64]) -> [Vec<f64>; CHANNELS] {
        let records: Vec<Rgb> = rows
            .glossy
            .par_iter()
            .zip(&rows.material)
            .filter_map(|(glossy, &material)| {
                let exponent = exponents[material];
                let records = self.equations.glossy[(*glossy)?].records(exponent);
                Some(records.map(|value| value * 0.5 * (exponent + 2.0)))
            })
            .collect();
        std::array::from_fn(|c| records.iter().map(|record| record[c]).collect())
    }

    /// The model of a background alone; `irradiance` is I_s per sample.
    pub fn model(
        &self,
        rows: &Rows,
        background: LightSet,
        irradiance: &[Radiance],
        exponents: &[f64],
    ) -> Result<Model, Cancelled> {
        let diffuse = self.couple(rows, &background)?;
        let specular = self.specular(rows, &background, exponents, &diffuse);
        let base = |c: usize| -> Vec<f64> {
            rows.sample.iter().map(|&sample| f64::from(irradiance[sample][c])).collect()
        };
        let columns = diffuse.ncols();
        // Unseen surfaces that shine are few, and where they are is known.
        let is_ridged =
            |lobe: &Lobe| background.lights.lights[lobe.light].kind != LightKind::Surface;
        let ridged = background.lobes.lobes.iter().map(is_ridged).collect();
        Ok(Model {
            set: background,
            design: Design {
                diffuse,
                base: [base(0), base(1), base(2)],
                specular,
                specular_base: self.specular_base(rows, exponents),
            },
            ridged,
            centre: vec![[0.0; CHANNELS]; columns],
            floating: false,
            fixed: Vec::new(),
        })
    }

    /// Gives a model another I_s per sample.
    pub fn set_irradiance(&self, rows: &Rows, model: &mut Model, irradiance: &[Radiance]) {
        for (channel, base) in model.design.base.iter_mut().enumerate() {
            for (base, &sample) in base.iter_mut().zip(&rows.sample) {
                *base = f64::from(irradiance[sample][channel]);
            }
            for fixed in &model.fixed {
                add_scaled(base, fixed.emission[channel], &fixed.coupling);
            }
        }
    }

    /// Further lights.
    pub fn part(&self, rows: &Rows, set: LightSet, exponents: &[f64]) -> Result<Part, Cancelled> {
        let diffuse = self.couple(rows, &set)?;
        let specular = self.specular(rows, &set, exponents, &diffuse);
        Ok(Part { set, diffuse, specular })
    }

    /// Renews the specular parts for other exponents.
    pub fn set_exponents(&self, rows: &Rows, model: &mut Model, exponents: &[f64]) {
        let fixed = std::mem::take(&mut model.fixed);
        for fixed in &fixed {
            set_column(&mut model.design.diffuse, fixed.column, &fixed.coupling);
        }
        let diffuse = &model.design.diffuse;
        model.design.specular = self.specular(rows, &model.set, exponents, diffuse);
        model.design.specular_base = self.specular_base(rows, exponents);
        for Fixed { column, emission, coupling } in fixed {
            model.fix_specular(column, emission);
            set_column(&mut model.design.diffuse, column, &[]);
            model.fixed.push(Fixed { column, emission, coupling });
        }
    }
}

impl Model {
    pub fn columns(&self) -> usize {
        self.design.columns()
    }

    /// Whether any of the lights reaches any row.
    pub fn lights_any_row(&self) -> bool {
        let column = |column| kernels::column_of(self.design.diffuse.as_ref(), column);
        (0..self.columns()).any(|j| column(j).iter().any(|&k| k > 0.0))
    }

    /// The model with further lights, which no ridge draws to darkness.
    pub fn with<'a>(&self, parts: impl IntoIterator<Item = &'a Part>) -> Self {
        let parts: Vec<&Part> = parts.into_iter().collect();
        let mut model = self.clone();
        for part in &parts {
            model.set.append(&part.set);
        }
        let diffuse = parts.iter().map(|part| &part.diffuse);
        let specular = parts.iter().map(|part| &part.specular);
        model.design.diffuse = beside(&self.design.diffuse, diffuse);
        model.design.specular = beside(&self.design.specular, specular);
        model.ridged.resize(model.columns(), false);
        model.centre.resize(model.columns(), [0.0; CHANNELS]);
        model
    }

    /// k_ij, samples × columns, fixed ones with the others; every sample has a row.
    pub fn coupling(&self, rows: &Rows) -> Mat<f64> {
        let mut first: Vec<usize> = (0..rows.sample.len()).collect();
        first.dedup_by_key(|row| rows.sample[*row]);
        let mut coupling = Mat::from_fn(first.len(), self.columns(), |sample, column| {
            self.design.diffuse[(first[sample], column)]
        });
        for fixed in &self.fixed {
            for (sample, &row) in first.iter().enumerate() {
                coupling[(sample, fixed.column)] = fixed.coupling[row];
            }
        }
        coupling
    }

    /// λ per column.
    pub fn ridge(&self, lambda: f64) -> Vec<f64> {
        self.ridged.iter().map(|&ridged| if ridged { lambda } else { 0.0 }).collect()
    }

    /// Makes the emission of a column known: no unknown any more, but part of the base.
    pub fn fix(&mut self, column: usize, emission: Rgb) {
        let coupling = kernels::column_of(self.design.diffuse.as_ref(), column).to_vec();
        for (base, emission) in self.design.base.iter_mut().zip(emission) {
            add_scaled(base, emission, &coupling);
        }
        self.fix_specular(column, emission);
        set_column(&mut self.design.diffuse, column, &[]);
        self.fixed.push(Fixed { column, emission, coupling });
    }

    fn fix_specular(&mut self, column: usize, emission: Rgb) {
        let design = &mut self.design;
        if design.specular.nrows() > 0 {
            for (base, emission) in design.specular_base.iter_mut().zip(emission) {
                add_scaled(base, emission, kernels::column_of(design.specular.as_ref(), column));
            }
            set_column(&mut design.specular, column, &[]);
        }
    }
}

/// Overwrites a column; zeros where there are no values.
fn set_column(matrix: &mut Mat<f64>, column: usize, values: &[f64]) {
    let out = column_of_mut(matrix, column);
    out.fill(0.0);
    out[..values.len()].copy_from_slice(values);
}

fn beside<'a>(first: &'a Mat<f64>, others: impl Iterator<Item = &'a Mat<f64>> + Clone) -> Mat<f64> {
    let columns = first.ncols() + others.clone().map(Mat::ncols).sum::<usize>();
    let mut all = Mat::zeros(first.nrows(), columns);
    let mut next = 0;
    for matrix in std::iter::once(first).chain(others) {
        for column in 0..matrix.ncols() {
            column_of_mut(&mut all, next)
                .copy_from_slice(kernels::column_of(matrix.as_ref(), column));
            next += 1;
        }
    }
    all
}

//! The data to which light models are fitted: measured radiance, known light, and priors on the
//! reflectances. A problem is immutable; a step that changes any of these makes a new problem.

use std::sync::Arc;

use faer::Mat;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::Options;
use crate::reconstruct::equations::{Equation, Equations};
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::joint::blocks::Blocks;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::options::JointOptions;
use crate::reconstruct::joint::priors::Priors;
use crate::reconstruct::joint::seen_sky::SeenSky;
use crate::reconstruct::joint::surface_light::SurfaceLight;
use crate::reconstruct::joint::system::Rows;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::transport::{self, Transport};
use crate::scene::{Capture, MaterialKind, SurfacePoint, Views};
use crate::watch::{Cancelled, Watch};

/// The products of the stages before; their couplings and virtual lights are not used.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// Visibility between cameras, surfaces and lights.
    pub views: &'a Views<'a>,
    /// The samples.
    pub cloud: &'a SampleCloud,
    /// I_s and radiance records.
    pub transport: &'a Transport,
    /// One row of a problem for each.
    pub equations: &'a Equations,
    /// Of every stage.
    pub options: &'a Options,
    /// Counts steps and can cancel.
    pub watch: &'a Watch,
}

/// Rows of measured radiance with everything that is known about them.
#[derive(Clone)]
pub struct Problem<'a> {
    pub data: Data<'a>,
    pub rows: Arc<Rows>,
    /// Per row its place among the equations.
    pub equation: Arc<Vec<usize>>,
    /// Of every glossy row, in order, its place among the equations' glossy ones.
    pub glossy: Arc<Vec<usize>>,
    /// Per row its block.
    pub block: Arc<Vec<usize>>,
    /// The light of photographed surfaces, unphotographed ones and visible lights on the samples.
    pub surface_light: SurfaceLight,
    /// Per row the weight of its squared residual; 0 for rows that are left out.
    pub weights: Arc<Vec<f64>>,
    pub priors: Arc<Priors>,
    /// The photographed sky, if its radiance is used as the emission of sky cells.
    pub sky: Option<Arc<SeenSky>>,
}

impl<'a> Problem<'a> {
    pub fn new(data: Data<'a>, normalised: &[Option<Rgb>], start: &[Option<Rgb>]) -> Self {
        let equations = data.equations;
        // The rows of one material follow each other, so that sums over them are sums over slices.
        let mut order: Vec<usize> = (0..equations.rows.len()).collect();
        order.sort_by_key(|&equation| equations.rows[equation].material);
        let ordered = || order.iter().map(|&equation| &equations.rows[equation]);
        let log = |c: usize| -> Vec<f64> {
            let dark = equations.dark(c);
            let of = |row: &Equation| (std::f64::consts::PI * row.radiance[c].max(dark)).ln();
            ordered().map(of).collect()
        };
        let capture = data.views.capture;
        let glossy: Vec<usize> = ordered().filter_map(|row| row.glossy).collect();
        let mut places = 0..glossy.len();
        let rows = Rows {
            sample: ordered().map(|row| row.sample).collect(),
            material: ordered().map(|row| row.material).collect(),
            glossy: ordered().map(|row| row.glossy.and_then(|_| places.next())).collect(),
            log_radiance: [log(0), log(1), log(2)],
            materials: capture.materials.len(),
        };
        let blocks = Blocks::of(&capture.mesh, &data.cloud.samples);
        // By area, so that the light is not decided by many samples on small things.
        let weight = |row: &Equation| row.share * data.cloud.relative_area(row.material);
        let weights = ordered().map(weight).collect();
        Self {
            equation: Arc::new(order),
            glossy: Arc::new(glossy),
            block: Arc::new(rows.sample.iter().map(|&sample| blocks.of_sample[sample]).collect()),
            surface_light: SurfaceLight::photographed(data.transport),
            weights: Arc::new(weights),
            priors: Arc::new(Priors::new(capture, &data.options.joint, normalised, start)),
            rows: Arc::new(rows),
            sky: None,
            data,
        }
    }

    pub fn options(&self) -> &'a JointOptions {
        &self.data.options.joint
    }

    pub fn watch(&self) -> &'a Watch {
        self.data.watch
    }

    pub fn capture(&self) -> &'a Capture {
        self.data.views.capture
    }

    pub fn materials(&self) -> usize {
        self.rows.materials
    }

    pub fn surface_point(&self, row: usize) -> SurfacePoint {
        self.data.cloud.samples[self.rows.sample[row]].surface_point()
    }

    /// Whether a material is tagged as specular and has samples.
    pub fn is_tagged_specular(&self, material: usize) -> bool {
        self.priors.measured[material]
            && self.capture().materials[material].kind == MaterialKind::Specular
    }

    /// Rows of a material that count.
    pub fn rows_of(&self, material: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.rows.sample.len())
            .filter(move |&row| self.rows.material[row] == material && self.weights[row] > 0.0)
    }

    /// Materials with samples.
    pub fn measured(&self) -> Vec<usize> {
        (0..self.materials()).filter(|&material| self.priors.measured[material]).collect()
    }

    /// The weight of each material's rows, as a fraction of the weight of these materials together.
    pub fn shares(&self, materials: &[usize]) -> Vec<f64> {
        let mut sums = vec![0.0; self.materials()];
        for (&material, weight) in self.rows.material.iter().zip(&*self.weights) {
            sums[material] += weight;
        }
        let total: f64 = materials.iter().map(|&material| sums[material]).sum();
        materials.iter().map(|&material| sums[material] / total.max(f64::MIN_POSITIVE)).collect()
    }

    /// At most so many rows, evenly chosen in the order of the equations, in which materials are mixed.
    pub fn every(&self, most: usize) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..self.rows.sample.len()).collect();
        rows.sort_unstable_by_key(|&row| self.equation[row]);
        rows.iter().step_by(rows.len().div_ceil(most).max(1)).copied().collect()
    }

    /// Blocks up to the last that a row is in.
    pub fn block_count(&self) -> usize {
        self.block.iter().max().map_or(0, |last| last + 1)
    }

    /// The problem of some of the rows.
    pub fn part(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.rows.sample.len()).filter(|&row| keep(row)).collect();
        let rows = &self.rows;
        let mut glossy = Vec::new();
        let place = |&row: &usize| {
            rows.glossy[row].map(|index| {
                glossy.push(self.glossy[index]);
                glossy.len() - 1
            })
        };
        let of_glossy = kept.iter().map(place).collect();
        let some = |values: &[usize]| kept.iter().map(|&row| values[row]).collect::<Vec<_>>();
        Self {
            rows: Arc::new(Rows {
                sample: some(&rows.sample),
                material: some(&rows.material),
                glossy: of_glossy,
                log_radiance: rows
                    .log_radiance
                    .each_ref()
                    .map(|log| kept.iter().map(|&row| log[row]).collect()),
                materials: rows.materials,
            }),
            equation: Arc::new(some(&self.equation)),
            glossy: Arc::new(glossy),
            block: Arc::new(some(&self.block)),
            weights: Arc::new(kept.iter().map(|&row| self.weights[row]).collect()),
            surface_light: self.surface_light.clone(),
            priors: self.priors.clone(),
            sky: self.sky.clone(),
            data: self.data,
        }
    }

    /// An evenly spread subsample of every material's rows: about `count` in total, and at least
    /// `least` of each material that has as many. Neighbouring samples contain nearly the same
    /// information about which lights there are.
    pub fn subsample(&self, count: usize, least: usize) -> Self {
        let chosen = spread(&self.rows.sample, &self.rows.material, self.materials(), count, least);
        self.part(|row| chosen[row])
    }

    pub fn with_surface_light(&self, surface_light: SurfaceLight) -> Self {
        Self { surface_light, ..self.clone() }
    }

    pub fn with_sky(&self, sky: Option<Arc<SeenSky>>) -> Self {
        Self { sky, ..self.clone() }
    }

    pub fn with_weights(&self, weights: Vec<f64>) -> Self {
        Self { weights: Arc::new(weights), ..self.clone() }
    }

    pub fn with_priors(&self, priors: Priors) -> Self {
        Self { priors: Arc::new(priors), ..self.clone() }
    }

    /// k_ij, rows × lobes of a set of lights, in sr. A row has the same values in every part of a
    /// problem.
    pub fn couple(&self, set: &LightSet) -> Result<Mat<f32>, Cancelled> {
        self.couple_beyond(set, &Rows::default(), &Mat::zeros(0, set.lobes.lobes.len()))
    }

    /// The same, with the couplings taken from `known` for samples that have one of `rows`. `known` has
    /// those rows, of the same problem and the same lights.
    pub fn couple_beyond(
        &self,
        set: &LightSet,
        rows: &Rows,
        known: &Mat<f32>,
    ) -> Result<Mat<f32>, Cancelled> {
        let seed = self.data.options.general.seed as u64;
        let Data { views, cloud, options, .. } = self.data;
        let mut known_row = vec![None; cloud.samples.len()];
        for (row, &sample) in rows.sample.iter().enumerate() {
            known_row[sample] = Some(row);
        }
        // The rows of one sample follow each other.
        let mut samples = self.rows.sample.clone();
        samples.dedup();
        samples.retain(|&sample| known_row[sample].is_none());
        let (lights, options) = ((&set.lights, &set.lobes), &options.transport);
        let values =
            transport::couple_some(views, cloud, &samples, lights, options, seed, self.watch())?;
        let mut place = vec![usize::MAX; cloud.samples.len()];
        samples.iter().enumerate().for_each(|(index, &sample)| place[sample] = index);
        let value = |row: usize, column: usize| {
            let sample = self.rows.sample[row];
            match known_row[sample] {
                Some(row) => known[(row, column)],
                None => values[place[sample]][column],
            }
        };
        Ok(Mat::from_fn(self.rows.sample.len(), set.lobes.lobes.len(), value))
    }

    /// Mean square of log(computed/measured), per channel.
    pub fn mean_square(&self, fitted: &Fitted) -> Rgb {
        let total: f64 = self.weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        std::array::from_fn(|c| {
            let residuals = &fitted.channels[c].residuals;
            let squares = residuals.iter().zip(&*self.weights).map(|(r, w)| w * r * r);
            squares.sum::<f64>() / total
        })
    }

    /// Mean square of the mean residuals of blocks of one material, per channel. It measures errors
    /// of the light, which vary between blocks, and not a pattern on the surface, which varies
    /// within them.
    pub fn mean_square_of_blocks(&self, fitted: &Fitted, material: usize) -> Rgb {
        let mut sums = vec![([0.0; CHANNELS], 0.0); self.block_count()];
        for row in self.rows_of(material) {
            let (sum, weight) = &mut sums[self.block[row]];
            for (sum, fit) in sum.iter_mut().zip(&fitted.channels) {
                *sum += self.weights[row] * fit.residuals[row];
            }
            *weight += self.weights[row];
        }
        let blocks = || sums.iter().filter(|(_, weight)| *weight > 0.0);
        let total: f64 = blocks().map(|(_, weight)| weight).sum();
        std::array::from_fn(|c| {
            let squares = blocks().map(|(sum, weight)| sum[c].powi(2) / weight);
            squares.sum::<f64>() / total.max(f64::MIN_POSITIVE)
        })
    }

    /// The problem with values estimated from a fit of a very flexible light model: the weight of
    /// each material's residuals, the reflectance of its brightest parts, and the noise of a row.
    /// `seen` is the part of the rows that was fitted.
    pub fn informed_by(&self, seen: &Problem, fitted: &Fitted) -> Self {
        let mut priors = (*self.priors).clone();
        let robust = self.options().robust;
        let mut factor = vec![1.0; self.materials()];
        if robust > 0.0 {
            let all: Vec<usize> =
                (0..seen.rows.sample.len()).filter(|&row| seen.weights[row] > 0.0).collect();
            let typical = fitted.deviation(&all);
            for (material, factor) in factor.iter_mut().enumerate() {
                let rows: Vec<usize> = seen.rows_of(material).collect();
                let own = match rows.len() {
                    ..ENOUGH => typical,
                    _ => fitted.deviation(&rows).max(SMALLEST_DEVIATION * typical),
                };
                priors.robust[material] = robust * own;
                *factor = (typical / own).powi(2);
            }
        }
        for material in (0..self.materials()).filter(|&m| self.capture().materials[m].textured) {
            let rows: Vec<usize> =
                seen.rows_of(material).filter(|&row| seen.rows.glossy[row].is_none()).collect();
            if rows.len() < ENOUGH {
                continue;
            }
            for (channel, fit) in fitted.channels.iter().enumerate() {
                let mut pattern = pattern(&seen.block, &fit.residuals, &rows);
                pattern.sort_by(f64::total_cmp);
                let brightest = pattern[(pattern.len() as f64 * BRIGHT_QUANTILE) as usize];
                priors.upper[channel][material] =
                    self.options().brightest.ln() - brightest.max(0.0);
                // Its known reflectance is the mean over the surface, while logarithms find the
                // geometric mean.
                let mean = pattern.iter().map(|log| log.exp()).sum::<f64>() / pattern.len() as f64;
                if let Some(known) = &mut priors.known[channel][material] {
                    *known -= mean.ln();
                }
                for (_, value, sd) in priors.pins.iter_mut().filter(|(m, ..)| *m == material) {
                    value[channel] /= mean;
                    sd[channel] /= mean;
                }
            }
        }
        let weights =
            self.weights.iter().zip(&self.rows.material).map(|(w, &m)| w * factor[m]).collect();
        self.with_priors(priors).with_weights(weights)
    }
}

/// Fewest rows of a material from which its distribution is estimated.
const ENOUGH: usize = 20;
/// The standard deviation of a material is at least this fraction of that of all: its rows cannot
/// be more accurate than the light model.
const SMALLEST_DEVIATION: f64 = 0.5;
/// The quantile of a pattern that counts as the brightest part of a surface.
const BRIGHT_QUANTILE: f64 = 0.95;

/// The residuals of rows minus the mean of their block, as logarithms: a pattern on the surface,
/// which varies within a block, without errors of the light, which vary between blocks.
fn pattern(block: &[usize], residuals: &[f64], rows: &[usize]) -> Vec<f64> {
    let count = block.iter().max().map_or(0, |last| last + 1);
    let mut sums = vec![(0.0, 0.0); count];
    for &row in rows {
        let (sum, number) = &mut sums[block[row]];
        *sum -= residuals[row];
        *number += 1.0;
    }
    let beyond = |&row: &usize| {
        let (sum, number) = sums[block[row]];
        -residuals[row] - sum / number
    };
    rows.iter().map(beyond).collect()
}

/// Which rows are kept of [`Problem::subsample`]; all rows of a sample or none.
fn spread(
    sample: &[usize],
    material: &[usize],
    materials: usize,
    count: usize,
    least: usize,
) -> Vec<bool> {
    let first = |row: usize| row == 0 || sample[row] != sample[row - 1];
    let mut counts = vec![0usize; materials];
    for row in (0..sample.len()).filter(|&row| first(row)) {
        counts[material[row]] += 1;
    }
    let all: usize = counts.iter().sum();
    let wanted = |own: usize| (own * count).div_ceil(all.max(1)).max(least).min(own);
    let mut passed = vec![0usize; materials];
    let mut is_kept = false;
    (0..sample.len())
        .map(|row| {
            if first(row) {
                let m = material[row];
                let (own, wanted, place) = (counts[m], wanted(counts[m]), passed[m]);
                passed[m] += 1;
                // A new one of `wanted` even parts begins here.
                is_kept = (place + 1) * wanted / own > place * wanted / own;
            }
            is_kept
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of which one block in four lies in light that the model does not know, twice as
    /// bright, and a wall with a print of ± 0.3 everywhere.
    #[test]
    fn light_that_is_not_understood_is_no_pattern() {
        let rows: Vec<usize> = (0..400).collect();
        let block: Vec<usize> = rows.iter().map(|row| row / 25).collect();
        let lit: Vec<f64> =
            rows.iter().map(|row| if row / 25 % 4 == 0 { -0.7 } else { 0.0 }).collect();
        let of_light = pattern(&block, &lit, &rows);
        assert!(of_light.iter().all(|value| value.abs() < 1e-12), "{of_light:?}");
        let print: Vec<f64> =
            rows.iter().map(|row| if row % 2 == 0 { -0.3 } else { 0.3 }).collect();
        let mut of_print = pattern(&block, &print, &rows);
        of_print.sort_by(f64::total_cmp);
        assert!((of_print[380] - 0.3).abs() < 0.02, "{}", of_print[380]);
    }

    #[test]
    fn a_part_of_every_material_is_kept_and_all_of_small_ones() {
        let sample: Vec<usize> = (0..6000).collect();
        let material: Vec<usize> = (0..6000).map(|k| if k % 100 == 7 { 1 } else { 0 }).collect();
        let kept = spread(&sample, &material, 3, 1200, 80);
        let of = |m: usize| (0..6000).filter(|&row| kept[row] && material[row] == m).count();
        assert_eq!((of(0), of(1), of(2)), (5940 * 1200 / 6000, 60, 0));
        // Evenly: of the last tenth as much as of the first.
        let within = |low, high| (low..high).filter(|&row| kept[row]).count();
        assert!(within(0, 600).abs_diff(within(5400, 6000)) < 3);
        // All rows of a sample or none.
        let sample: Vec<usize> = (0..6000).map(|row| row / 3).collect();
        let kept = spread(&sample, &[0; 6000], 1, 100, 10);
        assert!(kept.chunks(3).all(|rows| rows.iter().all(|&kept| kept == rows[0])));
    }
}

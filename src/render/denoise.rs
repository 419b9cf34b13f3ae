//! Denoises a picture by averaging neighbouring pixels that are probably lit alike.
//!
//! The filter is an edge-avoiding à-trous wavelet (Dammertz et al. 2010). It works on the light
//! that falls on surfaces: the albedo, which has no noise, is divided out first, so that textures
//! stay sharp. The weight of a neighbour falls with the difference of normals and distances, and
//! with the difference of light beyond that due to noise (Schied et al. 2017). The noise is
//! estimated from the two halves of the paths.
//!
//! The sum of light is preserved: in each pair of pixels, one gains what the other loses, as in the
//! diffusion of heat. The usual weights, which are normalised to a sum of one in each pixel, lose
//! light. The noise has a long tail: many pixels are a little too dark and have a small estimated
//! variance, and few are much too bright. With normalised weights the dark pixels would ignore the
//! bright ones, while the bright ones would be replaced by the mean of the dark ones.
//!
//! A picture is filtered row by row, one neighbour of all pixels after the other, so that the
//! compiler can process several pixels at once. Each component of a pixel is therefore stored in a
//! plane of its own; a row has its part of each plane, one after the other.

use glam::Vec3;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::film::{Film, LightFilm, SurfaceFilm};
use crate::solve::kernels::vectorised;

/// Rounds, each with neighbours twice as far away.
const ROUNDS: u32 = 5;
/// The kernel of a cubic B-spline.
const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Differences of light that count as noise, in standard deviations. One pixel that is much too bright
/// makes for seven, as the variance is averaged over seven by seven pixels: less, and it stays alone.
const LIGHT: f32 = 8.0;
/// How sharply differences of normals separate surfaces: they count by this power of two of the
/// cosine between them.
const NORMAL_SQUARINGS: u32 = 6;
/// Albedos below are taken to be this.
const DARKEST: f32 = 0.02;
/// Pixels to each side whose variances are averaged.
const REACH: isize = 3;

/// Properties of every pixel that have no noise.
pub struct Guides {
    pub(super) width: usize,
    pub(super) height: usize,
    pub albedo: Vec<Radiance>,
    /// Per row the planes of [`GUIDES`].
    rows: Vec<f32>,
}

/// Normal; 1 where no surface is; distance, and its change from one pixel to the next, across and
/// down.
pub(super) const GUIDES: usize = 7;

/// The film with less noise; its layers still add up.
pub fn denoised(film: &Film) -> Film {
    if film.paths < 2 {
        return film.clone();
    }
    let guides = Guides::new(&film.surfaces, film.width, film.height);
    let mut result = film.clone();
    result.set_layers(&guides.denoised(&film.light));
    result
}

impl Guides {
    pub fn new(surfaces: &SurfaceFilm, width: usize, height: usize) -> Self {
        let (normal, distance_m) = (surfaces.normal(), surfaces.distance_m());
        let (albedo, coverage) = (surfaces.albedo(), surfaces.coverage());
        let slope = |index: usize, stride: usize, at: usize, count: usize| {
            let here = distance_m[index];
            let before = (at > 0).then(|| here - distance_m[index - stride]);
            let after = (at + 1 < count).then(|| distance_m[index + stride] - here);
            // Of the two the smaller one: the other may reach over an edge.
            let all = [before, after].into_iter().flatten();
            all.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
        };
        let mut rows = vec![0.0; GUIDES * width * height];
        rows.par_chunks_exact_mut((GUIDES * width).max(1)).enumerate().for_each(|(y, row)| {
            for x in 0..width {
                let index = y * width + x;
                let normal = Vec3::from(normal[index]).normalize_or_zero();
                let is_known = coverage[index] > 0.5 && normal != Vec3::ZERO;
                let values = if is_known {
                    let across = slope(index, 1, x, width);
                    let down = slope(index, width, y, height);
                    [normal.x, normal.y, normal.z, 0.0, distance_m[index], across, down]
                } else {
                    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
                };
                for (plane, value) in values.into_iter().enumerate() {
                    row[plane * width + x] = value;
                }
            }
        });
        let albedo = albedo.into_iter().map(|albedo| albedo.map(|value| value.max(DARKEST)));
        Self { width, height, albedo: albedo.collect(), rows }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.rows) + size_of_val(&*self.albedo)
    }

    pub(super) fn plane(&self, y: usize, plane: usize) -> &[f32] {
        &self.rows[(y * GUIDES + plane) * self.width..][..self.width]
    }

    /// Every layer of a film with less noise.
    pub fn denoised(&self, film: &LightFilm) -> Vec<Vec<Radiance>> {
        let mut light = self.demodulated(film);
        if film.paths() >= 2 {
            light.smooth_variance(self);
            for round in 0..ROUNDS {
                light = light.filtered(self, 1 << round);
            }
        }
        let modulated = |layer: usize| {
            let pixel = |index: usize| {
                let (x, y) = (index % self.width, index / self.width);
                let row = light.row(y);
                std::array::from_fn(|c| {
                    row[(CHANNELS * layer + c) * self.width + x] * self.albedo[index][c]
                })
            };
            (0..self.albedo.len()).into_par_iter().map(pixel).collect()
        };
        (0..film.layers()).map(modulated).collect()
    }

    fn demodulated(&self, film: &LightFilm) -> Light {
        let (width, layers) = (self.width, film.layers());
        let mut light = Light::new(width, self.height, layers);
        let stride = light.stride();
        light.rows.par_chunks_exact_mut(stride.max(1)).enumerate().for_each(|(y, row)| {
            for x in 0..width {
                let index = y * width + x;
                let albedo = self.albedo[index];
                let (means, error) = film.light(index);
                let (mut sum, mut whole) = (0.0, 0.0);
                for (layer, mean) in means.enumerate() {
                    for c in 0..CHANNELS {
                        let value = mean[c] / albedo[c];
                        row[(CHANNELS * layer + c) * width + x] = value;
                        if layer < film.summed() {
                            sum += value;
                            whole += mean[c];
                        }
                    }
                }
                // The error is known of the brightness; that of the light is as large a part of it.
                let error = if whole > 0.0 { error * sum / whole } else { 0.0 };
                row[CHANNELS * layers * width + x] = sum / CHANNELS as f32;
                row[(CHANNELS * layers + 1) * width + x] = error * error;
            }
        });
        light
    }
}

/// From 0 to 1, whether two pixels that lie `away` from each other show one smooth surface, whose
/// distance changes by `slope` from one pixel to the next; `further` of the exponent is against it.
/// The same for both where `slope` is.
#[inline(always)]
pub(super) fn alike(
    own: [f32; GUIDES],
    other: [f32; GUIDES],
    slope: [f32; 2],
    away: [f32; 2],
    further: f32,
) -> f32 {
    let [nx, ny, nz, none, distance_m, ..] = own;
    let expected = slope[0] * away[0] + slope[1] * away[1];
    let steepest = (slope[0] * away[0]).abs() + (slope[1] * away[1]).abs();
    let off = (other[4] - distance_m - expected).abs();
    let scale = 0.5 * steepest + 1e-3 * (distance_m + other[4]);
    let scale = scale.max(f32::MIN_POSITIVE);
    let cosine = nx * other[0] + ny * other[1] + nz * other[2] + none * other[3];
    let mut near = cosine.max(0.0);
    for _ in 0..NORMAL_SQUARINGS {
        near *= near;
    }
    near * exp(-off / scale - further)
}

/// eˣ of numbers below 0 to four digits; what is below 1e-26 is no less.
#[inline(always)]
fn exp(x: f32) -> f32 {
    // Adding it leaves the nearest integer in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let binary = (x * std::f32::consts::LOG2_E).max(-86.0);
    let shifted = binary + ROUND;
    let rest = binary - (shifted - ROUND);
    let power = shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23;
    // 2ʳ by its series.
    let part = 1.0
        + rest
            * (std::f32::consts::LN_2
                + rest * (0.240_226_5 + rest * (0.055_504_1 + rest * 0.009_618_1)));
    part * f32::from_bits(power)
}

/// The light on every pixel: every layer, then their brightness and the variance of its mean.
struct Light {
    width: usize,
    layers: usize,
    rows: Vec<f32>,
}

impl Light {
    fn new(width: usize, height: usize, layers: usize) -> Self {
        Self { width, layers, rows: vec![0.0; width * height * (CHANNELS * layers + 2)] }
    }

    fn stride(&self) -> usize {
        self.width * (CHANNELS * self.layers + 2)
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.rows[y * self.stride()..(y + 1) * self.stride()]
    }

    fn brightness(&self, y: usize) -> &[f32] {
        &self.row(y)[CHANNELS * self.layers * self.width..][..self.width]
    }

    fn variance(&self, y: usize) -> &[f32] {
        &self.row(y)[(CHANNELS * self.layers + 1) * self.width..]
    }

    /// The variance of one pixel, estimated from the difference of two halves, is itself noisy: it
    /// is averaged with its neighbours'.
    fn smooth_variance(&mut self, guides: &Guides) {
        let width = self.width;
        let mut smoothed = vec![0.0; width * guides.height];
        smoothed.par_chunks_exact_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            vectorised!(self.smooth_row(guides, y, row));
        });
        let (stride, first) = (self.stride(), (CHANNELS * self.layers + 1) * width);
        for (row, smoothed) in
            self.rows.chunks_exact_mut(stride.max(1)).zip(smoothed.chunks_exact(width.max(1)))
        {
            row[first..].copy_from_slice(smoothed);
        }
    }

    /// One round with neighbours `step` pixels apart.
    fn filtered(&self, guides: &Guides, step: isize) -> Self {
        let (width, stride) = (self.width, self.stride());
        let mut result = Self::new(width, guides.height, self.layers);
        result.rows.par_chunks_exact_mut(stride.max(1)).enumerate().for_each(|(y, row)| {
            vectorised!(self.filter_row(guides, (y, step), row));
        });
        result
    }

    #[inline(always)]
    fn smooth_row(&self, guides: &Guides, y: usize, row: &mut [f32]) {
        let (none, mut kernel) = (vec![0.0; self.width], Kernel::new(self.width));
        for j in -REACH..=REACH {
            for i in -REACH..=REACH {
                let Some(tap) = Tap::new(guides, (y, i, j)) else { continue };
                kernel.weigh(guides, &tap, 1.0, [[&none, &none], [&none, &none]]);
                kernel.add(&tap, self.variance(tap.other), row, false);
            }
        }
        kernel.divide(row);
    }

    #[inline(always)]
    fn filter_row(&self, guides: &Guides, (y, step): (usize, isize), row: &mut [f32]) {
        let width = self.width;
        let mut kernel = Kernel::new(width);
        let own = [self.brightness(y), self.variance(y)];
        let (means, variance) = row.split_at_mut(self.stride() - width);
        for j in -2..=2isize {
            for i in -2..=2isize {
                if (i, j) == (0, 0) {
                    continue;
                }
                let spline = SPLINE[i.unsigned_abs()] * SPLINE[j.unsigned_abs()];
                let Some(tap) = Tap::new(guides, (y, i * step, j * step)) else { continue };
                let other = [self.brightness(tap.other), self.variance(tap.other)];
                kernel.weigh(guides, &tap, spline, [own, other]);
                let planes = self.row(tap.other).chunks_exact(width);
                for (plane, sums) in planes.zip(means.chunks_exact_mut(width)) {
                    kernel.add(&tap, plane, sums, false);
                }
                kernel.add(&tap, self.variance(tap.other), variance, true);
            }
        }
        for (plane, sums) in self.row(y).chunks_exact(width).zip(means.chunks_exact_mut(width)) {
            kernel.keep(plane, sums, false);
        }
        kernel.keep(self.variance(y), variance, true);
    }
}

/// One of the neighbours of all pixels of a row.
struct Tap {
    /// The row, and that of the neighbours.
    row: usize,
    other: usize,
    /// The first pixel that has such a neighbour, the neighbour, and how many have.
    first: usize,
    neighbour: usize,
    count: usize,
    away: [f32; 2],
}

impl Tap {
    fn new(guides: &Guides, (row, across, down): (usize, isize, isize)) -> Option<Self> {
        let other = row.checked_add_signed(down).filter(|other| *other < guides.height)?;
        let reach = across.unsigned_abs();
        let count = guides.width.checked_sub(reach).filter(|count| *count > 0)?;
        let (first, neighbour) = if across < 0 { (reach, 0) } else { (0, reach) };
        Some(Self { row, other, first, neighbour, count, away: [across as f32, down as f32] })
    }
}

/// The weights of one neighbour of all pixels of a row, and their sums.
struct Kernel {
    weights: Vec<f32>,
    sums: Vec<f32>,
}

impl Kernel {
    fn new(width: usize) -> Self {
        Self { weights: vec![0.0; width], sums: vec![0.0; width] }
    }

    /// `light` holds the brightness of the pixels and its variance, then those of their neighbours. A
    /// neighbour counts for a pixel as much as the pixel does for it.
    #[inline(always)]
    fn weigh(&mut self, guides: &Guides, tap: &Tap, factor: f32, light: [[&[f32]; 2]; 2]) {
        let Tap { row, other, first, neighbour, count, away } = *tap;
        let own: [&[f32]; GUIDES] =
            std::array::from_fn(|plane| &guides.plane(row, plane)[first..first + count]);
        let others: [&[f32]; GUIDES] =
            std::array::from_fn(|plane| &guides.plane(other, plane)[neighbour..neighbour + count]);
        let here = light[0].map(|plane| &plane[first..first + count]);
        let there = light[1].map(|plane| &plane[neighbour..neighbour + count]);
        let weights = &mut self.weights[..count];
        let sums = &mut self.sums[first..first + count];
        for k in 0..count {
            let noise = LIGHT * (0.5 * (here[1][k] + there[1][k])).sqrt();
            let least = 1e-6 * (here[0][k] + there[0][k]).abs() + f32::MIN_POSITIVE;
            let apart = ((here[0][k] - there[0][k]) / (noise + least)).powi(2);
            let own: [f32; GUIDES] = std::array::from_fn(|plane| own[plane][k]);
            let other: [f32; GUIDES] = std::array::from_fn(|plane| others[plane][k]);
            let slope = [0.5 * (own[5] + other[5]), 0.5 * (own[6] + other[6])];
            weights[k] = factor * alike(own, other, slope, away, apart);
            sums[k] += weights[k];
        }
    }

    /// Adds the neighbours' values by their weights, or by the squares of these.
    #[inline(always)]
    fn add(&self, tap: &Tap, plane: &[f32], sums: &mut [f32], is_squared: bool) {
        let values = &plane[tap.neighbour..tap.neighbour + tap.count];
        let sums = &mut sums[tap.first..tap.first + tap.count];
        let weights = &self.weights[..tap.count];
        for ((sum, value), weight) in sums.iter_mut().zip(values).zip(weights) {
            *sum += if is_squared { weight * weight } else { *weight } * value;
        }
    }

    /// Adds the pixels' own values by what their neighbours, whose weights add up to less than 1,
    /// leave of it.
    #[inline(always)]
    fn keep(&self, plane: &[f32], sums: &mut [f32], is_squared: bool) {
        for ((sum, value), others) in sums.iter_mut().zip(plane).zip(&self.sums) {
            let own = 1.0 - others;
            *sum += if is_squared { own * own } else { own } * value;
        }
    }

    #[inline(always)]
    fn divide(&self, values: &mut [f32]) {
        for (value, sum) in values.iter_mut().zip(&self.sums) {
            *value /= *sum;
        }
    }
}

#[cfg(test)]
mod tests;

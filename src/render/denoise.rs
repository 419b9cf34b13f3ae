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

mod kernel;

use glam::Vec3;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::film::{Film, LightFilm, SurfaceFilm};
use crate::render::tracer::Tracer;
use crate::solve::kernels::vectorised;

pub(super) use kernel::alike;
use kernel::{Kernel, Tap};

/// Rounds, each with neighbours twice as far away.
pub(crate) const ROUNDS: u32 = 5;
/// The kernel of a cubic B-spline.
const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
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

/// Numbers of a pixel that say to which surface it belongs, see [`Guides::rows`].
pub(super) const GUIDES: usize = 7;

/// The film with less noise, which a tracer takes out; its layers still add up.
pub fn denoised(film: &Film, tracer: &dyn Tracer) -> Film {
    if film.paths < 2 {
        return film.clone();
    }
    let guides = Guides::new(&film.surfaces, film.width, film.height);
    let mut result = film.clone();
    result.set_layers(&guides.denoised(&film.light, tracer));
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

    /// Per row of pixels [`GUIDES`] planes: the normal, 1 where no surface is, the distance, and its
    /// change from one pixel to the next, across and down.
    #[cfg(feature = "gpu")]
    pub(crate) fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// Every layer of a film with less noise, which a tracer takes out.
    pub fn denoised(&self, film: &LightFilm, tracer: &dyn Tracer) -> Vec<Vec<Radiance>> {
        let mut light = self.demodulated(film);
        if film.paths() >= 2 {
            light = tracer.denoise(self, light);
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

/// The light on every pixel: per row of pixels a plane for each channel of each layer, then their
/// brightness and the variance of its mean.
pub struct Light {
    pub(crate) width: usize,
    pub(crate) layers: usize,
    pub(crate) rows: Vec<f32>,
}

impl Light {
    fn new(width: usize, height: usize, layers: usize) -> Self {
        Self { width, layers, rows: vec![0.0; width * height * (CHANNELS * layers + 2)] }
    }

    /// The same with less noise, on this processor.
    pub(super) fn filtered(mut self, guides: &Guides) -> Self {
        self.smooth_variance(guides);
        (0..ROUNDS).fold(self, |light, round| light.round(guides, 1 << round))
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
    fn round(&self, guides: &Guides, step: isize) -> Self {
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

#[cfg(test)]
mod tests;

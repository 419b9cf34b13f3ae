//! The values that a camera accumulates: light in layers, and properties of the surface that its
//! rays meet first.

use glam::Vec3;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::path::{First, Gathered};

/// Pixels in a row of memory that have the same number of paths: they are traced by one task, and a
/// film whose tracing was cancelled goes on with the strips that were left.
pub const STRIP: usize = 256;

/// Sums over the paths of every pixel: the light of some layers that are traced together.
#[derive(Clone, Debug)]
pub struct LightFilm {
    layers: usize,
    /// Of the layers the first so many add up to the picture; one beyond them holds what is in
    /// them already.
    summed: usize,
    /// Paths per pixel of every strip.
    paths: Vec<u32>,
    /// Per pixel the layers, then the brightness of all odd paths.
    values: Vec<f32>,
}

/// The surfaces that the rays through every pixel meet first; without noise, except at edges.
#[derive(Clone, Debug)]
pub struct SurfaceFilm {
    paths: Vec<u32>,
    values: Vec<f32>,
}

/// The numbers of a pixel's surfaces: albedo, normal, distance, known, object.
const SURFACE: usize = 2 * CHANNELS + 3;

/// A whole picture.
#[derive(Clone, Debug)]
pub struct Film {
    pub width: usize,
    pub height: usize,
    /// Paths per pixel so far.
    pub paths: usize,
    /// Recovered light, then each added one, then what came without a detour.
    pub(super) light: LightFilm,
    pub(super) surfaces: SurfaceFilm,
}

fn mean(radiance: Radiance) -> f32 {
    radiance.iter().sum::<f32>() / CHANNELS as f32
}

impl LightFilm {
    /// `beside` layers beyond `summed` ones.
    pub fn new(pixels: usize, summed: usize, beside: usize) -> Self {
        let layers = summed + beside;
        let values = vec![0.0; pixels * (CHANNELS * layers + 1)];
        Self { layers, summed, paths: vec![0; pixels.div_ceil(STRIP)], values }
    }

    fn stride(&self) -> usize {
        CHANNELS * self.layers + 1
    }

    pub fn layers(&self) -> usize {
        self.layers
    }

    pub fn summed(&self) -> usize {
        self.summed
    }

    pub fn pixels(&self) -> usize {
        self.values.len() / self.stride()
    }

    /// Paths per pixel, of each strip.
    pub fn strips(&self) -> &[u32] {
        &self.paths
    }

    /// Paths that every pixel has at least.
    pub fn paths(&self) -> usize {
        self.paths.iter().copied().min().unwrap_or(0) as usize
    }

    /// Paths through all pixels together.
    pub fn total_paths(&self) -> u64 {
        let pixels = |strip: usize| (self.pixels() - strip * STRIP).min(STRIP) as u64;
        let strips = self.paths.iter().enumerate();
        strips.map(|(strip, &paths)| u64::from(paths) * pixels(strip)).sum()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.values) + size_of_val(&*self.paths)
    }

    /// The strips with their numbers of paths, to be added to side by side.
    pub(super) fn strips_mut(&mut self) -> impl Iterator<Item = (&mut u32, &mut [f32])> {
        let stride = self.stride();
        self.paths.iter_mut().zip(self.values.chunks_mut(STRIP * stride))
    }

    /// Mean radiance of one pixel in every layer, and half the difference between the mean
    /// brightness of its even and its odd paths, which is as large as its error.
    pub fn light(&self, index: usize) -> (impl Iterator<Item = Radiance>, f32) {
        let factor = 1.0 / self.paths[index / STRIP].max(1) as f32;
        let pixel = &self.values[index * self.stride()..(index + 1) * self.stride()];
        let (light, odd) = pixel.split_at(CHANNELS * self.layers);
        let all = light[..CHANNELS * self.summed].iter().sum::<f32>() / CHANNELS as f32;
        let means = light.chunks_exact(CHANNELS);
        let means = means.map(move |layer| std::array::from_fn(|c| layer[c] * factor));
        (means, (all - 2.0 * odd[0]) * factor)
    }

    /// Mean radiance of one layer.
    pub fn layer(&self, layer: usize) -> Vec<Radiance> {
        let pixels = self.values.chunks_exact(self.stride()).enumerate();
        pixels
            .map(|(index, pixel)| {
                let factor = 1.0 / self.paths[index / STRIP].max(1) as f32;
                std::array::from_fn(|c| pixel[CHANNELS * layer + c] * factor)
            })
            .collect()
    }

    /// Mean radiance of all layers that add up.
    fn sum(&self) -> Vec<Radiance> {
        let pixels = self.values.chunks_exact(self.stride()).enumerate();
        pixels
            .map(|(index, pixel)| {
                let factor = 1.0 / self.paths[index / STRIP].max(1) as f32;
                let layers = || (0..self.summed).map(|layer| CHANNELS * layer);
                std::array::from_fn(|c| {
                    layers().map(|first| pixel[first + c]).sum::<f32>() * factor
                })
            })
            .collect()
    }

    /// Puts other means in the layers' places; the noise is no longer known.
    fn set_layers(&mut self, layers: &[Vec<Radiance>]) {
        let stride = self.stride();
        for (index, pixel) in self.values.chunks_exact_mut(stride).enumerate() {
            let paths = self.paths[index / STRIP] as f32;
            for (values, layer) in pixel.chunks_exact_mut(CHANNELS).zip(layers) {
                for (value, mean) in values.iter_mut().zip(layer[index]) {
                    *value = mean * paths;
                }
            }
        }
    }

    /// The sum over all pixels of the squared error of their brightness, for weighted layers. The
    /// noise of the layers is taken to be fully correlated.
    pub fn squared_error(&self, weights: &[Radiance]) -> f64 {
        let squared = |index: usize| {
            let (means, error) = self.light(index);
            let (mut plain, mut weighted) = (0.0, 0.0);
            for (light, weight) in means.take(self.summed).zip(weights) {
                plain += mean(light);
                weighted += mean(std::array::from_fn(|c| light[c] * weight[c]));
            }
            if plain > 0.0 { f64::from(error * weighted / plain).powi(2) } else { 0.0 }
        };
        (0..self.pixels()).map(squared).sum()
    }
}

impl SurfaceFilm {
    pub fn new(pixels: usize) -> Self {
        Self { paths: vec![0; pixels.div_ceil(STRIP)], values: vec![0.0; pixels * SURFACE] }
    }

    /// Paths that every pixel has at least.
    pub fn paths(&self) -> usize {
        self.paths.iter().copied().min().unwrap_or(0) as usize
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.values) + size_of_val(&*self.paths)
    }

    /// Paths per pixel, of each strip.
    pub fn strips(&self) -> &[u32] {
        &self.paths
    }

    /// The strips with their numbers of paths, to be added to side by side.
    pub(super) fn strips_mut(&mut self) -> impl Iterator<Item = (&mut u32, &mut [f32])> {
        self.paths.iter_mut().zip(self.values.chunks_mut(STRIP * SURFACE))
    }

    fn means<T>(&self, value: impl Fn(&[f32], f32) -> T) -> Vec<T> {
        let pixels = self.values.chunks_exact(SURFACE).enumerate();
        pixels
            .map(|(index, pixel)| value(pixel, 1.0 / self.paths[index / STRIP].max(1) as f32))
            .collect()
    }

    /// Diffuse and specular reflectance together.
    pub fn albedo(&self) -> Vec<Radiance> {
        self.means(|pixel, factor| std::array::from_fn(|c| pixel[c] * factor))
    }

    /// Mean of unit normals.
    pub fn normal(&self) -> Vec<Radiance> {
        self.means(|pixel, factor| std::array::from_fn(|c| pixel[CHANNELS + c] * factor))
    }

    /// Mean distance from the camera in metres; 0 where nothing is known.
    pub fn distance_m(&self) -> Vec<f32> {
        let far = |sum: f32, known: f32| if known > 0.0 { sum / known } else { 0.0 };
        self.means(|pixel, _| far(pixel[2 * CHANNELS], pixel[2 * CHANNELS + 1]))
    }

    /// Part of every pixel that known surfaces or objects cover.
    pub fn coverage(&self) -> Vec<f32> {
        self.means(|pixel, factor| pixel[2 * CHANNELS + 1] * factor)
    }

    /// Part of every pixel that objects cover.
    pub fn object_coverage(&self) -> Vec<f32> {
        self.means(|pixel, factor| pixel[2 * CHANNELS + 2] * factor)
    }
}

impl Film {
    pub fn new(width: usize, height: usize, layers: usize) -> Self {
        let light = LightFilm::new(width * height, layers, 1);
        Self { width, height, paths: 0, light, surfaces: SurfaceFilm::new(width * height) }
    }

    /// One light's part of the radiance: 0 is the recovered light, then the added ones.
    pub fn layer(&self, index: usize) -> Vec<Radiance> {
        self.light.layer(index)
    }

    pub fn layers(&self) -> usize {
        self.light.summed()
    }

    /// All of the radiance.
    pub fn beauty(&self) -> Vec<Radiance> {
        self.light.sum()
    }

    /// Direct light at the visible surfaces.
    pub fn direct(&self) -> Vec<Radiance> {
        self.light.layer(self.light.summed)
    }

    pub fn albedo(&self) -> Vec<Radiance> {
        self.surfaces.albedo()
    }

    /// Mean of unit normals.
    pub fn normal(&self) -> Vec<Radiance> {
        self.surfaces.normal()
    }

    /// Mean distance from the camera in metres; 0 where nothing is known.
    pub fn distance_m(&self) -> Vec<f32> {
        self.surfaces.distance_m()
    }

    /// Part of every pixel that known surfaces or objects cover.
    pub fn coverage(&self) -> Vec<f32> {
        self.surfaces.coverage()
    }

    /// Part of every pixel that objects cover.
    pub fn object_coverage(&self) -> Vec<f32> {
        self.surfaces.object_coverage()
    }

    /// Puts other means in the light's layers' places; the noise is no longer known.
    pub(super) fn set_layers(&mut self, layers: &[Vec<Radiance>]) {
        self.light.set_layers(layers);
    }

    /// Standard error of the brightness over the whole picture, relative to its mean: from the
    /// difference between every other path and the rest. `None` before there are two of each.
    pub fn noise(&self) -> Option<f64> {
        if self.paths < 4 {
            return None;
        }
        let (mut squares, mut sum) = (0.0f64, 0.0f64);
        for index in 0..self.width * self.height {
            let (means, error) = self.light.light(index);
            // Both halves have as many paths: an even number was traced.
            squares += f64::from(error).powi(2);
            sum += means.take(self.light.summed).map(|light| f64::from(mean(light))).sum::<f64>();
        }
        let count = (self.width * self.height).max(1) as f64;
        (sum > 0.0).then(|| (squares / count).sqrt() / (sum / count))
    }
}

/// Room for the light of one path, and the sums over the paths of one pixel.
pub(super) struct Buffer {
    layers: Vec<Radiance>,
    sums: Vec<Radiance>,
    odd: Vec<Radiance>,
    surface: [f32; SURFACE],
}

impl Buffer {
    /// For as many layers and what came without a detour.
    pub fn new(layers: usize) -> Self {
        let empty = vec![[0.0; CHANNELS]; layers + 1];
        Self { layers: empty.clone(), sums: empty.clone(), odd: empty, surface: [0.0; SURFACE] }
    }

    /// All layers of the path together.
    pub fn sum(&self) -> Radiance {
        let layers = &self.layers[..self.layers.len() - 1];
        std::array::from_fn(|c| layers.iter().map(|layer| layer[c]).sum())
    }

    /// Empty, for the next path.
    pub fn clear(&mut self) -> Gathered<'_> {
        self.layers.fill([0.0; CHANNELS]);
        Gathered { layers: &mut self.layers }
    }

    /// Adds the path to the sums.
    pub fn take(&mut self, index: u64, first: First, is_new_surface: bool) {
        let add = |sums: &mut [Radiance], layers: &[Radiance]| {
            for (sum, value) in sums.iter_mut().flatten().zip(layers.iter().flatten()) {
                *sum += value;
            }
        };
        add(&mut self.sums, &self.layers);
        if index % 2 == 1 {
            add(&mut self.odd, &self.layers);
        }
        if is_new_surface {
            let normal = if first.is_known { first.normal } else { Vec3::ZERO };
            let known = f32::from(u8::from(first.is_known));
            let rest = [first.distance_m, known, f32::from(u8::from(first.is_object))];
            let values = first.albedo.into_iter().chain(normal.to_array()).chain(rest);
            for (sum, value) in self.surface.iter_mut().zip(values) {
                *sum += value;
            }
        }
    }

    /// Adds the sums of some layers to a pixel of their film, whose first `summed` add up.
    pub fn give(&self, pixel: &mut [f32], layers: std::ops::Range<usize>, summed: usize) {
        let sums = self.sums[layers.clone()].iter().flatten();
        for (value, sum) in pixel.iter_mut().zip(sums) {
            *value += sum;
        }
        if let Some(odd) = pixel.last_mut() {
            *odd += self.odd[layers].iter().take(summed).map(|light| mean(*light)).sum::<f32>();
        }
    }

    /// Adds the sums of what was met to a pixel, and starts with another pixel.
    pub fn finish(&mut self, surface: &mut [f32]) {
        for (value, sum) in surface.iter_mut().zip(self.surface) {
            *value += sum;
        }
        self.sums.fill([0.0; CHANNELS]);
        self.odd.fill([0.0; CHANNELS]);
        self.surface = [0.0; SURFACE];
    }
}

/// The numbers of a pixel's surfaces.
pub(super) const SURFACE_STRIDE: usize = SURFACE;

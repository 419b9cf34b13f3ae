//! What a camera gathers.

use glam::Vec3;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::path::{First, Gathered};

/// Sums over the paths of every pixel.
#[derive(Clone, Debug)]
pub struct Film {
    pub width: usize,
    pub height: usize,
    /// Recovered light, then each added one.
    layers: usize,
    /// Paths per pixel so far.
    pub paths: usize,
    values: Vec<f32>,
}

/// The numbers of a pixel after its layers: direct, the sum of every other path, albedo, normal,
/// distance, known, object.
const REST: usize = 4 * CHANNELS + 3;

impl Film {
    pub fn new(width: usize, height: usize, layers: usize) -> Self {
        let values = vec![0.0; width * height * (CHANNELS * layers + REST)];
        Self { width, height, layers, paths: 0, values }
    }

    fn stride(&self) -> usize {
        CHANNELS * self.layers + REST
    }

    /// The rows of pixels, to be added to side by side.
    pub(super) fn rows(&mut self) -> (usize, impl Iterator<Item = (usize, &mut [f32])>) {
        let (stride, row) = (self.stride(), self.width * self.stride());
        (stride, self.values.chunks_exact_mut(row.max(1)).enumerate())
    }

    /// One channel of all layers of a pixel.
    fn sum(&self, pixel: &[f32], channel: usize) -> f32 {
        (0..self.layers).map(|layer| pixel[CHANNELS * layer + channel]).sum()
    }

    fn mean(&self, first: usize) -> Vec<Radiance> {
        let factor = 1.0 / self.paths.max(1) as f32;
        self.values
            .chunks_exact(self.stride())
            .map(|pixel| std::array::from_fn(|c| pixel[first + c] * factor))
            .collect()
    }

    fn mean_one(&self, index: usize) -> Vec<f32> {
        let factor = 1.0 / self.paths.max(1) as f32;
        self.values.chunks_exact(self.stride()).map(|pixel| pixel[index] * factor).collect()
    }

    /// One light's part of the radiance: 0 is the recovered light, then the added ones.
    pub fn layer(&self, index: usize) -> Vec<Radiance> {
        self.mean(CHANNELS * index)
    }

    pub fn layers(&self) -> usize {
        self.layers
    }

    /// All of the radiance.
    pub fn beauty(&self) -> Vec<Radiance> {
        let factor = 1.0 / self.paths.max(1) as f32;
        self.values
            .chunks_exact(self.stride())
            .map(|pixel| std::array::from_fn(|c| self.sum(pixel, c) * factor))
            .collect()
    }

    /// What reached what is seen without a detour.
    pub fn direct(&self) -> Vec<Radiance> {
        self.mean(CHANNELS * self.layers)
    }

    pub fn albedo(&self) -> Vec<Radiance> {
        self.mean(CHANNELS * (self.layers + 2))
    }

    /// Mean of unit normals.
    pub fn normal(&self) -> Vec<Radiance> {
        self.mean(CHANNELS * (self.layers + 3))
    }

    /// Mean distance from the camera in metres; 0 where nothing is known.
    pub fn distance_m(&self) -> Vec<f32> {
        let sums = self.mean_one(CHANNELS * (self.layers + 4));
        let known = self.coverage();
        sums.iter().zip(known).map(|(&sum, k)| if k > 0.0 { sum / k } else { 0.0 }).collect()
    }

    /// Part of every pixel that known surfaces or objects cover.
    pub fn coverage(&self) -> Vec<f32> {
        self.mean_one(CHANNELS * (self.layers + 4) + 1)
    }

    /// Part of every pixel that objects cover.
    pub fn object_coverage(&self) -> Vec<f32> {
        self.mean_one(CHANNELS * (self.layers + 4) + 2)
    }

    /// Of one pixel the mean radiance of every layer, then of the direct part; and half the
    /// difference between the means of the two halves of its paths, the size of its error.
    pub(super) fn light(&self, index: usize) -> (Vec<Radiance>, Radiance) {
        let stride = self.stride();
        let pixel = &self.values[index * stride..(index + 1) * stride];
        let factor = 1.0 / self.paths.max(1) as f32;
        let triple = |first: usize| std::array::from_fn(|c| pixel[first + c] * factor);
        let layers: Vec<Radiance> =
            (0..=self.layers).map(|layer| triple(CHANNELS * layer)).collect();
        let odd: Radiance = triple(CHANNELS * (self.layers + 1));
        let apart = std::array::from_fn(|c| {
            layers[..self.layers].iter().map(|layer| layer[c]).sum::<f32>() - 2.0 * odd[c]
        });
        (layers, apart)
    }

    /// Replaces what `light` gives; the noise is no longer known.
    pub(super) fn set_light(&mut self, index: usize, layers: &[Radiance]) {
        let stride = self.stride();
        let paths = self.paths as f32;
        let pixel = &mut self.values[index * stride..(index + 1) * stride];
        for (value, mean) in pixel.iter_mut().zip(layers.iter().flatten()) {
            *value = mean * paths;
        }
    }

    /// Standard error of the radiance over the whole picture, relative to its mean: from the
    /// difference between every other path and the rest. `None` before there are two of each.
    pub fn noise(&self) -> Option<f64> {
        if self.paths < 4 {
            return None;
        }
        let odd = CHANNELS * (self.layers + 1);
        let (mut squares, mut sum) = (0.0f64, 0.0f64);
        for pixel in self.values.chunks_exact(self.stride()) {
            for c in 0..CHANNELS {
                let all = self.sum(pixel, c);
                let odd = pixel[odd + c];
                // Both halves have as many paths: an even number was traced.
                squares += f64::from(all - 2.0 * odd).powi(2);
                sum += f64::from(all);
            }
        }
        let count = (CHANNELS * self.width * self.height).max(1) as f64;
        (sum > 0.0).then(|| (squares / count).sqrt() / (sum / count))
    }
}

/// One pixel's numbers, while paths are added.
pub(super) struct Pixel<'a> {
    values: &'a mut [f32],
    layers: usize,
}

impl<'a> Pixel<'a> {
    pub fn new(values: &'a mut [f32]) -> Self {
        let layers = (values.len() - REST) / CHANNELS;
        Self { values, layers }
    }

    /// Adds what one path found.
    pub fn add(&mut self, index: u64, first: First, buffer: &Buffer) {
        let mut next = 0;
        let mut push = |triple: Radiance| {
            for value in triple {
                self.values[next] += value;
                next += 1;
            }
        };
        let mut sum = [0.0; CHANNELS];
        for layer in &buffer.layers {
            push(*layer);
            for (sum, value) in sum.iter_mut().zip(layer) {
                *sum += value;
            }
        }
        push(buffer.direct);
        push(if index % 2 == 1 { sum } else { [0.0; CHANNELS] });
        push(first.albedo);
        push(if first.is_known { first.normal } else { Vec3::ZERO }.to_array());
        let known = f32::from(u8::from(first.is_known));
        push([first.distance_m, known, f32::from(u8::from(first.is_object))]);
        debug_assert_eq!(next, CHANNELS * self.layers + REST);
    }
}

/// Room for one path.
pub(super) struct Buffer {
    layers: Vec<Radiance>,
    direct: Radiance,
}

impl Buffer {
    pub fn new(layers: usize) -> Self {
        Self { layers: vec![[0.0; CHANNELS]; layers], direct: [0.0; CHANNELS] }
    }

    /// All layers together.
    pub fn sum(&self) -> Radiance {
        std::array::from_fn(|c| self.layers.iter().map(|layer| layer[c]).sum())
    }

    /// Empty, for the next path.
    pub fn clear(&mut self) -> Gathered<'_> {
        self.layers.fill([0.0; CHANNELS]);
        self.direct = [0.0; CHANNELS];
        Gathered { layers: &mut self.layers, direct: &mut self.direct }
    }
}

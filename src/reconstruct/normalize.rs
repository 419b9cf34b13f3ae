//! Section 5.2: the first estimate of reflectance, by comprehensive colour normalisation.
//!
//! Finlayson, Schiele, Crowley, "Comprehensive colour image normalization" (1998): divide every
//! pixel by its brightness, then every channel by its mean, and repeat until nothing changes.
//! The first step removes the geometry of the light, the second its colour.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::lattice_step;
use crate::reconstruct::samples::SampleCloud;
use crate::scene::{Image, Views};
use crate::watch::{Cancelled, Watch};

/// The two steps have converged when no channel's gain changes by more than this.
const GAIN_TOLERANCE: f64 = 1e-6;
const MAX_ITERATIONS: usize = 200;

/// The state in which repeated normalisation leaves an image: a pixel's normalised colour is
/// its radiance times `gain`, divided by the sum of these products.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalization {
    gain: Rgb,
}

impl Normalization {
    /// Normalises an image, over its valid pixels. An image without light in some channel keeps
    /// that channel at zero.
    pub fn of(image: &Image, watch: &Watch) -> Result<Self, Cancelled> {
        let mut gain = [1.0; CHANNELS];
        let step = lattice_step(image.width() * image.height(), MOST_PIXELS);
        for _ in 0..MAX_ITERATIONS {
            watch.check()?;
            // Both steps only ever scale pixels and channels, so the normalised image is known
            // from the channels' accumulated gains, and need not be stored.
            let (mut sum, mut count) = ([0.0f64; CHANNELS], 0.0f64);
            for y in (0..image.height()).step_by(step) {
                for x in (0..image.width()).step_by(step) {
                    let Some(radiance) = image.radiance(x, y) else { continue };
                    let Some(colour) = normalized(radiance, gain) else { continue };
                    for (sum, value) in sum.iter_mut().zip(colour) {
                        *sum += value;
                    }
                    count += 1.0;
                }
            }
            let mut change = 0.0f64;
            for (gain, sum) in gain.iter_mut().zip(sum) {
                if sum > 0.0 {
                    // The channel's mean becomes 1/3.
                    let factor = count / (CHANNELS as f64 * sum);
                    *gain *= factor;
                    change = change.max((factor - 1.0).abs());
                }
            }
            if change < GAIN_TOLERANCE {
                break;
            }
        }
        Ok(Self { gain })
    }

    /// The normalised colour of a pixel: three numbers that add up to 1; `None` for black.
    pub fn apply(&self, radiance: Radiance) -> Option<Rgb> {
        normalized(radiance, self.gain)
    }
}

/// Pixels are read in every round. Of a photograph that has more than this, only every k-th pixel
/// of every k-th row is used.
const MOST_PIXELS: usize = 1 << 20;

fn normalized(radiance: Radiance, gain: Rgb) -> Option<Rgb> {
    let scaled: Rgb = std::array::from_fn(|c| f64::from(radiance[c]) * gain[c]);
    let sum: f64 = scaled.iter().sum();
    (sum > 0.0 && sum.is_finite()).then(|| scaled.map(|value| value / sum))
}

/// Eq. 11: the mean normalised colour of each material's samples; `None` where it has none.
pub fn initial_diffuse(
    views: &Views,
    cloud: &SampleCloud,
    watch: &Watch,
) -> Result<Vec<Option<Rgb>>, Cancelled> {
    let mut normalizations = vec![None; views.capture.photographs.len()];
    let of_buffers: Vec<Normalization> = views
        .buffers
        .par_iter()
        .map(|buffer| {
            let normalization = Normalization::of(buffer.image, watch);
            buffer.image.release();
            normalization
        })
        .collect::<Result<_, Cancelled>>()?;
    for (buffer, normalization) in views.buffers.iter().zip(of_buffers) {
        normalizations[buffer.photograph] = Some(normalization);
    }
    let mut sums = vec![([0.0f64; CHANNELS], 0.0f64); views.capture.materials.len()];
    for sample in &cloud.samples {
        let (sum, count) = &mut sums[sample.material];
        for view in &cloud.views[sample.views.clone()] {
            let colour = normalizations[view.photograph].and_then(|n| n.apply(view.radiance));
            // A black sample is black whatever the light.
            let colour = colour.unwrap_or([0.0; CHANNELS]);
            let share = 1.0 / sample.views.len() as f64;
            for (sum, value) in sum.iter_mut().zip(colour) {
                *sum += share * value;
            }
            *count += share;
        }
    }
    Ok(sums
        .into_iter()
        .map(|(sum, count)| (count > 0.0).then(|| sum.map(|value| value / count)))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two steps carried out on stored pixels, as the paper describes them.
    fn stepwise(pixels: &[Radiance]) -> Vec<Rgb> {
        let mut image: Vec<Rgb> = pixels.iter().map(|p| p.map(f64::from)).collect();
        for _ in 0..300 {
            for pixel in &mut image {
                let sum: f64 = pixel.iter().sum();
                *pixel = pixel.map(|value| value / sum);
            }
            for c in 0..CHANNELS {
                let sum: f64 = image.iter().map(|pixel| pixel[c]).sum();
                let factor = image.len() as f64 / (3.0 * sum);
                image.iter_mut().for_each(|pixel| pixel[c] *= factor);
            }
        }
        image
    }

    fn pixels() -> Vec<Radiance> {
        let value = |i: usize, c: usize| 0.05 + ((7 * i + 3 * c + i * c) % 11) as f32 / 7.0;
        (0..24).map(|i| std::array::from_fn(|c| value(i, c))).collect()
    }

    #[test]
    fn gains_equal_the_steps_on_stored_pixels() {
        let image = Image::new(6, 4, pixels(), None);
        let normalization = Normalization::of(&image, &Watch::new()).unwrap();
        for (pixel, expected) in pixels().into_iter().zip(stepwise(&pixels())) {
            for (value, expected) in normalization.apply(pixel).unwrap().iter().zip(expected) {
                assert!((value - expected).abs() < 1e-5, "{value} is not {expected}");
            }
        }
    }

    #[test]
    fn light_colour_and_shading_are_removed() {
        let lit: Vec<Radiance> = pixels()
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let shade = 0.2 + (i % 5) as f32;
                [p[0] * shade * 1.0, p[1] * shade * 0.4, p[2] * shade * 0.1]
            })
            .collect();
        let watch = Watch::new();
        let white = Normalization::of(&Image::new(6, 4, pixels(), None), &watch).unwrap();
        let orange = Normalization::of(&Image::new(6, 4, lit.clone(), None), &watch).unwrap();
        for (a, b) in pixels().into_iter().zip(lit) {
            let (a, b) = (white.apply(a).unwrap(), orange.apply(b).unwrap());
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{a:?} is not {b:?}");
        }
    }
}

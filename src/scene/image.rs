//! A photograph's linear radiance, with the pixels that are no measurement marked.

use crate::math::rgb::Radiance;

/// A pixel at or above this in a channel is no measurement, in whatever unit: sums of such values
/// and their squares would leave the range of single precision, and an infinite radiance would
/// spoil every equation it is part of.
const LARGEST: f32 = 1e18;

/// Linear radiance in the capture's arbitrary unit, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<Radiance>,
    /// Finite, not negative, below saturation and below [`LARGEST`] in every channel.
    valid: Vec<bool>,
    invalid: usize,
}

impl Image {
    /// Marks as invalid every pixel with a channel that is not finite, negative, at or above
    /// `saturation`, or 1e18 and more.
    ///
    /// # Panics
    /// If `pixels` does not have `width × height` entries.
    pub fn new(
        width: usize,
        height: usize,
        pixels: Vec<Radiance>,
        saturation: Option<f32>,
    ) -> Self {
        assert_eq!(pixels.len(), width * height);
        let limit = saturation.unwrap_or(LARGEST).min(LARGEST);
        let valid: Vec<bool> = pixels
            .iter()
            .map(|pixel| pixel.iter().all(|&v| v.is_finite() && v >= 0.0 && v < limit))
            .collect();
        let invalid = valid.iter().filter(|valid| !**valid).count();
        Self { width, height, pixels, valid, invalid }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    pub fn height(&self) -> usize {
        self.height
    }

    /// Every pixel as it was read, invalid ones included.
    pub fn pixels(&self) -> &[Radiance] {
        &self.pixels
    }

    /// The radiance of a pixel, or `None` where it is no measurement.
    pub fn radiance(&self, x: usize, y: usize) -> Option<Radiance> {
        let index = y * self.width + x;
        self.valid[index].then(|| self.pixels[index])
    }

    /// The number of pixels that are no measurement.
    pub fn invalid_count(&self) -> usize {
        self.invalid
    }

    /// Multiplies the radiance of every pixel by `gain(x, y)`, leaving validity as it was
    /// decided on the values that the sensor gave.
    pub fn scale(&mut self, gain: impl Fn(usize, usize) -> f32) {
        for y in 0..self.height {
            for x in 0..self.width {
                let g = gain(x, y);
                self.pixels[y * self.width + x] =
                    self.pixels[y * self.width + x].map(|value| value * g);
            }
        }
    }
}

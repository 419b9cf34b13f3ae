//! A photograph's linear radiance, with the pixels that are no measurement marked.

use crate::math::rgb::Radiance;

/// Linear radiance in the capture's arbitrary unit, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<Radiance>,
    /// Finite, not negative and below saturation in every channel.
    valid: Vec<bool>,
    invalid: usize,
}

impl Image {
    /// Marks as invalid every pixel with a channel that is not finite, negative, or at or above
    /// `saturation`.
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
        let limit = saturation.unwrap_or(f32::INFINITY);
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

//! A photograph's linear radiance, with the pixels that are no measurement marked.

use std::sync::Arc;

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
    /// Shared by all states of the mask.
    pixels: Arc<Vec<Radiance>>,
    /// What each pixel is to the reconstruction.
    states: Vec<State>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Finite, not negative, below saturation and below [`LARGEST`] in every channel.
    Measured,
    Invalid,
    /// Left out by a mask: it shows what is not of the scene. Without the mask it would be measured.
    Masked,
    /// Left out by a mask, and invalid without it.
    MaskedInvalid,
}

impl State {
    fn is_masked(self) -> bool {
        matches!(self, Self::Masked | Self::MaskedInvalid)
    }

    fn with_mask(self, is_masked: bool) -> Self {
        match (self, is_masked) {
            (Self::Measured | Self::Masked, false) => Self::Measured,
            (Self::Measured | Self::Masked, true) => Self::Masked,
            (Self::Invalid | Self::MaskedInvalid, false) => Self::Invalid,
            (Self::Invalid | Self::MaskedInvalid, true) => Self::MaskedInvalid,
        }
    }
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
        let is_measured =
            |pixel: &Radiance| pixel.iter().all(|&v| v.is_finite() && v >= 0.0 && v < limit);
        let states = pixels
            .iter()
            .map(|pixel| if is_measured(pixel) { State::Measured } else { State::Invalid })
            .collect();
        Self { width, height, pixels: Arc::new(pixels), states }
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

    /// Whether another image is the same one, apart from its mask.
    pub fn has_pixels_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.pixels, &other.pixels)
    }

    /// The radiance of a pixel, or `None` where it is no measurement.
    pub fn radiance(&self, x: usize, y: usize) -> Option<Radiance> {
        let index = y * self.width + x;
        (self.states[index] == State::Measured).then(|| self.pixels[index])
    }

    /// The radiance that a pixel would have without a mask, or `None` where it is no measurement.
    pub fn radiance_without_mask(&self, x: usize, y: usize) -> Option<Radiance> {
        let index = y * self.width + x;
        matches!(self.states[index], State::Measured | State::Masked).then(|| self.pixels[index])
    }

    /// Leaves out the pixels for which `is_left_out(x, y)`, beside those that are left out already.
    /// From here on nothing reads them as radiance: this is all that a mask is to the
    /// reconstruction.
    pub fn mask(&mut self, is_left_out: impl Fn(usize, usize) -> bool) {
        for (index, state) in self.states.iter_mut().enumerate() {
            if is_left_out(index % self.width, index / self.width) {
                *state = state.with_mask(true);
            }
        }
    }

    /// Leaves out these pixels, row by row from the top, and no others.
    ///
    /// # Panics
    /// If `is_left_out` does not have an entry for each pixel.
    pub fn set_mask(&mut self, is_left_out: &[bool]) {
        assert_eq!(is_left_out.len(), self.states.len());
        for (state, &is_left_out) in self.states.iter_mut().zip(is_left_out) {
            *state = state.with_mask(is_left_out);
        }
    }

    /// For each pixel, row by row from the top, whether a mask leaves it out.
    pub fn mask_pixels(&self) -> Vec<bool> {
        self.states.iter().map(|state| state.is_masked()).collect()
    }

    /// Whether a mask leaves a pixel out. Other pixels that are no measurement are often the
    /// brightest ones; what a mask leaves out says nothing of what is beside it.
    pub fn is_masked(&self, x: usize, y: usize) -> bool {
        self.states[y * self.width + x].is_masked()
    }

    /// The number of pixels that a mask leaves out.
    pub fn masked_count(&self) -> usize {
        self.states.iter().filter(|state| state.is_masked()).count()
    }

    /// The number of other pixels that are no measurement: saturated, negative or not finite.
    pub fn invalid_count(&self) -> usize {
        self.states.iter().filter(|state| **state == State::Invalid).count()
    }

    /// Whether any pixel is a measurement.
    pub fn measures_anything(&self) -> bool {
        self.states.contains(&State::Measured)
    }

    /// Changes the radiance of every pixel, leaving validity as it was decided on the values that
    /// the sensor gave.
    pub fn recolor(&mut self, of: impl Fn(Radiance) -> Radiance) {
        Arc::make_mut(&mut self.pixels).iter_mut().for_each(|pixel| *pixel = of(*pixel));
    }

    /// Multiplies the radiance of every pixel by `gain(x, y)`, leaving validity as it was
    /// decided on the values that the sensor gave.
    pub fn scale(&mut self, gain: impl Fn(usize, usize) -> f32) {
        let pixels = Arc::make_mut(&mut self.pixels);
        for (index, pixel) in pixels.iter_mut().enumerate() {
            let gain = gain(index % self.width, index / self.width);
            *pixel = pixel.map(|value| value * gain);
        }
    }
}

//! The linear radiance of a photograph, in which pixels that are not measurements are marked.

use std::fmt;
use std::sync::Arc;

use super::pixels::{Bits, Pixels, Stored, Values};
use crate::math::rgb::Radiance;

/// A pixel at or above this in a channel is no measurement, in whatever unit: sums of such values
/// and their squares would leave the range of single precision, and an infinite radiance would
/// spoil every equation it is part of.
const LARGEST: f32 = 1e18;

/// Linear radiance in the capture's arbitrary unit, row by row from the top.
#[derive(Clone)]
pub struct Image {
    width: usize,
    height: usize,
    /// Shared by all states of the mask.
    pixels: Arc<Pixels>,
    /// By which they are multiplied when they are read.
    gain: f32,
    /// What is not finite, negative, saturated or [`LARGEST`] in a channel.
    invalid: Arc<Bits>,
    /// Left out by a mask: it shows what is not of the scene.
    masked: Arc<Bits>,
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
        Self::of_values(width, height, pixels.into(), saturation)
    }

    /// As [`Self::new`].
    ///
    /// # Panics
    /// If `pixels` does not have `width × height` entries.
    pub fn of_values(width: usize, height: usize, pixels: Values, saturation: Option<f32>) -> Self {
        assert_eq!(pixels.len(), width * height);
        let invalid = pixels.outside(saturation.unwrap_or(LARGEST).min(LARGEST));
        Self {
            width,
            height,
            pixels: Arc::new(Pixels::Held(pixels)),
            gain: 1.0,
            invalid: Arc::new(invalid),
            masked: Arc::default(),
        }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    pub fn height(&self) -> usize {
        self.height
    }

    /// A pixel as it was read, though it may be invalid.
    pub fn pixel(&self, x: usize, y: usize) -> Radiance {
        self.at(y * self.width + x)
    }

    /// Every pixel as it was read, invalid ones included.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = Radiance> + '_ {
        (0..self.width * self.height).map(|index| self.at(index))
    }

    /// Whether another image is the same one, apart from its mask.
    pub fn has_pixels_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.pixels, &other.pixels) && self.gain.to_bits() == other.gain.to_bits()
    }

    /// The radiance of a pixel, or `None` where it is no measurement.
    pub fn radiance(&self, x: usize, y: usize) -> Option<Radiance> {
        let index = y * self.width + x;
        (!self.invalid.get(index) && !self.masked.get(index)).then(|| self.at(index))
    }

    /// The radiance that a pixel would have without a mask, or `None` where it is no measurement.
    pub fn radiance_without_mask(&self, x: usize, y: usize) -> Option<Radiance> {
        let index = y * self.width + x;
        (!self.invalid.get(index)).then(|| self.at(index))
    }

    #[inline]
    fn at(&self, index: usize) -> Radiance {
        self.pixels.get(index).map(|value| value * self.gain)
    }

    /// Leaves out the pixels for which `is_left_out(x, y)`, beside those that are left out already.
    /// From here on nothing reads them as radiance: this is all that a mask is to the
    /// reconstruction.
    pub fn mask(&mut self, is_left_out: impl Fn(usize, usize) -> bool) {
        let (width, masked) = (self.width, &self.masked);
        let is_masked =
            |index: usize| masked.get(index) || is_left_out(index % width, index / width);
        self.masked = Arc::new(Bits::of(width * self.height, is_masked));
    }

    /// Leaves out these pixels, row by row from the top, and no others.
    ///
    /// # Panics
    /// If `is_left_out` does not have an entry for each pixel.
    pub fn set_mask(&mut self, is_left_out: &[bool]) {
        assert_eq!(is_left_out.len(), self.width * self.height);
        self.masked = Arc::new(Bits::of(is_left_out.len(), |index| is_left_out[index]));
    }

    /// For each pixel, row by row from the top, whether a mask leaves it out.
    pub fn mask_pixels(&self) -> Vec<bool> {
        (0..self.width * self.height).map(|index| self.masked.get(index)).collect()
    }

    /// Whether a mask leaves a pixel out. Other pixels that are no measurement are often the
    /// brightest ones; what a mask leaves out says nothing of what is beside it.
    pub fn is_masked(&self, x: usize, y: usize) -> bool {
        self.masked.get(y * self.width + x)
    }

    /// The number of pixels that a mask leaves out.
    pub fn masked_count(&self) -> usize {
        self.masked.count()
    }

    /// The number of other pixels that are no measurement: saturated, negative or not finite.
    pub fn invalid_count(&self) -> usize {
        self.invalid.count_without(&self.masked)
    }

    /// Whether any pixel is a measurement.
    pub fn measures_anything(&self) -> bool {
        self.invalid.count_with(&self.masked) < self.width * self.height
    }

    /// Changes the radiance of every pixel, leaving validity as it was decided on the values that
    /// the sensor gave.
    pub fn recolor(&mut self, of: impl Fn(Radiance) -> Radiance) {
        self.set_pixels(self.pixels().map(of).collect());
    }

    fn set_pixels(&mut self, pixels: Vec<Radiance>) {
        self.pixels = Arc::new(Pixels::Held(pixels.into()));
        self.gain = 1.0;
    }

    /// Multiplies the radiance of every pixel by `gain(x, y)`, leaving validity as it was
    /// decided on the values that the sensor gave.
    pub fn scale(&mut self, gain: impl Fn(usize, usize) -> f32) {
        let scaled = |(index, pixel): (usize, Radiance)| {
            let gain = gain(index % self.width, index / self.width);
            pixel.map(|value| value * gain)
        };
        self.set_pixels(self.pixels().enumerate().map(scaled).collect());
    }

    /// The same with every pixel multiplied by one factor when it is read.
    pub fn with_gain(&self, gain: f32) -> Self {
        if self.gain != 1.0 {
            let mut scaled = self.clone();
            scaled.scale(|_, _| gain);
            return scaled;
        }
        Self { gain, ..self.clone() }
    }

    /// Bytes that the pixels take, in memory or, once they are [kept elsewhere](Self::keep), there.
    pub fn byte_count(&self) -> usize {
        self.pixels.bytes().len()
    }

    /// Bytes of memory that the pixels take: none where they are kept elsewhere.
    pub fn memory_bytes(&self) -> usize {
        if self.pixels.is_stored() { 0 } else { self.byte_count() }
    }

    /// The pixels, to be kept elsewhere for [`Self::keep`].
    pub fn bytes(&self) -> &[u8] {
        self.pixels.bytes()
    }

    /// Reads the pixels from a copy of [`Self::bytes`] from now on, and no longer from memory.
    /// Returns whether it does: not where there are not as many bytes.
    pub fn keep(&mut self, bytes: Box<dyn Stored>) -> bool {
        let stored = self.pixels.stored(bytes);
        let is_kept = stored.is_some();
        if let Some(stored) = stored {
            self.pixels = Arc::new(stored);
        }
        is_kept
    }

    /// To be called after all pixels were read: those that are kept elsewhere leave memory until
    /// they are read again.
    pub fn release(&self) {
        self.pixels.release();
    }
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Image({} x {})", self.width, self.height)
    }
}

impl PartialEq for Image {
    fn eq(&self, other: &Self) -> bool {
        let size = |own: &Self| (own.width, own.height);
        size(self) == size(other)
            && (&self.invalid, &self.masked) == (&other.invalid, &other.masked)
            && (self.has_pixels_of(other) || self.pixels().eq(other.pixels()))
    }
}

#[cfg(test)]
mod tests;

//! The pixel values of a photograph: as half floats if this loses no precision, and in a file if
//! there are too many for memory.

use std::fmt;

use half::f16;
use half::slice::HalfFloatSliceExt;

use crate::math::rgb::{CHANNELS, Radiance};

/// Bytes that are kept elsewhere than in this process's own memory, such as in a file.
pub trait Stored: fmt::Debug + Send + Sync {
    fn bytes(&self) -> &[u8];

    /// Nothing of them will be read for a while: what of them is in memory can go.
    fn release(&self);
}

/// The values of pixels that are in memory, row by row from the top.
#[derive(Clone, Debug)]
pub enum Values {
    Half(Vec<[f16; CHANNELS]>),
    Single(Vec<Radiance>),
}

/// Values that are converted at a time.
const BATCH: usize = 4096 * CHANNELS;

impl From<Vec<Radiance>> for Values {
    /// As half floats where all of them are equal to the values, else as they are.
    fn from(pixels: Vec<Radiance>) -> Self {
        let mut half = vec![[f16::ZERO; CHANNELS]; pixels.len()];
        let mut back = [0.0; BATCH];
        let batches = pixels.as_flattened().chunks(BATCH);
        for (values, half) in batches.zip(half.as_flattened_mut().chunks_mut(BATCH)) {
            let back = &mut back[..values.len()];
            half.convert_from_f32_slice(values);
            half.convert_to_f32_slice(back);
            let is_half = |(value, back): (&f32, &f32)| value == back || value.is_nan();
            if !std::iter::zip(values, &*back).all(is_half) {
                return Self::Single(pixels);
            }
        }
        Self::Half(half)
    }
}

impl Values {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Half(pixels) => pixels.len(),
            Self::Single(pixels) => pixels.len(),
        }
    }

    /// Those with a channel that is negative, not a number, or `limit` and more; there is one.
    pub(super) fn outside(&self, limit: f32) -> Bits {
        match self {
            Self::Half(pixels) => {
                // Half floats that are not negative are in the order of their bits.
                let below = |bits: &u16| f16::from_bits(*bits).to_f32() < limit;
                let count = (0..f16::INFINITY.to_bits()).take_while(below).count() as u16;
                let negative_zero = if count > 0 { f16::NEG_ZERO } else { f16::NAN }.to_bits();
                let is_inside = |value: f16| {
                    let bits = value.to_bits();
                    (bits < count) | (bits == negative_zero)
                };
                Bits::of(pixels.len(), |index| {
                    let [r, g, b] = pixels[index].map(is_inside);
                    !(r & g & b)
                })
            }
            Self::Single(pixels) => {
                let is_inside = |value: f32| (value >= 0.0) & (value < limit);
                Bits::of(pixels.len(), |index| {
                    let [r, g, b] = pixels[index].map(is_inside);
                    !(r & g & b)
                })
            }
        }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Self::Half(pixels) => bytemuck::cast_slice(pixels.as_flattened().reinterpret_cast()),
            Self::Single(pixels) => bytemuck::cast_slice(pixels),
        }
    }
}

pub(super) enum Pixels {
    Held(Values),
    /// The same, as [`Pixels::bytes`] gave them.
    Stored {
        is_half: bool,
        bytes: Box<dyn Stored>,
    },
}

impl Pixels {
    #[inline]
    pub fn get(&self, index: usize) -> Radiance {
        match self {
            Self::Held(Values::Half(pixels)) => pixels[index].map(f16::to_f32),
            Self::Held(Values::Single(pixels)) => pixels[index],
            Self::Stored { is_half: true, bytes } => {
                let pixel = &bytes.bytes().as_chunks::<2>().0[CHANNELS * index..][..CHANNELS];
                std::array::from_fn(|c| f16::from_ne_bytes(pixel[c]).to_f32())
            }
            Self::Stored { is_half: false, bytes } => {
                let pixel = &bytes.bytes().as_chunks::<4>().0[CHANNELS * index..][..CHANNELS];
                std::array::from_fn(|c| f32::from_ne_bytes(pixel[c]))
            }
        }
    }

    /// The values, to be kept for [`Self::stored`].
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Held(values) => values.bytes(),
            Self::Stored { bytes, .. } => bytes.bytes(),
        }
    }

    /// These values, of bytes that are equal to [`Self::bytes`]; `None` where they are not as many.
    pub fn stored(&self, bytes: Box<dyn Stored>) -> Option<Self> {
        let is_half = match self {
            Self::Held(values) => matches!(values, Values::Half(_)),
            Self::Stored { is_half, .. } => *is_half,
        };
        (bytes.bytes().len() == self.bytes().len()).then_some(Self::Stored { is_half, bytes })
    }

    pub fn is_stored(&self) -> bool {
        matches!(self, Self::Stored { .. })
    }

    pub fn release(&self) {
        if let Self::Stored { bytes, .. } = self {
            bytes.release();
        }
    }
}

/// One bit for each pixel; none is kept while all are clear.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Bits {
    words: Vec<u64>,
}

impl Bits {
    /// Of so many pixels those for which `is_set(index)`.
    pub fn of(count: usize, is_set: impl Fn(usize) -> bool) -> Self {
        let word = |first: usize| {
            (first..count.min(first + 64))
                .filter(|index| is_set(*index))
                .fold(0, |word, index| word | 1 << (index - first))
        };
        let words: Vec<u64> = (0..count).step_by(64).map(word).collect();
        Self { words: if words.iter().all(|word| *word == 0) { Vec::new() } else { words } }
    }

    #[inline]
    pub fn get(&self, index: usize) -> bool {
        self.words.get(index / 64).is_some_and(|word| word >> (index % 64) & 1 == 1)
    }

    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Those that are set here and not there.
    pub fn count_without(&self, other: &Self) -> usize {
        let words = self.words.iter().enumerate();
        let without = |(index, word): (usize, &u64)| {
            (word & !other.words.get(index).copied().unwrap_or(0)).count_ones() as usize
        };
        words.map(without).sum()
    }

    /// Those that are set here or there.
    pub fn count_with(&self, other: &Self) -> usize {
        other.count() + self.count_without(other)
    }
}

//! The values of a photograph's pixels: half floats where they lose nothing by it, and in a file
//! where there are too many for memory.

use std::fmt;
use std::io::{self, Write};

use half::f16;

use crate::math::rgb::{CHANNELS, Radiance};

/// Bytes that are kept elsewhere than in this process's own memory, such as in a file.
pub trait Stored: fmt::Debug + Send + Sync {
    fn bytes(&self) -> &[u8];

    /// Nothing of them will be read for a while: what of them is in memory can go.
    fn release(&self);
}

/// Row by row from the top.
pub(super) enum Pixels {
    Half(Vec<[f16; CHANNELS]>),
    Single(Vec<Radiance>),
    /// The same, as [`Pixels::write`] has written it.
    Stored {
        is_half: bool,
        bytes: Box<dyn Stored>,
    },
}

impl Pixels {
    /// As half floats where all of them are equal to the values, else as they are.
    pub fn new(pixels: Vec<Radiance>) -> Self {
        let is_half = |value: &f32| value.is_nan() || f16::from_f32(*value).to_f32() == *value;
        if pixels.iter().flatten().all(is_half) {
            Self::Half(pixels.into_iter().map(|pixel| pixel.map(f16::from_f32)).collect())
        } else {
            Self::Single(pixels)
        }
    }

    #[inline]
    pub fn get(&self, index: usize) -> Radiance {
        match self {
            Self::Half(pixels) => pixels[index].map(f16::to_f32),
            Self::Single(pixels) => pixels[index],
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

    /// Bytes that the values take, in memory or elsewhere.
    pub fn byte_count(&self) -> usize {
        match self {
            Self::Half(pixels) => size_of_val(pixels.as_slice()),
            Self::Single(pixels) => size_of_val(pixels.as_slice()),
            Self::Stored { bytes, .. } => bytes.bytes().len(),
        }
    }

    /// Writes the values for [`Self::stored`].
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Half(pixels) => {
                pixels.iter().flatten().try_for_each(|value| out.write_all(&value.to_ne_bytes()))
            }
            Self::Single(pixels) => {
                pixels.iter().flatten().try_for_each(|value| out.write_all(&value.to_ne_bytes()))
            }
            Self::Stored { bytes, .. } => out.write_all(bytes.bytes()),
        }
    }

    /// These values, as they were written; `None` where the bytes are not as many.
    pub fn stored(&self, bytes: Box<dyn Stored>) -> Option<Self> {
        let is_half = match self {
            Self::Half(_) => true,
            Self::Single(_) => false,
            Self::Stored { is_half, .. } => *is_half,
        };
        (bytes.bytes().len() == self.byte_count()).then_some(Self::Stored { is_half, bytes })
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

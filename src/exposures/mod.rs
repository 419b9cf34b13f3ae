//! From several exposures of one view to radiance: the camera's response, alignment, weights.
//!
//! A camera turns exposure X = E t (radiance times exposure time) into codes by a response that
//! is the same for all pixels. [`response`] recovers ln X as a function of the code from pixels
//! seen at several exposures (Debevec and Malik, "Recovering High Dynamic Range Radiance Maps
//! from Photographs", 1997, Eq. 3); [`merge()`] then averages ln E over the exposures of every
//! pixel (their Eq. 6) with weights that know noise and clipping; [`align`] finds the
//! translations of hand-held exposures (Ward, "Fast, Robust Image Registration for Compositing
//! High Dynamic Range Photographs from Hand-Held Exposures", 2003); [`times`] holds the stated
//! times against the pixels; [`mosaic`] makes pixels of what a sensor measured.
//!
//! No file is read or written here; codes come in as they are stored, radiance goes out. The unit
//! of radiance is that which gives the middle code in one second, in every channel; series that
//! share a [`Response`] are on one scale. Of the crate it needs `math`, `options` and `watch`.

pub mod align;
pub mod merge;
pub mod mosaic;
pub mod options;
pub mod response;
pub mod samples;
pub mod times;

pub use merge::{Merged, merge};
pub use options::MergeOptions;
pub use response::Response;

/// Codes are counted in 255ths of full scale, whatever the depth of the file.
pub const FULL_SCALE: f32 = 255.0;
/// The knots of a response, one a code of an 8-bit file.
pub const KNOTS: usize = 256;

/// The pixels of one exposure, row by row from the top, as the file has them.
#[derive(Clone, Debug, PartialEq)]
pub enum Codes {
    Eight(Vec<[u8; 3]>),
    Sixteen(Vec<[u16; 3]>),
}

impl Codes {
    pub fn len(&self) -> usize {
        match self {
            Self::Eight(codes) => codes.len(),
            Self::Sixteen(codes) => codes.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A pixel in 255ths of full scale.
    pub fn at(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Eight(codes) => codes[index].map(f32::from),
            // 65535 / 255 = 257.
            Self::Sixteen(codes) => codes[index].map(|code| f32::from(code) / 257.0),
        }
    }
}

/// One photograph of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposure {
    pub width: usize,
    pub height: usize,
    pub codes: Codes,
    /// The light let in relative to one second, above 0: the exposure time, times what aperture
    /// and sensitivity add where they differ.
    pub seconds: f64,
    /// What is at (x, y) in the reference is at (x, y) + shift here, in pixels.
    pub shift: [isize; 2],
}

impl Exposure {
    /// The index of the pixel that shows what the reference has at (x, y), if it is in the image.
    pub fn index(&self, x: usize, y: usize) -> Option<usize> {
        let x = x.checked_add_signed(self.shift[0]).filter(|x| *x < self.width)?;
        let y = y.checked_add_signed(self.shift[1]).filter(|y| *y < self.height)?;
        Some(y * self.width + x)
    }
}

/// The light lost towards the corners: an image is radiance × (1 + a r² + b r⁴), r in half
/// diagonals from the principal point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vignetting {
    pub a: f64,
    pub b: f64,
}

impl Vignetting {
    /// The factor by which a place at the squared radius `r2`, in half diagonals, is darkened.
    pub fn falloff(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.a + r2 * self.b)
    }

    /// The smallest factor up to r = 1, the corner of an image whose principal point is in its
    /// middle.
    pub fn darkest(&self) -> f64 {
        // A parabola in r²: its ends, and its vertex where that lies between.
        let vertex = -0.5 * self.a / self.b;
        let vertex = if vertex > 0.0 && vertex < 1.0 { vertex } else { 1.0 };
        self.falloff(0.0).min(self.falloff(1.0)).min(self.falloff(vertex))
    }
}

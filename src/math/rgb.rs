//! Colour triples: red, green and blue are three independent measurements, never mixed here.

/// One value per colour channel, in the order red, green, blue.
pub type Rgb = [f64; 3];

/// Radiance as stored in photographs and samples (single precision, channel order r, g, b).
pub type Radiance = [f32; 3];

/// The number of colour channels.
pub const CHANNELS: usize = 3;

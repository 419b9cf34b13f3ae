//! Colour triples: red, green and blue are three independent measurements, never mixed here.

/// One value per colour channel, in the order red, green, blue.
pub type Rgb = [f64; 3];

/// Radiance as stored in photographs and samples (single precision, channel order r, g, b).
pub type Radiance = [f32; 3];

/// The number of colour channels.
pub const CHANNELS: usize = 3;

/// The luminance of linear Rec. 709 primaries, in their unit.
pub fn luminance<T: Into<f64>>(rgb: [T; CHANNELS]) -> f64 {
    let [red, green, blue] = rgb.map(Into::into);
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// The sRGB transfer function (IEC 61966-2-1), clipped to [0, 1].
pub fn srgb(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The same as a code of 8 bits; 0 of what is not a number.
pub fn srgb_code(linear: f32) -> u8 {
    (255.0 * srgb(linear)).round() as u8
}

/// Linear intensity of an sRGB value, both at most 1.
pub fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

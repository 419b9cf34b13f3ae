//! Colours for numbers and for categories, which colour-blind people can distinguish.

use eframe::egui::Color32;

/// Viridis at even steps, dark to light: magnitudes.
const MAGNITUDE: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Blue over light grey to orange: signed numbers, centred on zero.
const SIGNED: [[u8; 3]; 5] =
    [[20, 78, 160], [120, 165, 214], [228, 228, 228], [240, 165, 90], [190, 84, 0]];

/// Materials by index; the list repeats.
const MATERIALS: [[u8; 3]; 12] = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
    [148, 103, 189],
    [140, 86, 75],
    [127, 191, 63],
    [120, 200, 200],
    [190, 170, 150],
];

/// What is no measurement: saturated, negative or not finite.
pub const INVALID: Color32 = Color32::from_rgb(214, 60, 200);
/// A surface or number of which nothing is known.
pub const UNKNOWN: Color32 = Color32::from_gray(128);
/// Surfaces of luminaires.
pub const LUMINAIRE: Color32 = Color32::from_rgb(255, 244, 200);

/// Colour of a material by its index, colour-blind safe.
pub fn material_color(index: usize) -> Color32 {
    let [r, g, b] = MATERIALS[index % MATERIALS.len()];
    // Each round is a little darker than the one before, so that repeats can be told apart.
    let dim = 0.82f32.powi((index / MATERIALS.len()).min(4) as i32);
    Color32::from_rgb(r, g, b).gamma_multiply_opaque(dim)
}

/// The colours of a capture's materials. Materials without surfaces are not part of a capture, but
/// have their place in the list: the others keep their colours when one comes or goes there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialColors {
    /// The place in the list of each material of the capture; empty where both are the same.
    pub listed: Vec<usize>,
}

impl MaterialColors {
    pub fn of(&self, material: usize) -> Color32 {
        material_color(self.listed.get(material).copied().unwrap_or(material))
    }
}

/// Colour of a magnitude from 0 to 1.
pub fn magnitude(t: f32) -> Color32 {
    along(&MAGNITUDE, t)
}

/// Colour of a signed number from −1 to 1.
pub fn signed(t: f32) -> Color32 {
    along(&SIGNED, 0.5 * t + 0.5)
}

/// The table of magnitudes and the colour of invalid pixels for shaders, which colour by the same
/// numbers.
pub fn wgsl() -> String {
    let vector = |c: [u8; 3]| {
        let [r, g, b] = c.map(|v| f32::from(v) / 255.0);
        format!("vec3<f32>({r:.5}, {g:.5}, {b:.5})")
    };
    let count = MAGNITUDE.len();
    format!(
        "const MAGNITUDES: u32 = {count}u;\nconst MAGNITUDE = array<vec3<f32>, {count}>({});\n\
         const INVALID = {};\n",
        MAGNITUDE.map(vector).join(", "),
        vector([INVALID.r(), INVALID.g(), INVALID.b()])
    )
}

fn along(table: &[[u8; 3]], t: f32) -> Color32 {
    if !t.is_finite() {
        return UNKNOWN;
    }
    let place = t.clamp(0.0, 1.0) * (table.len() - 1) as f32;
    let low = (place as usize).min(table.len() - 2);
    let part = place - low as f32;
    let mix = |c: usize| {
        let (a, b) = (f32::from(table[low][c]), f32::from(table[low + 1][c]));
        (a + (b - a) * part).round() as u8
    };
    Color32::from_rgb(mix(0), mix(1), mix(2))
}

trait Dim {
    fn gamma_multiply_opaque(self, factor: f32) -> Self;
}

impl Dim for Color32 {
    fn gamma_multiply_opaque(self, factor: f32) -> Self {
        let dim = |v: u8| (f32::from(v) * factor).round() as u8;
        Self::from_rgb(dim(self.r()), dim(self.g()), dim(self.b()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_their_ends_and_materials_differ() {
        assert_eq!(magnitude(0.0), Color32::from_rgb(68, 1, 84));
        assert_eq!(magnitude(2.0), Color32::from_rgb(253, 231, 37));
        assert_eq!(signed(0.0), Color32::from_rgb(228, 228, 228));
        assert_eq!(magnitude(f32::NAN), UNKNOWN);
        let colors: std::collections::HashSet<_> = (0..36).map(material_color).collect();
        assert_eq!(colors.len(), 36);
    }
}

//! The colour space that a file states, brought to linear Rec. 709, in which everything is computed.

use std::borrow::Cow;

use exr::meta::attribute::Chromaticities;
use exr::prelude::Vec2;
use glam::{DMat3, DVec3};

use crate::choices;
use crate::math::rgb::Radiance;

/// Rec. ITU-R BT.709 with its white, D65: what OpenEXR files are in that state nothing else.
pub(super) const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.329),
};

/// The primaries of ACES, AP1, with the white of ACES (Academy S-2014-004).
const ACES_CG: Chromaticities = Chromaticities {
    red: Vec2(0.713, 0.293),
    green: Vec2(0.165, 0.83),
    blue: Vec2(0.128, 0.044),
    white: Vec2(0.32168, 0.33767),
};

choices! {
    /// The linear colour space of a file that is written; it states its chromaticities.
    ColorSpace {
        /// That in which everything is computed.
        Rec709 = "rec709",
        /// The working space of ACES.
        AcesCg = "acescg",
    }
}

impl ColorSpace {
    /// Both of them.
    pub const ALL: [Self; 2] = [Self::Rec709, Self::AcesCg];

    pub(super) fn chromaticities(self) -> Chromaticities {
        match self {
            Self::Rec709 => REC_709,
            Self::AcesCg => ACES_CG,
        }
    }

    /// Colours of linear Rec. 709 in this space, white to white. What its primaries cannot make has a
    /// channel below 0.
    pub fn of_rec_709(self, pixels: &[Radiance]) -> Cow<'_, [Radiance]> {
        let matrix = match self {
            Self::Rec709 => None,
            Self::AcesCg => rec_709_from(&ACES_CG).map(|matrix| matrix.inverse()),
        };
        let Some(matrix) = matrix else { return Cow::Borrowed(pixels) };
        pixels.iter().map(|&pixel| product(&matrix, pixel).map(|value| value as f32)).collect()
    }
}

/// Cone responses of XYZ by which whites are adapted (Bradford; ICC.1:2022, Annex E).
const BRADFORD: DMat3 = DMat3::from_cols_array(&[
    0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
]);

/// From linear RGB of these chromaticities to linear Rec. 709, white to white. `None` where they span
/// no colours.
pub(super) fn rec_709_from(stated: &Chromaticities) -> Option<DMat3> {
    let (own, rec_709) = (xyz_from_rgb(stated)?, xyz_from_rgb(&REC_709)?);
    let cones = |space: &Chromaticities| BRADFORD * xyz(space.white);
    let gain = cones(&REC_709) / cones(stated);
    let adapted = BRADFORD.inverse() * DMat3::from_diagonal(gain) * BRADFORD;
    let matrix = rec_709.inverse() * adapted * own;
    matrix.is_finite().then_some(matrix)
}

/// Whether chromaticities are those of Rec. 709, to the digits in which programs write them.
pub(super) fn is_rec_709(stated: &Chromaticities) -> bool {
    let places = |space: &Chromaticities| [space.red, space.green, space.blue, space.white];
    let near = |(a, b): (Vec2<f32>, Vec2<f32>)| (a.0 - b.0).abs().max((a.1 - b.1).abs()) < 1e-3;
    std::iter::zip(places(stated), places(&REC_709)).all(near)
}

/// Converts pixels. What the primaries of Rec. 709 cannot make has a channel below 0 there, which
/// would count as no measurement: it becomes 0. Values that are none stay so.
pub(super) fn convert(pixels: &mut [Radiance], matrix: &DMat3) {
    pixels.iter_mut().for_each(|pixel| *pixel = converted(*pixel, matrix));
}

/// The same of one pixel.
pub(in crate::io) fn converted(pixel: Radiance, matrix: &DMat3) -> Radiance {
    if !pixel.iter().all(|value| value.is_finite() && *value >= 0.0) {
        return pixel;
    }
    product(matrix, pixel).map(|value| value.max(0.0) as f32)
}

fn product(matrix: &DMat3, pixel: Radiance) -> [f64; 3] {
    (*matrix * DVec3::from_array(pixel.map(f64::from))).to_array()
}

/// R, G, B of Y, RY = (R − Y)/Y, BY = (B − Y)/Y, with the luminance of Rec. 709, OpenEXR's
/// default.
pub(super) fn of_luminance_chroma([y, ry, by]: Radiance) -> Radiance {
    let (red, blue) = ((ry + 1.0) * y, (by + 1.0) * y);
    [red, (y - 0.2126 * red - 0.0722 * blue) / 0.7152, blue]
}

/// XYZ of unit luminance.
fn xyz(Vec2(x, y): Vec2<f32>) -> DVec3 {
    let (x, y) = (f64::from(x), f64::from(y));
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// The primaries scaled so that they sum to white (SMPTE RP 177).
fn xyz_from_rgb(space: &Chromaticities) -> Option<DMat3> {
    let primary = |Vec2(x, y): Vec2<f32>| {
        let (x, y) = (f64::from(x), f64::from(y));
        DVec3::new(x, y, 1.0 - x - y)
    };
    let primaries = DMat3::from_cols(primary(space.red), primary(space.green), primary(space.blue));
    let (determinant, white) = (primaries.determinant(), xyz(space.white));
    if !determinant.is_finite() || determinant.abs() < 1e-4 || !white.is_finite() {
        return None;
    }
    let sums = primaries.inverse() * white;
    // A white outside of the triangle would take light of a primary away.
    sums.cmpgt(DVec3::ZERO).all().then(|| primaries * DMat3::from_diagonal(sums))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn golden() -> serde_json::Value {
        serde_json::from_str(include_str!("../../../tests/golden/color/matrices.json")).unwrap()
    }

    /// Against colour-science (`tests/golden/color/make.py`); chromaticities are floats in the file,
    /// six digits of them.
    #[test]
    fn matrices_are_those_of_colour_science() {
        let golden = golden();
        let spaces = golden["spaces"].as_object().unwrap();
        assert_eq!(spaces.len(), 6);
        for (name, space) in spaces {
            let number = |value: &serde_json::Value| value.as_f64().unwrap();
            let at = |value: &serde_json::Value| {
                Vec2(number(&value[0]) as f32, number(&value[1]) as f32)
            };
            let [red, green, blue] = [0, 1, 2].map(|k| at(&space["primaries"][k]));
            let stated = Chromaticities { red, green, blue, white: at(&space["white"]) };
            let matrix = rec_709_from(&stated).unwrap();
            for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
                let expected = number(&space["rec709_from"][row][column]);
                let found = matrix.col(column)[row];
                assert!((found - expected).abs() < 2e-6, "{name}: {found} for {expected}");
            }
            assert_eq!(is_rec_709(&stated), name == "ITU-R BT.709");
        }
    }

    /// Against colour-science, too; and there and back.
    #[test]
    fn acescg_is_written_by_the_inverse_of_the_matrix_that_it_is_read_by() {
        let golden = golden();
        let pixel = [0.2, 0.5, 0.9];
        let written = ColorSpace::AcesCg.of_rec_709(&[pixel])[0];
        for (row, expected) in pixel.into_iter().enumerate() {
            let row = &golden["spaces"]["ACEScg"]["rec709_from"][row];
            let back: f64 = (0..3).map(|k| row[k].as_f64().unwrap() * f64::from(written[k])).sum();
            assert!((back - f64::from(expected)).abs() < 1e-5, "{back} for {expected}");
        }
        let white = ColorSpace::AcesCg.of_rec_709(&[[1.0; 3]])[0];
        assert!(white.iter().all(|value| (value - 1.0).abs() < 1e-5), "{white:?}");
        assert_eq!(*ColorSpace::Rec709.of_rec_709(&[pixel]), [pixel]);
    }

    #[test]
    fn what_spans_no_colours_is_refused() {
        let line = Chromaticities { green: Vec2(0.395, 0.195), ..REC_709 };
        assert!(rec_709_from(&line).is_none());
        let black = Chromaticities { white: Vec2(0.3, 0.0), ..REC_709 };
        assert!(rec_709_from(&black).is_none());
        let beyond = Chromaticities { white: Vec2(0.1, 0.8), ..REC_709 };
        assert!(rec_709_from(&beyond).is_none());
        let none = Chromaticities { red: Vec2(f32::NAN, 0.3), ..REC_709 };
        assert!(rec_709_from(&none).is_none());
    }
}

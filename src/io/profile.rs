//! ICC profiles of JPEG, PNG and TIFF: what the channels of a file are in linear Rec. 709, in which
//! everything is computed, and the curve of its codes.
//!
//! Profiles of three primaries and three curves are read (ICC.1:2022, F.3), and those of a grey
//! scale: what cameras, phones and programs write. Those that are tables, or of other inks, are
//! named and left out.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::exif::{Context, In, Tag, Value};
use ::image::ImageDecoder;
use glam::{DMat3, DVec3};
use moxcms::{ColorProfile, DataColorSpace, Matrix3d, ToneReprCurve};

use super::picture::{self, Format};
use super::{Error, Fault, photograph, raw};
use crate::exposures::{FULL_SCALE, KNOTS, Response};

/// Profiles as programs write them round what they hold: an entry of a matrix nearer than this, or
/// a logarithm of exposure, is the same.
const SAME_MATRIX: f64 = 2e-3;
const SAME_CURVE: f64 = 0.02;
/// The tag of a TIFF that holds its profile (ICC.1:2022, B.4).
const PROFILE: u16 = 34675;
/// Codes below this stand for so little light that rounded curves differ there.
const DARK: usize = 8;

/// What a file says of its colours.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// To linear Rec. 709, white to white; `None` where its primaries are those of Rec. 709.
    pub rec_709: Option<DMat3>,
    pub curve: Response,
}

/// The profile of a file; `None` where it has none. `Err` says in words why one cannot be used.
pub fn read(file: &Path) -> Result<Option<Result<Profile, String>>, Error> {
    if raw::is_raw(file) {
        return Ok(None);
    }
    let reader = picture::reader(file)?;
    // What is wrong with the picture is said where it is decoded. `image` finds none in a TIFF whose
    // profile is of the type that the specification asks for.
    let is_tiff = Format::of(file)? == Format::Tiff;
    let bytes = || match is_tiff {
        true => of_tiff(file),
        false => reader.into_decoder().and_then(|mut decoder| decoder.icc_profile()).ok()?,
    };
    let Ok(Some(bytes)) = catch_unwind(AssertUnwindSafe(bytes)) else { return Ok(None) };
    let parsed = catch_unwind(AssertUnwindSafe(|| parse(&bytes)));
    Ok(Some(parsed.unwrap_or_else(|_| Err("it is damaged".to_owned()))))
}

fn of_tiff(file: &Path) -> Option<Vec<u8>> {
    let exif = photograph::exif(file).ok()??;
    match &exif.get_field(Tag(Context::Tiff, PROFILE), In::PRIMARY)?.value {
        Value::Undefined(bytes, _) | Value::Byte(bytes) => Some(bytes.clone()),
        _ => None,
    }
}

fn parse(bytes: &[u8]) -> Result<Profile, String> {
    let damaged = |reason: moxcms::CmsError| format!("it is damaged ({reason})");
    let profile = ColorProfile::new_from_slice(bytes).map_err(damaged)?;
    let curves = match profile.color_space {
        DataColorSpace::Rgb => [&profile.red_trc, &profile.green_trc, &profile.blue_trc],
        DataColorSpace::Gray => [&profile.gray_trc; 3],
        _ => return Err("it is of inks or another model than RGB and grey".to_owned()),
    };
    let [Some(red), Some(green), Some(blue)] = curves else {
        return Err("it is a table, and not three primaries with their curves".to_owned());
    };
    let curve = Response::Curve(Box::new([knots(red)?, knots(green)?, knots(blue)?]));
    if profile.color_space == DataColorSpace::Gray {
        return Ok(Profile { rec_709: None, curve });
    }
    // Colorants are seen under the white of profiles, D50, from both sides.
    let own = matrix(profile.colorant_matrix());
    if own.determinant().abs() < 1e-4 {
        return Err("its primaries span no colours".to_owned());
    }
    let rec_709 = matrix(ColorProfile::new_srgb().colorant_matrix()).inverse() * own;
    let white = rec_709 * DVec3::ONE;
    if !white.is_finite() || (white - DVec3::ONE).abs().max_element() > 0.05 {
        return Err("its primaries do not add up to white".to_owned());
    }
    // Their sum is white but for 16 bits after the point; what is neutral stays so.
    let rec_709 = DMat3::from_diagonal(white.recip()) * rec_709;
    let off = (rec_709 - DMat3::IDENTITY).to_cols_array().map(f64::abs);
    let is_other = off.iter().any(|off| *off > SAME_MATRIX);
    Ok(Profile { rec_709: is_other.then_some(rec_709), curve })
}

fn matrix(rows: Matrix3d) -> DMat3 {
    DMat3::from_cols_array_2d(&rows.v).transpose()
}

/// ln exposure of codes, that of the middle one being 0.
fn knots(curve: &ToneReprCurve) -> Result<[f64; KNOTS], String> {
    let light = curve.make_linear_evaluator().map_err(|_| "its curve is damaged".to_owned())?;
    let at = |code: f64| f64::from(light.evaluate_value((code / f64::from(FULL_SCALE)) as f32));
    let values: [f64; KNOTS] = std::array::from_fn(|code| at(code as f64));
    let first = values.iter().position(|value| *value > 0.0);
    let first = first.filter(|first| *first < KNOTS / 2);
    let first = first.ok_or_else(|| "its curve is dark throughout".to_owned())?;
    if values.iter().any(|v| !v.is_finite()) || values.windows(2).any(|pair| pair[1] < pair[0]) {
        return Err("its curve decreases".to_owned());
    }
    // No light at all has no logarithm: as in the response of sRGB it is that of half a code.
    let dark = at(first as f64 - 0.5).max(0.5 * values[first]).min(values[first]);
    let middle = values[KNOTS / 2].ln();
    Ok(values.map(|value| if value > 0.0 { value.ln() } else { dark.ln() } - middle))
}

/// The response by which all files are read that are stated to be of sRGB's curve: that of their
/// profiles, where they have another.
pub fn response<'a>(files: impl Iterator<Item = &'a Path>) -> Result<Response, Error> {
    let mut found: Option<(&Path, Response)> = None;
    for file in files {
        let curve = match read(file)? {
            Some(Ok(profile)) if !is_same(&profile.curve, &Response::srgb()) => profile.curve,
            _ => Response::srgb(),
        };
        match &found {
            None => found = Some((file, curve)),
            Some((first, other)) if !is_same(other, &curve) => {
                return Err(Error::Invalid(Fault::new(
                    file,
                    "",
                    format!(
                        "the curve of its ICC profile is not that of {}, and all photographs are \
                         read by one",
                        first.display()
                    ),
                    "Convert all to one profile, or photograph exposure series",
                )));
            }
            Some(_) => {}
        }
    }
    Ok(found.map_or_else(Response::srgb, |(_, curve)| curve))
}

fn is_same(first: &Response, second: &Response) -> bool {
    let codes = || (DARK..KNOTS).flat_map(|code| [(0, code), (1, code), (2, code)]);
    codes().all(|(channel, code)| {
        let at = |curve: &Response| curve.ln_exposure(channel, code as f32);
        (at(first) - at(second)).abs() < SAME_CURVE
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_of_srgb_changes_nothing() {
        let bytes = ColorProfile::new_srgb().encode().unwrap();
        let profile = parse(&bytes).unwrap();
        assert_eq!(profile.rec_709, None);
        assert!(is_same(&profile.curve, &Response::srgb()));
        for cut in [0, 40, 127, 200, bytes.len() / 2] {
            assert!(parse(&bytes[..cut]).is_err(), "{cut}");
        }
    }
}

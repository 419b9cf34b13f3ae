//! Lens and orientation from EXIF: start values for placing a photograph.

use std::path::Path;

use ::exif::{Exif, In, Tag, Value};

use super::Error;
use super::orientation::Orientation;
use super::{photograph, picture, raw};

/// The diagonal of the 36 mm × 24 mm film that "35 mm equivalent" means (CIPA DC-008).
const FILM_DIAGONAL_MM: f64 = 43.266_615_3;

/// `None` where EXIF does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExifLens {
    /// In pixels of the image as it is stored.
    pub focal_px: Option<f64>,
    /// How the pixels are to be turned; upright where it does not say.
    pub orientation: Orientation,
}

/// Reads it; nothing where the file has no EXIF, or it is broken.
pub fn read(file: &Path) -> Result<ExifLens, Error> {
    let Some(exif) = photograph::exif(file)? else {
        return Ok(ExifLens { focal_px: None, orientation: held(file, None) });
    };
    let size = picture::dimensions(file)
        .or_else(|_| photograph::head(file).map(|(width, height, _)| (width, height)));
    let (width, height) = size?;
    let focal_px = by_film(&exif, width, height).or_else(|| by_sensor(&exif, width));
    Ok(ExifLens {
        focal_px: focal_px.filter(|focal| focal.is_finite() && *focal > 0.0),
        orientation: held(file, Some(&exif)),
    })
}

/// How the pixels of a photograph are to be turned by its EXIF; upright where that does not say.
/// Images of radiance are as programs wrote them.
pub fn orientation(file: &Path) -> Result<Orientation, Error> {
    Ok(held(file, photograph::exif(file)?.as_ref()))
}

fn held(file: &Path, exif: Option<&Exif>) -> Orientation {
    // Decoders of RAW photographs know where their camera says it.
    if raw::is_raw(file)
        && let Ok(own) = raw::orientation(file)
    {
        return own;
    }
    let field = exif.and_then(|exif| exif.get_field(Tag::Orientation, In::PRIMARY));
    field.and_then(|field| Orientation::of(field.value.get_uint(0)?)).unwrap_or_default()
}

/// From the focal length that gives the same angle of view on film.
fn by_film(exif: &Exif, width: usize, height: usize) -> Option<f64> {
    let focal_mm = number(exif, Tag::FocalLengthIn35mmFilm).filter(|focal| *focal > 0.0)?;
    Some(focal_mm / FILM_DIAGONAL_MM * (width as f64).hypot(height as f64))
}

/// From the focal length and the sensor's pixels per unit of length.
fn by_sensor(exif: &Exif, width: usize) -> Option<f64> {
    let focal_mm = number(exif, Tag::FocalLength)?;
    let density = number(exif, Tag::FocalPlaneXResolution)?;
    let unit_mm = match number(exif, Tag::FocalPlaneResolutionUnit).unwrap_or(2.0) as u32 {
        3 => 10.0,
        4 => 1.0,
        5 => 1e-3,
        _ => 25.4,
    };
    // The image may have been made smaller; the density is of the size that EXIF states.
    let stated = number(exif, Tag::PixelXDimension).filter(|stated| *stated > 0.0);
    let shrink = stated.map_or(1.0, |stated| width as f64 / stated);
    Some(focal_mm * density / unit_mm * shrink)
}

fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first().map(::exif::Rational::to_f64),
        Value::SRational(values) => values.first().map(::exif::SRational::to_f64),
        value => value.get_uint(0).map(f64::from),
    }
}

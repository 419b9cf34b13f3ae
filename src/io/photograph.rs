//! Photographs as cameras write them: 8 and 16 bits a channel in JPEG, PNG, TIFF or RAW (see
//! [`raw`]), with the exposure that their EXIF states.

use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::exif::{Exif, In, Tag, Value};
use ::image::{DynamicImage, Limits};

use super::picture::{self, Format, LARGEST_SIDE_PRODUCT};
use super::{Error, Fault, raw};
use crate::exposures::Codes;

/// The codes of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    pub width: usize,
    pub height: usize,
    pub codes: Codes,
}

/// What EXIF says of how a photograph was taken; `None` where it does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shot {
    pub exposure_secs: Option<f64>,
    pub f_number: Option<f64>,
    pub iso: Option<f64>,
    /// When the shutter opened, in seconds since some day.
    pub taken_secs: Option<f64>,
}

/// Decodes a photograph, as its pixels are stored: EXIF's orientation is not applied, since
/// cameras are calibrated on the pixels. A single channel becomes three equal ones, opacity is
/// left out.
pub fn read(file: &Path) -> Result<Photo, Error> {
    if raw::is_raw(file) {
        return raw::read(file);
    }
    // Refuses other files, and sizes that no photograph has.
    head(file)?;
    let mut reader = picture::reader(file)?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(8 * LARGEST_SIDE_PRODUCT);
    reader.limits(limits);
    // Its decoders are said not to panic, but they see files from anywhere.
    let decoded = catch_unwind(AssertUnwindSafe(|| reader.decode()))
        .map_err(|_| damaged(file, "its contents contradict its header"))?
        .map_err(|failure| failed(file, failure))?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    if width == 0 || height == 0 {
        return Err(damaged(file, "it has no pixels"));
    }
    let codes = match decoded {
        image @ (DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_)) => {
            Codes::Eight(image.into_rgb8().into_raw().as_chunks::<3>().0.to_vec())
        }
        image @ (DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)) => {
            Codes::Sixteen(image.into_rgb16().into_raw().as_chunks::<3>().0.to_vec())
        }
        _ => return Err(not_an_exposure(file)),
    };
    Ok(Photo { width, height, codes })
}

/// Width, height and bytes a channel, from the file's head alone.
pub fn head(file: &Path) -> Result<(usize, usize, usize), Error> {
    use ::image::ImageDecoder;
    if raw::is_raw(file) {
        return raw::dimensions(file).map(|(width, height)| (width, height, 2));
    }
    let densest = densest(file)?;
    let unreadable = |source| Error::Read { file: file.to_owned(), source };
    let length = std::fs::metadata(file).map_err(unreadable)?.len();
    let reader = picture::reader(file)?;
    let look = || {
        let decoder = reader.into_decoder()?;
        let (width, height) = decoder.dimensions();
        let color = decoder.color_type();
        let bytes = usize::from(color.bytes_per_pixel() / color.channel_count().max(1));
        Ok((width as usize, height as usize, bytes))
    };
    let (width, height, bytes) = catch_unwind(AssertUnwindSafe(look))
        .map_err(|_| damaged(file, "its header is broken"))?
        .map_err(|failure| failed(file, failure))?;
    let pixels = width as u64 * height as u64;
    if pixels > LARGEST_SIDE_PRODUCT {
        return Err(super::picture::too_large(file, width as u64, height as u64));
    }
    if pixels > length.saturating_mul(densest) {
        return Err(damaged(
            file,
            &format!("its {length} bytes cannot hold {width} x {height} pixels"),
        ));
    }
    Ok((width, height, bytes))
}

/// What the EXIF data of a file say; nothing where there are none, or they are broken.
pub fn shot(file: &Path) -> Result<Shot, Error> {
    if raw::is_raw(file) {
        return raw::shot(file).or_else(|failure| match failure {
            Error::Read { .. } => Err(failure),
            _ => Ok(Shot::default()),
        });
    }
    let Some(exif) = exif(file)? else { return Ok(Shot::default()) };
    // Shutter speed and aperture may be given as logarithms only (APEX).
    let exposure = number(&exif, Tag::ExposureTime)
        .or_else(|| number(&exif, Tag::ShutterSpeedValue).map(|value| (-value).exp2()));
    let f_number = number(&exif, Tag::FNumber)
        .or_else(|| number(&exif, Tag::ApertureValue).map(|value| (0.5 * value).exp2()));
    let positive = |value: &f64| value.is_finite() && *value > 0.0;
    Ok(Shot {
        exposure_secs: exposure.filter(positive),
        f_number: f_number.filter(positive),
        iso: number(&exif, Tag::PhotographicSensitivity).filter(positive),
        taken_secs: taken(&exif),
    })
}

/// The EXIF data of a file, as much of them as can be read; `None` where there are none.
pub(super) fn exif(file: &Path) -> Result<Option<Exif>, Error> {
    let open = File::open(file).map_err(|source| Error::Read { file: file.to_owned(), source })?;
    let read = || {
        let mut reader = ::exif::Reader::new();
        reader.continue_on_error(true);
        reader
            .read_from_container(&mut BufReader::new(open))
            .or_else(|error| error.distill_partial_result(|_| ()))
    };
    Ok(catch_unwind(AssertUnwindSafe(read)).ok().and_then(Result::ok))
}

fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first().map(::exif::Rational::to_f64),
        Value::SRational(values) => values.first().map(::exif::SRational::to_f64),
        value => value.get_uint(0).map(f64::from),
    }
}

fn taken(exif: &Exif) -> Option<f64> {
    let text = |tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(lines) => lines.first().cloned(),
        _ => None,
    };
    let part = text(Tag::SubSecTimeOriginal);
    seconds_of(&text(Tag::DateTimeOriginal)?, part.as_deref())
}

/// Seconds since some day, of `YYYY:MM:DD HH:MM:SS` and the digits after the point.
pub(super) fn seconds_of(date: &[u8], part: Option<&[u8]>) -> Option<f64> {
    let date = ::exif::DateTime::from_ascii(date).ok()?;
    // Days by a count that only has to grow by one a day (proleptic Gregorian, from March).
    let (month, day) = (i64::from(date.month), i64::from(date.day));
    let year = i64::from(date.year) - i64::from(month <= 2);
    let month = (month + 9) % 12;
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day;
    let hours = 24 * days + i64::from(date.hour);
    let secs = 60 * (60 * hours + i64::from(date.minute)) + i64::from(date.second);
    let part = part
        .and_then(|digits| format!("0.{}", String::from_utf8_lossy(digits).trim()).parse().ok())
        .filter(|part: &f64| part.is_finite());
    Some(secs as f64 + part.unwrap_or(0.0))
}

/// How many pixels one byte of a file stands for at most, by its format; names what is no exposure
/// in a form that is read here.
/// A JPEG spends a bit on every block of 8×8 pixels, and Deflate makes 1032 bytes of one, of up to
/// 8 pixels each; TIFF has compressions that know no such end.
fn densest(file: &Path) -> Result<u64, Error> {
    match Format::of(file)? {
        Format::Jpeg => Ok(8 * 64),
        Format::Png => Ok(1032 * 8),
        Format::Tiff => Ok(u64::MAX),
        Format::OpenExr | Format::Radiance => Err(Error::Unsupported(Fault::new(
            file,
            "",
            "this is an image of radiance already, not one exposure of a series",
            "Use it as it is, or give the exposures that it was made from",
        ))),
        Format::Unknown => Err(Error::Unsupported(Fault::new(
            file,
            "",
            "this is no JPEG, PNG, TIFF or RAW photograph",
            "Give the exposures in one of these formats",
        ))),
    }
}

fn not_an_exposure(file: &Path) -> Error {
    Error::Unsupported(Fault::new(
        file,
        "",
        "its pixels are floating-point numbers and no codes of a camera",
        "Save it as OpenEXR if it is radiance, else with 8 or 16 bits a channel",
    ))
}

fn failed(file: &Path, failure: ::image::ImageError) -> Error {
    match failure {
        ::image::ImageError::IoError(source)
            if source.kind() != std::io::ErrorKind::UnexpectedEof =>
        {
            Error::Read { file: file.to_owned(), source }
        }
        ::image::ImageError::Limits(_) => Error::TooLarge(Fault::new(
            file,
            "",
            "the image claims more pixels than are read",
            "Scale it down; if it is not that large, the file is damaged",
        )),
        ::image::ImageError::Unsupported(what) => Error::Unsupported(Fault::new(
            file,
            "",
            format!("this variety of the format is not read ({what})"),
            "Save it as RGB with 8 or 16 bits a channel",
        )),
        other => damaged(file, &other.to_string()),
    }
}

fn damaged(file: &Path, reason: &str) -> Error {
    Error::Invalid(Fault::new(
        file,
        "",
        format!("this image is damaged or cut off ({reason})"),
        "Copy or export it again, or leave it out",
    ))
}

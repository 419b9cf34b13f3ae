//! RAW photographs (CR2, CR3, NEF, ARW, DNG and others): what the sensor measured, linear in the
//! light, with the black and white levels of each channel taken off (`flashraw`).
//!
//! The pixels are those of the crop that the camera itself develops, in the sensor's orientation,
//! as with every photograph here. Neither white balance nor a tone curve is applied. A file whose
//! data are damaged in part is refused whole.

mod directory;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::flashraw::{
    CfaColor, CorruptionPolicy, DecodeOptions, Error as Failure, FlashRaw, FrameInfo, Limits,
    OutputFormat, RawFrame, Rect,
};
use glam::{DMat3, DVec3};

use super::error::read_bounded;
use super::orientation::Orientation;
use super::photograph::{Photo, Shot, seconds_of};
use super::picture::LARGEST_SIDE_PRODUCT;
use super::{Error, Fault};
use crate::exposures::Codes;
use crate::exposures::mosaic::{self, Area, Pattern};

/// By their extension; many of them look like TIFF from within.
const EXTENSIONS: [&str; 22] = [
    "3fr", "arw", "cr2", "cr3", "crw", "dcr", "dng", "erf", "iiq", "kdc", "mef", "mos", "mrw",
    "nef", "nrw", "orf", "pef", "raf", "raw", "rw2", "sr2", "srw",
];

/// Files of medium-format cameras have 0.4 GB.
const LARGEST: u64 = 1 << 30;
/// The noise of a sensor leaves a bit a sample or so when compressed: a file that claims more has
/// not got them.
const MOST_SAMPLES_A_BYTE: u64 = 64;
/// Samples beside the image itself: masked edges, a preview.
const SPARE_SAMPLES: u64 = 1 << 20;

/// Whether a file is RAW, by its name.
pub fn is_raw(file: &Path) -> bool {
    file.extension()
        .is_some_and(|own| EXTENSIONS.iter().any(|extension| own.eq_ignore_ascii_case(extension)))
}

/// Width and height of the pixels that [`read`] gives, without decoding them.
pub fn dimensions(file: &Path) -> Result<(usize, usize), Error> {
    open(file, |raw| {
        let shown = shown(file, raw.frame_info())?;
        Ok((shown.width as usize, shown.height as usize))
    })
}

/// How the pixels that [`read`] gives are to be turned.
pub(super) fn orientation(file: &Path) -> Result<Orientation, Error> {
    open(file, |raw| Ok(Orientation::of(raw.frame_info().orientation as u32).unwrap_or_default()))
}

/// What the file says of how the photograph was taken.
pub(super) fn shot(file: &Path) -> Result<Shot, Error> {
    open(file, |raw| {
        let metadata = raw.metadata();
        let exposure = &metadata.exposure;
        let positive = |value: &f64| value.is_finite() && *value > 0.0;
        Ok(Shot {
            exposure_secs: exposure.exposure_time.filter(positive),
            f_number: exposure.f_number.map(f64::from).filter(positive),
            iso: exposure.iso.map(f64::from).filter(positive),
            taken_secs: metadata.capture_time.as_deref().and_then(taken),
        })
    })
}

/// Linear sRGB from the channels that [`read`] gives, or `None` where neither the file nor what is
/// known of its camera says it.
///
/// From the camera's matrix for daylight alone, so that it is the same for every photograph of the
/// camera; scaled such that green stays what it was where daylight falls on white.
pub fn srgb_from_camera(file: &Path) -> Result<Option<DMat3>, Error> {
    open(file, |raw| Ok(matrix(raw.frame_info())))
}

/// Decodes a photograph: 16-bit codes, 0 at black, 65535 where a channel is saturated.
///
/// Memory: the file, 6 bytes a site of the sensor while decoding, and 6 bytes a pixel.
pub fn read(file: &Path) -> Result<Photo, Error> {
    open(file, |raw| {
        let info = raw.frame_info();
        let crop = shown(file, info)?;
        let options = DecodeOptions {
            output: OutputFormat::NormalizedF32,
            limits: limits(),
            corruption_policy: CorruptionPolicy::Strict,
            ..DecodeOptions::default()
        };
        let frame = raw.decode(options).map_err(|failure| failed(file, &failure))?;
        let codes = codes(file, &frame, crop)?;
        let (width, height) = (crop.width as usize, crop.height as usize);
        Ok(Photo { width, height, codes: Codes::Sixteen(codes) })
    })
}

/// Opens a file whose claims are within bounds, and looks at it.
fn open<T>(file: &Path, look: impl FnOnce(&FlashRaw) -> Result<T, Error>) -> Result<T, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    if !directory::is_whole(&bytes) {
        return Err(damaged(file, "its directories reach beyond its end"));
    }
    let most = bytes.len() as u64 * MOST_SAMPLES_A_BYTE + SPARE_SAMPLES;
    // The decoder is made for files from anywhere, and yet a panic in it is not this program's end.
    let looked = catch_unwind(AssertUnwindSafe(|| {
        let raw = FlashRaw::open_with(bytes, limits()).map_err(|failure| failed(file, &failure))?;
        let info = raw.frame_info();
        let samples = u64::from(info.width) * u64::from(info.height) * u64::from(info.cpp.max(1));
        if samples > most {
            return Err(damaged(
                file,
                &format!("{} x {} pixels are more than it holds", info.width, info.height),
            ));
        }
        look(&raw)
    }));
    looked.unwrap_or_else(|_| Err(damaged(file, "its contents contradict its header")))
}

fn limits() -> Limits {
    Limits::default().with_max_samples(LARGEST_SIDE_PRODUCT)
}

/// The part of the sensor that the camera itself shows, within the light-sensitive area.
fn shown(file: &Path, info: &FrameInfo) -> Result<Rect, Error> {
    let light = light(info);
    let crop = info.crop.intersect(&light).filter(|crop| !crop.is_empty()).unwrap_or(light);
    if crop.is_empty() {
        return Err(damaged(file, "it has no pixels"));
    }
    if (info.pixel_aspect - 1.0).abs() > 1e-3 {
        return Err(unsupported(file, "its pixels are not square"));
    }
    Ok(crop)
}

fn light(info: &FrameInfo) -> Rect {
    let whole = Rect::full(info.width, info.height);
    info.active_area.intersect(&whole).filter(|area| !area.is_empty()).unwrap_or(whole)
}

fn codes(file: &Path, frame: &RawFrame, crop: Rect) -> Result<Vec<[u16; 3]>, Error> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let samples = frame.cpp as usize;
    let contradicted = || damaged(file, "its contents contradict its header");
    let values = frame.as_f32().ok_or_else(contradicted)?;
    let crop = area(crop);
    if values.len() != width * height * samples
        || crop.x + crop.width > width
        || crop.y + crop.height > height
    {
        return Err(contradicted());
    }
    // Colours of each pixel, or one that is all of them.
    let plain = |channels: [usize; 3]| {
        let rows = (crop.y..crop.y + crop.height).map(|y| &values[y * width * samples..]);
        rows.flat_map(|row| row[crop.x * samples..].chunks_exact(samples).take(crop.width))
            .map(|pixel| channels.map(|channel| mosaic::code(pixel[channel])))
            .collect()
    };
    match (&frame.cfa, samples) {
        (Some(pattern), 1) => {
            let channels = pattern.colors().into_iter().map(|color| match color {
                CfaColor::Red => Some(0),
                CfaColor::Green => Some(1),
                CfaColor::Blue => Some(2),
                _ => None,
            });
            let channels = channels.collect::<Option<Vec<usize>>>().ok_or_else(|| {
                unsupported(file, "its sensor has filters other than red, green and blue")
            })?;
            let pattern = Pattern { width: pattern.width(), channels };
            let light = Some(area(frame.active_area)).filter(|light| {
                crop.x >= light.x
                    && crop.y >= light.y
                    && crop.x + crop.width <= light.x + light.width
                    && crop.y + crop.height <= light.y + light.height
            });
            Ok(mosaic::interpolate(values, width, &pattern, light.unwrap_or(crop), crop))
        }
        (None, 1) => Ok(plain([0; 3])),
        (None, 3) => Ok(plain([0, 1, 2])),
        _ => Err(unsupported(file, &format!("its pixels have {samples} channels"))),
    }
}

fn area(rect: Rect) -> Area {
    let [x, y, width, height] = [rect.x, rect.y, rect.width, rect.height].map(|of| of as usize);
    Area { x, y, width, height }
}

fn matrix(info: &FrameInfo) -> Option<DMat3> {
    let matrix = info.color_matrices.preferred().filter(|matrix| matrix.rows == 3)?;
    let column = |rgb: [f32; 3]| {
        let response = matrix.camera_response(rgb);
        DVec3::from_array(std::array::from_fn(|row| f64::from(response[row])))
    };
    let mut camera_from_srgb =
        DMat3::from_cols(column([1.0, 0.0, 0.0]), column([0.0, 1.0, 0.0]), column([0.0, 0.0, 1.0]));
    // What the channels were multiplied by after the sensor.
    let mut gains = DVec3::ONE;
    if let [r, g, b] = info.color_matrices.analog_balance[..] {
        gains *= DVec3::new(r.into(), g.into(), b.into());
    }
    if info.white_balance_applied {
        let [r, g, b, _] = info.white_balance?.coeffs;
        gains *= DVec3::new(r.into(), g.into(), b.into());
    }
    camera_from_srgb = DMat3::from_diagonal(gains) * camera_from_srgb;
    let white = (camera_from_srgb * DVec3::ONE).y;
    let inverse = (camera_from_srgb * white.recip()).inverse();
    let is_usable = white > 0.0 && inverse.to_cols_array().iter().all(|value| value.is_finite());
    is_usable.then_some(inverse)
}

/// Seconds of `YYYY-MM-DDTHH:MM:SS[.sss]`.
fn taken(text: &str) -> Option<f64> {
    let (day, time) = text.split_once('T')?;
    let time = time.split(['+', '-', 'Z']).next()?;
    let (time, part) = time.split_once('.').unwrap_or((time, ""));
    let whole = format!("{} {time}", day.replace('-', ":"));
    seconds_of(whole.as_bytes(), Some(part.as_bytes()))
}

fn failed(file: &Path, failure: &Failure) -> Error {
    match failure {
        Failure::UnsupportedFormat(_) => {
            damaged(file, "it is no RAW photograph of a camera that is known")
        }
        Failure::UnsupportedCompression { .. } | Failure::CameraUnsupported { .. } => {
            unsupported(file, &failure.to_string())
        }
        Failure::LimitExceeded(_) => Error::TooLarge(Fault::new(
            file,
            "",
            "the image claims more pixels than are read",
            "Develop it at a smaller size; if it is not that large, the file is damaged",
        )),
        _ => damaged(file, &failure.to_string()),
    }
}

fn unsupported(file: &Path, problem: &str) -> Error {
    Error::Unsupported(Fault::new(
        file,
        "",
        format!("this RAW photograph is not read ({problem})"),
        "Develop it to a linear 16-bit TIFF, for example with dcraw -4 -T FILE or darktable-cli \
         FILE out.tif (linear profile, no tone curve), and give that",
    ))
}

fn damaged(file: &Path, reason: &str) -> Error {
    Error::Invalid(Fault::new(
        file,
        "",
        format!("this RAW photograph is damaged or cut off ({reason})"),
        "Copy it from the camera again, or leave it out",
    ))
}

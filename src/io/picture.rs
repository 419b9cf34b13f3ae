//! The image files that cameras name, whatever their format.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use ::image::ImageReader;

use super::{Error, Fault, exr, hdr, raw};
use crate::math::rgb::Radiance;
use crate::scene::Values;

/// No photograph has more pixels.
pub(crate) const LARGEST_SIDE_PRODUCT: u64 = 1 << 28;
/// Decoded size in bytes: 89 megapixels of three floats.
pub(crate) const LARGEST_BYTES: u64 = 1 << 30;

/// Linear values as they stand in a file, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture<P = Vec<Radiance>> {
    pub width: usize,
    pub height: usize,
    pub pixels: P,
    /// What had to be guessed while reading.
    pub notes: Vec<String>,
}

impl<P> Picture<P> {
    pub fn map<Q>(self, of: impl FnOnce(P) -> Q) -> Picture<Q> {
        let Self { width, height, pixels, notes } = self;
        Picture { width, height, pixels: of(pixels), notes }
    }
}

/// What a file is, by its first bytes rather than by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    OpenExr,
    Radiance,
    Png,
    Jpeg,
    Tiff,
    Unknown,
}

impl Format {
    pub fn of(file: &Path) -> Result<Self, Error> {
        let mut start = Vec::with_capacity(16);
        File::open(file)
            .and_then(|open| open.take(16).read_to_end(&mut start))
            .map_err(|source| Error::Read { file: file.to_owned(), source })?;
        Ok(match start.as_slice() {
            [0x76, 0x2f, 0x31, 0x01, ..] => Self::OpenExr,
            [b'#', b'?', ..] => Self::Radiance,
            [0x89, b'P', b'N', b'G', ..] => Self::Png,
            [0xFF, 0xD8, 0xFF, ..] => Self::Jpeg,
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Self::Tiff,
            _ => Self::Unknown,
        })
    }

    pub fn is_radiance(self) -> bool {
        matches!(self, Self::OpenExr | Self::Radiance)
    }
}

/// Reads linear radiance: OpenEXR or Radiance.
pub fn read(file: &Path) -> Result<Picture, Error> {
    if is_exr(file)? { exr::read(file) } else { hdr::read(file) }
}

/// As [`read`]. Values that the file has as half floats stay so.
pub fn read_values(file: &Path) -> Result<Picture<Values>, Error> {
    if is_exr(file)? { exr::read_values(file) } else { Ok(hdr::read(file)?.map(Values::from)) }
}

/// Whether a file of radiance is OpenEXR; else it is Radiance.
fn is_exr(file: &Path) -> Result<bool, Error> {
    match (Format::of(file)?, extension(file).as_str()) {
        (Format::OpenExr, _) | (Format::Unknown, "exr") => Ok(true),
        (Format::Radiance, _) | (Format::Unknown, "hdr") => Ok(false),
        _ => Err(no_radiance(file)),
    }
}

/// The OpenEXR and Radiance files of a folder, by their names without extension.
pub fn by_stem(folder: &Path) -> Result<BTreeMap<String, PathBuf>, Error> {
    let unreadable = |source| Error::Read { file: folder.to_owned(), source };
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        if ["exr", "hdr"].contains(&extension(&file).as_str())
            && let Some(stem) = file.file_stem()
        {
            files.insert(stem.to_string_lossy().into_owned(), file);
        }
    }
    Ok(files)
}

fn extension(file: &Path) -> String {
    file.extension().map_or_else(String::new, |own| own.to_string_lossy().to_lowercase())
}

/// Width and height, from the file's head alone.
pub fn dimensions(file: &Path) -> Result<(usize, usize), Error> {
    if raw::is_raw(file) {
        return raw::dimensions(file);
    }
    match Format::of(file)? {
        Format::OpenExr => exr::dimensions(file),
        Format::Radiance => hdr::dimensions(file),
        Format::Png | Format::Jpeg => displayed_dimensions(file),
        Format::Tiff | Format::Unknown => Err(no_radiance(file)),
    }
}

/// A file for `image`, whose contents tell its format.
pub(super) fn reader(file: &Path) -> Result<ImageReader<BufReader<File>>, Error> {
    ImageReader::open(file)
        .and_then(ImageReader::with_guessed_format)
        .map_err(|source| Error::Read { file: file.to_owned(), source })
}

fn displayed_dimensions(file: &Path) -> Result<(usize, usize), Error> {
    let (width, height) = reader(file)?.into_dimensions().map_err(|_| {
        Error::Invalid(Fault::new(
            file,
            "",
            "this image is damaged or cut off",
            "Export or copy it again, or remove its frame from the camera file",
        ))
    })?;
    if u64::from(width) * u64::from(height) > LARGEST_SIDE_PRODUCT {
        return Err(too_large(file, width.into(), height.into()));
    }
    Ok((width as usize, height as usize))
}

pub(crate) fn too_large(file: &Path, width: u64, height: u64) -> Error {
    Error::TooLarge(Fault::new(
        file,
        "",
        format!(
            "the image claims {width} x {height} pixels, and at most {} million are read",
            LARGEST_BYTES / std::mem::size_of::<Radiance>() as u64 / 1_000_000
        ),
        "Scale it down, together with w, h and the intrinsics of its camera; if it is not that \
         large, the file is damaged",
    ))
}

fn no_radiance(file: &Path) -> Error {
    Error::Unsupported(Fault::new(
        file,
        "",
        "this is neither OpenEXR nor Radiance .hdr",
        "Convert the photograph to OpenEXR with linear values",
    ))
}

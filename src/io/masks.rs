//! Masks: which pixels of a photograph show what is not of the scene.
//!
//! As in COLMAP ("no features will be extracted in regions where the mask image is black"),
//! nerfstudio (`mask_path`: black is ignored) and Metashape (white is kept), black is left out. They
//! write masks of two values; here what is darker than half of a mask's brightest value is left out,
//! so that masks of 0 and 1, and those that JPEG has blurred, mean the same.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use ::image::Limits;

use super::orientation::Orientation;
use super::picture::{self, Format, LARGEST_SIDE_PRODUCT};
use super::{Error, Fault, exr, inside, transforms};
use crate::scene::Image;

/// The folder of masks that are found by their names.
const FOLDER: &str = "masks";
/// Extensions that a mask's name may repeat of a photograph that has become another file since.
const EXTENSIONS: [&str; 8] = ["exr", "hdr", "jpg", "JPG", "jpeg", "png", "tif", "tiff"];
/// Alpha from here on covers a pixel: half floats and filters of renderers leave little less than 1.
const OPAQUE: f32 = 0.99;

/// The mask of the photograph that a `file_path` below `folder` names: in `masks` beside the
/// photographs' own folder or in it, as `NAME.jpg.png` (COLMAP), `NAME.png` or `NAME_mask.png`
/// (Metashape), in the folders below that the photograph is in.
pub fn beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = inside::tail(name);
    let below = name.split_once('/').map(|(_, below)| below);
    let places = below.into_iter().chain([name.as_str()]);
    places.flat_map(names).map(|mask| folder.join(FOLDER).join(mask)).find(|path| path.is_file())
}

/// The mask of a photograph of another program, up to three folders above it.
pub fn of_photograph(file: &Path) -> Option<PathBuf> {
    file.ancestors()
        .skip(1)
        .take(3)
        .find_map(|folder| beside(folder, file.strip_prefix(folder).ok()?.to_str()?))
}

fn names(photograph: &str) -> impl Iterator<Item = String> {
    let stem = match photograph.rsplit_once('.') {
        Some((stem, own)) if !stem.is_empty() && !own.contains('/') => stem,
        _ => photograph,
    };
    let others = EXTENSIONS.into_iter().map(move |own| format!("{stem}.{own}.png"));
    [format!("{photograph}.png")]
        .into_iter()
        .chain([format!("{stem}.png"), format!("{stem}_mask.png")])
        .chain(others)
}

/// Leaves out what the mask of a photograph, and the alpha channel of an OpenEXR `file`, say. Both
/// are turned with it; a mask that has the size of the turned photograph alone is upright already.
/// Returns what was read with reservations.
pub(super) fn apply(
    image: &mut Image,
    file: &Path,
    mask: Option<&Path>,
    orientation: Orientation,
) -> Result<Vec<String>, Error> {
    let mut notes = Vec::new();
    let width = image.width();
    let upright = (width, image.height());
    let stored = orientation.size(upright);
    if Format::of(file)? == Format::OpenExr
        && let Some(alpha) = exr::read_alpha(file)?
    {
        // Renderers leave an empty alpha beside full colours where it was not asked for.
        let alpha = orientation.turn(stored, alpha);
        if alpha.iter().any(|&alpha| alpha >= OPAQUE) {
            image.mask(|x, y| alpha[y * width + x] < OPAQUE);
        } else {
            notes.push(format!(
                "{}: its alpha channel covers no pixel, so it is not taken as a mask.",
                file.display()
            ));
        }
    }
    if let Some(mask) = mask {
        let is_stored = stored == upright || read_size(mask)? == stored;
        let kept = if is_stored {
            orientation.turn(stored, read(mask, stored)?)
        } else {
            read(mask, upright)?
        };
        image.mask(|x, y| !kept[y * width + x]);
    }
    Ok(notes)
}

/// For each pixel of a mask whether it is kept. `size` is the photograph's.
pub fn read(file: &Path, size: (usize, usize)) -> Result<Vec<bool>, Error> {
    let damaged = |reason: String| damaged(file, &reason);
    if Format::of(file)?.is_radiance() {
        return Err(damaged("it is an image of radiance".into()));
    }
    let found = read_size(file)?;
    if found != size {
        return Err(Error::Invalid(Fault::new(
            file,
            "",
            format!(
                "the mask has {} x {} pixels, and its photograph {} x {}",
                found.0, found.1, size.0, size.1
            ),
            "Make the mask for the photograph as it is here, in its full size",
        )));
    }
    let mut reader = picture::reader(file)?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(8 * LARGEST_SIDE_PRODUCT);
    reader.limits(limits);
    // Its decoders are said not to panic, but they see files from anywhere.
    let decoded = catch_unwind(AssertUnwindSafe(|| reader.decode()))
        .map_err(|_| damaged("its contents contradict its header".into()))?
        .map_err(|error| damaged(error.to_string()))?;
    // Some programs save a mask as opacity: what is transparent is black, whatever its colour.
    let values: Vec<u32> = (decoded.into_luma_alpha16().pixels())
        .map(|pixel| u32::from(pixel.0[0]) * u32::from(pixel.0[1]) / 0xFFFF)
        .collect();
    let brightest = values.iter().max().copied().unwrap_or(0);
    Ok(values.into_iter().map(|value| value > 0 && 2 * value >= brightest).collect())
}

/// Where the mask of one photograph was written, or is.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    pub file: PathBuf,
    /// The photograph has a mask already, which is as it was.
    pub is_kept: bool,
}

/// Writes a mask for each of some photographs of a capture, which loading it finds by their names:
/// for `images/a.exr` it is `masks/a.exr.png` in the capture's folder, or `a.exr.png` in `out`. A mask
/// that is there stays, unless it is to be replaced. Every entry is a photograph and, for each pixel
/// of it as it is seen upright, whether it is left out.
pub fn write(
    folder: &Path,
    out: Option<&Path>,
    masks: &[(usize, &[bool])],
    replace: bool,
) -> Result<Vec<Written>, Error> {
    let frames =
        transforms::read(&folder.join("transforms.json"), transforms::Images::Needed)?.frames;
    let mut written = Vec::new();
    for &(photograph, is_left_out) in masks {
        let Some(frame) = frames.get(photograph) else { continue };
        let (width, height) = (frame.camera.width, frame.camera.height);
        let own = out.is_none().then(|| frame.mask.clone()).flatten();
        let file = own.unwrap_or_else(|| {
            let name = inside::tail(&frame.name);
            let below = name.split_once('/').map_or(name.as_str(), |(_, below)| below);
            out.map_or_else(|| folder.join(FOLDER), Path::to_owned).join(format!("{below}.png"))
        });
        let is_kept = file.exists() && !replace;
        if !is_kept {
            if file.extension().is_none_or(|own| !own.eq_ignore_ascii_case("png")) {
                return Err(Error::Invalid(Fault::new(
                    &file,
                    "",
                    "this mask is no PNG file, and masks are written as PNG",
                    "Save it as PNG and name that file in mask_path",
                )));
            }
            if let Some(parent) = file.parent() {
                std::fs::create_dir_all(parent)
                    .map_err(|source| Error::Write { file: parent.to_owned(), source })?;
            }
            let stored = frame.orientation.size((width, height));
            let places = frame.orientation.turn(stored, (0..width * height).collect());
            let mut turned = vec![false; width * height];
            for (place, &is_left_out) in std::iter::zip(places, is_left_out) {
                turned[place] = is_left_out;
            }
            let bytes = super::png::encode_mask(stored.0, stored.1, &turned)
                .map_err(|source| Error::Write { file: file.clone(), source })?;
            super::atomic::write_bytes(&file, &bytes)?;
        }
        written.push(Written { photograph, file, is_kept });
    }
    Ok(written)
}

/// Width and height of a mask.
fn read_size(file: &Path) -> Result<(usize, usize), Error> {
    let size = picture::reader(file)?.into_dimensions();
    let (width, height) = size.map_err(|error| damaged(file, &error.to_string()))?;
    Ok((width as usize, height as usize))
}

fn damaged(file: &Path, reason: &str) -> Error {
    Error::Invalid(Fault::new(
        file,
        "",
        format!("this mask cannot be read ({reason})"),
        "Save it as PNG again, black where the photograph is to be left out",
    ))
}

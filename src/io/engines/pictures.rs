//! Writes the photographs for an engine: upright JPEG files with numbers as names, whatever format
//! the photographs have.

use std::path::{Path, PathBuf};

use exif::experimental::Writer;
use exif::{Field, In, Tag, Value};
use glam::DVec2;
use image::ImageEncoder;
use image::codecs::jpeg::JpegEncoder;

use super::{Engine, Subject};
use crate::io::{Error, atomic, import};
use crate::watch::Watch;

/// The folder's name.
pub(super) const FOLDER: &str = "pictures";
/// Longer side; engines make larger ones smaller themselves.
const LONGEST: usize = 3200;
const QUALITY: u8 = 97;
/// The diagonal of the film that EXIF's 35 mm equivalent means.
const FILM_DIAGONAL_MM: f64 = 43.266_615_3;

/// A photograph as it was written.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    /// Pixels of the photograph along a side of one of these.
    pub step: f64,
    /// Where in the photograph its top left corner is.
    pub corner: DVec2,
}

/// Writes them below [`FOLDER`]. Photographs that share a lens share a folder (COLMAP), or the
/// name of their camera (openmvg-rs, which reads one folder alone).
pub(super) fn write(
    folder: &Path,
    photographs: &[Subject],
    engine: Engine,
    is_shared: bool,
    watch: &Watch,
) -> Result<Vec<Picture>, Error> {
    watch.begin(photographs.len() as u64);
    let mut pictures = Vec::new();
    for (index, own) in photographs.iter().enumerate() {
        let shown = import::show(&own.file, own.orientation, LONGEST)?;
        let lens = match is_shared {
            true => format!("lens_{}x{}", shown.width, shown.height),
            false => format!("lens_{index}"),
        };
        let name = format!("{index:06}.jpg");
        let file: PathBuf = match engine {
            Engine::OpenMvg => folder.join(FOLDER).join(name),
            Engine::PyColmap | Engine::Colmap => folder.join(FOLDER).join(&lens).join(name),
        };
        let failed = |source| Error::Write { file: file.clone(), source };
        let step = shown.step as f64;
        let codes: Vec<u8> = shown.pixels.iter().flatten().copied().collect();
        let focal_px = own.focal_px.map(|focal| focal / step);
        let tags = tags(&lens, focal_px, (shown.width, shown.height)).map_err(failed)?;
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
        let other = |error: String| failed(std::io::Error::other(error));
        encoder.set_exif_metadata(tags).map_err(|error| other(error.to_string()))?;
        let (width, height) = (shown.width as u32, shown.height as u32);
        encoder
            .write_image(&codes, width, height, image::ExtendedColorType::Rgb8)
            .map_err(|error| other(error.to_string()))?;
        atomic::write_bytes(&file, &bytes)?;
        pictures.push(Picture { step, corner: corner(own, (shown.width, shown.height), step) });
        watch.tick()?;
    }
    Ok(pictures)
}

/// Pixels beyond the last whole square are left out at the sides that are right and bottom as the
/// photograph is stored; turned, these may be others.
fn corner(own: &Subject, (width, height): (usize, usize), step: f64) -> DVec2 {
    // Turning a size twice gives it back.
    let stored = own.orientation.size(own.size);
    let small = own.orientation.size((width, height));
    own.orientation.place(stored, DVec2::ZERO) - step * own.orientation.place(small, DVec2::ZERO)
}

/// EXIF that names a camera for each lens, and its focal length where that is known.
fn tags(
    lens: &str,
    focal_px: Option<f64>,
    (width, height): (usize, usize),
) -> std::io::Result<Vec<u8>> {
    let text = |own: &str| Value::Ascii(vec![own.as_bytes().to_vec()]);
    let field = |tag: Tag, value: Value| Field { tag, ifd_num: In::PRIMARY, value };
    let mut fields = vec![field(Tag::Make, text("lobelia")), field(Tag::Model, text(lens))];
    if let Some(focal) = focal_px {
        let diagonal = (width as f64).hypot(height as f64);
        let film_mm = (focal * FILM_DIAGONAL_MM / diagonal).round().clamp(1.0, 10_000.0);
        fields.push(field(Tag::FocalLengthIn35mmFilm, Value::Short(vec![film_mm as u16])));
    }
    let mut writer = Writer::new();
    fields.iter().for_each(|own| writer.push_field(own));
    let mut bytes = std::io::Cursor::new(Vec::new());
    writer.write(&mut bytes, true).map_err(std::io::Error::other)?;
    Ok(bytes.into_inner())
}

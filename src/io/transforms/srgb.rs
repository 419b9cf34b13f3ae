//! Changes the camera file of a capture so that its single photographs are converted to radiance by
//! the curve of sRGB.

use std::path::Path;

use super::find_below;
use crate::io::json::{self, Field};
use crate::io::picture::Format;
use crate::io::{Error, Fault, atomic, raw};

/// Writes `"response": "srgb"` into a camera file, and takes back that its JPEG, PNG and TIFF
/// photographs are no measurements; the file before stays beside it, with a `~`. Gives their number.
pub fn take_as_srgb(file: &Path) -> Result<usize, Error> {
    let mut value = json::read(file)?;
    let root = Field::root(file, &value)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut taken = Vec::new();
    for (index, frame) in root.need("frames")?.items()?.iter().enumerate() {
        let is_geometry =
            frame.get("use").is_some_and(|own| own.text().is_ok_and(|own| own == "geometry"));
        let name = frame.get("file_path").and_then(|own| own.text().ok().map(str::to_owned));
        let Some(image) = name.and_then(|name| find_below(folder, &name)) else { continue };
        let is_code = !raw::is_raw(&image) && !Format::of(&image)?.is_radiance();
        if is_code && !is_geometry {
            taken.push(index);
        }
    }
    if taken.is_empty() {
        return Err(Error::Missing(Fault::new(
            file,
            "frames",
            "none of the photographs is JPEG, PNG or TIFF and may be a measurement",
            "Give photographs of linear radiance: OpenEXR or .hdr, or exposure series",
        )));
    }
    if let Some(frames) = value.get_mut("frames").and_then(|own| own.as_array_mut()) {
        for index in &taken {
            if let Some(frame) = frames[*index].as_object_mut() {
                frame.remove("hdr");
            }
        }
    }
    if let Some(top) = value.as_object_mut() {
        top.remove("hdr");
        top.insert("response".to_owned(), "srgb".into());
    }
    let mut before = file.as_os_str().to_owned();
    before.push("~");
    std::fs::copy(file, &before).map_err(|source| Error::Write { file: before.into(), source })?;
    atomic::write_bytes(file, format!("{value:#}\n").as_bytes())?;
    Ok(taken.len())
}

#[cfg(test)]
mod tests;

//! Makes a capture from photographs alone: `images/` and a camera file without cameras.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::cameras::{self, Unplaced};
use crate::io::picture::{self, Format};
use crate::io::{Error, Fault, atomic, exif_lens, import, photograph, raw};
use crate::watch::Watch;

/// Makes the folder, which must be new or empty, with copies of the photographs and a camera file
/// that has their names, sizes, and what EXIF tells. The folder is there whole or not at all.
/// `watch` counts the photographs.
pub fn new_capture(
    folder: &Path,
    images: &[PathBuf],
    watch: &Watch,
) -> Result<Vec<Unplaced>, Error> {
    import::check_folder(folder, false)?;
    watch.begin(images.len() as u64);
    // All are looked at before the first is copied.
    let mut taken = HashSet::new();
    let photographs: Vec<Unplaced> =
        images.iter().map(|image| look(image, &mut taken)).collect::<Result<_, _>>()?;
    let failed = |source| Error::Write { file: folder.to_owned(), source };
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(failed)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".lobelia-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o777));
    }
    let made = builder.tempdir_in(parent).map_err(failed)?;
    for (image, photograph) in images.iter().zip(&photographs) {
        watch.tick()?;
        let to = made.path().join(&photograph.name);
        let unreadable = |source| Error::Read { file: image.clone(), source };
        let bytes = std::fs::File::open(image).map_err(unreadable)?;
        atomic::write(&to, |out| std::io::copy(&mut &bytes, out).map(drop))?;
    }
    let text = cameras::begin(&photographs);
    atomic::write_bytes(&made.path().join("transforms.json"), text.as_bytes())?;
    if folder.exists() {
        std::fs::remove_dir(folder).map_err(failed)?;
    }
    std::fs::rename(made.path(), folder).map_err(failed)?;
    // It is where it belongs: nothing is left to be cleaned up.
    let _ = made.keep();
    Ok(photographs)
}

/// A photograph with its path in the capture: `images/` and its own name, numbered where two have
/// the same.
fn look(image: &Path, taken: &mut HashSet<String>) -> Result<Unplaced, Error> {
    let is_raw = raw::is_raw(image);
    let format = if is_raw { Format::Unknown } else { Format::of(image)? };
    let size = match format {
        Format::Tiff => photograph::head(image).map(|(width, height, _)| (width, height))?,
        Format::Unknown if !is_raw => {
            return Err(Error::Unsupported(Fault::new(
                image,
                "",
                "this is no photograph that is read here",
                "Give OpenEXR, Radiance .hdr, JPEG, PNG, TIFF or RAW",
            )));
        }
        _ => picture::dimensions(image)?,
    };
    let part = |own: Option<&std::ffi::OsStr>| {
        own.map_or_else(String::new, |own| own.to_string_lossy().into_owned())
    };
    let (stem, extension) = (part(image.file_stem()), part(image.extension()));
    let numbered = |number: usize| {
        let number = if number == 1 { String::new() } else { format!("_{number}") };
        let dot = if extension.is_empty() { "" } else { "." };
        format!("images/{stem}{number}{dot}{extension}")
    };
    let free = (1..).map(numbered).find(|name| taken.insert(name.to_lowercase()));
    let lens = exif_lens::read(image)?;
    Ok(Unplaced {
        name: free.unwrap_or_default(),
        size: lens.orientation.size(size),
        lens,
        is_radiance: format.is_radiance(),
    })
}

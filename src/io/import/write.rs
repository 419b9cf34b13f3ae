//! Writes an import as a capture: `images/`, `masks/`, `scene.obj` with its library, `transforms.json`,
//! and `points.json` where the source has points.
//!
//! Everything is made in a folder beside and renamed at the end, so that a capture is there whole
//! or not at all.

use std::collections::HashSet;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::{Import, Shot, ShotSeries, files, tracks};
use crate::exposures::MergeOptions;
use crate::io::brackets::{self, Found, Series};
use crate::io::orientation::Orientation;
use crate::io::{Error, Fault, atomic, exr, model};
use crate::watch::Watch;

/// What a capture consists of: a folder with anything else in it is not replaced.
const PARTS: [&str; 7] =
    ["images", "masks", "scene.obj", "scene.mtl", "transforms.json", "tags.json", model::POINTS];

/// How photographs come into the capture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Copying {
    #[default]
    Copy,
    /// A second name for the same file where the disk allows it, else a copy.
    Link,
}

/// How a capture is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Writing {
    pub copying: Copying,
    /// A capture that is in the folder already may go.
    pub replace: bool,
    /// Merge exposure series to images of radiance.
    pub merge: Option<MergeOptions>,
    /// Single photographs in JPEG, PNG and TIFF stand for radiance by the curve of sRGB.
    pub as_srgb: bool,
}

/// What was found out while a capture was written.
#[derive(Clone, Debug, Default)]
pub struct Written {
    /// Of the merged series, in the order of `Import::series`.
    pub found: Option<Found>,
    pub warnings: Vec<String>,
}

/// What a folder holds that is to become a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    Nothing,
    /// A capture and nothing else: it may be replaced.
    Capture,
    Other,
}

/// Writes the capture. The folder must be new or empty, or hold a capture that may be replaced.
/// `watch` counts the photographs, and the exposures that are merged.
pub fn write(
    import: &Import,
    folder: &Path,
    writing: &Writing,
    watch: &Watch,
) -> Result<Written, Error> {
    check_folder(folder, writing.replace)?;
    let failed = |file: &Path| {
        let file = file.to_owned();
        move |source| Error::Write { file, source }
    };
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(failed(parent))?;
    let beside = || {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".lobelia-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o777));
        }
        builder.tempdir_in(parent).map_err(failed(folder))
    };
    let made = beside()?;
    let series = writing.merge.as_ref().map_or(&[][..], |_| &import.series);
    let kept = kept(import, series);
    let shots: Vec<Shot> = kept.iter().map(|&index| as_written(import, series, index)).collect();
    let names = files::names(&shots);
    let exposures: Vec<Series> = series.iter().map(|view| view.series.clone()).collect();
    watch.begin(names.len() as u64 + brackets::steps(&exposures));
    let mut written = Written::default();
    if let Some(options) = writing.merge.as_ref().filter(|_| !exposures.is_empty()) {
        let places: Vec<PathBuf> = series
            .iter()
            .filter_map(|view| kept.iter().position(|own| *own == view.shot))
            .map(|own| made.path().join(&names[own]))
            .collect();
        let found = brackets::merge_all(&exposures, None, options, watch, |index, merged| {
            let place = &places[index];
            if let Some(folder) = place.parent() {
                std::fs::create_dir_all(folder).map_err(failed(folder))?;
            }
            let (stored, turned) = ((merged.width, merged.height), series[index].shot);
            let turned = import.shots[turned].orientation;
            let pixels = turned.turn(stored, merged.pixels);
            let (width, height) = turned.size(stored);
            exr::write_rgb(place, width, height, &pixels)
        })?;
        written.warnings.clone_from(&found.warnings);
        written.found = Some(found);
        let others = import.shots.len() - kept.len();
        if others > 0 {
            written.warnings.push(format!(
                "{others} cameras are of exposures that were merged into another's: left out."
            ));
        }
    } else if writing.merge.is_none() && !import.series.is_empty() {
        written.warnings.push(format!(
            "{} photographs are exposures of series, which are not merged: --series does that.",
            import.series.len()
        ));
    }
    for (shot, name) in shots.iter().zip(&names) {
        let place = made.path().join(name);
        if let Some(image) = shot.image.as_ref().filter(|_| !place.exists()) {
            bring(image, &place, writing.copying)?;
        }
        if let Some(mask) = &shot.mask {
            bring(mask, &made.path().join(files::mask_name(name, mask)), writing.copying)?;
        }
        watch.tick()?;
    }
    if let Some(geometry) = &import.geometry {
        files::write_mesh(made.path(), geometry)?;
    }
    if !shots.is_empty() {
        let text = serde_json::to_string_pretty(&files::cameras(&shots, &names, writing.as_srgb));
        let text = text.map_err(|failure| failed(folder)(failure.into()))? + "\n";
        atomic::write_bytes(&made.path().join("transforms.json"), text.as_bytes())?;
        let photograph = |shot: usize| kept.iter().position(|own| *own == shot);
        let points = tracks(import, photograph, |_, pixel| pixel);
        if !points.is_empty() {
            model::write_points(&made.path().join(model::POINTS), &names, &points)?;
        }
    }
    watch.check()?;
    // What was there goes only once the new capture stands in its place.
    let mut old = None;
    match holds(folder) {
        Ok(Holds::Capture) => {
            let aside = beside()?;
            std::fs::rename(folder, aside.path().join("old")).map_err(failed(folder))?;
            old = Some(aside);
        }
        Ok(Holds::Nothing) if folder.exists() => {
            std::fs::remove_dir(folder).map_err(failed(folder))?;
        }
        _ => {}
    }
    if let Err(source) = std::fs::rename(made.path(), folder) {
        if let Some(aside) = old {
            // Whatever comes of it, the first failure is the one to tell.
            let _ = std::fs::rename(aside.path().join("old"), folder);
        }
        return Err(failed(folder)(source));
    }
    // It is where it belongs: nothing is left to be cleaned up.
    let _ = made.keep();
    Ok(written)
}

/// Refuses a folder that holds something, before work is done for nothing.
pub fn check_folder(folder: &Path, replace: bool) -> Result<(), Error> {
    let occupied = |problem: &str| {
        let remedy = "Give a new folder for the capture, or empty this one";
        Err(Error::Invalid(Fault::new(folder, "", problem, remedy)))
    };
    match holds(folder)? {
        Holds::Nothing => Ok(()),
        Holds::Capture if replace => Ok(()),
        Holds::Other if replace => occupied("the folder holds other things than a capture"),
        Holds::Capture | Holds::Other => occupied("the folder is not empty"),
    }
}

/// Looks into a folder, which need not exist.
pub fn holds(folder: &Path) -> Result<Holds, Error> {
    let unusable = |source| Error::Write { file: folder.to_owned(), source };
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Holds::Nothing),
        Err(source) => return Err(unusable(source)),
    };
    let (mut is_empty, mut is_capture) = (true, true);
    for entry in entries {
        let entry = entry.map_err(unusable)?;
        is_empty = false;
        is_capture &= entry.file_name().to_str().is_some_and(|own| PARTS.contains(&own));
    }
    Ok(match (is_empty, is_capture) {
        (true, _) => Holds::Nothing,
        (false, true) => Holds::Capture,
        (false, false) => Holds::Other,
    })
}

/// The cameras that stay: merging makes one photograph of those of a view.
fn kept(import: &Import, series: &[ShotSeries]) -> Vec<usize> {
    let gone: HashSet<usize> = series.iter().flat_map(|view| view.others.iter().copied()).collect();
    (0..import.shots.len()).filter(|index| !gone.contains(index)).collect()
}

/// A photograph as it will be: radiance where it is merged.
fn as_written(import: &Import, series: &[ShotSeries], index: usize) -> Shot {
    let mut shot = Shot { observations: Vec::new(), ..import.shots[index].clone() };
    if series.iter().any(|view| view.shot == index) {
        shot.is_measurement = true;
        // Its radiance is written upright.
        shot.orientation = Orientation::default();
        shot.image = shot.image.map(|image| image.with_extension("exr"));
    }
    shot
}

fn bring(image: &Path, to: &Path, copying: Copying) -> Result<(), Error> {
    let failed = |source| Error::Write { file: to.to_owned(), source };
    if let Some(folder) = to.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    // A link to a link would point nowhere once it is moved.
    let real = dunce::canonicalize(image);
    let real = real.map_err(|source| Error::Read { file: image.to_owned(), source })?;
    if copying == Copying::Link && std::fs::hard_link(&real, to).is_ok() {
        return Ok(());
    }
    let unreadable = |source| Error::Read { file: image.to_owned(), source };
    let mut from = std::fs::File::open(&real).map_err(unreadable)?;
    let mut into = std::fs::File::create(to).map_err(failed)?;
    std::io::copy(&mut from, &mut into).map_err(failed)?;
    into.flush().map_err(failed)
}

//! Exposure series among the photographs of an import: a camera whose photograph is one exposure
//! of several can have them merged to radiance.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::{Import, ShotSeries};
use crate::io::brackets::Series;
use crate::io::grouping::{self, Times};
use crate::io::{Error, Fault, raw};
use crate::watch::Watch;

/// What exposures are kept as, beside RAW.
const EXPOSURES: [&str; 5] = ["jpg", "jpeg", "png", "tif", "tiff"];
/// Cameras of one view look the same way within this (3°),
const SAME_VIEW_COSINE: f64 = 0.9986;
/// and stand no farther apart than this part of the spread of all cameras.
const SAME_PLACE: f64 = 0.05;
/// Beyond this it is no folder of photographs.
const MOST_FILES: usize = 100_000;

/// Finds the series that photographs belong to: those that the source names, or else by the EXIF
/// data, or the times given, of what lies beside them. Several cameras of one series are one view:
/// the one with the middle exposure stands for it.
pub(super) fn find(
    import: &mut Import,
    mut named: HashMap<PathBuf, Series>,
    times: Option<&Times>,
    watch: &Watch,
) -> Result<(), Error> {
    let displayed: Vec<(usize, PathBuf)> = import
        .shots
        .iter()
        .enumerate()
        .filter(|(_, shot)| !shot.is_measurement)
        .filter_map(|(index, shot)| Some((index, shot.image.clone()?)))
        .collect();
    let mut views: Vec<ShotSeries> = Vec::new();
    let mut loose = Vec::new();
    for (shot, image) in displayed {
        match named.remove(&image) {
            Some(series) => views.push(ShotSeries { shot, others: Vec::new(), series }),
            None => loose.push((shot, image)),
        }
    }
    let folders: BTreeSet<(&Path, bool)> =
        loose.iter().filter_map(|(_, image)| Some((image.parent()?, raw::is_raw(image)))).collect();
    let mut files: Vec<PathBuf> =
        folders.into_iter().flat_map(|(folder, is_raw)| exposures(folder, is_raw)).collect();
    files.truncate(MOST_FILES);
    let groups = grouping::find(&files, times, watch)?;
    let places: HashMap<&Path, (usize, usize)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, series)| {
            let files = series.files.iter().enumerate();
            files.map(move |(exposure, file)| (file.as_path(), (group, exposure)))
        })
        .collect();
    let mut cameras: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    for (shot, image) in &loose {
        if let Some(&(group, exposure)) = places.get(image.as_path()) {
            cameras.entry(group).or_default().push((exposure, *shot));
        }
    }
    let spread = spread(import);
    for (group, own) in cameras {
        let series = &groups[group];
        let mut order: Vec<usize> = (0..series.files.len()).collect();
        order.sort_by(|a, b| series.seconds[*a].total_cmp(&series.seconds[*b]));
        let rank = |exposure: usize| order.iter().position(|own| *own == exposure).unwrap_or(0);
        let middle = rank(series.reference);
        let nearest = own.iter().min_by_key(|(exposure, _)| rank(*exposure).abs_diff(middle));
        let Some(&(reference, shot)) = nearest else { continue };
        // Automatic exposure gives each view a time of its own, too: then the cameras tell.
        let stand = |other: usize| stands_alike(import, shot, other, spread);
        if !own.iter().all(|(_, other)| stand(*other)) {
            continue;
        }
        let others = own.iter().map(|(_, other)| *other).filter(|other| *other != shot).collect();
        // The camera was found on this exposure: the others are aligned to it.
        let series = Series { reference, ..series.clone() };
        views.push(ShotSeries { shot, others, series });
    }
    views.sort_by_key(|view| view.shot);
    if views.is_empty() && times.is_some() {
        let file = loose.first().map(|(_, image)| image.clone()).unwrap_or_default();
        return Err(Error::Missing(Fault::new(
            &file,
            "",
            "exposure times are given, but no photograph of a camera is one of several exposures",
            "Give the times of all files, and the folder of the exposures by --images",
        )));
    }
    import.series = views;
    Ok(())
}

/// The side of the box around all cameras.
fn spread(import: &Import) -> f64 {
    let positions = || import.shots.iter().map(|shot| shot.camera.position);
    let low = positions().fold(DVec3::INFINITY, DVec3::min);
    let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
    (high - low).max_element().max(0.0)
}

/// Whether two cameras took the same view, hand-held at worst.
fn stands_alike(import: &Import, a: usize, b: usize, spread: f64) -> bool {
    let [a, b] = [a, b].map(|index| &import.shots[index].camera);
    let cosine = a.world_from_camera.z_axis.dot(b.world_from_camera.z_axis);
    cosine >= SAME_VIEW_COSINE && a.position.distance(b.position) <= SAME_PLACE * spread
}

/// The files of a folder that may be exposures, RAW or others, by name.
fn exposures(folder: &Path, is_raw: bool) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| {
            if is_raw {
                return raw::is_raw(path);
            }
            let extension = path.extension().map(|own| own.to_string_lossy().to_lowercase());
            extension.is_some_and(|own| EXPOSURES.contains(&own.as_str()))
        })
        .collect();
    files.sort();
    files
}

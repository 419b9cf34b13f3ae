//! Opens the model of a capture for editing, and the changes to it that were not saved.

use std::path::Path;

use glam::DVec2;

use super::points::{POINTS, read_points};
use super::{NAME, UNSAVED, read, unplaced, write};
use crate::io::json::{self, Field};
use crate::io::transforms::{self, Frame, Images};
use crate::io::{Error, capture, exif_lens, inside, orientation, photograph, picture};
use crate::model::{Fit, FoundCameras, FoundPoint, Lens, Model, Photograph};
use crate::scene::{Camera, Distortion};

const CAMERAS: &str = "transforms.json";
/// Cameras that show points farther from their pixels in the median, as a part of the image's diagonal,
/// are other cameras: at a thousand pixels ten.
const ELSEWHERE: f64 = 0.01;

/// A capture's model.
#[derive(Clone, Debug)]
pub struct Opened {
    /// Of `model.json`; where there is none, the photographs of the camera file alone.
    pub model: Model,
    /// Whether there is a `model.json`.
    pub is_saved: bool,
    /// What was drawn since, and not saved before the program ended.
    pub unsaved: Option<Model>,
    /// What could not be read.
    pub warnings: Vec<String>,
}

/// Whether a folder holds photographs whose cameras or mesh are still to be made here.
pub fn is_begun(folder: &Path) -> bool {
    let (count, open) = match unplaced(&folder.join(CAMERAS)) {
        Ok((count, names)) => (count, names.len()),
        Err(_) => (0, 0),
    };
    let is_whole = open < count && capture::find_geometry(folder).is_ok();
    !is_whole && (open > 0 || folder.join(NAME).is_file())
}

/// Whether a folder holds photographs with cameras, and no mesh.
pub fn lacks_mesh(folder: &Path) -> bool {
    let has_cameras = || matches!(unplaced(&folder.join(CAMERAS)), Ok((count, _)) if count > 0);
    matches!(capture::find_geometry(folder), Err(Error::Missing(_))) && has_cameras()
}

/// Reads the model of a capture, or begins one.
pub fn open(folder: &Path) -> Result<Opened, Error> {
    let (file, kept) = (folder.join(NAME), folder.join(UNSAVED));
    let is_saved = file.is_file();
    let mut warnings = Vec::new();
    let model = if is_saved { read(&file)? } else { begun(folder, &mut warnings)? };
    let unsaved = match kept.is_file().then(|| read(&kept)) {
        Some(Ok(own)) if own != model => Some(own),
        Some(Err(error)) => {
            warnings.push(error.to_string());
            None
        }
        _ => None,
    };
    Ok(Opened { model, is_saved, unsaved, warnings })
}

/// Keeps a model that is not saved yet, in case that the program ends.
pub fn keep(folder: &Path, model: &Model) -> Result<(), Error> {
    write(&folder.join(UNSAVED), model)
}

/// Forgets what was kept: it is saved, or not wanted.
pub fn forget(folder: &Path) {
    // There may be none.
    let _ = std::fs::remove_file(folder.join(UNSAVED));
}

/// Saves a model as the capture's `model.json`, whole or not at all.
pub fn save(folder: &Path, model: &Model) -> Result<(), Error> {
    write(&folder.join(NAME), model)
}

/// A model of the photographs that a camera file names, with the cameras that they have. Photographs
/// of one size and one focal length share a lens.
fn begun(folder: &Path, warnings: &mut Vec<String>) -> Result<Model, Error> {
    let file = folder.join(CAMERAS);
    let value = json::read(&file)?;
    let root = Field::root(&file, &value)?;
    let mut model = Model::default();
    for frame in root.need("frames")?.items()? {
        let name = frame.need("file_path")?.text()?.to_owned();
        let image = inside::join(folder, &name).filter(|image| image.is_file());
        let either = |key: &str| frame.get(key).or_else(|| root.get(key));
        let number = |key: &str| either(key).map(|field| field.number()).transpose();
        let size = match (number("w")?, number("h")?, &image) {
            (Some(width), Some(height), _) if width >= 1.0 && height >= 1.0 => {
                (width as usize, height as usize)
            }
            (.., Some(image)) => {
                orientation::of_frame(&frame)?.size(picture::dimensions(image).or_else(|_| {
                    photograph::head(image).map(|(width, height, _)| (width, height))
                })?)
            }
            _ => {
                let problem = "neither its size is given nor is the image there";
                return Err(frame.wrong_with(problem, "Put the photograph there, or give w and h"));
            }
        };
        let known = number("fl_x")?.filter(|focal| *focal > 0.0);
        let focal_px = match (known, &image) {
            (Some(focal), _) => Some(focal),
            (None, Some(image)) => exif_lens::read(image)?.focal_px,
            (None, None) => None,
        };
        let is_own = |photograph: &Photograph| {
            photograph.size == size && model.lenses[photograph.lens].focal_px == focal_px
        };
        let shared = model.photographs.iter().find(|own| is_own(own)).map(|own| own.lens);
        let lens = shared.unwrap_or_else(|| {
            let id = match model.lenses.len() {
                0 => "lens".to_owned(),
                count => format!("lens{}", count + 1),
            };
            model.lenses.push(Lens {
                id,
                focal_px,
                principal_px: None,
                radial: DVec2::ZERO,
                fit: Fit::default(),
            });
            model.lenses.len() - 1
        });
        model.photographs.push(Photograph { name, lens, size, found: None });
    }
    take_cameras(&mut model, &file, &value, warnings);
    Ok(model)
}

/// Photographs that have cameras stand towards each other as these say, and in metres.
fn take_cameras(
    model: &mut Model,
    file: &Path,
    value: &serde_json::Value,
    warnings: &mut Vec<String>,
) {
    let folder = file.parent().unwrap_or(Path::new(""));
    let find = |name: &str| transforms::find_below(folder, name);
    // Without cameras nothing is lost: the photographs can be drawn on all the same.
    let Ok(read) = transforms::interpret(file, value, Images::Optional, &find) else { return };
    let camera = |own: &Photograph| {
        let is_own = |frame: &&Frame| frame.name == own.name;
        let camera = read.frames.iter().find(is_own).map(|frame| frame.camera);
        camera.filter(|camera| (camera.width, camera.height) == own.size)
    };
    let cameras: Vec<_> = model.photographs.iter().map(camera).collect();
    if cameras.iter().all(Option::is_none) {
        return;
    }
    let is_simplified = |camera: &Camera| {
        let Distortion { radial, tangential, denominator } = camera.distortion;
        radial[2..] != [0.0; 2] || tangential != [0.0; 2] || denominator != [0.0; 3]
    };
    if cameras.iter().flatten().any(is_simplified) {
        warnings.push(format!(
            "{}: a model has k1 and k2 of a lens alone. The other terms of these cameras are left \
             out, and lost once the model is used: undistort the photographs before.",
            file.display()
        ));
    }
    let engine = CAMERAS.to_owned();
    let points = points(folder, model, &cameras, warnings);
    let found = FoundCameras { engine, cameras, points, in_metres: true, ..Default::default() };
    model.take_found(&found);
}

/// The points that stand beside the cameras, if they are of these cameras.
fn points(
    folder: &Path,
    model: &Model,
    cameras: &[Option<Camera>],
    warnings: &mut Vec<String>,
) -> Vec<FoundPoint> {
    let file = folder.join(POINTS);
    if !file.is_file() {
        return Vec::new();
    }
    let names: Vec<&str> = model.photographs.iter().map(|own| own.name.as_str()).collect();
    let points = match read_points(&file, &names) {
        Ok(points) => points,
        Err(error) => {
            warnings.push(format!("{error} The cameras are used without the points."));
            return Vec::new();
        }
    };
    // Parts of the image's diagonal by which the cameras show points elsewhere than the pixels say.
    let mut off: Vec<f64> = Vec::new();
    for point in &points {
        for (&photograph, &pixel) in point.photographs.iter().zip(&point.pixels) {
            let Some(camera) = &cameras[photograph] else { continue };
            let diagonal = (camera.width as f64).hypot(camera.height as f64);
            let seen = camera.project(point.position).map(|(seen, _)| seen.distance(pixel));
            off.push(seen.map_or(f64::INFINITY, |distance| distance / diagonal));
        }
    }
    off.sort_by(f64::total_cmp);
    if off.get(off.len() / 2).is_some_and(|median| *median > ELSEWHERE) {
        warnings.push(format!(
            "{}: the points are not of the cameras of {CAMERAS}, which show them elsewhere. They \
             are left out: import the capture again to have them.",
            file.display()
        ));
        return Vec::new();
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::exr;
    use crate::io::model::new_capture;
    use crate::watch::Watch;

    #[test]
    fn a_new_capture_is_begun_and_what_was_not_saved_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<_> = [(8, 6), (8, 6), (6, 8)]
            .iter()
            .enumerate()
            .map(|(index, (width, height))| {
                let file = folder.path().join(format!("{index}.exr"));
                exr::write_rgb(&file, *width, *height, &vec![[0.5; 3]; width * height]).unwrap();
                file
            })
            .collect();
        let room = folder.path().join("room");
        assert!(!is_begun(&room));
        new_capture(&room, &files, &Watch::new()).unwrap();
        assert!(is_begun(&room));
        let Opened { mut model, is_saved, unsaved, .. } = open(&room).unwrap();
        assert!(!is_saved && unsaved.is_none());
        let lenses: Vec<usize> = model.photographs.iter().map(|own| own.lens).collect();
        assert_eq!((lenses, model.lenses[1].id.as_str()), (vec![0, 0, 1], "lens2"));
        save(&room, &model).unwrap();
        model.points.push(crate::model::Point { id: "p1".into() });
        keep(&room, &model).unwrap();
        let opened = open(&room).unwrap();
        assert!(opened.is_saved && opened.model.points.is_empty());
        assert_eq!(opened.unsaved, Some(model));
        std::fs::write(room.join(UNSAVED), "{").unwrap();
        assert_eq!(open(&room).unwrap().warnings.len(), 1);
        forget(&room);
        assert!(open(&room).unwrap().unsaved.is_none());
    }
}

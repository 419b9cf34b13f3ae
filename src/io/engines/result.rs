//! Reads the result of an engine: the largest of its COLMAP models, by the importer, and checks it.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::pictures::{FOLDER, Picture};
use super::{Engine, REMEDY, Subject};
use crate::io::import::{self, Import, colmap};
use crate::io::{Error, Fault};
use crate::model::FoundCameras;
use crate::scene::Camera;
use crate::watch::Watch;

/// Focal lengths beyond these, in lengths of the longer side, are none of a photograph.
const FOCAL: std::ops::Range<f64> = 0.1..100.0;

/// The models below a folder.
pub(super) fn models(out: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(out.join("sparse")).into_iter().flatten().flatten();
    let mut models: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| colmap::is_model(path)).collect();
    models.sort();
    models
}

/// Reads the model with most photographs.
pub(super) fn read(
    engine: Engine,
    out: &Path,
    pictures: &[Picture],
    photographs: &[Subject],
    watch: &Watch,
) -> Result<FoundCameras, Error> {
    let nonsense = |problem: String| {
        let remedy = "Run it again, or take another engine";
        Error::Invalid(Fault::new(Path::new(engine.name()), "", problem, remedy))
    };
    let unreadable = |error: Error| match error {
        Error::Cancelled(own) => Error::Cancelled(own),
        other => {
            let text = other.to_string();
            nonsense(format!("what it wrote cannot be read ({})", text.trim_end_matches('.')))
        }
    };
    let mut best: Option<(usize, PathBuf)> = None;
    for model in models(out) {
        let count = colmap::read(&model).map_err(unreadable)?.images.len();
        if best.as_ref().is_none_or(|(most, _)| count > *most) {
            best = Some((count, model));
        }
    }
    let Some((count, model)) = best else {
        return Err(nonsense("it ended without writing any camera".to_owned()));
    };
    if count < 2 {
        let problem = "it found no photographs that show the same points".to_owned();
        return Err(Error::Invalid(Fault::new(Path::new(engine.name()), "", problem, REMEDY)));
    }
    let images = out.with_file_name(FOLDER);
    let options = import::Options { images: vec![images], ..Default::default() };
    let import = import::read(&model, &options, watch).map_err(unreadable)?;
    taken(engine, &import, pictures, photographs).map_err(nonsense)
}

/// The cameras in pixels of the photographs; an error in words where they cannot be.
fn taken(
    engine: Engine,
    import: &Import,
    pictures: &[Picture],
    photographs: &[Subject],
) -> Result<FoundCameras, String> {
    let mut cameras: Vec<Option<Camera>> = vec![None; photographs.len()];
    for shot in &import.shots {
        let Some(index) = number(&shot.name, photographs.len()) else {
            return Err(format!("it placed a photograph that is none of these: {}", shot.name));
        };
        let longest = shot.camera.width.max(shot.camera.height) as f64;
        let focal = shot.camera.focal_px / longest;
        if !FOCAL.contains(&focal.x) || !FOCAL.contains(&focal.y) {
            return Err(format!(
                "it gives photograph {} a focal length of {:.0} px, which no lens has",
                index + 1,
                shot.camera.focal_px.x
            ));
        }
        if cameras[index].is_some() {
            return Err(format!("it placed photograph {} twice", index + 1));
        }
        let Picture { step, corner } = pictures[index];
        let old = &shot.camera;
        cameras[index] = Some(Camera::new(
            photographs[index].size,
            old.focal_px * step,
            old.principal_px * step + corner,
            old.distortion,
            old.world_from_camera,
            old.position,
        ));
    }
    let placed: Vec<DVec3> = cameras.iter().flatten().map(|camera| camera.position).collect();
    let spread = placed.iter().map(|own| own.distance(placed[0])).fold(0.0, f64::max);
    if placed.len() < 2 || spread.is_nan() || spread <= 0.0 {
        return Err("all its cameras stand in one place".to_owned());
    }
    let number = |shot: usize| number(&import.shots[shot].name, photographs.len());
    let points = import::tracks(import, number, |photograph, pixel| {
        let Picture { step, corner } = pictures[photograph];
        pixel * step + corner
    });
    let error_px = import.reprojection.as_ref().map(|own| own.median_px);
    let engine = engine.name().to_owned();
    Ok(FoundCameras { engine, cameras, points, error_px, in_metres: false })
}

/// The number of a picture by its name.
fn number(name: &str, photographs: usize) -> Option<usize> {
    let name = Path::new(name).file_stem()?.to_str()?;
    name.parse().ok().filter(|own| *own < photographs)
}

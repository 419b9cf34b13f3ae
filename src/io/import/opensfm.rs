//! OpenSfM's `reconstruction.json`.
//!
//! Poses are world to camera, angle times axis, in the axes of computer vision. Image coordinates
//! are in lengths of the longer side from the middle, which is half the size from the corner: a
//! pixel's centre is at (x + 0.5 − w/2) / max(w, h) (`opensfm/features.py`). Lens terms are
//! OpenCV's.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use serde_json::Value;

use super::format::{Format, Sign};
use super::{Lens, Parsed, View, from_vision, gathered};
use crate::io::json::{self, Field};
use crate::io::{Error, Fault};
use crate::scene::Distortion;

pub(super) const FORMAT: Format = Format {
    name: "OpenSfM",
    signs: &[Sign::Json(is_it)],
    parse: |file, bytes, _| parse(file, bytes),
};

/// Whether a JSON value looks like such a file.
fn is_it(value: &Value) -> bool {
    let first = value.as_array().and_then(|items| items.first());
    first.is_some_and(|first| first.get("cameras").is_some() && first.get("shots").is_some())
}

/// Reads the bytes of a file; `file` is for messages.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Parsed, Error> {
    interpret(file, &json::parse_bytes(file, bytes)?)
}

pub(super) fn interpret(file: &Path, value: &Value) -> Result<Parsed, Error> {
    let root = Field { file, path: String::new(), value };
    let mut parsed = Parsed::default();
    let items = root.items()?;
    let shots =
        |item: &Field| item.value.get("shots").and_then(Value::as_object).map_or(0, |s| s.len());
    let Some(largest) = (0..items.len()).max_by_key(|&i| (shots(&items[i]), usize::MAX - i)) else {
        return Err(root.wrong("there is no reconstruction in the file"));
    };
    if items.len() > 1 {
        parsed.warnings.push(format!(
            "{}: the file has {} separate reconstructions; the largest is read, number {largest} \
             with {} photographs.",
            file.display(),
            items.len(),
            shots(&items[largest])
        ));
    }
    let item = &items[largest];
    let Some(shots) = item.need("shots")?.value.as_object() else {
        return Err(item.wrong("\"shots\" must be an object {…}"));
    };
    let cameras = item.need("cameras")?;
    let mut foreign = Vec::new();
    for (name, value) in shots {
        let path = format!("[{largest}].shots ({name})");
        let shot = Field { file, path: path.clone(), value };
        let camera = cameras.need(shot.need("camera")?.text()?)?;
        let Some((lens, distortion)) = lens(&camera)? else {
            let kind = camera.get("projection_type").and_then(|kind| kind.text().ok());
            foreign.push(format!("{path}, {}", kind.unwrap_or_default()));
            continue;
        };
        let side = |key| camera.need(key)?.number().map(|side| side as usize);
        let turn = DVec3::from(shot.need("rotation")?.numbers::<3>()?);
        let angle = turn.length();
        let rotation = match turn.try_normalize() {
            Some(axis) => DMat3::from_axis_angle(axis, angle),
            None => DMat3::IDENTITY,
        };
        let translation = DVec3::from(shot.need("translation")?.numbers::<3>()?);
        let (world_from_camera, position) = from_vision(rotation, translation);
        parsed.views.push(View {
            name: name.clone(),
            undistorted: None,
            place: path,
            size: Some((side("width")?, side("height")?)),
            lens,
            distortion,
            world_from_camera,
            position,
        });
    }
    if parsed.views.is_empty() {
        return Err(match foreign.first() {
            Some(place) => Error::Unsupported(Fault::new(
                file,
                place.clone(),
                "this lens model is not supported",
                "Undistort the images (opensfm undistort) and import that reconstruction",
            )),
            None => item.wrong("there is no photograph in the reconstruction"),
        });
    }
    let what = "this lens model is not supported; the photograph is left out.";
    parsed.warnings.extend(gathered(file, &foreign, what));
    Ok(parsed)
}

/// The lens, or `None` for a model that is not supported.
fn lens(camera: &Field) -> Result<Option<(Lens, Distortion)>, Error> {
    let term = |key: &str| camera.get(key).map_or(Ok(0.0), |field| field.number());
    let kind = camera.get("projection_type").map_or(Ok("perspective"), |field| field.text())?;
    let radial =
        Distortion { radial: [term("k1")?, term("k2")?, term("k3")?, 0.], ..Default::default() };
    let distortion = match kind {
        "perspective" | "simple_radial" | "radial" => radial,
        "brown" => Distortion { tangential: [term("p1")?, term("p2")?], ..radial },
        _ => return Ok(None),
    };
    let focal = match camera.get("focal") {
        Some(focal) => DVec2::splat(focal.number()?),
        None => DVec2::new(camera.need("focal_x")?.number()?, camera.need("focal_y")?.number()?),
    };
    let offset = DVec2::new(term("c_x")?, term("c_y")?);
    Ok(Some((Lens::Relative { focal, offset }, distortion)))
}

//! Fits a camera to the size of its image.

use std::path::{Path, PathBuf};

use glam::DVec2;

use super::notes::Notes;
use crate::io::exif_lens;
use crate::io::orientation::Orientation;
use crate::io::picture::{self, Format};
use crate::scene::Camera;

/// Sides may differ by this many pixels from an exact scaling.
const ROUNDED_PX: f64 = 1.0;

pub(super) fn is_radiance(image: Option<&Path>) -> bool {
    image.is_some_and(|image| Format::of(image).is_ok_and(Format::is_radiance))
}

/// An image with its size; an image that is damaged is none.
pub(super) fn measured(
    image: Option<PathBuf>,
    notes: &mut Notes,
) -> (Option<PathBuf>, Option<(usize, usize)>) {
    let Some(path) = image else { return (None, None) };
    if matches!(Format::of(&path), Ok(Format::Tiff)) {
        // Only shown, and its size is not read.
        return (Some(path), None);
    }
    match picture::dimensions(&path) {
        Ok(size) => (Some(path), Some(size)),
        Err(error) => {
            notes.damaged.push(error.to_string());
            (None, None)
        }
    }
}

/// Camera and image brought together, with the image's orientation: the camera is turned upright
/// where it is one of the pixels as they are stored, and scaled where the image is smaller or larger;
/// `None` where it cannot be the image of this camera.
pub(super) fn fit(
    camera: Camera,
    image: Option<PathBuf>,
    actual: Option<(usize, usize)>,
    place: &str,
    notes: &mut Notes,
) -> Option<(Camera, Option<PathBuf>, Orientation)> {
    let held = image.as_deref().map(exif_lens::orientation).and_then(Result::ok);
    let held = held.unwrap_or_default();
    let is_turned = |stored: (usize, usize)| {
        let own = (camera.width, camera.height);
        factor(own, stored).is_none() && factor(own, held.size(stored)).is_some()
    };
    if actual.is_some_and(is_turned) {
        let actual = actual.map(|stored| held.size(stored));
        return scale(camera, actual, place, notes).map(|camera| (camera, image, held));
    }
    let camera = scale(camera, actual, place, notes)?;
    Some(match held.camera(&camera) {
        Some(upright) => (upright, image, held),
        None => (camera, image, Orientation::default()),
    })
}

/// By what an image is larger than its camera's, along x and y; `None` where it has another shape
/// but for rounding to whole pixels.
fn factor(own: (usize, usize), actual: (usize, usize)) -> Option<DVec2> {
    let size = |(width, height): (usize, usize)| DVec2::new(width as f64, height as f64);
    let (ours, theirs) = (size(own), size(actual));
    let factor = theirs / ours;
    let skew = (theirs - ours * factor.max_element()).abs().max_element();
    (skew <= ROUNDED_PX * factor.max_element().max(1.0)).then_some(factor)
}

/// The camera for the image as it is: scaled where that is smaller or larger; `None` where it
/// cannot be the image of this camera.
pub(super) fn scale(
    camera: Camera,
    actual: Option<(usize, usize)>,
    place: &str,
    notes: &mut Notes,
) -> Option<Camera> {
    let own = (camera.width, camera.height);
    let Some(actual) = actual.filter(|actual| *actual != own) else { return Some(camera) };
    let Some(factor) = factor(own, actual) else {
        notes.misshapen.push(format!(
            "{place}, {} x {} pixels where the camera has {} x {}",
            actual.0, actual.1, own.0, own.1
        ));
        return None;
    };
    notes.scaled.push(place.to_owned());
    let (focal, principal) = (camera.focal_px * factor, camera.principal_px * factor);
    let (rotation, position) = (camera.world_from_camera, camera.position);
    Some(Camera::new(actual, focal, principal, camera.distortion, rotation, position))
}

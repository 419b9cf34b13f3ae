//! Brings a camera and the image that it took together.

use std::path::{Path, PathBuf};

use super::notes::Notes;
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

/// The camera for the image as it is: scaled where that is smaller or larger; `None` where it
/// cannot be the image of this camera.
pub(super) fn fit(
    camera: Camera,
    image: Option<PathBuf>,
    actual: Option<(usize, usize)>,
    place: &str,
    notes: &mut Notes,
) -> Option<(Camera, Option<PathBuf>)> {
    let own = (camera.width, camera.height);
    let Some(actual) = actual.filter(|actual| *actual != own) else { return Some((camera, image)) };
    let size = |(width, height): (usize, usize)| glam::DVec2::new(width as f64, height as f64);
    let (ours, theirs) = (size(own), size(actual));
    let factor = theirs / ours;
    // The same shape but for rounding to whole pixels.
    let skew = (theirs - ours * factor.max_element()).abs().max_element();
    if skew > ROUNDED_PX * factor.max_element().max(1.0) {
        notes.misshapen.push(format!(
            "{place}, {} x {} pixels where the camera has {} x {}",
            actual.0, actual.1, own.0, own.1
        ));
        return None;
    }
    notes.scaled.push(place.to_owned());
    let (focal, principal) = (camera.focal_px * factor, camera.principal_px * factor);
    let (rotation, position) = (camera.world_from_camera, camera.position);
    Some((Camera::new(actual, focal, principal, camera.distortion, rotation, position), image))
}

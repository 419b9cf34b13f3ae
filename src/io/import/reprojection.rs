//! The distances of a COLMAP model's points, projected by the imported cameras, from their
//! observations. COLMAP has written the same distances into the model, so a difference shows an
//! error in reading.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec2, DVec3, Vec2};

use super::colmap::Reconstruction;
use super::{Parsed, Shot, View};
use crate::io::Error;
use crate::scene::Camera;

/// What the points of a model say about its cameras.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reprojection {
    /// Points whose whole track falls into its images.
    pub points: usize,
    pub observations: usize,
    /// Observations that no camera of this program sees, or that are not there.
    pub unseen: usize,
    /// Mean distance of projections from observations, in pixels.
    pub mean_px: f64,
    /// Root of the mean square of these.
    pub rms_px: f64,
    pub median_px: f64,
    pub worst_px: f64,
    /// Largest difference between a point's mean distance here and the one in the model, in
    /// pixels, over the points.
    pub disagreement_px: f64,
    /// The difference that 99 % of the points stay below.
    pub disagreement_99_px: f64,
}

/// Projects every point into the images of its track; `None` where nothing was observed.
pub(super) fn check(
    file: &Path,
    model: &Reconstruction,
    parsed: &Parsed,
) -> Result<Option<Reprojection>, Error> {
    let views: HashMap<&str, &View> =
        parsed.views.iter().map(|view| (view.place.as_str(), view)).collect();
    let mut cameras: HashMap<i64, (Camera, usize)> = HashMap::new();
    for (index, image) in model.images.iter().enumerate() {
        let place = format!("{} ({})", image.place, image.name);
        let Some(view) = views.get(place.as_str()) else { continue };
        let camera = view.camera(file, view.size.unwrap_or_default())?;
        cameras.insert(image.id, (camera, index));
    }
    let mut result = Reprojection::default();
    let (mut sum, mut squares, mut differences) = (0.0, 0.0, Vec::new());
    let mut distances = Vec::new();
    for point in &model.points {
        let (mut whole, mut own, mut count) = (true, 0.0, 0);
        for (image, number) in &point.track {
            let observed = cameras.get(image).and_then(|(camera, index)| {
                let number = usize::try_from(*number).ok()?;
                Some((camera, model.images[*index].observations.get(number)?))
            });
            let seen = observed.and_then(|(camera, observed)| {
                let (pixel, _) = camera.project(point.position)?;
                Some(pixel.distance(*observed)).filter(|distance| distance.is_finite())
            });
            let Some(distance) = seen else {
                result.unseen += 1;
                whole = false;
                continue;
            };
            sum += distance;
            distances.push(distance);
            squares += distance * distance;
            own += distance;
            count += 1;
        }
        result.observations += count;
        if whole && count > 0 {
            result.points += 1;
            differences.push((own / count as f64 - point.error_px).abs());
        }
    }
    if result.observations == 0 {
        return Ok(None);
    }
    result.mean_px = sum / result.observations as f64;
    result.rms_px = (squares / result.observations as f64).sqrt();
    (result.median_px, result.worst_px) = median_and_worst(distances);
    differences.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * differences.len() as f64).ceil() as usize;
        differences.get(index.saturating_sub(1)).copied().unwrap_or(0.0)
    };
    (result.disagreement_px, result.disagreement_99_px) = (at(1.0), at(0.99));
    Ok(Some(result))
}

/// Where a photograph shows a point of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// In pixels of the photograph as it is.
    pub pixel: Vec2,
    /// An index into `Import::points`.
    pub point: u32,
}

/// Gives the photographs what the model observed in them, and the points, each brought to its
/// `place` in the capture.
pub(super) fn observe(
    model: &Reconstruction,
    shots: &mut [Shot],
    place: impl Fn(DVec3) -> DVec3,
) -> Vec<DVec3> {
    let named: HashMap<&str, usize> =
        model.images.iter().enumerate().map(|(i, image)| (image.name.as_str(), i)).collect();
    let numbers: HashMap<i64, usize> =
        model.images.iter().enumerate().map(|(i, image)| (image.id, i)).collect();
    let mut seen: Vec<Vec<Observation>> = vec![Vec::new(); model.images.len()];
    for (point, record) in model.points.iter().enumerate() {
        for (image, number) in &record.track {
            let Some(&image) = numbers.get(image) else { continue };
            let observations = &model.images[image].observations;
            let pixel = usize::try_from(*number).ok().and_then(|own| observations.get(own));
            if let Some(pixel) = pixel.filter(|pixel| pixel.is_finite()) {
                seen[image].push(Observation { pixel: pixel.as_vec2(), point: point as u32 });
            }
        }
    }
    for shot in shots {
        let Some(&image) = named.get(shot.name.as_str()) else { continue };
        let Some(record) = model.cameras.get(&model.images[image].camera) else { continue };
        // The photograph may have been scaled since.
        let (width, height) = shot.orientation.size((shot.camera.width, shot.camera.height));
        let factor = DVec2::new(width as f64, height as f64)
            / DVec2::new(record.size.0 as f64, record.size.1 as f64);
        shot.observations = std::mem::take(&mut seen[image]);
        for observation in &mut shot.observations {
            let stored = observation.pixel.as_dvec2() * factor;
            observation.pixel = shot.orientation.place((width, height), stored).as_vec2();
        }
    }
    model.points.iter().map(|point| place(point.position)).collect()
}

/// The median of distances, the mean of the middle two where they are even in number, and the
/// largest; zero of none.
pub fn median_and_worst(mut distances: Vec<f64>) -> (f64, f64) {
    distances.sort_by(f64::total_cmp);
    let count = distances.len();
    match count {
        0 => (0.0, 0.0),
        _ => (0.5 * (distances[(count - 1) / 2] + distances[count / 2]), distances[count - 1]),
    }
}

//! Whether a place along the ray of a pixel, in front of the surface that it meets, looks occupied
//! in the other photographs.

use glam::Vec3;

use super::difference::others;
use super::small::SmallView;
use crate::scene::Views;

/// Places along a ray, closer together near the camera.
const PLACES: usize = 40;
/// The nearest place and the farthest where a ray meets nothing, in parts of the typical distance
/// of surfaces.
const NEAREST: f32 = 0.065;
const FARTHEST: f32 = 2.2;
/// A place this far behind what a photograph sees, as a part of the distance, may still be seen.
const DEPTH_SLACK: f32 = 1.01;
/// Every so-many-th pixel and row has a ray of its own.
const STEP: usize = 2;
/// Pixels with less evidence show the known surface: no place along their rays is occupied.
const AGREES: f32 = -0.5;

/// For each pixel the sum over the other photographs of their evidence at the place along its ray
/// where that is largest.
pub(super) fn along_rays(
    views: &Views,
    small: &[SmallView],
    evidence: &[Vec<f32>],
    view: usize,
    typical_m: f32,
) -> Vec<f32> {
    let own = &small[view];
    let others = others(views, small, view);
    let (width, height) = own.size();
    let near = NEAREST * typical_m;
    let columns = width.div_ceil(STEP);
    let mut largest = Vec::with_capacity(columns * height.div_ceil(STEP));
    for y in (0..height).step_by(STEP) {
        for x in (0..width).step_by(STEP) {
            let index = y * width + x;
            let direction = own.directions[index];
            let far = own.points[index].map_or(FARTHEST * typical_m, |hit| hit.distance);
            let place = |step: usize| {
                let part = step as f32 / (PLACES - 1) as f32;
                let distance =
                    if far <= near { far } else { 1.0 / ((1.0 - part) / near + part / far) };
                own.position + direction * distance
            };
            let sums = (0..PLACES).map(|step| sum_at(views, small, evidence, &others, place(step)));
            let agrees = evidence[view][index] < AGREES;
            largest.push(if agrees || direction == Vec3::ZERO {
                0.0
            } else {
                sums.fold(f32::NEG_INFINITY, f32::max)
            });
        }
    }
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.map(|(x, y)| largest[(y / STEP) * columns + x / STEP]).collect()
}

fn sum_at(
    views: &Views,
    small: &[SmallView],
    evidence: &[Vec<f32>],
    others: &[usize],
    place: Vec3,
) -> f32 {
    let mut sum = 0.0;
    for &other in others {
        let Some(pixel) = views.buffers[other].pixel(place) else { continue };
        let view = &small[other];
        let index = view.squares.index(pixel);
        let distance = place.distance(view.position);
        if view.points[index].is_none_or(|hit| distance < DEPTH_SLACK * hit.distance) {
            sum += evidence[other][index];
        }
    }
    sum
}

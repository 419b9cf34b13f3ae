//! Photographs with fewer pixels, together with their visibility buffers.

use glam::{DVec2, Vec3};

use super::LONGEST_SIDE;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::scene::{SurfacePoint, Views};
use crate::watch::Cancelled;

/// Below this part of the median brightness, logarithms are of noise.
const FLOOR: f32 = 1e-3;
/// Standard deviation in pixels by which photographs are smoothed against noise and against edges
/// that are off by part of a pixel.
const SMOOTHING_PX: f32 = 0.7;

/// One photograph in fewer pixels.
pub(super) struct SmallView {
    pub photograph: usize,
    pub width: usize,
    pub height: usize,
    /// Side in pixels of the square that one pixel stands for.
    block: usize,
    full: (usize, usize),
    pub position: Vec3,
    /// Logarithm of the smoothed radiance.
    pub log: Vec<Radiance>,
    pub is_valid: Vec<bool>,
    pub points: Vec<Option<SmallHit>>,
    /// Unit direction of each pixel's ray; zero where the lens has none.
    pub directions: Vec<Vec3>,
}

/// What a pixel sees.
#[derive(Clone, Copy)]
pub(super) struct SmallHit {
    pub point: SurfacePoint,
    pub surface: usize,
    pub distance: f32,
}

impl SmallView {
    pub fn new(views: &Views, view: usize) -> Result<Self, Cancelled> {
        let buffer = &views.buffers[view];
        let (camera, image) = (buffer.camera, buffer.image);
        let full = (camera.width, camera.height);
        let block = full.0.max(full.1).div_ceil(LONGEST_SIDE).max(1);
        let (width, height) = (full.0.div_ceil(block), full.1.div_ceil(block));
        let position = camera.position.as_vec3();
        let (mut pixels, mut is_valid) = (Vec::new(), Vec::new());
        let (mut points, mut directions) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = ([0.0; CHANNELS], 0);
                let rows = y * block..((y + 1) * block).min(full.1);
                let columns = x * block..((x + 1) * block).min(full.0);
                for (u, v) in rows.clone().flat_map(|v| columns.clone().map(move |u| (u, v))) {
                    let Some(radiance) = image.radiance_without_mask(u, v) else { continue };
                    sum.iter_mut().zip(radiance).for_each(|(sum, own)| *sum += own);
                    count += 1;
                }
                is_valid.push(count == rows.len() * columns.len());
                // What is no measurement is mostly too bright for the sensor.
                let raw = || image.pixel(columns.start, rows.start);
                pixels.push(match count {
                    0 => raw().map(|own| if own.is_finite() { own.clamp(0.0, 1e9) } else { 0.0 }),
                    count => sum.map(|own| own / count as f32),
                });
                let middle = [(x, full.0), (y, full.1)]
                    .map(|(own, side)| (own * block + block / 2).min(side - 1));
                let place = DVec2::new(middle[0] as f64 + 0.5, middle[1] as f64 + 0.5);
                let direction = camera.direction(place).map_or(Vec3::ZERO, |own| own.as_vec3());
                directions.push(direction);
                points.push(buffer.hit(middle[0], middle[1]).map(|(position, triangle)| {
                    SmallHit {
                        point: views.side(position, triangle, -direction),
                        surface: views.capture.mesh.surface[triangle as usize] as usize,
                        distance: position.distance(camera.position.as_vec3()),
                    }
                }));
            }
        }
        let mut brightness: Vec<f32> =
            pixels.iter().map(|own| own.iter().sum::<f32>() / CHANNELS as f32).collect();
        brightness.sort_by(f32::total_cmp);
        let floor =
            (FLOOR * brightness.get(brightness.len() / 2).copied().unwrap_or(0.0)).max(1e-9);
        let smoothed = blurred(&pixels, (width, height), SMOOTHING_PX);
        let log = smoothed.into_iter().map(|own| own.map(|own| (own + floor).ln())).collect();
        let photograph = buffer.photograph;
        Ok(Self {
            photograph,
            width,
            height,
            block,
            full,
            position,
            log,
            is_valid,
            points,
            directions,
        })
    }

    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The pixel for one of the whole photograph.
    pub fn index(&self, (x, y): (usize, usize)) -> usize {
        (y / self.block) * self.width + x / self.block
    }

    /// The logarithm of the radiance between pixels, at a place in the whole photograph; `None`
    /// where one of the four is no measurement.
    pub fn between(&self, place: DVec2) -> Option<Radiance> {
        let place = place / self.block as f64 - 0.5;
        let last = DVec2::new((self.width - 1) as f64, (self.height - 1) as f64);
        let place = place.clamp(DVec2::ZERO, last);
        let (x, y) = (place.x as usize, place.y as usize);
        let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
        let part = (place - place.floor()).as_vec2();
        let mut sum = [0.0; CHANNELS];
        for (u, v, weight) in [
            (x, y, (1.0 - part.x) * (1.0 - part.y)),
            (right, y, part.x * (1.0 - part.y)),
            (x, below, (1.0 - part.x) * part.y),
            (right, below, part.x * part.y),
        ] {
            let index = v * self.width + u;
            if !self.is_valid[index] {
                return None;
            }
            sum.iter_mut().zip(self.log[index]).for_each(|(sum, own)| *sum += weight * own);
        }
        Some(sum)
    }

    /// A mask in the pixels of the whole photograph.
    pub fn enlarged(&self, is_masked: &[bool]) -> Vec<bool> {
        let (width, height) = self.full;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        pixels.map(|pixel| is_masked[self.index(pixel)]).collect()
    }
}

/// The median of how far the known surfaces are from the cameras, in metres.
pub(super) fn typical_distance(views: &[SmallView]) -> f32 {
    let mut distances: Vec<f32> = views
        .iter()
        .flat_map(|view| view.points.iter().step_by(17).flatten().map(|hit| hit.distance))
        .collect();
    distances.sort_by(f32::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(1.0)
}

/// Smoothed by a Gaussian; beyond the border the nearest pixel is meant.
pub(super) fn blurred(
    pixels: &[Radiance],
    (width, height): (usize, usize),
    deviation_px: f32,
) -> Vec<Radiance> {
    let reach = (4.0 * deviation_px + 0.5) as i64;
    let weight = |at: i64| (-0.5 * (at as f32 / deviation_px).powi(2)).exp();
    let total: f32 = (-reach..=reach).map(weight).sum();
    let pass = |from: &[Radiance], step: [i64; 2]| -> Vec<Radiance> {
        let places = (0..height as i64).flat_map(|y| (0..width as i64).map(move |x| [x, y]));
        places
            .map(|[x, y]| {
                let mut sum = [0.0; CHANNELS];
                for at in -reach..=reach {
                    let u = (x + at * step[0]).clamp(0, width as i64 - 1) as usize;
                    let v = (y + at * step[1]).clamp(0, height as i64 - 1) as usize;
                    let own = from[v * width + u];
                    sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += weight(at) * own);
                }
                sum.map(|own| own / total)
            })
            .collect()
    };
    pass(&pass(pixels, [1, 0]), [0, 1])
}

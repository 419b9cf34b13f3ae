//! Photographs with fewer pixels, together with their visibility buffers.

use glam::{DVec2, Vec3};

use crate::math::rgb::{CHANNELS, Radiance};
use crate::scene::{Camera, SurfacePoint, Views};
use crate::watch::Cancelled;

/// Below this part of the median brightness, logarithms are of noise.
const FLOOR: f32 = 1e-3;
/// Rows and columns of pixels that are read in each square, at most.
const MOST_READ: usize = 4;
/// Standard deviation in pixels by which photographs are smoothed against noise and against edges
/// that are off by part of a pixel.
const SMOOTHING_PX: f32 = 0.7;

/// Equal squares of the pixels of a photograph.
#[derive(Clone, Copy)]
pub(super) struct Squares {
    /// Of one square, in pixels of the photograph.
    side: usize,
    /// How many are along the sides of the photograph.
    pub width: usize,
    pub height: usize,
}

impl Squares {
    /// At most `longest_side` of them along a side.
    pub fn new(camera: &Camera, longest_side: usize) -> Self {
        let side = camera.width.max(camera.height).div_ceil(longest_side.max(1)).max(1);
        Self { side, width: camera.width.div_ceil(side), height: camera.height.div_ceil(side) }
    }

    /// The square that a pixel of the photograph is in, row by row from the top.
    pub fn index(&self, (x, y): (usize, usize)) -> usize {
        (y / self.side) * self.width + x / self.side
    }
}

/// One photograph in fewer pixels.
pub(super) struct SmallView {
    pub photograph: usize,
    /// What the pixels stand for, one each.
    pub squares: Squares,
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
    /// No side has more than `longest_side` pixels.
    pub fn new(views: &Views, view: usize, longest_side: usize) -> Result<Self, Cancelled> {
        let buffer = &views.buffers[view];
        let (camera, image) = (buffer.camera, buffer.image);
        let full = (camera.width, camera.height);
        let squares = Squares::new(camera, longest_side);
        let Squares { side, width, height } = squares;
        let step = side.div_ceil(MOST_READ);
        let position = camera.position.as_vec3();
        let (mut pixels, mut is_valid) = (Vec::new(), Vec::new());
        let (mut points, mut directions) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = ([0.0; CHANNELS], 0);
                let rows = y * side..((y + 1) * side).min(full.1);
                let columns = x * side..((x + 1) * side).min(full.0);
                let read = rows
                    .clone()
                    .step_by(step)
                    .flat_map(|v| columns.clone().step_by(step).map(move |u| (u, v)));
                let mut is_whole = true;
                for (u, v) in read {
                    let Some(radiance) = image.radiance_without_mask(u, v) else {
                        is_whole = false;
                        continue;
                    };
                    sum.iter_mut().zip(radiance).for_each(|(sum, own)| *sum += own);
                    count += 1;
                }
                is_valid.push(is_whole);
                // What is no measurement is mostly too bright for the sensor.
                let raw = || image.pixel(columns.start, rows.start);
                pixels.push(match count {
                    0 => raw().map(|own| if own.is_finite() { own.clamp(0.0, 1e9) } else { 0.0 }),
                    count => sum.map(|own| own / count as f32),
                });
                let middle = [(x, full.0), (y, full.1)]
                    .map(|(own, full)| (own * side + side / 2).min(full - 1));
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
        image.release();
        Ok(Self { photograph, squares, position, log, is_valid, points, directions })
    }

    pub fn size(&self) -> (usize, usize) {
        (self.squares.width, self.squares.height)
    }

    /// How far the logarithm of a radiance is beyond those of the four pixels around a place in the
    /// whole photograph; `None` where one of the four is no measurement. Where they differ, this
    /// photograph may show the same point blurred.
    pub fn beyond(&self, place: DVec2, log: Radiance) -> Option<Radiance> {
        let (width, height) = self.size();
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let place = (place / self.squares.side as f64 - 0.5).clamp(DVec2::ZERO, last);
        let (x, y) = (place.x as usize, place.y as usize);
        let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
        let around = [(x, y), (right, y), (x, below), (right, below)].map(|(u, v)| v * width + u);
        if around.iter().any(|&index| !self.is_valid[index]) {
            return None;
        }
        let own = |channel: usize| around.map(|index| self.log[index][channel]);
        Some(std::array::from_fn(|channel| {
            let least = own(channel).into_iter().fold(f32::INFINITY, f32::min);
            let most = own(channel).into_iter().fold(f32::NEG_INFINITY, f32::max);
            log[channel] - log[channel].clamp(least, most)
        }))
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

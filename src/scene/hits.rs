//! What the pixels of one photograph see: of each the triangle and the position, or, where the
//! photographs have too many pixels for that, the triangle alone, in runs of pixels that see the
//! same one. The position then follows from the ray through the pixel, to the same bits.

use std::sync::Arc;

use glam::{DVec2, Vec3};

use crate::geometry::bvh::{Hit, Ray, RayCaster, distance_to};
use crate::geometry::mesh::Mesh;
use crate::scene::Camera;

/// What the ray through a pixel's centre met.
#[derive(Clone, Copy)]
pub(super) struct PixelHit {
    pub position: Vec3,
    pub seen: SeenTriangle,
}

/// The triangle, or `NOTHING`. The highest bit is set where the nine hits around the pixel lie on
/// one smooth piece of one surface; it is kept here because both are read together.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct SeenTriangle(u32);

const NOTHING: u32 = u32::MAX >> 1;
const CLEAN: u32 = 1 << 31;
pub(super) const NO_HIT: PixelHit = PixelHit { position: Vec3::ZERO, seen: SeenTriangle(NOTHING) };

impl SeenTriangle {
    pub fn triangle(self) -> Option<u32> {
        let triangle = self.0 & !CLEAN;
        (triangle != NOTHING).then_some(triangle)
    }

    pub fn is_clean(self) -> bool {
        self.0 & CLEAN != 0
    }

    pub fn mark_clean(&mut self) {
        self.0 |= CLEAN;
    }
}

/// The hits of one photograph, row by row from the top.
#[derive(Clone)]
pub(super) enum Hits {
    Whole(Arc<[PixelHit]>),
    Packed(Arc<Runs>),
}

impl Default for Hits {
    fn default() -> Self {
        Self::Whole(Arc::default())
    }
}

impl Hits {
    pub fn len(&self) -> usize {
        match self {
            Self::Whole(hits) => hits.len(),
            Self::Packed(runs) => runs.count,
        }
    }

    #[inline]
    pub fn seen(&self, index: usize) -> SeenTriangle {
        match self {
            Self::Whole(hits) => hits[index].seen,
            Self::Packed(runs) => runs.get(index),
        }
    }

    /// Where the ray through a pixel meets the triangle that it sees.
    #[inline]
    pub fn position(&self, camera: &Camera, mesh: &Mesh, index: usize) -> Vec3 {
        match self {
            Self::Whole(hits) => hits[index].position,
            Self::Packed(runs) => {
                let ray = ray(camera, index % camera.width, index / camera.width);
                match runs.get(index).triangle().zip(ray) {
                    Some((triangle, ray)) => {
                        let t = distance_to(&mesh.corners(triangle as usize), &ray);
                        ray.origin + ray.direction * t
                    }
                    None => NO_HIT.position,
                }
            }
        }
    }

    pub fn any(&self) -> bool {
        match self {
            Self::Whole(hits) => hits.iter().any(|hit| hit.seen.triangle().is_some()),
            Self::Packed(runs) => runs.values.iter().any(|seen| seen.triangle().is_some()),
        }
    }
}

/// Triangles in runs of pixels that see the same one. Pixels are taken 64 at a time: a bit of each
/// says whether it begins a run, as the first of the 64 always does.
pub(super) struct Runs {
    count: usize,
    begins: Vec<u64>,
    /// The number of runs before the 64 pixels.
    before: Vec<u32>,
    values: Vec<SeenTriangle>,
}

impl Runs {
    /// Of no more than 2³² pixels.
    pub fn of(hits: &[PixelHit]) -> Self {
        let (mut begins, mut before) = (Vec::new(), Vec::new());
        let mut values: Vec<SeenTriangle> = Vec::new();
        for chunk in hits.chunks(64) {
            before.push(values.len() as u32);
            let mut word = 0;
            let mut last = None;
            for (place, hit) in chunk.iter().enumerate() {
                if last != Some(hit.seen) {
                    word |= 1 << place;
                    values.push(hit.seen);
                    last = Some(hit.seen);
                }
            }
            begins.push(word);
        }
        values.shrink_to_fit();
        Self { count: hits.len(), begins, before, values }
    }

    #[inline]
    fn get(&self, index: usize) -> SeenTriangle {
        let (chunk, place) = (index / 64, index % 64);
        // Up to and with the pixel's own bit; the first bit is always set.
        let runs = (self.begins[chunk] << (63 - place)).count_ones();
        self.values[(self.before[chunk] + runs) as usize - 1]
    }
}

/// The ray through a pixel's centre; `None` where the lens has none.
fn ray(camera: &Camera, x: usize, y: usize) -> Option<Ray> {
    let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
    let direction = camera.direction(centre)?.as_vec3();
    let origin = camera.position.as_vec3();
    Some(Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY })
}

/// What a pixel's centre sees.
pub(super) fn cast(caster: &RayCaster, camera: &Camera, x: usize, y: usize) -> PixelHit {
    let hit = |ray: Ray| -> Option<PixelHit> {
        let Hit { t, triangle, .. } = caster.closest(&ray)?;
        Some(PixelHit { position: ray.origin + ray.direction * t, seen: SeenTriangle(triangle) })
    };
    ray(camera, x, y).and_then(hit).unwrap_or(NO_HIT)
}

#[cfg(test)]
mod tests;

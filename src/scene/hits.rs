//! The visibility buffer of one photograph: for each pixel the triangle and the position that it
//! shows. If the photographs have too many pixels for this, only the triangle is kept, in runs of
//! pixels that show the same one. The position is then computed from the ray through the pixel,
//! with the same bits.

use std::sync::Arc;

use glam::{DVec2, Vec3};

use crate::geometry::bvh::{Ray, distance_to};
use crate::geometry::mesh::Mesh;
use crate::scene::Camera;

/// What the ray through a pixel's centre met.
#[derive(Clone, Copy, PartialEq)]
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
    pub fn new(triangle: Option<u32>) -> Self {
        Self(triangle.unwrap_or(NOTHING))
    }

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

    /// What a pixel sees, and where pixels end, at the latest at `end`, that see the same.
    #[inline]
    pub fn run(&self, index: usize, end: usize) -> (SeenTriangle, usize) {
        match self {
            Self::Whole(hits) => {
                let seen = hits[index].seen;
                let other = hits[index..end].iter().position(|hit| hit.seen != seen);
                (seen, other.map_or(end, |count| index + count))
            }
            Self::Packed(runs) => (runs.get(index), runs.end(index).min(end)),
        }
    }

    /// Where the ray through a pixel meets the triangle that it sees.
    #[inline]
    pub fn position(&self, camera: &Camera, mesh: &Mesh, index: usize) -> Vec3 {
        match self {
            Self::Whole(hits) => hits[index].position,
            Self::Packed(runs) => position(camera, mesh, index, runs.get(index)),
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
#[derive(Default)]
pub(super) struct Runs {
    count: usize,
    begins: Vec<u64>,
    /// The number of runs before the 64 pixels.
    before: Vec<u32>,
    values: Vec<SeenTriangle>,
}

/// Pixels whose runs end together.
pub(super) const CHUNK: usize = 64;

impl Runs {
    /// Of no more than 2³² pixels.
    pub fn of(pixels: &[SeenTriangle]) -> Self {
        let mut runs = Self { count: pixels.len(), ..Self::default() };
        for chunk in pixels.chunks(CHUNK) {
            runs.before.push(runs.values.len() as u32);
            let mut word = 0;
            let mut last = None;
            for (place, &seen) in chunk.iter().enumerate() {
                if last != Some(seen) {
                    word |= 1 << place;
                    runs.values.push(seen);
                    last = Some(seen);
                }
            }
            runs.begins.push(word);
        }
        runs.values.shrink_to_fit();
        runs
    }

    /// One after the other; all but the last are of whole chunks.
    pub fn joined(parts: Vec<Self>) -> Self {
        let sum = |of: fn(&Self) -> usize| parts.iter().map(of).sum::<usize>();
        let mut all = Self {
            count: sum(|own| own.count),
            begins: Vec::with_capacity(sum(|own| own.begins.len())),
            before: Vec::with_capacity(sum(|own| own.before.len())),
            values: Vec::with_capacity(sum(|own| own.values.len())),
        };
        for part in parts {
            let before = all.values.len() as u32;
            all.begins.extend(part.begins);
            all.before.extend(part.before.into_iter().map(|own| before + own));
            all.values.extend(part.values);
        }
        all
    }

    #[inline]
    fn get(&self, index: usize) -> SeenTriangle {
        let (chunk, place) = (index / CHUNK, index % CHUNK);
        // Up to and with the pixel's own bit; the first bit is always set.
        let runs = (self.begins[chunk] << (63 - place)).count_ones();
        self.values[(self.before[chunk] + runs) as usize - 1]
    }

    /// Where the run of a pixel ends, or the chunk.
    #[inline]
    fn end(&self, index: usize) -> usize {
        let (chunk, place) = (index / CHUNK, index % CHUNK);
        let later = self.begins[chunk] >> place >> 1;
        if later == 0 { (chunk + 1) * CHUNK } else { index + 1 + later.trailing_zeros() as usize }
    }
}

/// Where the ray through a pixel meets the triangle that it sees.
pub(super) fn position(camera: &Camera, mesh: &Mesh, index: usize, seen: SeenTriangle) -> Vec3 {
    let ray = ray(camera, index % camera.width, index / camera.width);
    match seen.triangle().zip(ray) {
        Some((triangle, ray)) => {
            let t = distance_to(&mesh.corners(triangle as usize), &ray);
            ray.origin + ray.direction * t
        }
        None => NO_HIT.position,
    }
}

/// The ray through a pixel's centre; `None` where the lens has none.
pub(super) fn ray(camera: &Camera, x: usize, y: usize) -> Option<Ray> {
    camera.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5))
}

#[cfg(test)]
mod tests;

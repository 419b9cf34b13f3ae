//! Computes the visibility buffer of one photograph by rays. Bands of rows are processed in
//! parallel, and within them the rays of squares of pixels are traced together.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::hits::{self, CHUNK, Hits, NO_HIT, PixelHit, Runs, SeenTriangle, ray};
use crate::geometry::bvh::{Beam, MOST_RAYS, Met, Ray, RayCaster};
use crate::geometry::mesh::Mesh;
use crate::scene::Camera;
use crate::watch::{Cancelled, Watch};

/// Neighbouring hits whose normals differ by more belong to different faces (20°).
const SMOOTH_COSINE: f32 = 0.94;
/// Rows of a band: of whole [`CHUNK`]s, whatever the width.
const ROWS: usize = CHUNK;
/// Side of a square of pixels.
const SIDE: usize = 8;

/// A photograph's camera before the geometry.
pub(super) struct Look<'a> {
    pub caster: &'a RayCaster,
    pub camera: &'a Camera,
    pub mesh: &'a Mesh,
    /// Unit normal of each triangle.
    pub normals: &'a [Vec3],
}

/// What the pixels of some rows see.
struct Band {
    /// The first of the rows.
    first: usize,
    /// Row by row; the position is not a number where it was not needed so far.
    hits: Vec<PixelHit>,
}

const UNKNOWN: Vec3 = Vec3::NAN;

impl Look<'_> {
    /// The visibility buffer of all pixels, packed or whole. `watch` counts the rows.
    pub fn hits(&self, is_packed: bool, watch: &Watch) -> Result<Hits, Cancelled> {
        let Camera { width, height, .. } = *self.camera;
        if is_packed {
            let runs = |band: usize| {
                let (band, own) = self.band(band, watch)?;
                let seen: Vec<SeenTriangle> = band.hits[own].iter().map(|hit| hit.seen).collect();
                Ok(Runs::of(&seen))
            };
            let bands = (0..height.div_ceil(ROWS)).into_par_iter();
            let parts: Vec<Runs> = bands.map(runs).collect::<Result<_, Cancelled>>()?;
            return Ok(Hits::Packed(Arc::new(Runs::joined(parts))));
        }
        let mut hits = vec![NO_HIT; width * height];
        let bands = hits.par_chunks_mut((ROWS * width).max(1)).enumerate();
        bands.try_for_each(|(index, hits)| {
            let (mut band, own) = self.band(index, watch)?;
            own.clone().for_each(|index| _ = band.position(self, index));
            hits.copy_from_slice(&band.hits[own]);
            Ok(())
        })?;
        Ok(Hits::Whole(hits.into()))
    }

    /// A band by its number, with a row more on either side, and its own pixels among them.
    fn band(&self, index: usize, watch: &Watch) -> Result<(Band, Range<usize>), Cancelled> {
        let Camera { width, height, .. } = *self.camera;
        let rows = index * ROWS..height.min((index + 1) * ROWS);
        // Whether a pixel is off the edges depends on the rows beside its own.
        let (first, end) = (rows.start.saturating_sub(1), height.min(rows.end + 1));
        let mut band = self.cast(first, end, watch)?;
        self.mark_clean(&mut band, rows.clone());
        rows.clone().try_for_each(|_| watch.tick())?;
        let begin = (rows.start - first) * width;
        Ok((band, begin..begin + rows.len() * width))
    }

    /// What the pixels of some rows see, none of them marked as clean.
    fn cast(&self, first: usize, end: usize, watch: &Watch) -> Result<Band, Cancelled> {
        let width = self.camera.width;
        let mut band = Band { first, hits: vec![NO_HIT; (end - first) * width] };
        for top in (first..end).step_by(SIDE) {
            let rows = SIDE.min(end - top);
            for left in (0..width).step_by(SIDE) {
                let square = Square { left, top, width: SIDE.min(width - left), height: rows };
                self.cast_square(&square, &mut band);
            }
            watch.check()?;
        }
        Ok(band)
    }

    fn cast_square(&self, square: &Square, band: &mut Band) {
        let (camera, count) = (self.camera, square.width * square.height);
        let through = |place: usize| {
            let (x, y) = square.pixel(place);
            ray(camera, x, y)
        };
        // Without a lens the rays at the corners hold the others.
        let is_straight = camera.distortion.is_none();
        let mut rays = [None; MOST_RAYS];
        let beam = if is_straight {
            self.beam(square.corners().map(through))
        } else {
            rays.iter_mut().take(count).enumerate().for_each(|(place, ray)| *ray = through(place));
            self.beam(rays.iter().take(count).copied())
        };
        let ray = |place: usize| if is_straight { through(place) } else { rays[place] };
        let mut triangles = [None; MOST_RAYS];
        let triangles = &mut triangles[..count];
        let met = if let Some(beam) = beam {
            let ray = |place| ray(place).expect("a beam is of pixels that have rays");
            self.caster.closest_of_beam(&beam, &ray, triangles)
        } else {
            for (place, triangle) in triangles.iter_mut().enumerate() {
                let hit = ray(place).and_then(|ray| self.caster.closest(&ray));
                *triangle = hit.map(|hit| hit.triangle);
            }
            Met::Each
        };
        let rows = triangles.chunks(square.width).zip(square.top..);
        for (triangles, y) in rows {
            let first = (y - band.first) * camera.width + square.left;
            let row = &mut band.hits[first..first + square.width];
            for (hit, own) in row.iter_mut().zip(triangles) {
                let triangle = if let Met::One(triangle) = met { triangle } else { *own };
                if triangle.is_some() {
                    *hit = PixelHit { position: UNKNOWN, seen: SeenTriangle::new(triangle) };
                }
            }
        }
    }

    /// The beam of some rays, if all of them are rays.
    fn beam(&self, rays: impl IntoIterator<Item = Option<Ray>>) -> Option<Beam> {
        let mut is_whole = true;
        let directions = rays.into_iter().map_while(|ray| {
            is_whole &= ray.is_some();
            ray.map(|ray| ray.direction)
        });
        let beam = Beam::of(self.camera.position.as_vec3(), directions);
        beam.filter(|_| is_whole)
    }

    /// Marks the pixels of some rows off every edge by a pixel.
    fn mark_clean(&self, band: &mut Band, rows: Range<usize>) {
        let Camera { width, height, .. } = *self.camera;
        for y in rows.start.max(1)..rows.end.min(height.saturating_sub(1)) {
            for x in 1..width.saturating_sub(1) {
                let index = (y - band.first) * width + x;
                let Some(triangle) = band.hits[index].seen.triangle() else { continue };
                let is_one = [index - width, index, index + width].into_iter().all(|middle| {
                    let around = &band.hits[middle - 1..=middle + 1];
                    around.iter().all(|hit| hit.seen.triangle() == Some(triangle))
                });
                if is_one || self.is_clean(band, index, triangle) {
                    band.hits[index].seen.mark_clean();
                }
            }
        }
    }

    /// Whether the nine hits around a pixel that sees a triangle lie on one smooth piece of one
    /// surface.
    fn is_clean(&self, band: &mut Band, index: usize, triangle: u32) -> bool {
        let (mesh, width, triangle) = (self.mesh, self.camera.width, triangle as usize);
        let mut around = [None; 9];
        for (place, around) in around.iter_mut().enumerate() {
            let other = index + place / 3 * width + place % 3 - width - 1;
            let Some(neighbour) = band.hits[other].seen.triangle() else { return false };
            if mesh.surface[neighbour as usize] != mesh.surface[triangle] {
                return false;
            }
            *around = Some((other, neighbour as usize));
        }
        let position = band.position(self, index);
        let sight = position - self.camera.position.as_vec3();
        let footprint = sight.length() / self.camera.focal_px.as_vec2().min_element();
        let direction = sight.normalize_or_zero();
        let facing = |triangle: usize| {
            let normal = self.normals[triangle];
            if normal.dot(direction) > 0.0 { -normal } else { normal }
        };
        let normal = facing(triangle);
        let steepness = normal.dot(direction).abs().max(0.02);
        around.into_iter().flatten().all(|(other, neighbour)| {
            if neighbour == triangle {
                return true;
            }
            // Both sides of a thin sheet, or two steps of a stair, are different faces:
            // compare normals as seen, and depth against this pixel's tangent plane.
            if facing(neighbour).dot(normal) <= SMOOTH_COSINE {
                return false;
            }
            let off_plane = normal.dot(band.position(self, other) - position).abs() / steepness;
            off_plane <= footprint
        })
    }
}

impl Band {
    /// Where the ray through a pixel of the band meets what it sees.
    fn position(&mut self, look: &Look, index: usize) -> Vec3 {
        let PixelHit { position, seen } = self.hits[index];
        if !position.is_nan() {
            return position;
        }
        let of_image = self.first * look.camera.width + index;
        let position = hits::position(look.camera, look.mesh, of_image, seen);
        self.hits[index].position = position;
        position
    }
}

/// Some pixels beside and below each other, counted row by row.
struct Square {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl Square {
    fn pixel(&self, place: usize) -> (usize, usize) {
        (self.left + place % self.width, self.top + place / self.width)
    }

    /// The pixels at the corners.
    fn corners(&self) -> [usize; 4] {
        let last = self.width * self.height - 1;
        [0, self.width - 1, last + 1 - self.width, last]
    }
}

#[cfg(test)]
mod tests;

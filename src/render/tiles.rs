//! Parts of a pass that a tracer without access to the films traces by itself, and the addition of
//! their sums to the films.

use std::ops::Range;

use rayon::prelude::*;

use crate::math::rgb::CHANNELS;
use crate::render::film::{STRIP, SURFACE_STRIDE, SurfaceFilm};
use crate::render::{Exposure, Pass};

/// Paths through pixels that have the same number of paths so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// In the order of memory, whole strips.
    pub pixels: Range<usize>,
    /// Numbers of the paths of every pixel.
    pub paths: Range<usize>,
    /// The first of them whose surfaces are not known yet.
    pub surfaces_from: usize,
}

/// What is summed of the surfaces beside light: albedo and distance, normal and known, object.
const SURFACE_SUMS: usize = 3;

impl Tile {
    /// Groups of four sums per pixel: of `layers` and of direct light red, green, blue and the
    /// brightness of odd paths, then albedo and distance, normal and whether anything is known, and
    /// whether it is of an object.
    pub fn sums(layers: usize) -> usize {
        layers + 1 + SURFACE_SUMS
    }
}

impl Pass<'_> {
    /// The next tile of at most so many pixels, or of one strip; `None` when the pass is done.
    pub fn next_tile(
        &self,
        surfaces: &SurfaceFilm,
        exposures: &[Exposure],
        most_pixels: usize,
    ) -> Option<Tile> {
        let done = exposures.first()?.film.strips();
        let seen = surfaces.strips();
        let first = done.iter().position(|&paths| (paths as usize) < self.upto)?;
        let same = |strip: &usize| (done[*strip], seen[*strip]) == (done[first], seen[first]);
        let most = (most_pixels / STRIP).max(1);
        let strips = (first..done.len()).take_while(same).take(most).count();
        let pixels = self.camera.width * self.camera.height;
        Some(Tile {
            pixels: first * STRIP..((first + strips) * STRIP).min(pixels),
            paths: done[first] as usize..self.upto,
            surfaces_from: seen[first] as usize,
        })
    }

    /// Adds the sums of a tile: per group of [`Tile::sums`] one entry for each pixel.
    pub fn add(
        &self,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        tile: &Tile,
        sums: &[[f32; 4]],
    ) {
        let (layers, count) = (self.scene.layers, tile.pixels.len());
        assert_eq!(sums.len(), count * Tile::sums(layers), "a sum for each pixel and group");
        let group = |index: usize| &sums[index * count..(index + 1) * count];
        let strips = tile.pixels.start / STRIP..tile.pixels.end.div_ceil(STRIP);
        for Exposure { film, layers } in exposures {
            let (stride, summed) = (film.layers() * CHANNELS + 1, film.summed());
            let parts: Vec<_> = film.strips_mut().collect();
            let parts =
                parts.into_par_iter().enumerate().filter(|(strip, _)| strips.contains(strip));
            parts.for_each(|(strip, (paths, values))| {
                let first = strip * STRIP - tile.pixels.start;
                for (within, pixel) in values.chunks_exact_mut(stride).enumerate() {
                    for (place, layer) in layers.clone().enumerate() {
                        let [r, g, b, odd] = group(layer)[first + within];
                        for (value, sum) in pixel[CHANNELS * place..].iter_mut().zip([r, g, b]) {
                            *value += sum;
                        }
                        if place < summed {
                            pixel[stride - 1] += odd;
                        }
                    }
                }
                *paths = tile.paths.end as u32;
            });
        }
        let surface = [0, 1, 2].map(|index| group(layers + 1 + index));
        for (strip, (paths, values)) in surfaces.strips_mut().enumerate() {
            if !strips.contains(&strip) || *paths as usize >= tile.paths.end {
                continue;
            }
            let first = strip * STRIP - tile.pixels.start;
            for (within, pixel) in values.chunks_exact_mut(SURFACE_STRIDE).enumerate() {
                let [albedo, normal, object] = surface.map(|sums| sums[first + within]);
                let [r, g, b, distance] = albedo;
                let [x, y, z, known] = normal;
                let found = [r, g, b, x, y, z, distance, known, object[0]];
                for (value, sum) in pixel.iter_mut().zip(found) {
                    *value += sum;
                }
            }
            *paths = tile.paths.end as u32;
        }
    }
}

//! Textures with texels smaller than the pixels of the photographs.
//!
//! Eq. 13 uses, for each texel, the pixel in which its centre lies. The texture is therefore
//! blurred by the size of a pixel, and a picture that is rendered from it is blurred a second time.
//! This module computes texels whose mean over every pixel is the value that the pixel measured, by
//! the simultaneous iterative reconstruction technique (Gilbert 1972). It starts with the mean of
//! the pixels that show a texel, and is stopped early so that it does not amplify the noise of
//! single pixels.

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::lattice_step;
use crate::reconstruct::unwrap::Unwrap;
use crate::scene::Views;
use crate::scene::views::VisibilityBuffer;
use crate::watch::{Cancelled, Watch};

/// A pixel that shows nothing but the surface.
#[derive(Clone, Copy)]
struct Pixel {
    /// Where its centre is in the texture, in texels; 0 is the middle of the first one.
    middle: Vec2,
    /// What one pixel to the right and one down is there.
    right: Vec2,
    down: Vec2,
    radiance: Radiance,
}

/// Places within a pixel along a side at most, where it covers many texels.
const MOST_PLACES: f32 = 6.0;
/// Pixels that are held at most, unless the map has so many texels that it needs more.
const MOST_PIXELS: usize = 1 << 23;
const PIXELS_PER_TEXEL: usize = 8;
/// Parts of the pixels that are added up apart, whatever the number of threads.
const PARTS: usize = 4;

/// Radiance that every texel sends (Eq. 13 before the division by irradiance), from `start`, the
/// same by the pixel at its middle; texels without one are left out. Row by row from the top.
pub(super) fn sharpen(
    views: &Views,
    unwrap: &Unwrap,
    start: Vec<Option<Radiance>>,
    rounds: usize,
    watch: &Watch,
) -> Result<Vec<Option<Radiance>>, Cancelled> {
    let most = most_pixels(start.len());
    let pixels = pixels(views, unwrap, most, watch)?;
    let mut texels = Vec::new();
    let mut entry = |texel: &Option<Radiance>| {
        texel.map_or(NONE, |texel| {
            texels.push(texel);
            texels.len() as u32 - 1
        })
    };
    let entry = start.iter().map(&mut entry).collect();
    let grid = Grid { width: unwrap.width, entry, count: texels.len() };
    let share = grid.spread(&pixels, &|_, _| [1.0; CHANNELS], watch)?;
    let measured = grid.spread(&pixels, &|pixel, _| pixel.radiance, watch)?;
    let told = |share: &Radiance| share[0] > LEAST_SHARE;
    for ((texel, sum), share) in texels.iter_mut().zip(measured).zip(&share) {
        if told(share) {
            *texel = sum.map(|sum| sum / share[0]);
        }
    }
    for _ in 0..rounds {
        let missing = |pixel: &Pixel, shown: &[(usize, f32)]| {
            let mut missing = pixel.radiance;
            for &(index, part) in shown {
                for (missing, texel) in missing.iter_mut().zip(texels[index]) {
                    *missing -= part * texel;
                }
            }
            missing
        };
        let missing = grid.spread(&pixels, &missing, watch)?;
        for ((texel, sum), share) in texels.iter_mut().zip(missing).zip(&share) {
            if told(share) {
                *texel = std::array::from_fn(|c| (texel[c] + sum[c] / share[0]).max(0.0));
            }
        }
    }
    let texel = |&entry: &u32| (entry != NONE).then(|| texels[entry as usize]);
    Ok(grid.entry.iter().map(texel).collect())
}

/// Pixels that are held at most for a map of so many texels.
pub fn most_pixels(texels: usize) -> usize {
    MOST_PIXELS.max(texels.saturating_mul(PIXELS_PER_TEXEL))
}

/// Pixels, in sum, that have to show a texel for it to follow from them.
const LEAST_SHARE: f32 = 1e-3;

/// Something of a pixel, given the texels that it shows and their parts of it.
type Value<'a> = dyn Fn(&Pixel, &[(usize, f32)]) -> Radiance + Sync + 'a;

/// The texels of a map of which something is known.
struct Grid {
    width: usize,
    /// Per texel of the map its number among these, or `NONE`.
    entry: Vec<u32>,
    count: usize,
}

const NONE: u32 = u32::MAX;

impl Grid {
    /// The texels that a pixel shows, and what part of it each fills; the parts add up to 1.
    fn shown(&self, pixel: &Pixel, texels: &mut Vec<(usize, f32)>) {
        texels.clear();
        let places = |step: Vec2| step.abs().max_element().ceil().clamp(1.0, MOST_PLACES);
        let (across, along) = (places(pixel.right), places(pixel.down));
        let height = self.entry.len() / self.width;
        for row in 0..along as usize {
            for column in 0..across as usize {
                let right = (column as f32 + 0.5) / across - 0.5;
                let down = (row as f32 + 0.5) / along - 0.5;
                let place = pixel.middle + right * pixel.right + down * pixel.down;
                let (low, part) = (place.floor(), place - place.floor());
                let rest = 1.0 - part;
                for (x, y, weight) in [
                    (0.0, 0.0, rest.x * rest.y),
                    (1.0, 0.0, part.x * rest.y),
                    (0.0, 1.0, rest.x * part.y),
                    (1.0, 1.0, part.x * part.y),
                ] {
                    let (x, y) = (low.x + x, low.y + y);
                    if x < 0.0 || y < 0.0 || x >= self.width as f32 || y >= height as f32 {
                        continue;
                    }
                    let entry = self.entry[y as usize * self.width + x as usize];
                    if entry != NONE {
                        texels.push((entry as usize, weight));
                    }
                }
            }
        }
        let sum: f32 = texels.iter().map(|(_, weight)| weight).sum();
        if sum <= 0.0 {
            texels.clear();
        }
        texels.iter_mut().for_each(|(_, weight)| *weight /= sum);
    }

    /// Per texel the sum over the pixels that show it of a value of theirs, by that part.
    fn spread(
        &self,
        pixels: &[Pixel],
        value: &Value,
        watch: &Watch,
    ) -> Result<Vec<Radiance>, Cancelled> {
        let sums = pixels
            .par_chunks(pixels.len().div_ceil(PARTS).max(1))
            .map(|pixels| {
                watch.check()?;
                let mut sums = vec![[0.0; CHANNELS]; self.count];
                let mut shown = Vec::new();
                for pixel in pixels {
                    self.shown(pixel, &mut shown);
                    let value = value(pixel, &shown);
                    for &(index, part) in &shown {
                        for (sum, value) in sums[index].iter_mut().zip(value) {
                            *sum += part * value;
                        }
                    }
                }
                Ok(sums)
            })
            .collect::<Result<Vec<_>, Cancelled>>()?;
        let mut total = vec![[0.0; CHANNELS]; self.count];
        for sums in sums {
            for (total, sum) in total.iter_mut().flatten().zip(sums.iter().flatten()) {
                *total += sum;
            }
        }
        Ok(total)
    }
}

/// Every pixel of every photograph that measures nothing but the surface; where they are more than
/// `most`, a lattice of them in each photograph.
fn pixels(
    views: &Views,
    unwrap: &Unwrap,
    most: usize,
    watch: &Watch,
) -> Result<Vec<Pixel>, Cancelled> {
    let mut entry = vec![None; views.capture.mesh.triangles.len()];
    for (index, &triangle) in unwrap.triangles.iter().enumerate() {
        entry[triangle] = Some(index);
    }
    let on_surface = |buffer: &VisibilityBuffer, x: usize, y: usize| {
        let triangle = buffer.triangle(x, y).filter(|_| buffer.is_off_edges(x, y))?;
        Some((triangle, entry[triangle as usize]?))
    };
    let mut step = 1;
    let all: usize = views.buffers.iter().map(|own| own.camera.width * own.camera.height).sum();
    if all > most {
        let of_row = |buffer: &VisibilityBuffer, y: usize| {
            (0..buffer.camera.width).filter(|x| on_surface(buffer, *x, y).is_some()).count()
        };
        let of_photograph = |buffer: &VisibilityBuffer| -> usize {
            (0..buffer.camera.height).into_par_iter().map(|y| of_row(buffer, y)).sum()
        };
        let count: usize = views.buffers.iter().map(of_photograph).sum();
        step = lattice_step(count, most);
    }
    let mut pixels = Vec::new();
    for buffer in &views.buffers {
        let width = buffer.camera.width;
        let lines: Vec<usize> = (0..buffer.camera.height).step_by(step).collect();
        let rows = lines.into_par_iter().map(|y| {
            watch.check()?;
            let pixel = |x: usize| {
                let (triangle, index) = on_surface(buffer, x, y)?;
                let radiance = buffer.image.radiance(x, y)?;
                let plane = Plane::new(views, unwrap, triangle as usize, index)?;
                let place = |dx: f64, dy: f64| plane.texel(buffer, x as f64 + dx, y as f64 + dy);
                let middle = place(0.5, 0.5)?;
                let right = place(1.0, 0.5)? - place(0.0, 0.5)?;
                let down = place(0.5, 1.0)? - place(0.5, 0.0)?;
                Some(Pixel { middle, right, down, radiance })
            };
            Ok((0..width).step_by(step).filter_map(pixel).collect::<Vec<_>>())
        });
        let rows = rows.collect::<Result<Vec<_>, Cancelled>>()?;
        pixels.extend(rows.into_iter().flatten());
        buffer.image.release();
    }
    Ok(pixels)
}

/// A triangle's plane with texture coordinates that go on beyond its edges.
struct Plane {
    corner: Vec3,
    normal: Vec3,
    /// Texels per metre along the plane.
    gradients: [Vec3; 2],
    origin: Vec2,
}

impl Plane {
    /// `None` for a triangle without area.
    fn new(views: &Views, unwrap: &Unwrap, triangle: usize, index: usize) -> Option<Self> {
        let size = Vec2::new(unwrap.width as f32, unwrap.height as f32);
        // Rows from the top.
        let [a, b, c] = unwrap.corners[index].map(|uv| Vec2::new(uv.x, 1.0 - uv.y) * size - 0.5);
        let [p, q, r] = views.capture.mesh.corners(triangle);
        let (u, v) = (q - p, r - p);
        let normal = u.cross(v);
        let squared = normal.length_squared();
        if squared < 1e-24 {
            return None;
        }
        // Gradients of the barycentric coordinates of q and r.
        let (of_q, of_r) = (v.cross(normal) / squared, normal.cross(u) / squared);
        let gradient = |b: f32, c: f32| of_q * b + of_r * c;
        let (b, c) = (b - a, c - a);
        Some(Self {
            corner: p,
            normal: views.normals[triangle],
            gradients: [gradient(b.x, c.x), gradient(b.y, c.y)],
            origin: a,
        })
    }

    /// Where a position in a photograph is in the texture, in texels.
    fn texel(&self, buffer: &VisibilityBuffer, x: f64, y: f64) -> Option<Vec2> {
        let direction = buffer.camera.direction(DVec2::new(x, y))?.as_vec3();
        let eye = buffer.camera.position.as_vec3() - self.corner;
        let along = -eye.dot(self.normal) / direction.dot(self.normal);
        let place = eye + along * direction;
        let [u, v] = self.gradients.map(|gradient| gradient.dot(place));
        (along > 0.0 && along.is_finite()).then(|| self.origin + Vec2::new(u, v))
    }
}

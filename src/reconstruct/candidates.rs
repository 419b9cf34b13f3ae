//! The pixels from which samples are chosen (Section 4.1).
//!
//! There are millions of pixels and thousands of samples. A random subset of the pixels, still many
//! times as many as the samples, is therefore enough.

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::TooManyPoints;
use crate::math::sampling::Random;
use crate::reconstruct::Stream;
use crate::scene::views::Run;
use crate::scene::{Optics, Role, SurfacePoint, Views};

/// The conditions on the pixels.
pub(super) struct Wanted<'a> {
    pub min_cosine: f64,
    /// Samples that are aimed at.
    pub samples: usize,
    pub seed: u64,
    /// Whether pixels of a material, by its index, are wanted.
    pub of_material: &'a (dyn Fn(usize) -> bool + Sync),
}

/// A pixel that could become a sample. There are millions, so only its place is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Candidate {
    /// Index into `Views::buffers`.
    pub buffer: u32,
    /// Pixels before it, row by row.
    pixel: u32,
}

impl Candidate {
    pub fn new(buffer: usize, pixel: usize) -> Result<Self, TooManyPoints> {
        let index = |number: usize| u32::try_from(number).map_err(|_| TooManyPoints(number));
        Ok(Self { buffer: index(buffer)?, pixel: index(pixel)? })
    }

    /// The position and the triangle that the pixel shows.
    pub fn hit(self, views: &Views) -> (Vec3, u32) {
        let buffer = &views.buffers[self.buffer as usize];
        let (pixel, width) = (self.pixel as usize, buffer.camera.width);
        buffer.hit(pixel % width, pixel / width).expect("candidates show something")
    }

    /// The surface point that the pixel shows, on the side that faces the camera.
    pub fn point(self, views: &Views) -> SurfacePoint {
        let (position, triangle) = self.hit(views);
        let camera = views.buffers[self.buffer as usize].camera.position.as_vec3();
        views.side(position, triangle, camera - position)
    }

    fn triangle(self, views: &Views) -> u32 {
        let buffer = &views.buffers[self.buffer as usize];
        let (pixel, width) = (self.pixel as usize, buffer.camera.width);
        buffer.triangle(pixel % width, pixel / width).expect("candidates show something")
    }
}

/// The material of each candidate.
pub(super) fn materials(views: &Views, candidates: &[Candidate]) -> Vec<u32> {
    candidates.par_iter().map(|candidate| material_of(views, *candidate) as u32).collect()
}

pub(super) fn material_of(views: &Views, candidate: Candidate) -> usize {
    let triangle = candidate.triangle(views);
    match views.capture.surfaces[views.capture.mesh.surface[triangle as usize] as usize].role {
        Role::Material(material) => material,
        _ => unreachable!("candidates lie on surfaces with a material"),
    }
}

/// Every pixel that measures a surface with a material, photograph by photograph, row by row; of a
/// material that shows in more than [`thinned`] keeps, a random part of them.
pub(super) fn find(
    views: &Views,
    wanted: &Wanted,
    off_edges: bool,
) -> Result<Vec<Candidate>, TooManyPoints> {
    let capture = views.capture;
    let material = |run: &Run| {
        let usable =
            views.optics(run.triangle) == Optics::Opaque && (!off_edges || run.is_off_edges);
        capture.material_of(run.triangle).filter(|&own| usable && (wanted.of_material)(own))
    };
    let kept = thinned(views, wanted.samples, &material);
    let mut candidates = Vec::new();
    for (index, buffer) in views.buffers.iter().enumerate() {
        let camera = buffer.camera.position.as_vec3();
        let (width, height) = (buffer.camera.width, buffer.camera.height);
        Candidate::new(index, width * height)?;
        let (material, kept) = (&material, &kept);
        candidates.par_extend((0..height).into_par_iter().flat_map_iter(|y| {
            let pixel = move |x, triangle, kept: Option<u32>| {
                let pixel = y * width + x;
                if kept.is_some_and(|kept| hash(wanted.seed, index, pixel) >= kept) {
                    return None;
                }
                buffer.image.radiance(x, y)?;
                let (position, _) = buffer.hit(x, y)?;
                let sight = (camera - position).normalize_or_zero();
                let cosine = views.normals[triangle as usize].dot(sight).abs();
                if f64::from(cosine) < wanted.min_cosine {
                    return None;
                }
                // Smaller than the number of pixels, which was found to fit.
                Candidate::new(index, pixel).ok()
            };
            let of_run = move |run: Run| {
                let material = material(&run)?;
                let kept = kept.as_ref().map(|kept| kept[material]);
                Some(run.columns.filter_map(move |x| pixel(x, run.triangle, kept)))
            };
            buffer.runs(y).filter_map(of_run).flatten()
        }));
        buffer.image.release();
    }
    Ok(candidates)
}

/// Candidates that are held at most, where that is many times the number of samples.
const MOST_CANDIDATES: usize = 1 << 24;
/// Candidates for each sample then, at least.
const CANDIDATES_PER_SAMPLE: usize = 32;

/// Candidates that are held at most for so many samples.
pub(super) fn most_candidates(samples: usize) -> usize {
    MOST_CANDIDATES.max(samples.saturating_mul(CANDIDATES_PER_SAMPLE))
}

/// Per material up to which [`hash`] its pixels become candidates; `None` where all do, since there
/// are not too many. Materials that show in few pixels keep all of theirs: the others share what
/// is left evenly.
fn thinned(
    views: &Views,
    samples: usize,
    material: &(dyn Fn(&Run) -> Option<usize> + Sync),
) -> Option<Vec<u32>> {
    let most = most_candidates(samples);
    let pixels: usize = views.buffers.iter().map(|own| own.camera.width * own.camera.height).sum();
    if pixels <= most {
        return None;
    }
    let none = || vec![0usize; views.capture.materials.len()];
    let add = |mut all: Vec<usize>, own: Vec<usize>| {
        all.iter_mut().zip(own).for_each(|(all, own)| *all += own);
        all
    };
    let mut counts = none();
    for buffer in &views.buffers {
        let of_row = |mut counts: Vec<usize>, y: usize| {
            for run in buffer.runs(y) {
                if let Some(material) = material(&run) {
                    counts[material] += run.columns.len();
                }
            }
            counts
        };
        let rows = (0..buffer.camera.height).into_par_iter();
        counts = add(counts, rows.fold(none, of_row).reduce(none, add));
    }
    shares(&counts, most)
}

/// Of so many pixels per material, the part of `u32::MAX` that is kept, if all that are kept are to
/// be no more than `most`; `None` where they are not.
fn shares(counts: &[usize], most: usize) -> Option<Vec<u32>> {
    if counts.iter().sum::<usize>() <= most {
        return None;
    }
    let mut sorted = counts.to_vec();
    sorted.sort_unstable();
    // The number that each material may keep grows while those that have fewer leave some over.
    let (mut rest, mut each) = (most, 0);
    for (place, &count) in sorted.iter().enumerate() {
        each = rest / (sorted.len() - place);
        if count > each {
            break;
        }
        rest -= count;
    }
    let share = |&count: &usize| {
        let part = each as f64 / count.max(1) as f64;
        if part >= 1.0 { u32::MAX } else { (part * f64::from(u32::MAX)) as u32 }
    };
    Some(counts.iter().map(share).collect())
}

/// A number that looks random, of a pixel.
fn hash(seed: u64, buffer: usize, pixel: usize) -> u32 {
    let index = (buffer as u64) << 32 | pixel as u64;
    (Random::new(seed, Stream::Candidates as u64, index).next_u64() >> 32) as u32
}

#[cfg(test)]
mod tests;

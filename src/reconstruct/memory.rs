//! The peak memory of a run, estimated before it begins.
//!
//! All numbers are bytes, and upper bounds for captures like those that they were measured on
//! (the guide's page on speed has the measurements): a machine that has as much can do the run.

use super::candidates::most_candidates;
use super::checks::{LOWER_JOINT, LOWER_PAPER, SolveSize};
use super::textures::sharpen;
use super::{Error, Method, Options, Stage, in_front};
use crate::scene::views::WHOLE_PIXELS;
use crate::scene::{Capture, MaterialKind};

/// The program with its threads, and results.
const PROGRAM: u64 = 96 << 20;
/// A triangle of the mesh with its corners and normal, and in the tree of the ray caster.
const TRIANGLE: u64 = 240;
/// The same while the tree is built.
const TRIANGLE_BUILT: u64 = 320;
/// The visibility of one pixel, whole and packed (in runs), and the memory beside that of the
/// photograph that is looked at.
const HIT: u64 = 16;
const HIT_FOUND: u64 = 18;
const PACKED_HIT: u64 = 1;
const PACKED_HIT_FOUND: u64 = 3;
/// A pixel while its photograph is read.
const READ: u64 = 20;
/// A candidate for a sample, with its place in the order, its position and its material, and what
/// comparing them takes.
const CANDIDATE: u64 = 40;
/// A pixel while a texture is sharpened: itself, and in the list of its row.
const SHARPENED: u64 = 80;
/// A texel of a texture, with where it lies and what shows it.
const TEXEL: u64 = 160;

/// How to reduce the memory if there are too many pixels.
const SMALLER: &str = "leave photographs out, or give smaller ones, with w, h and the intrinsics of \
    their cameras";

/// Bytes of memory that a run takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryNeed {
    /// The mesh and those photographs that are in memory, which are there before the run.
    pub loaded: u64,
    /// Photographs that are kept in files, of which memory holds as much as there is room for; it
    /// is in none of the sums.
    pub in_files: u64,
    /// Memory for reading the photographs, beside the photographs themselves.
    pub loading: u64,
    /// Memory that is held during the whole run.
    pub held: u64,
    /// Memory of each of [`Stage::ALL`], beside these.
    pub stages: [u64; 5],
}

impl MemoryNeed {
    /// Of a run of this capture on as many threads as there are.
    pub fn of(capture: &Capture, options: &Options) -> Self {
        Self::on_threads(capture, options, rayon::current_num_threads())
    }

    /// As [`Self::of`], on so many threads.
    pub fn on_threads(capture: &Capture, options: &Options, threads: usize) -> Self {
        let sizes = || capture.measurements().map(|(_, camera, _)| camera.width * camera.height);
        let (pixels, largest) = (sizes().sum::<usize>(), sizes().max().unwrap_or(0) as u64);
        let triangles = capture.mesh.triangles.len() as u64;
        let in_memory: usize =
            capture.measurements().map(|(_, _, image)| image.memory_bytes()).sum();
        let all: usize = capture.measurements().map(|(_, _, image)| image.byte_count()).sum();
        let (hit, hit_found) =
            if pixels > WHOLE_PIXELS { (PACKED_HIT, PACKED_HIT_FOUND) } else { (HIT, HIT_FOUND) };

        let candidates = pixels.min(most_candidates(options.samples.count)) as u64;
        let found = largest * hit_found + triangles * TRIANGLE_BUILT;
        let textured: Vec<usize> = capture
            .materials
            .iter()
            .filter(|material| material.textured && options.textures.enabled)
            .map(|material| material.surfaces.len())
            .collect();
        let texels = options.textures.max_side.pow(2).min(pixels) as u64;
        let sharpened = pixels.min(sharpen::most_pixels(texels as usize)) as u64;
        let textures = if textured.is_empty() {
            0
        } else {
            let surfaces = textured.iter().sum::<usize>() as u64;
            // Of those that are done the texels alone are held.
            sharpened * SHARPENED + texels * TEXEL + surfaces * texels.min(pixels as u64) * 13
        };
        let solve = u64::try_from(solve(capture, options, threads)).unwrap_or(u64::MAX);
        let mut stages = [0; 5];
        let compared = in_front::compared_pixels(sizes().count()).min(pixels) as u64;
        let compared = if options.samples.omit_unmodelled { compared } else { 0 };
        stages[Stage::Samples as usize] =
            found.max(candidates * CANDIDATE).max(compared * in_front::PIXEL_BYTES);
        stages[Stage::Solve as usize] = solve;
        stages[Stage::Textures as usize] = textures;
        Self {
            loaded: PROGRAM + triangles * 60 + in_memory as u64,
            in_files: (all - in_memory) as u64,
            loading: largest * READ * threads.min(sizes().count()) as u64,
            held: triangles * (TRIANGLE - 60) + pixels as u64 * hit,
            stages,
        }
    }

    /// All that the program takes when it takes most.
    pub fn peak(&self) -> u64 {
        self.loaded.saturating_add(self.more().max(self.loading))
    }

    /// What is still to be taken when the capture is there.
    pub fn more(&self) -> u64 {
        self.held.saturating_add(self.stages.into_iter().max().unwrap_or(0))
    }

    /// The stage that takes most.
    pub fn largest(&self) -> Stage {
        let largest = Stage::ALL.into_iter().max_by_key(|stage| self.stages[*stage as usize]);
        largest.unwrap_or(Stage::Samples)
    }

    /// Whether so many bytes are enough for it.
    ///
    /// # Errors
    /// `Error::Memory` where they are not, with what to change.
    pub fn check(&self, available: u64, method: Method) -> Result<(), Error> {
        if self.more() <= available {
            return Ok(());
        }
        let stage = self.largest();
        let is_of_pixels = self.held > self.stages[stage as usize] || stage == Stage::Samples;
        let lower = match (stage, method) {
            _ if is_of_pixels => SMALLER.to_owned(),
            (Stage::Textures, _) => {
                "lower textures.max_side, or raise textures.texel_px".to_owned()
            }
            (_, Method::Joint) => format!("lower {LOWER_JOINT}"),
            (_, Method::Paper) => format!("lower {LOWER_PAPER}"),
        };
        let (needed, available) = (gigabytes(self.more()), gigabytes(available));
        Err(Error::Memory { needed, available, stage: stage.name(), lower })
    }
}

/// Bytes in words: "1.2 GB", in units of 2³⁰ bytes.
pub fn gigabytes(bytes: u64) -> String {
    format!("{:.1} GB", bytes as f64 / (1u64 << 30) as f64)
}

/// What the solve takes, of the samples that are aimed at and of the lights that there may be.
fn solve(capture: &Capture, options: &Options, threads: usize) -> u128 {
    let materials = capture.materials.len().max(1);
    let specular = capture.materials.iter().filter(|own| own.kind != MaterialKind::Diffuse).count();
    let samples = options.samples.count + materials * options.samples.min_per_material;
    let views = options.gloss.views_per_sample.min(capture.photographs.len()).max(1);
    let rows = samples + samples * specular / materials * (views - 1);
    let (lobes, light_sets) = match options.general.method {
        Method::Joint => (options.joint.largest_set(), options.joint.light_sets),
        Method::Paper => (options.lights.count * options.lobes.grid * options.lobes.grid / 2, 1),
    };
    SolveSize { samples, rows, lobes, light_sets, threads }.peak_bytes()
}

#[cfg(test)]
mod tests;

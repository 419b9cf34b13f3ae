//! Checks before and during a run, and warnings about its result.

use crate::math::rgb::CHANNELS;
use crate::math::sampling::lattice_step;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::reconstruct::{Error, Method, Options};
use crate::scene::{Capture, KnownLight, Optics, Views};

/// Start values are those of materials that there are.
pub(super) fn check_start(capture: &Capture, options: &Options) -> Result<(), Error> {
    for material in options.start.keys() {
        if !capture.materials.iter().any(|m| m.name == *material) {
            let known: Vec<_> = capture.materials.iter().map(|m| m.name.as_str()).collect();
            return Err(Error::UnknownStart {
                material: material.clone(),
                known: known.join(", "),
            });
        }
    }
    Ok(())
}

/// The memory that a solve will take.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolveSize {
    pub samples: usize,
    /// Equations: a specular sample has one for each photograph that is used.
    pub rows: usize,
    /// Columns of the coupling.
    pub lobes: usize,
    /// Solved one beside the other, as far as there are threads; 1 for the paper's method.
    pub light_sets: usize,
    /// Threads that the solve may use.
    pub threads: usize,
}

impl SolveSize {
    /// Bytes held at the peak, in every matrix with an entry for each row and lobe. Every light set
    /// that is under way has its coupling (f64) with the f32 rows that it is made from, and what is
    /// multiplied by unknowns: the same again where specular samples have rows of their own. Every
    /// channel that is being solved has a copy weighted by its slopes (the Jacobian), and the
    /// products of its columns with each other.
    pub(super) fn peak_bytes(&self) -> u128 {
        let entries = |rows: usize| rows as u128 * self.lobes as u128;
        let (single, double) = (size_of::<f32>() as u128, size_of::<f64>() as u128);
        let light_sets = self.light_sets.min(self.threads).max(1);
        let channels = (CHANNELS * light_sets).min(self.threads.max(1));
        let design = if self.rows > self.samples { entries(self.rows) * double } else { 0 };
        let coupling = entries(self.samples) * (single + double) + design;
        let jacobian = (entries(self.rows) + entries(self.lobes)) * double;
        light_sets as u128 * coupling + channels as u128 * jacobian
    }
}

/// Whether a solve fits into memory. `lower` names the options that make it smaller.
pub(super) fn check_size(size: &SolveSize, lower: &'static str) -> Result<(), Error> {
    let bytes = size.peak_bytes();
    if bytes > LARGEST_SOLVE {
        let SolveSize { samples, lobes, .. } = *size;
        let gigabytes = bytes.div_ceil(1 << 30);
        return Err(Error::TooLarge { samples, lobes, gigabytes, lower });
    }
    Ok(())
}

/// Bytes; many times what a scene needs, and still within a workstation's memory.
const LARGEST_SOLVE: u128 = 16 << 30;

/// What makes the joint solve smaller.
pub(super) const LOWER_JOINT: &str = "samples.count (or raise samples.spacing_m), \
    joint.light_sets, gloss.views_per_sample or joint.fine_grid (or raise joint.fine_spacing)";
/// What makes the paper's solve smaller.
pub(super) const LOWER_PAPER: &str = "samples.count (or raise samples.spacing_m), \
    gloss.views_per_sample, lights.count or lobes.grid";

/// Pixels of a photograph that are checked, evenly spread.
const MOST_PIXELS: usize = 1 << 20;

/// Warnings about photographs that do not match the geometry.
pub(super) fn of_photographs(views: &Views) -> Vec<String> {
    let mut warnings = Vec::new();
    for buffer in &views.buffers {
        let name = &views.capture.photographs[buffer.photograph].name;
        let (camera, position) = (buffer.camera, buffer.camera.position.as_vec3());
        let (mut shown, mut inner) = (0usize, 0usize);
        let pixels = camera.width * camera.height;
        let step = lattice_step(pixels, MOST_PIXELS);
        let column = |y: usize| (0..camera.width).step_by(step).map(move |x| (x, y));
        for (x, y) in (0..camera.height).step_by(step).flat_map(column) {
            if let Some((hit, triangle)) = buffer.hit(x, y) {
                shown += 1;
                let normal = views.normals[triangle as usize];
                inner += usize::from(normal.dot(hit - position) > 0.0);
            }
        }
        if !buffer.shows_anything() {
            warnings.push(format!(
                "{name} shows none of the geometry: check its camera, or leave it out"
            ));
        } else if inner > shown * 9 / 10 {
            warnings.push(format!(
                "{name} shows the inner sides of the surfaces: its camera may stand inside a \
                 wall or box, or the faces may be wound the wrong way round"
            ));
        }
        if !buffer.image.measures_anything() {
            warnings.push(format!("{name} has no valid pixel and is not used"));
        }
    }
    warnings
}

/// Warnings about the result.
pub(super) fn warn(
    capture: &Capture,
    options: &Options,
    samples: &SampleCloud,
    lobes: &Lobes,
    solution: &Solution,
) -> Vec<String> {
    let mut warnings = samples.warnings.clone();
    let optics = |index: usize| solution.optics.get(index).copied().unwrap_or_default();
    let materials = capture.materials.iter().zip(&solution.reflectances).enumerate();
    for (index, (material, reflectance)) in materials {
        let is_unknown = reflectance.is_none() && material.known_diffuse.is_none();
        if is_unknown && optics(index) == Optics::Opaque {
            warnings.push(format!(
                "material \"{}\" is measured in no photograph: its reflectance stays unknown",
                material.name
            ));
        }
    }
    if options.general.method == Method::Paper {
        for light in &capture.lights {
            if !matches!(light, KnownLight::Visible { .. }) {
                let (name, kind) = (light.name(), light.kind());
                warnings.push(format!(
                "light \"{name}\" ({kind}) is not used by the method \"paper\", which takes all \
                 light from outside the photographs to be unknown"
            ));
            }
        }
    }
    if lobes.lobes.is_empty() {
        warnings.push(
            "no virtual light was placed, since every ray from the samples meets a photographed \
             surface: the result holds only if all luminaires are tagged as visible lights"
                .to_owned(),
        );
    }
    if samples.samples.len() < lobes.lobes.len() {
        warnings.push(format!(
            "there are fewer samples ({}) than emission lobes ({}): the light is \
             underdetermined; lower samples.spacing_m or raise lights.spacing_factor",
            samples.samples.len(),
            lobes.lobes.len()
        ));
    }
    warnings.extend(solution.warnings.iter().cloned());
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIGABYTE: u128 = 1_000_000_000;

    /// A coupling of 8 GB by itself, with as many rows as samples.
    fn size() -> SolveSize {
        SolveSize { samples: 1_000_000, rows: 1_000_000, lobes: 1000, light_sets: 1, threads: 1 }
    }

    #[test]
    fn the_peak_counts_every_matrix_that_is_held_at_once() {
        // 8 for the coupling, 4 for the rows it is made from, 8 for one channel's Jacobian, and
        // 8 MB for its products.
        let products = 8_000_000;
        assert_eq!(size().peak_bytes(), 20 * GIGABYTE + products);
        // Three channels at once.
        let threads = |threads| SolveSize { threads, ..size() };
        assert_eq!(threads(16).peak_bytes(), 36 * GIGABYTE + 3 * products);
        // Two light sets at once on two threads, which are two channels; six, and all of theirs.
        let sets = |sets, threads| SolveSize { light_sets: sets, threads, ..size() };
        assert_eq!(sets(6, 2).peak_bytes(), 40 * GIGABYTE + 2 * products);
        assert_eq!(sets(6, 64).peak_bytes(), (6 * 12 + 18 * 8) * GIGABYTE + 18 * products);
        // Four rows a sample: the design and the Jacobian have all of them.
        let glossy = SolveSize { rows: 4_000_000, ..size() };
        assert_eq!(glossy.peak_bytes(), (12 + 32 + 32) * GIGABYTE + products);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_what_to_lower() {
        // Fits by the coupling alone, and not with all that comes with it.
        let error = check_size(&size(), LOWER_JOINT).unwrap_err().to_string();
        assert!(error.contains("19 GB") && error.contains("1000 lobes"), "{error}");
        assert!(error.contains("lower samples.count"), "{error}");
        assert!(error.contains("joint.light_sets"), "{error}");
        let scene =
            SolveSize { samples: 3500, rows: 5000, lobes: 2100, light_sets: 6, threads: 64 };
        assert!(check_size(&scene, LOWER_PAPER).is_ok());
        assert!(check_size(&SolveSize { lobes: 0, threads: 0, ..size() }, LOWER_PAPER).is_ok());
        let all = 1 << 48;
        let largest = SolveSize { samples: all, rows: 0, lobes: all, light_sets: 1, threads: 1 };
        assert!(check_size(&largest, LOWER_PAPER).is_err());
    }
}

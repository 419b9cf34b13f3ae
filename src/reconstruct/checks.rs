//! What must hold before a run and within it, and what the artist should know about its result.

use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::reconstruct::{Error, Method, Options};
use crate::scene::{Capture, KnownLight};

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

/// The coupling of all samples with all lobes is held in memory.
pub(super) fn check_size(samples: usize, lobes: usize) -> Result<(), Error> {
    let bytes = samples as u64 * lobes as u64 * size_of::<f64>() as u64;
    if bytes > LARGEST_COUPLING {
        return Err(Error::TooLarge { samples, lobes, gigabytes: bytes >> 30 });
    }
    Ok(())
}

/// Bytes; many times what a scene needs, and still within a workstation's memory.
const LARGEST_COUPLING: u64 = 8 << 30;

/// What the artist should know about the result.
pub(super) fn warn(
    capture: &Capture,
    options: &Options,
    samples: &SampleCloud,
    lobes: &Lobes,
    solution: &Solution,
) -> Vec<String> {
    let mut warnings = samples.warnings.clone();
    for (material, reflectance) in capture.materials.iter().zip(&solution.reflectances) {
        if reflectance.is_none() {
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

//! The radiance of samples that a reconstruction was not given, from what it found: how well a
//! result predicts, by whatever method it was made.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::math::rgb::Rgb;
use crate::reconstruct::joint::held_out;
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::options::Options;
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::reconstruct::solution::Solution;
use crate::reconstruct::textures::TextureOptions;
use crate::reconstruct::textures::light::Light;
use crate::reconstruct::transport::PatchRadiosity;
use crate::scene::Views;
use crate::watch::{Cancelled, Watch};

/// A sample that was held out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Radiance in the photographs, in their unit.
    pub measured: Rgb,
    pub computed: Rgb,
}

/// Takes the samples of one part of all blocks out of a cloud. Blocks are cells of a fifth of
/// the half-diagonal: single samples would be predicted by the ones beside them.
pub(super) fn withhold(views: &Views, cloud: &mut SampleCloud, part: usize) -> Vec<Sample> {
    let block = held_out::block(&views.capture.mesh);
    let part = part % held_out::FOLDS;
    let (out, kept) = std::mem::take(&mut cloud.samples)
        .into_iter()
        .partition(|sample| held_out::fold(block(sample)) == part);
    cloud.samples = kept;
    out
}

/// Predicts samples of diffuse materials (Eq. 5): with textured ones by their mean. Others, and
/// those without a reflectance, are passed over.
pub(super) fn radiance(
    views: &Views,
    samples: Vec<Sample>,
    (lights, lobes, patch_radiosity, solution): (
        &VirtualLights,
        &Lobes,
        &PatchRadiosity,
        &Solution,
    ),
    options: &Options,
    watch: &Watch,
) -> Result<Vec<Predicted>, Cancelled> {
    let light =
        Light::new(lights, lobes, patch_radiosity, solution, options, options.general.seed as u64);
    let rays = TextureOptions {
        rays: options.transport.rays,
        disc_rays: options.transport.disc_rays,
        ..options.textures.clone()
    };
    let predicted: Vec<Option<Predicted>> = samples
        .par_iter()
        .map(|sample| {
            watch.check()?;
            let reflectance = solution.reflectances[sample.material]
                .as_ref()
                .filter(|reflectance| reflectance.specular.iter().all(|&s| s == 0.0));
            Ok(reflectance.map(|reflectance| {
                let irradiance = light.at(views, sample.surface_point(), &rays);
                let computed = std::array::from_fn(|c| reflectance.diffuse[c] * irradiance[c] / PI);
                Predicted { measured: sample.radiance.map(f64::from), computed }
            }))
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(predicted.into_iter().flatten().collect())
}

//! Prediction of withheld samples: the radiance that a result of either method computes for samples
//! that it was not given.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::math::rgb::Rgb;
use crate::reconstruct::joint::held_out;
use crate::reconstruct::options::Options;
use crate::reconstruct::recovered::RecoveredLight;
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::reconstruct::textures::TextureOptions;
use crate::reconstruct::textures::light::Light;
use crate::scene::{Brdf, Views};
use crate::watch::{Cancelled, Watch};

/// The measured and the computed radiance of a withheld sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Mean over the photographs, in their unit of radiance.
    pub measured: Rgb,
    /// In the same unit.
    pub computed: Rgb,
}

/// Takes the samples of one part of all blocks out of a cloud, and returns them. Blocks are cells of
/// a fifth of the half-diagonal: single samples would be predicted too well from those beside them.
pub(super) fn withhold(views: &Views, cloud: &mut SampleCloud, part: usize) -> Vec<Sample> {
    let block = held_out::block(&views.capture.mesh);
    let part = part % held_out::FOLDS;
    let (out, kept) = std::mem::take(&mut cloud.samples)
        .into_iter()
        .partition(|sample| held_out::fold(block(sample)) == part);
    cloud.samples = kept;
    out
}

/// Predicts samples of diffuse materials (Eq. 5), textured ones with their mean reflectance. Samples
/// of specular materials, and of materials without a BRDF, are left out. `brdfs` has one per
/// material.
pub(super) fn radiance(
    views: &Views,
    samples: Vec<Sample>,
    light: &RecoveredLight,
    brdfs: &[Option<Brdf>],
    options: &Options,
    watch: &Watch,
) -> Result<Vec<Predicted>, Cancelled> {
    let light = Light::new(light, options);
    let rays = TextureOptions {
        rays: options.transport.rays,
        disc_rays: options.transport.disc_rays,
        ..options.textures.clone()
    };
    let predicted: Vec<Option<Predicted>> = samples
        .par_iter()
        .map(|sample| {
            watch.check()?;
            let brdf = brdfs[sample.material]
                .as_ref()
                .filter(|brdf| brdf.specular.iter().all(|&s| s == 0.0));
            Ok(brdf.map(|brdf| {
                let irradiance = light.at(views, sample.surface_point(), &rays);
                let computed = std::array::from_fn(|c| brdf.diffuse[c] * irradiance[c] / PI);
                Predicted { measured: sample.radiance.map(f64::from), computed }
            }))
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(predicted.into_iter().flatten().collect())
}

//! Prediction of held-out samples: the radiance that a result, of either method, gives for samples
//! to which it was not fitted.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::math::rgb::Rgb;
use crate::reconstruct::joint::blocks::{Blocks, deal};
use crate::reconstruct::options::Options;
use crate::reconstruct::recovered::RecoveredLight;
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::reconstruct::textures::TextureOptions;
use crate::reconstruct::textures::light::Light;
use crate::scene::{Brdf, Views};
use crate::watch::{Cancelled, Watch};

/// The measured and the computed radiance of a held-out sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Mean over the photographs, in their unit of radiance.
    pub measured: Rgb,
    /// In the same unit.
    pub computed: Rgb,
}

/// Parts of which one is taken out, and [`deal`]'s purpose of them.
const PARTS: usize = 4;
const PURPOSE: u64 = 2;

/// Removes the samples of one part of all blocks from a cloud, and returns them. Blocks are cells
/// of a fifth of the half-diagonal: single held-out samples would be predicted too well, because of
/// their neighbours.
pub(super) fn withhold(views: &Views, cloud: &mut SampleCloud, part: usize) -> Vec<Sample> {
    let blocks = Blocks::of(&views.capture.mesh, &cloud.samples);
    let fold = deal(blocks.count, PARTS, PURPOSE);
    let (mut out, mut kept) = (Vec::new(), Vec::new());
    for (sample, block) in std::mem::take(&mut cloud.samples).into_iter().zip(blocks.of_sample) {
        if fold[block] == part % PARTS { out.push(sample) } else { kept.push(sample) }
    }
    cloud.samples = kept;
    out
}

/// As many rays for the light at a point as for that at a sample.
pub(super) fn rays(options: &Options) -> TextureOptions {
    TextureOptions {
        rays: options.transport.rays,
        disc_rays: options.transport.disc_rays,
        ..options.textures.clone()
    }
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
    let rays = rays(options);
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

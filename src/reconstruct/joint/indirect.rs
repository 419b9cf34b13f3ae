//! I_s, the irradiance of every sample from known surfaces: one operator from the reflectances and
//! the light of a fit to I_s, and to the same light by direction on the samples of glossy surfaces.
//!
//! - The radiance of photographed surfaces is read from the photographs (`Transport::irradiance`).
//! - The radiance of known surfaces that no photograph shows is computed by radiosity: patches are
//!   spread over them, and form factors couple the patches. If these surfaces were emitters of
//!   unknown strength (Section 4.2) instead, they would be so near to the samples that they could
//!   imitate the light of photographed surfaces. Only that light determines the scale of the
//!   reflectances.
//! - A glossy surface reflects other light towards a sample than towards the cameras. Once its
//!   specular lobe and the light are known, the radiance that was read in the photographs is
//!   multiplied by the ratio of the two.

use std::sync::Arc;

use faer::Mat;
use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::{Nearest, select_spaced};
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::Random;
use crate::reconstruct::hemisphere::{Gathered, UnphotographedHit, hemisphere};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::glossy::{self, Reflections};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::surface_light::SurfaceLight;
use crate::reconstruct::samples::{Sample, SampleCloud, spacing_for};
use crate::reconstruct::transport::{self, PatchRadiosity, TransportOptions};
use crate::reconstruct::{Error, Stream};
use crate::scene::Role;
use crate::watch::Cancelled;

/// Patches on surfaces that no photograph shows.
const PATCHES: usize = 400;
/// Side of the grid of rays of a patch, and rays that find how much of a light it sees.
const PATCH_SIDE: usize = 16;
const PATCH_DISC_RAYS: usize = 4;
/// The light and I_s are computed in turn until I_s changes by less than this fraction, or for so
/// many rounds. The change of each round is about a tenth of that of the round before.
const TOLERANCE: f64 = 1e-3;
const ROUNDS: usize = 8;
/// Reflections between patches end when they are below this fraction of the light.
const LEAST_REFLECTED: f64 = 1e-4;

/// The rays from the samples to patches and to glossy surfaces.
pub struct Indirect {
    patches: Option<Patches>,
    /// The rays that meet glossy surfaces.
    glossy: Vec<Reflections>,
}

/// Patches of known surfaces that no photograph shows.
struct Patches {
    nearest: Nearest,
    /// The patches, as samples without measurements.
    cloud: SampleCloud,
    reflecting: Vec<Reflecting>,
    /// Irradiance of every patch from photographed surfaces.
    photographed: Vec<Rgb>,
    /// For each patch the other patches that are visible from it, and their form factors times π,
    /// in sr.
    form_factors: Vec<Vec<(usize, f64)>>,
    /// The patch at every unphotographed point that a ray from a sample meets.
    of_point: Vec<usize>,
}

/// What a patch reflects of the light on it.
#[derive(Clone, Copy)]
enum Reflecting {
    /// As much as a material that photographs show.
    Measured(usize),
    /// What `known_diffuse` gives for a material that no photograph shows.
    Known(Rgb),
    /// Not known: as much as the measured materials in the mean.
    Unknown,
}

/// A fit whose I_s agrees with its own light and reflectances.
pub struct Settled<'a> {
    pub problem: Problem<'a>,
    pub fitted: Fitted,
    /// The radiosity of the patches.
    pub patch_radiosity: PatchRadiosity,
}

impl Indirect {
    /// Traces rays from every sample. The radiance of glossy surfaces is interpolated from the
    /// problem's own samples.
    ///
    /// # Errors
    /// If it is cancelled.
    pub fn new(problem: &Problem) -> Result<Self, Cancelled> {
        Ok(Self { patches: Patches::find(problem)?, glossy: glossy::reflections(problem)? })
    }

    /// Whether rays from samples meet known surfaces that no photograph shows.
    pub fn has_patches(&self) -> bool {
        self.patches.is_some()
    }

    /// The same without what unphotographed surfaces reflect.
    pub fn without_patches(self) -> Self {
        Self { patches: None, ..self }
    }

    /// Whether I_s depends on a fit at all.
    fn is_fixed(&self, fitted: &Fitted) -> bool {
        self.patches.is_none() && (!fitted.model.is_glossy() || self.glossy.is_empty())
    }

    /// Fits a model and computes I_s from its light, in turn, until I_s converges.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn settle<'a>(&self, problem: &Problem<'a>, fitted: Fitted) -> Result<Settled<'a>, Error> {
        let mut settled = Settled {
            problem: problem.clone(),
            fitted,
            patch_radiosity: PatchRadiosity::default(),
        };
        if self.is_fixed(&settled.fitted) {
            return Ok(settled);
        }
        let coupling =
            self.patches.as_ref().map(|p| p.couple(problem, &settled.fitted)).transpose()?;
        let transport = problem.data.transport;
        let gloss = &settled.fitted.model.gloss;
        let records = |sample| transport.records_of(sample).iter().copied();
        let photographed = glossy::mirrored(problem, gloss, &self.glossy, records);
        for _ in 0..ROUNDS {
            let Settled { problem, fitted, .. } = &settled;
            let (surface_light, patch_radiosity) =
                self.light(problem, fitted, coupling.as_ref(), &photographed);
            let before = &problem.surface_light.irradiance;
            let change = relative_change(before, &surface_light.irradiance);
            let problem = problem.with_surface_light(surface_light);
            let fitted = fit(&problem, &fitted.model, Some(fitted), ROUGH)?;
            settled = Settled { problem, fitted, patch_radiosity };
            if change < TOLERANCE {
                break;
            }
        }
        Ok(settled)
    }

    /// The light of known surfaces on every sample, and the radiosity of the patches. `photographed` is what
    /// [`glossy::mirrored`] gives for the light of photographed surfaces.
    fn light(
        &self,
        problem: &Problem,
        fitted: &Fitted,
        coupling: Option<&Mat<f64>>,
        photographed: &[Vec<Rgb>],
    ) -> (SurfaceLight, PatchRadiosity) {
        let transport = problem.data.transport;
        let (radiance, patch_radiosity) = match (&self.patches, coupling) {
            (Some(patches), Some(coupling)) => {
                let radiosity = patches.light(problem, fitted, coupling);
                let of = |&patch: &usize| radiosity.radiance[patch];
                (Arc::new(patches.of_point.iter().map(of).collect()), radiosity)
            }
            // The same, so that designs that were computed with it stay valid (`Design::has_patches`).
            _ => (problem.surface_light.patches.clone(), PatchRadiosity::default()),
        };
        let mut light = SurfaceLight { patches: radiance, ..SurfaceLight::default() };
        let samples = 0..transport.irradiance.len();
        let mut sums: Vec<Rgb> =
            samples.into_par_iter().map(|sample| light.irradiance_on(transport, sample)).collect();
        if fitted.model.is_glossy() {
            // Of the patches as they were when the model was fitted.
            let records = |sample| problem.surface_light.of_patches(transport, sample);
            let mut from_surfaces =
                glossy::mirrored(problem, &fitted.model.gloss, &self.glossy, records);
            let all = from_surfaces.iter_mut().flatten().zip(photographed.iter().flatten());
            all.for_each(|(sum, own)| sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += own));
            glossy::correct(problem, fitted, &self.glossy, &from_surfaces, &mut sums);
        }
        let single = |sum: Rgb| sum.map(|value| value.max(0.0) as f32);
        light.irradiance = Arc::new(sums.into_iter().map(single).collect());
        (light, patch_radiosity)
    }
}

/// Root of the summed squared change over that of the values.
fn relative_change(before: &[Radiance], after: &[Radiance]) -> f64 {
    let (mut change, mut whole) = (0.0, 0.0);
    for (before, after) in before.iter().flatten().zip(after.iter().flatten()) {
        change += f64::from(after - before).powi(2);
        whole += f64::from(*after).powi(2);
    }
    if whole > 0.0 { (change / whole).sqrt() } else { 0.0 }
}

impl Patches {
    /// Patches spread over the unphotographed surface points that rays from the samples meet;
    /// `None` if there are no such points.
    fn find(problem: &Problem) -> Result<Option<Self>, Cancelled> {
        let (views, watch) = (problem.data.views, problem.watch());
        let transport = &problem.data.transport;
        let (unphotographed, bright) = (&transport.unphotographed, &transport.bright);
        let seed = problem.data.options.general.seed as u64;
        let positions: Vec<Vec3> = unphotographed.iter().map(|hit| hit.point.position).collect();
        // In the order of the samples, the first ones would decide where all patches are.
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        Random::new(seed, Stream::Unseen as u64, u64::MAX).shuffle(&mut order);
        let spacing_m = spacing_for(&positions, &order, PATCHES, watch)?;
        let kept = select_spaced(&positions, &order, spacing_m, watch)?;
        let places: Vec<UnphotographedHit> =
            kept.iter().map(|&index| unphotographed[index as usize]).collect();
        let points: Vec<Vec3> = places.iter().map(|place| place.point.position).collect();
        let Some(nearest) = Nearest::new(&points) else { return Ok(None) };

        let gathered = places
            .par_iter()
            .enumerate()
            .map(|(index, place)| {
                watch.check()?;
                let mut random = Random::new(seed, Stream::Unseen as u64, index as u64);
                let Gathered { irradiance, unphotographed, .. } =
                    hemisphere(views, bright, place.point, PATCH_SIDE, &mut random);
                let factor = |unphotographed: &UnphotographedHit| {
                    (nearest.to(unphotographed.point.position), unphotographed.projected_sr)
                };
                Ok((irradiance.map(f64::from), unphotographed.iter().map(factor).collect()))
            })
            .collect::<Result<Vec<(Rgb, Vec<(usize, f64)>)>, Cancelled>>()?;
        let (photographed, form_factors) = gathered.into_iter().unzip();

        let nothing_measured = |place: &UnphotographedHit| Sample {
            position: place.point.position,
            normal: place.point.normal,
            material: 0,
            surface: 0,
            views: 0..0,
            radiance: [0.0; CHANNELS],
        };
        let cloud = SampleCloud {
            samples: places.iter().map(nothing_measured).collect(),
            ..SampleCloud::default()
        };
        let capture = views.capture;
        let reflecting = |place: &UnphotographedHit| {
            let surface = capture.mesh.surface[place.triangle as usize] as usize;
            let Role::Material(material) = capture.surfaces[surface].role else {
                return Reflecting::Unknown;
            };
            if problem.priors.measured[material] {
                return Reflecting::Measured(material);
            }
            let known = capture.materials[material].known_diffuse;
            known.map_or(Reflecting::Unknown, Reflecting::Known)
        };
        let reflecting = places.iter().map(reflecting).collect();
        let of_point = positions.par_iter().map(|&position| nearest.to(position)).collect();
        Ok(Some(Self { nearest, cloud, reflecting, photographed, form_factors, of_point }))
    }

    /// k_ij, patches × columns of a model.
    fn couple(&self, problem: &Problem, fitted: &Fitted) -> Result<Mat<f64>, Cancelled> {
        let options = problem.data.options;
        let seed = options.general.seed as u64;
        let options = TransportOptions { disc_rays: PATCH_DISC_RAYS, ..options.transport.clone() };
        let set = fitted.model.set();
        let (views, watch) = (problem.data.views, problem.watch());
        transport::couple(views, &self.cloud, &set.lights, &set.lobes, &options, seed, watch)
    }

    /// The radiosity of the patches with the light and the reflectances of a fit.
    fn light(&self, problem: &Problem, fitted: &Fitted, coupling: &Mat<f64>) -> PatchRadiosity {
        let count = self.reflecting.len();
        let mut radiance = vec![[0.0f32; CHANNELS]; count];
        for (c, fit) in fitted.channels.iter().enumerate() {
            let emission = &fit.state.emission;
            let lights = |patch: usize| -> f64 {
                emission.iter().enumerate().map(|(j, e)| e * coupling[(patch, j)]).sum()
            };
            let direct: Vec<f64> =
                (0..count).map(|patch| self.photographed[patch][c] + lights(patch)).collect();
            let logs: Vec<f64> =
                problem.measured().into_iter().map(|m| fit.state.log_diffuse[m]).collect();
            let mean = (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
            // Of all that arrives, the part that is reflected into any direction.
            let part = |reflecting: &Reflecting| match *reflecting {
                Reflecting::Measured(m) => {
                    let lobe = fitted.model.gloss[m]
                        .map_or(0.0, |gloss| fit.state.specular[m] * gloss.albedo());
                    (fit.state.log_diffuse[m].exp() + lobe).min(1.0)
                }
                Reflecting::Known(reflectance) => reflectance[c],
                Reflecting::Unknown => mean,
            };
            let reflectance: Vec<f64> = self.reflecting.iter().map(part).collect();
            let reflect = |irradiance: &dyn Fn(usize) -> f64| -> Vec<f64> {
                (0..count)
                    .map(|patch| reflectance[patch] * irradiance(patch) / std::f64::consts::PI)
                    .collect()
            };
            // Neumann series of the radiosity equation.
            let mut order = reflect(&|patch| direct[patch]);
            let first: f64 = order.iter().sum();
            let mut sent = order.clone();
            while order.iter().sum::<f64>() > LEAST_REFLECTED * first {
                let before = std::mem::take(&mut order);
                order = reflect(&|patch| {
                    self.form_factors[patch].iter().map(|&(other, w)| w * before[other]).sum()
                });
                sent.iter_mut().zip(&order).for_each(|(sent, order)| *sent += order);
                if order.iter().sum::<f64>() >= before.iter().sum::<f64>() {
                    // Mirrors all around: the series has no end that these patches would know.
                    break;
                }
            }
            for (radiance, sent) in radiance.iter_mut().zip(sent) {
                radiance[c] = sent as f32;
            }
        }
        PatchRadiosity::new(self.nearest.clone(), radiance)
    }
}

//! Light from known surfaces that no photograph shows: backs, undersides, hidden floors.
//!
//! As emitters of unknown strength (Section 4.2) they lie so near to the samples that they
//! imitate what photographed surfaces send, which is all that tells the scale of the
//! reflectances. But they emit nothing: what they reflect follows from the light and the
//! reflectances that explain the rest, and does not change with their common scale. So it is
//! computed from a first fit and is part of I_s from then on.

use faer::Mat;
use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::{Nearest, select_spaced};
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::Random;
use crate::reconstruct::Stream;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::model::{Data, Model};
use crate::reconstruct::samples::{Sample, SampleCloud, spacing_for};
use crate::reconstruct::transport::{
    self, Gathered, PatchRadiosity, TransportOptions, UnphotographedHit, hemisphere,
};
use crate::scene::Role;
use crate::watch::Cancelled;

/// Places on unseen surfaces whose light is computed.
const PLACES: usize = 400;
/// Side of the grid of rays of each place.
const SIDE: usize = 16;
/// Rays that find how much of a light a place sees.
const DISC_RAYS: usize = 4;
/// Rounds of light between the places.
const ROUNDS: usize = 4;

/// Places on unseen surfaces, and what they see.
pub struct Unseen {
    nearest: Nearest,
    /// The places, as samples that nothing was measured at.
    cloud: SampleCloud,
    materials: Vec<Option<usize>>,
    /// I_s of every place from photographed surfaces.
    photographed: Vec<Rgb>,
    /// Which places each place sees, and with what part of its hemisphere, in sr.
    between: Vec<Vec<(usize, f64)>>,
    /// The place of every hidden point that a sample sees.
    of_hidden: Vec<usize>,
}

impl Unseen {
    /// Places spread over what the samples see of unseen surfaces; `None` where nothing is
    /// unseen.
    pub fn find(fitter: &Fitter) -> Result<Option<Self>, Cancelled> {
        let (data, watch) = (&fitter.data, fitter.watch());
        let (views, unphotographed) = (data.views, &data.transport.unphotographed);
        let seed = data.options.general.seed as u64;
        let positions: Vec<Vec3> =
            unphotographed.iter().map(|unphotographed| unphotographed.point.position).collect();
        // In the order of the samples, the first ones would decide where all places are.
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        Random::new(seed, Stream::Unseen as u64, u64::MAX).shuffle(&mut order);
        let spacing_m = spacing_for(&positions, &order, PLACES, watch)?;
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
                    hemisphere(views, place.point, SIDE, &mut random);
                let share = |unphotographed: &UnphotographedHit| {
                    (nearest.to(unphotographed.point.position), unphotographed.projected_sr)
                };
                Ok((irradiance.map(f64::from), unphotographed.iter().map(share).collect()))
            })
            .collect::<Result<Vec<(Rgb, Vec<(usize, f64)>)>, Cancelled>>()?;
        let (photographed, between) = gathered.into_iter().unzip();

        let cloud = SampleCloud {
            samples: places.iter().map(as_sample).collect(),
            ..SampleCloud::default()
        };
        let capture = views.capture;
        let material = |place: &UnphotographedHit| {
            let surface = capture.mesh.surface[place.triangle as usize] as usize;
            match capture.surfaces[surface].role {
                Role::Material(material) if fitter.measured[material] => Some(material),
                _ => None,
            }
        };
        let materials = places.iter().map(material).collect();
        let of_hidden = positions.par_iter().map(|&position| nearest.to(position)).collect();
        Ok(Some(Self { nearest, cloud, materials, photographed, between, of_hidden }))
    }

    /// k_ij, places × columns of a model.
    pub fn coupling(&self, fitter: &Fitter, model: &Model) -> Result<Mat<f64>, Cancelled> {
        let Data { views, options, watch, .. } = fitter.data;
        let seed = options.general.seed as u64;
        let options = TransportOptions { disc_rays: DISC_RAYS, ..options.transport.clone() };
        let (lights, lobes) = (&model.set.lights, &model.set.lobes);
        transport::couple(views, &self.cloud, lights, lobes, &options, seed, watch)
    }

    /// What the places send, when the light and the reflectances are those of a fit of the model
    /// whose coupling this is.
    pub fn light(&self, fitter: &Fitter, coupling: &Mat<f64>, fits: &Fits) -> PatchRadiosity {
        let count = self.materials.len();
        let mut radiance = vec![[0.0f32; CHANNELS]; count];
        for (c, fit) in fits.iter().enumerate() {
            let emission = &fit.state.emission;
            let lights = |place: usize| -> f64 {
                emission.iter().enumerate().map(|(j, e)| e * coupling[(place, j)]).sum()
            };
            let lit: Vec<f64> =
                (0..count).map(|place| self.photographed[place][c] + lights(place)).collect();
            let mean = mean_reflectance(fitter, &fit.state.log_diffuse);
            // Of all that arrives, the part that is reflected into any direction; the others'
            // mean where the material was not measured.
            let reflectance = |material: &Option<usize>| {
                material.map_or(mean, |m| fit.state.log_diffuse[m].exp() + fit.state.specular[m])
            };
            let reflectance: Vec<f64> = self.materials.iter().map(reflectance).collect();
            let mut sent = vec![0.0; count];
            for _ in 0..ROUNDS {
                sent = (0..count)
                    .map(|place| {
                        let others: f64 =
                            self.between[place].iter().map(|&(other, w)| w * sent[other]).sum();
                        reflectance[place] * (lit[place] + others) / std::f64::consts::PI
                    })
                    .collect();
            }
            for (radiance, sent) in radiance.iter_mut().zip(sent) {
                radiance[c] = sent as f32;
            }
        }
        PatchRadiosity::new(self.nearest.clone(), radiance)
    }

    /// I_s of every sample with what hidden surfaces send there.
    pub fn irradiance(&self, fitter: &Fitter, light: &PatchRadiosity) -> Vec<Radiance> {
        let transport = fitter.data.transport;
        (0..transport.irradiance.len())
            .into_par_iter()
            .map(|sample| {
                let points = transport.first_unphotographed[sample]
                    ..transport.first_unphotographed[sample + 1];
                let seen = points.map(|point| {
                    (self.of_hidden[point], transport.unphotographed[point].projected_sr)
                });
                light.added_from(transport.irradiance[sample], seen).map(|value| value as f32)
            })
            .collect()
    }
}

/// A sample that nothing was measured at.
fn as_sample(place: &UnphotographedHit) -> Sample {
    Sample {
        position: place.point.position,
        normal: place.point.normal,
        material: 0,
        surface: 0,
        views: 0..0,
        radiance: [0.0; CHANNELS],
    }
}

/// Geometric mean over the materials that were measured.
fn mean_reflectance(fitter: &Fitter, log_diffuse: &[f64]) -> f64 {
    let measured = log_diffuse.iter().zip(&fitter.measured).filter(|(_, measured)| **measured);
    let (sum, count) = measured.fold((0.0, 0), |(sum, count), (log, _)| (sum + log, count + 1));
    (sum / f64::from(count.max(1))).exp()
}

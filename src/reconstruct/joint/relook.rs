//! What specular surfaces send to the samples, rather than to the cameras.
//!
//! I_s is read from the photographs as if every surface looked alike from everywhere. Of a
//! specular surface the cameras see other reflections than a sample does, and an error of I_s
//! goes whole into the common scale of the reflectances. Once the specular lobes and the light
//! are known, what is read there is corrected by the ratio of the two.

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::Nearest;
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::{Frame, Random, mirrored, square_to_cosine_hemisphere, stratified};
use crate::reconstruct::Stream;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::model::Model;
use crate::scene::Role;
use crate::watch::Cancelled;

/// Side of the grid of rays of each sample; what is corrected is a small part of the light.
const SIDE: usize = 12;
/// A ratio beyond these says more of the model's faults than of the surface.
const RATIO: (f64, f64) = (0.5, 2.0);

/// A sample of a specular surface, with the light on it.
struct Glossy {
    material: usize,
    normal: Vec3,
    position: Vec3,
    sample: usize,
    /// g, the irradiance of Eq. 14.
    irradiance: Rgb,
    /// From each light.
    lights: Vec<(usize, Rgb)>,
    /// Mean of π L̂ over the photographs.
    seen: Rgb,
}

/// I_s of every sample with what specular surfaces send it; as gathered where there are none.
pub fn irradiance(fitter: &Fitter, model: &Model, fits: &Fits) -> Result<Vec<Radiance>, Cancelled> {
    let data = &fitter.data;
    let gathered = &fitter.gathered;
    let glossy = glossy(fitter, model, fits);
    let positions: Vec<Vec3> = glossy.iter().map(|glossy| glossy.position).collect();
    let Some(nearest) = Nearest::new(&positions) else { return Ok(gathered.clone()) };
    let capture = data.views.capture;
    let seed = data.options.general.seed as u64;
    let weight = std::f64::consts::PI / (SIDE * SIDE) as f64;
    data.cloud
        .samples
        .par_iter()
        .zip(gathered)
        .enumerate()
        .map(|(index, (sample, gathered))| {
            fitter.watch().check()?;
            let mut random = Random::new(seed, Stream::Relook as u64, index as u64);
            let frame = Frame::about(sample.normal);
            let mut irradiance = gathered.map(f64::from);
            for square in stratified(SIDE, &mut random) {
                let direction = frame.to_world(square_to_cosine_hemisphere(square));
                let ray = data.views.ray(sample.surface_point(), direction);
                let Some(hit) = data.views.caster.closest(&ray) else { continue };
                let surface = capture.mesh.surface[hit.triangle as usize] as usize;
                let Role::Material(material) = capture.surfaces[surface].role else { continue };
                if !fitter.is_specular(material) {
                    continue;
                }
                let point = data.views.surface_point(&ray, &hit);
                let Some(radiance) = data.views.radiance(point) else { continue };
                let near = &glossy[nearest.to(point.position)];
                // Beside an edge the nearest sample may belong to something else.
                if near.material != material || near.normal.dot(point.normal) < SAME_SIDE {
                    continue;
                }
                let sent = near.towards(fitter, model, fits, -direction);
                for c in 0..CHANNELS {
                    let ratio =
                        (sent[c] / near.seen[c].max(f64::MIN_POSITIVE)).clamp(RATIO.0, RATIO.1);
                    irradiance[c] += weight * f64::from(radiance[c]) * (ratio - 1.0);
                }
            }
            Ok(irradiance.map(|value| value.max(0.0) as f32))
        })
        .collect()
}

const SAME_SIDE: f32 = 0.9;

fn glossy(fitter: &Fitter, model: &Model, fits: &Fits) -> Vec<Glossy> {
    let rows = &fitter.rows;
    let mut found: Vec<Glossy> = Vec::new();
    let mut row = 0;
    while row < rows.sample.len() {
        let sample = rows.sample[row];
        let end = (row..rows.sample.len()).find(|&r| rows.sample[r] != sample);
        let range = row..end.unwrap_or(rows.sample.len());
        let material = rows.material[row];
        if fitter.is_specular(material) {
            let mut seen = [0.0; CHANNELS];
            for (c, seen) in seen.iter_mut().enumerate() {
                for r in range.clone() {
                    let log = rows.log_radiance[c][r] + fits[c].residuals[r];
                    *seen += log.exp() / range.len() as f64;
                }
            }
            let mut lights: Vec<(usize, Rgb)> = Vec::new();
            let mut irradiance: Rgb = std::array::from_fn(|c| model.design.base[c][row]);
            for (column, lobe) in model.set.lobes.lobes.iter().enumerate() {
                let coupling = model.design.diffuse[(row, column)];
                let arriving: Rgb =
                    std::array::from_fn(|c| fits[c].state.emission[column] * coupling);
                if arriving == [0.0; CHANNELS] {
                    continue;
                }
                for c in 0..CHANNELS {
                    irradiance[c] += arriving[c];
                }
                match lights.last_mut().filter(|(light, _)| *light == lobe.light) {
                    Some((_, sum)) => {
                        for (sum, value) in sum.iter_mut().zip(arriving) {
                            *sum += value;
                        }
                    }
                    None => lights.push((lobe.light, arriving)),
                }
            }
            let point = &fitter.data.cloud.samples[sample];
            let (normal, position) = (point.normal, point.position);
            found.push(Glossy { material, normal, position, sample, irradiance, lights, seen });
        }
        row = range.end;
    }
    found
}

impl Glossy {
    /// π L̂ in a direction away from the surface.
    fn towards(&self, fitter: &Fitter, model: &Model, fits: &Fits, direction: Vec3) -> Rgb {
        let mirror = mirrored(direction, self.normal);
        let exponent = fitter.exponents[self.material];
        let transport = fitter.data.transport;
        let mut lobe = [0.0; CHANNELS];
        let scale = 0.5 * (exponent + 2.0) * transport.record_weight;
        for record in transport.records_of(self.sample) {
            let cosine = mirror.dot(record.direction);
            if cosine > 0.0 {
                let factor = scale * f64::from(cosine.powf(exponent as f32));
                for (sum, radiance) in lobe.iter_mut().zip(record.radiance) {
                    *sum += factor * f64::from(radiance);
                }
            }
        }
        for (light, irradiance) in &self.lights {
            let factor = model.set.lights.lights[*light].lobe(self.position, mirror, exponent);
            for (sum, value) in lobe.iter_mut().zip(irradiance) {
                *sum += factor * value;
            }
        }
        std::array::from_fn(|c| {
            let state = &fits[c].state;
            state.log_diffuse[self.material].exp() * self.irradiance[c]
                + state.specular[self.material] * lobe[c]
        })
    }
}

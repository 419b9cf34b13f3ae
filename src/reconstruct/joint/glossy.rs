//! What glossy surfaces send to the samples, rather than to the cameras.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::Nearest;
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::{Frame, Random, mirrored, square_to_cosine_hemisphere, stratified};
use crate::reconstruct::Stream;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::lights::VirtualLight;
use crate::reconstruct::samples::Sample;
use crate::scene::{Role, agreeing};
use crate::watch::Cancelled;

/// Side of the grid of rays of a sample that find glossy surfaces; what is corrected is a small
/// part of its light.
const GLOSSY_SIDE: usize = 12;
/// A ratio beyond these says more of the light model's faults than of the surface.
const RATIO: (f64, f64) = (0.5, 2.0);
/// Cosine between the normals of a point and of the nearest sample that are of one face.
const SAME_SIDE: f32 = 0.9;

/// A ray from a sample that met a photographed glossy surface.
pub struct Reflection {
    /// The nearest sample of the same surface.
    near: usize,
    /// Unit direction of the ray.
    direction: Vec3,
    radiance: Radiance,
}

/// Corrects irradiance, per sample, by the ratio of what glossy surfaces send to the sample and to
/// the cameras.
pub fn correct(
    problem: &Problem,
    fitted: &Fitted,
    reflections: &[Vec<Reflection>],
    sums: &mut [Rgb],
) {
    let shining = GlossySample::all(problem, fitted);
    let weight = std::f64::consts::PI / (GLOSSY_SIDE * GLOSSY_SIDE) as f64;
    sums.par_iter_mut().zip(reflections).for_each(|(sum, reflections)| {
        for reflection in reflections {
            let Some(near) = &shining[reflection.near] else { continue };
            let sent = near.towards(problem, fitted, -reflection.direction);
            for c in 0..CHANNELS {
                let ratio = sent[c] / near.seen[c].max(f64::MIN_POSITIVE);
                let ratio = ratio.clamp(RATIO.0, RATIO.1);
                sum[c] += weight * f64::from(reflection.radiance[c]) * (ratio - 1.0);
            }
        }
    });
}

/// What every sample of the cloud sees of glossy surfaces.
pub fn reflections(problem: &Problem) -> Result<Vec<Vec<Reflection>>, Cancelled> {
    let (views, cloud) = (problem.data.views, problem.data.cloud);
    let mut glossy: Vec<usize> = (0..problem.rows.sample.len())
        .filter(|&row| problem.rows.glossy[row].is_some())
        .map(|row| problem.rows.sample[row])
        .collect();
    glossy.dedup();
    let positions: Vec<Vec3> = glossy.iter().map(|&s| cloud.samples[s].position).collect();
    let Some(nearest) = Nearest::new(&positions) else {
        return Ok(cloud.samples.iter().map(|_| Vec::new()).collect());
    };
    let capture = views.capture;
    let seed = problem.data.options.general.seed as u64;
    let seen = |index: usize, sample: &Sample| {
        problem.watch().check()?;
        let mut random = Random::new(seed, Stream::Relook as u64, index as u64);
        let frame = Frame::about(sample.normal);
        let meets = |square| {
            let direction = frame.to_world(square_to_cosine_hemisphere(square));
            let ray = views.ray(sample.surface_point(), direction);
            let hit = views.caster.closest(&ray)?;
            let surface = capture.mesh.surface[hit.triangle as usize] as usize;
            let Role::Material(material) = capture.surfaces[surface].role else { return None };
            if !problem.is_tagged_specular(material) {
                return None;
            }
            let point = views.surface_point(&ray, &hit);
            let radiance = views.radiance(point)?;
            let near = glossy[nearest.to(point.position)];
            // Beside an edge the nearest sample may belong to something else.
            let sample = &cloud.samples[near];
            let is_near =
                sample.material == material && sample.normal.dot(point.normal) >= SAME_SIDE;
            is_near.then_some(Reflection { near, direction, radiance })
        };
        let squares: Vec<_> = stratified(GLOSSY_SIDE, &mut random).collect();
        Ok(squares.into_iter().filter_map(meets).collect())
    };
    cloud.samples.par_iter().enumerate().map(|(index, sample)| seen(index, sample)).collect()
}

/// A sample of a glossy surface, with the light on it.
struct GlossySample {
    material: usize,
    exponent: f64,
    normal: Vec3,
    position: Vec3,
    sample: usize,
    /// g, the irradiance of Eq. 14.
    irradiance: Rgb,
    /// From each light.
    lights: Vec<(usize, Rgb)>,
    /// Mean of π L̂ over the photographs that [`Views::radiance`] asks.
    seen: Rgb,
    shapes: Arc<Vec<VirtualLight>>,
}

impl GlossySample {
    /// By sample of the cloud; `None` for those that are not glossy in the fit's model.
    fn all(problem: &Problem, fitted: &Fitted) -> Vec<Option<Self>> {
        let rows = &problem.rows;
        let mut found: Vec<Option<Self>> = Vec::new();
        found.resize_with(problem.data.cloud.samples.len(), || None);
        let set = fitted.model.set();
        let shapes = Arc::new(set.lights.lights);
        let mut row = 0;
        while row < rows.sample.len() {
            let sample = rows.sample[row];
            let end = (row..rows.sample.len()).find(|&r| rows.sample[r] != sample);
            let range = row..end.unwrap_or(rows.sample.len());
            let material = rows.material[row];
            if let Some(exponent) = fitted.model.gloss[material] {
                let computed = |r: usize| -> Rgb {
                    std::array::from_fn(|c| {
                        (rows.log_radiance[c][r] + fitted.channels[c].residuals[r]).exp()
                    })
                };
                // In the photographs from which the reflected radiance was taken.
                let brightness =
                    range.clone().map(|r| rows.log_radiance.iter().map(|log| log[r].exp()).sum());
                let asked = range.clone().zip(agreeing(brightness)).filter(|(_, is_near)| *is_near);
                let asked: Vec<Rgb> = asked.map(|(r, _)| computed(r)).collect();
                let seen = std::array::from_fn(|c| {
                    asked.iter().map(|rgb| rgb[c]).sum::<f64>() / asked.len() as f64
                });
                let mut lights: Vec<(usize, Rgb)> = Vec::new();
                let mut irradiance: Rgb = std::array::from_fn(|c| fitted.design.base[c][row]);
                for (column, lobe) in set.lobes.lobes.iter().enumerate() {
                    let coupling = fitted.design.diffuse[(row, column)];
                    let arriving: Rgb = std::array::from_fn(|c| {
                        fitted.channels[c].state.emission[column] * coupling
                    });
                    if arriving == [0.0; CHANNELS] {
                        continue;
                    }
                    for c in 0..CHANNELS {
                        irradiance[c] += arriving[c];
                    }
                    match lights.last_mut().filter(|(light, _)| *light == lobe.light) {
                        Some((_, sum)) => {
                            sum.iter_mut().zip(arriving).for_each(|(sum, value)| *sum += value);
                        }
                        None => lights.push((lobe.light, arriving)),
                    }
                }
                let point = &problem.data.cloud.samples[sample];
                let (normal, position) = (point.normal, point.position);
                let shapes = shapes.clone();
                found[sample] = Some(Self {
                    material,
                    exponent,
                    normal,
                    position,
                    sample,
                    irradiance,
                    lights,
                    seen,
                    shapes,
                });
            }
            row = range.end;
        }
        found
    }

    /// π L̂ in a direction away from the surface.
    fn towards(&self, problem: &Problem, fitted: &Fitted, direction: Vec3) -> Rgb {
        let mirror = mirrored(direction, self.normal);
        let transport = problem.data.transport;
        let mut lobe = [0.0; CHANNELS];
        let scale = 0.5 * (self.exponent + 2.0) * transport.record_weight;
        for record in transport.records_of(self.sample) {
            let cosine = mirror.dot(record.direction);
            if cosine > 0.0 {
                let factor = scale * f64::from(cosine.powf(self.exponent as f32));
                for (sum, radiance) in lobe.iter_mut().zip(record.radiance) {
                    *sum += factor * f64::from(radiance);
                }
            }
        }
        for (light, irradiance) in &self.lights {
            let factor = self.shapes[*light].lobe(self.position, mirror, self.exponent);
            for (sum, value) in lobe.iter_mut().zip(irradiance) {
                *sum += factor * value;
            }
        }
        std::array::from_fn(|c| {
            let state = &fitted.channels[c].state;
            state.log_diffuse[self.material].exp() * self.irradiance[c]
                + state.specular[self.material] * lobe[c]
        })
    }
}

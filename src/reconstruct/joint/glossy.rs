//! The light that glossy surfaces reflect towards the samples. It differs from the radiance in the
//! photographs, which is what they reflect towards the cameras.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::spaced::Nearest;
use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::math::sampling::{Frame, Random, square_to_cosine_hemisphere, stratified};
use crate::reconstruct::Stream;
use crate::reconstruct::hemisphere::{Record, incoming};
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::samples::Sample;
use crate::scene::{Gloss, Role, Viewing, agreeing};
use crate::watch::Cancelled;

/// Side of the grid of rays of a sample that find glossy surfaces; what is corrected is a small
/// part of its light.
const GLOSSY_SIDE: usize = 12;
/// Ratios are limited to this range; beyond it they are due to errors of the light model rather
/// than to the surface.
const RATIO: (f64, f64) = (0.5, 2.0);
/// Cosine between the normals of a point and of the nearest sample that are of one face.
const SAME_SIDE: f32 = 0.9;

/// The rays from samples that met a photographed glossy surface near one of its samples.
pub struct Reflections {
    /// The sample of the glossy surface.
    near: usize,
    rays: Vec<Reflection>,
}

/// A ray from a sample that met a photographed glossy surface.
struct Reflection {
    sample: usize,
    /// Unit direction of the ray.
    direction: Vec3,
    radiance: Radiance,
}

/// Corrects the irradiance of each sample by the ratio of the radiance that glossy surfaces send to
/// the sample to that which they send to the cameras.
///
/// `from_surfaces` is what [`mirrored`] gives for the fit's gloss and the light of known surfaces.
pub fn correct(
    problem: &Problem,
    fitted: &Fitted,
    reflections: &[Reflections],
    from_surfaces: &[Vec<Rgb>],
    sums: &mut [Rgb],
) {
    let set = fitted.model.set();
    let first_row = first_rows(problem);
    let weight = std::f64::consts::PI / (GLOSSY_SIDE * GLOSSY_SIDE) as f64;
    let changes = |(seen, from_surfaces): (&Reflections, &Vec<Rgb>)| -> Option<Vec<Rgb>> {
        let near = GlossySample::at(problem, fitted, &set, first_row[seen.near]?)?;
        let change = |(ray, &from_surfaces): (&Reflection, &Rgb)| -> Rgb {
            let sent = near.towards(problem, fitted, &set, (-ray.direction, from_surfaces));
            std::array::from_fn(|c| {
                let ratio = sent[c] / near.seen[c].max(f64::MIN_POSITIVE);
                let ratio = ratio.clamp(RATIO.0, RATIO.1);
                weight * f64::from(ray.radiance[c]) * (ratio - 1.0)
            })
        };
        Some(seen.rays.iter().zip(from_surfaces).map(change).collect())
    };
    let changes: Vec<Option<Vec<Rgb>>> =
        reflections.par_iter().zip(from_surfaces).map(changes).collect();
    for (seen, changes) in reflections.iter().zip(changes) {
        for (ray, change) in seen.rays.iter().zip(changes.iter().flatten()) {
            sums[ray.sample].iter_mut().zip(change).for_each(|(sum, change)| *sum += change);
        }
    }
}

/// Per ray what the lobe of the surface there sends to the sample, π L/ρ_s, of the light that `light_on`
/// gives for a sample of a glossy surface.
pub fn mirrored<R: Iterator<Item = Record>>(
    problem: &Problem,
    gloss: &[Option<Gloss>],
    reflections: &[Reflections],
    light_on: impl Fn(usize) -> R + Sync,
) -> Vec<Vec<Rgb>> {
    let cloud = problem.data.cloud;
    let of = |seen: &Reflections| -> Vec<Rgb> {
        let near = &cloud.samples[seen.near];
        let Some(gloss) = gloss[near.material] else {
            return vec![[0.0; CHANNELS]; seen.rays.len()];
        };
        let incoming = incoming(light_on(seen.near));
        let viewing = |ray: &Reflection| Viewing::from(-ray.direction, near.normal);
        seen.rays.iter().map(|ray| incoming.reflected(viewing(ray), gloss)).collect()
    };
    reflections.par_iter().map(of).collect()
}

/// The rays from every sample of the cloud that meet glossy surfaces, by where they meet them.
pub fn reflections(problem: &Problem) -> Result<Vec<Reflections>, Cancelled> {
    let (views, cloud) = (problem.data.views, problem.data.cloud);
    let mut glossy: Vec<usize> = (0..problem.rows.sample.len())
        .filter(|&row| problem.rows.glossy[row].is_some())
        .map(|row| problem.rows.sample[row])
        .collect();
    glossy.dedup();
    let positions: Vec<Vec3> = glossy.iter().map(|&s| cloud.samples[s].position).collect();
    let Some(nearest) = Nearest::new(&positions) else {
        return Ok(Vec::new());
    };
    let capture = views.capture;
    let seed = problem.data.options.general.seed as u64;
    let seen = |(index, sample): (usize, &Sample)| -> Result<Vec<(usize, Reflection)>, Cancelled> {
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
            is_near.then_some((near, Reflection { sample: index, direction, radiance }))
        };
        let squares: Vec<_> = stratified(GLOSSY_SIDE, &mut random).collect();
        Ok(squares.into_iter().filter_map(meets).collect())
    };
    let seen: Vec<Vec<(usize, Reflection)>> =
        cloud.samples.par_iter().enumerate().map(seen).collect::<Result<_, Cancelled>>()?;
    let mut met: BTreeMap<usize, Vec<Reflection>> = BTreeMap::new();
    for (near, ray) in seen.into_iter().flatten() {
        met.entry(near).or_default().push(ray);
    }
    Ok(met.into_iter().map(|(near, rays)| Reflections { near, rays }).collect())
}

/// The light on the sample of a row, by where it comes from.
pub struct LightOnRow {
    /// g, the irradiance of Eq. 14.
    pub irradiance: Rgb,
    /// From each light of the model's set.
    pub lights: Vec<(usize, Rgb)>,
}

impl LightOnRow {
    /// `set` has the lights of the fit's model.
    pub fn of(fitted: &Fitted, set: &LightSet, row: usize) -> Self {
        let mut lights: Vec<(usize, Rgb)> = Vec::new();
        let mut irradiance: Rgb = std::array::from_fn(|c| fitted.design.base[c][row]);
        for (column, lobe) in set.lobes.lobes.iter().enumerate() {
            let coupling = f64::from(fitted.design.diffuse[(row, column)]);
            let arriving: Rgb =
                std::array::from_fn(|c| fitted.channels[c].state.emission[column] * coupling);
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
        Self { irradiance, lights }
    }

    /// ∫ L π f/ρ_s cos θ dω over the lights: what a specular lobe reflects of them.
    pub fn mirrored(&self, set: &LightSet, position: Vec3, viewing: Viewing, gloss: Gloss) -> Rgb {
        let mut sum = [0.0; CHANNELS];
        for (light, irradiance) in &self.lights {
            let factor = set.lights.lights[*light].lobe(position, viewing, gloss);
            for (sum, value) in sum.iter_mut().zip(irradiance) {
                *sum += factor * value;
            }
        }
        sum
    }
}

/// A sample of a glossy surface, with the light on it.
struct GlossySample {
    material: usize,
    gloss: Gloss,
    /// The first row of the sample.
    row: usize,
    light: LightOnRow,
    /// Mean of π L̂ over the photographs that [`Views::radiance`] asks.
    seen: Rgb,
}

/// Per sample of the cloud the first of its rows, which are one after the other; `None` without rows.
fn first_rows(problem: &Problem) -> Vec<Option<usize>> {
    let mut first = vec![None; problem.data.cloud.samples.len()];
    for (row, &sample) in problem.rows.sample.iter().enumerate().rev() {
        first[sample] = Some(row);
    }
    first
}

impl GlossySample {
    /// The sample whose first row is given; `None` if it is not glossy in the fit's model.
    fn at(problem: &Problem, fitted: &Fitted, set: &LightSet, row: usize) -> Option<Self> {
        let rows = &problem.rows;
        let material = rows.material[row];
        let gloss = fitted.model.gloss[material]?;
        let count = rows.sample[row..].iter().take_while(|&&s| s == rows.sample[row]).count();
        let range = row..row + count;
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
        let light = LightOnRow::of(fitted, set, row);
        Some(Self { material, gloss, row, light, seen })
    }

    /// π L̂ in a direction away from the surface, with what [`mirrored`] gives for it and the light of known
    /// surfaces.
    fn towards(
        &self,
        problem: &Problem,
        fitted: &Fitted,
        set: &LightSet,
        (direction, from_surfaces): (Vec3, Rgb),
    ) -> Rgb {
        let point = problem.surface_point(self.row);
        let viewing = Viewing::from(direction, point.normal);
        let lights = self.light.mirrored(set, point.position, viewing, self.gloss);
        let mirrored: Rgb = std::array::from_fn(|c| from_surfaces[c] + lights[c]);
        std::array::from_fn(|c| {
            let state = &fitted.channels[c].state;
            state.log_diffuse[self.material].exp() * self.light.irradiance[c]
                + state.specular[self.material] * mirrored[c]
        })
    }
}

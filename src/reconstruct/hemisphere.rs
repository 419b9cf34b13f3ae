//! Rays over the hemisphere of a surface point, by which the light from photographed surfaces that
//! arrives there is integrated.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::{Frame, Random, square_to_cosine_hemisphere, stratified};
use crate::reconstruct::bright::{Aim, BrightCells};
use crate::scene::{Incoming, SurfacePoint, Views};

/// Where a gathering ray hit a known surface that no photograph shows.
#[derive(Clone, Copy, Debug)]
pub struct UnphotographedHit {
    /// The point, on the side that the ray hit.
    pub point: SurfacePoint,
    /// Index into `Mesh::triangles`.
    pub triangle: u32,
    /// Unit direction of the ray from where it started, before any mirror.
    pub direction: Vec3,
    /// The projected solid angle that the ray stands for, cos θ ω in sr.
    pub projected_sr: f64,
}

impl UnphotographedHit {
    /// What arrives from there, if the radiance of the surface is known.
    pub fn record(&self, radiance: Radiance) -> Record {
        let irradiance = radiance.map(|value| value * self.projected_sr as f32);
        Record { direction: self.direction, irradiance }
    }
}

/// Light that arrives at a specular sample from a point of a known surface.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// Unit direction from the sample to where the radiance comes from.
    pub direction: Vec3,
    /// L_j cos θ_j ω_j: its radiance times the projected solid angle that its ray stands for.
    pub irradiance: Radiance,
}

impl Record {
    /// The direction, an angular radius of 0, and the irradiance, as [`Incoming`] takes them.
    pub fn from_direction(&self) -> (Vec3, f32, Radiance) {
        (self.direction, 0.0, self.irradiance)
    }
}

/// The light of records, for a specular lobe.
pub fn incoming(records: impl Iterator<Item = Record>) -> Incoming {
    Incoming::new(records.map(|record| record.from_direction()))
}

/// The light that rays over a surface point's hemisphere found.
pub struct Gathered {
    /// I_s, from photographed surfaces alone.
    pub irradiance: Radiance,
    /// Of the hits that a photograph measures, one per ray.
    pub records: Vec<Record>,
    /// The other hits.
    pub unphotographed: Vec<UnphotographedHit>,
}

/// What rays from a surface point find: `side`² that are distributed by the cosine, and a quarter as
/// many that are aimed at bright cells.
pub fn hemisphere(
    views: &Views,
    bright: &BrightCells,
    point: SurfacePoint,
    side: usize,
    random: &mut Random,
) -> Gathered {
    let frame = Frame::about(point.normal);
    let count = (side * side) as f32;
    let aimed = if bright.is_empty() { 0 } else { side * side / 4 };
    // π p_h / (n_h p_h + n_b p_b): the projected solid angle that a ray of either kind stands for, by
    // the balance heuristic. `geometry` is cos θ cos θ′ / r², π times p_h per m² there.
    let weight =
        |geometry: f32, density: f32| geometry / (count * geometry / PI + aimed as f32 * density);
    let (mut records, mut unphotographed) = (Vec::new(), Vec::new());
    for square in stratified(side, random) {
        let direction = frame.to_world(square_to_cosine_hemisphere(square));
        let first = views.ray(point, direction);
        let Some((ray, hit, part)) = views.met(first) else { continue };
        let met = views.surface_point(&ray, &hit);
        let Some(radiance) = views.radiance(met) else {
            unphotographed.push(UnphotographedHit {
                point: met,
                triangle: hit.triangle,
                direction,
                projected_sr: f64::from(PI / count * part.iter().sum::<f32>()) / CHANNELS as f64,
            });
            continue;
        };
        // Nothing is aimed by way of a mirror.
        let density = if ray.origin == first.origin {
            bright.density(views, hit.triangle, met, Vec2::new(hit.u, hit.v))
        } else {
            0.0
        };
        let sr = if density > 0.0 {
            let cosines = direction.dot(point.normal) * -ray.direction.dot(met.normal);
            weight(cosines.max(1e-9) / hit.t.powi(2), density)
        } else {
            PI / count
        };
        let irradiance = std::array::from_fn(|c| part[c] * radiance[c] * sr);
        records.push(Record { direction, irradiance });
    }
    for index in 0..aimed {
        let choice = (index as f32 + random.uniform()) / aimed as f32;
        let Aim { point: met, density } = bright.aim(views, choice, random.point());
        let offset = met.position - point.position;
        let direction = offset.normalize_or_zero();
        let cosines = direction.dot(point.normal).max(0.0) * -direction.dot(met.normal).min(0.0);
        let geometry = cosines / offset.length_squared().max(f32::MIN_POSITIVE);
        if geometry <= 0.0 || !views.is_free(point, met.position) {
            continue;
        }
        let Some(radiance) = views.radiance(met) else { continue };
        let sr = weight(geometry, density);
        records.push(Record { direction, irradiance: radiance.map(|value| value * sr) });
    }
    let mut sum = [0.0f64; CHANNELS];
    for record in &records {
        for (sum, value) in sum.iter_mut().zip(record.irradiance) {
            *sum += f64::from(value);
        }
    }
    Gathered { irradiance: sum.map(|value| value as f32), records, unphotographed }
}

//! The lights of a scene: the recovered ones, of which one is asked at a time, and those that
//! were added.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::lobes::Lobe;
use crate::reconstruct::transport::geometric_factor;
use crate::render::edits::{AddedLight, Edits, Shape};
use crate::render::groups;
use crate::render::scene::{Geometry, Solved};
use crate::scene::emitter::Arrival;
use crate::scene::{Capture, Dome, Emitter, KnownLight, SurfacePoint, Views};

/// A recovered light that shines.
#[derive(Clone, Debug)]
pub struct Light {
    pub shape: VirtualLight,
    /// Of a light that the artist gave.
    pub emitter: Option<Emitter>,
    /// E per lobe; one entry for a light that the artist gave.
    pub lobes: Vec<(Lobe, Radiance)>,
}

/// All recovered lights, and how likely each is asked at a place.
pub struct Recovered {
    lights: Vec<Light>,
    low: Vec3,
    cell_m: Vec3,
    /// Cells along each axis.
    side: usize,
    /// Per cell of a grid and side of the axes the lights' cumulated probabilities.
    cumulated: Vec<f32>,
}

/// Light that reaches a surface point from one direction, were nothing in the way.
#[derive(Clone, Copy, Debug)]
pub struct Arriving {
    /// Irradiance of the surface point.
    pub irradiance: Radiance,
    /// (n+2)/2 cosⁿγ per mirror direction and exponent is asked of this.
    pub direction: Vec3,
}

/// The most probabilities that are kept, 16 MB.
const MOST: usize = 4 << 20;
const FINEST: usize = 16;
/// Part of the choices that is even among all lights, so that a light which does not reach the
/// middle of a cell is found all the same.
const EVEN: f32 = 0.15;
/// The sides of the axes that a grid's cells know lights for.
const SIDES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

impl Recovered {
    /// The grid goes over the box around the geometry.
    pub fn new(capture: &Capture, solved: &Solved, edits: &Edits, geometry: &Geometry) -> Self {
        let (low, high) = geometry.bounds();
        let (factors, _) = groups::factors(capture, solved, edits);
        let mut lights = Vec::new();
        for (index, &shape) in solved.light.lights.lights.iter().enumerate() {
            let lobe = |lobe: usize| {
                let emission =
                    solved.light.emission[lobe].map(|value| factors[index] * value as f32);
                (solved.light.lobes.lobes[lobe], emission)
            };
            let lobes: Vec<(Lobe, Radiance)> = solved
                .light
                .lobes
                .of(index)
                .map(lobe)
                .filter(|(_, emission)| emission.iter().any(|&value| value > 0.0))
                .collect();
            let emitter = match shape.kind {
                LightKind::Known(known) => match &capture.lights[known] {
                    KnownLight::Shape { emitter, .. } => Some(*emitter),
                    _ => continue,
                },
                _ => None,
            };
            if !lobes.is_empty() {
                lights.push(Light { shape, emitter, lobes });
            }
        }
        let cells = (MOST / SIDES.len() / lights.len().max(1)) as f32;
        let side = (cells.cbrt() as usize).clamp(1, FINEST);
        let cell_m = ((high - low) / side as f32).max(Vec3::splat(1e-6));
        let least_m = 0.5 * cell_m.length();
        let mut recovered = Self { lights, low, cell_m, side, cumulated: Vec::new() };
        recovered.cumulated = (0..side * side * side)
            .into_par_iter()
            .flat_map_iter(|cell| {
                let place = [cell % side, cell / side % side, cell / side / side];
                let place = Vec3::from(place.map(|index| index as f32 + 0.5));
                let position = low + place * cell_m;
                let recovered = &recovered;
                SIDES.into_iter().flat_map(move |normal| recovered.cell(position, normal, least_m))
            })
            .collect();
        recovered
    }

    pub fn is_dark(&self) -> bool {
        self.lights.is_empty()
    }

    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Cumulated probabilities of the lights about a place.
    fn cell(&self, position: Vec3, normal: Vec3, least_m: f32) -> Vec<f32> {
        let strength = |light: &Light| {
            // A light below the horizon of the middle may be above that of another place.
            let towards = match &light.emitter {
                Some(emitter) => emitter.direction_from(position),
                None => light.shape.direction_from(position),
            };
            let tilted = SurfacePoint { position, normal: (normal + towards).normalize_or(normal) };
            let arriving = light.arriving(tilted, least_m, Vec2::splat(0.5));
            let facing = towards.dot(normal).max(0.0) + 0.1;
            arriving.map_or(0.0, |(a, _)| facing * a.irradiance.iter().sum::<f32>())
        };
        let strengths: Vec<f32> = self.lights.iter().map(strength).collect();
        let total: f32 = strengths.iter().sum();
        let count = strengths.len() as f32;
        let mut sum = 0.0;
        strengths
            .iter()
            .map(|&strength| {
                let share = if total > 0.0 { strength / total } else { 1.0 / count };
                sum += EVEN / count + (1.0 - EVEN) * share;
                sum
            })
            .collect()
    }

    /// One of the lights, chosen by a number in [0, 1), divided by its probability.
    pub fn sample(
        &self,
        views: &Views,
        point: SurfacePoint,
        choice: f32,
        square: Vec2,
    ) -> Option<(Arriving, &VirtualLight)> {
        let count = self.lights.len();
        if count == 0 {
            return None;
        }
        let side = self.side;
        let place = ((point.position - self.low) / self.cell_m).to_array();
        let [x, y, z] = place.map(|index| (index.max(0.0) as usize).min(side - 1));
        let facing = point.normal.abs();
        let axis = facing.max_position();
        let sign = usize::from(point.normal[axis] < 0.0);
        let first = (((z * side + y) * side + x) * SIDES.len() + 2 * axis + sign) * count;
        let cumulated = &self.cumulated[first..first + count];
        let index = cumulated.partition_point(|&sum| sum <= choice).min(count - 1);
        let before = if index > 0 { cumulated[index - 1] } else { 0.0 };
        let probability = cumulated[index] - before;
        let light = &self.lights[index];
        let (arriving, arrival) = light.arriving(point, views.offset_m, square)?;
        let is_free = match arrival {
            Some(arrival) => arrival.is_free(views, point),
            None => light.shape.is_seen(views, point, square),
        };
        let irradiance = arriving.irradiance.map(|value| value / probability);
        is_free.then_some((Arriving { irradiance, ..arriving }, &light.shape))
    }
}

impl Light {
    /// Irradiance of a surface at a position that faces the light, were nothing in the way; for a
    /// light that the artist gave the part that comes from its middle.
    pub fn facing(&self, position: Vec3) -> Option<Arriving> {
        let normal = match &self.emitter {
            Some(emitter) => emitter.direction_from(position),
            None => self.shape.direction_from(position),
        };
        let arriving = self.arriving(SurfacePoint { position, normal }, 0.0, Vec2::splat(0.5));
        arriving.map(|(arriving, _)| arriving)
    }

    /// Light at a surface point were nothing in the way; of a light that the artist gave also the
    /// way that it takes.
    fn arriving(
        &self,
        point: SurfacePoint,
        least_m: f32,
        square: Vec2,
    ) -> Option<(Arriving, Option<Arrival>)> {
        let mut irradiance = [0.0; CHANNELS];
        if let Some(emitter) = &self.emitter {
            let arrival = emitter.arrival(point, least_m, square)?;
            for (sum, value) in irradiance.iter_mut().zip(self.lobes[0].1) {
                *sum = value * arrival.cosine * arrival.strength;
            }
            return Some((Arriving { irradiance, direction: arrival.direction }, Some(arrival)));
        }
        let geometry = geometric_factor(&self.shape, point)?;
        for (lobe, emission) in &self.lobes {
            let value = geometry.factor * lobe.value(-geometry.direction);
            for (sum, emission) in irradiance.iter_mut().zip(emission) {
                *sum += value * emission;
            }
        }
        Some((Arriving { irradiance, direction: geometry.direction }, None))
    }
}

/// A light that was added.
pub struct Added {
    source: Source,
    pub emission: Radiance,
}

enum Source {
    Emitter(Emitter),
    Dome(DomeTable),
}

/// Part of the distance within which a light may lie on a surface.
const FLUSH: f32 = 1e-3;

/// Light of an added one at a surface point.
#[derive(Clone, Copy, Debug)]
pub struct Direct {
    pub direction: Vec3,
    pub cosine: f32,
    /// Radiance divided by the density of its direction; see [`Emitter::arrival`].
    pub light: Radiance,
    /// The density by solid angle with which the direction was found; 0 for lights without
    /// extent, which are found in no other way.
    pub density: f32,
}

impl Added {
    pub fn new(light: &AddedLight) -> Self {
        let source = match &light.shape {
            Shape::Emitter(emitter) => Source::Emitter(*emitter),
            Shape::Dome(dome) => Source::Dome(DomeTable::new(dome.clone())),
        };
        Self { source, emission: light.emission.map(|value| value as f32) }
    }

    /// What it is; `None` for a dome.
    pub fn emitter(&self) -> Option<Emitter> {
        match &self.source {
            Source::Emitter(emitter) => Some(*emitter),
            Source::Dome(_) => None,
        }
    }

    /// Of a dome the radiance from a direction.
    pub fn dome(&self, direction: Vec3) -> Option<Radiance> {
        let Source::Dome(table) = &self.source else { return None };
        let mut radiance = table.dome.radiance(direction);
        for (radiance, factor) in radiance.iter_mut().zip(self.emission) {
            *radiance *= factor;
        }
        Some(radiance)
    }

    /// Light from a direction that a point of the unit square stands for, with shadows.
    pub fn sample(&self, views: &Views, point: SurfacePoint, square: Vec2) -> Option<Direct> {
        match &self.source {
            Source::Emitter(emitter) => {
                let arrival = emitter.arrival(point, views.offset_m, square)?;
                if !arrival.is_free(views, point) {
                    return None;
                }
                let has_extent =
                    matches!(emitter, Emitter::Rectangle { .. } | Emitter::Sphere { .. });
                // So little, seen from its edge, that its inverse is infinite.
                if arrival.strength < f32::MIN_POSITIVE {
                    return None;
                }
                Some(Direct {
                    direction: arrival.direction,
                    cosine: arrival.cosine,
                    light: self.emission.map(|value| value * arrival.strength),
                    density: if has_extent { 1.0 / arrival.strength } else { 0.0 },
                })
            }
            Source::Dome(table) => {
                let (direction, density) = table.sample(square)?;
                let cosine = direction.dot(point.normal);
                if cosine <= 0.0 || views.caster.occluded(&views.ray(point, direction)) {
                    return None;
                }
                let mut light = table.dome.radiance(direction);
                for (light, factor) in light.iter_mut().zip(self.emission) {
                    *light *= factor / density;
                }
                Some(Direct { direction, cosine, light, density })
            }
        }
    }

    /// Radiance that a ray from a surface point meets before `distance_m`, with the density with
    /// which [`sample`](Self::sample) finds its direction.
    pub fn met(
        &self,
        views: &Views,
        point: SurfacePoint,
        direction: Vec3,
        distance_m: f32,
    ) -> Option<(Radiance, f32)> {
        match &self.source {
            Source::Emitter(emitter) => {
                let (along, strength) = emitter.met(point, direction)?;
                // A panel may lie on the surface that the ray met: where light sampling finds it,
                // it has to be found here, too.
                let is_flush = || {
                    along * (1.0 - FLUSH) - 1e2 * views.offset_m < distance_m
                        && views.is_free(point, point.position + direction * along)
                };
                (along < distance_m || is_flush()).then(|| (self.emission, 1.0 / strength))
            }
            Source::Dome(table) => {
                if distance_m < f32::INFINITY {
                    return None;
                }
                let mut radiance = table.dome.radiance(direction);
                for (radiance, factor) in radiance.iter_mut().zip(self.emission) {
                    *radiance *= factor;
                }
                Some((radiance, table.density(direction)))
            }
        }
    }
}

/// Directions of a dome, the bright ones more often.
struct DomeTable {
    dome: Dome,
    columns: usize,
    rows: usize,
    /// Over all cells, row by row.
    cumulated: Vec<f32>,
}

/// The finest table, in rows; columns are twice as many.
const DOME_ROWS: usize = 256;

impl DomeTable {
    fn new(dome: Dome) -> Self {
        let rows = dome.image.height().clamp(1, DOME_ROWS);
        let columns = 2 * rows;
        let mut table = Self { dome, columns, rows, cumulated: Vec::new() };
        let mut sum = 0.0f64;
        // As fine as the image, so that a sun of a few pixels is not missed.
        let fine = table.dome.image.height().div_ceil(rows).clamp(1, 32);
        let power = |row: usize, column: usize| {
            let within = (0..fine * fine).map(|k| {
                let part = Vec2::new((k % fine) as f32 + 0.5, (k / fine) as f32 + 0.5);
                let place = Vec2::new(column as f32, row as f32) + part / fine as f32;
                let radiance = table.dome.radiance(table.direction(place));
                radiance.iter().map(|&value| f64::from(value.max(0.0))).sum::<f64>()
            });
            within.sum::<f64>() / (fine * fine) as f64
        };
        let powers: Vec<f64> = (0..rows * columns)
            .into_par_iter()
            .map(|cell| power(cell / columns, cell % columns))
            .collect();
        // A little everywhere: between the places that were asked there may be light.
        let least = 1e-4 * powers.iter().sum::<f64>() / powers.len() as f64;
        let least = if least > 0.0 { least } else { 1.0 };
        let mut sums = Vec::with_capacity(rows * columns);
        for (cell, power) in powers.iter().enumerate() {
            sum += (power + least) * f64::from(table.solid_angle(cell / columns));
            sums.push(sum);
        }
        table.cumulated = sums.iter().map(|value| (value / sum) as f32).collect();
        table
    }

    /// The direction of a place in cells.
    fn direction(&self, place: Vec2) -> Vec3 {
        let polar = place.y / self.rows as f32 * PI;
        let azimuth = place.x / self.columns as f32 * 2.0 * PI;
        Vec3::new(polar.sin() * azimuth.sin(), polar.sin() * azimuth.cos(), polar.cos())
    }

    /// The height of a row's upper edge.
    fn edge(&self, row: usize) -> f32 {
        (row as f32 / self.rows as f32 * PI).cos()
    }

    fn solid_angle(&self, row: usize) -> f32 {
        (self.edge(row) - self.edge(row + 1)) * 2.0 * PI / self.columns as f32
    }

    fn probability(&self, cell: usize) -> f32 {
        let before = if cell > 0 { self.cumulated[cell - 1] } else { 0.0 };
        self.cumulated[cell] - before
    }

    /// A direction and its density by solid angle.
    fn sample(&self, square: Vec2) -> Option<(Vec3, f32)> {
        let last = self.cumulated.len() - 1;
        let cell = self.cumulated.partition_point(|&sum| sum <= square.x).min(last);
        let probability = self.probability(cell);
        if probability <= 0.0 {
            return None;
        }
        // What the choice leaves of the number is even in [0, 1) again.
        let rest = (square.x - (self.cumulated[cell] - probability)) / probability;
        let row = cell / self.columns;
        let height = self.edge(row) + square.y * (self.edge(row + 1) - self.edge(row));
        let azimuth =
            ((cell % self.columns) as f32 + rest.clamp(0.0, 1.0)) / self.columns as f32 * 2.0 * PI;
        let across = (1.0 - height * height).max(0.0).sqrt();
        let direction = Vec3::new(across * azimuth.sin(), across * azimuth.cos(), height);
        Some((direction, probability / self.solid_angle(row)))
    }

    fn density(&self, direction: Vec3) -> f32 {
        let azimuth = direction.x.atan2(direction.y).rem_euclid(2.0 * PI);
        let polar = direction.truncate().length().atan2(direction.z);
        let row = ((polar / PI * self.rows as f32) as usize).min(self.rows - 1);
        let column = ((azimuth / (2.0 * PI) * self.columns as f32) as usize).min(self.columns - 1);
        self.probability(row * self.columns + column) / self.solid_angle(row)
    }
}

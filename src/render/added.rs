//! Lights that an artist adds, and the sampling of directions towards them.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::latlong;
use crate::math::rgb::Radiance;
use crate::render::edits::{AddedLight, Shape};
use crate::scene::{Dome, Emitter, SurfacePoint, Views};

/// A light that was added.
pub struct Added {
    source: Source,
    pub emission: Radiance,
}

enum Source {
    Emitter(Emitter),
    Dome(DomeTable),
}

/// A light that was added, with what its sampling needs.
pub enum Packed<'a> {
    Emitter(&'a Emitter),
    /// With the cumulated probabilities of its cells, row by row.
    Dome {
        dome: &'a Dome,
        columns: usize,
        rows: usize,
        cumulated: &'a [f32],
    },
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
        Self { source, emission: light.sent().map(|value| value as f32) }
    }

    /// What it is; `None` for a dome.
    pub fn emitter(&self) -> Option<Emitter> {
        match &self.source {
            Source::Emitter(emitter) => Some(*emitter),
            Source::Dome(_) => None,
        }
    }

    /// For tracers that cannot follow references.
    pub fn packed(&self) -> Packed<'_> {
        match &self.source {
            Source::Emitter(emitter) => Packed::Emitter(emitter),
            Source::Dome(DomeTable { dome, columns, rows, cumulated }) => {
                Packed::Dome { dome, columns: *columns, rows: *rows, cumulated }
            }
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
        latlong::direction(place / Vec2::new(self.columns as f32, self.rows as f32))
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
        let (column, row) = latlong::cell(direction, (self.columns, self.rows));
        self.probability(row * self.columns + column) / self.solid_angle(row)
    }
}

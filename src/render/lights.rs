//! The recovered lights of a scene, of which one is sampled at a time.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::Random;
use crate::reconstruct::RecoveredLight;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::lobes::Lobe;
use crate::reconstruct::transport::geometric_factor;
use crate::render::edits::Edits;
use crate::render::groups;
use crate::render::scene::Solved;
use crate::render::sky::Sky;
use crate::scene::emitter::Arrival;
use crate::scene::{Capture, Emitter, KnownLight, SurfacePoint, Views};

/// A recovered light that shines.
#[derive(Clone, Debug)]
pub struct Light {
    pub shape: VirtualLight,
    /// Of a light that the artist gave.
    pub emitter: Option<Emitter>,
    /// E per lobe; one entry for a light that the artist gave.
    pub lobes: Vec<(Lobe, Radiance)>,
    /// The layer that its light goes into.
    pub layer: usize,
}

/// All recovered lights, and the probability with which each is sampled at a place.
pub struct Recovered {
    lights: Vec<Light>,
    sky: Sky,
    grid: Arc<IrradianceGrid>,
    /// Per bin of the grid the lights' cumulated probabilities.
    cumulated: Vec<f32>,
    /// Per bin, for each of as many equal parts of [0, 1) as there are lights, the light that its
    /// lowest number chooses: from there the search is a step or two (Chen and Asau 1974).
    starts: Vec<u16>,
}

/// Mean irradiance from each recovered light, shadows included, in the bins of a grid over the
/// capture's geometry. A bin is a cell with one of six sides that surfaces may face.
pub struct IrradianceGrid {
    /// Indices into the recovered lights of those that shine.
    shining: Vec<usize>,
    low: Vec3,
    cell_m: Vec3,
    /// Cells along each axis.
    side: usize,
    /// Per bin, the sum over the channels for each shining light.
    irradiance: Vec<f32>,
}

/// Light that reaches a surface point from one direction, were nothing in the way.
#[derive(Clone, Copy, Debug)]
pub struct Arriving {
    /// Irradiance of the surface point.
    pub irradiance: Radiance,
    /// (n+2)/2 cosⁿγ per mirror direction and exponent is evaluated for this.
    pub direction: Vec3,
}

/// The most irradiances that a grid holds, 16 MB.
const MOST: usize = 4 << 20;
const FINEST: usize = 16;
/// Part of the probability that is even among all lights, so that a light which reaches no point
/// that a bin was measured at is sampled all the same.
const EVEN: f32 = 0.15;
/// The sides that surfaces may face.
const SIDES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
/// Surface points over the whole geometry, by area; each gives one point per side of the surface.
const SURFACE_POINTS: usize = 1 << 15;
/// The most points that one bin is measured at.
const POINTS_PER_BIN: usize = 8;
/// Points in the air of a cell, for objects that may be set there.
const POINTS_IN_AIR: usize = 4;

/// What becomes of one of the recovered lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Use {
    /// Factor on its emission.
    pub factor: f32,
    /// The layer that its light goes into.
    pub layer: usize,
    /// How much more often than by its irradiance it is sampled, relative to the other lights. It
    /// changes how fast a picture converges, not what it converges to.
    pub importance: f32,
}

impl Recovered {
    /// The lights with the edits' changes of their groups, in one layer.
    pub fn new(
        grid: Arc<IrradianceGrid>,
        capture: &Capture,
        solved: &Solved,
        edits: &Edits,
    ) -> Self {
        let (factors, _) = groups::factors(capture, solved, edits);
        let uses = factors.iter().map(|&factor| Use { factor, layer: 0, importance: factor });
        Self::used(grid, capture, solved, &uses.collect::<Vec<Use>>())
    }

    /// The lights as `uses` says of each.
    pub fn used(
        grid: Arc<IrradianceGrid>,
        capture: &Capture,
        solved: &Solved,
        uses: &[Use],
    ) -> Self {
        let mut lights = Vec::new();
        // Per light its place among those that the grid was measured for, and its importance.
        let mut columns = Vec::new();
        for (column, &index) in grid.shining.iter().enumerate() {
            let Use { factor, layer, importance } = uses[index];
            if let Some(light) = Light::recovered(capture, solved, index, factor) {
                lights.push(Light { layer, ..light });
                columns.push((column, importance));
            }
        }
        let count = lights.len() as f32;
        let bins = grid.irradiance.par_chunks_exact(grid.shining.len().max(1));
        let cumulated: Vec<f32> = bins
            .flat_map_iter(|bin| {
                let irradiance = |&(column, importance): &(usize, f32)| importance * bin[column];
                let total: f32 = columns.iter().map(irradiance).sum();
                let mut sum = 0.0;
                columns
                    .iter()
                    .map(move |column| {
                        let share =
                            if total > 0.0 { irradiance(column) / total } else { 1.0 / count };
                        sum += EVEN / count + (1.0 - EVEN) * share;
                        sum
                    })
                    .collect::<Vec<f32>>()
            })
            .collect();
        let sky = Sky::new(&lights);
        let starts = starts(&cumulated, lights.len());
        Self { lights, sky, grid, cumulated, starts }
    }

    /// The same lights with other changes of their groups.
    pub fn with_groups(&self, capture: &Capture, solved: &Solved, edits: &Edits) -> Self {
        Self::new(self.grid.clone(), capture, solved, edits)
    }

    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Radiance of the sky from a direction, and its layer.
    pub fn sky(&self, direction: Vec3) -> Option<(usize, Radiance)> {
        self.sky.radiance(direction)
    }

    /// One of the lights, chosen by a number in [0, 1), divided by its probability.
    pub fn sample(
        &self,
        views: &Views,
        point: SurfacePoint,
        choice: f32,
        square: Vec2,
    ) -> Option<(Arriving, &Light)> {
        let count = self.lights.len();
        if count == 0 {
            return None;
        }
        let first = self.grid.bin(point) * count;
        let cumulated = &self.cumulated[first..first + count];
        let part = ((choice * count as f32) as usize).min(count - 1);
        let start = usize::from(self.starts[first + part]);
        let rest = cumulated[start..].iter().position(|&sum| sum > choice);
        let index = rest.map_or(count - 1, |steps| start + steps);
        let before = if index > 0 { cumulated[index - 1] } else { 0.0 };
        let probability = cumulated[index] - before;
        let light = &self.lights[index];
        let (arriving, arrival) = light.arriving(point, views.offset_m, square)?;
        let irradiance = arriving.irradiance.map(|value| value / probability);
        light
            .is_free(views, point, arrival, square)
            .then_some((Arriving { irradiance, ..arriving }, light))
    }
}

/// Where the search for a number begins in each bin, see [`Recovered::starts`].
fn starts(cumulated: &[f32], count: usize) -> Vec<u16> {
    let bins = cumulated.par_chunks_exact(count.max(1));
    bins.flat_map_iter(|bin| {
        let mut light = 0;
        (0..count).map(move |part| {
            // A little below, for numbers that are rounded up into this part.
            let lowest = part as f32 / count as f32 * (1.0 - 4.0 * f32::EPSILON);
            while light + 1 < count && bin[light] <= lowest {
                light += 1;
            }
            // Lights beyond what it can say are found from the last one that it can.
            light.min(usize::from(u16::MAX)) as u16
        })
    })
    .collect()
}

impl IrradianceGrid {
    /// Measured by shadow rays through the capture's own geometry. The seed is fixed: the grid
    /// changes how fast a picture converges, not what it converges to.
    pub fn new(views: &Views, solved: &Solved) -> Self {
        let capture = views.capture;
        let mut shining = Vec::new();
        let mut lights = Vec::new();
        for index in 0..solved.light.lights.lights.len() {
            if let Some(light) = Light::recovered(capture, solved, index, 1.0) {
                shining.push(index);
                lights.push(light);
            }
        }
        let (low, high) = capture.mesh.bounds().unwrap_or_default();
        let cells = (MOST / SIDES.len() / lights.len().max(1)) as f32;
        let side = (cells.cbrt() as usize).clamp(1, FINEST);
        let cell_m = ((high - low) / side as f32).max(Vec3::splat(1e-6));
        let mut grid = Self { shining, low, cell_m, side, irradiance: Vec::new() };
        if lights.is_empty() {
            return grid;
        }
        let mut points = vec![Vec::new(); side * side * side * SIDES.len()];
        for point in surface_points(&capture.mesh) {
            for normal in [point.normal, -point.normal] {
                let point = SurfacePoint { normal, ..point };
                let bin: &mut Vec<SurfacePoint> = &mut points[grid.bin(point)];
                if bin.len() < POINTS_PER_BIN {
                    bin.push(point);
                }
            }
        }
        grid.irradiance = points
            .par_chunks_exact(SIDES.len())
            .enumerate()
            .flat_map_iter(|(cell, points)| grid.cell(views, &lights, cell, points))
            .collect();
        grid
    }

    /// Of the bin that holds a surface point; of the nearest one outside the grid.
    fn bin(&self, point: SurfacePoint) -> usize {
        let side = self.side;
        let place = ((point.position - self.low) / self.cell_m).to_array();
        let [x, y, z] = place.map(|index| (index.max(0.0) as usize).min(side - 1));
        let axis = point.normal.abs().max_position();
        let sign = usize::from(point.normal[axis] < 0.0);
        ((z * side + y) * side + x) * SIDES.len() + 2 * axis + sign
    }

    /// The bins of one cell, given the surface points in each.
    fn cell(
        &self,
        views: &Views,
        lights: &[Light],
        cell: usize,
        points: &[Vec<SurfacePoint>],
    ) -> Vec<f32> {
        let mut random = Random::new(0, 1, cell as u64);
        let least_m = 0.5 * self.cell_m.length();
        let corner = [cell % self.side, cell / self.side % self.side, cell / self.side / self.side];
        let corner = Vec3::from(corner.map(|index| index as f32));
        let place = |within: Vec3| self.low + (corner + within) * self.cell_m;
        let middle = place(Vec3::splat(0.5));
        let in_air: [Vec3; POINTS_IN_AIR] =
            std::array::from_fn(|_| place(Vec3::from(std::array::from_fn(|_| random.uniform()))));
        let squares: [Vec2; POINTS_PER_BIN] = std::array::from_fn(|_| random.point());

        let mut bins = vec![0.0; SIDES.len() * lights.len()];
        for (index, light) in lights.iter().enumerate() {
            // A light below the horizon of one point may be above that of another, and an object
            // in the air may face any way.
            let irradiance = |position: Vec3, normal: Vec3| {
                let direction = light.direction_from(position);
                let normal_tilted = (normal + direction).normalize_or(normal);
                let tilted = SurfacePoint { position, normal: normal_tilted };
                let arriving = light.arriving(tilted, least_m, Vec2::splat(0.5));
                let facing = direction.dot(normal).max(0.0) + 0.1;
                arriving.map_or(0.0, |(a, _)| facing * a.irradiance.iter().sum::<f32>())
            };
            let mut in_air_part = None;
            for (side, points) in points.iter().enumerate() {
                let (irradiance, part) = if points.is_empty() {
                    let part = *in_air_part.get_or_insert_with(|| {
                        let facing = in_air.map(|position| SurfacePoint {
                            position,
                            normal: light.direction_from(position),
                        });
                        light.visible_part(views, &facing, &squares)
                    });
                    (irradiance(middle, SIDES[side]), part)
                } else {
                    let sum: f32 = points.iter().map(|p| irradiance(p.position, p.normal)).sum();
                    let part = light.visible_part(views, points, &squares);
                    (sum / points.len() as f32, part)
                };
                bins[side * lights.len() + index] = irradiance * part;
            }
        }
        bins
    }
}

/// Points on all surfaces, as many as their area asks for, in an order that is random.
fn surface_points(mesh: &Mesh) -> impl Iterator<Item = SurfacePoint> {
    let mut cumulated = Vec::with_capacity(mesh.triangles.len());
    let mut total = 0.0f64;
    for triangle in 0..mesh.triangles.len() {
        total += f64::from(mesh.area(triangle));
        cumulated.push(total);
    }
    let mut random = Random::new(0, 0, 0);
    let count = if total > 0.0 { SURFACE_POINTS } else { 0 };
    (0..count).map(move |_| {
        let place = f64::from(random.uniform()) * total;
        let triangle = cumulated.partition_point(|&sum| sum <= place).min(cumulated.len() - 1);
        let [a, b, c] = mesh.corners(triangle);
        // Uniform over the triangle.
        let (root, across) = (random.uniform().sqrt(), random.uniform());
        let position = a + root * ((b - a) + across * (c - b));
        SurfacePoint { position, normal: mesh.normal(triangle) }
    })
}

impl Light {
    /// One of the recovered lights with its emission times a factor; `None` if it is dark.
    fn recovered(capture: &Capture, solved: &Solved, index: usize, factor: f32) -> Option<Self> {
        let RecoveredLight { lights, lobes, emission, .. } = &solved.light;
        let shape = lights.lights[index];
        let emitter = match shape.kind {
            LightKind::Known(known) => match &capture.lights[known] {
                KnownLight::Shape { emitter, .. } => Some(*emitter),
                _ => return None,
            },
            _ => None,
        };
        let lobes: Vec<(Lobe, Radiance)> = lobes
            .of(index)
            .map(|lobe| (lobes.lobes[lobe], emission[lobe].map(|value| factor * value as f32)))
            .filter(|(_, emission)| emission.iter().any(|&value| value > 0.0))
            .collect();
        (!lobes.is_empty()).then_some(Self { shape, emitter, lobes, layer: 0 })
    }

    /// Unit direction from a position to its middle.
    fn direction_from(&self, position: Vec3) -> Vec3 {
        match &self.emitter {
            Some(emitter) => emitter.direction_from(position),
            None => self.shape.direction_from(position),
        }
    }

    /// Whether nothing is in the way of what [`arriving`](Self::arriving) found.
    fn is_free(
        &self,
        views: &Views,
        point: SurfacePoint,
        arrival: Option<Arrival>,
        square: Vec2,
    ) -> bool {
        match arrival {
            Some(arrival) => arrival.is_free(views, point),
            None => self.shape.is_seen(views, point, square),
        }
    }

    /// The part of it that a few points see, by Krichevsky's and Trofimov's estimate: what none of
    /// them sees may be seen from beside them.
    fn visible_part(&self, views: &Views, points: &[SurfacePoint], squares: &[Vec2]) -> f32 {
        let is_seen = |(&point, &square): (&SurfacePoint, &Vec2)| {
            let arriving = self.arriving(point, views.offset_m, square);
            arriving.is_some_and(|(_, arrival)| self.is_free(views, point, arrival, square))
        };
        let seen = points.iter().zip(squares).filter(|&pair| is_seen(pair)).count();
        (seen as f32 + 0.5) / (points.len() as f32 + 1.0)
    }

    /// Irradiance of a surface at a position that faces the light, were nothing in the way; for a
    /// light that the artist gave the part that comes from its middle.
    pub fn facing(&self, position: Vec3) -> Option<Arriving> {
        let normal = self.direction_from(position);
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

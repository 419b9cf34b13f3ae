//! The recovered lights of a scene, and the choice of one of them at random, in proportion to its
//! contribution.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::rgb::Radiance;
use crate::reconstruct::lights::LightKind;
use crate::render::edits::Edits;
pub use crate::render::grid::IrradianceGrid;
use crate::render::groups;
pub use crate::render::light::{Arriving, Light};
use crate::render::scene::Solved;
use crate::render::sky::Sky;
use crate::scene::emitter::Arrival;
use crate::scene::{Capture, SurfacePoint, Views};

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

/// Part of the probability that is even among all lights, so that a light which reaches no point
/// that was measured is sampled all the same.
const EVEN: f32 = 0.05;
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
        let bins = grid.bins();
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

    /// Per bin of the grid the lights' cumulated probabilities, and for each of as many equal parts of
    /// [0, 1) as there are lights the light with which a search for its numbers begins.
    pub fn choices(&self) -> (&[f32], &[u16]) {
        (&self.cumulated, &self.starts)
    }

    pub fn grid(&self) -> &IrradianceGrid {
        &self.grid
    }

    pub fn sky_cells(&self) -> &Sky {
        &self.sky
    }

    /// Radiance of the sky from a direction, and its layer.
    pub fn sky(&self, direction: Vec3) -> Option<(usize, Radiance)> {
        self.sky.radiance(direction)
    }

    /// One of the lights, chosen by a number in [0, 1).
    pub fn choose(
        &self,
        views: &Views,
        point: SurfacePoint,
        choice: f32,
        square: Vec2,
    ) -> Option<Chosen<'_>> {
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
        Some(Chosen { arriving, light, probability, arrival, square })
    }

    /// The cells of the sky that hold a direction from a surface point, each with its light there,
    /// were nothing in the way, and the probability with which it is chosen.
    pub fn cells(
        &self,
        point: SurfacePoint,
        direction: Vec3,
    ) -> impl Iterator<Item = (Arriving, &Light, f32)> {
        let first = self.grid.bin(point) * self.lights.len();
        self.sky.holding(direction).filter_map(move |index| {
            let cumulated = &self.cumulated[first..];
            let before = if index > 0 { cumulated[index - 1] } else { 0.0 };
            let light = &self.lights[index];
            let (arriving, _) = light.arriving(point, 0.0, Vec2::ZERO)?;
            Some((arriving, light, cumulated[index] - before))
        })
    }
}

/// A light that was chosen, were nothing in the way.
pub struct Chosen<'a> {
    pub arriving: Arriving,
    pub light: &'a Light,
    pub probability: f32,
    arrival: Option<Arrival>,
    square: Vec2,
}

impl Chosen<'_> {
    /// Of a cell of the sky the direction that is looked at, which has a density of 1 over its solid
    /// angle, and that solid angle.
    pub fn of_sky(&self) -> Option<(Vec3, f32)> {
        let shape = &self.light.shape;
        (shape.kind == LightKind::Sky)
            .then(|| (shape.direction_within(self.square), shape.solid_angle_sr()))
    }

    /// Whether nothing is in the way.
    pub fn is_free(&self, views: &Views, point: SurfacePoint) -> bool {
        self.light.is_free(views, point, self.arrival, self.square)
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

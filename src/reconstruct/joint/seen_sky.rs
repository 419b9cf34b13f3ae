//! The sky as photographs show it: pixels beyond the known geometry see the unknown light itself.

use std::collections::BTreeMap;

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use crate::math::rgb::{Radiance, Rgb};
use crate::math::sampling::fibonacci;
use crate::reconstruct::joint::background::{LightSet, half_angle};
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::scene::agreement::brightness;
use crate::scene::{Views, agreeing};

/// Cells over the whole sphere, about 5° across: a window of a metre is that wide at 11 m.
const CELLS: usize = 2000;
/// One pixel of so many in either direction is read; a cell has hundreds.
const STRIDE: usize = 2;
/// Pixels of a photograph within a cell that tell its mean.
const ENOUGH_PIXELS: usize = 8;
/// Part of the pixels of a photograph within a cell that are about as bright as their mean. A lamp or the
/// sun in a cell, which says nothing of the light around it, leaves most of them far darker. Set, like the
/// next, with the random scene coat-0 in view, whose lamps are 100 times as bright as its walls.
const ALIKE: f64 = 0.75;
/// Pixels are about as bright as their mean within this factor either way.
const AS_BRIGHT: f64 = 2.0;

/// Cells of the sky that photographs show, with their radiance.
#[derive(Clone, Debug)]
pub struct SeenSky {
    /// Unit directions towards all cells of the sphere.
    pub directions: Vec<Vec3>,
    /// The cells that photographs show.
    pub cells: Vec<usize>,
    /// Of each of these, in the photographs' unit.
    pub radiance: Vec<Rgb>,
}

/// What a photograph shows of a cell.
#[derive(Default)]
struct Shown {
    pixels: Vec<Radiance>,
    /// Pixels without a valid value: where some are clipped the others are the darker ones.
    invalid: usize,
}

impl Shown {
    /// Its mean radiance, where it shows about the same all over.
    fn mean(&self) -> Option<Rgb> {
        if self.pixels.len() < ENOUGH_PIXELS || self.invalid > 0 {
            return None;
        }
        let count = self.pixels.len() as f64;
        let mean: Rgb = std::array::from_fn(|c| {
            self.pixels.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>() / count
        });
        let typical: f64 = mean.iter().sum();
        let range = typical / AS_BRIGHT..=typical * AS_BRIGHT;
        let alike = self.pixels.iter().filter(|pixel| range.contains(&brightness(pixel))).count();
        (alike as f64 >= ALIKE * count).then_some(mean)
    }
}

impl SeenSky {
    /// The cells in which all photographs that look there beyond the known geometry see about the
    /// same: what is nearer than the sky is seen in different directions from different places.
    /// `None` where there are none.
    pub fn find(views: &Views) -> Option<Self> {
        let directions: Vec<Vec3> = fibonacci(CELLS, 0.0).collect();
        let mut of_cell: BTreeMap<usize, Vec<Rgb>> = BTreeMap::new();
        for index in 0..views.buffers.len() {
            for (cell, shown) in shown(views, index, &directions) {
                if let Some(mean) = shown.mean() {
                    of_cell.entry(cell).or_default().push(mean);
                }
            }
        }
        let (mut cells, mut radiance) = (Vec::new(), Vec::new());
        for (cell, seen) in of_cell {
            let brightness = seen.iter().map(|rgb| rgb.iter().sum());
            let mean: Rgb = std::array::from_fn(|c| {
                seen.iter().map(|rgb| rgb[c]).sum::<f64>() / seen.len() as f64
            });
            if agreeing(brightness).all(|is_near| is_near) && mean.iter().any(|&value| value > 0.0)
            {
                cells.push(cell);
                radiance.push(mean);
            }
        }
        (!radiance.is_empty()).then_some(Self { directions, cells, radiance })
    }

    /// The cells that photographs show, as lights.
    pub fn set(&self) -> LightSet {
        let (mut set, half_angle) = (LightSet::default(), half_angle(self.directions.len()));
        for &cell in &self.cells {
            let travels = -self.directions[cell];
            let light = VirtualLight::distant(LightKind::Sky, travels, half_angle);
            set.push(light, &[(travels, 0.0)]);
        }
        set
    }
}

/// The pixels of one photograph that see no geometry, nor any beside them, by cell.
fn shown(views: &Views, index: usize, directions: &[Vec3]) -> BTreeMap<usize, Shown> {
    let buffer = &views.buffers[index];
    let camera = buffer.camera;
    let beyond = |x: usize, y: usize| {
        (y - 1..=y + 1).all(|y| (x - 1..=x + 1).all(|x| buffer.triangle(x, y).is_none()))
    };
    let pixel = |x: usize, y: usize| {
        if !beyond(x, y) || buffer.image.is_masked(x, y) {
            return None;
        }
        let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let towards = camera.direction(center)?.as_vec3();
        let nearest = |a: &usize, b: &usize| {
            directions[*a].dot(towards).total_cmp(&directions[*b].dot(towards))
        };
        Some(((0..directions.len()).max_by(nearest)?, buffer.image.radiance(x, y)))
    };
    let lines: Vec<usize> = (1..camera.height.saturating_sub(1)).step_by(STRIDE).collect();
    let found: Vec<Vec<_>> = lines
        .into_par_iter()
        .map(|y| {
            let line = (1..camera.width.saturating_sub(1)).step_by(STRIDE);
            line.filter_map(|x| pixel(x, y)).collect()
        })
        .collect();
    let mut cells: BTreeMap<usize, Shown> = BTreeMap::new();
    for (cell, radiance) in found.into_iter().flatten() {
        let shown = cells.entry(cell).or_default();
        match radiance {
            Some(radiance) => shown.pixels.push(radiance),
            None => shown.invalid += 1,
        }
    }
    cells
}

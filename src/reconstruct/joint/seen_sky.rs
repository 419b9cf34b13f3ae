//! The sky as photographs show it: pixels beyond the known geometry see the unknown light itself.

use std::collections::BTreeMap;

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::sampling::fibonacci;
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::scene::{Views, agreeing};

/// Cells over the whole sphere, about 5° across: a window of a metre is that wide at 11 m.
const CELLS: usize = 2000;
/// One pixel of so many in either direction is read; a cell has hundreds.
const STRIDE: usize = 2;
/// Pixels of a photograph within a cell that tell its mean.
const ENOUGH_PIXELS: usize = 8;

/// Cells of the sky that photographs show, with their radiance.
#[derive(Clone, Debug)]
pub struct SeenSky {
    pub set: LightSet,
    /// Per cell, in the photographs' unit.
    pub radiance: Vec<Rgb>,
}

/// Sum and number of some pixels.
type Sum = (Rgb, usize);

impl SeenSky {
    /// The cells in which all photographs that look there beyond the known geometry see about the
    /// same: what is nearer than the sky is seen in different directions from different places.
    /// `None` where there are none.
    pub fn find(views: &Views) -> Option<Self> {
        let directions: Vec<Vec3> = fibonacci(CELLS, 0.0).collect();
        let of_photograph: Vec<BTreeMap<usize, Sum>> =
            (0..views.buffers.len()).map(|index| sums(views, index, &directions)).collect();
        let mut of_cell: BTreeMap<usize, Vec<Rgb>> = BTreeMap::new();
        for (cell, (sum, count)) in of_photograph.into_iter().flatten() {
            if count >= ENOUGH_PIXELS {
                let mean = sum.map(|value| value / count as f64);
                of_cell.entry(cell).or_default().push(mean);
            }
        }
        // A cone with a cell's share of the sphere.
        let half_angle = 2.0 * (1.0 / CELLS as f32).sqrt().asin();
        let (mut set, mut radiance) = (LightSet::default(), Vec::new());
        for (cell, seen) in of_cell {
            let brightness = seen.iter().map(|rgb| rgb.iter().sum());
            let mean: Rgb = std::array::from_fn(|c| {
                seen.iter().map(|rgb| rgb[c]).sum::<f64>() / seen.len() as f64
            });
            if agreeing(brightness).all(|is_near| is_near) && mean.iter().any(|&value| value > 0.0)
            {
                let towards = directions[cell];
                let light = VirtualLight::distant(LightKind::Sky, -towards, half_angle);
                set.push(light, &[(-towards, 0.0)]);
                radiance.push(mean);
            }
        }
        (!radiance.is_empty()).then_some(Self { set, radiance })
    }
}

/// The pixels of one photograph that see no geometry, nor any beside them, by cell.
fn sums(views: &Views, index: usize, directions: &[Vec3]) -> BTreeMap<usize, Sum> {
    let buffer = &views.buffers[index];
    let camera = buffer.camera;
    let beyond = |x: usize, y: usize| {
        (y - 1..=y + 1).all(|y| (x - 1..=x + 1).all(|x| buffer.hit(x, y).is_none()))
    };
    let pixel = |x: usize, y: usize| {
        let radiance = buffer.image.radiance(x, y).filter(|_| beyond(x, y))?;
        let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let towards = camera.direction(center)?.as_vec3();
        let nearest = |a: &usize, b: &usize| {
            directions[*a].dot(towards).total_cmp(&directions[*b].dot(towards))
        };
        Some(((0..directions.len()).max_by(nearest)?, radiance))
    };
    let lines: Vec<usize> = (1..camera.height.saturating_sub(1)).step_by(STRIDE).collect();
    let found: Vec<Vec<_>> = lines
        .into_par_iter()
        .map(|y| {
            let line = (1..camera.width.saturating_sub(1)).step_by(STRIDE);
            line.filter_map(|x| pixel(x, y)).collect()
        })
        .collect();
    let mut sums: BTreeMap<usize, Sum> = BTreeMap::new();
    for (cell, radiance) in found.into_iter().flatten() {
        let (sum, count) = sums.entry(cell).or_insert(([0.0; CHANNELS], 0));
        sum.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += f64::from(value));
        *count += 1;
    }
    sums
}

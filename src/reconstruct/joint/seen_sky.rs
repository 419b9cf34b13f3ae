//! The sky as photographs show it: pixels beyond the known geometry see the unknown light itself.

use std::collections::BTreeMap;
use std::f64::consts::PI;

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

/// Cells that two photographs see from different places, counted by pairs of photographs, below which
/// they do not tell whether what they see is near.
const ENOUGH_PAIRS: usize = 20;
/// What two photographs see in one direction differs so much, as a part of what one photograph sees in
/// neighbouring cells, if the parallax between them is half a cell: then most cells stand where a
/// neighbour belongs. The skies of the random scenes, of outdoor-open and of kitchen-full show 0.03 to
/// 0.34; rooms of the random scenes of which a part is not modelled, and `large`, 0.83 to 1.9.
const PARALLAX: f64 = 0.5;

/// Cells of the sky that photographs show, with their radiance.
#[derive(Clone, Debug)]
pub struct SeenSky {
    /// Unit directions towards all cells of the sphere.
    pub directions: Vec<Vec3>,
    /// The cells that photographs show.
    pub cells: Vec<usize>,
    /// Of each of these, in the photographs' unit.
    pub radiance: Vec<Rgb>,
    /// Whether photographs from different places show that it is far away: it may be near otherwise.
    pub is_distant: bool,
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
    /// `None` where there are none, or where photographs show that all of it is near.
    pub fn find(views: &Views) -> Option<Self> {
        let directions: Vec<Vec3> = fibonacci(CELLS, 0.0).collect();
        let of_photograph = |index| -> BTreeMap<usize, Rgb> {
            let cells = shown(views, index, &directions).into_iter();
            cells.filter_map(|(cell, shown)| Some((cell, shown.mean()?))).collect()
        };
        let photographs: Vec<_> = (0..views.buffers.len()).map(of_photograph).collect();
        let is_near = is_near(&photographs, &directions);
        if is_near == Some(true) {
            return None;
        }
        let is_distant = is_near == Some(false);
        let mut of_cell: BTreeMap<usize, Vec<Rgb>> = BTreeMap::new();
        for (cell, mean) in photographs.into_iter().flatten() {
            of_cell.entry(cell).or_default().push(mean);
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
        (!radiance.is_empty()).then_some(Self { directions, cells, radiance, is_distant })
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

/// Whether what photographs show beyond the known geometry is near them: from another place they see
/// other parts of it in the same direction. Each photograph is given by the mean radiance of its cells;
/// `None` where too few of these are seen from two places.
fn is_near(photographs: &[BTreeMap<usize, Rgb>], directions: &[Vec3]) -> Option<bool> {
    let level = |cells: &BTreeMap<usize, Rgb>, cell: usize| -> Option<f64> {
        Some(cells.get(&cell)?.iter().sum::<f64>().ln()).filter(|level| level.is_finite())
    };
    // Between the first neighbours of a cell and the second.
    let limit = 1.35 * (4.0 * PI / directions.len() as f64).sqrt();
    let is_beside =
        |a: usize, b: usize| a != b && f64::from(directions[a].dot(directions[b])) > limit.cos();
    let mut beside: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut squares = Vec::new();
    for (k, first) in photographs.iter().enumerate() {
        for second in &photographs[k + 1..] {
            for &cell in first.keys() {
                let Some((a, b)) = level(first, cell).zip(level(second, cell)) else { continue };
                let beside = beside.entry(cell).or_insert_with(|| {
                    (0..directions.len()).filter(|&other| is_beside(cell, other)).collect()
                });
                let of_neighbours: Vec<f64> = [(first, a), (second, b)]
                    .into_iter()
                    .flat_map(|(cells, own)| {
                        beside.iter().filter_map(move |&other| Some(level(cells, other)? - own))
                    })
                    .map(|difference| difference * difference)
                    .collect();
                if !of_neighbours.is_empty() {
                    let mean = of_neighbours.iter().sum::<f64>() / of_neighbours.len() as f64;
                    squares.push([(a - b).powi(2), mean]);
                }
            }
        }
    }
    let median = |k: usize| {
        let mut values: Vec<f64> = squares.iter().map(|pair| pair[k]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    (squares.len() >= ENOUGH_PAIRS).then(|| median(0) > PARALLAX * PARALLAX * median(1))
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// What two cameras, a metre apart, see of a sphere around them of this radius in m, whose brightness
    /// goes by direction from its centre, in the upper half of the cells.
    fn seen(radius: f64, brightness: impl Fn(DVec3) -> f64) -> [BTreeMap<usize, Rgb>; 2] {
        let directions: Vec<Vec3> = fibonacci(CELLS, 0.0).collect();
        [-0.5, 0.5].map(|x| {
            let eye = DVec3::X * x;
            let cell = |(cell, direction): (usize, &Vec3)| {
                // From the eye to the sphere: |eye + t·direction| = radius.
                let direction = direction.as_dvec3();
                let along = eye.dot(direction);
                let t = -along + (along * along + radius * radius - x * x).sqrt();
                let value = brightness((eye + t * direction) / radius);
                (direction.z > 0.0).then_some((cell, [value, 2.0 * value, value]))
            };
            directions.iter().enumerate().filter_map(cell).collect()
        })
    }

    #[test]
    fn what_changes_with_the_place_is_near() {
        let directions: Vec<Vec3> = fibonacci(CELLS, 0.0).collect();
        let of = |radius| {
            is_near(&seen(radius, |p| 1.5 + (3.0 * p.x).sin() * (2.0 * p.y).cos()), &directions)
        };
        // Cells are 0.08 rad across, about 0.16 m on a sphere of 2 m, and 4 m on one of 50 m.
        assert_eq!((of(2.0), of(50.0)), (Some(true), Some(false)));
        // One photograph tells nothing, nor do two that share few cells.
        let [first, second] = seen(2.0, |p| 1.5 + p.x);
        assert_eq!(is_near(std::slice::from_ref(&first), &directions), None);
        let few = second.into_iter().take(ENOUGH_PAIRS - 1).collect();
        assert_eq!(is_near(&[first, few], &directions), None);
        // Black cells have no level to compare.
        assert_eq!(is_near(&seen(2.0, |_| 0.0), &directions), None);
    }
}

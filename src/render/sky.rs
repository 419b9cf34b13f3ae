//! The cells of a recovered sky, with a look-up by direction.

use std::f32::consts::PI;

use glam::Vec3;

use crate::math::rgb::Radiance;
use crate::reconstruct::lights::LightKind;
use crate::render::light::Light;

/// For every direction the few cells that may hold it, so that a ray which escapes need not ask
/// all: a furnished room has hundreds.
#[derive(Clone, Debug, Default)]
pub struct Sky {
    cells: Vec<Cell>,
    /// Per bucket of directions its part of `members`; empty without cells.
    first: Vec<u32>,
    /// Indices into `cells`, in their order.
    members: Vec<u32>,
}

#[derive(Clone, Debug)]
pub struct Cell {
    /// Unit direction to its middle.
    pub towards: Vec3,
    /// Of the cone that it is.
    pub half_angle: f32,
    /// Its index among the lights.
    pub light: usize,
    pub layer: usize,
    pub radiance: Radiance,
}

/// Buckets from pole to pole; twice as many go around.
const ROWS: usize = 32;
const COLUMNS: usize = 2 * ROWS;
/// The angle of half a bucket's diagonal at the equator, and a little for rounding.
const REACH: f32 = 1.01 * std::f32::consts::FRAC_1_SQRT_2 * PI / ROWS as f32;

impl Sky {
    pub fn new(lights: &[Light]) -> Self {
        let all = lights.iter().enumerate();
        let cells = all.filter(|(_, light)| light.shape.kind == LightKind::Sky);
        let cells: Vec<Cell> = cells
            .map(|(index, light)| Cell {
                light: index,
                towards: -light.shape.normal,
                half_angle: light.shape.half_angle,
                layer: light.layer,
                radiance: light.lobes[0].1,
            })
            .collect();
        let mut sky = Self { cells, ..Self::default() };
        if sky.cells.is_empty() {
            return sky;
        }
        for bucket in 0..ROWS * COLUMNS {
            sky.first.push(sky.members.len() as u32);
            let middle = middle(bucket);
            let may_hold =
                |cell: &Cell| middle.angle_between(cell.towards) <= cell.half_angle + REACH;
            let members = sky.cells.iter().enumerate().filter(|(_, cell)| may_hold(cell));
            sky.members.extend(members.map(|(index, _)| index as u32));
        }
        sky.first.push(sky.members.len() as u32);
        sky
    }

    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Per bucket of directions where its part of the second list begins, and at the end the length
    /// of that; the indices of the cells that may hold each bucket's directions. A bucket is a row
    /// from pole to pole, times twice the number of rows, plus a column around +z from +x on.
    pub fn buckets(&self) -> (&[u32], &[u32]) {
        (&self.first, &self.members)
    }

    /// Radiance from a direction, and its layer: of the cell whose middle is nearest, in half-angles
    /// of its cone, if the direction is within that.
    pub fn radiance(&self, direction: Vec3) -> Option<(usize, Radiance)> {
        let cells = self.near(direction);
        let (off, cell) = cells
            .map(|cell| (cell.off(direction), cell))
            .min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        (off <= 1.0).then_some((cell.layer, cell.radiance))
    }

    /// Indices of all lights whose cones hold a direction.
    pub fn holding(&self, direction: Vec3) -> impl Iterator<Item = usize> {
        let cells = self.near(direction);
        cells.filter(move |cell| cell.off(direction) <= 1.0).map(|cell| cell.light)
    }

    /// The cells that may hold a direction.
    fn near(&self, direction: Vec3) -> impl Iterator<Item = &Cell> {
        let range = if self.cells.is_empty() {
            0..0
        } else {
            let bucket = bucket(direction);
            self.first[bucket] as usize..self.first[bucket + 1] as usize
        };
        self.members[range].iter().map(|&index| &self.cells[index as usize])
    }
}

impl Cell {
    /// sin² of half the angle to the middle, in that of the cone's edge; 1 − cos cancels where cells
    /// are small.
    fn off(&self, direction: Vec3) -> f32 {
        let half = 0.5 * (direction - self.towards).length();
        (half / (0.5 * self.half_angle).sin()).powi(2)
    }
}

/// The bucket that a unit direction falls into.
fn bucket(direction: Vec3) -> usize {
    let polar = direction.truncate().length().atan2(direction.z);
    let azimuth = direction.y.atan2(direction.x).rem_euclid(2.0 * PI);
    let row = ((polar / PI * ROWS as f32) as usize).min(ROWS - 1);
    let column = ((azimuth / (2.0 * PI) * COLUMNS as f32) as usize).min(COLUMNS - 1);
    row * COLUMNS + column
}

fn middle(bucket: usize) -> Vec3 {
    let polar = (bucket / COLUMNS) as f32 + 0.5;
    let azimuth = (bucket % COLUMNS) as f32 + 0.5;
    let (polar, azimuth) = (polar / ROWS as f32 * PI, azimuth / COLUMNS as f32 * 2.0 * PI);
    Vec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::{Random, fibonacci};
    use crate::reconstruct::lights::VirtualLight;
    use crate::reconstruct::lobes::Lobe;

    fn direction(random: &mut Random) -> Vec3 {
        let (z, angle) = (2.0 * random.uniform() - 1.0, 2.0 * PI * random.uniform());
        let across = (1.0 - z * z).sqrt();
        Vec3::new(across * angle.cos(), across * angle.sin(), z)
    }

    /// Cells of several sizes, some over others, some of a part of the sky alone.
    fn cells(count: usize) -> Vec<Light> {
        let light = |(index, towards): (usize, Vec3)| {
            let half_angle = [0.02, 0.1, 0.4, 1.2][index % 4];
            let shape = VirtualLight {
                kind: LightKind::Sky,
                normal: -towards,
                half_angle,
                ..VirtualLight::lamp(Vec3::ZERO, 0.1)
            };
            let lobe = Lobe { light: index, direction: -towards, exponent: 0.0 };
            Light { shape, emitter: None, lobes: vec![(lobe, [index as f32; 3])], layer: index }
        };
        fibonacci(count, 0.3).enumerate().map(light).collect()
    }

    #[test]
    fn the_cell_is_the_nearest_of_all() {
        let mut random = Random::new(5, 0, 0);
        for count in [0, 1, 7, 300] {
            let lights = cells(count);
            let sky = Sky::new(&lights);
            let mut held = 0;
            for _ in 0..5000 {
                let direction = direction(&mut random);
                // In double precision, by angles.
                let off = |light: &Light| {
                    let towards = -light.shape.normal.as_dvec3();
                    let half = direction.as_dvec3().distance(towards) / 2.0;
                    (half / (0.5 * f64::from(light.shape.half_angle)).sin()).min(1e3)
                };
                let mut offs: Vec<(f64, usize)> =
                    lights.iter().map(|light| (off(light), light.layer)).collect();
                offs.sort_by(|a, b| a.0.total_cmp(&b.0));
                let clear = |a: f64, b: f64| (a - b).abs() > 1e-4;
                let found = sky.radiance(direction).map(|(layer, _)| layer);
                match offs[..] {
                    [] => assert_eq!(found, None),
                    [(best, layer), ref rest @ ..] => {
                        if !clear(best, 1.0) || rest.first().is_some_and(|r| !clear(best, r.0)) {
                            continue;
                        }
                        assert_eq!(found, (best < 1.0).then_some(layer), "{direction}");
                        held += usize::from(best < 1.0);
                    }
                }
            }
            assert!(count == 0 || held > 0);
        }
    }
}

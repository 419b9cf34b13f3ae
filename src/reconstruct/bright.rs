//! Photographed surfaces as emitters: small cells of them, sampled by how bright they are.
//!
//! A sunlit patch, or the wall beside a lamp, can provide half of the light at a surface point and
//! be met by only two of the 400 rays over its hemisphere. Additional rays are therefore aimed at
//! such patches (importance sampling). Both kinds of rays are weighted by the balance heuristic
//! (Veach and Guibas 1995, Section 3), so that the estimate is unbiased however bright the cells
//! are taken to be, and no ray has a larger weight than without the others.

use std::sync::atomic::AtomicUsize;

use glam::Vec2;
use rayon::prelude::*;

use crate::scene::{SurfacePoint, Views};

/// Cells over all surfaces, about: 3 cm in a room of 50 m².
const CELLS: f32 = 50_000.0;
/// Cells along an edge of a triangle, at most.
const MOST_ALONG_EDGE: f32 = 512.0;
/// Triangles that count as one of [`Views::count_point`]'s points: most have two cells.
const TRIANGLES_A_POINT: usize = 16;
/// How many times as bright as the mean of photographed surfaces a cell is that rays are aimed at:
/// others fill so much of a hemisphere that its own rays find their light.
const BRIGHT: f32 = 2.0;

/// Cells that are much brighter than photographed surfaces are in the mean, and how often rays are
/// aimed at each. The default has no cells, and nothing is aimed.
#[derive(Clone, Debug, Default)]
pub struct BrightCells {
    /// Per triangle the cells along its edges, n: both of its sides have n² cells.
    along_edge: Vec<u16>,
    /// Per triangle the first of its cells: those of its front, then those of its back.
    first: Vec<u32>,
    /// Per cell the probability by which a ray is aimed there, per m².
    density: Vec<f32>,
    /// The triangle and the cell's place among its cells, of cells that rays are aimed at.
    aimed_at: Vec<(u32, u32)>,
    /// The probability of these and all before them.
    cumulative: Vec<f32>,
}

/// A point that a ray is aimed at.
pub struct Aim {
    /// On the side that is bright.
    pub point: SurfacePoint,
    /// The probability by which it is chosen, per m².
    pub density: f32,
}

impl BrightCells {
    /// What photographs show in the middle of each cell.
    pub fn new(views: &Views) -> Self {
        let mesh = &views.capture.mesh;
        let areas: Vec<f32> = (0..mesh.triangles.len()).map(|t| mesh.area(t)).collect();
        let total: f64 = areas.iter().map(|&area| f64::from(area)).sum();
        let cell_m2 = (total as f32 / CELLS).max(f32::MIN_POSITIVE);
        let along_edge: Vec<u16> = areas
            .iter()
            .map(|area| (area / cell_m2).sqrt().ceil().clamp(1.0, MOST_ALONG_EDGE) as u16)
            .collect();
        let mut cells = Self { along_edge, ..Self::default() };
        let mut count = 0u32;
        for &n in &cells.along_edge {
            cells.first.push(count);
            count += 2 * u32::from(n).pow(2);
        }
        let done = AtomicUsize::new(0);
        let brightness: Vec<Vec<Option<f32>>> = (0..areas.len())
            .into_par_iter()
            .map(|triangle| {
                if triangle % TRIANGLES_A_POINT == 0 {
                    views.count_point(&done);
                }
                let n = u32::from(cells.along_edge[triangle]);
                let middle = Vec2::splat(1.0 / 3.0);
                (0..2 * n * n)
                    .map(|cell| views.radiance(cells.place(views, triangle, cell, middle)))
                    .map(|radiance| radiance.map(|radiance| radiance.iter().sum()))
                    .collect()
            })
            .collect();
        let area_of =
            |triangle: usize| areas[triangle] / f32::from(cells.along_edge[triangle]).powi(2);
        let (mut sent, mut photographed_m2) = (0.0f64, 0.0f64);
        for (triangle, brightness) in brightness.iter().enumerate() {
            for value in brightness.iter().flatten() {
                sent += f64::from(area_of(triangle) * value);
                photographed_m2 += f64::from(area_of(triangle));
            }
        }
        let mean = (sent / photographed_m2.max(f64::MIN_POSITIVE)) as f32;
        let beyond = |value: &Option<f32>| value.map_or(0.0, |v| (v - BRIGHT * mean).max(0.0));
        let mut sum = 0.0f64;
        let mut sums = Vec::new();
        for (triangle, brightness) in brightness.iter().enumerate() {
            for (cell, value) in brightness.iter().enumerate() {
                let value = beyond(value);
                cells.density.push(value);
                if value > 0.0 {
                    sum += f64::from(area_of(triangle) * value);
                    cells.aimed_at.push((triangle as u32, cell as u32));
                    sums.push(sum);
                }
            }
        }
        cells.cumulative = sums.iter().map(|value| (value / sum) as f32).collect();
        cells.density.iter_mut().for_each(|value| *value = (f64::from(*value) / sum) as f32);
        cells
    }

    /// Whether there is nothing to aim at.
    pub fn is_empty(&self) -> bool {
        self.aimed_at.is_empty()
    }

    /// A point by a number in [0, 1) that chooses the cell, and one in the unit square within it.
    pub fn aim(&self, views: &Views, choice: f32, within: Vec2) -> Aim {
        let index =
            self.cumulative.partition_point(|&sum| sum <= choice).min(self.aimed_at.len() - 1);
        let (triangle, cell) = self.aimed_at[index];
        let triangle = triangle as usize;
        // Uniform over a triangle: the half of the square beyond its diagonal is folded back.
        let within = if within.element_sum() > 1.0 { Vec2::ONE - within } else { within };
        let density = self.density[(self.first[triangle] + cell) as usize];
        Aim { point: self.place(views, triangle, cell, within), density }
    }

    /// The probability per m² by which [`Self::aim`] chooses the place of a hit: `at` has its
    /// barycentric coordinates u and v, as in [`Hit`](crate::geometry::bvh::Hit).
    pub fn density(&self, views: &Views, triangle: u32, point: SurfacePoint, at: Vec2) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let triangle = triangle as usize;
        let n = u32::from(self.along_edge[triangle]);
        let scaled = at.clamp(Vec2::ZERO, Vec2::ONE) * n as f32;
        let row = (scaled.x as u32).min(n - 1);
        let column = (scaled.y as u32).min(n - 1 - row);
        let beyond_diagonal = (scaled - Vec2::new(row as f32, column as f32)).element_sum() > 1.0;
        let in_row = 2 * column + u32::from(beyond_diagonal && column + 1 < n - row);
        let back = point.normal.dot(views.normals[triangle]) < 0.0;
        let cell = row * (2 * n - row) + in_row + if back { n * n } else { 0 };
        self.density[(self.first[triangle] + cell) as usize]
    }

    /// The point of a cell at barycentric coordinates within it. A triangle's row i of n has
    /// 2(n − i) − 1 cells, every second one upside down.
    fn place(&self, views: &Views, triangle: usize, cell: u32, within: Vec2) -> SurfacePoint {
        let n = u32::from(self.along_edge[triangle]);
        let (back, cell) = (cell >= n * n, cell % (n * n));
        // Rows before it have i (2n − i) cells.
        let row = (0..n).rfind(|row| row * (2 * n - row) <= cell).unwrap_or(0);
        let in_row = cell - row * (2 * n - row);
        let corner = Vec2::new(row as f32, (in_row / 2) as f32);
        let at = if in_row % 2 == 0 { corner + within } else { corner + Vec2::ONE - within };
        let at = at / n as f32;
        let [a, b, c] = views.capture.mesh.corners(triangle);
        let normal = views.normals[triangle];
        SurfacePoint {
            position: a + (b - a) * at.x + (c - a) * at.y,
            normal: if back { -normal } else { normal },
        }
    }
}

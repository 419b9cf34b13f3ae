//! A grid over the scene with the irradiance from each recovered light. It gives the probabilities
//! by which lights are sampled.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::mesh::Mesh;
use crate::math::sampling::Random;
use crate::render::light::Light;
use crate::render::scene::Solved;
use crate::scene::{SurfacePoint, Views};

/// Mean irradiance from each recovered light, shadows included, in the bins of a grid over the
/// capture's geometry. A bin is a cell with one of six sides that surfaces may face.
pub struct IrradianceGrid {
    /// Indices into the recovered lights of those that shine.
    pub shining: Vec<usize>,
    /// The corner of its box with the smallest coordinates.
    pub low: Vec3,
    pub cell_m: Vec3,
    /// Cells along each axis.
    pub side: usize,
    /// Per bin, the sum over the channels for each shining light.
    irradiance: Vec<f32>,
}

/// The most irradiances that a grid holds, 16 MB.
const MOST: usize = 4 << 20;
const FINEST: usize = 16;
/// The sides that surfaces may face.
const SIDES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
/// Surface points over the whole geometry, by area; each gives one point per side of the surface.
const SURFACE_POINTS: usize = 1 << 15;
/// The most points that one bin is measured at.
const POINTS_PER_BIN: usize = 8;
/// Points in the air of a cell, for objects that may be set there.
const POINTS_IN_AIR: usize = 4;

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
        let measured: Vec<Cell> = points
            .par_chunks_exact(SIDES.len())
            .enumerate()
            .map(|(cell, points)| grid.cell(views, &lights, cell, points))
            .collect();
        grid.irradiance = (0..points.len())
            .into_par_iter()
            .flat_map_iter(|bin| grid.shadowed(&measured, &points, bin))
            .collect();
        grid
    }

    /// Per bin what it holds of each shining light.
    pub fn bins(&self) -> rayon::slice::ChunksExact<'_, f32> {
        self.irradiance.par_chunks_exact(self.shining.len().max(1))
    }

    /// Of the bin that holds a surface point; of the nearest one outside the grid.
    pub fn bin(&self, point: SurfacePoint) -> usize {
        let side = self.side;
        let place = ((point.position - self.low) / self.cell_m).to_array();
        let [x, y, z] = place.map(|index| (index.max(0.0) as usize).min(side - 1));
        let axis = point.normal.abs().max_position();
        let sign = usize::from(point.normal[axis] < 0.0);
        ((z * side + y) * side + x) * SIDES.len() + 2 * axis + sign
    }

    /// The irradiance in one bin, shadows included. The visible fraction of a light is estimated
    /// from a few points by the estimator of Krichevsky and Trofimov, whose prior mean is a half,
    /// since a light that is hidden from all of these points may be visible between them. Where the
    /// surface continues into neighbouring bins, their mean is the prior instead: deep in a room,
    /// hundreds of cells of a sky are visible from nowhere, and with a half they would get most of
    /// the samples.
    fn shadowed(&self, cells: &[Cell], points: &[Vec<SurfacePoint>], bin: usize) -> Vec<f32> {
        let (cell, side) = (bin / SIDES.len(), bin % SIDES.len());
        let count = self.shining.len();
        let mut around = vec![0u32; count];
        let mut tried = 0;
        for other in self.around(cell) {
            let own = points[other * SIDES.len() + side].len();
            if own > 0 {
                tried += own;
                for (sum, &seen) in around.iter_mut().zip(&cells[other].seen[side * count..]) {
                    *sum += u32::from(seen);
                }
            }
        }
        let own = points[bin].len();
        let part = |light: usize| {
            let seen = f32::from(cells[cell].seen[side * count + light]);
            if own == 0 {
                return (seen + 0.5) / (POINTS_IN_AIR as f32 + 1.0);
            }
            let expected = (around[light] as f32 + 0.5) / (tried as f32 + 1.0);
            (seen + expected) / (own as f32 + 1.0)
        };
        (0..count).map(|light| cells[cell].irradiance[side * count + light] * part(light)).collect()
    }

    /// A cell and those around it.
    fn around(&self, cell: usize) -> impl Iterator<Item = usize> {
        let side = self.side;
        let near = move |at: usize| at.saturating_sub(1)..(at + 2).min(side);
        let (x, y, z) = (cell % side, cell / side % side, cell / side / side);
        near(z).flat_map(move |z| {
            near(y).flat_map(move |y| near(x).map(move |x| (z * side + y) * side + x))
        })
    }

    /// What is measured in one cell, given the surface points in each of its bins.
    fn cell(
        &self,
        views: &Views,
        lights: &[Light],
        cell: usize,
        points: &[Vec<SurfacePoint>],
    ) -> Cell {
        let mut random = Random::new(0, 1, cell as u64);
        let least_m = 0.5 * self.cell_m.length();
        let corner = [cell % self.side, cell / self.side % self.side, cell / self.side / self.side];
        let corner = Vec3::from(corner.map(|index| index as f32));
        let place = |within: Vec3| self.low + (corner + within) * self.cell_m;
        let middle = place(Vec3::splat(0.5));
        let in_air: [Vec3; POINTS_IN_AIR] =
            std::array::from_fn(|_| place(Vec3::from(std::array::from_fn(|_| random.uniform()))));
        let squares: [Vec2; POINTS_PER_BIN] = std::array::from_fn(|_| random.point());

        let size = SIDES.len() * lights.len();
        let mut measured = Cell { irradiance: vec![0.0; size], seen: vec![0; size] };
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
            let mut in_air_seen = None;
            for (side, points) in points.iter().enumerate() {
                let (irradiance, seen) = if points.is_empty() {
                    let seen = *in_air_seen.get_or_insert_with(|| {
                        let facing = in_air.map(|position| SurfacePoint {
                            position,
                            normal: light.direction_from(position),
                        });
                        light.seen_by(views, &facing, &squares)
                    });
                    (irradiance(middle, SIDES[side]), seen)
                } else {
                    let sum: f32 = points.iter().map(|p| irradiance(p.position, p.normal)).sum();
                    (sum / points.len() as f32, light.seen_by(views, points, &squares))
                };
                measured.irradiance[side * lights.len() + index] = irradiance;
                measured.seen[side * lights.len() + index] = seen as u8;
            }
        }
        measured
    }
}

/// What is measured in the bins of one cell: for each side each light.
struct Cell {
    /// Mean irradiance without shadows.
    irradiance: Vec<f32>,
    /// How many points see the light.
    seen: Vec<u8>,
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

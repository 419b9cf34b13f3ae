//! The layout of a background: discs with lobes on a sphere around a room, or cells of a sky.

use glam::Vec3;
use rayon::prelude::*;

use crate::math::rgb::Rgb;
use crate::math::sampling::fibonacci;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::seen_sky::SeenSky;
use crate::reconstruct::lights::{self, LightKind, LightOptions, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::{self, Lobe, LobeOptions, Lobes};
use crate::reconstruct::samples::JAMMING_DENSITY;
use crate::watch::Cancelled;

/// How a background is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    pub world: World,
    /// Radius of the sphere in half-diagonals of the known geometry.
    pub radius: f64,
    /// Distance between lights in half-diagonals; sky cells are as many as they would be on a
    /// sphere of that spacing.
    pub spacing: f64,
    /// Side of the grid of lobes of each light.
    pub grid: usize,
    pub exponent: f64,
    pub seed: u64,
    /// Whether known surfaces that no photograph shows may emit light.
    pub surfaces: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum World {
    /// Light comes from a finite distance: lamps, walls, windows.
    Room,
    /// Light comes from the sky.
    Open,
}

/// What a background is for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Density {
    /// Few lights, in addition to lamps and a sun.
    Coarse,
    /// Many, which imitate almost any light.
    Fine,
}

/// Lights with their lobes.
#[derive(Clone, Debug)]
pub struct LightSet {
    pub lights: VirtualLights,
    pub lobes: Lobes,
}

/// Neighbours of a sky cell: as many as cells of equal size on a sphere have around them.
pub const NEIGHBOURS: usize = 6;
/// Pixels along the side of a coverage mask; its grid has at most a quarter of that.
const MASK_PX: usize = 48;
/// Backgrounds that are spread over the ranges of the options; prime, so that steps of any length
/// run through all of them.
const VARIATIONS: usize = 7;

impl Default for LightSet {
    fn default() -> Self {
        let lobes = Lobes { lobes: Vec::new(), first: vec![0] };
        Self { lights: VirtualLights::default(), lobes }
    }
}

impl LightSet {
    /// Adds the lights of another set after its own.
    pub fn append(&mut self, other: &Self) {
        for (index, light) in other.lights.lights.iter().enumerate() {
            let lobes: Vec<(Vec3, f32)> = other.lobes.lobes[other.lobes.of(index)]
                .iter()
                .map(|lobe| (lobe.direction, lobe.exponent))
                .collect();
            self.push(*light, &lobes);
        }
    }

    /// Each sky cell's lobe with those of the cells that are nearest to it.
    pub fn neighbours(&self) -> Vec<[usize; 2]> {
        let light = |lobe: usize| &self.lights.lights[self.lobes.lobes[lobe].light];
        let cells: Vec<usize> = (0..self.lobes.lobes.len())
            .filter(|&lobe| light(lobe).kind == LightKind::Sky)
            .collect();
        let nearest = |&cell: &usize| {
            let cosine = |other: usize| light(cell).normal.dot(light(other).normal);
            let mut others: Vec<usize> = cells.iter().copied().filter(|&c| c != cell).collect();
            let nearer = |&a: &usize, &b: &usize| cosine(b).total_cmp(&cosine(a)).then(a.cmp(&b));
            let count = NEIGHBOURS.min(others.len());
            if count < others.len() {
                others.select_nth_unstable_by(count, nearer);
            }
            others.truncate(count);
            others.sort_unstable();
            others.into_iter().map(move |other| [cell, other]).collect::<Vec<_>>()
        };
        cells.par_iter().flat_map_iter(nearest).collect()
    }

    /// The lobes that are chosen, by index, with their lights.
    pub fn selected(&self, is_chosen: impl Fn(usize) -> bool) -> Self {
        let lights = VirtualLights { lights: Vec::new(), ..self.lights.clone() };
        let mut set = Self { lights, ..Self::default() };
        for (index, light) in self.lights.lights.iter().enumerate() {
            let chosen = self.lobes.of(index).filter(|&lobe| is_chosen(lobe));
            let lobes: Vec<(Vec3, f32)> = chosen
                .map(|lobe| (self.lobes.lobes[lobe].direction, self.lobes.lobes[lobe].exponent))
                .collect();
            if !lobes.is_empty() {
                set.push(*light, &lobes);
            }
        }
        set
    }

    /// Adds a light with its lobes: directions and exponents.
    pub fn push(&mut self, light: VirtualLight, lobes: &[(Vec3, f32)]) {
        let index = self.lights.lights.len();
        self.lights.lights.push(light);
        self.lobes.lobes.extend(lobes.iter().map(|&(direction, exponent)| Lobe {
            light: index,
            direction,
            exponent,
        }));
        self.lobes.first.push(self.lobes.lobes.len());
    }
}

impl Layout {
    /// The background that the options ask for.
    pub fn new(problem: &Problem, world: World, density: Density, surfaces: bool) -> Self {
        let options = problem.options();
        let (spacing, grid, exponent) = match density {
            Density::Coarse => {
                (options.coarse_spacing, options.coarse_grid, options.coarse_exponent)
            }
            Density::Fine => (options.fine_spacing, options.fine_grid, options.fine_exponent),
        };
        Self { world, radius: options.radius_factor, spacing, grid, exponent, seed: 1, surfaces }
    }

    /// This many times as many lights.
    pub fn with_lights(&self, factor: f64) -> Self {
        Self { spacing: self.spacing / factor.sqrt(), ..*self }
    }

    /// The same for one light set, laid out differently but for that of index 0.
    pub fn varied(&self, index: usize) -> Self {
        // Spread in different orders, so that no two go together; at its own value for index 0.
        let part = |step: usize| ((index * step) % VARIATIONS) as f64 / (VARIATIONS - 1) as f64;
        let vary =
            |low: f64, range: f64, step| if index == 0 { 1.0 } else { low + range * part(step) };
        Self {
            radius: self.radius * vary(1.0, 0.35, 5),
            spacing: self.spacing * vary(0.7, 0.45, 3),
            exponent: self.exponent * vary(0.8, 0.4, 2),
            seed: 1 + index as u64,
            ..*self
        }
    }

    /// The lights of this background, and for each lobe its emission if photographs show it.
    pub fn place(&self, problem: &Problem) -> Result<(LightSet, Vec<Option<Rgb>>), Cancelled> {
        let (views, cloud, watch) = (problem.data.views, problem.data.cloud, problem.watch());
        let (low, high) = views.capture.mesh.bounds().unwrap_or_default();
        let spacing_m = self.spacing * f64::from(0.5 * (high - low).length());
        let options = LightOptions {
            radius_factor: self.radius,
            spacing_factor: Some(spacing_m / f64::from(cloud.spacing_m)),
            ..LightOptions::default()
        };
        let mut placed = lights::place(views, cloud, &options, self.seed, watch)?;
        let mut set = LightSet {
            lights: VirtualLights { lights: Vec::new(), ..placed.clone() },
            ..LightSet::default()
        };
        let on_surface = |light: &VirtualLight| light.kind == LightKind::Surface;
        let mut known = Vec::new();
        let surfaces: Vec<VirtualLight> =
            placed.lights.iter().filter(|light| on_surface(light)).copied().collect();
        placed.lights.retain(|light| !on_surface(light));
        match self.world {
            World::Room => {
                let options = LobeOptions {
                    mask_px: MASK_PX,
                    grid: self.grid,
                    exponent: self.exponent,
                    ..LobeOptions::default()
                };
                let chosen = lobes::choose(views, &mut placed, &options, watch)?;
                for (index, light) in placed.lights.iter().enumerate() {
                    let lobes: Vec<(Vec3, f32)> = chosen.lobes[chosen.of(index)]
                        .iter()
                        .map(|lobe| (lobe.direction, lobe.exponent))
                        .collect();
                    set.push(*light, &lobes);
                }
            }
            World::Open => {
                // As many as points of that distance would be on the sphere.
                let area = 4.0 * std::f64::consts::PI * self.radius.powi(2);
                let count = (JAMMING_DENSITY * area / self.spacing.powi(2)).round();
                let count = count.max(12.0) as usize;
                let first = fibonacci(count, self.seed as f32).collect();
                for cell in cells(first, problem.sky.as_deref()) {
                    let half_angle = half_angle(cell.count);
                    let light = VirtualLight::distant(LightKind::Sky, cell.direction, half_angle);
                    set.push(light, &[(cell.direction, 0.0)]);
                    known.push(cell.radiance);
                }
            }
        }
        // A known surface is taken to be diffuse: it sends the same radiance everywhere, and E
        // cosⁿ times k, which lacks the emitter's cosine, is that for n = 1.
        for light in surfaces.into_iter().filter(|_| self.surfaces) {
            set.push(light, &[(light.normal, 1.0)]);
        }
        known.resize(set.lobes.lobes.len(), None);
        Ok((set, known))
    }
}

/// Half the angle of a cone with one of `count` equal shares of the sphere, in radians.
pub fn half_angle(count: usize) -> f32 {
    2.0 * (1.0 / count as f32).sqrt().asin()
}

/// A cell of a sky.
struct Cell {
    /// In which its light travels.
    direction: Vec3,
    /// How many cells of its size there are on the sphere.
    count: usize,
    /// Where photographs show it.
    radiance: Option<Rgb>,
}

/// Cells are divided by so many from size to size, and by at least half of it into the smallest ones:
/// by less, some cells would be nearest to none.
const DIVISION: usize = 4;

/// A sky in cells around the given directions of light. A cell of which photographs show a part is
/// divided repeatedly, until each of its parts is either photographed or not photographed.
fn cells(first: Vec<Vec3>, seen: Option<&SeenSky>) -> Vec<Cell> {
    let whole = |direction: Vec3, count| Cell { direction, count, radiance: None };
    let Some(seen) = seen.filter(|seen| seen.directions.len() > first.len()) else {
        let count = first.len();
        return first.into_iter().map(|direction| whole(direction, count)).collect();
    };
    let mut sizes = vec![first];
    while let Some(last) = sizes.last()
        && last.len() * DIVISION * DIVISION / 2 <= seen.directions.len()
    {
        sizes.push(fibonacci(last.len() * DIVISION, 0.0).collect());
    }
    sizes.push(seen.directions.iter().map(|towards| -*towards).collect());
    // Each cell is a part of the larger one that is nearest.
    let parents: Vec<Vec<usize>> = sizes
        .windows(2)
        .map(|sizes| sizes[1].par_iter().map(|&cell| nearest(&sizes[0], cell)).collect())
        .collect();
    let mut is_shown: Vec<Vec<bool>> = sizes.iter().map(|size| vec![false; size.len()]).collect();
    for &cell in &seen.cells {
        let mut cell = cell;
        for size in (0..sizes.len()).rev() {
            is_shown[size][cell] = true;
            if size > 0 {
                cell = parents[size - 1][cell];
            }
        }
    }
    let mut radiance = vec![None; seen.directions.len()];
    for (&cell, &value) in seen.cells.iter().zip(&seen.radiance) {
        radiance[cell] = Some(value);
    }
    let mut found = Vec::new();
    let last = sizes.len() - 1;
    for (size, directions) in sizes.iter().enumerate() {
        for (cell, &direction) in directions.iter().enumerate() {
            let is_part = size == 0 || is_shown[size - 1][parents[size - 1][cell]];
            if is_part && (size == last || !is_shown[size][cell]) {
                let radiance = if size == last { radiance[cell] } else { None };
                found.push(Cell { radiance, ..whole(direction, directions.len()) });
            }
        }
    }
    found
}

/// Which of some unit directions is nearest to another.
fn nearest(directions: &[Vec3], to: Vec3) -> usize {
    let nearer = |a: &usize, b: &usize| {
        directions[*a].dot(to).total_cmp(&directions[*b].dot(to)).then(b.cmp(a))
    };
    (0..directions.len()).max_by(nearer).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHOWN: Vec3 = Vec3::new(0.6, 0.0, 0.8);

    /// A sky of which photographs show all within 20° of that direction.
    fn partly_seen() -> SeenSky {
        let directions: Vec<Vec3> = fibonacci(2000, 0.0).collect();
        let cells: Vec<usize> =
            (0..directions.len()).filter(|&cell| directions[cell].dot(SHOWN) > 0.94).collect();
        let radiance = cells.iter().map(|&cell| [cell as f64, 1.0, 2.0]).collect();
        SeenSky { directions, cells, radiance, is_distant: false }
    }

    #[test]
    fn a_sky_is_divided_where_photographs_show_it_and_covered_once() {
        for count in [12, 35, 70, 123, 280, 492, 900] {
            is_divided_and_covered_once(count);
        }
    }

    fn is_divided_and_covered_once(count: usize) {
        let seen = partly_seen();
        let first: Vec<Vec3> = fibonacci(count, 1.0).collect();
        let found = cells(first.clone(), Some(&seen));
        let shown: Vec<&Cell> = found.iter().filter(|cell| cell.radiance.is_some()).collect();
        assert_eq!(shown.len(), seen.cells.len());
        for (&cell, radiance) in seen.cells.iter().zip(&seen.radiance) {
            let own = |found: &&&Cell| found.direction == -seen.directions[cell];
            let same: Vec<_> = shown.iter().filter(own).collect();
            assert_eq!(same.len(), 1);
            assert_eq!((same[0].count, same[0].radiance), (2000, Some(*radiance)));
        }
        // Large where nothing is shown, with few cells in between.
        let large = found.iter().filter(|cell| cell.count == count).count();
        assert!(
            large > count / 2 && found.len() < count + 4 * seen.cells.len(),
            "{count}: {large}"
        );
        // Every direction is in about one cell: the cones have the area of the sphere, also of the part
        // that is shown, and far from all of them is nowhere.
        let area = |chosen: &dyn Fn(&Cell) -> bool| -> f64 {
            let chosen = found.iter().filter(|cell| chosen(cell));
            chosen.map(|cell| 1.0 / cell.count as f64).sum()
        };
        let whole = area(&|_| true);
        assert!((whole - 1.0).abs() < 0.02, "{count}: {whole}");
        let inside = area(&|cell| cell.direction.dot(SHOWN) < -0.96);
        assert!((inside / 0.02 - 1.0).abs() < 0.1, "{count}: {inside}");
        for direction in fibonacci(5000, 0.5) {
            let angle = |cell: &Cell| {
                cell.direction.dot(direction).clamp(-1.0, 1.0).acos() / half_angle(cell.count)
            };
            let nearest = found.iter().map(angle).fold(f32::INFINITY, f32::min);
            assert!(nearest < 1.7, "{count}: {direction}: {nearest}");
        }
    }

    #[test]
    fn a_sky_that_no_photograph_shows_has_cells_of_one_size() {
        let first: Vec<Vec3> = fibonacci(35, 1.0).collect();
        let found = cells(first.clone(), None);
        let directions: Vec<Vec3> = found.iter().map(|cell| cell.direction).collect();
        assert_eq!(directions, first);
        assert!(found.iter().all(|cell| cell.count == 35 && cell.radiance.is_none()));
        // Nor has one that is finer than what photographs tell apart.
        let fine: Vec<Vec3> = fibonacci(3000, 1.0).collect();
        let found = cells(fine, Some(&partly_seen()));
        assert!(found.iter().all(|cell| cell.count == 3000 && cell.radiance.is_none()));
    }
}

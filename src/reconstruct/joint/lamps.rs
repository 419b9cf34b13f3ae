//! Lamps, found one by one: small luminaires anywhere in space.
//!
//! Many lobes on a sphere can imitate a lamp that is not on that sphere. They can then also imitate
//! the light from photographed surfaces, so that the scale of the reflectances is not determined. A
//! lamp in its right place, with a coarse background, cannot.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::bvh::Blocker;
use crate::math::sampling::{Random, fibonacci, square_to_disc, stratified};
use crate::reconstruct::Stream;
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::lamp_gain::Scaled;
use crate::reconstruct::joint::linearised::{Residue, residues};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::lights::VirtualLight;
use crate::scene::agreement::brightness;
use crate::scene::{Emitter, Gloss, KnownLight, SurfacePoint, Viewing, agreeing};
use crate::watch::Cancelled;

/// Directions in which a lamp's radiance may differ: it is Σ E_k w_k with w₀ = 1 and w_k the
/// cosine to one of the six axes where that is positive.
pub const AXES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
pub const COLUMNS: usize = 1 + AXES.len();

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    pub position: Vec3,
    pub radius_m: f32,
}

impl Lamp {
    /// The lamp as a light with its lobes.
    pub fn set(&self) -> LightSet {
        let mut lobes = vec![(Vec3::Z, 0.0)];
        lobes.extend(AXES.map(|axis| (axis, 1.0)));
        let mut set = LightSet::default();
        set.push(VirtualLight::lamp(self.position, self.radius_m), &lobes);
        set
    }
}

/// Places at which a lamp was tried, with its coupling to some of the rows.
pub struct Candidates {
    lamps: Vec<Lamp>,
    /// Rows that the search looks at.
    rows: Vec<usize>,
    points: Vec<SurfacePoint>,
    /// For each of these rows, the points on the unit disc of a lamp to which rays are traced. They
    /// are the same for every place of the lamp, so that a score changes only with that place.
    discs: Vec<Vec<Vec2>>,
    /// For glossy rows the direction from the sample to the camera, and the material.
    viewings: Vec<Option<(Viewing, usize)>>,
    /// π r² V cos θ / d² per place and row.
    coupling: Vec<Vec<f32>>,
    /// The same of lamps that were tried when a place was refined, by the bits of position and radius: a
    /// lamp is tried again at the same places when another one was added and it stays.
    tried: Mutex<HashMap<[u32; 4], Arc<Vec<f32>>>>,
    /// Middle and half the diagonal of the geometry's bounds.
    center: Vec3,
    half_diagonal: f32,
    /// Segments from samples to the cameras of the photographs that show them; nothing can be in
    /// between.
    sight: Vec<[Vec3; 2]>,
    /// Positions of known lights. No lamp is searched for near them, because a lamp of unknown
    /// strength there would make a given strength meaningless.
    given: Vec<Vec3>,
}

/// Directions and distances (in half-diagonals) from the middle of the geometry of the places that
/// are tried first, and the number of rows that are used there.
const DIRECTIONS: usize = 500;
const DISTANCES: usize = 8;
const NEAREST: f32 = 0.4;
const FARTHEST: f32 = 5.0;
const ROWS: usize = 800;
/// Square root of the number of rays from a surface point to a lamp whose place is refined.
const RAYS_SIDE: usize = 2;
/// Columns of lamps that are projected together.
const BATCH: usize = 8 * COLUMNS;
/// Places at which all columns of a lamp are tried: a tenth of all places.
const SHORT_LIST: usize = 400;
/// Radius of a lamp before its own is found, and the smallest and largest, in half-diagonals.
const FIRST_RADIUS: f32 = 0.05;
const SMALLEST_RADIUS: f32 = 0.01;
const LARGEST_RADIUS: f32 = 0.3;
/// Places of which the coupling is remembered; all of them are forgotten where there are more.
const REMEMBERED: usize = 10_000;
/// Distance that a lamp keeps from given lights, in half-diagonals.
const APART: f32 = 0.3;
/// Fraction of the radius of a lamp within which the lamp must not hide a surface that a photograph
/// shows. It is below 1 because a ball that represents a luminaire of another shape may be larger
/// than it.
const CORE: f32 = 0.5;
/// First and last step of the search for a lamp's place, in half-diagonals.
const FIRST_STEP: f32 = 0.12;
const LAST_STEP: f32 = 0.006;

/// Places for lamps in all directions, with their coupling to some of the rows; none if no lamps
/// are asked for.
pub fn candidates(problem: &Problem, is_wanted: bool) -> Result<Candidates, Cancelled> {
    let (views, watch) = (problem.data.views, problem.watch());
    let seed = problem.data.options.general.seed as u64;
    let (low, high) = views.capture.mesh.bounds().unwrap_or_default();
    let center = 0.5 * (low + high);
    let half_diagonal = 0.5 * (high - low).length();
    let radius_m = FIRST_RADIUS * half_diagonal;
    let mut lamps = Vec::new();
    let shells = if is_wanted && problem.options().max_lamps > 0 { DISTANCES } else { 0 };
    for k in 0..shells {
        let part = k as f32 / (DISTANCES - 1) as f32;
        let distance = half_diagonal * NEAREST * (FARTHEST / NEAREST).powf(part);
        // Turned from shell to shell, so that no direction is left out by all.
        lamps.extend(
            fibonacci(DIRECTIONS, 2.4 * k as f32)
                .map(|direction| Lamp { position: center + direction * distance, radius_m }),
        );
    }
    let rows = problem.every(ROWS);
    let points: Vec<SurfacePoint> = rows.iter().map(|&row| problem.surface_point(row)).collect();
    let discs = |index: usize| {
        let mut random = Random::new(seed, Stream::Lamps as u64, index as u64);
        stratified(RAYS_SIDE, &mut random).map(square_to_disc).collect()
    };
    let viewing = |row: usize| {
        let glossy = problem.glossy[problem.rows.glossy[row]?];
        Some((problem.data.equations.glossy[glossy].viewing, problem.rows.material[row]))
    };
    let sight = rows.iter().flat_map(|&row| sight(problem, row)).collect();
    // Places that light nothing, such as those within the geometry, are no candidates.
    let mut found = Candidates {
        lamps: Vec::new(),
        viewings: rows.iter().map(|&row| viewing(row)).collect(),
        rows,
        discs: (0..points.len()).map(discs).collect(),
        points,
        coupling: Vec::new(),
        tried: Mutex::default(),
        center,
        half_diagonal,
        sight,
        given: views
            .capture
            .lights
            .iter()
            .filter_map(|light| match light {
                KnownLight::Shape { emitter: Emitter::Sun { .. }, .. } => None,
                KnownLight::Shape { emitter, .. } => Some(emitter.extent().0),
                _ => None,
            })
            .collect(),
    };
    lamps.retain(|lamp| found.is_possible(lamp));
    watch.begin(lamps.len() as u64);
    let points = &found.points;
    let coupling = lamps
        .par_iter()
        .map(|lamp| {
            watch.tick()?;
            let is_free =
                |point: SurfacePoint| f32::from(u8::from(views.is_free(point, lamp.position)));
            Ok(points.iter().map(|&point| arriving(lamp, point, || is_free(point))).collect())
        })
        .collect::<Result<Vec<Vec<f32>>, Cancelled>>()?;
    for (lamp, coupling) in lamps.into_iter().zip(coupling) {
        if coupling.iter().filter(|&&k| k > 0.0).count() * 50 > found.rows.len() {
            found.lamps.push(lamp);
            found.coupling.push(coupling);
        }
    }
    Ok(found)
}

/// Segments from the sample of a row to every camera that shows it. Where such a photograph is
/// bright, it may show a lamp instead.
fn sight(problem: &Problem, row: usize) -> impl Iterator<Item = [Vec3; 2]> {
    let cloud = problem.data.cloud;
    let sample = &cloud.samples[problem.rows.sample[row]];
    let views = &cloud.views[sample.views.clone()];
    let is_near = agreeing(views.iter().map(|view| brightness(&view.radiance)));
    let photographs = &problem.capture().photographs;
    views
        .iter()
        .zip(is_near)
        .filter(|(_, is_near)| *is_near)
        .map(|(view, _)| [sample.position, photographs[view.photograph].camera.position.as_vec3()])
}

/// π r² V cos θ / d² of a lamp at a surface point, V being asked for where it matters.
fn arriving(lamp: &Lamp, point: SurfacePoint, visible: impl FnOnce() -> f32) -> f32 {
    let offset = lamp.position - point.position;
    let distance = offset.length().max(lamp.radius_m);
    let cosine = offset.dot(point.normal) / distance;
    if cosine <= 0.0 {
        return 0.0;
    }
    let light = VirtualLight::lamp(lamp.position, lamp.radius_m);
    light.area_m2() * cosine / (distance * distance) * visible()
}

/// Fills the first or all seven columns of a lamp on the rows, one after the other, before the scale of a
/// channel, where they are not 0.
fn fill(columns: &mut [f32], lamp: &Lamp, points: &[SurfacePoint], coupling: &[f32]) {
    let rows = points.len();
    if columns.len() == rows {
        columns.copy_from_slice(coupling);
        return;
    }
    for (row, (point, &k)) in points.iter().zip(coupling).enumerate() {
        if k == 0.0 {
            continue;
        }
        let direction = (point.position - lamp.position).normalize_or_zero();
        columns[row] = k;
        for (axis, component) in direction.to_array().into_iter().enumerate() {
            columns[(1 + 2 * axis) * rows + row] = k * component.max(0.0);
            columns[(2 + 2 * axis) * rows + row] = k * (-component).max(0.0);
        }
    }
}

impl Candidates {
    /// π f/ρ_s for the light of a lamp at each row; 0 for diffuse ones.
    fn lobes(&self, lamp: &Lamp, gloss: &[Option<Gloss>]) -> Vec<f32> {
        let light = VirtualLight::lamp(lamp.position, lamp.radius_m);
        let of = |(point, viewing): (&SurfacePoint, &Option<(Viewing, usize)>)| {
            let lobe = viewing.and_then(|(viewing, material)| {
                Some(light.lobe(point.position, viewing, gloss[material]?) as f32)
            });
            lobe.unwrap_or(0.0)
        };
        self.points.iter().zip(&self.viewings).map(of).collect()
    }

    /// Whether a lamp is not near a known light and hides no surface that a photograph shows.
    fn is_possible(&self, lamp: &Lamp) -> bool {
        let limit = APART * self.half_diagonal;
        let is_beside = |given: &Vec3| given.distance(lamp.position) < limit;
        let core = (CORE * lamp.radius_m).powi(2);
        let is_through = |&[sample, camera]: &[Vec3; 2]| {
            let (along, offset) = (camera - sample, lamp.position - sample);
            let part = (offset.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (offset - part * along).length_squared() < core
        };
        !self.given.iter().any(is_beside) && !self.sight.iter().any(is_through)
    }

    /// The place that lowers the objective most: of all places by a lamp that sends the same in all
    /// directions, and of the best of these by one that need not.
    pub fn best(&self, problem: &Problem, fitted: &Fitted) -> Option<(Lamp, f64)> {
        let residues = residues(problem, fitted, &self.rows, None);
        let gloss = &fitted.model.gloss;
        let mut places: Vec<usize> = (0..self.lamps.len()).collect();
        let gains = self.gains(&places, 1, gloss, &residues);
        places.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
        places.truncate(SHORT_LIST);
        places.sort_unstable();
        let gains = self.gains(&places, COLUMNS, gloss, &residues);
        let mut best: Option<(usize, f32)> = None;
        for (index, gain) in places.into_iter().zip(gains) {
            if gain > best.map_or(0.0, |(_, gain)| gain) {
                best = Some((index, gain));
            }
        }
        best.map(|(index, gain)| (self.lamps[index], f64::from(gain)))
    }

    /// By how much the best of the first columns of each lamp lowers the sum of squared residuals alone.
    fn gains(
        &self,
        places: &[usize],
        count: usize,
        gloss: &[Option<Gloss>],
        residues: &[Residue],
    ) -> Vec<f32> {
        let size = count * self.points.len();
        let of_batch = |places: &[usize]| -> Vec<f32> {
            let mut columns = vec![0.0; size * places.len()];
            for (columns, &place) in columns.chunks_exact_mut(size).zip(places) {
                fill(columns, &self.lamps[place], &self.points, &self.coupling[place]);
            }
            let lobes = places.iter().map(|&place| self.lobes(&self.lamps[place], gloss));
            let lobes = lobes.collect::<Vec<Vec<f32>>>().concat();
            let mut gains = vec![0.0f32; count * places.len()];
            for residue in residues {
                Scaled::new(&columns, &lobes, residue).add_gains(residue, &mut gains);
            }
            gains.chunks_exact(count).map(|lamp| lamp.iter().copied().fold(0.0, f32::max)).collect()
        };
        let gains: Vec<Vec<f32>> = places.par_chunks(BATCH / count).map(of_batch).collect();
        gains.concat()
    }

    /// Moves a lamp to the place where it lowers the squared residuals most. `slot` is its part of
    /// the fit's model, if it has one.
    pub fn refine(
        &self,
        problem: &Problem,
        fitted: &Fitted,
        lamp: Lamp,
        slot: Option<usize>,
    ) -> Result<Lamp, Cancelled> {
        let residues = residues(problem, fitted, &self.rows, slot);
        let score = |lamp: &Lamp| -> Result<f64, Cancelled> {
            problem.watch().check()?;
            if !self.is_possible(lamp) {
                return Ok(0.0);
            }
            Ok(self.explained(problem, &fitted.model.gloss, lamp, &residues))
        };
        let mut best = (lamp, score(&lamp)?);
        let mut step = FIRST_STEP * self.half_diagonal;
        let mut growth = 2.0f32;
        while step > LAST_STEP * self.half_diagonal {
            let mut tries: Vec<Lamp> = AXES
                .iter()
                .map(|&axis| Lamp { position: best.0.position + step * axis, ..best.0 })
                .collect();
            // Nearer and farther: what the rows show of a lamp changes least along this line.
            let outwards = (best.0.position - self.center).normalize_or_zero();
            for along in [-2.0, 2.0] {
                let position = best.0.position + along * step * outwards;
                tries.push(Lamp { position, ..best.0 });
            }
            for factor in [growth, 1.0 / growth] {
                let radius_m = (best.0.radius_m * factor).clamp(
                    SMALLEST_RADIUS * self.half_diagonal,
                    LARGEST_RADIUS * self.half_diagonal,
                );
                tries.push(Lamp { radius_m, ..best.0 });
            }
            let scores: Vec<f64> = tries.par_iter().map(score).collect::<Result<_, Cancelled>>()?;
            let mut moved = false;
            for (lamp, score) in tries.into_iter().zip(scores) {
                if score > best.1 * (1.0 + 1e-4) {
                    best = (lamp, score);
                    moved = true;
                }
            }
            if !moved {
                step *= 0.5;
                growth = growth.sqrt().max(1.1);
            }
        }
        Ok(best.0)
    }

    /// π r² V cos θ / d² of a lamp per row.
    fn coupling_of(&self, problem: &Problem, lamp: &Lamp) -> Arc<Vec<f32>> {
        let Vec3 { x, y, z } = lamp.position;
        let key = [x, y, z, lamp.radius_m].map(f32::to_bits);
        let tried = || self.tried.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = tried().get(&key) {
            return known.clone();
        }
        let light = VirtualLight::lamp(lamp.position, lamp.radius_m);
        let visible = |point, discs: &Vec<Vec2>| {
            light.visible_part(problem.data.views, point, discs, &mut Blocker::default())
        };
        let points = self.points.iter().zip(&self.discs);
        let coupling: Vec<f32> =
            points.map(|(&point, discs)| arriving(lamp, point, || visible(point, discs))).collect();
        let coupling = Arc::new(coupling);
        let mut tried = tried();
        if tried.len() >= REMEMBERED {
            tried.clear();
        }
        tried.insert(key, coupling.clone());
        coupling
    }

    /// By how much a lamp lowers the sum of squared residuals, with emissions of at least 0.
    fn explained(
        &self,
        problem: &Problem,
        gloss: &[Option<Gloss>],
        lamp: &Lamp,
        residues: &[Residue],
    ) -> f64 {
        let mut columns = vec![0.0; COLUMNS * self.points.len()];
        fill(&mut columns, lamp, &self.points, &self.coupling_of(problem, lamp));
        let lobes = self.lobes(lamp, gloss);
        residues
            .iter()
            .map(|residue| Scaled::new(&columns, &lobes, residue).explained(residue))
            .sum()
    }
}

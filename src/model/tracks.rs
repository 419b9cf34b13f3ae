//! What the points of an engine tell about its cameras.
//!
//! An engine adjusts cameras to thousands of points, each shown in several photographs: its tracks
//! (bundle adjustment: Triggs et al., "Bundle Adjustment, a Modern Synthesis", 2000). Their cost
//! is made quadratic about given cameras, and the points are eliminated (Schur complement). What is
//! left is a small quadratic form of the cameras and their lenses, which strokes can be added to:
//! numbers that the tracks determine badly, most often the focal length, then follow the strokes,
//! and the others stay.

use faer::{Mat, Side};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::view::Projected;
use super::{FoundPoint, Optic, Pose, found};

/// Least standard deviation of a point's place in a photograph, in pixels. A detector is not better.
const LEAST_PX: f64 = 0.25;
/// A photograph takes part that shows as many points.
const FEWEST: usize = 8;
/// Observations that take part, and the least of each photograph.
const OBSERVATIONS: usize = 2000;
const LEAST_SHARE: usize = 100;
/// Steps by which a point is placed anew at most; Gauss–Newton's method takes five to eight.
const STEPS: usize = 30;
/// Scales of the robust loss by which a point is placed one after the other, in its own scale. With
/// the last alone there may be several minima, and the engine's place may be far from all.
const STAGES: [f64; 4] = [f64::INFINITY, 4.0, 2.0, 1.0];
/// A point of which the rays are nearer to parallel is left out: the determinant of its normal
/// equations, over the cube of a third of their trace.
const PARALLEL: f64 = 1e-12;
/// Added to the diagonal, with columns of unit length: rounding leaves directions that nothing
/// determines below zero.
const RIDGE: f64 = 1e-12;

/// A number of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    /// Of a photograph: turn about the camera's axes in radians, place along the engine's axes in
    /// the engine's unit.
    Pose(usize, usize),
    /// Of a lens: focal length, principal point, k1, k2.
    Lens(usize, usize),
}

/// ½ |factor · d + offset|² of the changes d of numbers, in standard deviations of a point's place.
#[derive(Clone, Debug)]
pub(super) struct Term {
    pub numbers: Vec<Number>,
    /// Upper triangular.
    pub factor: Mat<f64>,
    pub offset: Vec<f64>,
}

impl Term {
    /// Whether it tells of a photograph.
    pub fn tells(&self, photograph: usize) -> bool {
        self.numbers.contains(&Number::Pose(photograph, 0))
    }
}

/// A photograph that takes part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    /// In the engine's coordinates.
    pub pose: Pose,
    pub lens: usize,
    pub optic: Optic,
    /// Which numbers of its lens are adjusted.
    pub is_free: [bool; 5],
}

/// Where a photograph shows a point.
struct Sight {
    photograph: usize,
    residual: DVec2,
    seen: Projected,
}

/// A point where the photographs agree on best.
struct Placed {
    sights: Vec<Sight>,
    /// Of its own normal equations.
    inverse: DMat3,
}

/// The points that take part: the first that show in a photograph, up to its share of all
/// observations. More would make a solve too slow for a drag, and tell little more.
pub(super) fn chosen(points: &[FoundPoint], photographs: usize) -> Vec<&FoundPoint> {
    let share = (OBSERVATIONS / photographs.max(1)).max(LEAST_SHARE);
    let shown: Vec<&FoundPoint> =
        points.iter().filter(|own| own.pixels.len() == own.photographs.len()).collect();
    let is_chosen = found::are_first(shown.iter().copied(), share);
    shown.into_iter().zip(is_chosen).filter(|own| own.1).map(|own| own.0).collect()
}

/// Whether chosen points say enough about each photograph.
pub(super) fn is_tracked(chosen: &[&FoundPoint], photographs: usize) -> Vec<bool> {
    let mut counts = vec![0; photographs];
    for &photograph in chosen.iter().flat_map(|own| &own.photographs) {
        counts[photograph] += 1;
    }
    counts.into_iter().map(|count| count >= FEWEST).collect()
}

/// The numbers of all cameras, in the order of the columns.
struct Columns<'a> {
    cameras: &'a [Option<Camera>],
    numbers: Vec<Number>,
    /// By photograph: the first of its pose.
    poses: Vec<usize>,
    /// By photograph: those of its lens that are adjusted.
    lenses: Vec<[Option<usize>; 5]>,
    loss_px: f64,
}

impl<'a> Columns<'a> {
    fn of(cameras: &'a [Option<Camera>], loss_px: f64) -> Self {
        let mut numbers = Vec::new();
        let mut poses = vec![0; cameras.len()];
        for (index, _) in cameras.iter().enumerate().filter(|own| own.1.is_some()) {
            poses[index] = numbers.len();
            numbers.extend((0..6).map(|part| Number::Pose(index, part)));
        }
        let mut lenses = vec![[None; 5]; cameras.len()];
        for (columns, camera) in lenses.iter_mut().zip(cameras) {
            let Some(camera) = camera else { continue };
            for part in (0..5).filter(|&part| camera.is_free[part]) {
                let own = Number::Lens(camera.lens, part);
                let shared = numbers.iter().position(|other| *other == own);
                columns[part] = Some(shared.unwrap_or(numbers.len()));
                numbers.extend(shared.is_none().then_some(own));
            }
        }
        Self { cameras, numbers, poses, lenses, loss_px }
    }

    /// By the robust loss with so many times its scale.
    fn weight(&self, residual: DVec2, stage: f64) -> f64 {
        1.0 / (1.0 + residual.length_squared() / (stage * self.loss_px).powi(2))
    }

    /// Where the cameras show a point that lies at a place; an item is `None` where it is behind
    /// the camera.
    fn sights<'b>(
        &'b self,
        point: &'b FoundPoint,
        at: DVec3,
    ) -> impl Iterator<Item = Option<Sight>> + 'b {
        let shown = point.photographs.iter().zip(&point.pixels);
        shown.filter_map(move |(&photograph, pixel)| {
            let camera = self.cameras[photograph].as_ref()?;
            let seen = camera.pose.project(&camera.optic, at);
            Some(seen.map(|seen| Sight { photograph, residual: seen.pixel - *pixel, seen }))
        })
    }

    /// The columns that a sight depends on, with its derivatives.
    fn slopes(&self, sight: &Sight) -> impl Iterator<Item = (usize, DVec2)> {
        let (first, seen) = (self.poses[sight.photograph], sight.seen);
        let turns = (0..3).map(move |k| (first + k, seen.by_turn[k]));
        let shifts = (0..3).map(move |k| (first + 3 + k, -seen.by_point[k]));
        let [k1, k2] = seen.by_radial;
        let by_lens = [seen.by_focal, DVec2::X, DVec2::Y, k1, k2];
        let lens = self.lenses[sight.photograph].into_iter().zip(by_lens);
        turns.chain(shifts).chain(lens.filter_map(|(column, by)| Some((column?, by))))
    }

    /// Places a point where the photographs agree on best; `None` where fewer than two show it, or
    /// their rays are parallel.
    fn placed(&self, point: &FoundPoint) -> Option<Placed> {
        let (mut at, mut steps) = (point.position, 0);
        let mut stages = STAGES.into_iter();
        let mut stage = stages.next()?;
        loop {
            let (mut matrix, mut gradient, mut count) = (DMat3::ZERO, DVec3::ZERO, 0);
            for sight in self.sights(point, at) {
                let Sight { residual, seen, .. } = sight?;
                let weight = self.weight(residual, stage);
                for axis in 0..2 {
                    let row = DVec3::from(seen.by_point.map(|by| by[axis]));
                    matrix += DMat3::from_cols(row * row.x, row * row.y, row * row.z) * weight;
                    gradient += row * (weight * residual[axis]);
                }
                count += 1;
            }
            let trace = matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
            let determinant = matrix.determinant();
            let is_told = determinant > PARALLEL * (trace / 3.0).powi(3);
            if count < 2 || !is_told {
                return None;
            }
            let inverse = matrix.inverse();
            let shift = inverse * gradient;
            steps += 1;
            let square = gradient.dot(shift);
            match stages.as_slice() {
                // By less than rounding of the pixels.
                [] if square <= 1e-20 || steps >= STEPS => {
                    let sights = self.sights(point, at).collect::<Option<_>>()?;
                    return Some(Placed { sights, inverse });
                }
                [] => {}
                _ if square <= 0.01 || steps >= STEPS => stage = stages.next()?,
                _ => {}
            }
            at -= shift;
        }
    }
}

/// The quadratic form of chosen points about cameras, by photograph; `None` where no point tells of
/// them. `loss_px` is c of the robust loss, in pixels.
pub(super) fn linearised(
    points: &[&FoundPoint],
    cameras: &[Option<Camera>],
    loss_px: f64,
) -> Option<Term> {
    let columns = Columns::of(cameras, loss_px);
    let count = columns.numbers.len();
    if count == 0 {
        return None;
    }
    let mut sum = Normal { matrix: Mat::zeros(count, count), gradient: vec![0.0; count] };
    let (mut squares, mut freedom) = (0.0, 7.0 - count as f64);
    let placed: Vec<Placed> = points.par_iter().filter_map(|own| columns.placed(own)).collect();
    for own in &placed {
        let square =
            |own: &Sight| columns.weight(own.residual, 1.0) * own.residual.length_squared();
        squares += own.sights.iter().map(square).sum::<f64>();
        freedom += 2.0 * own.sights.len() as f64 - 3.0;
        sum.add(&columns, own);
    }
    if freedom <= 0.0 {
        return None;
    }
    let variance = (squares / freedom).max(LEAST_PX * LEAST_PX);
    let scales: Vec<f64> = (0..count).map(|i| (sum.matrix[(i, i)] / variance).sqrt()).collect();
    if scales.iter().any(|scale| scale.is_nan() || *scale <= 0.0) {
        return None;
    }
    let mut scaled = Mat::from_fn(count, count, |i, j| {
        sum.matrix[(i.max(j), i.min(j))] / (variance * scales[i] * scales[j])
    });
    for direction in unseen(&columns.numbers, cameras, &scales) {
        for i in 0..count {
            (0..count).for_each(|j| scaled[(i, j)] += direction[i] * direction[j]);
        }
    }
    (0..count).for_each(|i| scaled[(i, i)] += RIDGE);
    let lower = scaled.llt(Side::Lower).ok()?;
    let lower = lower.L();
    let factor = Mat::from_fn(count, count, |i, j| lower[(j, i)] * scales[j]);
    // Forward substitution: the offset of which the gradient is that of the tracks.
    let mut offset = vec![0.0; count];
    for i in 0..count {
        let before: f64 = (0..i).map(|j| lower[(i, j)] * offset[j]).sum();
        offset[i] = (sum.gradient[i] / (variance * scales[i]) - before) / lower[(i, i)];
    }
    Some(Term { numbers: columns.numbers, factor, offset })
}

/// The normal equations of the numbers alone.
struct Normal {
    /// The lower triangle.
    matrix: Mat<f64>,
    gradient: Vec<f64>,
}

impl Normal {
    /// Adds a point that is placed, and eliminates it.
    fn add(&mut self, columns: &Columns, Placed { sights, inverse }: &Placed) {
        let mut mixed: Vec<(usize, DVec3)> = Vec::new();
        let mut pull = DVec3::ZERO;
        for own in sights {
            let weight = columns.weight(own.residual, 1.0);
            let by_point = |by: DVec2| DVec3::from(own.seen.by_point.map(|own| own.dot(by)));
            pull += by_point(own.residual) * weight;
            for (i, by) in columns.slopes(own) {
                self.gradient[i] += weight * by.dot(own.residual);
                for (j, other) in columns.slopes(own).filter(|(j, _)| *j <= i) {
                    self.matrix[(i, j)] += weight * by.dot(other);
                }
                let change = by_point(by) * weight;
                match mixed.iter_mut().find(|(column, _)| *column == i) {
                    Some((_, sum)) => *sum += change,
                    None => mixed.push((i, change)),
                }
            }
        }
        for &(i, by) in &mixed {
            let own = *inverse * by;
            self.gradient[i] -= own.dot(pull);
            for &(j, other) in mixed.iter().filter(|(j, _)| *j <= i) {
                self.matrix[(i, j)] -= own.dot(other);
            }
        }
    }
}

/// Changes of all cameras at once that tracks cannot tell: three shifts, three turns, the scale;
/// orthonormal, in units of the scales. They are held, since the similarity from the engine's
/// coordinates to the world stands for them.
fn unseen(numbers: &[Number], cameras: &[Option<Camera>], scales: &[f64]) -> Vec<Vec<f64>> {
    let places = || cameras.iter().flatten().map(|own| own.pose.position);
    let middle = places().sum::<DVec3>() / places().count().max(1) as f64;
    let change = |movement: usize, number: &Number| {
        let &Number::Pose(photograph, part) = number else { return 0.0 };
        let Some(camera) = cameras[photograph] else { return 0.0 };
        let from_middle = camera.pose.position - middle;
        let axis = |k: usize| DVec3::AXES[k % 3];
        match (movement, part) {
            (0..3, 3..) => axis(movement)[part - 3],
            (3..6, 0..3) => (camera.pose.world_from_camera.transpose() * axis(movement))[part],
            (3..6, _) => axis(movement).cross(from_middle)[part - 3],
            (6, 3..) => from_middle[part - 3],
            _ => 0.0,
        }
    };
    let mut all: Vec<Vec<f64>> = Vec::new();
    for movement in 0..7 {
        let mut own: Vec<f64> =
            numbers.iter().zip(scales).map(|(own, scale)| scale * change(movement, own)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let length = dot(&own, &own).sqrt();
        // Twice: once leaves what rounding loses.
        for other in all.iter().chain(&all) {
            let along = dot(&own, other);
            own.iter_mut().zip(other).for_each(|(own, other)| *own -= along * other);
        }
        let rest = dot(&own, &own).sqrt();
        if rest > 1e-9 * length {
            own.iter_mut().for_each(|value| *value /= rest);
            all.push(own);
        }
    }
    all
}

//! The sun: a directional light, whose sharp shadows no lobe can draw.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::sampling::Frame;
use crate::reconstruct::joint::background::fibonacci;
use crate::reconstruct::joint::fit::Fitter;
use crate::reconstruct::joint::project::{Linearised, Projected};
use crate::scene::{SurfacePoint, Views};
use crate::watch::Cancelled;

/// Directions over the sphere at which the search begins: about 4° apart.
const DIRECTIONS: usize = 2400;
/// Rows that the first search and the refinement look at, at most.
const FIRST_ROWS: usize = 1200;
const ROWS: usize = 6000;
/// Local searches, from the strongest of the first directions.
const STARTS: usize = 3;
/// Radians; the last is 0.03°, less than the sun's own size.
const FIRST_STEP: f32 = 0.044;
const LAST_STEP: f32 = 0.0005;

/// The direction, towards the sun, whose light explains most of the residuals.
pub fn search(fitter: &Fitter, problems: &[Linearised]) -> Result<Option<Vec3>, Cancelled> {
    let first = Look::new(fitter, problems, FIRST_ROWS, 0..0);
    fitter.watch().begin(DIRECTIONS as u64);
    let directions: Vec<Vec3> = fibonacci(DIRECTIONS, 0.0).collect();
    let gains: Vec<f64> = directions
        .par_iter()
        .map(|&direction| {
            fitter.watch().tick()?;
            Ok(first.gain(direction))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut order: Vec<usize> = (0..directions.len()).filter(|&k| gains[k] > 0.0).collect();
    order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));

    let closer = Look::new(fitter, problems, ROWS, 0..0);
    let mut best: Option<(Vec3, f64)> = None;
    for &start in order.iter().take(STARTS) {
        let found = closer.descend(fitter, directions[start])?;
        if best.is_none_or(|(_, gain)| found.1 > gain) {
            best = Some(found);
        }
    }
    Ok(best.map(|(direction, _)| direction))
}

/// The best direction near one whose column, `without`, is in the model.
pub fn refine(
    fitter: &Fitter,
    problems: &[Linearised],
    towards: Vec3,
    without: Range<usize>,
) -> Result<Vec3, Cancelled> {
    Ok(Look::new(fitter, problems, ROWS, without).descend(fitter, towards)?.0)
}

/// Some rows, and what is left to explain there.
struct Look<'a> {
    views: &'a Views<'a>,
    points: Vec<SurfacePoint>,
    projected: Vec<Projected>,
}

impl<'a> Look<'a> {
    fn new(
        fitter: &Fitter<'a>,
        problems: &[Linearised],
        most: usize,
        without: Range<usize>,
    ) -> Self {
        let samples = &fitter.rows.sample;
        let step = samples.len().div_ceil(most).max(1);
        let rows: Vec<usize> = (0..samples.len()).step_by(step).collect();
        Self {
            views: fitter.data.views,
            points: rows
                .iter()
                .map(|&row| fitter.data.cloud.samples[samples[row]].surface_point())
                .collect(),
            projected: problems
                .par_iter()
                .map(|problem| Projected::new(problem, &rows, without.clone()))
                .collect(),
        }
    }

    /// By how much a sun in a direction lowers the sum of the squared residuals.
    fn gain(&self, towards: Vec3) -> f64 {
        let column: Vec<f32> = self
            .points
            .iter()
            .map(|&point| {
                let cosine = towards.dot(point.normal);
                let lit =
                    cosine > 0.0 && !self.views.caster.occluded(&self.views.ray(point, towards));
                if lit { cosine } else { 0.0 }
            })
            .collect();
        let mut total = 0.0;
        for problem in &self.projected {
            let scaled: Vec<f32> =
                column.iter().zip(&problem.scale).map(|(value, scale)| value * scale).collect();
            let matrix = MatRef::from_column_major_slice(&scaled, scaled.len(), 1);
            let mut parts = Mat::zeros(problem.basis.ncols(), 1);
            let basis = problem.basis.transpose();
            matmul(parts.as_mut(), Accum::Replace, basis, matrix, 1.0, Par::Seq);
            let (mut square, mut product) = (0.0f64, 0.0f64);
            for (&value, &residual) in scaled.iter().zip(&problem.residual) {
                square += f64::from(value).powi(2);
                product -= f64::from(value) * f64::from(residual);
            }
            let explained: f64 = parts.col(0).iter().map(|part| f64::from(*part).powi(2)).sum();
            let kept = square - explained;
            if product > 0.0 && kept > 1e-3 * square {
                total += product * product / kept;
            }
        }
        total
    }

    fn descend(&self, fitter: &Fitter, start: Vec3) -> Result<(Vec3, f64), Cancelled> {
        let mut best = (start, self.gain(start));
        let mut step = FIRST_STEP;
        while step > LAST_STEP {
            fitter.watch().check()?;
            let frame = Frame::about(best.0);
            let tries: Vec<Vec3> = (0..9)
                .filter(|&k| k != 4)
                .map(|k| {
                    let offset = Vec2::new((k % 3) as f32 - 1.0, (k / 3) as f32 - 1.0) * step;
                    let moved = best.0 + frame.tangent * offset.x + frame.bitangent * offset.y;
                    moved.normalize_or_zero()
                })
                .collect();
            let gains: Vec<f64> = tries.par_iter().map(|&towards| self.gain(towards)).collect();
            let mut moved = false;
            for (towards, gain) in tries.into_iter().zip(gains) {
                if gain > best.1 {
                    best = (towards, gain);
                    moved = true;
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        Ok(best)
    }
}

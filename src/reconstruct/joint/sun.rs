//! The sun: a directional light, whose sharp shadows no lobe can draw.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::sampling::{Frame, fibonacci};
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::linearised::{Residue, residues};
use crate::reconstruct::joint::problem::Problem;
use crate::scene::{SurfacePoint, Views};
use crate::watch::Cancelled;

/// Directions over the sphere at which the search begins: about 5° apart.
const DIRECTIONS: usize = 1500;
/// Rows that the first search and the refinement look at, at most.
const FIRST_ROWS: usize = 1200;
const ROWS: usize = 6000;
/// Local searches, from the strongest of the first directions.
const STARTS: usize = 3;
/// Radians; the last is 0.03°, less than the sun's own size.
const FIRST_STEP: f32 = 0.044;
const LAST_STEP: f32 = 0.0005;

/// Directions in which a sun may stand, with where it would shine.
pub struct Directions {
    towards: Vec<Vec3>,
    rows: Vec<usize>,
    /// V cos θ per direction and row.
    columns: Vec<Vec<f32>>,
}

impl Directions {
    /// Directions above the horizon; none where none is looked for.
    ///
    /// # Errors
    /// If it is cancelled.
    pub fn new(problem: &Problem, is_wanted: bool) -> Result<Self, Cancelled> {
        let rows = problem.every(FIRST_ROWS);
        let points: Vec<SurfacePoint> =
            rows.iter().map(|&row| problem.surface_point(row)).collect();
        let towards: Vec<Vec3> = fibonacci(if is_wanted { DIRECTIONS } else { 0 }, 0.0)
            .filter(|&towards| is_above(towards))
            .collect();
        let columns = towards
            .par_iter()
            .map(|&towards| {
                problem.watch().check()?;
                Ok(column(problem.data.views, &points, towards))
            })
            .collect::<Result<_, Cancelled>>()?;
        Ok(Self { towards, rows, columns })
    }

    /// The direction, towards the sun, whose light explains most of what a fit leaves; `None` where
    /// none of them lowers the sum of the squared residuals by more than `rival`.
    ///
    /// # Errors
    /// If it is cancelled.
    pub fn best(
        &self,
        problem: &Problem,
        fitted: &Fitted,
        rival: f64,
    ) -> Result<Option<Vec3>, Cancelled> {
        if self.towards.is_empty() {
            return Ok(None);
        }
        let residues = residues(problem, fitted, &self.rows, None);
        let gains: Vec<f64> =
            self.columns.par_iter().map(|column| gain(column, &residues)).collect();
        let mut order: Vec<usize> = (0..gains.len()).filter(|&k| gains[k] > rival).collect();
        order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
        if order.is_empty() {
            return Ok(None);
        }
        let closer = Look::new(problem, fitted, ROWS, None);
        let mut best: Option<(Vec3, f64)> = None;
        for &start in order.iter().take(STARTS) {
            let found = closer.descend(problem, self.towards[start])?;
            if best.is_none_or(|(_, gain)| found.1 > gain) {
                best = Some(found);
            }
        }
        Ok(best.map(|(direction, _)| direction))
    }
}

/// The best direction near that of a sun which is the part `slot` of the fit's model.
pub fn refine(
    problem: &Problem,
    fitted: &Fitted,
    towards: Vec3,
    slot: usize,
) -> Result<Vec3, Cancelled> {
    Ok(Look::new(problem, fitted, ROWS, Some(slot)).descend(problem, towards)?.0)
}

/// Some rows, and what is left to explain there.
struct Look<'a> {
    views: &'a Views<'a>,
    points: Vec<SurfacePoint>,
    residues: Vec<Residue>,
}

impl<'a> Look<'a> {
    fn new(problem: &Problem<'a>, fitted: &Fitted, most: usize, without: Option<usize>) -> Self {
        let rows = problem.every(most);
        Self {
            views: problem.data.views,
            points: rows.iter().map(|&row| problem.surface_point(row)).collect(),
            residues: residues(problem, fitted, &rows, without),
        }
    }

    /// By how much a sun in a direction lowers the sum of the squared residuals.
    fn gain(&self, towards: Vec3) -> f64 {
        if !is_above(towards) {
            return 0.0;
        }
        gain(&column(self.views, &self.points, towards), &self.residues)
    }

    fn descend(&self, problem: &Problem, start: Vec3) -> Result<(Vec3, f64), Cancelled> {
        let mut best = (start, self.gain(start));
        let mut step = FIRST_STEP;
        while step > LAST_STEP {
            problem.watch().check()?;
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

/// Whether a direction is above the horizon; z is up in every capture.
fn is_above(towards: Vec3) -> bool {
    towards.z > 0.0
}

/// V cos θ of a sun at some surface points.
fn column(views: &Views, points: &[SurfacePoint], towards: Vec3) -> Vec<f32> {
    points
        .iter()
        .map(|&point| {
            let cosine = towards.dot(point.normal);
            let lit = cosine > 0.0 && !views.caster.occluded(&views.ray(point, towards));
            if lit { cosine } else { 0.0 }
        })
        .collect()
}

/// A column of which the model's columns leave less than this part, squared, is noise of single
/// precision. A sun that lights nearly all rows differs from brighter surfaces by its shadows alone.
const LEAST_KEPT: f64 = 1e-5;

/// By how much a light with this column lowers the sum of the squared residuals.
fn gain(column: &[f32], residues: &[Residue]) -> f64 {
    let mut total = 0.0;
    for residue in residues {
        let scaled: Vec<f32> =
            column.iter().zip(&residue.scale).map(|(value, scale)| value * scale).collect();
        let matrix = MatRef::from_column_major_slice(&scaled, scaled.len(), 1);
        let mut parts = Mat::zeros(residue.basis.ncols(), 1);
        let basis = residue.basis.transpose();
        matmul(parts.as_mut(), Accum::Replace, basis, matrix, 1.0, Par::Seq);
        let (mut square, mut product) = (0.0f64, 0.0f64);
        for (&value, &residual) in scaled.iter().zip(&residue.residual) {
            square += f64::from(value).powi(2);
            product -= f64::from(value) * f64::from(residual);
        }
        let explained: f64 = parts.col(0).iter().map(|part| f64::from(*part).powi(2)).sum();
        let kept = square - explained;
        if product > 0.0 && kept > LEAST_KEPT * square {
            total += product * product / kept;
        }
    }
    total
}

//! Bundle adjustment: Levenberg–Marquardt over all cameras, lenses, things and points that are
//! placed.
//!
//! Minimises Σ ½ c² ln(1 + (r/c)²) over the residuals of drawn strokes (Cauchy's loss) plus Σ ½ r²
//! over those of typed numbers, by reweighted least squares: each step solves the normal equations
//! (faer's Cholesky) with weights 1 / (1 + (r/c)²) and damping in the units of the diagonal
//! (Marquardt, 1963; its control after H. B. Nielsen, "Damping Parameter in Marquardt's Method",
//! 1999). The problems are of some hundred unknowns, so the normal equations are dense.

use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, Par, Side};

use super::residuals::{self, Row};
use super::rig::Rig;
use super::unknowns::{State, Unknowns};
use super::{Model, ModelError};
use crate::watch::Watch;

/// How the adjustment is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdjustOptions {
    /// c of the loss, in pixels, > 0: a residual of c has half the weight of a small one. Default
    /// 3: three times the error of a careful hand.
    pub loss_px: f64,
    /// Most steps that are tried. Default 500.
    pub max_steps: usize,
    /// Ends when a step changes the residuals by less than this in all, in pixels: the length of
    /// the step, each unknown in the units of its column of the Jacobian. > 0. Default 1e-9.
    pub tolerance_px: f64,
    /// What an engine's points tell is made quadratic anew until that changes the result by less
    /// than this, in the same units. > 0. Default 0.01.
    pub tracks_px: f64,
}

impl Default for AdjustOptions {
    fn default() -> Self {
        Self { loss_px: 3.0, max_steps: 500, tolerance_px: 1e-9, tracks_px: 0.01 }
    }
}

/// Why an adjustment ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// The inequality of [`AdjustOptions::tolerance_px`] was met.
    Converged,
    /// [`AdjustOptions::max_steps`] were tried.
    MaxSteps,
    /// No step made the cost smaller, however short: rounding, or an undetermined problem.
    Stalled,
    /// It was asked to stop; the values are those of the last step.
    Cancelled,
}

/// The result of an adjustment.
#[derive(Clone, Debug)]
pub struct Adjusted {
    /// The values at the minimum.
    pub state: State,
    /// Which of them were adjusted.
    pub unknowns: Unknowns,
    /// The residuals there.
    pub rows: Vec<Row>,
    /// The cost before and after, in square pixels.
    pub cost: [f64; 2],
    /// Steps that were tried.
    pub steps: usize,
    /// Why it ended.
    pub stopped: Stopped,
}

/// The weight of a residual: 1 where it is small against the loss' scale or was typed.
pub fn weight(row: &Row, loss_px: f64) -> f64 {
    if row.is_drawn { 1.0 / (1.0 + (row.value / loss_px).powi(2)) } else { 1.0 }
}

/// Adjusts everything that is placed in `start`, with what an engine tells about its cameras.
pub fn adjust(
    model: &Model,
    rig: &Rig,
    start: &State,
    options: &AdjustOptions,
    watch: &Watch,
) -> Result<Adjusted, ModelError> {
    let rows = |state: &State, unknowns: &Unknowns| residuals::rows(model, rig, state, unknowns);
    minimise(start, Unknowns::of(model, start), rows, options, watch).map_err(|stroke| {
        ModelError::new(
            format!("strokes[{stroke}]"),
            format!("{} lies behind its camera as it is placed", model.stroke_name(stroke)),
            "Check that the stroke names the right corner and photograph",
        )
    })
}

/// Adjusts the unknowns to the minimum of the cost of some residuals. `residuals` are those of a
/// state; one that has none is not gone to, and is the error where it is the first.
pub(super) fn minimise<E>(
    start: &State,
    unknowns: Unknowns,
    residuals: impl Fn(&State, &Unknowns) -> Result<Vec<Row>, E>,
    options: &AdjustOptions,
    watch: &Watch,
) -> Result<Adjusted, E> {
    let mut state = start.clone();
    let mut rows = residuals(&state, &unknowns)?;
    let first = cost(&rows, options.loss_px);
    let mut now = first;
    let (mut damping, mut growth) = (1e-4, 2.0);
    let (mut steps, mut stopped) = (0, Stopped::MaxSteps);
    if unknowns.list.is_empty() {
        stopped = Stopped::Converged;
    }
    let mut normal = Normal::of(&rows, unknowns.list.len(), options.loss_px);
    while steps < options.max_steps && stopped == Stopped::MaxSteps {
        if watch.check().is_err() {
            stopped = Stopped::Cancelled;
            break;
        }
        steps += 1;
        let step = normal.step(damping);
        let Some(step) = step.filter(|step| step.iter().all(|value| value.is_finite())) else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                stopped = Stopped::Stalled;
            }
            continue;
        };
        let (length, predicted) = normal.measure(&step, damping);
        let tried = unknowns.moved(&state, &step);
        let next = residuals(&tried, &unknowns);
        let after = next.as_ref().map_or(f64::INFINITY, |rows| cost(rows, options.loss_px));
        if after < now || (after == now && length <= options.tolerance_px) {
            let ratio = (now - after) / predicted.max(f64::MIN_POSITIVE);
            damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0);
            damping = damping.max(1e-15);
            growth = 2.0;
            (state, now) = (tried, after);
            rows = next.unwrap_or_default();
            if length <= options.tolerance_px {
                stopped = Stopped::Converged;
            } else {
                normal = Normal::of(&rows, unknowns.list.len(), options.loss_px);
            }
        } else {
            // At the minimum rounding decides whether the cost falls.
            if length <= options.tolerance_px.max(1e-6) && damping <= 1.0 {
                stopped = Stopped::Converged;
            }
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                stopped = Stopped::Stalled;
            }
        }
    }
    Ok(Adjusted { state, unknowns, rows, cost: [first, now], steps, stopped })
}

/// The cost of residuals, in square pixels.
pub fn cost(rows: &[Row], loss_px: f64) -> f64 {
    let square = loss_px * loss_px;
    let one = |row: &Row| {
        let own = row.value * row.value;
        if row.is_drawn { 0.5 * square * (own / square).ln_1p() } else { 0.5 * own }
    };
    rows.iter().map(one).sum()
}

/// Adds rows that name most of the unknowns, as those of an engine's points do, by one product of
/// matrices.
fn add_dense(matrix: &mut Mat<f64>, gradient: &mut [f64], rows: &[&Row], loss_px: f64) {
    let mut block = Mat::<f64>::zeros(rows.len(), gradient.len());
    for (i, row) in rows.iter().enumerate() {
        let root = weight(row, loss_px).sqrt();
        for &(j, slope) in &row.slopes {
            block[(i, j)] += root * slope;
            gradient[j] += root * root * slope * row.value;
        }
    }
    triangular::matmul(
        matrix.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        block.transpose(),
        BlockStructure::Rectangular,
        block.as_ref(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// The normal equations of one linearisation.
pub(super) struct Normal {
    /// The lower triangle.
    matrix: Mat<f64>,
    gradient: Vec<f64>,
}

impl Normal {
    pub(super) fn of(rows: &[Row], unknowns: usize, loss_px: f64) -> Self {
        let mut matrix = Mat::<f64>::zeros(unknowns, unknowns);
        let mut gradient = vec![0.0; unknowns];
        let is_dense = |row: &&Row| 2 * row.slopes.len() > unknowns;
        add_dense(
            &mut matrix,
            &mut gradient,
            &rows.iter().filter(is_dense).collect::<Vec<_>>(),
            loss_px,
        );
        for row in rows.iter().filter(|row| !is_dense(row)) {
            let weight = weight(row, loss_px);
            for &(i, slope) in &row.slopes {
                gradient[i] += weight * slope * row.value;
                // The lower triangle; the product of a pair stands there once, of one twice.
                for &(j, other) in row.slopes.iter().filter(|(j, _)| *j <= i) {
                    matrix[(i, j)] += weight * slope * other;
                }
            }
        }
        Self { matrix, gradient }
    }

    /// An element of the matrix, which is symmetric.
    pub(super) fn at(&self, i: usize, j: usize) -> f64 {
        self.matrix[(i.max(j), i.min(j))]
    }

    /// What the diagonal is taken for where it vanishes.
    fn scale(&self, i: usize) -> f64 {
        let diagonal = self.matrix[(i, i)];
        if diagonal > 0.0 { diagonal } else { 1.0 }
    }

    fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let count = self.gradient.len();
        let mut damped = self.matrix.clone();
        (0..count).for_each(|i| damped[(i, i)] += damping * self.scale(i));
        let factor = damped.llt(Side::Lower).ok()?;
        let right = Mat::from_fn(count, 1, |i, _| -self.gradient[i]);
        let step = factor.solve(&right);
        Some((0..count).map(|i| step[(i, 0)]).collect())
    }

    /// The length of a step in pixels, and by how much it should lower the cost.
    fn measure(&self, step: &[f64], damping: f64) -> (f64, f64) {
        let (mut length, mut predicted) = (0.0, 0.0);
        for (i, &change) in step.iter().enumerate() {
            let scaled = self.scale(i) * change * change;
            length += scaled;
            predicted += 0.5 * (damping * scaled - self.gradient[i] * change);
        }
        (length.sqrt(), predicted)
    }
}

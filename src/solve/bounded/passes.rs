//! The outer loop: passes over `A` that price its columns, and solutions on the working ones.

use faer::Mat;

use super::exchange::{self, Box, violation};
use super::kernels::dot;
use super::model::{FactorModel, GramModel};
use super::system::{Point, System, norm};
use super::working::Working;
use super::{BoundedError, BoundedOptions, BoundedSolution, Path, PathChoice};
use crate::watch::Watch;

/// Up to this many columns, all inner products cost less than the passes they save.
const FEW_COLUMNS: usize = 96;
/// A solution on the working columns should reduce their violations by this factor at least;
/// if not, their Gram matrix is too inaccurate.
const CONTRACTION: f64 = 0.1;
/// Passes without progress, on the orthogonal factor, before giving up.
const PATIENCE: usize = 4;

pub fn solve(
    system: &System,
    mut point: Point,
    start: Option<&[f64]>,
    options: &BoundedOptions,
    watch: &Watch,
) -> Result<BoundedSolution, BoundedError> {
    let n = system.columns;
    let (lower, upper): (Vec<f64>, Vec<f64>) = (0..n).map(|j| system.scaled_bounds(j)).unzip();
    let movable: Vec<bool> = (0..n).map(|j| !system.is_zero(j) && lower[j] < upper[j]).collect();
    let path = match options.choice {
        PathChoice::Gram => Path::Gram,
        PathChoice::Auto if n <= FEW_COLUMNS => Path::Gram,
        _ => Path::Columns,
    };

    let mut working = Working::new(system);
    let first: Vec<usize> = (0..n)
        .filter(|&j| {
            movable[j] && (path == Path::Gram || (lower[j] < point.y[j] && point.y[j] < upper[j]))
        })
        .collect();
    working.extend(system, &first);

    let goal = options.tolerance * system.scale;
    let (mut passes, mut iterations) = (1, 0);
    let mut exact = false;
    let (mut best_violation, mut best_objective) = (f64::INFINITY, f64::INFINITY);
    let mut stalled = 0;
    let mut last_largest = f64::INFINITY;
    loop {
        let violations: Vec<f64> = (0..n)
            .map(|j| {
                if movable[j] {
                    violation(point.y[j], lower[j], upper[j], point.gradient[j])
                } else {
                    0.0
                }
            })
            .collect();
        let largest = violations.iter().copied().fold(0.0, f64::max);
        let inside = working.members.iter().map(|&j| violations[j]).fold(0.0, f64::max);
        let objective = dot(&point.residual, &point.residual)
            + system.ridge * system.ridge * dot(&point.y, &point.y);
        if std::env::var("DBG").is_ok() {
            eprintln!(
                "pass {passes} w {} kkt {:.2e} inside {:.2e} obj {objective:.15e} it {iterations} exact {exact} nviol {}",
                working.members.len(),
                largest / system.scale,
                inside / system.scale,
                violations.iter().filter(|v| **v > goal).count()
            );
        }
        let converged = largest <= goal;
        if largest < 0.5 * best_violation || objective < best_objective * (1.0 - 1e-12) {
            stalled = 0;
        } else {
            stalled += 1;
        }
        best_violation = best_violation.min(largest);
        best_objective = best_objective.min(objective);
        if converged || iterations >= options.max_iterations || stalled >= PATIENCE {
            let x = system.unscaled(&point.y, start);
            return Ok(BoundedSolution {
                residual_norm: norm(&point.residual),
                kkt_residual: largest / system.scale,
                kkt_absolute: (0..n).map(|j| violations[j] * system.norm(j)).fold(0.0, f64::max),
                active: (0..n)
                    .filter(|&j| movable[j] && lower[j] < point.y[j] && point.y[j] < upper[j])
                    .count(),
                iterations,
                passes,
                path,
                converged,
                x,
            });
        }
        exact |=
            stalled > 0 || (passes > 1 && inside > goal && inside > CONTRACTION * last_largest);
        last_largest = largest;

        let wanted = wanted(&violations, goal, |j| !working.contains(j), working.members.len());
        let limit = options.max_iterations - iterations;
        let inner_goal = 0.5 * goal;
        if exact {
            let members = exact_members(&violations, goal, &point.y, &lower, &upper, &movable);
            let mut model = factor_model(system, &members, &point);
            iterations += correct(
                &mut model, &members, &mut point, &lower, &upper, inner_goal, limit, watch,
            )?;
        } else {
            working.extend(system, &wanted);
            let gradient = working.members.iter().map(|&j| point.gradient[j]).collect();
            let mut model = GramModel::new(working.gram(), gradient);
            iterations += correct(
                &mut model,
                &working.members,
                &mut point,
                &lower,
                &upper,
                inner_goal,
                limit,
                watch,
            )?;
        }
        watch.check()?;
        system.evaluate(&mut point);
        passes += 1;
    }
}

fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

fn wanted(
    violations: &[f64],
    goal: f64,
    eligible: impl Fn(usize) -> bool,
    size: usize,
) -> Vec<usize> {
    let mut found: Vec<usize> =
        (0..violations.len()).filter(|&j| violations[j] > goal && eligible(j)).collect();
    found.sort_by(|&a, &b| violations[b].total_cmp(&violations[a]).then(a.cmp(&b)));
    let most = (env("KMIN", 32.0) as usize).max((size as f64 * env("KSHARE", 0.5)) as usize);
    let fraction = found.first().map_or(0.0, |&j| env("KFRAC", 0.0) * violations[j]);
    found.into_iter().take(most).take_while(|&j| violations[j] >= fraction).collect()
}

fn exact_members(
    violations: &[f64],
    goal: f64,
    y: &[f64],
    lower: &[f64],
    upper: &[f64],
    movable: &[bool],
) -> Vec<usize> {
    let between = |j: usize| movable[j] && lower[j] < y[j] && y[j] < upper[j];
    let mut members: Vec<usize> = (0..y.len()).filter(|&j| between(j)).collect();
    members.extend(wanted(violations, goal, |j| !between(j), members.len()));
    members
}

#[allow(clippy::too_many_arguments)]
fn correct<M: super::model::Model>(
    model: &mut M,
    members: &[usize],
    point: &mut Point,
    lower: &[f64],
    upper: &[f64],
    goal: f64,
    limit: usize,
    watch: &Watch,
) -> Result<usize, BoundedError> {
    let pick = |values: &[f64]| members.iter().map(|&j| values[j]).collect::<Vec<f64>>();
    let (mut y, lower, upper) = (pick(&point.y), pick(lower), pick(upper));
    let free: Vec<usize> =
        (0..members.len()).filter(|&p| lower[p] < y[p] && y[p] < upper[p]).collect();
    let mut state = Box { y: &mut y, lower: &lower, upper: &upper };
    let iterations = exchange::solve(model, &mut state, &free, goal, limit, watch)?;
    for (&j, &y) in members.iter().zip(&y) {
        point.y[j] = y;
    }
    Ok(iterations)
}

/// The working columns without their squares: themselves, or, when there are many more rows
/// than columns, the triangle of their QR factors and the residual in that basis.
fn factor_model(system: &System, members: &[usize], point: &Point) -> FactorModel {
    let count = members.len();
    // A ridge is as many rows more, with residual 0 − ridge y.
    let extra = if system.ridge > 0.0 { count } else { 0 };
    let rows = system.rows + extra;
    let mut all = Mat::zeros(rows, count + 1);
    for (position, &j) in members.iter().enumerate() {
        let column = all.col_mut(position).try_as_col_major_mut().expect("column-major");
        system.copy_column(j, &mut column.as_slice_mut()[..system.rows]);
        if extra > 0 {
            all[(system.rows + position, position)] = system.ridge;
            all[(system.rows + position, count)] = -system.ridge * point.y[j];
        }
    }
    for (row, &value) in point.residual.iter().enumerate() {
        all[(row, count)] = value;
    }
    let small = if rows > count + 1 { all.qr().thin_R().to_owned() } else { all };
    let columns = small.subcols(0, count).to_owned();
    let residual = small.col(count).iter().copied().collect();
    FactorModel::new(columns, residual)
}

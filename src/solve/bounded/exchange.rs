//! The active-set loop on the working columns.

use super::BoundedError;
use super::model::Model;
use crate::watch::Watch;

/// The unknowns of the working columns, and their box.
pub struct State {
    pub y: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
}

/// Ends when no working column violates its optimality condition by more than `tolerance` (in
/// the units of the gradient), or after `limit` subspace solutions; gives their
/// number.
///
/// Columns that violate enter several at once. Each subspace minimum is approached through the
/// box: the whole step cut off at the bounds if that lowers the objective at least as much as
/// the step up to the first bound would by half, else the latter; what meets a bound leaves.
/// The free list then only shrinks until a subspace minimum inside the box is reached, each
/// of these is lower than the one before, and there are finitely many.
pub fn solve<M: Model>(
    model: &mut M,
    state: &mut State,
    start_free: &[usize],
    tolerance: f64,
    limit: usize,
    watch: &Watch,
) -> Result<usize, BoundedError> {
    // Columns that cannot enter the present free ones: they depend on them, or would leave the
    // box at once. It holds until others are free.
    let mut refused = vec![false; state.y.len()];
    if !model.replace(start_free) {
        for &column in start_free {
            refused[column] = !model.enter(column);
        }
    }
    let limit = limit.min(LIMIT_PER_COLUMN * state.y.len() + LIMIT_AT_LEAST);
    let mut iterations = 0;
    let mut newcomers = Vec::new();
    loop {
        while !model.free().is_empty() && iterations < limit {
            watch.check()?;
            iterations += 1;
            match descend(model, state, &newcomers, &mut refused) {
                Descent::Minimum => break,
                Descent::Continue => newcomers.clear(),
            }
        }
        if iterations >= limit {
            return Ok(iterations);
        }
        newcomers = violating(model, state, &refused, tolerance);
        if newcomers.is_empty() {
            return Ok(iterations);
        }
        newcomers.retain(|&column| {
            let entered = model.enter(column);
            refused[column] |= !entered;
            entered
        });
    }
}

enum Descent {
    /// The minimum over the free columns lies in the box and has been reached.
    Minimum,
    /// Some columns left; the minimum over the others is to be tried.
    Continue,
}

fn descend<M: Model>(
    model: &mut M,
    state: &mut State,
    newcomers: &[usize],
    refused: &mut [bool],
) -> Descent {
    let step = model.newton_step();
    let free = model.free().to_vec();

    // A column on its bound that wants to leave the box cannot move at all.
    let stuck: Vec<usize> = (0..free.len())
        .filter(|&p| {
            let j = free[p];
            (state.y[j] <= state.lower[j] && step[p] <= 0.0)
                || (state.y[j] >= state.upper[j] && step[p] >= 0.0)
        })
        .collect();
    if !stuck.is_empty() {
        for &p in &stuck {
            // Its gradient said otherwise only by rounding or by the others that entered with
            // it: it waits until something has changed.
            refused[free[p]] |= newcomers.contains(&free[p]);
        }
        model.leave(&stuck);
        return Descent::Continue;
    }

    // How much of the step fits.
    let mut fraction = 1.0_f64;
    for (p, &j) in free.iter().enumerate() {
        let room = if step[p] < 0.0 { state.lower[j] } else { state.upper[j] } - state.y[j];
        if room.abs() < step[p].abs() {
            fraction = fraction.min(room / step[p]);
        }
    }
    if newcomers.iter().any(|j| free.contains(j)) {
        refused.fill(false);
    }
    if fraction >= 1.0 {
        model.advance(&step);
        for (p, &j) in free.iter().enumerate() {
            state.y[j] = (state.y[j] + step[p]).clamp(state.lower[j], state.upper[j]);
        }
        return Descent::Minimum;
    }

    let before: Vec<f64> = free.iter().map(|&j| model.gradient()[j]).collect();
    let slope: f64 = before.iter().zip(&step).map(|(g, s)| g * s).sum();
    let target = |p: usize, part: f64| {
        let j = free[p];
        (state.y[j] + part * step[p]).clamp(state.lower[j], state.upper[j])
    };
    let cut: Vec<f64> = (0..free.len()).map(|p| target(p, 1.0)).collect();
    let moves: Vec<f64> = free.iter().zip(&cut).map(|(&j, to)| to - state.y[j]).collect();
    model.advance(&moves);
    // Along a step d the quadratic falls by d·(g + g')/2, g and g' being the ends' gradients.
    let fall: f64 =
        (0..free.len()).map(|p| 0.5 * moves[p] * (before[p] + model.gradient()[free[p]])).sum();
    let reached = if fall >= 0.5 * fraction * (1.0 - 0.5 * fraction) * slope {
        cut
    } else {
        let short: Vec<f64> = (0..free.len()).map(|p| target(p, fraction)).collect();
        let back: Vec<f64> = short.iter().zip(&cut).map(|(short, cut)| short - cut).collect();
        model.advance(&back);
        short
    };
    let mut arrived = Vec::new();
    let mut nearest = (f64::INFINITY, 0);
    for (p, &j) in free.iter().enumerate() {
        state.y[j] = reached[p];
        let bound = if step[p] < 0.0 { state.lower[j] } else { state.upper[j] };
        if reached[p] == bound {
            arrived.push(p);
        }
        let left = (bound - reached[p]).abs() / step[p].abs();
        if left < nearest.0 {
            nearest = (left, p);
        }
    }
    if arrived.is_empty() {
        // The first to meet its bound missed it by rounding.
        let p = nearest.1;
        let j = free[p];
        let bound = if step[p] < 0.0 { state.lower[j] } else { state.upper[j] };
        let mut last = vec![0.0; free.len()];
        last[p] = bound - state.y[j];
        model.advance(&last);
        state.y[j] = bound;
        arrived.push(p);
    }
    model.leave(&arrived);
    refused.fill(false);
    Descent::Continue
}

/// By how much a scaled descent direction violates the optimality condition at `y`.
pub fn violation(y: f64, lower: f64, upper: f64, gradient: f64) -> f64 {
    if (y >= upper && gradient > 0.0) || (y <= lower && gradient < 0.0) {
        0.0
    } else {
        gradient.abs()
    }
}

/// The columns to enter next: those whose violation is not far from the largest.
fn violating<M: Model>(model: &M, state: &State, refused: &[bool], tolerance: f64) -> Vec<usize> {
    let mut is_free = vec![false; state.y.len()];
    for &j in model.free() {
        is_free[j] = true;
    }
    let mut found: Vec<(f64, usize)> = (0..state.y.len())
        .filter(|&j| !refused[j] && !is_free[j])
        .map(|j| (violation(state.y[j], state.lower[j], state.upper[j], model.gradient()[j]), j))
        .filter(|&(violation, _)| violation > tolerance)
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let Some(&(largest, _)) = found.first() else { return Vec::new() };
    let most = 1 + model.free().len() / ENTER_SHARE;
    let fraction = ENTER_FRACTION * largest;
    found.into_iter().take(most).take_while(|found| found.0 >= fraction).map(|f| f.1).collect()
}

/// Subspace solutions on w working columns end after this many times w, and this many more: only
/// rounding can ask for so many, and a fresh gradient from `A` helps more then.
const LIMIT_PER_COLUMN: usize = 4;
const LIMIT_AT_LEAST: usize = 500;
/// At most 1 + free / this many columns enter at once.
const ENTER_SHARE: usize = 4;
/// Columns enter whose violation is at least this part of the largest.
const ENTER_FRACTION: f64 = 0.5;

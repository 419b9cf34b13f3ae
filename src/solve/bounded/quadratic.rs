//! Bounded quadratic programs of a few hundred unknowns whose matrix is at hand.

use faer::{Mat, MatRef};

use super::BoundedError;
use super::exchange::{self, State};
use super::model::GramModel;
use crate::solve::kernels::{add_scaled, column_of, column_of_mut};
use crate::watch::Watch;

/// Minimises ½ xᵀHx − bᵀx with lower ≤ x ≤ upper, from `start` (projected onto the bounds), by
/// the active-set method of [`bounded_least_squares`](super::bounded_least_squares).
///
/// `hessian` is symmetric and positive semidefinite, n × n; the other slices have length n. An
/// unknown whose diagonal entry is not positive keeps its start. Among dependent columns the
/// ones that are free at the start, then the earlier ones, are preferred.
pub fn bounded_quadratic(
    hessian: MatRef<'_, f64>,
    linear: &[f64],
    lower: &[f64],
    upper: &[f64],
    start: &[f64],
    watch: &Watch,
) -> Result<Vec<f64>, BoundedError> {
    let count = linear.len();
    // Unit diagonals: the rules by which columns enter then do not depend on units.
    let scale: Vec<f64> = (0..count)
        .map(|j| {
            let square = hessian[(j, j)];
            if square > 0.0 && square.is_finite() { square.sqrt().recip() } else { 0.0 }
        })
        .collect();
    let mut gram = Mat::zeros(count, count);
    for j in 0..count {
        let (inner, column) = (column_of(hessian, j), column_of_mut(&mut gram, j));
        for ((value, inner), scale_i) in column.iter_mut().zip(inner).zip(&scale) {
            if scale_i * scale[j] != 0.0 {
                *value = inner * scale_i * scale[j];
            }
        }
        if scale[j] * scale[j] == 0.0 {
            column[j] = 1.0;
        }
    }
    let bound = |value: f64, j: usize| if scale[j] > 0.0 { value / scale[j] } else { 0.0 };
    let mut state = State {
        y: (0..count).map(|j| bound(start[j].clamp(lower[j], upper[j]), j)).collect(),
        lower: (0..count).map(|j| bound(lower[j], j)).collect(),
        upper: (0..count).map(|j| bound(upper[j], j)).collect(),
    };
    let mut gradient: Vec<f64> = (0..count).map(|j| linear[j] * scale[j]).collect();
    for (j, &y) in state.y.iter().enumerate().filter(|(_, y)| **y != 0.0) {
        add_scaled(&mut gradient, -y, column_of(gram.as_ref(), j));
    }
    let free: Vec<usize> = (0..count)
        .filter(|&j| state.lower[j] < state.y[j] && state.y[j] < state.upper[j])
        .collect();
    let size = (0..count).map(|j| (linear[j] * scale[j]).abs()).fold(0.0, f64::max);
    let mut model = GramModel::new(gram.as_ref(), gradient);
    exchange::solve(&mut model, &mut state, &free, TOLERANCE * size, LIMIT, watch)?;
    Ok((0..count)
        .map(|j| {
            if scale[j] <= 0.0 {
                start[j].clamp(lower[j], upper[j])
            } else if state.y[j] <= state.lower[j] {
                // On a bound it is the bound itself, not what rounding makes of it.
                lower[j]
            } else if state.y[j] >= state.upper[j] {
                upper[j]
            } else {
                (state.y[j] * scale[j]).clamp(lower[j], upper[j])
            }
        })
        .collect())
}

/// Relative to the largest entry of the scaled right side.
const TOLERANCE: f64 = 1e-12;
const LIMIT: usize = 100_000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::Random;

    /// The optimality conditions, checked on the problem as it was given.
    #[test]
    fn the_solution_meets_the_optimality_conditions() {
        let mut random = Random::new(3, 1, 4);
        for case in 0..30 {
            let n = 3 + case % 20;
            let mut draw = || f64::from(random.uniform()) - 0.5;
            let root = Mat::from_fn(n + 2, n, |_, _| draw());
            let hessian = root.transpose() * &root;
            let linear: Vec<f64> = (0..n).map(|_| draw()).collect();
            let lower: Vec<f64> = (0..n).map(|_| -0.3 + draw()).collect();
            let upper: Vec<f64> = lower.iter().map(|low| low + 0.4).collect();
            let start: Vec<f64> = (0..n).map(|_| draw()).collect();
            let x =
                bounded_quadratic(hessian.as_ref(), &linear, &lower, &upper, &start, &Watch::new())
                    .unwrap();
            for i in 0..n {
                let slope: f64 = linear[i] - (0..n).map(|j| hessian[(i, j)] * x[j]).sum::<f64>();
                assert!((lower[i]..=upper[i]).contains(&x[i]));
                // Some of these matrices are nearly singular: of a slope of order 1, the gradient
                // that is carried along keeps about ten digits.
                let rounding = 1e-8;
                assert!(x[i] < upper[i] || slope > -rounding, "case {case}, {i}: {slope}");
                assert!(x[i] > lower[i] || slope < rounding, "case {case}, {i}: {slope}");
                let is_free = x[i] > lower[i] && x[i] < upper[i];
                assert!(!is_free || slope.abs() < rounding, "case {case}, {i}: {slope}");
            }
        }
    }
}

//! Specular materials: the exponent by a search, everything else solved with it.
//!
//! For a fixed exponent the problem is smooth in ρ_d, ρ_s and the light; with the light held
//! fixed instead, as in the paper's alternation, ρ_s comes out several times too small.

use rayon::prelude::*;

use crate::reconstruct::Error;
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::problem::Problem;

/// What the search over one material's exponent found.
#[derive(Clone, Debug)]
pub struct Exponents {
    pub material: usize,
    pub exponent: f64,
    /// Exponents that explain the material's radiance about as well as the best.
    pub range: [f64; 2],
}

/// The exponents tried first; each a little more than half an octave's step in sharpness.
const TRIED: [f64; 8] = [3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0, 400.0];
/// An exponent is about as good if the material's own squared residuals are larger by no more
/// than this part.
const FLAT: f64 = 0.05;
/// Times that exponents halfway between the best and its neighbours are tried.
const HALVINGS: usize = 2;

/// Finds the exponent of every glossy material of a fit in turn, the others' given.
///
/// # Errors
/// As [`fit`].
pub fn find_exponents(
    problem: &Problem,
    fitted: Fitted,
) -> Result<(Fitted, Vec<Exponents>), Error> {
    let most = problem.data.options.gloss.max_exponent;
    let glossy = (0..problem.materials()).filter(|&m| fitted.model.gloss[m].is_some());
    let mut found = Vec::new();
    let mut best = fitted.clone();
    for material in glossy {
        let evaluate = |exponents: Vec<f64>| -> Result<Vec<(f64, Fitted)>, Error> {
            exponents
                .into_par_iter()
                .map(|exponent| {
                    let model = best.model.with_gloss(material, Some(exponent));
                    Ok((exponent, fit(problem, &model, Some(&best), ROUGH)?))
                })
                .collect()
        };
        let mut first: Vec<f64> = TRIED.into_iter().filter(|&exponent| exponent <= most).collect();
        if first.is_empty() {
            first.push(most);
        }
        let mut tried = evaluate(first)?;
        for _ in 0..HALVINGS {
            let least = least(&tried);
            let between = |a: usize, b: usize| (tried[a].0 * tried[b].0).sqrt();
            let mut next = Vec::new();
            if least > 0 {
                next.push(between(least - 1, least));
            }
            if least + 1 < tried.len() {
                next.push(between(least, least + 1));
            }
            tried.extend(evaluate(next)?);
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let least = least(&tried);
        found.push(Exponents {
            material,
            exponent: tried[least].0,
            range: range(problem, material, &tried, least),
        });
        best = tried.swap_remove(least).1;
    }
    Ok((best, found))
}

/// The exponents about the best that are about as good: where the cost crosses the limit, between
/// two that were tried.
fn range(problem: &Problem, material: usize, tried: &[(f64, Fitted)], least: usize) -> [f64; 2] {
    let fitted = &tried[least].1;
    let own: f64 = (0..problem.rows.sample.len())
        .filter(|&row| problem.rows.material[row] == material)
        .map(|row| {
            let squares: f64 = fitted.channels.iter().map(|fit| fit.residuals[row].powi(2)).sum();
            0.5 * problem.weights[row] * squares
        })
        .sum();
    let cost = |index: usize| tried[index].1.cost();
    let limit = cost(least) + FLAT * own;
    let crossing = |inside: usize, outside: usize| {
        let part = ((limit - cost(inside)) / (cost(outside) - cost(inside))).clamp(0.0, 1.0);
        let (a, b) = (tried[inside].0.ln(), tried[outside].0.ln());
        (a + part * (b - a)).exp()
    };
    let mut low = least;
    while low > 0 && cost(low - 1) <= limit {
        low -= 1;
    }
    let mut high = least;
    while high + 1 < tried.len() && cost(high + 1) <= limit {
        high += 1;
    }
    [
        if low > 0 { crossing(low, low - 1) } else { tried[low].0 },
        if high + 1 < tried.len() { crossing(high, high + 1) } else { tried[high].0 },
    ]
}

fn least(tried: &[(f64, Fitted)]) -> usize {
    let mut least = 0;
    for (index, (_, fitted)) in tried.iter().enumerate() {
        if fitted.cost() < tried[least].1.cost() {
            least = index;
        }
    }
    least
}

//! Specular materials: the exponent by a search, everything else solved with it.
//!
//! For a fixed exponent the problem is smooth in ρ_d, ρ_s and the light; with the light held
//! fixed instead, as in the paper's alternation, ρ_s comes out several times too small.

use crate::reconstruct::Error;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::model::Model;

/// What the search over one material's exponent found.
#[derive(Clone, Debug)]
pub struct Exponents {
    pub material: usize,
    /// Exponents that explain the material's radiance about as well as the best.
    pub range: [f64; 2],
}

/// The exponents tried first; each a little more than half an octave's step in sharpness.
const TRIED: [f64; 8] = [3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0, 400.0];
/// An exponent is about as good if the material's own squared residuals are larger by no more
/// than this part.
const FLAT: f64 = 0.05;

/// Finds the exponent of every specular material in turn, the others' given, and leaves the
/// fitter, the model and the fits with them.
pub fn find_exponents(
    fitter: &mut Fitter,
    model: &mut Model,
    lambda: f64,
    fits: &mut Fits,
) -> Result<Vec<Exponents>, Error> {
    let mut found = Vec::new();
    for material in 0..fitter.rows.materials {
        if !fitter.is_specular(material) {
            continue;
        }
        let most = fitter.data.options.gloss.max_exponent;
        let mut tried: Vec<(f64, f64, Fits)> = Vec::new();
        let mut evaluate =
            |exponent: f64, tried: &mut Vec<(f64, f64, Fits)>| -> Result<(), Error> {
                fitter.exponents[material] = exponent;
                fitter.data.set_exponents(&fitter.rows, model, &fitter.exponents);
                let fitted = fitter.fit(model, lambda, &fitter.weights, Some(fits))?;
                tried.push((exponent, Fitter::total(&fitted), fitted));
                Ok(())
            };
        for exponent in TRIED.into_iter().filter(|&exponent| exponent <= most) {
            evaluate(exponent, &mut tried)?;
        }
        if tried.is_empty() {
            evaluate(most, &mut tried)?;
        }
        // Between the best and its neighbours, in the logarithm.
        for _ in 0..2 {
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
            let best = best(&tried);
            let mut between = Vec::new();
            if best > 0 {
                between.push((tried[best - 1].0 * tried[best].0).sqrt());
            }
            if best + 1 < tried.len() {
                between.push((tried[best].0 * tried[best + 1].0).sqrt());
            }
            for exponent in between {
                evaluate(exponent, &mut tried)?;
            }
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = best(&tried);
        let (exponent, least, fitted) = tried[best].clone();
        let own: f64 = (0..fitter.rows.sample.len())
            .filter(|&row| fitter.rows.material[row] == material)
            .map(|row| {
                let squares: f64 = fitted.iter().map(|fit| fit.residuals[row].powi(2)).sum();
                0.5 * fitter.weights[row] * squares
            })
            .sum();
        let limit = least + FLAT * own;
        let mut range = [exponent; 2];
        // Where the objective crosses the limit, between two exponents that were tried.
        let crossing = |inside: usize, outside: usize| {
            let (a, b) = (&tried[inside], &tried[outside]);
            let part = ((limit - a.1) / (b.1 - a.1)).clamp(0.0, 1.0);
            (a.0.ln() + part * (b.0.ln() - a.0.ln())).exp()
        };
        let mut low = best;
        while low > 0 && tried[low - 1].1 <= limit {
            low -= 1;
        }
        range[0] = if low > 0 { crossing(low, low - 1) } else { tried[low].0 };
        let mut high = best;
        while high + 1 < tried.len() && tried[high + 1].1 <= limit {
            high += 1;
        }
        range[1] = if high + 1 < tried.len() { crossing(high, high + 1) } else { tried[high].0 };
        fitter.exponents[material] = exponent;
        fitter.data.set_exponents(&fitter.rows, model, &fitter.exponents);
        *fits = fitted;
        found.push(Exponents { material, range });
    }
    Ok(found)
}

fn best(tried: &[(f64, f64, Fits)]) -> usize {
    let mut best = 0;
    for (index, (_, value, _)) in tried.iter().enumerate() {
        if *value < tried[best].1 {
            best = index;
        }
    }
    best
}

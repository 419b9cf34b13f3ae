//! The problem linearised at a fit, with the columns of all unknowns of the model projected out.
//! What remains is the part of the residuals that only another light can reduce.

use faer::Mat;

use crate::math::rgb::CHANNELS;
use crate::reconstruct::joint::fit::{Fitted, ROUGH, with_terms};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::system::{Channel, Linearisation};
use crate::solve::kernels::{add_scaled, dot, vectorised};

/// One channel's linearised problem on some rows.
pub struct Residue {
    /// Orthonormal basis of the columns of light and reflectances, rows × columns.
    pub basis: Mat<f32>,
    /// The residual after projection; the residual before it has the norm 1.
    pub residual: Vec<f32>,
    /// ρ_d times the factor from a change of π L̂ to the change of a weighted residual.
    pub scale: Vec<f32>,
    /// The same with ρ_s.
    pub gloss: Vec<f32>,
}

/// The linearisation of a channel at a fit: residuals and Jacobian without ridge or anchors.
pub fn linearise(problem: &Problem, fitted: &Fitted, channel: usize) -> Linearisation {
    with_terms(problem, &fitted.model, &problem.weights, channel, ROUGH, |terms| {
        let system = Channel { rows: &problem.rows, design: &fitted.design, channel };
        system.linearisation(terms, &fitted.channels[channel])
    })
}

/// The residuals of a fit on some rows after projection, per channel. The part of the model in
/// `without` is removed first, with its contribution.
pub fn residues(
    problem: &Problem,
    fitted: &Fitted,
    rows: &[usize],
    without: Option<usize>,
) -> Vec<Residue> {
    let without = without.map_or(0..0, |slot| fitted.model.columns_of(slot));
    use rayon::prelude::*;
    (0..CHANNELS)
        .into_par_iter()
        .map(|channel| Residue::new(problem, fitted, rows, without.clone(), channel))
        .collect()
}

impl Residue {
    fn new(
        problem: &Problem,
        fitted: &Fitted,
        rows: &[usize],
        without: std::ops::Range<usize>,
        channel: usize,
    ) -> Self {
        let normal = linearise(problem, fitted, channel);
        let state = &fitted.channels[channel].state;
        let total: f64 = normal.residual.iter().map(|r| r * r).sum();
        let unit = total.max(1e-300).sqrt().recip();
        let lit = normal.lit.len();
        let mut residual: Vec<f64> = rows.iter().map(|&row| normal.residual[row] * unit).collect();
        let mut kept = Vec::new();
        for column in 0..normal.jacobian.ncols() {
            if column < lit && without.contains(&normal.lit[column]) {
                let emission = state.emission[normal.lit[column]];
                for (residual, &row) in residual.iter_mut().zip(rows) {
                    *residual -= emission * normal.jacobian[(row, column)] * unit;
                }
            } else {
                kept.push(column);
            }
        }
        // Gram–Schmidt, twice for each column; what depends on earlier ones is left out.
        let mut basis: Vec<Vec<f64>> = Vec::new();
        let project = |values: &mut [f64], basis: &[Vec<f64>]| {
            vectorised!({
                for _ in 0..2 {
                    for direction in basis {
                        let part = dot(values, direction);
                        add_scaled(values, -part, direction);
                    }
                }
            });
        };
        for column in kept {
            let mut values: Vec<f64> =
                rows.iter().map(|&row| normal.jacobian[(row, column)]).collect();
            let length = dot(&values, &values).sqrt();
            project(&mut values, &basis);
            let left = dot(&values, &values).sqrt();
            if left > 1e-6 * length {
                values.iter_mut().for_each(|value| *value /= left);
                basis.push(values);
            }
        }
        project(&mut residual, &basis);
        let times = |reflectance: &dyn Fn(usize) -> f64| -> Vec<f32> {
            let of = |&row: &usize| {
                (normal.scale[row] * reflectance(problem.rows.material[row]) * unit) as f32
            };
            rows.iter().map(of).collect()
        };
        let scale = times(&|material| state.log_diffuse[material].exp());
        let gloss = times(&|material| state.specular[material]);
        Self {
            basis: Mat::from_fn(rows.len(), basis.len(), |row, column| basis[column][row] as f32),
            residual: residual.into_iter().map(|r| r as f32).collect(),
            scale,
            gloss,
        }
    }
}

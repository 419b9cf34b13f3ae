//! The linearised problem with everything that is modelled projected out: what a new light could
//! still explain.

use faer::Mat;

use crate::reconstruct::joint::system::{Channel, Fit, Terms};
use crate::solve::kernels::{add_scaled, dot, vectorised};

/// One channel's linearised problem on the rows of the search, the light's and the materials'
/// columns projected out.
pub struct Projected {
    /// Orthonormal basis of the columns, rows × columns.
    pub basis: Mat<f32>,
    /// What remains of the residual.
    pub residual: Vec<f32>,
    /// ρ_d by what a change of π L̂ is multiplied to change a weighted residual.
    pub scale: Vec<f32>,
    /// The same with ρ_s.
    pub gloss: Vec<f32>,
}

/// What is needed to linearise one channel.
pub struct Linearised<'a> {
    pub channel: Channel<'a>,
    pub terms: Terms<'a>,
    pub fit: &'a Fit,
}

impl Projected {
    /// Columns in `without` are taken out of the model, with what they explained.
    pub fn new(linearised: &Linearised, rows: &[usize], without: std::ops::Range<usize>) -> Self {
        let normal = linearised.channel.normal(&linearised.terms, linearised.fit);
        let state = &linearised.fit.state;
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
            vectorised(|| {
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
                let material = linearised.channel.rows.material[row];
                (normal.scale[row] * reflectance(material) * unit) as f32
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

//! The joint problem of one channel: all diffuse reflectances, the specular ones, and the
//! emissions of all lobes, from the logarithms (or the ratios) of computed and measured radiance.
//!
//! With g = I_s + Σ k E for the irradiance of Eq. 14 and h for the same light weighed by the
//! specular lobe of Eq. 12, a row computes π L̂ = ρ_d g + ρ_s (n+2)/2 h. The residual is
//! log(L̂/L), or L̂/L − 1. Gauss–Newton, each step a bounded quadratic program over the columns
//! that are lit or ought to be; emissions stay at 0 or above and reflectances at 1 or below.
//!
//! The tempting linear form (πL/ρ − I_s − K E, linear in 1/ρ) is no choice: the measured
//! radiance, which carries the model's error, then multiplies an unknown, and reflectances come
//! out far too large.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, Par};

use crate::reconstruct::joint::terms::{Pulls, curvature, influence, loss};
use crate::solve::bounded::{BoundedError, bounded_quadratic};
use crate::solve::kernels::{self, add_scaled, column_of_mut, dot};
use crate::watch::Watch;

pub use crate::reconstruct::joint::terms::{Anchor, EXACT, Objective, Terms};

/// The rows of all channels: a diffuse sample has one, a specular sample one per photograph.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    pub sample: Vec<usize>,
    pub material: Vec<usize>,
    /// Whether the row's material is fitted with a specular lobe, as its position among such
    /// rows.
    pub glossy: Vec<Option<usize>>,
    /// log πL per channel.
    pub log_radiance: [Vec<f64>; 3],
    pub materials: usize,
}

/// How the light reaches the rows.
#[derive(Clone, Debug)]
pub struct Design {
    /// k_ij, rows × columns.
    pub diffuse: Mat<f64>,
    /// Irradiance per channel that is no unknown: I_s and lights of known emission.
    pub base: [Vec<f64>; 3],
    /// (n+2)/2 cosⁿγ k_ij, glossy rows × columns.
    pub specular: Mat<f64>,
    /// The same part of `base`, per channel and glossy row.
    pub specular_base: [Vec<f64>; 3],
}

impl Design {
    pub fn columns(&self) -> usize {
        self.diffuse.ncols()
    }
}

/// Unknowns of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// E per column.
    pub emission: Vec<f64>,
    /// log ρ_d per material.
    pub log_diffuse: Vec<f64>,
    /// ρ_s per material; 0 for those without glossy rows.
    pub specular: Vec<f64>,
}

#[derive(Clone, Debug)]
pub struct Fit {
    pub state: State,
    /// log(L̂/L) per row, whatever the objective.
    pub residuals: Vec<f64>,
    pub value: f64,
    /// The largest projected slope at `state`, relative to its column's norm and the residuals'.
    pub slope: f64,
    pub iterations: usize,
}

/// Smallest log reflectance, ρ = 0.0005: below it nothing is told from black.
const DARKEST: f64 = -7.6;
const MAX_ITERATIONS: usize = 60;
/// Ends when no projected slope is larger (a cosine between residuals and a column).
const SLOPE_TOLERANCE: f64 = 1e-6;

pub struct Channel<'a> {
    pub rows: &'a Rows,
    pub design: &'a Design,
    pub channel: usize,
}

/// Computed radiance and its parts at a state.
struct Computed {
    /// π L̂ per row.
    value: Vec<f64>,
    /// g per row.
    diffuse: Vec<f64>,
    /// (n+2)/2 h per glossy row.
    specular: Vec<f64>,
}

impl Channel<'_> {
    fn compute(&self, state: &State) -> Computed {
        let design = self.design;
        let mut diffuse = design.base[self.channel].clone();
        let mut specular = design.specular_base[self.channel].clone();
        for (column, &emission) in state.emission.iter().enumerate() {
            if emission != 0.0 {
                add_scaled(
                    &mut diffuse,
                    emission,
                    kernels::column_of(design.diffuse.as_ref(), column),
                );
                if !specular.is_empty() {
                    add_scaled(
                        &mut specular,
                        emission,
                        kernels::column_of(design.specular.as_ref(), column),
                    );
                }
            }
        }
        let reflectance: Vec<f64> = state.log_diffuse.iter().map(|u| u.exp()).collect();
        let value = (0..diffuse.len())
            .map(|row| {
                let material = self.rows.material[row];
                let gloss = self.rows.glossy[row]
                    .map_or(0.0, |glossy| state.specular[material] * specular[glossy]);
                reflectance[material] * diffuse[row] + gloss
            })
            .collect();
        Computed { value, diffuse, specular }
    }

    /// log(L̂/L) per row; where nothing arrives at all, as if a millionth of L did.
    fn residuals(&self, computed: &Computed) -> Vec<f64> {
        let log_radiance = &self.rows.log_radiance[self.channel];
        let log = |(value, log): (&f64, &f64)| (value.max(1e-300).ln() - log).max(NOTHING_LOG);
        computed.value.iter().zip(log_radiance).map(log).collect()
    }

    fn value(&self, terms: &Terms, norms: &[f64], state: &State, residuals: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (row, (&residual, &weight)) in residuals.iter().zip(terms.weights).enumerate() {
            if weight > 0.0 {
                let robust = terms.robust[self.rows.material[row]];
                sum += weight * loss(terms.objective.of(residual).0, robust);
            }
        }
        let pulls = Pulls::new(terms, norms, &state.emission);
        for (j, &emission) in state.emission.iter().enumerate() {
            sum += pulls.ridge[j] * (emission - terms.centre[j] - pulls.common).powi(2);
        }
        for anchor in terms.anchors {
            sum += anchor.weight * anchor.miss(&state.log_diffuse).powi(2);
        }
        0.5 * sum
    }

    /// The norms of the columns, in units in which a residual is 1: those of the design divided
    /// by the irradiance that the reference reflectances ask for.
    pub fn norms(&self, terms: &Terms) -> Vec<f64> {
        let log_radiance = &self.rows.log_radiance[self.channel];
        let scale: Vec<f64> = (0..terms.weights.len())
            .map(|row| {
                let log = terms.reference[self.rows.material[row]] - log_radiance[row];
                let weight = terms.weights[row];
                if weight > 0.0 { weight * (2.0 * log).exp() } else { 0.0 }
            })
            .collect();
        (0..self.design.columns())
            .map(|column| {
                let values = kernels::column_of(self.design.diffuse.as_ref(), column);
                values.iter().zip(&scale).map(|(k, s)| k * k * s).sum::<f64>().sqrt()
            })
            .collect()
    }

    /// Descends from `start` to the minimum.
    pub fn fit(&self, terms: &Terms, start: &State, watch: &Watch) -> Result<Fit, BoundedError> {
        let norms = self.norms(terms);
        let mut state = start.clone();
        for (m, u) in state.log_diffuse.iter_mut().enumerate() {
            *u = terms.known[m].map_or(u.clamp(DARKEST, terms.upper[m]), |k| k.clamp(DARKEST, 0.0));
            state.specular[m] = terms.known_specular[m].unwrap_or(state.specular[m]);
        }
        let mut computed = self.compute(&state);
        let mut residuals = self.residuals(&computed);
        let mut value = self.value(terms, &norms, &state, &residuals);
        let mut iterations = 0;
        let mut settled = false;
        let slope = loop {
            watch.check()?;
            let linear = self.linearise(terms, &computed, &residuals, curvature);
            let gradient = self.emission_gradient(terms, &norms, &state, &linear);
            let working = working(&state, &gradient, &norms);
            let tangent = self.tangent(terms, &norms, &state, &computed, &linear, &working);
            let outside = largest_outside(&state, &gradient, &norms, &linear, &working);
            let slope = tangent.slope.max(outside);
            if slope <= SLOPE_TOLERANCE || settled || iterations == MAX_ITERATIONS {
                break slope;
            }
            iterations += 1;
            let target = self.step(terms, &norms, &state, &tangent, &working, watch)?;
            // The box is convex: every part of the step stays in it.
            let mut part = 1.0;
            let improved = loop {
                let candidate = state.towards(&target, part);
                let new_computed = self.compute(&candidate);
                let new_residuals = self.residuals(&new_computed);
                let new_value = self.value(terms, &norms, &candidate, &new_residuals);
                if new_value < value {
                    break Some((candidate, new_computed, new_residuals, new_value));
                }
                part *= 0.5;
                if part < 1e-4 {
                    break None;
                }
            };
            let Some((next, new_computed, new_residuals, new_value)) = improved else {
                break slope;
            };
            settled = value - new_value <= terms.fall * new_value;
            (state, computed, residuals, value) = (next, new_computed, new_residuals, new_value);
        };
        Ok(Fit { state, residuals, value, slope, iterations })
    }

    /// The least-squares problem with the objective's slopes at these residuals, a residual's
    /// second derivative being what `bend` makes of it and its material's `robust`.
    fn linearise(
        &self,
        terms: &Terms,
        computed: &Computed,
        residuals: &[f64],
        bend: fn(f64, f64) -> f64,
    ) -> Linear {
        let rows = residuals.len();
        let mut linear = Linear { residual: vec![0.0; rows], scale: vec![0.0; rows], norm: 0.0 };
        let mut square = 0.0;
        for (row, &residual) in residuals.iter().enumerate() {
            let weight = terms.weights[row];
            if weight <= 0.0 {
                // Not even an infinity there counts.
                continue;
            }
            let (value, by_log) = terms.objective.of(residual);
            let robust = terms.robust[self.rows.material[row]];
            let slope = weight * influence(value, robust);
            if residual > NOTHING_LOG {
                let root = (weight * bend(value, robust)).sqrt();
                linear.residual[row] = slope * value / root;
                linear.scale[row] = root * by_log / computed.value[row];
                square += slope * value * value;
            } else {
                // Where nothing arrives a logarithm has no slope: the way out is that of L̂/L − 1.
                let root = slope.sqrt();
                linear.residual[row] = -root;
                linear.scale[row] = root * (-self.rows.log_radiance[self.channel][row]).exp();
                square += slope;
            }
        }
        linear.norm = square.sqrt().max(1e-300);
        linear
    }

    /// Descent direction per column of emission.
    fn emission_gradient(
        &self,
        terms: &Terms,
        norms: &[f64],
        state: &State,
        linear: &Linear,
    ) -> Vec<f64> {
        let rows = linear.scale.len();
        let mut diffuse = vec![0.0; rows];
        let mut specular = vec![0.0; self.design.specular.nrows()];
        for (row, diffuse) in diffuse.iter_mut().enumerate() {
            let material = self.rows.material[row];
            let product = linear.scale[row] * linear.residual[row];
            *diffuse = state.log_diffuse[material].exp() * product;
            if let Some(glossy) = self.rows.glossy[row] {
                specular[glossy] = state.specular[material] * product;
            }
        }
        let pulls = Pulls::new(terms, norms, &state.emission);
        (0..self.design.columns())
            .map(|column| {
                let mut sum =
                    dot(kernels::column_of(self.design.diffuse.as_ref(), column), &diffuse);
                if !specular.is_empty() {
                    sum +=
                        dot(kernels::column_of(self.design.specular.as_ref(), column), &specular);
                }
                let pull = state.emission[column] - terms.centre[column] - pulls.common;
                -sum - pulls.ridge[column] * pull
            })
            .collect()
    }

    /// The Jacobian of the weighted residuals: the given columns of emission, then log ρ_d and
    /// ρ_s of every material.
    fn jacobian(
        &self,
        state: &State,
        computed: &Computed,
        scale: &[f64],
        columns: &[usize],
    ) -> Mat<f64> {
        let rows = scale.len();
        let materials = self.rows.materials;
        let mut jacobian = Mat::zeros(rows, columns.len() + 2 * materials);
        let reflectance: Vec<f64> = state.log_diffuse.iter().map(|u| u.exp()).collect();
        // What every column is multiplied by, row by row.
        let by_diffuse: Vec<f64> =
            scale.iter().zip(&self.rows.material).map(|(s, &m)| s * reflectance[m]).collect();
        let by_specular: Vec<(usize, usize, f64)> = (0..rows)
            .filter_map(|row| {
                let factor = scale[row] * state.specular[self.rows.material[row]];
                self.rows.glossy[row].map(|glossy| (row, glossy, factor))
            })
            .collect();
        for (position, &column) in columns.iter().enumerate() {
            let diffuse = kernels::column_of(self.design.diffuse.as_ref(), column);
            let out = column_of_mut(&mut jacobian, position);
            for ((out, factor), k) in out.iter_mut().zip(&by_diffuse).zip(diffuse) {
                *out = factor * k;
            }
            if !by_specular.is_empty() {
                let specular = kernels::column_of(self.design.specular.as_ref(), column);
                for &(row, glossy, factor) in &by_specular {
                    out[row] += factor * specular[glossy];
                }
            }
        }
        for row in 0..rows {
            let material = self.rows.material[row];
            let first = columns.len() + material;
            jacobian[(row, first)] = by_diffuse[row] * computed.diffuse[row];
            if let Some(glossy) = self.rows.glossy[row] {
                jacobian[(row, first + materials)] = scale[row] * computed.specular[glossy];
            }
        }
        jacobian
    }

    /// The linearised problem over the working columns and all reflectances.
    fn tangent(
        &self,
        terms: &Terms,
        norms: &[f64],
        state: &State,
        computed: &Computed,
        linear: &Linear,
        working: &[usize],
    ) -> Tangent {
        let materials = self.rows.materials;
        let jacobian = self.jacobian(state, computed, &linear.scale, working);
        let count = jacobian.ncols();
        let mut x: Vec<f64> = working.iter().map(|&column| state.emission[column]).collect();
        x.extend(&state.log_diffuse);
        x.extend(&state.specular);
        let column = |j: usize| kernels::column_of(jacobian.as_ref(), j);
        let mut gradient: Vec<f64> =
            (0..count).map(|j| -dot(column(j), &linear.residual)).collect();
        let mut curvature: Vec<f64> = (0..count).map(|j| dot(column(j), column(j))).collect();
        let pulls = Pulls::new(terms, norms, &state.emission);
        for (j, &column) in working.iter().enumerate() {
            curvature[j] += pulls.hessian(column, column);
            gradient[j] -= pulls.ridge[column] * (x[j] - terms.centre[column] - pulls.common);
        }
        for anchor in terms.anchors {
            let miss = anchor.miss(&state.log_diffuse);
            for (m, factor) in anchor.combination.iter().enumerate() {
                curvature[working.len() + m] += anchor.weight * factor * factor;
                gradient[working.len() + m] -= anchor.weight * miss * factor;
            }
        }
        let mut lower = vec![0.0; count];
        let mut upper = vec![f64::INFINITY; count];
        for material in 0..materials {
            let i = working.len() + material;
            (lower[i], upper[i]) = match terms.known[material] {
                Some(known) => (known.clamp(DARKEST, 0.0), known.clamp(DARKEST, 0.0)),
                None => (DARKEST, terms.upper[material]),
            };
            upper[i + materials] = 1.0;
            if let Some(known) = terms.known_specular[material] {
                (lower[i + materials], upper[i + materials]) = (known, known);
            }
        }
        let mut slope = 0.0f64;
        for j in 0..count {
            let norm = curvature[j].sqrt();
            let outward =
                (x[j] <= lower[j] && gradient[j] < 0.0) || (x[j] >= upper[j] && gradient[j] > 0.0);
            if norm > 0.0 && !outward {
                slope = slope.max(gradient[j].abs() / (norm * linear.norm));
            }
        }
        Tangent { jacobian, x, lower, upper, gradient, slope }
    }

    /// Where the linearised problem has its minimum.
    fn step(
        &self,
        terms: &Terms,
        norms: &[f64],
        state: &State,
        tangent: &Tangent,
        working: &[usize],
        watch: &Watch,
    ) -> Result<State, BoundedError> {
        let materials = self.rows.materials;
        let Tangent { jacobian, x, lower, upper, gradient, .. } = tangent;
        let mut hessian = gram(jacobian);
        let pulls = Pulls::new(terms, norms, &state.emission);
        for (j, &column) in working.iter().enumerate() {
            if terms.floating {
                for (i, &other) in working.iter().enumerate() {
                    hessian[(i, j)] += pulls.hessian(other, column);
                }
            } else {
                hessian[(j, j)] += pulls.ridge[column];
            }
        }
        for anchor in terms.anchors {
            for a in 0..materials {
                for b in 0..materials {
                    hessian[(working.len() + a, working.len() + b)] +=
                        anchor.weight * anchor.combination[a] * anchor.combination[b];
                }
            }
        }
        let mut linear_term = gradient.clone();
        for (j, &x) in x.iter().enumerate() {
            if x != 0.0 {
                add_scaled(&mut linear_term, x, kernels::column_of(hessian.as_ref(), j));
            }
        }
        let solved = bounded_quadratic(hessian.as_ref(), &linear_term, lower, upper, x, watch)?;
        let mut target = state.clone();
        for (&column, &value) in working.iter().zip(&solved) {
            target.emission[column] = value;
        }
        let first = working.len();
        target.log_diffuse.copy_from_slice(&solved[first..first + materials]);
        target.specular.copy_from_slice(&solved[first + materials..]);
        Ok(target)
    }

    /// The Jacobian without ridge or anchors at a fit, over its lit columns, then log ρ_d and ρ_s
    /// of every material.
    pub fn normal(&self, terms: &Terms, fit: &Fit) -> Normal {
        let computed = self.compute(&fit.state);
        let linear = self.linearise(terms, &computed, &fit.residuals, influence);
        let lit: Vec<usize> =
            (0..self.design.columns()).filter(|&j| fit.state.emission[j] > 0.0).collect();
        let jacobian = self.jacobian(&fit.state, &computed, &linear.scale, &lit);
        Normal { jacobian, lit, residual: linear.residual, scale: linear.scale }
    }
}

/// The linearised problem at a fit.
pub struct Normal {
    pub jacobian: Mat<f64>,
    /// The columns of emission that are above 0.
    pub lit: Vec<usize>,
    /// √w r per row.
    pub residual: Vec<f64>,
    /// By what a change of π L̂ is multiplied to change `residual`.
    pub scale: Vec<f64>,
}

struct Linear {
    /// Per row: times `scale` the objective's slope by π L̂.
    residual: Vec<f64>,
    /// Per row the root of the second derivative by π L̂.
    scale: Vec<f64>,
    /// √Σ w r², r being what the robust loss leaves of each residual.
    norm: f64,
}

/// The linearised problem over the working columns, then log ρ_d and ρ_s of every material.
struct Tangent {
    /// Of the weighted residuals.
    jacobian: Mat<f64>,
    /// The unknowns, and the box they stay in.
    x: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Descent direction, ridge and anchors with it.
    gradient: Vec<f64>,
    /// The largest projected slope.
    slope: f64,
}

impl State {
    fn towards(&self, target: &Self, part: f64) -> Self {
        let mix = |from: &[f64], to: &[f64]| -> Vec<f64> {
            from.iter()
                .zip(to)
                .map(|(a, b)| if part == 1.0 { *b } else { a + part * (b - a) })
                .collect()
        };
        Self {
            emission: mix(&self.emission, &target.emission),
            log_diffuse: mix(&self.log_diffuse, &target.log_diffuse),
            specular: mix(&self.specular, &target.specular),
        }
    }
}

/// log(L̂/L) where nothing arrives.
const NOTHING_LOG: f64 = -13.8;

/// The columns of emission to solve for: those lit, and of those that ought to be, the most
/// pressing.
fn working(state: &State, gradient: &[f64], norms: &[f64]) -> Vec<usize> {
    let mut lit: Vec<usize> = (0..norms.len()).filter(|&j| state.emission[j] > 0.0).collect();
    let mut dark: Vec<(f64, usize)> = (0..norms.len())
        .filter(|&j| state.emission[j] <= 0.0 && gradient[j] > 0.0 && norms[j] > 0.0)
        .map(|j| (gradient[j] / norms[j], j))
        .collect();
    dark.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let most = 40 + lit.len() / 2;
    lit.extend(dark.into_iter().take(most).map(|(_, j)| j));
    lit.sort_unstable();
    lit
}

/// The largest projected slope among the columns that are not worked on.
fn largest_outside(
    state: &State,
    gradient: &[f64],
    norms: &[f64],
    linear: &Linear,
    working: &[usize],
) -> f64 {
    let mut largest = 0.0f64;
    for j in 0..norms.len() {
        if state.emission[j] <= 0.0 && norms[j] > 0.0 && working.binary_search(&j).is_err() {
            largest = largest.max(gradient[j] / (norms[j] * linear.norm));
        }
    }
    largest
}

/// MᵀM.
/// MᵀM.
pub fn gram(matrix: &Mat<f64>) -> Mat<f64> {
    let count = matrix.ncols();
    let mut gram = Mat::zeros(count, count);
    // On one thread: channels and light sets are what runs side by side, and sums keep their
    // order.
    matmul(
        gram.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        matrix.transpose(),
        BlockStructure::Rectangular,
        matrix.as_ref(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    for column in 0..count {
        for row in 0..column {
            gram[(row, column)] = gram[(column, row)];
        }
    }
    gram
}

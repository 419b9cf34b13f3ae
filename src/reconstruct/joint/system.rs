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

use std::sync::Arc;

use faer::{Mat, MatMut};

use crate::reconstruct::joint::hessian::{ByReflectances, Hessian, RowScales};
use crate::reconstruct::joint::terms::{Ridge, curvature, influence, loss};
use crate::solve::bounded::{BoundedError, bounded_quadratic};
use crate::solve::kernels::{
    self, TOGETHER, add_all_scaled, add_scaled, dot, dots_single, groups, slice_of, vectorised,
    weighted_square,
};
use crate::watch::Watch;

pub use crate::reconstruct::joint::design::Design;
pub use crate::reconstruct::joint::rows::Rows;
use crate::reconstruct::joint::rows::{Run, Stretch, stretches};
pub use crate::reconstruct::joint::terms::{Anchor, Objective, Pair, Terms};

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

/// A channel at its minimum.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The unknowns.
    pub state: State,
    /// log(L̂/L) per row, whatever the objective.
    pub residuals: Vec<f64>,
    /// The cost: half the sum of the rows' weighted losses, ridge and anchors.
    pub value: f64,
    /// Direction of descent of the cost by every unknown: the emissions, log ρ_d and ρ_s of every
    /// material. For an unknown that is held fixed it tells how the cost at the minimum over the others
    /// changes with it.
    pub gradient: Vec<f64>,
    /// KKT residual: the largest projected gradient at `state`, relative to its column's norm and the
    /// residuals' (a cosine).
    pub kkt_residual: f64,
    /// Gauss–Newton steps that were taken.
    pub iterations: usize,
    /// The second derivatives there, nearly.
    pub(super) hessian: Arc<Hessian>,
}

/// Smallest log reflectance, ρ = 0.0005: below it nothing is told from black.
const DARKEST: f64 = -7.6;
const MAX_ITERATIONS: usize = 60;
/// Ends when no projected gradient is larger (a cosine between residuals and a column).
const KKT_TOLERANCE: f64 = 1e-6;

/// One channel's problem.
pub struct Channel<'a> {
    /// What was measured.
    pub rows: &'a Rows,
    /// How the light reaches the rows.
    pub design: &'a Design,
    /// 0, 1 or 2 for red, green and blue.
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
        let lit = || state.emission.iter().enumerate().filter(|(_, emission)| **emission != 0.0);
        let add_to = |sums: &mut [f64], design: &Mat<f32>| {
            let of_column = |(column, &emission): (usize, &f64)| {
                (emission, kernels::column_of(design.as_ref(), column))
            };
            let terms: Vec<(f64, &[f32])> = lit().map(of_column).collect();
            vectorised!(add_all_scaled(sums, &terms));
        };
        add_to(&mut diffuse, &design.diffuse);
        if !specular.is_empty() {
            add_to(&mut specular, &design.specular);
        }
        let mut value = diffuse.clone();
        for run in self.rows.runs() {
            let value = &mut value[run.rows];
            let reflectance = state.log_diffuse[run.material].exp();
            value.iter_mut().for_each(|value| *value *= reflectance);
            if let Some(glossy) = run.glossy {
                add_scaled(value, state.specular[run.material], &specular[glossy]);
            }
        }
        Computed { value, diffuse, specular }
    }

    /// log(L̂/L) per row; where nothing arrives at all, as if a millionth of L did.
    fn residuals(&self, computed: &Computed) -> Vec<f64> {
        let log_radiance = &self.rows.log_radiance[self.channel];
        let log = |(value, log): (&f64, &f64)| (value.max(1e-300).ln() - log).max(NOTHING_LOG);
        computed.value.iter().zip(log_radiance).map(log).collect()
    }

    fn value(&self, terms: &Terms, ridge: &Ridge, state: &State, residuals: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (row, (&residual, &weight)) in residuals.iter().zip(terms.weights).enumerate() {
            if weight > 0.0 {
                let robust = terms.robust[self.rows.material[row]];
                sum += weight * loss(terms.objective.of(residual).0, robust);
            }
        }
        sum += ridge.value(&state.emission);
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
        let norm = |column: usize| {
            let values = self.design.diffuse_of(column);
            vectorised!(weighted_square(values, &scale)).sqrt()
        };
        (0..self.design.columns()).map(norm).collect()
    }

    /// Descends from `start` to the minimum.
    pub fn fit(&self, terms: &Terms, start: &State, watch: &Watch) -> Result<Fit, BoundedError> {
        self.fit_with(terms, start, None, watch)
    }

    /// The same with second derivatives that were computed near `start`; they have no effect on where the
    /// minimum is.
    pub fn fit_with(
        &self,
        terms: &Terms,
        start: &State,
        mut earlier: Option<Hessian>,
        watch: &Watch,
    ) -> Result<Fit, BoundedError> {
        let norms = self.norms(terms);
        let ridge = Ridge::new(terms, &norms);
        let norms = ridge.column_scales(&norms);
        let mut state = start.clone();
        for (emission, held) in state.emission.iter_mut().zip(terms.held) {
            *emission = held.unwrap_or(*emission);
        }
        for (m, u) in state.log_diffuse.iter_mut().enumerate() {
            *u = terms.known[m].map_or(u.clamp(DARKEST, terms.upper[m]), |k| k.clamp(DARKEST, 0.0));
            state.specular[m] = terms.known_specular[m].unwrap_or(state.specular[m]);
        }
        let mut computed = self.compute(&state);
        let mut residuals = self.residuals(&computed);
        let mut value = self.value(terms, &ridge, &state, &residuals);
        let columns = norms.len();
        let reflectances = self.unknown_reflectances(terms);
        let mut iterations = 0;
        let mut settled = false;
        let (gradient, kkt_residual, hessian) = loop {
            watch.check()?;
            let linear = self.linearise(terms, &computed, &residuals, curvature);
            let gradient = self.gradient(terms, &ridge, &state, &computed, &linear);
            let mut lit = working(&state, &gradient, &norms, terms.held);
            let row_scales = self.row_scales(&state, linear.scale.clone());
            let is_last = settled || iterations == MAX_ITERATIONS;
            let (mut hessian, is_exact) = match earlier.take() {
                // Nothing is solved with it any more.
                Some(hessian) if is_last => (hessian, false),
                Some(mut hessian) => {
                    let is_exact = hessian.refresh(self, row_scales);
                    (hessian, is_exact)
                }
                None => (Hessian::new(row_scales, columns), true),
            };
            let jacobian = self.by_reflectances(&hessian.row_scales, &computed);
            let products = if is_last {
                lit.retain(|&column| hessian.has(column));
                hessian.diagonal_over(self, &lit, &reflectances, &jacobian)
            } else {
                hessian.extend(self, &lit);
                hessian.over(self, &lit, &reflectances, &jacobian)
            };
            let outside = largest_outside(terms, &state, &gradient, &norms, &linear, &lit);
            let working: Vec<usize> =
                lit.into_iter().chain(reflectances.iter().map(|index| columns + index)).collect();
            let quadratic = self.quadratic(terms, &ridge, &state, &working, &gradient, products);
            let kkt_residual = quadratic.kkt_residual(&linear).max(outside);
            if kkt_residual <= KKT_TOLERANCE || is_last {
                break (gradient, kkt_residual, hessian);
            }
            iterations += 1;
            let target = self.step(&state, &quadratic, &working, watch)?;
            // The box is convex: every part of the step stays in it.
            let mut part = 1.0;
            let improved = loop {
                let candidate = state.towards(&target, part);
                let new_computed = self.compute(&candidate);
                let new_residuals = self.residuals(&new_computed);
                let new_value = self.value(terms, &ridge, &candidate, &new_residuals);
                if new_value < value {
                    break Some((candidate, new_computed, new_residuals, new_value));
                }
                part *= 0.5;
                if part < 1e-4 {
                    break None;
                }
            };
            let Some((next, new_computed, new_residuals, new_value)) = improved else {
                if is_exact {
                    break (gradient, kkt_residual, hessian);
                }
                // Once more with second derivatives of this state.
                continue;
            };
            settled = value - new_value <= terms.fall * new_value;
            (state, computed, residuals, value) = (next, new_computed, new_residuals, new_value);
            earlier = Some(hessian);
        };
        let hessian = Arc::new(hessian);
        Ok(Fit { state, residuals, value, gradient, kkt_residual, iterations, hessian })
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

    /// Descent direction by every unknown: the emissions, log ρ_d and ρ_s of every material.
    fn gradient(
        &self,
        terms: &Terms,
        ridge: &Ridge,
        state: &State,
        computed: &Computed,
        linear: &Linear,
    ) -> Vec<f64> {
        let materials = self.rows.materials;
        let product: Vec<f64> =
            linear.scale.iter().zip(&linear.residual).map(|(scale, r)| scale * r).collect();
        let mut by_diffuse = product.clone();
        let mut by_specular = vec![0.0; self.design.specular.nrows()];
        let mut of_reflectances = vec![0.0; 2 * materials];
        for run in self.rows.runs() {
            let Run { material, rows, glossy } = run;
            let reflectance = state.log_diffuse[material].exp();
            by_diffuse[rows.clone()].iter_mut().for_each(|value| *value *= reflectance);
            of_reflectances[material] -=
                dot(&by_diffuse[rows.clone()], &computed.diffuse[rows.clone()]);
            if let Some(glossy) = glossy {
                let product = &product[rows];
                add_scaled(&mut by_specular[glossy.clone()], state.specular[material], product);
                of_reflectances[materials + material] -= dot(product, &computed.specular[glossy]);
            }
        }
        for anchor in terms.anchors {
            let miss = anchor.miss(&state.log_diffuse);
            for (gradient, factor) in of_reflectances.iter_mut().zip(&anchor.combination) {
                *gradient -= anchor.weight * miss * factor;
            }
        }
        let of_ridge = ridge.gradient(&state.emission);
        let columns: Vec<usize> = (0..self.design.columns()).collect();
        let of_group = |columns: [usize; TOGETHER]| {
            let diffuse = columns.map(|column| self.design.diffuse_of(column));
            let specular = columns.map(|column| self.design.specular_of(column));
            let sums = vectorised!(dots_single(diffuse, [&by_diffuse]));
            let of_lobes = vectorised!(dots_single(specular, [&by_specular]));
            std::array::from_fn::<f64, TOGETHER, _>(|k| -sums[k][0] - of_lobes[k][0])
        };
        let of_light = groups(&columns).flat_map(of_group).zip(of_ridge);
        of_light.map(|(sum, ridge)| sum - ridge).chain(of_reflectances).collect()
    }

    /// What the columns of the Jacobian of the weighted residuals are made with.
    fn row_scales(&self, state: &State, scale: Vec<f64>) -> RowScales {
        let mut diffuse = scale.clone();
        let mut specular = vec![0.0; self.design.specular.nrows()];
        for Run { material, rows, glossy } in self.rows.runs() {
            let reflectance = state.log_diffuse[material].exp();
            diffuse[rows.clone()].iter_mut().for_each(|value| *value *= reflectance);
            if let Some(glossy) = glossy {
                add_scaled(&mut specular[glossy], state.specular[material], &scale[rows]);
            }
        }
        RowScales { scale, diffuse, specular }
    }

    /// Some rows of the Jacobian's columns of some emissions, written into `out`.
    pub(super) fn panel(
        &self,
        row_scales: &RowScales,
        rows: &[usize],
        columns: &[usize],
        mut out: MatMut<'_, f64>,
    ) {
        let glossy = rows.iter().enumerate();
        let glossy = glossy.filter_map(|(place, &row)| Some((place, self.rows.glossy[row]?)));
        let (diffuse, specular) = (stretches(rows.iter().copied().enumerate()), stretches(glossy));
        for (position, &column) in columns.iter().enumerate() {
            let out = slice_of(out.as_mut(), position);
            let (of_rows, of_lobes) =
                (self.design.diffuse_of(column), self.design.specular_of(column));
            vectorised!({
                for Stretch { places, from } in &diffuse {
                    let factors = &row_scales.diffuse[from.clone()];
                    let values = factors.iter().zip(&of_rows[from.clone()]);
                    for (out, (factor, &k)) in out[places.clone()].iter_mut().zip(values) {
                        *out = factor * f64::from(k);
                    }
                }
                for Stretch { places, from } in &specular {
                    let factors = &row_scales.specular[from.clone()];
                    let values = factors.iter().zip(&of_lobes[from.clone()]);
                    for (out, (factor, &k)) in out[places.clone()].iter_mut().zip(values) {
                        *out += factor * f64::from(k);
                    }
                }
            });
        }
    }

    /// The Jacobian's columns of the reflectances.
    fn by_reflectances(&self, row_scales: &RowScales, computed: &Computed) -> ByReflectances {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect();
        let glossy = (0..self.rows.glossy.len()).filter(|&row| self.rows.glossy[row].is_some());
        let scale: Vec<f64> = glossy.map(|row| row_scales.scale[row]).collect();
        ByReflectances {
            diffuse: product(&row_scales.diffuse, &computed.diffuse),
            specular: product(&scale, &computed.specular),
        }
    }

    /// Those of log ρ_d and ρ_s of every material that are not held fixed.
    fn unknown_reflectances(&self, terms: &Terms) -> Vec<usize> {
        let materials = self.rows.materials;
        let mut has_gloss = vec![false; materials];
        for (&material, glossy) in self.rows.material.iter().zip(&self.rows.glossy) {
            has_gloss[material] |= glossy.is_some();
        }
        let diffuse = (0..materials).filter(|&m| terms.known[m].is_none());
        let specular =
            (0..materials).filter(|&m| has_gloss[m] && terms.known_specular[m].is_none());
        diffuse.chain(specular.map(|m| materials + m)).collect()
    }

    /// The linearised problem over the unknowns that are worked on: `gradient` is that of all,
    /// `products` JᵀJ over these.
    fn quadratic(
        &self,
        terms: &Terms,
        ridge: &Ridge,
        state: &State,
        working: &[usize],
        gradient: &[f64],
        products: Mat<f64>,
    ) -> QuadraticModel {
        let (columns, materials) = (state.emission.len(), self.rows.materials);
        let mut hessian = products;
        let lit = working.partition_point(|&unknown| unknown < columns);
        ridge.add_to(&mut hessian, &state.emission, &working[..lit]);
        for anchor in terms.anchors {
            // Of log ρ_d alone, which come first.
            let factor =
                |i: usize| anchor.combination.get(working[i] - columns).copied().unwrap_or(0.0);
            for a in lit..working.len() {
                for b in lit..working.len() {
                    hessian[(a, b)] += anchor.weight * factor(a) * factor(b);
                }
            }
        }
        let bounds = |&unknown: &usize| match unknown.checked_sub(columns) {
            None => (0.0, f64::INFINITY),
            Some(material) if material < materials => (DARKEST, terms.upper[material]),
            Some(_) => (0.0, 1.0),
        };
        let (lower, upper) = working.iter().map(bounds).unzip();
        QuadraticModel {
            hessian,
            x: working.iter().map(|&unknown| state.value(unknown)).collect(),
            lower,
            upper,
            gradient: working.iter().map(|&unknown| gradient[unknown]).collect(),
        }
    }

    /// Where the linearised problem has its minimum.
    fn step(
        &self,
        state: &State,
        quadratic: &QuadraticModel,
        working: &[usize],
        watch: &Watch,
    ) -> Result<State, BoundedError> {
        let QuadraticModel { hessian, x, lower, upper, gradient } = quadratic;
        let mut linear_term = gradient.clone();
        for (j, &x) in x.iter().enumerate() {
            if x != 0.0 {
                add_scaled(&mut linear_term, x, kernels::column_of(hessian.as_ref(), j));
            }
        }
        let solved = bounded_quadratic(hessian.as_ref(), &linear_term, lower, upper, x, watch)?;
        let mut target = state.clone();
        for (&unknown, &value) in working.iter().zip(&solved) {
            *target.value_mut(unknown) = value;
        }
        Ok(target)
    }

    /// The Jacobian without ridge or anchors at a fit, over its lit columns, then log ρ_d and ρ_s
    /// of every material.
    pub fn linearisation(&self, terms: &Terms, fit: &Fit) -> Linearisation {
        let computed = self.compute(&fit.state);
        let linear = self.linearise(terms, &computed, &fit.residuals, influence);
        let lit: Vec<usize> = (0..self.design.columns())
            .filter(|&j| fit.state.emission[j] > 0.0 && !is_held(terms.held, j))
            .collect();
        let row_scales = self.row_scales(&fit.state, linear.scale.clone());
        let by = self.by_reflectances(&row_scales, &computed);
        let (rows, materials) = (self.rows.material.len(), self.rows.materials);
        let mut jacobian = Mat::zeros(rows, lit.len() + 2 * materials);
        let all: Vec<usize> = (0..rows).collect();
        self.panel(&row_scales, &all, &lit, jacobian.subcols_mut(0, lit.len()));
        for row in all {
            let column = lit.len() + self.rows.material[row];
            jacobian[(row, column)] = by.diffuse[row];
            if let Some(glossy) = self.rows.glossy[row] {
                jacobian[(row, materials + column)] = by.specular[glossy];
            }
        }
        Linearisation { jacobian, lit, residual: linear.residual, scale: linear.scale }
    }
}

/// The linearised problem at a fit.
pub struct Linearisation {
    /// Rows × unknowns.
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

/// The linearised problem over the unknowns that are worked on.
struct QuadraticModel {
    /// Ridge and anchors with it.
    hessian: Mat<f64>,
    /// The unknowns, and the box they stay in.
    x: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Descent direction, ridge and anchors with it.
    gradient: Vec<f64>,
}

impl QuadraticModel {
    /// The KKT residual: the largest projected gradient, relative to its column's norm and the residuals'.
    fn kkt_residual(&self, linear: &Linear) -> f64 {
        let mut slope = 0.0f64;
        for (j, (&x, &gradient)) in self.x.iter().zip(&self.gradient).enumerate() {
            let norm = self.hessian[(j, j)].sqrt();
            let outward =
                (x <= self.lower[j] && gradient < 0.0) || (x >= self.upper[j] && gradient > 0.0);
            if norm > 0.0 && !outward {
                slope = slope.max(gradient.abs() / (norm * linear.norm));
            }
        }
        slope
    }
}

impl State {
    /// An unknown by its number: the emissions, log ρ_d and ρ_s of every material.
    fn value(&self, unknown: usize) -> f64 {
        let (columns, materials) = (self.emission.len(), self.log_diffuse.len());
        match unknown.checked_sub(columns) {
            None => self.emission[unknown],
            Some(material) if material < materials => self.log_diffuse[material],
            Some(index) => self.specular[index - materials],
        }
    }

    fn value_mut(&mut self, unknown: usize) -> &mut f64 {
        let (columns, materials) = (self.emission.len(), self.log_diffuse.len());
        match unknown.checked_sub(columns) {
            None => &mut self.emission[unknown],
            Some(material) if material < materials => &mut self.log_diffuse[material],
            Some(index) => &mut self.specular[index - materials],
        }
    }

    /// Adds the difference of two states, as far as light and ρ_s stay at 0 or above.
    pub fn shift(&mut self, from: &Self, to: &Self) {
        let add = |own: &mut [f64], from: &[f64], to: &[f64], least: f64| {
            for ((own, from), to) in own.iter_mut().zip(from).zip(to) {
                *own = (*own + to - from).max(least);
            }
        };
        add(&mut self.emission, &from.emission, &to.emission, 0.0);
        add(&mut self.log_diffuse, &from.log_diffuse, &to.log_diffuse, DARKEST);
        add(&mut self.specular, &from.specular, &to.specular, 0.0);
    }

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
fn working(state: &State, gradient: &[f64], norms: &[f64], held: &[Option<f64>]) -> Vec<usize> {
    let free = || (0..norms.len()).filter(|&j| !is_held(held, j));
    let mut lit: Vec<usize> = free().filter(|&j| state.emission[j] > 0.0).collect();
    let mut dark: Vec<(f64, usize)> = free()
        .filter(|&j| state.emission[j] <= 0.0 && gradient[j] > 0.0 && norms[j] > 0.0)
        .map(|j| (gradient[j] / norms[j], j))
        .collect();
    dark.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let most = 60 + lit.len();
    lit.extend(dark.into_iter().take(most).map(|(_, j)| j));
    lit.sort_unstable();
    lit
}

fn is_held(held: &[Option<f64>], column: usize) -> bool {
    held.get(column).is_some_and(Option::is_some)
}

/// The largest projected gradient among the columns that are not worked on.
fn largest_outside(
    terms: &Terms,
    state: &State,
    gradient: &[f64],
    norms: &[f64],
    linear: &Linear,
    working: &[usize],
) -> f64 {
    let mut largest = 0.0f64;
    for j in 0..norms.len() {
        let is_dark = state.emission[j] <= 0.0 && !is_held(terms.held, j);
        if is_dark && norms[j] > 0.0 && working.binary_search(&j).is_err() {
            largest = largest.max(gradient[j] / (norms[j] * linear.norm));
        }
    }
    largest
}

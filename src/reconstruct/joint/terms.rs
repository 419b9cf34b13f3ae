//! The terms of the objective of a joint solve: the loss of a residual, the ridge on the emissions,
//! and priors on combinations of reflectances.

use faer::Mat;

use crate::solve::kernels::{column_of_mut, dot};

/// Which residuals are minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Objective {
    /// Squared logarithms of computed over measured radiance.
    #[default]
    Log,
    /// Squared relative differences, which texture biases: for tests and benches that show it.
    Relative,
}

/// A known combination of log reflectances: adds ½ weight (Σ a_m u_m − target)².
#[derive(Clone, Debug)]
pub struct Anchor {
    /// a_m per material.
    pub combination: Vec<f64>,
    /// The prior mean of the combination.
    pub target: f64,
    /// In units in which a squared residual of a row of weight 1 counts 1.
    pub weight: f64,
}

/// A smoothness term between two emissions: adds ½ weight N² (E_a − centre_a − E_b + centre_b)², N
/// being the sum of the norms of all columns that are in pairs. That sum is the same however finely
/// a sky is divided, and so is the sum of the squared differences between neighbouring cells: as
/// many more of them as they become smaller (the membrane energy ∫ |∇E|² in two dimensions).
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// a and b.
    pub columns: [usize; 2],
    /// λ.
    pub weight: f64,
}

/// All terms of the objective for one channel.
#[derive(Clone, Copy, Debug)]
pub struct Terms<'a> {
    /// Which residuals are squared.
    pub objective: Objective,
    /// Per row, at least 0; a row with 0 is held out.
    pub weights: &'a [f64],
    /// Per column λ_j of ½ λ_j n_j² (E_j − centre_j)², n_j being the column's norm in units in
    /// which a residual is 1 (see
    /// [`norms`](crate::reconstruct::joint::system::Channel::norms)).
    pub ridge: &'a [f64],
    /// Per column the one whose norm is n_j; its own where this is empty. With a unit of its own, a lobe
    /// that hardly any row sees could take any value.
    pub ridge_units: &'a [usize],
    /// Smoothness terms between emissions. They share one unit: with units of their own, a column
    /// that hardly reaches any row could take any value.
    pub pairs: &'a [Pair],
    /// Log reflectances that set those units. They belong to the objective, so that where a solve
    /// starts has no effect on where it ends.
    pub reference: &'a [f64],
    /// Prior mean of each emission under the ridge; 0 where nothing is known.
    pub centre: &'a [f64],
    /// Whether ridge and pairs are divided by the square of the level of all light, where no centre is
    /// known: they then have no effect on that level, only on how the light is distributed.
    pub relative_ridge: bool,
    /// Per column an emission that is known.
    pub held: &'a [Option<f64>],
    /// Per material a log reflectance that is known exactly.
    pub known: &'a [Option<f64>],
    /// Per material a specular reflectance that is held fixed.
    pub known_specular: &'a [Option<f64>],
    /// Per material the largest log reflectance, 0 or less.
    pub upper: &'a [f64],
    /// Combinations of reflectances that are known.
    pub anchors: &'a [Anchor],
    /// Per material: residuals much larger than this count less (Cauchy's loss); ∞ is least
    /// squares.
    pub robust: &'a [f64],
    /// A solve also ends where a step lowers the objective by less than this part of itself.
    pub fall: f64,
}

impl Default for Terms<'_> {
    /// Squared logarithms without rows, columns or materials.
    fn default() -> Self {
        Self {
            objective: Objective::Log,
            weights: &[],
            ridge: &[],
            ridge_units: &[],
            pairs: &[],
            reference: &[],
            centre: &[],
            relative_ridge: false,
            held: &[],
            known: &[],
            known_specular: &[],
            upper: &[],
            anchors: &[],
            robust: &[],
            fall: 0.0,
        }
    }
}

impl Objective {
    /// The residual and its derivative by log L̂, of log(L̂/L).
    pub(super) fn of(self, log: f64) -> (f64, f64) {
        match self {
            Self::Log => (log, 1.0),
            Self::Relative => (log.exp() - 1.0, log.exp()),
        }
    }
}

impl Anchor {
    pub(super) fn miss(&self, log_diffuse: &[f64]) -> f64 {
        dot(&self.combination, log_diffuse) - self.target
    }
}

/// The quadratic terms on the emissions, ridge and smoothness: R = Σ_j λ_j n_j² (E_j − centre_j)²
/// plus the pairs. A relative ridge is R s² / (M² + ε s²), with the level M = Σ_j n_j E_j of the
/// light and s² the sum of the rows' weights. With R alone, dimmer light costs less, so that all
/// reflectances come out too high.
pub(super) struct Ridge<'a> {
    terms: &'a Terms<'a>,
    /// N².
    unit: f64,
    /// λ_j n_j² per column.
    ridge: Vec<f64>,
    /// n_j per column where the ridge is relative.
    norms: Option<Vec<f64>>,
    /// s².
    weights: f64,
}

/// ε keeps the relative ridge finite where all emissions are 0.
const NO_LIGHT: f64 = 1e-4;

impl<'a> Ridge<'a> {
    /// `norms` are those of the columns.
    pub fn new(terms: &'a Terms, norms: &[f64]) -> Self {
        let squares: Vec<f64> = norms.iter().map(|norm| norm * norm).collect();
        let mut is_paired = vec![false; norms.len()];
        for column in terms.pairs.iter().flat_map(|pair| pair.columns) {
            is_paired[column] = true;
        }
        let whole: f64 =
            norms.iter().zip(is_paired).filter(|(_, paired)| *paired).map(|(norm, _)| norm).sum();
        let unit = whole * whole;
        let unit_of = |column: usize| squares[*terms.ridge_units.get(column).unwrap_or(&column)];
        let mut ridge: Vec<f64> =
            terms.ridge.iter().enumerate().map(|(column, l)| l * unit_of(column)).collect();
        ridge.resize(norms.len(), 0.0);
        let is_relative = terms.relative_ridge && terms.centre.iter().all(|&centre| centre == 0.0);
        let weights = terms.weights.iter().sum();
        Self { terms, unit, ridge, norms: is_relative.then(|| norms.to_vec()), weights }
    }

    /// Twice its cost.
    pub fn value(&self, emission: &[f64]) -> f64 {
        self.absolute(emission) * self.scale(emission).0
    }

    /// Its derivative by each emission.
    pub fn gradient(&self, emission: &[f64]) -> Vec<f64> {
        let (scale, falls_by) = self.scale(emission);
        let mut gradient = self.slope(emission);
        gradient.iter_mut().for_each(|slope| *slope *= scale);
        if let Some(norms) = &self.norms {
            let of_level = scale * self.absolute(emission) * falls_by;
            for (slope, norm) in gradient.iter_mut().zip(norms) {
                *slope -= of_level * norm;
            }
        }
        gradient
    }

    /// Adds its second derivatives by some columns, in ascending order, that come first in a
    /// Hessian; those of the Gauss-Newton method where it is relative.
    pub fn add_to(&self, hessian: &mut Mat<f64>, emission: &[f64], columns: &[usize]) {
        let (scale, falls_by) = self.scale(emission);
        for (place, &column) in columns.iter().enumerate() {
            hessian[(place, place)] += scale * self.ridge[column];
        }
        for pair in self.terms.pairs {
            let weight = scale * self.unit * pair.weight;
            let places = pair.columns.map(|column| columns.binary_search(&column));
            for place in places.into_iter().flatten() {
                hessian[(place, place)] += weight;
            }
            if let [Ok(a), Ok(b)] = places {
                hessian[(a, b)] -= weight;
                hessian[(b, a)] -= weight;
            }
        }
        if let Some(norms) = &self.norms {
            let slope = self.slope(emission);
            let of_level = falls_by * self.absolute(emission);
            let of = |&column: &usize| (slope[column], norms[column]);
            let of: Vec<(f64, f64)> = columns.iter().map(of).collect();
            for (j, &(slope_b, norm_b)) in of.iter().enumerate() {
                let column = column_of_mut(hessian, j);
                for (value, (slope_a, norm_a)) in column.iter_mut().zip(&of) {
                    let mixed = slope_a * norm_b + norm_a * slope_b;
                    let own = of_level * norm_a * norm_b;
                    *value += scale * falls_by * (own - mixed);
                }
            }
        }
    }

    /// The scale of each column: its norm together with ridge and pairs. A column that reaches no
    /// row has only the latter two.
    pub fn column_scales(&self, norms: &[f64]) -> Vec<f64> {
        let mut squares: Vec<f64> =
            norms.iter().zip(&self.ridge).map(|(norm, ridge)| (norm * norm).max(*ridge)).collect();
        for pair in self.terms.pairs {
            for column in pair.columns {
                squares[column] += self.unit * pair.weight;
            }
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// What R is multiplied by, s² / (M² + ε s²), and half of what the logarithm of that falls by per
    /// M, M / (M² + ε s²); 1 and 0 where the ridge is not relative.
    fn scale(&self, emission: &[f64]) -> (f64, f64) {
        let Some(norms) = &self.norms else { return (1.0, 0.0) };
        let level = dot(norms, emission);
        let square = level * level + NO_LIGHT * self.weights;
        if square > 0.0 { (self.weights / square, level / square) } else { (1.0, 0.0) }
    }

    /// R, not relative to anything.
    fn absolute(&self, emission: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (column, ridge) in self.ridge.iter().enumerate().filter(|(_, ridge)| **ridge > 0.0) {
            sum += ridge * self.off(emission, column).powi(2);
        }
        for pair in self.terms.pairs {
            sum += self.unit * pair.weight * self.difference(emission, pair).powi(2);
        }
        sum
    }

    /// Half the derivative of R by each emission.
    fn slope(&self, emission: &[f64]) -> Vec<f64> {
        let of_column = |(column, &ridge): (usize, &f64)| {
            if ridge > 0.0 { ridge * self.off(emission, column) } else { 0.0 }
        };
        let mut slope: Vec<f64> = self.ridge.iter().enumerate().map(of_column).collect();
        for pair in self.terms.pairs {
            let own = self.unit * pair.weight * self.difference(emission, pair);
            let [a, b] = pair.columns;
            slope[a] += own;
            slope[b] -= own;
        }
        slope
    }

    fn off(&self, emission: &[f64], column: usize) -> f64 {
        emission[column] - self.terms.centre[column]
    }

    fn difference(&self, emission: &[f64], pair: &Pair) -> f64 {
        let [a, b] = pair.columns;
        self.off(emission, a) - self.off(emission, b)
    }
}

/// Twice the loss of a residual: its square, or Cauchy's.
pub(super) fn loss(residual: f64, robust: f64) -> f64 {
    if robust.is_infinite() {
        residual * residual
    } else {
        (residual / robust).powi(2).ln_1p() * robust * robust
    }
}

/// The weight that makes a squared residual's slope that of the loss.
pub(super) fn influence(residual: f64, robust: f64) -> f64 {
    if robust.is_infinite() { 1.0 } else { 1.0 / (1.0 + (residual / robust).powi(2)) }
}

/// The loss's second derivative. That of Cauchy's is negative beyond `robust`; there a small part
/// of the influence, with which a step still descends, and is not too long.
pub(super) fn curvature(residual: f64, robust: f64) -> f64 {
    if robust.is_infinite() {
        return 1.0;
    }
    let square = (residual / robust).powi(2);
    ((1.0 - square) / (1.0 + square)).max(LEAST_CURVATURE) / (1.0 + square)
}

const LEAST_CURVATURE: f64 = 0.2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::fibonacci;
    use crate::reconstruct::joint::background::LightSet;
    use crate::reconstruct::lights::{LightKind, VirtualLight};

    /// The same sky in more cells was once drawn together so much less that its cells took up what
    /// the photographs do not determine.
    #[test]
    fn a_sky_is_drawn_together_as_strongly_however_finely_it_is_divided() {
        let energy = |count: usize| {
            let mut set = LightSet::default();
            let mut emission = Vec::new();
            for direction in fibonacci(count, 0.0) {
                set.push(
                    VirtualLight::distant(LightKind::Sky, direction, 0.1),
                    &[(direction, 0.0)],
                );
                emission.push(1.0 + f64::from(direction.z));
            }
            let pair = |columns: [usize; 2]| Pair { columns, weight: 1.0 };
            let pairs: Vec<Pair> = set.neighbours().into_iter().map(pair).collect();
            let centre = vec![0.0; count];
            let terms = Terms { pairs: &pairs, centre: &centre, ..Terms::default() };
            // A cell's light is as much as its share of the sky.
            let norms = vec![1.0 / count as f64; count];
            Ridge::new(&terms, &norms).value(&emission)
        };
        let [coarse, fine] = [100, 800].map(energy);
        assert!((fine / coarse - 1.0).abs() < 0.1, "{coarse} {fine}");
    }
}

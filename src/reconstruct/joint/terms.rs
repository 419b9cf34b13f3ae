//! What a joint solve holds against the data: the loss of a residual, the ridge on the emissions,
//! known combinations of reflectances.

use crate::solve::kernels::dot;

/// What is made small.
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
    /// What the combination is known to be.
    pub target: f64,
    /// In units in which a squared residual of a row of weight 1 counts 1.
    pub weight: f64,
}

/// What is held against the data, and how.
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
    /// Log reflectances that set those units. They belong to the objective, so that where a solve
    /// starts has no effect on where it ends.
    pub reference: &'a [f64],
    /// What the ridge draws each emission to; 0 where nothing is known.
    pub centre: &'a [f64],
    /// Whether the ridge draws the emissions to those values plus one that is common to all
    /// columns and chosen with the unknowns: then it evens them out without making them dark.
    pub floating: bool,
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
            reference: &[],
            centre: &[],
            floating: false,
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

/// The ridge at some emissions.
pub(super) struct Ridge {
    /// λ_j n_j² per column.
    pub ridge: Vec<f64>,
    /// Their sum; ∞ where nothing floats.
    total: f64,
    /// The value common to all columns, at its best.
    pub common: f64,
}

impl Ridge {
    pub fn new(terms: &Terms, norms: &[f64], emission: &[f64]) -> Self {
        let ridge: Vec<f64> =
            terms.ridge.iter().zip(norms).map(|(ridge, norm)| ridge * norm * norm).collect();
        let total: f64 = ridge.iter().sum();
        if !terms.floating || total <= 0.0 {
            return Self { ridge, total: f64::INFINITY, common: 0.0 };
        }
        let sum: f64 = (0..ridge.len()).map(|j| ridge[j] * (emission[j] - terms.centre[j])).sum();
        Self { total, common: sum / total, ridge }
    }

    /// The second derivative by two emissions.
    pub fn hessian(&self, a: usize, b: usize) -> f64 {
        let own = if a == b { self.ridge[a] } else { 0.0 };
        own - self.ridge[a] * self.ridge[b] / self.total
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

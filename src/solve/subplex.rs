//! Minimisation without derivatives by simplex searches in subspaces, after T. H. Rowan,
//! "Functional Stability Analysis of Numerical Algorithms", PhD thesis, University of Texas at
//! Austin, 1990. Written from the published description; it is not Rowan's SUBPLEX program,
//! whose name he asked reimplementations not to carry as a product.
//!
//! A cycle splits the coordinates into subspaces of few dimensions, those that moved most in
//! the cycle before together, and runs the Nelder–Mead simplex in each in turn until it has
//! shrunk to a part of its first size. The steps of the next cycle follow from how far this one
//! went. The number of evaluations grows about linearly with the dimension, and a noisy or
//! discontinuous objective does no harm: only comparisons are used.

mod partition;
mod simplex;

/// Parts of the published method; Rowan's values.
const SIMPLEX_REDUCTION: f64 = 0.25;
const STEP_REDUCTION: f64 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubplexOptions {
    /// Ends after a cycle with max(|Δxᵢ|, 0.25 |stepᵢ|) <= tolerance · max(|xᵢ|, 1) for every i,
    /// Δx being the change in the cycle. Dimensionless, > 0. Default 1e-8.
    pub tolerance: f64,
    /// Most evaluations of the objective. Default 100 000.
    pub max_evaluations: usize,
    /// Dimensions of a subspace, 1 ..= `max_subspace`; Rowan's 2. Fewer coordinates than this
    /// are one subspace.
    pub min_subspace: usize,
    /// At least 2 · `min_subspace` − 1, or a split may be impossible; Rowan's 5.
    pub max_subspace: usize,
}

impl Default for SubplexOptions {
    fn default() -> Self {
        Self { tolerance: 1e-8, max_evaluations: 100_000, min_subspace: 2, max_subspace: 5 }
    }
}

impl SubplexOptions {
    pub fn check(&self) -> Result<(), SubplexError> {
        let fault = |name, wanted| Err(SubplexError::Option { name, wanted });
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return fault("tolerance", "positive");
        }
        if self.max_evaluations == 0 {
            return fault("max_evaluations", "at least 1");
        }
        if self.min_subspace == 0 {
            return fault("min_subspace", "at least 1");
        }
        if self.max_subspace + 1 < 2 * self.min_subspace {
            return fault("max_subspace", "at least 2 min_subspace - 1");
        }
        Ok(())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubplexError {
    #[error("option {name} must be {wanted}")]
    Option { name: &'static str, wanted: &'static str },
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubplexStop {
    /// The inequality of [`SubplexOptions::tolerance`] was met.
    Tolerance,
    /// [`SubplexOptions::max_evaluations`] were made.
    MaxEvaluations,
    /// Nothing to do or not doable: no coordinates, start and steps of different lengths or not
    /// finite, or options that fail their check; `x` is the start.
    BadInput,
}

#[derive(Clone, Debug, PartialEq)]
pub struct SubplexReport {
    /// The best point seen.
    pub x: Vec<f64>,
    /// The objective there; +∞ if it was nowhere a number.
    pub value: f64,
    pub evaluations: usize,
    /// Cycles over all subspaces.
    pub cycles: usize,
    pub stopped: SubplexStop,
}

/// Minimises `objective` from `start` with first steps `steps` along each coordinate (their sign
/// is the direction of the first try; a step of 0 keeps its coordinate fixed). A value of NaN
/// counts as +∞, so a box can be had by giving +∞ outside. The same input gives the same
/// sequence of evaluations.
pub fn subplex(
    objective: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    steps: &[f64],
    options: &SubplexOptions,
) -> SubplexReport {
    let moving: Vec<usize> =
        (0..start.len().min(steps.len())).filter(|&i| steps[i] != 0.0).collect();
    let finite = start.iter().chain(steps).all(|value| value.is_finite());
    if moving.is_empty() || start.len() != steps.len() || !finite || options.check().is_err() {
        let (x, value) = (start.to_vec(), f64::INFINITY);
        let stopped = SubplexStop::BadInput;
        return SubplexReport { x, value, evaluations: 0, cycles: 0, stopped };
    }

    let mut search = Search::new(objective, start, options.max_evaluations);
    let mut steps = steps.to_vec();
    let mut progress = vec![0.0; start.len()];
    let mut cycles = 0;
    let stopped = loop {
        let before = search.x.clone();
        let parts =
            partition::partition(&moving, &progress, options.min_subspace, options.max_subspace);
        for part in &parts {
            simplex::search(&mut search, part, &steps, SIMPLEX_REDUCTION);
            if search.spent() {
                break;
            }
        }
        cycles += 1;
        if search.spent() {
            break SubplexStop::MaxEvaluations;
        }
        for (progress, (now, before)) in progress.iter_mut().zip(search.x.iter().zip(&before)) {
            *progress = now - before;
        }
        let small = moving.iter().all(|&i| {
            let reach = progress[i].abs().max(SIMPLEX_REDUCTION * steps[i].abs());
            reach <= options.tolerance * search.x[i].abs().max(1.0)
        });
        if small {
            break SubplexStop::Tolerance;
        }
        rescale(&mut steps, &progress, parts.len());
    };
    let Search { x, value, evaluations, .. } = search;
    SubplexReport { x, value, evaluations, cycles, stopped }
}

/// The next cycle's steps: longer or shorter as this cycle went far or not, in the direction it
/// went; back where a coordinate did not move.
fn rescale(steps: &mut [f64], progress: &[f64], parts: usize) {
    let sum = |values: &[f64]| values.iter().map(|value| value.abs()).sum::<f64>();
    let factor = if parts > 1 {
        (sum(progress) / sum(steps)).clamp(STEP_REDUCTION, 1.0 / STEP_REDUCTION)
    } else {
        SIMPLEX_REDUCTION
    };
    for (step, &progress) in steps.iter_mut().zip(progress) {
        let length = step.abs() * factor;
        *step = match progress {
            p if p > 0.0 => length,
            p if p < 0.0 => -length,
            _ => -step.signum() * length,
        };
    }
}

/// The best point so far, and the only place that calls the objective.
struct Search<F> {
    objective: F,
    x: Vec<f64>,
    value: f64,
    evaluations: usize,
    most: usize,
}

impl<F: FnMut(&[f64]) -> f64> Search<F> {
    fn new(objective: F, start: &[f64], most: usize) -> Self {
        let mut search =
            Self { objective, x: start.to_vec(), value: f64::INFINITY, evaluations: 0, most };
        search.value = search.evaluate(start);
        search
    }

    fn evaluate(&mut self, x: &[f64]) -> f64 {
        self.evaluations += 1;
        let value = (self.objective)(x);
        if value.is_nan() { f64::INFINITY } else { value }
    }

    fn spent(&self) -> bool {
        self.evaluations >= self.most
    }
}

#[cfg(test)]
mod tests;

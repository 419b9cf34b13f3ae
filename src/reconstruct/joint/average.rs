//! The result as a weighted mean over several light sets. Each light set has the lamps and the
//! gloss that were chosen, together with a differently laid out background; its weight follows from
//! its error in held-out blocks.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::Error;
use crate::reconstruct::joint::compare::{Validated, compare, validate};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit, fit_with_scale_prior};
use crate::reconstruct::joint::light_model::LightModel;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::search::{Found, regrow};

/// The ridge of the light sets, in turn, as a factor of that of the options.
const RIDGES: [f64; 3] = [1.0, 1.0 / 3.0, 3.0];

/// The fitted light sets with their weights, which add up to 1. The first has the background of the
/// search.
pub struct Ensemble {
    pub members: Vec<(Fitted, f64)>,
}

/// Mean and spread of an ensemble.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// log ρ_d, per channel and material.
    pub log_diffuse: [Vec<f64>; CHANNELS],
    pub log_diffuse_variance: [Vec<f64>; CHANNELS],
    /// ρ_s.
    pub specular: [Vec<f64>; CHANNELS],
    pub specular_variance: [Vec<f64>; CHANNELS],
}

impl Ensemble {
    /// Fits the light sets to all rows of a problem; their weights are from the rows that the
    /// model was chosen with. `main` is the model that was chosen, on all rows.
    ///
    /// # Errors
    /// If it is cancelled, or if the bounded least squares of a fit fails.
    pub fn new(
        problem: &Problem,
        found: &Found,
        main: &LightModel,
        count: usize,
    ) -> Result<Self, Error> {
        let sets: Vec<Validated> = (0..count)
            .into_par_iter()
            .map(|index| light_set(found, index))
            .collect::<Result<_, Error>>()?;
        let weights = weights(&found.problem, &sets);
        let members = sets
            .into_par_iter()
            .zip(weights)
            .enumerate()
            .map(|(index, (set, weight))| {
                let model = match index {
                    0 => main.clone(),
                    _ => set.fitted.model.on(problem, &set.fitted.rows)?,
                };
                let fitted = fit(problem, &model, Some(&set.fitted), ROUGH)?;
                Ok((fit_with_scale_prior(problem, fitted)?, weight))
            })
            .collect::<Result<_, Error>>()?;
        Ok(Self { members })
    }

    /// The same light sets fitted to a problem with other weights or another I_s.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn refit(&self, problem: &Problem) -> Result<Self, Error> {
        let members = self.members.par_iter().map(|(fitted, weight)| {
            let fitted = fit(problem, &fitted.model, Some(fitted), ROUGH)?;
            Ok((fit_with_scale_prior(problem, fitted)?, *weight))
        });
        Ok(Self { members: members.collect::<Result<_, Error>>()? })
    }

    pub fn main(&self) -> &Fitted {
        &self.members[0].0
    }

    pub fn posterior(&self) -> Posterior {
        let moments = |of: &dyn Fn(&Fitted, usize) -> Vec<f64>, c: usize| {
            let values: Vec<(Vec<f64>, f64)> =
                self.members.iter().map(|(fitted, weight)| (of(fitted, c), *weight)).collect();
            let mut mean = vec![0.0; values[0].0.len()];
            for (value, weight) in &values {
                mean.iter_mut().zip(value).for_each(|(mean, value)| *mean += weight * value);
            }
            let mut variance = vec![0.0; mean.len()];
            // The variance about the sample's own mean is too small by this factor.
            let unseen: f64 = 1.0 - values.iter().map(|(_, weight)| weight * weight).sum::<f64>();
            for (value, weight) in &values {
                for ((variance, mean), value) in variance.iter_mut().zip(&mean).zip(value) {
                    *variance += weight * (value - mean).powi(2) / unseen.max(LEAST_UNSEEN);
                }
            }
            (mean, variance)
        };
        let log = |fitted: &Fitted, c: usize| fitted.channels[c].state.log_diffuse.clone();
        let specular = |fitted: &Fitted, c: usize| fitted.channels[c].state.specular.clone();
        let [d0, d1, d2] = [0, 1, 2].map(|c| moments(&log, c));
        let [s0, s1, s2] = [0, 1, 2].map(|c| moments(&specular, c));
        Posterior {
            log_diffuse: [d0.0, d1.0, d2.0],
            log_diffuse_variance: [d0.1, d1.1, d2.1],
            specular: [s0.0, s1.0, s2.0],
            specular_variance: [s0.1, s1.1, s2.1],
        }
    }
}

/// The variance that few light sets show is enlarged at most by the inverse of this.
const LEAST_UNSEEN: f64 = 0.1;

impl Posterior {
    pub fn diffuse(&self, material: usize) -> Rgb {
        std::array::from_fn(|c| self.log_diffuse[c][material].exp())
    }

    pub fn specular(&self, material: usize) -> Rgb {
        std::array::from_fn(|c| self.specular[c][material])
    }

    /// The same with some materials taken to be diffuse.
    pub fn without_gloss(mut self, materials: &[usize]) -> Self {
        for specular in &mut self.specular {
            materials.iter().for_each(|&material| specular[material] = 0.0);
        }
        self
    }

    /// The problem with these reflectances as known values.
    pub fn known_to<'a>(&self, problem: &Problem<'a>) -> Problem<'a> {
        let mut priors = (*problem.priors).clone();
        for c in 0..CHANNELS {
            priors.known[c] = self.log_diffuse[c].iter().map(|&log| Some(log)).collect();
            priors.known_specular[c] = self.specular[c].iter().map(|&value| Some(value)).collect();
        }
        problem.with_priors(priors)
    }
}

/// The model that was chosen with the background of one light set.
fn light_set(found: &Found, index: usize) -> Result<Validated, Error> {
    if index == 0 {
        return Ok(found.best.clone().without_folds());
    }
    let (problem, fitted) = (&found.problem, &found.best.fitted);
    let mut model = fitted.model.clone();
    for part in &fitted.model.parts {
        if let PartKind::Background(layout) = part.kind {
            let background = Part::background(problem, &layout.varied(index))?;
            model = model.replacing(part.slot, background);
        }
    }
    model.ridge = problem.options().ridge * RIDGES[index % RIDGES.len()];
    Ok(validate(problem, regrow(found, &model)?, None)?.without_folds())
}

/// The weight of each light set: exp(−z²/2), where z is by how many standard errors of the
/// difference its held-out error is above that of the best.
fn weights(problem: &Problem, sets: &[Validated]) -> Vec<f64> {
    let total = |set: &Validated| set.losses.iter().sum::<f64>();
    let Some(best) = sets.iter().min_by(|a, b| total(a).total_cmp(&total(b))) else {
        return Vec::new();
    };
    let weight = |set: &Validated| {
        let cv = compare(problem, best, set);
        if cv.change <= 0.0 || cv.standard_error.is_infinite() {
            return 1.0;
        }
        (-0.5 * (cv.change / cv.standard_error.max(f64::MIN_POSITIVE)).powi(2)).exp()
    };
    let weights: Vec<f64> = sets.iter().map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

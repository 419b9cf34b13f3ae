//! Fits a light model to a problem, in all three channels.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::statistics::robust_deviation;
use crate::reconstruct::Error;
use crate::reconstruct::joint::hessian::Hessian;
use crate::reconstruct::joint::light_model::LightModel;
use crate::reconstruct::joint::part::Part;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::rows::Run;
use crate::reconstruct::joint::strength::{
    Held, STRENGTH_TOLERANCE, hold, mean_log_strength, zero_of_slope,
};
use crate::reconstruct::joint::system::{Anchor, Channel, Design, Fit, Rows, State, Terms};
use crate::scene::Gloss;
use crate::solve::kernels::dot;

/// When a fit ends: when a step lowers the cost by less than this fraction of the cost.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance(pub f64);

/// For comparing models, whose costs differ by a thousand times as much.
pub const ROUGH: Tolerance = Tolerance(1e-6);
/// For a result: the cosine between the residuals and any column is then about a millionth.
pub const EXACT: Tolerance = Tolerance(1e-12);

/// A light model at its minimum.
#[derive(Clone)]
pub struct Fitted {
    pub model: LightModel,
    /// The rows that it was fitted to.
    pub rows: Arc<Rows>,
    pub design: Arc<Design>,
    /// Per channel.
    pub channels: Vec<Fit>,
}

impl Fitted {
    /// Sum of the channels' costs.
    pub fn cost(&self) -> f64 {
        self.channels.iter().map(|fit| fit.value).sum()
    }

    /// Largest projected gradient of any unknown, as a cosine.
    pub fn kkt_residual(&self) -> f64 {
        self.channels.iter().map(|fit| fit.kkt_residual).fold(0.0, f64::max)
    }

    /// Emission per column.
    pub fn emission(&self) -> Vec<Rgb> {
        let of = |column: usize| std::array::from_fn(|c| self.channels[c].state.emission[column]);
        (0..self.model.columns()).map(of).collect()
    }

    /// log ρ_d of a material.
    pub fn log_diffuse(&self, material: usize) -> Rgb {
        std::array::from_fn(|c| self.channels[c].state.log_diffuse[material])
    }

    /// ρ_s of a material.
    pub fn specular(&self, material: usize) -> Rgb {
        std::array::from_fn(|c| self.channels[c].state.specular[material])
    }

    /// The columns of a part whose coupling is also that of a part of this model; `None` if there is none.
    pub fn columns_of_same(&self, part: &Part) -> Option<Range<usize>> {
        let is_same = |own: &&Part| Arc::ptr_eq(&own.coupling, &part.coupling);
        let own = self.model.parts.iter().find(is_same)?;
        Some(self.model.columns_of(own.slot))
    }

    /// Whether it is of the same rows as another, with so many of its lights (7/8) that it costs less to
    /// add the others to its second derivatives than to take a quarter of the rows out of one's own.
    pub fn is_like(&self, other: &Self) -> bool {
        let shared = self.model.columns_in(other).iter().flatten().count();
        Arc::ptr_eq(&self.rows, &other.rows) && 8 * shared >= 7 * self.model.columns()
    }

    /// Where a descent from this minimum starts, per channel.
    pub fn starts(&self) -> Vec<Start> {
        self.channels.iter().map(Start::at).collect()
    }

    /// Robust standard deviation of the residuals of some rows, all channels together.
    pub fn deviation(&self, rows: &[usize]) -> f64 {
        let residuals =
            self.channels.iter().flat_map(|fit| rows.iter().map(|&row| fit.residuals[row]));
        robust_deviation(residuals).max(f64::MIN_POSITIVE)
    }
}

/// The minimum for a light model, from an earlier fit of a model with some of the same parts or
/// from the start values.
///
/// # Errors
/// If it is cancelled, or if the bounded least squares of a step fails.
pub fn fit(
    problem: &Problem,
    model: &LightModel,
    from: Option<&Fitted>,
    tolerance: Tolerance,
) -> Result<Fitted, Error> {
    let alike = from.filter(|fitted| Arc::ptr_eq(&fitted.rows, &problem.rows));
    let design = Arc::new(model.design(problem, alike));
    let starts: Vec<Start> = (0..CHANNELS)
        .into_par_iter()
        .map(|channel| Start {
            state: start(problem, model, from, channel),
            hessian: alike.map(|fitted| carried(model, fitted, channel)),
        })
        .collect();
    let channels =
        descend(problem, model, &design, &problem.weights, starts, tolerance, |_| Vec::new())?;
    Ok(Fitted { model: model.clone(), rows: problem.rows.clone(), design, channels })
}

/// The same minimum with the weak prior on the common scale: the mean log reflectance a + b of a
/// channel, a (of all channels) normal about log `prior_mean`, b (of the channel) about 0. Where a
/// reflectance is known there is no such prior.
///
/// # Errors
/// As [`fit`].
pub fn fit_with_scale_prior(problem: &Problem, mut fitted: Fitted) -> Result<Fitted, Error> {
    let measured = &problem.priors.measured;
    let count = measured.iter().filter(|measured| **measured).count();
    if problem.priors.has_pin() || count == 0 {
        return fit(problem, &fitted.model, Some(&fitted), EXACT);
    }
    let share = |measured: &bool| if *measured { 1.0 / count as f64 } else { 0.0 };
    let combination: Vec<f64> = measured.iter().map(share).collect();
    let options = problem.options();
    let mean = options.prior_mean.ln();
    let (common, own) = (options.prior_sd.powi(2), options.channel_tie.powi(2));
    // Mean and variance of one channel's a + b, the others' given.
    let gain = common / (2.0 * common + own);
    let variance = common + own - 2.0 * common * gain;
    let level =
        |fitted: &Fitted, c: usize| dot(&combination, &fitted.channels[c].state.log_diffuse);
    for _ in 0..PRIOR_ROUNDS {
        let before: Rgb = std::array::from_fn(|c| level(&fitted, c));
        let (model, design, starts) = (&fitted.model, &fitted.design, fitted.starts());
        let channels = descend(problem, model, design, &problem.weights, starts, EXACT, |c| {
            let others: f64 = (0..CHANNELS).filter(|o| *o != c).map(|o| before[o] - mean).sum();
            let (target, weight) = (mean + gain * others, problem.priors.noise[c] / variance);
            vec![Anchor { combination: combination.clone(), target, weight }]
        })?;
        fitted.channels = channels;
        if (0..CHANNELS).all(|c| (level(&fitted, c) - before[c]).abs() < LEVEL_TOLERANCE) {
            break;
        }
    }
    Ok(fitted)
}

/// Change of a channel's mean log reflectance that is no change, and the most rounds until then;
/// each leaves less than half of it.
const LEVEL_TOLERANCE: f64 = 1e-4;
const PRIOR_ROUNDS: usize = 20;
const FIRST_SPECULAR: f64 = 0.05;

/// Where the descent of a channel starts.
pub struct Start {
    state: State,
    /// Second derivatives near it.
    hessian: Option<Hessian>,
}

impl Start {
    fn at(fit: &Fit) -> Self {
        Self { state: fit.state.clone(), hessian: Some((*fit.hessian).clone()) }
    }
}

/// Where the descents of a fit with other weights of the rows start, per channel: at the minimum `blind` of
/// an earlier model with these weights, moved as `fitted` has moved from that model's minimum for all rows.
pub fn starts_beside(
    problem: &Problem,
    fitted: &Fitted,
    earlier: &Fitted,
    blind: &Fitted,
) -> Vec<Start> {
    let start = |channel: usize| {
        let of = |fit: &Fitted| start(problem, &fitted.model, Some(fit), channel);
        let mut state = of(blind);
        state.shift(&of(earlier), &fitted.channels[channel].state);
        Start { state, hessian: Some(carried(&fitted.model, blind, channel)) }
    };
    (0..CHANNELS).into_par_iter().map(start).collect()
}

/// The second derivatives of an earlier fit to the same rows, over the columns that a model has in common
/// with it.
fn carried(model: &LightModel, from: &Fitted, channel: usize) -> Hessian {
    let has_another_lobe = |run: &Run| {
        run.glossy.is_some() && model.gloss[run.material] != from.model.gloss[run.material]
    };
    let rows: Vec<usize> =
        from.rows.runs().filter(has_another_lobe).flat_map(|run| run.rows).collect();
    let mut hessian = (*from.channels[channel].hessian).clone();
    let system = Channel { rows: &from.rows, design: &from.design, channel };
    hessian.take_out(&system, &rows);
    hessian.carried(&model.columns_in(from))
}

/// The unknowns with which the descent of a channel starts.
fn start(problem: &Problem, model: &LightModel, from: Option<&Fitted>, channel: usize) -> State {
    let glossy = |material: usize, specular: f64| {
        if model.gloss[material].is_some() { specular } else { 0.0 }
    };
    match from {
        Some(fitted) => {
            let state = &fitted.channels[channel].state;
            let specular = |m: usize| match fitted.model.gloss[m] {
                Some(_) => glossy(m, state.specular[m]),
                None => glossy(m, FIRST_SPECULAR),
            };
            State {
                emission: model.carry(fitted, channel),
                log_diffuse: state.log_diffuse.clone(),
                specular: (0..problem.materials()).map(specular).collect(),
            }
        }
        None => State {
            emission: vec![0.0; model.columns()],
            log_diffuse: problem.priors.start[channel].clone(),
            specular: (0..problem.materials()).map(|m| glossy(m, FIRST_SPECULAR)).collect(),
        },
    }
}

/// The minimum of each channel from given states, with other weights or further anchors (Gaussian
/// priors on combinations of log reflectances). A light of known colour has one strength in all
/// channels: the one at which the sum of the costs is least.
///
/// # Errors
/// As [`fit`].
pub fn descend(
    problem: &Problem,
    model: &LightModel,
    design: &Design,
    weights: &[f64],
    starts: Vec<Start>,
    tolerance: Tolerance,
    anchors: impl Fn(usize) -> Vec<Anchor> + Sync,
) -> Result<Vec<Fit>, Error> {
    let minima = |held: &Held, starts: Vec<Start>| -> Result<Vec<Fit>, Error> {
        starts
            .into_par_iter()
            .enumerate()
            .map(|(channel, start)| {
                with_terms(problem, model, weights, channel, tolerance, |terms| {
                    let mut all = anchors(channel);
                    all.extend(pin_anchors(problem, channel));
                    let terms = Terms { anchors: &all, held: &held[channel], ..*terms };
                    let system = Channel { rows: &problem.rows, design, channel };
                    let Start { state, hessian } = start;
                    Ok(system.fit_with(&terms, &state, hessian, problem.watch())?)
                })
            })
            .collect()
    };
    let mut held: Held = std::array::from_fn(|channel| model.held(channel));
    // A light of known colour that was fitted before starts with the strength that it had then.
    let column_of = |part: &Part| Some((part.colour?, model.columns_of(part.slot).start));
    let coloured: Vec<(Rgb, usize)> = model.parts.iter().filter_map(column_of).collect();
    let states = starts.iter().map(|start| &start.state);
    for &(colour, column) in &coloured {
        let log = mean_log_strength(states.clone().map(|state| state.emission[column]), colour);
        hold(&mut held, column, colour, log);
    }
    let mut fits = minima(&held, starts)?;
    for (colour, column) in coloured {
        let Some(first) =
            mean_log_strength(fits.iter().map(|fit| fit.state.emission[column]), colour)
        else {
            continue;
        };
        let at = |log: f64, from: &Vec<Fit>| {
            let mut held = held.clone();
            hold(&mut held, column, colour, Some(log));
            minima(&held, from.iter().map(Start::at).collect())
        };
        if held[0][column].is_none() {
            fits = at(first, &fits)?;
        }
        let slope = |fits: &Vec<Fit>| -> f64 {
            fits.iter().map(|fit| -fit.gradient[column] * fit.state.emission[column]).sum()
        };
        let (log, best) = zero_of_slope((first, fits), STRENGTH_TOLERANCE, at, slope)?;
        hold(&mut held, column, colour, Some(log));
        fits = best;
    }
    Ok(fits)
}

/// Calls a function with the terms of one channel: loss, ridge and bounds, without anchors.
pub fn with_terms<T>(
    problem: &Problem,
    model: &LightModel,
    weights: &[f64],
    channel: usize,
    tolerance: Tolerance,
    work: impl FnOnce(&Terms) -> T,
) -> T {
    let priors = &problem.priors;
    let (ridge, ridge_units, pairs) = (model.ridges(), model.ridge_units(), model.pairs());
    let (centre, held) = (model.centres(channel), model.held(channel));
    let known_specular: Vec<Option<f64>> = (0..problem.materials())
        .map(|m| match model.gloss[m] {
            Some(Gloss::Phong { .. }) => priors.known_specular[channel][m],
            Some(Gloss::Coat { .. }) => Some(1.0),
            None => Some(0.0),
        })
        .collect();
    work(&Terms {
        weights,
        ridge: &ridge,
        ridge_units: &ridge_units,
        centre: &centre,
        relative_ridge: priors.relative_ridge,
        pairs: &pairs,
        held: &held,
        reference: &priors.reference[channel],
        known: &priors.known[channel],
        known_specular: &known_specular,
        upper: &priors.upper[channel],
        robust: &priors.robust,
        fall: tolerance.0,
        ..Terms::default()
    })
}

/// Reflectances that are known with a standard deviation, against the noise of the rows.
fn pin_anchors(problem: &Problem, channel: usize) -> Vec<Anchor> {
    let anchor = |(material, target, variance): (usize, f64, f64)| {
        let mut combination = vec![0.0; problem.materials()];
        combination[material] = 1.0;
        Anchor { combination, target, weight: problem.priors.noise[channel] / variance }
    };
    problem.priors.pins_of(channel).map(anchor).collect()
}

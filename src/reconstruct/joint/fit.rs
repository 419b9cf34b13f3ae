//! All three channels of a light model, fitted with everything that is known of the reflectances.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::Error;
use crate::reconstruct::joint::diagnose::deviation;
use crate::reconstruct::joint::model::{Data, Model};
use crate::reconstruct::joint::options::JointOptions;
use crate::reconstruct::joint::system::{Anchor, Channel, Fit, Rows, State, Terms};
use crate::reconstruct::joint::terms::{EXACT, ROUGH};
use crate::scene::MaterialKind;
use crate::solve::kernels::dot;
use crate::watch::Watch;

/// One fit per channel.
pub type Fits = Vec<Fit>;

/// What all light models are fitted to.
#[derive(Clone)]
pub struct Fitter<'a> {
    pub data: Data<'a>,
    pub options: &'a JointOptions,
    pub rows: Rows,
    /// I_s per sample.
    pub irradiance: Vec<Radiance>,
    /// The same before specular surfaces were looked at again.
    pub gathered: Vec<Radiance>,
    /// Whether known surfaces that no photograph shows are taken to shine.
    pub surfaces_shine: bool,
    /// Per row: its share of its sample; 0 for samples that were dropped.
    pub weights: Vec<f64>,
    /// Materials with samples.
    pub measured: Vec<bool>,
    /// Log reflectances to start from, by which the ridge is scaled, per channel and material.
    pub reference: [Vec<f64>; CHANNELS],
    /// log ρ_d that are known exactly, per channel and material.
    pub known: [Vec<Option<f64>>; CHANNELS],
    /// ρ_s that are held fixed.
    pub known_specular: [Vec<Option<f64>>; CHANNELS],
    /// Reflectances that are known with a standard deviation: material, ρ_d, sd.
    pub pins: Vec<(usize, Rgb, Rgb)>,
    /// Largest log ρ_d, per channel and material.
    pub upper: [Vec<f64>; CHANNELS],
    /// Exponent n per material.
    pub exponents: Vec<f64>,
    /// Per material: residuals beyond this count less; ∞ for least squares.
    pub robust: Vec<f64>,
    /// Materials that are tagged as specular and taken to be diffuse.
    pub matt: Vec<bool>,
}

impl<'a> Fitter<'a> {
    pub fn new(data: Data<'a>, start: &[Option<Rgb>]) -> Self {
        let options = &data.options.joint;
        let rows = data.rows();
        let capture = data.views.capture;
        let mut known: [Vec<Option<f64>>; CHANNELS] =
            std::array::from_fn(|_| vec![None; rows.materials]);
        let mut pins = Vec::new();
        for (index, material) in capture.materials.iter().enumerate() {
            let Some(value) = material.known_diffuse else { continue };
            match material.known_diffuse_sd.filter(|sd| sd.iter().any(|sd| *sd > 0.0)) {
                Some(sd) => pins.push((index, value, sd)),
                None => {
                    for (known, value) in known.iter_mut().zip(value) {
                        known[index] = Some(value.max(BLACK).ln());
                    }
                }
            }
        }
        let upper = vec![options.brightest.ln(); rows.materials];
        Self {
            irradiance: data.transport.irradiance.clone(),
            surfaces_shine: false,
            gathered: data.transport.irradiance.clone(),
            weights: data.equations.rows.iter().map(|row| row.share).collect(),
            measured: start.iter().map(Option::is_some).collect(),
            reference: std::array::from_fn(|c| {
                let log = |start: &Option<Rgb>| start.map_or(UNSEEN, |rgb| rgb[c]).max(BLACK).ln();
                start.iter().map(log).collect()
            }),
            known,
            known_specular: std::array::from_fn(|_| vec![None; rows.materials]),
            pins,
            upper: std::array::from_fn(|_| upper.clone()),
            exponents: vec![data.options.gloss.start_exponent; rows.materials],
            robust: vec![f64::INFINITY; capture.materials.len()],
            matt: vec![false; capture.materials.len()],
            rows,
            options,
            data,
        }
    }

    pub fn watch(&self) -> &Watch {
        self.data.watch
    }

    pub fn is_specular(&self, material: usize) -> bool {
        self.is_tagged_specular(material) && !self.matt[material]
    }

    pub fn is_tagged_specular(&self, material: usize) -> bool {
        self.measured[material]
            && self.data.views.capture.materials[material].kind == MaterialKind::Specular
    }

    /// Takes a material to be diffuse, whatever its tag says.
    pub fn make_matt(&mut self, material: usize) {
        self.matt[material] = true;
        for known in &mut self.known_specular {
            known[material] = Some(0.0);
        }
    }

    pub fn channel<'b>(&'b self, model: &'b Model, channel: usize) -> Channel<'b> {
        Channel { rows: &self.rows, design: &model.design, channel }
    }

    /// The terms of one channel, without anchors.
    pub fn terms<'b>(
        &'b self,
        ridge: &'b [f64],
        centre: &'b [f64],
        weights: &'b [f64],
        channel: usize,
    ) -> Terms<'b> {
        Terms {
            objective: self.options.objective,
            weights,
            ridge,
            centre,
            floating: false,
            reference: &self.reference[channel],
            known: &self.known[channel],
            known_specular: &self.known_specular[channel],
            upper: &self.upper[channel],
            anchors: &[],
            robust: &self.robust,
            fall: ROUGH,
        }
    }

    fn begin(&self, columns: usize, channel: usize) -> State {
        State {
            emission: vec![0.0; columns],
            log_diffuse: self.reference[channel].clone(),
            specular: (0..self.rows.materials)
                .map(|material| if self.is_specular(material) { FIRST_SPECULAR } else { 0.0 })
                .collect(),
        }
    }

    /// The minimum for a light model, from an earlier fit of a model with the same first columns
    /// or from the start; near enough to compare models.
    pub fn fit(
        &self,
        model: &Model,
        lambda: f64,
        weights: &[f64],
        from: Option<&[Fit]>,
    ) -> Result<Fits, Error> {
        self.fit_anchored(model, lambda, weights, from, ROUGH, |_| Vec::new())
    }

    /// The minimum itself, from a fit of the same model.
    pub fn fit_exactly(&self, model: &Model, lambda: f64, from: &[Fit]) -> Result<Fits, Error> {
        self.fit_anchored(model, lambda, &self.weights, Some(from), EXACT, |_| Vec::new())
    }

    fn fit_anchored(
        &self,
        model: &Model,
        lambda: f64,
        weights: &[f64],
        from: Option<&[Fit]>,
        fall: f64,
        anchors: impl Fn(usize) -> Vec<Anchor> + Sync,
    ) -> Result<Fits, Error> {
        let ridge = model.ridge(lambda);
        (0..CHANNELS)
            .into_par_iter()
            .map(|channel| {
                let mut state = self.begin(model.columns(), channel);
                if let Some(from) = from {
                    let from = &from[channel].state;
                    let shared = from.emission.len().min(state.emission.len());
                    state.emission[..shared].copy_from_slice(&from.emission[..shared]);
                    state.log_diffuse.clone_from(&from.log_diffuse);
                    state.specular.clone_from(&from.specular);
                }
                let centre: Vec<f64> = model.centre.iter().map(|rgb| rgb[channel]).collect();
                let mut anchors = anchors(channel);
                anchors.extend(self.pin_anchors(channel));
                let floating = model.floating;
                let terms = self.terms(&ridge, &centre, weights, channel);
                let terms = Terms { anchors: &anchors, floating, fall, ..terms };
                Ok(self.channel(model, channel).fit(&terms, &state, self.watch())?)
            })
            .collect()
    }

    /// Known reflectances with a standard deviation.
    fn pin_anchors(&self, channel: usize) -> Vec<Anchor> {
        let anchor = |(material, value, sd): &(usize, Rgb, Rgb)| {
            let mut combination = vec![0.0; self.rows.materials];
            combination[*material] = 1.0;
            let value = value[channel].max(BLACK);
            let relative = (sd[channel] / value).max(1e-3);
            // The data count one per sample with errors of TYPICAL_ERROR; so does this.
            let weight = (TYPICAL_ERROR / relative).powi(2);
            Anchor { combination, target: value.ln(), weight }
        };
        self.pins.iter().map(anchor).collect()
    }

    pub fn has_pin(&self) -> bool {
        !self.pins.is_empty() || self.known[0].iter().any(Option::is_some)
    }

    /// Mean square of log(computed/measured), per channel.
    pub fn mean_square(&self, fits: &[Fit]) -> Rgb {
        let total: f64 = self.weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        std::array::from_fn(|c| {
            let squares = fits[c].residuals.iter().zip(&self.weights).map(|(r, w)| w * r * r);
            squares.sum::<f64>() / total
        })
    }

    /// Weighs the weak prior on the common scale against the data: the mean log reflectance a + b
    /// of a channel, a (all channels) normal about log `prior_mean`, b (of the channel) about 0.
    /// The data's word on the scale counts with `SCALE_ERROR` times the residuals' error, since
    /// model error is no independent noise. Where a reflectance is known there is no prior.
    pub fn settle(&self, model: &Model, lambda: f64, mut fits: Fits) -> Result<Fits, Error> {
        let count = self.measured.iter().filter(|measured| **measured).count();
        if self.has_pin() || count == 0 {
            return self.fit_exactly(model, lambda, &fits);
        }
        let share = |measured: &bool| if *measured { 1.0 / count as f64 } else { 0.0 };
        let combination: Vec<f64> = self.measured.iter().map(share).collect();
        let (mean, common, own) = (
            self.options.prior_mean.ln(),
            self.options.prior_sd.powi(2),
            self.options.channel_tie.powi(2),
        );
        // Mean and variance of one channel's a + b, the others' given.
        let gain = common / (2.0 * common + own);
        let variance = common + own - 2.0 * common * gain;
        for round in 1..=PRIOR_ROUNDS {
            let fall = if round < PRIOR_ROUNDS { ROUGH } else { EXACT };
            let means: Vec<f64> =
                fits.iter().map(|fit| dot(&combination, &fit.state.log_diffuse)).collect();
            let squares = self.mean_square(&fits);
            fits = self.fit_anchored(model, lambda, &self.weights, Some(&fits), fall, |c| {
                let others: f64 =
                    (0..CHANNELS).filter(|o| *o != c).map(|other| means[other] - mean).sum();
                let weight = SCALE_ERROR * SCALE_ERROR * squares[c] / variance;
                let target = mean + gain * others;
                vec![Anchor { combination: combination.clone(), target, weight }]
            })?;
        }
        Ok(fits)
    }

    /// A textured material's known reflectance is the mean over its surface, while the solve in
    /// logarithms finds the geometric mean, which is smaller. The difference shows in the
    /// residuals of a fit.
    pub fn pin_geometric_means(&mut self, fits: &[Fit]) {
        let capture = self.data.views.capture;
        for (material, tags) in capture.materials.iter().enumerate() {
            if !tags.textured || tags.known_diffuse.is_none() {
                continue;
            }
            for (channel, fit) in fits.iter().enumerate() {
                let own: Vec<f64> = (0..self.rows.sample.len())
                    .filter(|&row| self.rows.material[row] == material && self.weights[row] > 0.0)
                    .map(|row| -fit.residuals[row])
                    .collect();
                let count = own.len().max(1) as f64;
                let middle = own.iter().sum::<f64>() / count;
                let mean = own.iter().map(|log| (log - middle).exp()).sum::<f64>() / count;
                if let Some(known) = &mut self.known[channel][material] {
                    *known -= mean.ln();
                }
                for (_, value, sd) in self.pins.iter_mut().filter(|(m, ..)| *m == material) {
                    value[channel] /= mean;
                    sd[channel] /= mean;
                }
            }
        }
    }

    /// Bounds every reflectance such that the brightest parts of its surfaces reflect no more
    /// than any surface does: what a sample shows beyond the model is its own reflectance.
    pub fn limit_by_brightest(&mut self, fits: &[Fit]) {
        for material in 0..self.rows.materials {
            for (channel, fit) in fits.iter().enumerate() {
                let mut beyond: Vec<f64> = (0..self.rows.sample.len())
                    .filter(|&row| {
                        self.rows.material[row] == material
                            && self.rows.glossy[row].is_none()
                            && self.weights[row] > 0.0
                    })
                    .map(|row| -fit.residuals[row])
                    .collect();
                if beyond.len() < ENOUGH_FOR_QUANTILE {
                    continue;
                }
                beyond.sort_by(f64::total_cmp);
                let quantile = beyond[(beyond.len() as f64 * BRIGHT_QUANTILE) as usize];
                self.upper[channel][material] =
                    self.options.brightest.ln() - quantile.clamp(0.0, LARGEST_QUANTILE);
            }
        }
    }

    /// Weighs every material by its own deviation, as far as `robust` of it: that of a textured
    /// or cluttered surface is its own, and not to decide about the light of all the others.
    pub fn weigh_by_deviation(&mut self, fits: &[Fit], robust: f64) {
        let of_rows = |rows: &[usize]| {
            let residuals = fits.iter().flat_map(|fit| rows.iter().map(|&row| fit.residuals[row]));
            deviation(residuals).max(f64::MIN_POSITIVE)
        };
        let all: Vec<usize> =
            (0..self.rows.sample.len()).filter(|&row| self.weights[row] > 0.0).collect();
        let typical = of_rows(&all);
        for material in 0..self.rows.materials {
            let rows: Vec<usize> =
                all.iter().copied().filter(|&row| self.rows.material[row] == material).collect();
            let own = if rows.len() < ENOUGH_FOR_QUANTILE { typical } else { of_rows(&rows) };
            let own = own.max(SMALLEST_DEVIATION * typical);
            self.robust[material] = robust * own;
            for row in rows {
                self.weights[row] *= (typical / own).powi(2);
            }
        }
    }

    /// Sum of the objectives of the channels.
    pub fn total(fits: &[Fit]) -> f64 {
        fits.iter().map(|fit| fit.value).sum()
    }
}

/// How many times the residuals' error, taken as independent, the scale is off by: up to 2.8 was
/// seen on captures of known truth, 1.5 is its standard deviation.
pub const SCALE_ERROR: f64 = 1.5;
/// Reflectance of materials that no photograph shows: it has no effect.
const UNSEEN: f64 = 0.4;
const BLACK: f64 = 1e-3;
const FIRST_SPECULAR: f64 = 0.05;
/// Relative error of a sample's radiance for which a stated standard deviation is weighed.
const TYPICAL_ERROR: f64 = 0.05;
const PRIOR_ROUNDS: usize = 3;
const BRIGHT_QUANTILE: f64 = 0.95;
/// Beyond this factor, as a logarithm, it is the light that is not understood.
const LARGEST_QUANTILE: f64 = 2.3;
/// Samples of a material that tell something of its distribution.
const ENOUGH_FOR_QUANTILE: usize = 20;
/// A material's deviation is taken to be at least this part of that of all: its samples are not
/// worth more than their light is understood.
const SMALLEST_DEVIATION: f64 = 0.5;

//! What is known of the reflectances before the light is.

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::joint::options::JointOptions;
use crate::scene::Capture;

/// Reflectance of materials that no photograph shows: it has no effect.
const UNSEEN: f64 = 0.4;
/// No photograph can distinguish reflectances below this from black.
pub const BLACK: f64 = 1e-3;

/// A known reflectance is taken to be no more certain than a thousandth.
const LEAST_RELATIVE_SD: f64 = 1e-3;

/// Relative error of a sample's radiance before anything is fitted.
const TYPICAL_ERROR: f64 = 0.05;

/// Prior knowledge of the reflectances.
#[derive(Clone, Debug)]
pub struct Priors {
    /// Materials with samples.
    pub measured: Vec<bool>,
    /// Log reflectances, known or from Eq. 11, per channel and material. They scale the ridge.
    pub reference: [Vec<f64>; CHANNELS],
    /// Log reflectances where the first fit starts.
    pub start: [Vec<f64>; CHANNELS],
    /// log ρ_d that are known exactly, per channel and material.
    pub known: [Vec<Option<f64>>; CHANNELS],
    /// ρ_s that are known, per channel and material.
    pub known_specular: [Vec<Option<f64>>; CHANNELS],
    /// Reflectances that are known with a standard deviation: material, ρ_d, sd.
    pub pins: Vec<(usize, Rgb, Rgb)>,
    /// Largest log ρ_d, per channel and material.
    pub upper: [Vec<f64>; CHANNELS],
    /// Per material the size of a residual beyond which it counts less (Cauchy's loss); infinite
    /// for least squares.
    pub robust: Vec<f64>,
    /// Effective variance of a row's residual in a mean over many rows, per channel: the variance
    /// of single residuals times the variance inflation by correlated neighbours.
    pub noise: Rgb,
    /// Whether the ridge is relative to the level of all light (see
    /// [`Terms`](crate::reconstruct::joint::terms::Terms)); not while the light model is searched for.
    /// With too few lights, a fit is then best at light that is orders of magnitude too bright over
    /// surfaces that are nearly black, and lights that are added later do not lead away from there.
    pub relative_ridge: bool,
}

impl Priors {
    /// `normalised` has the reflectances of Eq. 11, `start` those to begin with; `None` for
    /// materials without samples.
    pub fn new(
        capture: &Capture,
        options: &JointOptions,
        normalised: &[Option<Rgb>],
        start: &[Option<Rgb>],
    ) -> Self {
        let materials = capture.materials.len();
        let logs = |of: &[Option<Rgb>], c: usize| -> Vec<f64> {
            let known = capture.materials.iter().map(|material| material.known_diffuse);
            of.iter()
                .zip(known)
                .map(|(rgb, known)| known.or(*rgb).map_or(UNSEEN, |rgb| rgb[c]).max(BLACK).ln())
                .collect()
        };
        let mut known: [Vec<Option<f64>>; CHANNELS] =
            std::array::from_fn(|_| vec![None; materials]);
        let mut pins = Vec::new();
        let measured: Vec<bool> = start.iter().map(Option::is_some).collect();
        for (index, material) in capture.materials.iter().enumerate() {
            // Without rows it says nothing of the scale.
            let Some(value) = material.known_diffuse.filter(|_| measured[index]) else { continue };
            match material.known_diffuse_sd.filter(|sd| sd.iter().any(|sd| *sd > 0.0)) {
                Some(sd) => pins.push((index, value, sd)),
                None => {
                    for (known, value) in known.iter_mut().zip(value) {
                        known[index] = Some(value.max(BLACK).ln());
                    }
                }
            }
        }
        Self {
            measured,
            reference: std::array::from_fn(|c| logs(normalised, c)),
            start: std::array::from_fn(|c| logs(start, c)),
            known,
            known_specular: std::array::from_fn(|_| vec![None; materials]),
            pins,
            upper: std::array::from_fn(|_| vec![options.brightest.ln(); materials]),
            robust: vec![f64::INFINITY; materials],
            noise: [TYPICAL_ERROR * TYPICAL_ERROR; CHANNELS],
            relative_ridge: false,
        }
    }

    /// Reflectances of one channel that are known with a standard deviation: material, log ρ_d and the
    /// variance of that.
    pub fn pins_of(&self, channel: usize) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        self.pins.iter().map(move |(material, value, sd)| {
            let value = value[channel].max(BLACK);
            let relative = (sd[channel] / value).max(LEAST_RELATIVE_SD);
            (*material, value.ln(), relative.powi(2))
        })
    }

    pub fn has_pin(&self) -> bool {
        !self.pins.is_empty() || self.known[0].iter().any(Option::is_some)
    }
}

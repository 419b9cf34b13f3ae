//! Differences of exposure between the photographs, estimated from samples that several of them
//! show.
//!
//! A diffuse sample has the same radiance in every photograph, so the ratios of its measured
//! radiances are the ratios of the photographs' gains. For every pair of photographs the median of
//! the logarithm of this ratio over their common samples is taken; a few glossy or shadowed samples
//! do not change a median. Least squares over the graph of pairs gives a gain for each photograph.
//! Only ratios are determined: the median photograph of each connected part has a gain of 1.

use std::collections::BTreeMap;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use crate::reconstruct::samples::SampleCloud;
use crate::scene::{Capture, MaterialKind};
use crate::{choices, options};

choices! {
    /// Treatment of photographs with another exposure.
    GainUse {
        /// Not looked for.
        Off = "off",
        /// Reported, with a warning where one is large.
        Report = "report",
        /// Also divided out, before anything else.
        Apply = "apply",
    }
}

options! {
    /// The photographs as measurements.
    PhotographOptions in "photographs" {
        /// Differences of exposure between photographs, estimated from diffuse samples that several
        /// of them show. off: not estimated. report: a warning names large ones. apply: they are
        /// also divided out, before anything else.
        gain: GainUse = GainUse::Report, None, "";
    }
}

/// Pairs with fewer common samples are left out.
const FEWEST_SAMPLES: usize = 12;
/// Error of every ratio from registration and pixel size: the standard deviation of its logarithm.
const FLOOR: f64 = 0.003;
/// A gain differs significantly from 1 where its logarithm is larger than this,
const SIGNIFICANT: f64 = 0.02;
/// and larger than this many standard deviations.
const SIGNIFICANT_SD: f64 = 3.0;

/// The exposure of a photograph relative to the median one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    /// Its pixels are this many times as bright as they should be.
    pub gain: f64,
    /// Standard deviation of the logarithm of the gain.
    pub log_sd: f64,
    /// Samples that it shares with others.
    pub samples: usize,
}

impl Gain {
    /// Whether the photograph was exposed otherwise beyond doubt.
    pub fn is_significant(&self) -> bool {
        let ln = self.gain.ln().abs();
        ln > SIGNIFICANT && ln > SIGNIFICANT_SD * self.log_sd
    }
}

/// Two photographs and the ratio of their exposures by their common samples.
struct Pair {
    photographs: [usize; 2],
    /// Median of ln(first / second), and its standard deviation.
    ln_ratio: f64,
    sd: f64,
}

/// The gains of the photographs that share diffuse samples with others, in their order.
pub fn estimate(capture: &Capture, cloud: &SampleCloud) -> Vec<Gain> {
    let mut ratios: BTreeMap<[usize; 2], Vec<f64>> = BTreeMap::new();
    let mut shared: BTreeMap<usize, usize> = BTreeMap::new();
    // Of the ratios between the views of a sample all but so many follow from the others.
    let (mut dependent, mut independent) = (0, 0);
    for sample in &cloud.samples {
        let kind = capture.materials.get(sample.material).map(|material| material.kind);
        let views = &cloud.views[sample.views.clone()];
        if kind != Some(MaterialKind::Diffuse) || views.len() < 2 {
            continue;
        }
        let brightness = |radiance: [f32; 3]| radiance.iter().map(|&v| f64::from(v)).sum::<f64>();
        let seen: Vec<(usize, f64)> = views
            .iter()
            .map(|view| (view.photograph, brightness(view.radiance).ln()))
            .filter(|(_, ln)| ln.is_finite())
            .collect();
        dependent += seen.len() * seen.len().saturating_sub(1) / 2;
        independent += seen.len().saturating_sub(1);
        for (index, &(a, ln_a)) in seen.iter().enumerate() {
            *shared.entry(a).or_default() += 1;
            for &(b, ln_b) in &seen[index + 1..] {
                let (key, ratio) =
                    if a < b { ([a, b], ln_a - ln_b) } else { ([b, a], ln_b - ln_a) };
                ratios.entry(key).or_default().push(ratio);
            }
        }
    }
    let pairs: Vec<Pair> = ratios
        .into_iter()
        .filter(|(_, ratios)| ratios.len() >= FEWEST_SAMPLES)
        .map(|(photographs, mut ratios)| {
            let (ln_ratio, sd) = median(&mut ratios);
            Pair { photographs, ln_ratio, sd: sd.hypot(FLOOR) }
        })
        .collect();
    let repeated = dependent as f64 / independent.max(1) as f64;
    let mut gains: Vec<Gain> =
        parts(&pairs).iter().flat_map(|part| solve(&pairs, part, repeated)).collect();
    gains.sort_by_key(|gain| gain.photograph);
    for gain in &mut gains {
        gain.samples = shared.get(&gain.photograph).copied().unwrap_or(0);
    }
    gains
}

/// The photographs that pairs connect with each other.
fn parts(pairs: &[Pair]) -> Vec<Vec<usize>> {
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for pair in pairs {
        let (mut own, others): (Vec<_>, Vec<_>) = parts
            .into_iter()
            .partition(|part| pair.photographs.iter().any(|one| part.contains(one)));
        own.push(pair.photographs.to_vec());
        let mut joined = own.concat();
        joined.sort_unstable();
        joined.dedup();
        parts = others;
        parts.push(joined);
    }
    parts
}

/// Weighted least squares over the pairs of one part, the sum of the logarithms held at 0, which
/// leaves the differences as they are; then the median is made 1. `repeated` is the
/// variance inflation of dependent pairs: of n photographs that share a sample n(n−1)/2 pairs are
/// formed, but only n−1 of them are independent.
fn solve(pairs: &[Pair], part: &[usize], repeated: f64) -> Vec<Gain> {
    let count = part.len();
    let place = |photograph: usize| part.binary_search(&photograph).ok();
    let mut matrix = Mat::<f64>::from_fn(count, count, |_, _| 1.0 / count as f64);
    let mut right = Mat::<f64>::zeros(count, 1);
    let mut own = Vec::new();
    for pair in pairs {
        let [Some(a), Some(b)] = pair.photographs.map(place) else { continue };
        let weight = pair.sd.powi(2).recip();
        matrix[(a, a)] += weight;
        matrix[(b, b)] += weight;
        matrix[(a, b)] -= weight;
        matrix[(b, a)] -= weight;
        right[(a, 0)] += weight * pair.ln_ratio;
        right[(b, 0)] -= weight * pair.ln_ratio;
        own.push((a, b, weight, pair.ln_ratio));
    }
    let Ok(factor) = matrix.llt(Side::Lower) else { return Vec::new() };
    let solution = factor.solve(&right);
    let inverse = factor.solve(Mat::<f64>::identity(count, count));
    // Where the misfit is larger than the variances explain, they are scaled up by the reduced χ².
    let misfit: f64 = own
        .iter()
        .map(|(a, b, weight, ratio)| {
            weight * (solution[(*a, 0)] - solution[(*b, 0)] - ratio).powi(2)
        })
        .sum();
    let spare = (own.len() + 1).saturating_sub(count);
    let widened = if spare > 0 { (misfit / spare as f64).max(1.0) } else { 1.0 };
    let mut logarithms: Vec<f64> = (0..count).map(|k| solution[(k, 0)]).collect();
    let (middle, _) = median(&mut logarithms);
    part.iter()
        .enumerate()
        .map(|(k, &photograph)| Gain {
            photograph,
            gain: (solution[(k, 0)] - middle).exp(),
            log_sd: (repeated * widened * (inverse[(k, k)] - 1.0 / count as f64).max(0.0)).sqrt(),
            samples: 0,
        })
        .collect()
}

/// The median, and its standard deviation by the median absolute deviation (of normal values:
/// 1.4826 times that is their standard deviation, and the median's is 1.2533 times the mean's).
fn median(values: &mut [f64]) -> (f64, f64) {
    let count = values.len();
    let middle = |values: &mut [f64]| {
        values.sort_by(f64::total_cmp);
        0.5 * (values[(count - 1) / 2] + values[count / 2])
    };
    if count == 0 {
        return (0.0, 0.0);
    }
    let center = middle(values);
    let mut away: Vec<f64> = values.iter().map(|value| (value - center).abs()).collect();
    (center, 1.2533 * 1.4826 * middle(&mut away) / (count as f64).sqrt())
}

/// The capture with significant gains divided out; `None` where there are none.
pub fn corrected(capture: &Capture, gains: &[Gain]) -> Option<Capture> {
    let significant: Vec<&Gain> = gains.iter().filter(|gain| gain.is_significant()).collect();
    if significant.is_empty() {
        return None;
    }
    let mut corrected = capture.clone();
    for gain in significant {
        let photograph = &mut corrected.photographs[gain.photograph];
        let factor = gain.gain.recip() as f32;
        if let Some(image) = &mut photograph.image {
            *image = std::sync::Arc::new(image.with_gain(factor));
        }
    }
    Some(corrected)
}

/// A sentence for each photograph whose gain differs significantly from 1.
pub fn warnings(capture: &Capture, gains: &[Gain], is_applied: bool) -> Vec<String> {
    let word = |gain: &Gain| {
        let percent = 100.0 * (gain.gain - 1.0);
        let direction = if percent > 0.0 { "brighter" } else { "darker" };
        let done = if is_applied {
            "it was divided out"
        } else {
            "check its exposure, or divide it out with --photographs.gain apply"
        };
        format!(
            "photograph \"{}\" is {:.1} % {direction} than the others by {} common samples (± {:.1} \
             %): {done}",
            capture.photographs[gain.photograph].name,
            percent.abs(),
            gain.samples,
            100.0 * gain.log_sd
        )
    };
    gains.iter().filter(|gain| gain.is_significant()).map(word).collect()
}

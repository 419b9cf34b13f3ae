//! The camera's response: ln of the exposure that a code stands for (Debevec and Malik 1997).

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;

use super::options::{MergeOptions, Weights};
use super::samples::Readings;
use super::{FULL_SCALE, KNOTS};
use crate::math::rgb::{CHANNELS, srgb_to_linear};

/// The code whose exposure is 1 in every channel.
const MIDDLE: usize = 128;
/// The number of pixels for which the smoothness is stated.
const PIXELS_OF_SMOOTHNESS: f64 = 70.0;
/// A camera's response is nowhere flatter, in ln exposure a code, than a linear one is at white.
const FLATTEST: f64 = 1.0 / FULL_SCALE as f64;
/// Half the span over which slopes are taken, in codes.
const SLOPE_SPAN: usize = 4;

/// ln exposure of codes, channel by channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Response {
    /// Exposure is code − black, in 255ths of full scale; 1 at the middle code.
    Linear { black: f64 },
    /// One value a code of an 8-bit file, not decreasing; 16-bit codes lie between.
    Curve(Box<[[f64; KNOTS]; CHANNELS]>),
}

/// The readings do not determine a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the exposures do not determine a response")]
pub struct Undetermined;

impl Response {
    /// The curve of sRGB (IEC 61966-2-1): what a file meant for a screen stands for, where its
    /// camera has not bent the tones further.
    pub fn srgb() -> Self {
        // No light at all has no logarithm: code 0 is taken to be half a code.
        let ln = |code: f64| srgb_to_linear(code.max(0.5) / f64::from(FULL_SCALE)).ln();
        let knots = std::array::from_fn(|code| ln(code as f64) - ln(MIDDLE as f64));
        Self::Curve(Box::new([knots; CHANNELS]))
    }

    /// ln of the exposure that `code` (in 255ths of full scale) stands for; −∞ for no light.
    pub fn ln_exposure(&self, channel: usize, code: f32) -> f64 {
        match self {
            Self::Linear { black } => {
                let middle = MIDDLE as f64 - black;
                ((f64::from(code) - black).max(0.0) / middle).ln()
            }
            Self::Curve(knots) => {
                let (low, part) = split(code);
                let knots = &knots[channel];
                knots[low] + part * (knots[(low + 1).min(KNOTS - 1)] - knots[low])
            }
        }
    }

    /// The standard deviation of ln exposure at a code, up to a factor common to all codes.
    ///
    /// A recovered response belongs to codes that were made for viewing, whose noise is about the
    /// same at all of them; the noise of linear codes is that of photons.
    pub fn deviation(&self, channel: usize, code: f32) -> f64 {
        match self {
            Self::Linear { black } => {
                (f64::from(code) - black).max(f64::MIN_POSITIVE).sqrt().recip()
            }
            Self::Curve(knots) => {
                let (middle, _) = split(code + 0.5);
                let low = middle.saturating_sub(SLOPE_SPAN);
                let high = (middle + SLOPE_SPAN).min(KNOTS - 1);
                let rise = knots[channel][high] - knots[channel][low];
                (rise / (high - low) as f64).max(FLATTEST)
            }
        }
    }
}

/// The triangle of Debevec and Malik (Eq. 4), 1 to 128, for a code in 255ths of full scale.
pub fn hat(code: f32) -> f64 {
    let code = f64::from(code);
    (code + 1.0).min(256.0 - code).clamp(0.0, 128.0)
}

/// The weight of a code in the average of ln E, without what is common to all codes: 0 at and
/// beyond the ends of the usable range.
pub fn weight(response: &Response, options: &MergeOptions, channel: usize, code: f32) -> f64 {
    let (low, high) = options.usable();
    if code.is_nan() || code <= low || code >= high {
        return 0.0;
    }
    match options.weights {
        Weights::Hat => hat(code),
        Weights::Noise => {
            // Ward's broad hat (Reinhard et al., High Dynamic Range Imaging, 2nd ed., 5.7) keeps
            // clipped noise out; the rest is the inverse of the variance of ln E.
            let (low, high) = (f64::from(low), f64::from(high));
            let x = (2.0 * f64::from(code) - low - high) / (high - low);
            (1.0 - x.powi(12)) / response.deviation(channel, code).powi(2)
        }
    }
}

fn split(code: f32) -> (usize, f64) {
    let code = f64::from(code.clamp(0.0, FULL_SCALE));
    (code as usize, code.fract())
}

/// Recovers the response of each channel from readings of all series together. `parts[s][j]`
/// numbers the part of series `s` that exposure `j` belongs to: exposure times are believed
/// within a part only.
///
/// Minimises Σ (w(z) (g(z) − ln E − ln t))² + λ² Σ (w(z) g″(z))² over g and the ln E of every
/// pixel and part (Eq. 3 and 4), with g = 0 at the middle code; the ln E are eliminated, which
/// leaves a system of 256 unknowns. Where noise makes g decrease, it is levelled.
pub fn recover(
    readings: &[Readings],
    parts: &[Vec<usize>],
    smoothness: f64,
) -> Result<Response, Undetermined> {
    let curves: Vec<Option<[f64; KNOTS]>> = (0..CHANNELS)
        .into_par_iter()
        .map(|channel| recover_channel(readings, parts, smoothness, channel))
        .collect();
    let mut knots = Box::new([[0.0; KNOTS]; CHANNELS]);
    for (knots, curve) in knots.iter_mut().zip(curves) {
        *knots = curve.ok_or(Undetermined)?;
    }
    Ok(Response::Curve(knots))
}

fn recover_channel(
    readings: &[Readings],
    parts: &[Vec<usize>],
    smoothness: f64,
    channel: usize,
) -> Option<[f64; KNOTS]> {
    let mut matrix = Mat::<f64>::zeros(KNOTS, KNOTS);
    let mut right = [0.0; KNOTS];
    let mut count = 0_usize;
    // (knot, share) pairs of one pixel's rows, summed over its exposures.
    let mut row: Vec<(usize, f64)> = Vec::new();
    for (series, parts) in std::iter::zip(readings, parts) {
        let ln_times: Vec<f64> = series.seconds.iter().map(|seconds| seconds.ln()).collect();
        let last = parts.iter().copied().max().unwrap_or(0);
        for pixel in series.pixels() {
            for part in 0..=last {
                let members = || {
                    (0..pixel.len()).filter_map(|j| {
                        let code = pixel[j][channel];
                        (parts[j] == part && !code.is_nan())
                            .then(|| (split(code), hat(code).powi(2), ln_times[j]))
                    })
                };
                let total: f64 = members().map(|(_, weight, _)| weight).sum();
                if members().count() < 2 || total <= 0.0 {
                    continue;
                }
                count += 1;
                let mean = members().map(|(_, weight, t)| weight * t).sum::<f64>() / total;
                row.clear();
                for ((low, share), weight, ln_time) in members() {
                    let ends = [(low, 1.0 - share), ((low + 1).min(KNOTS - 1), share)];
                    let ends = &ends[..if share > 0.0 { 2 } else { 1 }];
                    for &(i, a) in ends {
                        right[i] += weight * a * (ln_time - mean);
                        row.push((i, weight * a));
                        for &(k, b) in ends {
                            matrix[(i, k)] += weight * a * b;
                        }
                    }
                }
                for &(i, a) in &row {
                    for &(k, b) in &row {
                        matrix[(i, k)] -= a * b / total;
                    }
                }
            }
        }
    }
    if count == 0 {
        return None;
    }
    // So that the curve does not depend on how many pixels are looked at.
    let lambda2 = smoothness * smoothness * count as f64 / PIXELS_OF_SMOOTHNESS;
    for middle in 1..KNOTS - 1 {
        let weight = lambda2 * hat(middle as f32).powi(2);
        let second = [(middle - 1, 1.0), (middle, -2.0), (middle + 1, 1.0)];
        for (i, a) in second {
            for (k, b) in second {
                matrix[(i, k)] += weight * a * b;
            }
        }
    }
    // The scale: the middle code is an exposure of 1.
    let largest = (0..KNOTS).map(|i| matrix[(i, i)]).fold(0.0, f64::max);
    matrix[(MIDDLE, MIDDLE)] += largest;
    let factor = matrix.llt(Side::Lower).ok()?;
    let solution = factor.solve(Mat::from_fn(KNOTS, 1, |i, _| right[i]));
    let mut curve: [f64; KNOTS] = std::array::from_fn(|i| solution[(i, 0)]);
    if curve.iter().any(|value| !value.is_finite()) || curve[KNOTS - 1] <= curve[0] {
        return None;
    }
    level(&mut curve);
    let middle = curve[MIDDLE];
    curve.iter_mut().for_each(|value| *value -= middle);
    Some(curve)
}

/// The nearest curve, in least squares weighted as the data are, that does not decrease (pool
/// adjacent violators).
fn level(curve: &mut [f64; KNOTS]) {
    // Value, weight and length of each level stretch.
    let mut pools: Vec<(f64, f64, usize)> = Vec::with_capacity(KNOTS);
    for (code, &value) in curve.iter().enumerate() {
        let mut pool = (value, hat(code as f32), 1);
        while let Some(&(before, weight, length)) = pools.last()
            && before > pool.0
        {
            pools.pop();
            let total = weight + pool.1;
            pool = ((before * weight + pool.0 * pool.1) / total, total, length + pool.2);
        }
        pools.push(pool);
    }
    let levelled = pools.iter().flat_map(|&(value, _, length)| std::iter::repeat_n(value, length));
    for (value, levelled) in curve.iter_mut().zip(levelled) {
        *value = levelled;
    }
}

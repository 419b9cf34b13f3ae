//! The error of a solution against the truth of a test capture.
//!
//! Reflectances and light are determined together, so an estimate may be right but for a
//! factor; errors are therefore given raw, after one common scale, and after a scale for each
//! channel. A scale is the factor on the estimates that makes the mean absolute error of the
//! diffuse reflectances least, so that this error is never larger after a scale than before it.
//! Specular reflectances are multiplied by the same factor and do not enter it.

use serde::Serialize;

use crate::io::solution::Solution;
use crate::io::truth::Truth;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::study::pictures::PictureScore;

#[cfg(test)]
mod tests;

/// What `lobelia score` prints and writes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Of every material that could be compared.
    pub materials: Vec<MaterialScore>,
    /// `null` where no material could be compared.
    pub raw: Option<Errors>,
    /// After one factor on all estimates.
    pub common_scale: Option<ScaledErrors>,
    /// After a factor for each channel.
    pub channel_scale: Option<ScaledErrors>,
    /// How many true values lie in their intervals.
    pub intervals: Intervals,
    /// Materials that were not compared, and why.
    pub skipped: Vec<Skipped>,
    /// Of rendered pictures, where some were given.
    pub pictures: Vec<PictureScore>,
}

/// One material beside the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialScore {
    /// In the capture.
    pub name: String,
    /// In the truth.
    pub true_name: String,
    /// ρ_d.
    pub estimated_diffuse: Rgb,
    /// ρ_d.
    pub true_diffuse: Rgb,
    /// ρ_s; `null` where the material is solved as diffuse.
    pub estimated_specular: Option<Rgb>,
    /// Zero for a truly diffuse material.
    pub true_specular: Rgb,
    /// n.
    pub estimated_exponent: Option<f64>,
    /// Exponents that fit the photographs about as well.
    pub exponent_interval: Option<[f64; 2]>,
    /// n; `null` where the truth has none.
    pub true_exponent: Option<f64>,
    /// Whether each true value lies in its interval; `null` without an interval.
    pub diffuse_inside: [Option<bool>; CHANNELS],
    /// `null` also where no specular reflectance was estimated.
    pub specular_inside: [Option<bool>; CHANNELS],
    /// `null` also where the material truly is diffuse.
    pub exponent_inside: Option<bool>,
    /// How many samples the material has.
    pub samples: usize,
}

/// Absolute errors over materials and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Over materials and channels.
    pub mean_diffuse: f64,
    /// Over materials and channels.
    pub largest_diffuse: f64,
    /// Over the materials that were estimated, or are, specular; `null` without any.
    pub mean_specular: Option<f64>,
    /// Over the same.
    pub largest_specular: Option<f64>,
}

/// Errors after the estimates were multiplied by a factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScaledErrors {
    /// The factor on the estimates of each channel, diffuse and specular: the one that makes the
    /// mean absolute error of the diffuse reflectances least.
    pub scale: Rgb,
    /// Of the estimates times these factors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// How many true values lie in their 95 % intervals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Intervals {
    /// Of diffuse and specular reflectances, each channel counting.
    pub inside: usize,
    /// How many there are with an interval.
    pub of: usize,
    /// Estimated reflectances that have no interval.
    pub without: usize,
    /// Of the intervals of reflectances, without any scale; `null` without an interval.
    pub mean_half_width: Option<f64>,
    /// Of exponents.
    pub exponents_inside: usize,
    /// Exponents with an interval and a true value.
    pub exponents_of: usize,
}

/// A material that was not compared.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// In the capture.
    pub name: String,
    /// In words.
    pub reason: String,
}

/// Compares a solution with the truth, material by material.
pub fn compare(solution: &Solution, truth: &Truth) -> Score {
    let mut score = Score {
        materials: Vec::new(),
        raw: None,
        common_scale: None,
        channel_scale: None,
        intervals: Intervals::default(),
        skipped: Vec::new(),
        pictures: Vec::new(),
    };
    // Of every estimated value, where it has an interval.
    let mut widths: Vec<Option<f64>> = Vec::new();
    for material in &solution.materials {
        let mut skip = |reason: String| {
            score.skipped.push(Skipped { name: material.name.clone(), reason });
        };
        let Some(diffuse) = material.diffuse.filter(|_| material.samples > 0) else {
            skip("no photograph sees it".into());
            continue;
        };
        // Several surfaces may share one true material.
        let mut found: Vec<_> =
            material.surfaces.iter().filter_map(|surface| truth.of_surface(surface)).collect();
        found.dedup_by_key(|(name, _)| *name);
        let (true_name, true_material) = match found.as_slice() {
            [one] => *one,
            [] => {
                skip("the truth does not know its surfaces".into());
                continue;
            }
            several => {
                let names: Vec<&str> = several.iter().map(|(name, _)| *name).collect();
                skip(format!("its surfaces are of different materials: {}", names.join(", ")));
                continue;
            }
        };
        let true_specular = true_material.rho_s.unwrap_or([0.0; 3]);
        let diffuse_intervals = material.diffuse_interval.unwrap_or_default();
        widths.extend(diffuse_intervals.map(|interval| interval.map(half_width)));
        let specular_intervals =
            material.specular.and(material.specular_interval).unwrap_or_default();
        if material.specular.is_some() {
            widths.extend(specular_intervals.map(|interval| interval.map(half_width)));
        }
        score.materials.push(MaterialScore {
            name: material.name.clone(),
            true_name: true_name.to_owned(),
            estimated_diffuse: diffuse,
            true_diffuse: true_material.rho_d,
            estimated_specular: material.specular,
            true_specular,
            estimated_exponent: material.exponent,
            exponent_interval: material.exponent_interval,
            true_exponent: true_material.n,
            diffuse_inside: inside(diffuse_intervals, true_material.rho_d),
            specular_inside: inside(specular_intervals, true_specular),
            exponent_inside: material
                .exponent_interval
                .zip(true_material.n)
                .map(|(interval, truth)| contains(interval, truth)),
            samples: material.samples,
        });
    }
    score.intervals = count(&score.materials, &widths);
    let materials = &score.materials;
    score.raw = errors(materials, [1.0; 3]);
    let with = |scale: Rgb| errors(materials, scale).map(|errors| ScaledErrors { scale, errors });
    let all = 0..CHANNELS;
    score.common_scale = scale_of(materials, all.clone()).and_then(|scale| with([scale; CHANNELS]));
    let of_channel = |channel| scale_of(materials, channel..channel + 1);
    score.channel_scale = match [of_channel(0), of_channel(1), of_channel(2)] {
        [Some(r), Some(g), Some(b)] => with([r, g, b]),
        _ => None,
    };
    score
}

fn contains([low, high]: [f64; 2], truth: f64) -> bool {
    (low..=high).contains(&truth)
}

/// Mean half width of the intervals of all diffuse reflectances; `None` without any.
pub fn mean_half_width(solution: &Solution) -> Option<f64> {
    let intervals = solution.materials.iter().filter_map(|material| material.diffuse_interval);
    let widths = intervals.flatten().flatten().map(half_width);
    mean_and_largest(widths).map(|(mean, _)| mean)
}

fn half_width([low, high]: [f64; 2]) -> f64 {
    0.5 * (high - low)
}

fn inside(intervals: [Option<[f64; 2]>; CHANNELS], truth: Rgb) -> [Option<bool>; CHANNELS] {
    std::array::from_fn(|c| intervals[c].map(|interval| contains(interval, truth[c])))
}

fn count(materials: &[MaterialScore], widths: &[Option<f64>]) -> Intervals {
    let reflectances =
        materials.iter().flat_map(|m| m.diffuse_inside.iter().chain(&m.specular_inside)).flatten();
    let exponents = materials.iter().filter_map(|m| m.exponent_inside);
    Intervals {
        inside: reflectances.clone().filter(|inside| **inside).count(),
        of: reflectances.count(),
        without: widths.iter().filter(|width| width.is_none()).count(),
        mean_half_width: mean_and_largest(widths.iter().flatten().copied()).map(|(mean, _)| mean),
        exponents_inside: exponents.clone().filter(|inside| *inside).count(),
        exponents_of: exponents.count(),
    }
}

/// Estimated and true specular reflectance, where either is specular.
fn specular(material: &MaterialScore) -> Option<(Rgb, Rgb)> {
    let is_specular = material.estimated_specular.is_some_and(|values| values != [0.0; 3])
        || material.true_specular != [0.0; 3];
    is_specular.then(|| (material.estimated_specular.unwrap_or([0.0; 3]), material.true_specular))
}

fn scale_of(materials: &[MaterialScore], channels: std::ops::Range<usize>) -> Option<f64> {
    best_scale(materials.iter().flat_map(|material| {
        channels.clone().map(|c| (material.estimated_diffuse[c], material.true_diffuse[c]))
    }))
}

/// The factor s that makes Σ |s·estimated − true| over (estimated, true) values least: the median
/// of true/estimated, each weighted by its estimate. Of several such factors the one nearest to 1;
/// `None` where every estimate is zero.
pub(super) fn best_scale(values: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    // (true/estimated, estimated)
    let mut ratios: Vec<(f64, f64)> = values
        .filter(|(estimated, _)| *estimated > 0.0)
        .map(|(estimated, truth)| (truth / estimated, estimated))
        .collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * ratios.iter().map(|(_, weight)| weight).sum::<f64>();
    let median = |reversed: bool| {
        let mut sum = 0.0;
        let position = |k: usize| if reversed { ratios.len() - 1 - k } else { k };
        (0..ratios.len()).map(|k| ratios[position(k)]).find_map(|(ratio, weight)| {
            sum += weight;
            (sum >= half * (1.0 - ROUNDING)).then_some(ratio)
        })
    };
    // Where the weight is halved between two ratios, every factor from one to the other is as good.
    let (low, high) = (median(false)?, median(true)?);
    Some(1.0_f64.clamp(low, high.max(low)))
}

/// Relative error of a sum of weights that is taken to be half of them.
const ROUNDING: f64 = 1e-12;

fn errors(materials: &[MaterialScore], scale: Rgb) -> Option<Errors> {
    let difference = |(estimated, truth): (Rgb, Rgb)| {
        (0..CHANNELS)
            .map(move |channel| (scale[channel] * estimated[channel] - truth[channel]).abs())
    };
    let diffuse = materials
        .iter()
        .flat_map(|material| difference((material.estimated_diffuse, material.true_diffuse)));
    let (mean_diffuse, largest_diffuse) = mean_and_largest(diffuse)?;
    let specular = mean_and_largest(materials.iter().filter_map(specular).flat_map(difference));
    Some(Errors {
        mean_diffuse,
        largest_diffuse,
        mean_specular: specular.map(|(mean, _)| mean),
        largest_specular: specular.map(|(_, largest)| largest),
    })
}

fn mean_and_largest(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (mut sum, mut largest, mut count) = (0.0, 0.0_f64, 0);
    for value in values {
        sum += value;
        largest = largest.max(value);
        count += 1;
    }
    (count > 0).then(|| (sum / f64::from(count), largest))
}

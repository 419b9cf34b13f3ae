//! How far a solution is from the truth of a test capture.
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

/// What `lobelia score` prints and writes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    pub materials: Vec<MaterialScore>,
    /// `null` where no material could be compared.
    pub raw: Option<Errors>,
    pub common_scale: Option<ScaledErrors>,
    pub channel_scale: Option<ScaledErrors>,
    pub intervals: Intervals,
    /// Materials that were not compared, and why.
    pub skipped: Vec<Skipped>,
    /// Of rendered pictures, where some were given.
    pub pictures: Vec<PictureScore>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialScore {
    pub name: String,
    pub true_name: String,
    pub estimated_diffuse: Rgb,
    pub true_diffuse: Rgb,
    pub estimated_specular: Option<Rgb>,
    /// Zero for a truly diffuse material.
    pub true_specular: Rgb,
    pub estimated_exponent: Option<f64>,
    pub exponent_interval: Option<[f64; 2]>,
    pub true_exponent: Option<f64>,
    /// Whether each true value lies in its interval; `null` without an interval.
    pub diffuse_inside: [Option<bool>; CHANNELS],
    /// `null` also where no specular reflectance was estimated.
    pub specular_inside: [Option<bool>; CHANNELS],
    /// `null` also where the material truly is diffuse.
    pub exponent_inside: Option<bool>,
    pub samples: usize,
}

/// Absolute errors over materials and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    pub mean_diffuse: f64,
    pub largest_diffuse: f64,
    /// Over the materials that were estimated, or are, specular; `null` without any.
    pub mean_specular: Option<f64>,
    pub largest_specular: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScaledErrors {
    /// The factor on the estimates of each channel, diffuse and specular: the one that makes the
    /// mean absolute error of the diffuse reflectances least.
    pub scale: Rgb,
    #[serde(flatten)]
    pub errors: Errors,
}

/// How many true values lie in their 95 % intervals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Intervals {
    /// Of diffuse and specular reflectances, each channel counting.
    pub inside: usize,
    pub of: usize,
    /// Estimated reflectances that have no interval.
    pub without: usize,
    /// Of the intervals of reflectances, without any scale; `null` without an interval.
    pub mean_half_width: Option<f64>,
    pub exponents_inside: usize,
    pub exponents_of: usize,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    pub name: String,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::solution::Material;
    use crate::io::truth::TrueMaterial;
    use crate::math::sampling::Random;

    fn material(name: &str, surfaces: &[&str], diffuse: Option<Rgb>) -> Material {
        Material {
            name: name.into(),
            kind: "diffuse".into(),
            surfaces: surfaces.iter().map(|surface| surface.to_string()).collect(),
            diffuse,
            samples: diffuse.map_or(0, |_| 10),
            ..Default::default()
        }
    }

    fn truth() -> Truth {
        let groups = [("a", "wall"), ("b", "wall"), ("c", "floor")];
        let materials = [("wall", [0.2, 0.4, 0.6]), ("floor", [0.4, 0.4, 0.4])];
        Truth {
            groups: groups.map(|(surface, name)| (surface.into(), name.into())).into(),
            materials: materials
                .map(|(name, rho_d)| (name.into(), TrueMaterial { rho_d, ..Default::default() }))
                .into(),
        }
    }

    #[test]
    fn a_scale_is_found_and_taken_out() {
        let mut solution = Solution::new("paper");
        // Twice too bright in red, right in green, half in blue.
        let mut walls = material("walls", &["a", "b"], Some([0.4, 0.4, 0.3]));
        walls.diffuse_interval = Some([Some([0.1, 0.3]), Some([0.3, 0.5]), Some([0.7, 0.8])]);
        solution.materials =
            vec![walls, material("floor", &["c"], Some([0.8, 0.4, 0.2])), material("x", &[], None)];
        let score = compare(&solution, &truth());
        let raw = score.raw.unwrap();
        assert!((raw.mean_diffuse - 1.1 / 6.0).abs() < 1e-12);
        assert!((raw.largest_diffuse - 0.4).abs() < 1e-12 && raw.mean_specular.is_none());
        // Ratios below 1 have 1.2 of the weight of 2.5, those above it 0.5.
        assert_eq!(score.common_scale.unwrap().scale, [1.0; 3]);
        let channels = score.channel_scale.unwrap();
        for (scale, expected) in std::iter::zip(channels.scale, [0.5, 1.0, 2.0]) {
            assert!((scale - expected).abs() < 1e-12);
        }
        assert!(channels.errors.largest_diffuse < 1e-12);
        assert_eq!(
            (score.intervals.inside, score.intervals.of, score.intervals.without),
            (2, 3, 3)
        );
        assert_eq!(score.skipped[0].reason, "no photograph sees it");
    }

    #[test]
    fn specular_values_do_not_enter_the_scale() {
        let mut solution = Solution::new("joint");
        // Diffuse right but for one value, specular ten times too dim.
        let mut walls = material("walls", &["a"], Some([0.2, 0.4, 0.63]));
        walls.specular = Some([0.01; 3]);
        solution.materials = vec![walls, material("floor", &["c"], Some([0.4; 3]))];
        let mut truth = truth();
        truth.materials.get_mut("wall").unwrap().rho_s = Some([0.1; 3]);
        let score = compare(&solution, &truth);
        let raw = score.raw.unwrap().mean_diffuse;
        assert!((raw - 0.03 / 6.0).abs() < 1e-12);
        let common = score.common_scale.unwrap();
        assert_eq!((common.scale, common.errors.mean_diffuse), ([1.0; 3], raw));
        assert_eq!(common.errors.mean_specular, score.raw.unwrap().mean_specular);
    }

    #[test]
    fn no_scale_makes_the_mean_error_larger() {
        let mut random = Random::new(1, 0, 0);
        for _ in 0..200 {
            let mut solution = Solution::new("joint");
            let mut truth = truth();
            let mut triple = || [0.0; 3].map(|_: f64| f64::from(random.uniform()));
            let surfaces = [("wall", "a"), ("floor", "c")];
            solution.materials = surfaces
                .map(|(name, surface)| {
                    let true_material = truth.materials.get_mut(name).unwrap();
                    (true_material.rho_d, true_material.rho_s) = (triple(), Some(triple()));
                    let specular = Some(triple());
                    Material { specular, ..material(name, &[surface], Some(triple())) }
                })
                .into();
            let score = compare(&solution, &truth);
            let raw = score.raw.unwrap().mean_diffuse;
            let one = score.common_scale.unwrap();
            let three = score.channel_scale.unwrap();
            assert!(one.errors.mean_diffuse <= raw + 1e-12);
            assert!(three.errors.mean_diffuse <= one.errors.mean_diffuse + 1e-12);
            // The least, since no factor nearby is better.
            for factor in [0.99, 1.01] {
                let other = errors(&score.materials, one.scale.map(|s| factor * s)).unwrap();
                assert!(other.mean_diffuse >= one.errors.mean_diffuse - 1e-12);
            }
        }
    }

    #[test]
    fn of_factors_that_are_as_good_the_one_nearest_to_1_is_taken() {
        let mut solution = Solution::new("joint");
        // Ratios of 0.5 and 2 with the same weight.
        solution.materials = vec![
            material("walls", &["a"], Some([0.4; 3])),
            material("floor", &["c"], Some([0.4; 3])),
        ];
        let mut truth = truth();
        truth.materials.get_mut("wall").unwrap().rho_d = [0.2; 3];
        truth.materials.get_mut("floor").unwrap().rho_d = [0.8; 3];
        let scale = |truth: &Truth| compare(&solution, truth).common_scale.unwrap().scale[0];
        assert_eq!(scale(&truth), 1.0);
        truth.materials.get_mut("wall").unwrap().rho_d = [0.6; 3];
        assert!((scale(&truth) - 1.5).abs() < 1e-12);
        // A material that truly is black has a ratio of 0.
        truth.materials.get_mut("wall").unwrap().rho_d = [0.0; 3];
        assert_eq!(scale(&truth), 1.0);
    }

    #[test]
    fn intervals_count_where_there_are_any() {
        let mut solution = Solution::new("joint");
        let mut walls = material("walls", &["a"], Some([0.4; 3]));
        walls.diffuse_interval = Some([Some([0.1, 0.3]), None, Some([0.7, 0.8])]);
        walls.specular = Some([0.1; 3]);
        walls.specular_interval = Some([Some([0.0, 0.4]), Some([0.02, 0.08]), None]);
        walls.exponent_interval = Some([30.0, 52.0]);
        let mut floor = material("floor", &["c"], Some([0.4; 3]));
        // No specular reflectance was estimated, so there is nothing to be inside of it.
        floor.specular_interval = Some([Some([0.0, 1.0]); 3]);
        floor.exponent_interval = Some([1.0, 9.0]);
        // Not compared, so its intervals do not count.
        let mut unknown = material("unknown", &["z"], Some([0.4; 3]));
        unknown.diffuse_interval = Some([Some([0.0, 1.0]); 3]);
        solution.materials = vec![walls, floor, unknown];
        let mut truth = truth();
        truth.materials.get_mut("wall").unwrap().rho_s = Some([0.05, 0.09, 0.05]);
        truth.materials.get_mut("wall").unwrap().n = Some(52.5);

        let score = compare(&solution, &truth);
        assert_eq!(score.materials[0].diffuse_inside, [Some(true), None, Some(false)]);
        assert_eq!(score.materials[0].specular_inside, [Some(true), Some(false), None]);
        assert_eq!(score.materials[0].exponent_inside, Some(false));
        assert_eq!(score.materials[1].specular_inside, [None; 3]);
        // The floor truly has no exponent.
        assert_eq!(score.materials[1].exponent_inside, None);
        let intervals = score.intervals;
        assert_eq!((intervals.inside, intervals.of, intervals.without), (2, 4, 5));
        let mean = (0.1 + 0.05 + 0.2 + 0.03) / 4.0;
        assert!((intervals.mean_half_width.unwrap() - mean).abs() < 1e-12);
        assert_eq!((intervals.exponents_inside, intervals.exponents_of), (0, 1));

        truth.materials.get_mut("wall").unwrap().n = Some(30.0);
        assert_eq!(compare(&solution, &truth).intervals.exponents_inside, 1);
    }

    #[test]
    fn mixed_and_unknown_surfaces_are_not_compared() {
        let mut solution = Solution::new("paper");
        solution.materials = vec![
            material("mixed", &["a", "c"], Some([0.5; 3])),
            material("unknown", &["z"], Some([0.5; 3])),
        ];
        let score = compare(&solution, &truth());
        assert_eq!((score.materials.len(), score.skipped.len(), score.raw), (0, 2, None));
    }
}

//! How far a solution is from the truth of a test capture.
//!
//! Reflectances and light are determined together, so an estimate may be right but for a
//! factor; errors are therefore given raw, after one common scale, and after a scale for each
//! channel. A scale is the geometric mean of true/estimated: the factor that makes the sum of
//! squared logarithmic errors least. It is taken over all diffuse and specular values that are
//! above zero in both.

use serde::Serialize;

use crate::io::solution::Solution;
use crate::io::truth::Truth;
use crate::math::rgb::{CHANNELS, Rgb};

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
    pub true_exponent: Option<f64>,
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
    /// The factor on the estimates of each channel.
    pub scale: Rgb,
    #[serde(flatten)]
    pub errors: Errors,
}

/// How many true values lie in their 95 % intervals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Intervals {
    pub inside: usize,
    pub of: usize,
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
    };
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
        count_inside(&mut score.intervals, material.diffuse_interval, true_material.rho_d);
        count_inside(&mut score.intervals, material.specular_interval, true_specular);
        score.materials.push(MaterialScore {
            name: material.name.clone(),
            true_name: true_name.to_owned(),
            estimated_diffuse: diffuse,
            true_diffuse: true_material.rho_d,
            estimated_specular: material.specular,
            true_specular,
            estimated_exponent: material.exponent,
            true_exponent: true_material.n,
            samples: material.samples,
        });
    }
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

fn count_inside(count: &mut Intervals, intervals: Option<[[f64; 2]; 3]>, truth: Rgb) {
    for ([low, high], value) in std::iter::zip(intervals.into_iter().flatten(), truth) {
        count.of += 1;
        count.inside += usize::from((low..=high).contains(&value));
    }
}

/// Estimated and true specular reflectance, where either is specular.
fn specular(material: &MaterialScore) -> Option<(Rgb, Rgb)> {
    let is_specular = material.estimated_specular.is_some_and(|values| values != [0.0; 3])
        || material.true_specular != [0.0; 3];
    is_specular.then(|| (material.estimated_specular.unwrap_or([0.0; 3]), material.true_specular))
}

/// The geometric mean of true/estimated; `None` without a value above zero in both.
fn scale_of(materials: &[MaterialScore], channels: std::ops::Range<usize>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for material in materials {
        let diffuse = (material.estimated_diffuse, material.true_diffuse);
        for (estimated, truth) in std::iter::once(diffuse).chain(specular(material)) {
            for channel in channels.clone() {
                if estimated[channel] > 0.0 && truth[channel] > 0.0 {
                    sum += (truth[channel] / estimated[channel]).ln();
                    count += 1;
                }
            }
        }
    }
    (count > 0).then(|| (sum / f64::from(count)).exp())
}

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
        walls.diffuse_interval = Some([[0.1, 0.3], [0.3, 0.5], [0.7, 0.8]]);
        solution.materials =
            vec![walls, material("floor", &["c"], Some([0.8, 0.4, 0.2])), material("x", &[], None)];
        let score = compare(&solution, &truth());
        let raw = score.raw.unwrap();
        assert!((raw.mean_diffuse - 1.1 / 6.0).abs() < 1e-12);
        assert!((raw.largest_diffuse - 0.4).abs() < 1e-12 && raw.mean_specular.is_none());
        // The logarithms cancel, so one common scale is 1.
        assert!((score.common_scale.unwrap().scale[0] - 1.0).abs() < 1e-12);
        let channels = score.channel_scale.unwrap();
        for (scale, expected) in std::iter::zip(channels.scale, [0.5, 1.0, 2.0]) {
            assert!((scale - expected).abs() < 1e-12);
        }
        assert!(channels.errors.largest_diffuse < 1e-12);
        assert_eq!(score.intervals, Intervals { inside: 2, of: 3 });
        assert_eq!(score.skipped[0].reason, "no photograph sees it");
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

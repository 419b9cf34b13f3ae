//! The uncertainty of the reflectances: which are determined by the photographs, and intervals.
//!
//! Residuals are not independent: errors of the light model are alike for neighbours, and intervals
//! from independent errors contain a third as many true values as they should. The variance of a
//! reflectance is the sum of four, times a factor for errors that are in none of them: of a factor
//! common to all reflectances, of its own value with the light and all others free, between light
//! sets, and of light that is wrong alike over its whole surface.

use faer::linalg::matmul::matmul;
use faer::prelude::*;
use faer::{Accum, Mat, Par, Side};

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::joint::average::Posterior;
use crate::reconstruct::joint::fit::Fitted;
use crate::reconstruct::joint::gloss::Sharpness;
use crate::reconstruct::joint::hessian::gram;
use crate::reconstruct::joint::linearised::linearise;
use crate::reconstruct::joint::options::JointOptions;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::solution::{Certainty, MaterialCertainty, ScaleCertainty};
use crate::scene::Gloss;

/// 0.975 quantile of the normal distribution.
const QUANTILE: f64 = 1.96;
/// Standard deviation of a log reflectance above which there is a warning: a factor of 1.5 either
/// way at 95 %.
const WARN_SD: f64 = 0.2;
/// A column is independent if at least this fraction of its square remains after projection.
const INDEPENDENT: f64 = 1e-10;

/// The error of the light model, as far as it affects reflectances, over the size of the residuals:
/// up to 2.8 on the captures that set constants, with a standard deviation of 1.5.
const MODEL_ERROR: f64 = 1.5;

/// An error of the light has a part that varies over a surface, which residuals show, and a part
/// that is constant over it, which goes into the reflectance. The standard deviation of the latter
/// is taken as this fraction of the former: 0.4 to 0.8 was found on large, outdoor-open,
/// corner-glossy, kitchen-full and kitchen-coarse, 0.3 to 0.5 elsewhere.
const WHOLE_SURFACE: f64 = 0.5;

/// The variance of a log ρ_d is this many times the sum of the four variances: errors that all
/// light sets have in common, such as which lamps were chosen, are in none of these. Set on the
/// random captures 4 to 7 of every kind (`assets/study/random`), where the intervals then contain
/// 96 % of 861 true values, and 89 % without it; on captures 0 to 3, which only test, 97 % of 792,
/// and 92 % without it. It is not applied to ρ_s: no capture there shows how wrong its intervals
/// are.
const UNDERSTATED: f64 = 1.9;

/// Variance of a row's residual per channel, as far as a factor common to all reflectances is
/// concerned, for rows of weight 1. Errors of the light model are shared by all materials: they do
/// not average out over them as independent ones would.
pub fn row_noise(problem: &Problem, fitted: &Fitted) -> Rgb {
    let count = effective_count(&problem.shares(&problem.measured()));
    problem.mean_square(fitted).map(|square| count * MODEL_ERROR.powi(2) * square)
}

/// Number of materials with equal shares whose mean would be as certain as with these shares.
fn effective_count(shares: &[f64]) -> f64 {
    let squares: f64 = shares.iter().map(|share| share * share).sum();
    if squares > 0.0 { squares.recip() } else { 0.0 }
}

/// The information of one channel's rows on the reflectances, with the light free.
struct Determined {
    /// Materials of unknown ρ_d, ascending.
    unknown: Vec<usize>,
    /// Their shares of the area of all of them.
    shares: Vec<f64>,
    /// JᵀJ over their log ρ_d, the rest projected out; `None` without such materials, or where the
    /// rest depends on itself.
    diffuse: Option<Mat<f64>>,
    /// Variance of ρ_s of glossy materials, for rows of noise 1.
    specular: Vec<Option<f64>>,
    /// Smallest singular value over all measured materials, the light projected out and known
    /// reflectances taken for unknown.
    singular_value: f64,
}

/// Variances of the reflectances of one channel, for rows of noise 1.
struct Variances {
    /// Of every material's log ρ_d; `None` where it is known.
    log_diffuse: Vec<Option<f64>>,
    /// Of a factor common to all unknown ρ_d, by area. Its errors are shared by all materials, so
    /// this is as many times the variance of a mean of independent errors as there are materials.
    common: f64,
    /// Of the mean of all unknown log ρ_d.
    level: f64,
}

/// Intervals, identified values and warnings. `rows` have the noise of the problem's priors.
pub fn assess(
    problem: &Problem,
    fitted: &Fitted,
    posterior: &Posterior,
    light_sets: usize,
    sharpness: &[Sharpness],
    held_out: Option<Rgb>,
) -> (Certainty, Vec<String>) {
    let priors = &problem.priors;
    let mut certainty = Certainty {
        materials: priors.measured.iter().map(|&m| m.then(MaterialCertainty::default)).collect(),
        scale: ScaleCertainty {
            log_rms: problem.mean_square(fitted).map(f64::sqrt),
            ..Default::default()
        },
        held_out,
        light_sets,
        selection: None,
    };
    let mut open: Vec<Vec<usize>> = vec![Vec::new(); problem.materials()];
    let of_blocks: Vec<Rgb> =
        (0..problem.materials()).map(|m| problem.mean_square_of_blocks(fitted, m)).collect();
    let determined: [Determined; CHANNELS] =
        std::array::from_fn(|channel| Determined::of(problem, fitted, channel));
    let noise = certainty.scale.log_rms.map(|rms| (MODEL_ERROR * rms).powi(2));
    // A reflectance that is known with a standard deviation counts like rows.
    let pins: [Vec<(usize, f64)>; CHANNELS] = std::array::from_fn(|c| {
        let weight = |(material, _, variance)| (material, UNDERSTATED * noise[c] / variance);
        priors.pins_of(c).map(weight).collect()
    });
    let from_rows: [Variances; CHANNELS] =
        std::array::from_fn(|c| determined[c].variances(0.0, &pins[c]));
    let levels: Rgb = std::array::from_fn(|c| UNDERSTATED * noise[c] * from_rows[c].level);
    for channel in 0..CHANNELS {
        let (noise, from_rows) = (noise[channel], &from_rows[channel]);
        let prior = if priors.has_pin() {
            0.0
        } else {
            UNDERSTATED * noise / prior_variance(problem.options(), &levels, channel)
        };
        let with_prior = determined[channel].variances(prior, &pins[channel]);
        certainty.scale.singular_value[channel] = determined[channel].singular_value;
        certainty.scale.log_sd[channel] =
            if priors.has_pin() { 0.0 } else { (UNDERSTATED * noise * from_rows.common).sqrt() };
        for (material, (entry, of_blocks)) in
            certainty.materials.iter_mut().zip(&of_blocks).enumerate()
        {
            let Some(entry) = entry else { continue };
            let log = posterior.log_diffuse[channel][material];
            let Some(own) = from_rows.log_diffuse[material] else {
                entry.identified[channel] = true;
                entry.diffuse[channel] = (light_sets > 1).then_some([log.exp(); 2]);
                continue;
            };
            let whole = WHOLE_SURFACE.powi(2) * of_blocks[channel];
            let between = posterior.log_diffuse_variance[channel][material];
            let sum = |common: f64, own: f64| noise * (common + own) + between + whole;
            let by_rows = sum(from_rows.common, own);
            // Above that the weak prior, weighed by the same noise, is more certain
            //            than the rows.
            entry.identified[channel] = by_rows.sqrt() < problem.options().prior_sd;
            if (UNDERSTATED * by_rows).sqrt() > WARN_SD {
                open[material].push(channel);
            }
            if light_sets < 2 {
                continue;
            }
            let own = with_prior.log_diffuse[material].unwrap_or(own);
            let variance = UNDERSTATED * sum(with_prior.common, own);
            entry.diffuse[channel] = Some(interval(log, variance.sqrt()));
            let specular = determined[channel].specular[material];
            if let Some(own) = specular.filter(|_| entry.identified[channel]) {
                let value = posterior.specular[channel][material];
                let sd = (noise * own + posterior.specular_variance[channel][material]).sqrt();
                entry.specular[channel] =
                    Some([(value - QUANTILE * sd).max(0.0), (value + QUANTILE * sd).min(1.0)]);
            }
        }
    }
    for found in sharpness {
        if let Some(entry) = certainty.materials[found.material].as_mut() {
            match found.range {
                [Gloss::Coat { roughness: most }, Gloss::Coat { roughness: least }] => {
                    entry.roughness = Some([least, most]);
                }
                range => entry.exponent = Some(range.map(Gloss::exponent)),
            }
        }
    }
    let mut warnings = undetermined(problem, &open);
    if light_sets < 2 {
        warnings.push(
            "only one set of lights was tried, so there are no intervals: set joint.light_sets \
             to 6 for them"
                .to_owned(),
        );
    }
    (certainty, warnings)
}

/// Variance of the weak prior on a channel's mean log ρ_d, given the means of the other channels
/// from their rows (`levels`: variances): the mean is a + b, with a common to all channels (see
/// [`fit_with_scale_prior`](crate::reconstruct::joint::fit::fit_with_scale_prior)).
fn prior_variance(options: &JointOptions, levels: &Rgb, channel: usize) -> f64 {
    let own = options.channel_tie.powi(2);
    let others = (0..CHANNELS).filter(|other| *other != channel);
    let told: f64 = others.map(|other| (own + levels[other]).recip()).sum();
    own + (options.prior_sd.powi(-2) + told).recip()
}

/// One warning for all materials that are undetermined in the same channels.
fn undetermined(problem: &Problem, open: &[Vec<usize>]) -> Vec<String> {
    let measured = problem.priors.measured.iter().filter(|measured| **measured).count();
    let mut told: Vec<&[usize]> = Vec::new();
    let mut warnings = Vec::new();
    for channels in open.iter().filter(|channels| !channels.is_empty()) {
        if told.contains(&channels.as_slice()) {
            continue;
        }
        told.push(channels);
        let names: Vec<&str> = (0..open.len())
            .filter(|&material| open[material] == *channels)
            .map(|material| problem.capture().materials[material].name.as_str())
            .collect();
        let what = if names.len() == measured {
            "the overall brightness of the reflectances".to_owned()
        } else {
            format!("the brightness of {}", listed(&names))
        };
        let channels: Vec<&str> =
            channels.iter().map(|&channel| ["red", "green", "blue"][channel]).collect();
        warnings.push(format!(
            "{what} is hardly determined by these photographs in the {} channel{}: give one \
             material its known_diffuse in tags.json",
            listed(&channels),
            if channels.len() > 1 { "s" } else { "" },
        ));
    }
    warnings
}

fn interval(log: f64, sd: f64) -> [f64; 2] {
    [(log - QUANTILE * sd).exp(), (log + QUANTILE * sd).exp().min(1.0)]
}

pub(super) fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

impl Determined {
    fn of(problem: &Problem, fitted: &Fitted, channel: usize) -> Self {
        let materials = problem.materials();
        let normal = linearise(problem, fitted, channel);
        let products = gram(&normal.jacobian);
        let lit = normal.lit.len();
        let all = problem.measured();
        let known = &problem.priors.known[channel];
        let unknown: Vec<usize> = all.iter().copied().filter(|&m| known[m].is_none()).collect();
        let glossy: Vec<usize> = (0..materials)
            .filter(|&m| {
                let index = lit + materials + m;
                let is_unknown = matches!(fitted.model.gloss[m], Some(Gloss::Phong { .. }));
                is_unknown && products[(index, index)] > 0.0
            })
            .collect();
        let light: Vec<usize> = (0..lit).filter(|&j| products[(j, j)] > 0.0).collect();
        let specular: Vec<usize> = glossy.iter().map(|m| lit + materials + m).collect();
        let diffuse = |of: &[usize]| of.iter().map(|m| lit + m).collect::<Vec<_>>();

        let free: Vec<usize> = light.iter().chain(&specular).copied().collect();
        let mut singular_value = 0.0;
        if let Some(schur) = schur(&products, &diffuse(&all), &free)
            && let Ok(eigen) = schur.self_adjoint_eigen(Side::Lower)
        {
            // Ascending.
            singular_value = eigen.S()[0].max(0.0).sqrt();
        }
        let mut of_specular: Vec<Option<f64>> =
            (0..materials).map(|m| glossy.contains(&m).then_some(f64::INFINITY)).collect();
        let beside: Vec<usize> = light.iter().copied().chain(diffuse(&unknown)).collect();
        let left = schur(&products, &specular, &beside);
        if let Some(variance) = left.and_then(|left| inverse(&left)) {
            for (place, &material) in glossy.iter().enumerate() {
                of_specular[material] = Some(variance[(place, place)]);
            }
        }
        Self {
            diffuse: schur(&products, &diffuse(&unknown), &free),
            shares: problem.shares(&unknown),
            unknown,
            specular: of_specular,
            singular_value,
        }
    }

    /// Variances with a prior of this weight on the mean of all unknown log ρ_d, and with reflectances
    /// that are known: material and weight.
    fn variances(&self, prior: f64, pins: &[(usize, f64)]) -> Variances {
        let count = self.unknown.len();
        let mut found = Variances {
            log_diffuse: self.specular.iter().map(|_| None).collect(),
            common: if count == 0 { 0.0 } else { f64::INFINITY },
            level: f64::INFINITY,
        };
        for &material in &self.unknown {
            found.log_diffuse[material] = Some(f64::INFINITY);
        }
        let Some(variance) = self.diffuse.as_ref().and_then(|diffuse| {
            let share = prior / (count * count) as f64;
            let mut precision = Mat::from_fn(count, count, |i, j| diffuse[(i, j)] + share);
            for (material, weight) in pins {
                if let Ok(place) = self.unknown.binary_search(material) {
                    precision[(place, place)] += weight;
                }
            }
            inverse(&precision)
        }) else {
            return found;
        };
        for (place, &material) in self.unknown.iter().enumerate() {
            found.log_diffuse[material] = Some(variance[(place, place)]);
        }
        let of_mean = |shares: &[f64]| -> f64 {
            let pairs = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
            pairs.map(|(i, j)| shares[i] * shares[j] * variance[(i, j)]).sum()
        };
        found.common = effective_count(&self.shares) * of_mean(&self.shares);
        found.level = of_mean(&vec![1.0 / count as f64; count]);
        found
    }
}

/// The Schur complement of JᵀJ over some unknowns, with the others free; `None` without unknowns,
/// or if the others depend on each other.
fn schur(products: &Mat<f64>, inner: &[usize], outer: &[usize]) -> Option<Mat<f64>> {
    if inner.is_empty() {
        return None;
    }
    let block = |rows: &[usize], columns: &[usize]| {
        Mat::from_fn(rows.len(), columns.len(), |i, j| products[(rows[i], columns[j])])
    };
    let mut schur = block(inner, inner);
    if !outer.is_empty() {
        let mut light = block(outer, outer);
        for j in 0..outer.len() {
            light[(j, j)] *= 1.0 + INDEPENDENT;
        }
        let mixed = block(outer, inner);
        let solved = light.llt(Side::Lower).ok()?.solve(&mixed);
        matmul(schur.as_mut(), Accum::Add, mixed.transpose(), &solved, -1.0, Par::Seq);
    }
    Some(schur)
}

/// The inverse; undetermined unknowns get an infinite variance.
fn inverse(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    let count = matrix.ncols();
    let eigen = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    let (values, vectors) = (eigen.S(), eigen.U());
    let least = INDEPENDENT * values[count - 1].max(f64::MIN_POSITIVE);
    Some(Mat::from_fn(count, count, |i, j| {
        (0..count).map(|k| vectors[(i, k)] * vectors[(j, k)] / values[k].max(least)).sum()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest eigenvalue of all was once every material's own: one dark pane took the
    /// intervals of all others.
    #[test]
    fn what_is_open_of_one_material_leaves_the_others_determined() {
        let mut products = Mat::<f64>::identity(4, 4) * Scale(400.0);
        // The light, which the pane alone depends on.
        for (i, j) in [(0, 3), (3, 0)] {
            products[(i, j)] = 400.0;
        }
        let left = schur(&products, &[1, 2, 3], &[0]).unwrap();
        let variance = inverse(&left).unwrap();
        assert!((variance[(0, 0)] - 1.0 / 400.0).abs() < 1e-9);
        assert!((variance[(1, 1)] - 1.0 / 400.0).abs() < 1e-9);
        assert!(variance[(2, 2)] > 1e4, "{}", variance[(2, 2)]);
    }

    #[test]
    fn a_prior_on_the_mean_bounds_what_no_row_determines() {
        // Rows say the ratio of two reflectances with variance 2/100 and nothing of their mean; the
        // prior says the mean with variance 0.25. Each is the mean, plus or minus half the ratio.
        let determined = Determined {
            unknown: vec![1, 2],
            shares: vec![0.5, 0.5],
            diffuse: Some(Mat::from_fn(2, 2, |i, j| if i == j { 50.0 } else { -50.0 })),
            specular: vec![None; 3],
            singular_value: 0.0,
        };
        let found = determined.variances(4.0, &[]);
        assert_eq!(found.log_diffuse[0], None);
        let expected = 0.25 + 0.02 / 4.0;
        assert!((found.log_diffuse[1].unwrap() - expected).abs() < 1e-9, "{:?}", found.log_diffuse);
        assert!((found.level - 0.25).abs() < 1e-9, "{}", found.level);
        assert!((found.common - 2.0 * 0.25).abs() < 1e-9, "{}", found.common);
        assert!(determined.variances(0.0, &[]).level > 1e6);
        // Known to a variance of 0.01, the first determines the second as well as their ratio does.
        let pinned = determined.variances(0.0, &[(1, 100.0)]);
        assert!((pinned.log_diffuse[1].unwrap() - 0.01).abs() < 1e-9);
        assert!((pinned.log_diffuse[2].unwrap() - (0.01 + 0.02)).abs() < 1e-9);
    }

    #[test]
    fn channels_that_are_determined_narrow_the_prior_of_the_others() {
        let options = JointOptions { prior_sd: 0.3, channel_tie: 0.4, ..JointOptions::default() };
        let alone = prior_variance(&options, &[f64::INFINITY; CHANNELS], 1);
        assert!((alone - 0.25).abs() < 1e-12);
        // By hand: a normal of variance 0.09 seen twice with error 0.16, then b of variance 0.16.
        let beside = prior_variance(&options, &[0.0, f64::INFINITY, 0.0], 1);
        assert!((beside - (0.16 + 1.0 / (1.0 / 0.09 + 2.0 / 0.16))).abs() < 1e-12);
    }

    #[test]
    fn light_that_follows_freely_takes_what_it_shares() {
        // Two unknowns that share a light: by hand, S = [[2, −1], [−1, 2]] and S⁻¹ = [[2, 1], [1, 2]]/3.
        let products = Mat::from_fn(3, 3, |i, j| match (i.min(j), i.max(j)) {
            (0, 0) => 1.0,
            (0, _) => 1.0,
            (a, b) if a == b => 3.0,
            _ => 0.0,
        });
        let left = schur(&products, &[1, 2], &[0]).unwrap();
        let variance = inverse(&left).unwrap();
        for (at, expected) in [((0, 0), 2.0 / 3.0), ((0, 1), 1.0 / 3.0), ((1, 1), 2.0 / 3.0)] {
            assert!((variance[at] - expected).abs() < 1e-8, "{at:?}: {}", variance[at]);
        }
    }
}

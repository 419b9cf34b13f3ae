//! How far the reflectances can be trusted: what the photographs determine, and intervals.
//!
//! Nothing of this comes from residuals that are taken to be independent: the error is the light
//! model's, alike for neighbours, and intervals from independent errors cover a third of what
//! they promise. Errors are summed in blocks of samples (within one light set), and added to the
//! spread between light sets and to the error of the common scale.

use faer::linalg::matmul::matmul;
use faer::prelude::*;
use faer::{Accum, Mat, Par, Side};

use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::joint::fit::{Fits, Fitter, SCALE_ERROR};
use crate::reconstruct::joint::gloss::Exponents;
use crate::reconstruct::joint::held_out;
use crate::reconstruct::joint::hessian::gram;
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::system::Normal;
use crate::reconstruct::solution::{Certainty, MaterialCertainty, ScaleCertainty};

/// Reflectances of one light set.
#[derive(Clone, Debug)]
pub struct Member {
    /// log ρ_d, per channel and material.
    pub log_diffuse: [Vec<f64>; CHANNELS],
    /// ρ_s.
    pub specular: [Vec<f64>; CHANNELS],
}

impl Member {
    pub fn of(fits: &Fits) -> Self {
        Self {
            log_diffuse: std::array::from_fn(|c| fits[c].state.log_diffuse.clone()),
            specular: std::array::from_fn(|c| fits[c].state.specular.clone()),
        }
    }

    pub fn mean(members: &[Self]) -> Self {
        let mean = |of: &dyn Fn(&Self) -> &Vec<f64>| -> Vec<f64> {
            (0..of(&members[0]).len())
                .map(|m| members.iter().map(|member| of(member)[m]).sum::<f64>())
                .map(|sum| sum / members.len() as f64)
                .collect()
        };
        Self {
            log_diffuse: std::array::from_fn(|c| mean(&|member| &member.log_diffuse[c])),
            specular: std::array::from_fn(|c| mean(&|member| &member.specular[c])),
        }
    }
}

/// A direction of the reflectances that the photographs hardly determine.
struct Weak {
    /// Of the unknown materials, bounds ignored, the light projected out.
    singular_value: f64,
    /// Unit vector over the materials of `of`.
    direction: Vec<f64>,
    of: Vec<usize>,
}

/// Standard deviations within one light set, from errors summed in blocks.
struct Within {
    log_diffuse: Vec<f64>,
    specular: Vec<f64>,
}

/// What is known of the certainty, and what to warn of.
pub fn assess(
    fitter: &Fitter,
    model: &Model,
    fits: &Fits,
    members: &[Member],
    exponents: &[Exponents],
    held_out: Option<Rgb>,
) -> (Certainty, Vec<String>) {
    let capture = fitter.data.views.capture;
    let squares = fitter.mean_square(fits);
    let mut certainty = Certainty {
        materials: fitter.measured.iter().map(|&m| m.then(MaterialCertainty::default)).collect(),
        scale: ScaleCertainty { log_rms: squares.map(f64::sqrt), ..Default::default() },
        held_out,
        light_sets: members.len(),
        selection: None,
    };
    let mut warnings = Vec::new();
    let mean = Member::mean(members);
    let blocks = held_out::blocks(fitter);
    let mut undetermined = Vec::new();
    for (channel, fit) in fits.iter().enumerate() {
        let ridge = model.ridge(0.0);
        let centre = vec![0.0; ridge.len()];
        let terms = fitter.terms(&ridge, &centre, &fitter.weights, channel);
        let normal = fitter.channel(model, channel).normal(&terms, fit);
        let products = gram(&normal.jacobian);
        let all: Vec<usize> = (0..fitter.rows.materials).filter(|&m| fitter.measured[m]).collect();
        let unknown: Vec<usize> =
            all.iter().copied().filter(|&m| fitter.known[channel][m].is_none()).collect();
        if let Some(weak) = weakest(fitter, &normal, &products, &all) {
            certainty.scale.singular_value[channel] = weak.singular_value;
        }
        let weak = weakest(fitter, &normal, &products, &unknown);
        let ratio = weak
            .as_ref()
            .map_or(0.0, |weak| certainty.scale.log_rms[channel] / weak.singular_value.max(1e-9));
        let log_sd = SCALE_ERROR * ratio;
        certainty.scale.log_sd[channel] = log_sd;
        if let Some(weak) = weak.filter(|_| ratio > WARN_RATIO) {
            undetermined.push((channel, weak.words(fitter)));
        }
        let within = within(fitter, &normal, &products, &blocks);
        for &material in &all {
            let Some(entry) = certainty.materials[material].as_mut() else { continue };
            let is_known = fitter.known[channel][material].is_some();
            // Beyond that the weak prior says more than the photographs.
            entry.identified[channel] = is_known || log_sd < fitter.options.prior_sd;
            if members.len() < 2 {
                continue;
            }
            let spread = |of: &dyn Fn(&Member) -> f64, mean: f64| {
                let squares = members.iter().map(|member| (of(member) - mean).powi(2));
                squares.sum::<f64>() / (members.len() - 1) as f64
            };
            let log = mean.log_diffuse[channel][material];
            let between = spread(&|member| member.log_diffuse[channel][material], log);
            if is_known {
                entry.diffuse[channel] = Some([log.exp(); 2]);
            } else if entry.identified[channel] {
                let variance = between + within.log_diffuse[material].powi(2) + log_sd * log_sd;
                entry.diffuse[channel] = Some(interval(log, variance.sqrt()));
            }
            if fitter.is_specular(material) && entry.identified[channel] {
                let value = mean.specular[channel][material];
                let between = spread(&|member| member.specular[channel][material], value);
                let within = within.specular[material];
                let sd = (between + within * within + (value * log_sd).powi(2)).sqrt();
                entry.specular[channel] =
                    Some([(value - QUANTILE * sd).max(0.0), (value + QUANTILE * sd).min(1.0)]);
            }
        }
    }
    for found in exponents {
        if let Some(entry) = certainty.materials[found.material].as_mut() {
            entry.exponent = Some(found.range);
        }
    }
    // The same weakness in several channels is one warning.
    while let Some((first, words)) = undetermined.first().cloned() {
        let channels: Vec<&str> = undetermined
            .iter()
            .filter(|(_, other)| *other == words)
            .map(|(channel, _)| ["red", "green", "blue"][*channel])
            .collect();
        let sd = certainty.scale.log_sd[first];
        warnings.push(format!(
            "{words} is hardly determined by these photographs in the {} channel{} (a factor of \
             about {:.2} either way): give one material its known_diffuse in tags.json",
            listed(&channels),
            if channels.len() > 1 { "s" } else { "" },
            (1.96 * sd).min(3.0).exp(),
        ));
        undetermined.retain(|(_, other)| *other != words);
    }
    if members.len() < 2 {
        warnings.push(
            "only one set of lights was tried, so there are no intervals: set joint.light_sets \
             to 6 for them"
                .to_owned(),
        );
    }
    debug_assert_eq!(certainty.materials.len(), capture.materials.len());
    (certainty, warnings)
}

/// 0.975 quantile of the normal distribution.
const QUANTILE: f64 = 1.96;
/// Above it a factor on all reflectances may be off by more than 10 to 30 %.
const WARN_RATIO: f64 = 0.1;
/// Relative to a column's square, what it must keep beyond others to count as independent.
const INDEPENDENT: f64 = 1e-10;

fn interval(log: f64, sd: f64) -> [f64; 2] {
    [(log - QUANTILE * sd).exp(), (log + QUANTILE * sd).exp().min(1.0)]
}

/// The Schur complement of the log ρ_d of some materials: what is left of JᵀJ when the light and
/// the specular reflectances follow freely.
fn weakest(
    fitter: &Fitter,
    normal: &Normal,
    products: &Mat<f64>,
    materials: &[usize],
) -> Option<Weak> {
    if materials.is_empty() {
        return None;
    }
    let lit = normal.lit.len();
    let inner: Vec<usize> = materials.iter().map(|m| lit + m).collect();
    let mut outer: Vec<usize> = (0..lit).collect();
    outer.extend(
        (0..fitter.rows.materials)
            .filter(|&m| fitter.is_specular(m))
            .map(|m| lit + fitter.rows.materials + m),
    );
    outer.retain(|&j| products[(j, j)] > 0.0);
    let block = |rows: &[usize], columns: &[usize]| {
        Mat::from_fn(rows.len(), columns.len(), |i, j| products[(rows[i], columns[j])])
    };
    let mut schur = block(&inner, &inner);
    if !outer.is_empty() {
        let mut light = block(&outer, &outer);
        for j in 0..outer.len() {
            light[(j, j)] *= 1.0 + INDEPENDENT;
        }
        let mixed = block(&outer, &inner);
        let solved = light.llt(Side::Lower).ok()?.solve(&mixed);
        matmul(schur.as_mut(), Accum::Add, mixed.transpose(), &solved, -1.0, Par::Seq);
    }
    let eigen = schur.self_adjoint_eigen(Side::Lower).ok()?;
    // Ascending.
    let smallest = eigen.S()[0].max(0.0);
    let direction = (0..materials.len()).map(|i| eigen.U()[(i, 0)]).collect();
    Some(Weak { singular_value: smallest.sqrt(), direction, of: materials.to_vec() })
}

impl Weak {
    /// What the direction is, in words.
    fn words(&self, fitter: &Fitter) -> String {
        let names = |sign: f64| -> Vec<&str> {
            let largest = self.direction.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            self.of
                .iter()
                .zip(&self.direction)
                .filter(|(_, part)| sign * **part > 0.5 * largest)
                .map(|(&m, _)| fitter.data.views.capture.materials[m].name.as_str())
                .collect()
        };
        let sum: f64 = self.direction.iter().sum();
        let alignment = sum.abs() / (self.direction.len() as f64).sqrt();
        if alignment > 0.8 {
            return "the overall brightness of the reflectances".to_owned();
        }
        let (up, down) = (names(1.0), names(-1.0));
        match (up.is_empty(), down.is_empty()) {
            (false, false) => {
                format!("the brightness of {} against {}", listed(&up), listed(&down))
            }
            (false, true) => format!("the brightness of {}", listed(&up)),
            _ => format!("the brightness of {}", listed(&down)),
        }
    }
}

fn listed(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// The sandwich over blocks: with T = J H⁻¹ the influence of the residuals on the unknowns, the
/// variance is Σ_blocks (Σ_rows T r)².
fn within(fitter: &Fitter, normal: &Normal, products: &Mat<f64>, blocks: &[u64]) -> Within {
    let materials = fitter.rows.materials;
    let lit = normal.lit.len();
    let mut within = Within { log_diffuse: vec![0.0; materials], specular: vec![0.0; materials] };
    let used: Vec<usize> = (0..products.ncols()).filter(|&j| products[(j, j)] > 0.0).collect();
    let mut hessian = Mat::from_fn(used.len(), used.len(), |i, j| products[(used[i], used[j])]);
    for j in 0..used.len() {
        hessian[(j, j)] *= 1.0 + 1e-9;
    }
    let Ok(factor) = hessian.llt(Side::Lower) else { return within };
    let wanted: Vec<usize> = (0..used.len()).filter(|&i| used[i] >= lit).collect();
    let mut right = Mat::zeros(used.len(), wanted.len());
    for (k, &i) in wanted.iter().enumerate() {
        right[(i, k)] = 1.0;
    }
    let solved = factor.solve(&right);
    let jacobian =
        Mat::from_fn(normal.jacobian.nrows(), used.len(), |row, j| normal.jacobian[(row, used[j])]);
    let mut influence = Mat::zeros(jacobian.nrows(), wanted.len());
    matmul(influence.as_mut(), Accum::Replace, &jacobian, &solved, 1.0, Par::Seq);
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by_key(|&row| (blocks[row], row));
    for (k, &i) in wanted.iter().enumerate() {
        let (mut variance, mut sum) = (0.0, 0.0);
        for (place, &row) in order.iter().enumerate() {
            sum += influence[(row, k)] * normal.residual[row];
            let ends = order.get(place + 1).is_none_or(|&next| blocks[next] != blocks[row]);
            if ends {
                variance += sum * sum;
                sum = 0.0;
            }
        }
        let parameter = used[i] - lit;
        if parameter < materials {
            within.log_diffuse[parameter] = variance.sqrt();
        } else {
            within.specular[parameter - materials] = variance.sqrt();
        }
    }
    within
}

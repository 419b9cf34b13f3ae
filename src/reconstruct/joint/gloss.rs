//! Specular materials: a search over the sharpness of the specular lobe. For each sharpness that is
//! tried, all other unknowns are solved for.
//!
//! For a fixed sharpness the problem is smooth in ρ_d, ρ_s and the light. If the light is held
//! fixed instead, as in the paper's alternation, ρ_s comes out several times too small.

use faer::Mat;
use rayon::prelude::*;

use crate::math::rgb::Rgb;
use crate::reconstruct::Error;
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::joint::compare::{PairedCv, Validated, compare, validate};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit, with_terms};
use crate::reconstruct::joint::glossy::LightOnRow;
use crate::reconstruct::joint::problem::{Data, Problem};
use crate::reconstruct::joint::system::{Channel, Design, State, Terms};
use crate::reconstruct::solution::{Trial, TrialPart};
use crate::scene::{Gloss, Incoming, Viewing};

/// The result of the search over the sharpness of one material's lobe.
#[derive(Clone, Debug)]
pub struct Sharpness {
    pub material: usize,
    pub gloss: Gloss,
    /// The least sharp and the sharpest lobe that fit the radiance of the material about as well as
    /// the best.
    pub range: [Gloss; 2],
}

/// The exponents tried first; each a little more than half an octave's step in sharpness.
const TRIED: [f64; 8] = [3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0, 400.0];
/// A lobe is about as good as the best if the sum of squared residuals of its material is larger by
/// at most this fraction.
const FLAT: f64 = 0.05;
/// Times that exponents halfway between the best and its neighbours are tried.
const HALVINGS: usize = 2;

/// Chooses for every specular material between three models: a coat, a lobe of its own strength, and
/// no gloss at all. The tag says that the material is glossy, and most glossy surfaces have a coat, so
/// that the coat is taken unless another model has a lower held-out error. A lobe is taken only if its
/// error is lower than that of the coat and that of no gloss.
///
/// # Errors
/// As [`fit`].
pub fn choose(problem: &Problem, mut fitted: Fitted) -> Result<(Validated, Vec<Trial>), Error> {
    let glossy: Vec<usize> =
        (0..problem.materials()).filter(|&m| fitted.model.gloss[m].is_some()).collect();
    // All of them at their best before any is compared.
    for &material in &glossy {
        let phong = |exponent| Gloss::Phong { exponent };
        fitted = sharpest_in_its_light(problem, &fitted, material, phong)?;
    }
    let (mut best, mut trials) = (validate(problem, fitted, None)?, Vec::new());
    for material in glossy {
        let from = &best.fitted;
        let coated = sharpest_in_its_light(problem, from, material, Gloss::coat_like)?;
        let coated = validate(problem, coated, Some(&best))?;
        let cv = compare(problem, &coated, &best);
        trials.push(cv.trial(TrialPart::Lobe(material)));
        let is_coat = !cv.is_better();
        if is_coat {
            best = coated;
        }
        let model = best.fitted.model.with_gloss(material, None);
        let matt = fit(problem, &model, Some(&best.fitted), ROUGH)?;
        let matt = validate(problem, matt, Some(&best))?;
        let cv = compare(problem, &matt, &best);
        let is_kept = is_kept(is_coat, &cv, &compare(problem, &best, &matt));
        trials.push(Trial { supported: is_kept, ..cv.trial(TrialPart::Gloss(material)) });
        if !is_kept {
            best = matt;
        }
    }
    Ok((best, trials))
}

/// Whether the gloss of a material is kept. `gloss` compares the model with gloss to that without, and
/// `matt` the model without gloss to that with.
fn is_kept(is_coat: bool, gloss: &PairedCv, matt: &PairedCv) -> bool {
    match is_coat {
        true => !matt.is_better(),
        false => gloss.is_better(),
    }
}

/// Finds the sharpness of the lobe of every glossy material of a fit in turn, the others' given.
///
/// # Errors
/// As [`fit`].
pub fn sharpen(problem: &Problem, fitted: Fitted) -> Result<(Fitted, Vec<Sharpness>), Error> {
    let glossy: Vec<(usize, Gloss)> = (0..problem.materials())
        .filter_map(|material| Some((material, fitted.model.gloss[material]?)))
        .collect();
    let mut found = Vec::new();
    let mut best = fitted;
    for (material, gloss) in glossy {
        let of_kind = |exponent| match gloss {
            Gloss::Phong { .. } => Gloss::Phong { exponent },
            Gloss::Coat { .. } => Gloss::coat_like(exponent),
        };
        let (fitted, sharpness) = sharpest(problem, &best, material, of_kind)?;
        found.push(sharpness);
        best = fitted;
    }
    Ok((best, found))
}

/// Finds the best lobe of one material; `of_kind` makes one that is as sharp as a Phong lobe of
/// some exponent.
fn sharpest(
    problem: &Problem,
    from: &Fitted,
    material: usize,
    of_kind: impl Fn(f64) -> Gloss + Sync,
) -> Result<(Fitted, Sharpness), Error> {
    let fitted = |exponent| {
        let model = from.model.with_gloss(material, Some(of_kind(exponent)));
        fit(problem, &model, Some(from), ROUGH)
    };
    let mut tried = try_exponents(problem, fitted, Fitted::cost)?;
    let least = least(&tried, Fitted::cost);
    let sharpness = Sharpness {
        material,
        gloss: of_kind(tried[least].0),
        range: range(problem, material, &tried, least).map(of_kind),
    };
    Ok((tried.swap_remove(least).1, sharpness))
}

/// The fit with the best lobe of one material. The lobe is chosen with the light held fixed and the
/// light is then fitted again, in turn, until the lobe does not change. This is ten times as fast
/// as fitting the light for each lobe, and good enough to compare kinds of lobes.
fn sharpest_in_its_light(
    problem: &Problem,
    from: &Fitted,
    material: usize,
    of_kind: impl Fn(f64) -> Gloss + Sync,
) -> Result<Fitted, Error> {
    let mut fitted = from.clone();
    for _ in 0..ROUNDS {
        let lit = LitMaterial::new(problem, &fitted, material);
        let cost = |exponent| lit.cost(&fitted, of_kind(exponent));
        let tried = try_exponents(problem, cost, |cost| *cost)?;
        let gloss = of_kind(tried[least(&tried, |cost| *cost)].0);
        if fitted.model.gloss[material] == Some(gloss) {
            break;
        }
        let model = fitted.model.with_gloss(material, Some(gloss));
        fitted = fit(problem, &model, Some(&fitted), ROUGH)?;
    }
    Ok(fitted)
}

/// Times that a lobe is looked for and the light fitted to it.
const ROUNDS: usize = 3;

/// The rows of one glossy material, and the light on them, which is given.
struct LitMaterial<'a> {
    problem: Problem<'a>,
    material: usize,
    /// Per row.
    light: Vec<LitRow>,
}

/// The light on a glossy row: the contributions of known surfaces and of the lights of the
/// model.
struct LitRow {
    /// g, the irradiance of Eq. 14.
    irradiance: Rgb,
    viewing: Viewing,
    incoming: Incoming,
}

impl LitRow {
    fn new(problem: &Problem, fitted: &Fitted, set: &LightSet, row: usize) -> Option<Self> {
        let light = LightOnRow::of(fitted, set, row);
        let point = problem.surface_point(row);
        let glossy = problem.glossy[problem.rows.glossy[row]?];
        let viewing = problem.data.equations.glossy[glossy].viewing;
        let Data { transport, .. } = problem.data;
        let records = problem.surface_light.records(transport, problem.rows.sample[row]);
        let lights = light.lights.iter().map(|(index, irradiance)| {
            let shape = &set.lights.lights[*index];
            let direction = shape.direction_from(point.position);
            (direction, shape.angle_from(point.position), irradiance.map(|value| value as f32))
        });
        let records = records.map(|record| record.from_direction());
        let incoming = Incoming::new(records.chain(lights));
        Some(Self { irradiance: light.irradiance, viewing, incoming })
    }
}

impl<'a> LitMaterial<'a> {
    fn new(problem: &Problem<'a>, fitted: &Fitted, material: usize) -> Self {
        let is_own = |row: usize| {
            problem.rows.material[row] == material && problem.rows.glossy[row].is_some()
        };
        let set = fitted.model.set();
        let light = (0..problem.rows.sample.len())
            .into_par_iter()
            .filter(|&row| is_own(row))
            .filter_map(|row| LitRow::new(problem, fitted, &set, row))
            .collect();
        let mut priors = (*problem.priors).clone();
        for (known, fit) in priors.known.iter_mut().zip(&fitted.channels) {
            for (other, known) in known.iter_mut().enumerate().filter(|(m, _)| *m != material) {
                *known = Some(fit.state.log_diffuse[other]);
            }
        }
        let problem = problem.part(is_own).with_priors(priors);
        Self { problem, material, light }
    }

    /// The cost of its rows with its reflectances at their best.
    fn cost(&self, fitted: &Fitted, gloss: Gloss) -> Result<f64, Error> {
        let problem = &self.problem;
        let mirrored = |light: &LitRow| light.incoming.reflected(light.viewing, gloss);
        let specular: Vec<Rgb> = self.light.iter().map(mirrored).collect();
        let rows = self.light.len();
        let design = Design {
            diffuse: Mat::zeros(rows, 0).into(),
            base: std::array::from_fn(|c| self.light.iter().map(|l| l.irradiance[c]).collect()),
            specular: Mat::zeros(rows, 0).into(),
            specular_base: std::array::from_fn(|c| specular.iter().map(|rgb| rgb[c]).collect()),
            patches: problem.surface_light.patches.clone(),
        };
        let model = fitted.model.with_gloss(self.material, Some(gloss));
        let mut sum = 0.0;
        for (channel, fit) in fitted.channels.iter().enumerate() {
            let start = State { emission: Vec::new(), ..fit.state.clone() };
            let fit = with_terms(problem, &model, &problem.weights, channel, ROUGH, |terms| {
                let system = Channel { rows: &problem.rows, design: &design, channel };
                let terms = Terms { ridge: &[], pairs: &[], centre: &[], held: &[], ..*terms };
                system.fit(&terms, &start, problem.watch())
            })?;
            sum += fit.value;
        }
        Ok(sum)
    }
}

/// What is found for exponents, the first few and then halfway beside the best, by exponent.
fn try_exponents<T: Send>(
    problem: &Problem,
    evaluate: impl Fn(f64) -> Result<T, Error> + Sync,
    cost: impl Fn(&T) -> f64,
) -> Result<Vec<(f64, T)>, Error> {
    let most = problem.data.options.gloss.max_exponent;
    let all = |exponents: Vec<f64>| -> Result<Vec<(f64, T)>, Error> {
        exponents.into_par_iter().map(|exponent| Ok((exponent, evaluate(exponent)?))).collect()
    };
    let mut first: Vec<f64> = TRIED.into_iter().filter(|&exponent| exponent <= most).collect();
    if first.is_empty() {
        first.push(most);
    }
    let mut tried = all(first)?;
    for _ in 0..HALVINGS {
        let least = least(&tried, &cost);
        let between = |a: usize, b: usize| (tried[a].0 * tried[b].0).sqrt();
        let mut next = Vec::new();
        if least > 0 {
            next.push(between(least - 1, least));
        }
        if least + 1 < tried.len() {
            next.push(between(least, least + 1));
        }
        tried.extend(all(next)?);
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    Ok(tried)
}

/// The exponents about the best that are about as good: where the cost crosses the limit, between
/// two that were tried.
fn range(problem: &Problem, material: usize, tried: &[(f64, Fitted)], least: usize) -> [f64; 2] {
    let fitted = &tried[least].1;
    let own: f64 = (0..problem.rows.sample.len())
        .filter(|&row| problem.rows.material[row] == material)
        .map(|row| {
            let squares: f64 = fitted.channels.iter().map(|fit| fit.residuals[row].powi(2)).sum();
            0.5 * problem.weights[row] * squares
        })
        .sum();
    let cost = |index: usize| tried[index].1.cost();
    let limit = cost(least) + FLAT * own;
    let crossing = |inside: usize, outside: usize| {
        let part = ((limit - cost(inside)) / (cost(outside) - cost(inside))).clamp(0.0, 1.0);
        let (a, b) = (tried[inside].0.ln(), tried[outside].0.ln());
        (a + part * (b - a)).exp()
    };
    let mut low = least;
    while low > 0 && cost(low - 1) <= limit {
        low -= 1;
    }
    let mut high = least;
    while high + 1 < tried.len() && cost(high + 1) <= limit {
        high += 1;
    }
    [
        if low > 0 { crossing(low, low - 1) } else { tried[low].0 },
        if high + 1 < tried.len() { crossing(high, high + 1) } else { tried[high].0 },
    ]
}

/// The place of the least cost.
fn least<T>(tried: &[(f64, T)], cost: impl Fn(&T) -> f64) -> usize {
    let costs = tried.iter().map(|(_, value)| cost(value)).enumerate();
    costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coat_is_assumed_unless_it_predicts_worse_and_a_lobe_has_to_predict_better() {
        let falls_by = |part: f64| PairedCv {
            before: 1.0,
            after: 1.0 - part,
            change: -part,
            standard_error: 0.02,
        };
        let kept = |is_coat, gain| is_kept(is_coat, &falls_by(gain), &falls_by(-gain));
        for (gain, coat, lobe) in [(0.05, true, true), (0.01, true, false), (-0.01, true, false)] {
            assert_eq!((kept(true, gain), kept(false, gain)), (coat, lobe), "{gain}");
        }
        assert!(!kept(true, -0.05) && !kept(false, -0.05));
        // Too few blocks to tell.
        let unknown = PairedCv { standard_error: f64::INFINITY, ..falls_by(0.0) };
        assert!(is_kept(true, &unknown, &unknown) && !is_kept(false, &unknown, &unknown));
    }
}

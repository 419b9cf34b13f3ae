//! Light and reflectance solved together, with intervals.
//!
//! The paper's alternation (Section 5.3) hardly moves away from its start values. If the light is
//! too dim by some factor and all surfaces are too bright by the same factor, the photographs are
//! fitted nearly as well, and each half step of the alternation changes this factor only a little.
//! Here all unknowns are solved for at once ([`system`]). The light model is kept so small that it
//! cannot imitate the light of photographed surfaces, because only that light determines the
//! factor. The steps are:
//!
//! 1. `prepare`: the rows, the light of known surfaces (`indirect`), the photographed sky
//!    (`seen_sky`), and the weight of each material;
//! 2. `search`: a background of coarse lobes or sky cells, lamps, a sun and gloss; each part is
//!    kept only if it lowers the error in held-out blocks (`compare` has the rule);
//! 3. `average`: the mean over backgrounds that are laid out differently;
//! 4. `uncertainty`: which values are determined, and intervals;
//! 5. finer lobes in addition to the light that was found, with the reflectances held fixed, if
//!    they lower the held-out error: pictures need a finer light than reflectances can be solved
//!    with;
//! 6. the report: tags that do not fit (`diagnose`), and every comparison.

mod average;
mod background;
pub(super) mod blocks;
mod compare;
mod design;
mod diagnose;
mod fit;
mod gloss;
mod glossy;
mod grow;
mod hessian;
mod history;
mod indirect;
mod lamp_gain;
mod lamps;
mod light_model;
mod linearised;
pub mod options;
mod part;
mod prepare;
mod priors;
mod problem;
mod report;
mod rows;
mod search;
mod seen_sky;
mod strength;
mod sun;
mod sun_gain;
mod surface_light;
pub mod system;
mod terms;
mod uncertainty;

use faer::Mat;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::Error;
use crate::reconstruct::joint::average::{Ensemble, Posterior};
use crate::reconstruct::joint::background::{Density, Layout};
use crate::reconstruct::joint::compare::{compare, held_out_error, validate};
use crate::reconstruct::joint::fit::{EXACT, Fitted, ROUGH, fit};
use crate::reconstruct::joint::history::History;
use crate::reconstruct::joint::indirect::Settled;
use crate::reconstruct::joint::part::Part;
use crate::reconstruct::joint::prepare::{Prepared, prepare};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::search::{Found, search};
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::solution::{Iteration, Selection, Solution, Stopped, Trial, TrialPart};
use crate::reconstruct::transport::PatchRadiosity;
use crate::scene::{Brdf, Gloss};

pub use options::JointOptions;
pub use problem::Data;

/// The light that was found, with its couplings, I_s, and the solution.
pub struct Outcome {
    /// All lights of the model that is delivered.
    pub lights: VirtualLights,
    /// Their lobes, one for each emission of the solution.
    pub lobes: Lobes,
    /// k_ij, samples × lobes, in sr.
    pub coupling: Mat<f64>,
    /// I_s per sample, including the light from specular surfaces.
    pub irradiance: Vec<Radiance>,
    /// Radiosity of known surfaces that no photograph shows; part of I_s.
    pub patch_radiosity: PatchRadiosity,
    /// Reflectances, emissions and the report.
    pub solution: Solution,
}

/// A KKT residual (a cosine) beyond which a solve has not come to its minimum.
const ACCEPTED_KKT: f64 = 1e-4;
/// Steps of the progress.
const STEPS: u64 = 6;

/// Solves for light and reflectances. `normalised` has the reflectances of Eq. 11 and `start` those
/// to begin with, per material, `None` for materials without samples.
///
/// # Errors
/// If it is cancelled, or if the bounded least squares of a fit fails.
pub fn solve(
    data: Data,
    normalised: &[Option<Rgb>],
    start: &[Option<Rgb>],
    on_iteration: &dyn Fn(&Iteration),
) -> Result<Outcome, Error> {
    let watch = data.watch;
    watch.begin(STEPS);
    let inner = watch.within();
    let history = History::new(on_iteration);
    let problem = Problem::new(Data { watch: &inner, ..data }, normalised, start);

    let prepared = prepare(&problem)?;
    history.push(&prepared.search, &prepared.fine);
    watch.tick()?;

    let report = |problem: &Problem, fitted: &Fitted| history.push(problem, fitted);
    let Prepared { all, search: some, is_outer, fine, indirect, surfaces, seen } = prepared;
    let found = search(&some, seen.undecided, &indirect, fine, surfaces, &report)?;
    let all = all.with_surface_light(found.problem.surface_light.clone());
    let all = all.with_sky(found.problem.sky.clone());
    let best = &found.best.fitted;
    let fitted = fit(&all, &best.model.on(&all, &best.rows)?, Some(best), ROUGH)?;
    watch.tick()?;

    let (all, emitters) = diagnose::without_emitters(&all, &fitted, diagnose::EMITS);
    let all = for_last_fits(&all, &fit(&all, &fitted.model, Some(&fitted), ROUGH)?);
    let ensemble = Ensemble::new(&all, &found, &fitted.model, data.options.joint.light_sets)?;
    history.push(&all, ensemble.main());
    watch.tick()?;

    let posterior = ensemble.posterior();
    let finer = finer_light(&found, &posterior)?;
    let beside = match &finer {
        Some(Finer { part, trial }) if trial.supported => Some(part.on(&all, &found.problem.rows)?),
        _ => None,
    };
    let held_out = delivered_error(&all, &beside, &ensemble, &is_outer)?;
    watch.tick()?;

    let (mut certainty, doubts) = uncertainty::assess(
        &all,
        ensemble.main(),
        &posterior,
        ensemble.members.len(),
        &found.sharpness,
        held_out,
    );
    let mut warnings = emitters;
    warnings.extend(doubts);
    warnings.extend(diagnose::examine(&all, ensemble.main()));
    let matt = report::without_highlight(&all, &ensemble, &certainty, &posterior);
    warnings.extend(report::no_highlight(&all, &matt));
    let posterior = posterior.without_gloss(&matt);

    let known = posterior.known_to(&all);
    let fitted = delivered(&known, &beside, ensemble.main())?;
    let Settled { problem: known, fitted, patch_radiosity } = indirect.settle(&known, fitted)?;
    let fitted = fit(&known, &fitted.model, Some(&fitted), EXACT)?;
    history.push(&known, &fitted);
    watch.tick()?;

    let kkt = ensemble.main().kkt_residual().max(fitted.kkt_residual());
    let emission = fitted.emission();
    let kept = emission.iter().filter(|rgb| rgb.iter().any(|&e| e > 0.0)).count();
    let selection = Selection {
        candidates: found.candidates + finer.as_ref().map_or(0, |finer| finer.part.columns()),
        kept,
        trials: seen
            .trial
            .into_iter()
            .chain(found.trials.iter().cloned())
            .chain(finer.map(|finer| finer.trial))
            .collect(),
    };
    let notes = report::notes(&all, &found, &selection);
    certainty.selection = Some(selection);
    let reflectance = |material: usize| {
        let gloss = found.best.fitted.model.gloss[material].filter(|_| !matt.contains(&material));
        let diffuse = posterior.diffuse(material);
        all.priors.measured[material].then(|| match gloss {
            None => Brdf::diffuse(diffuse),
            Some(Gloss::Phong { exponent }) => {
                Brdf::phong(diffuse, posterior.specular(material), exponent)
            }
            Some(Gloss::Coat { roughness }) => {
                Brdf { coat: Some(roughness), ..Brdf::diffuse(diffuse) }
            }
        })
    };
    let solution = Solution {
        reflectances: (0..all.materials()).map(reflectance).collect(),
        optics: Vec::new(),
        emission,
        computed: of_equations(&known, history::computed(&known, &fitted)),
        iterations: history.iterations.into_inner(),
        stopped: if kkt <= ACCEPTED_KKT {
            Stopped::GradientConverged
        } else {
            Stopped::IterationLimit
        },
        certainty: Some(certainty),
        notes,
        warnings,
    };
    let set = fitted.model.set();
    Ok(Outcome {
        coupling: of_samples(&all, &fitted),
        lights: set.lights,
        lobes: set.lobes,
        irradiance: (*known.surface_light.irradiance).clone(),
        patch_radiosity,
        solution,
    })
}

/// The problem after the light model is chosen. The noise of its rows is estimated from a fit, and
/// its ridge does not affect the level of the light.
fn for_last_fits<'a>(problem: &Problem<'a>, fitted: &Fitted) -> Problem<'a> {
    let noise = uncertainty::row_noise(problem, fitted);
    let priors = (*problem.priors).clone();
    problem.with_priors(priors::Priors { noise, relative_ridge: true, ..priors })
}

/// Fine lobes in addition to the lights that were found, if they lower the held-out error. None are
/// tried if all lights are fine already, or if no light is unknown. The reflectances are held
/// fixed, because with so many lights they would not be determined.
fn finer_light(found: &Found, posterior: &Posterior) -> Result<Option<Finer>, Error> {
    let Some(layout) = found.best.fitted.model.layout().filter(|_| !found.is_fine) else {
        return Ok(None);
    };
    let problem = posterior.known_to(&found.problem);
    let fine = Layout::new(&problem, layout.world, Density::Fine, false);
    let part = Part::beside(&problem, &fine)?;
    if part.columns() == 0 {
        return Ok(None);
    }
    let coarse = fit(&problem, &found.best.fitted.model, Some(&found.best.fitted), ROUGH)?;
    let with = fit(&problem, &coarse.model.with(part.clone()), Some(&coarse), ROUGH)?;
    let (coarse, with) = (validate(&problem, coarse, None)?, validate(&problem, with, None)?);
    let trial = compare(&problem, &coarse, &with).trial(TrialPart::Beside(part.columns()));
    Ok(Some(Finer { part, trial }))
}

/// Fine lobes in addition to the lights that were found.
struct Finer {
    /// On the rows that were searched.
    part: Part,
    trial: Trial,
}

/// The light that goes with known reflectances.
fn delivered(known: &Problem, beside: &Option<Part>, main: &Fitted) -> Result<Fitted, Error> {
    let model = match beside {
        Some(part) => main.model.with(part.clone()),
        None => main.model.clone(),
    };
    fit(known, &model, Some(main), ROUGH)
}

/// The error of the delivered model in rows that were used neither to choose nor to fit it. Only
/// the direction of a sun was found with all rows.
fn delivered_error(
    all: &Problem,
    beside: &Option<Part>,
    ensemble: &Ensemble,
    is_outer: &[bool],
) -> Result<Option<Rgb>, Error> {
    if !is_outer.contains(&true) {
        return Ok(None);
    }
    let inside = |row: usize| if is_outer[row] { 0.0 } else { all.weights[row] };
    let blind = all.with_weights((0..is_outer.len()).map(inside).collect());
    let ensemble = ensemble.refit(&blind)?;
    let posterior = ensemble.posterior();
    let fitted = delivered(&posterior.known_to(&blind), beside, ensemble.main())?;
    held_out_error(&posterior.known_to(all), &fitted, |row| is_outer[row])
}

/// Values of all rows in the order of the equations.
fn of_equations(problem: &Problem, of_rows: Vec<Rgb>) -> Vec<Rgb> {
    let mut values = vec![[0.0; CHANNELS]; of_rows.len()];
    for (&equation, value) in problem.equation.iter().zip(of_rows) {
        values[equation] = value;
    }
    values
}

/// k_ij, samples × columns.
fn of_samples(problem: &Problem, fitted: &Fitted) -> Mat<f64> {
    let mut row_of = vec![0; problem.data.cloud.samples.len()];
    problem.rows.sample.iter().enumerate().for_each(|(row, &sample)| row_of[sample] = row);
    Mat::from_fn(row_of.len(), fitted.model.columns(), |sample, column| {
        f64::from(fitted.design.diffuse[(row_of[sample], column)])
    })
}

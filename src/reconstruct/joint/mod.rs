//! Light and reflectance solved together, with intervals.
//!
//! The paper's alternation (Section 5.3) returns its starting guess: light that is too dim by
//! some factor and surfaces that are too bright by it explain the photographs nearly as well,
//! and each half step moves hardly at all along that direction. Here all unknowns are solved at
//! once ([`system`]), and the light model is kept so small that it cannot imitate the light of
//! photographed surfaces, which is all that tells the scale:
//!
//! 0. what no photograph shows and no light explains, and how much each material's word counts
//!    (`prepare`, `unseen`);
//! 1. a background of coarse lobes ([`background`]), and lamps and a sun that are placed one by
//!    one where they explain most (`sources`, `lamps`, `sun`);
//! 2. specular materials with everything else (`gloss`);
//! 3. fine lobes instead, or a sky, where the error on held-out samples is lower (`held_out`);
//! 4. the same with other backgrounds, whose spread tells what the choice of one costs;
//! 5. what is determined, and intervals (`certainty`); tags that do not fit (`diagnose`);
//! 6. for the reflectances that came of it, finer light beside the light that was found, where it
//!    predicts better: pictures ask for more of it than reflectances bear.
//!
//! With `joint.model = auto` steps 1 to 4 look for structure on a part of the samples (`thin`), and
//! keep only what is borne out by samples that were held out (`grow`, `judge`).

pub mod background;
mod certainty;
mod choice;
mod diagnose;
mod fit;
mod gloss;
mod grow;
pub(super) mod held_out;
mod hessian;
mod history;
mod judge;
mod lamps;
mod model;
pub mod options;
mod prepare;
mod project;
mod relook;
mod sources;
mod sun;
pub mod system;
mod terms;
mod thin;
mod unseen;

use faer::Mat;
use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::equations::Equations;
use crate::reconstruct::joint::background::{Layout, LightSet, World};
use crate::reconstruct::joint::certainty::Member;
use crate::reconstruct::joint::choice::{Choice, Density, Search};
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::gloss::Exponents;
use crate::reconstruct::joint::history::History;
use crate::reconstruct::joint::lamps::Candidates;
use crate::reconstruct::joint::model::{Data, Model};
use crate::reconstruct::joint::options::ModelSize;
use crate::reconstruct::joint::prepare::{Fine, Prepared};
use crate::reconstruct::joint::thin::Thin;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::{Certainty, Iteration, Solution, Stopped, Trial, TrialPart};
use crate::reconstruct::transport::{PatchRadiosity, Transport};
use crate::reconstruct::{Error, Options};
use crate::scene::Brdf;
use crate::scene::{Environment, Views};
use crate::watch::Watch;

pub use options::JointOptions;

/// The light that was found, and everything that it explains.
pub struct Outcome {
    pub set: LightSet,
    /// k_ij, samples × lobes.
    pub coupling: Mat<f64>,
    /// I_s per sample, with what specular surfaces send there.
    pub irradiance: Vec<Radiance>,
    /// What known surfaces send that no photograph shows; part of I_s.
    pub patch_radiosity: PatchRadiosity,
    pub solution: Solution,
}

#[expect(clippy::too_many_arguments, reason = "every product of the stages before is needed")]
/// Solves for light and reflectances. `start` has the reflectances to begin with (Eq. 11), `None`
/// for materials without samples; `transport` needs no coupling, `equations` no lights.
pub fn solve(
    views: &Views,
    cloud: &SampleCloud,
    transport: &Transport,
    equations: &Equations,
    start: &[Option<Rgb>],
    options: &Options,
    on_iteration: &dyn Fn(&Iteration),
    watch: &Watch,
) -> Result<Outcome, Error> {
    let joint = &options.joint;
    watch.begin(STEPS + joint.light_sets as u64 - 1);
    let inner = watch.within();
    let data = Data { views, cloud, transport, equations, options, watch: &inner };
    let mut fitter = Fitter::new(data, start);
    let history = History::new(equations, on_iteration);
    let mut notes = Vec::new();

    let Prepared { room, fine, mut patch_radiosity, unseen, mut warnings } =
        prepare::prepare(&mut fitter, &history)?;
    watch.tick()?;

    let thin = (joint.model == ModelSize::Auto).then(|| Thin::of(&fitter));
    let chosen = match &thin {
        None => chosen(&mut fitter, (room, fine), &history, &mut notes, watch)?,
        Some(thin) => grow::grow(&mut fitter, thin, (room, fine), &history, &mut notes, watch)?,
    };
    let Chosen { mut choice, exponents, candidates, mut tried } = chosen;
    notes.extend(note_gloss(&fitter, &exponents));

    let emitters = diagnose::drop_emitters(&mut fitter, &choice.found.fits, diagnose::EMITS);
    if !emitters.is_empty() {
        let (model, fits) = (&choice.found.model, &choice.found.fits);
        choice.found.fits = fitter.fit(model, joint.ridge, &fitter.weights, Some(fits))?;
        warnings.extend(emitters);
    }
    choice.found.fits = fitter.settle(&choice.found.model, joint.ridge, choice.found.fits)?;
    history.push(&fitter, &choice.found.fits);
    let steepest = |fits: &Fits| fits.iter().map(|fit| fit.slope).fold(0.0, f64::max);
    let slope = steepest(&choice.found.fits);
    let mut members = vec![Member::of(&choice.found.fits)];
    let quick = thin.as_ref().map(|thin| thin.fitter(&fitter));
    let others = |index: usize| {
        let member = match &quick {
            None => choice::member(&fitter, &candidates, &choice, index)?,
            Some(quick) => grow::member(&fitter, quick, &candidates, &choice, index)?,
        };
        watch.tick()?;
        Ok(member)
    };
    let others = (1..joint.light_sets).into_par_iter().map(others);
    members.extend(others.collect::<Result<Vec<_>, Error>>()?);

    let (mut certainty, doubts) = certainty::assess(
        &fitter,
        &choice.found.model,
        &choice.found.fits,
        &members,
        &exponents,
        Some(choice.held_out),
    );
    warnings.extend(doubts);
    warnings.extend(diagnose::examine(&fitter, &choice.found.fits));
    warnings.extend(warn_gloss(&mut members, &fitter, &certainty));

    // The emissions that go with the mean of the light sets' reflectances.
    let mean = Member::mean(&members);
    for channel in 0..CHANNELS {
        for material in 0..fitter.rows.materials {
            fitter.known[channel][material] = Some(mean.log_diffuse[channel][material]);
            fitter.known_specular[channel][material] = Some(mean.specular[channel][material]);
        }
    }
    if let Some((lobes, trial)) = choice.refine(&fitter)? {
        match &mut tried {
            Some(tried) => *tried += lobes,
            None => notes.push(grow::told_beside(lobes, &trial)),
        }
        choice.trials.push(trial);
    }
    if let Some(unseen) = &unseen {
        patch_radiosity = choice.reflect(&mut fitter, unseen)?;
    }
    let model = &choice.found.model;
    let fits = fitter.fit_exactly(model, joint.ridge, &choice.found.fits)?;
    history.push(&fitter, &fits);
    watch.tick()?;

    let converged = slope.max(steepest(&fits)) <= ACCEPTED_SLOPE;
    let mut emission: Vec<Rgb> = (0..model.columns())
        .map(|column| std::array::from_fn(|c| fits[c].state.emission[column]))
        .collect();
    for fixed in &model.fixed {
        emission[fixed.column] = fixed.emission;
    }
    let reflectance = |material: usize| {
        fitter.measured[material].then(|| Brdf {
            diffuse: std::array::from_fn(|c| mean.log_diffuse[c][material].exp()),
            specular: std::array::from_fn(|c| mean.specular[c][material]),
            exponent: fitter.exponents[material],
        })
    };
    let computed = history.computed(&fits);
    if let Some(tried) = tried {
        let kept = emission.iter().filter(|rgb| rgb.iter().any(|&e| e > 0.0)).count();
        let trials = std::mem::take(&mut choice.trials);
        let (selection, told) = grow::report(&fitter, &choice.found, trials, tried, kept);
        certainty.selection = Some(selection);
        notes.extend(told);
    }
    let solution = Solution {
        reflectances: (0..fitter.rows.materials).map(reflectance).collect(),
        emission,
        iterations: history.iterations.into_inner(),
        stopped: if converged { Stopped::GradientConverged } else { Stopped::IterationLimit },
        computed,
        certainty: Some(certainty),
        notes,
        warnings,
    };
    Ok(Outcome {
        coupling: model.coupling(&fitter.rows),
        set: choice.found.model.set,
        irradiance: fitter.irradiance,
        patch_radiosity,
        solution,
    })
}

/// A light model, fitted to all samples, and what its light sets are found with.
struct Chosen {
    choice: Choice,
    exponents: Vec<Exponents>,
    candidates: Candidates,
    /// Lobes that were tried, of a model that was grown.
    tried: Option<usize>,
}

/// The light with as many lamps as explain enough, and gloss wherever it is tagged.
fn chosen(
    fitter: &mut Fitter,
    (room, fine): (Model, Fine),
    history: &History,
    notes: &mut Vec<String>,
    watch: &Watch,
) -> Result<Chosen, Error> {
    let candidates = lamp_candidates(fitter, &fine.model)?;
    let choice = choose_world(fitter, room, &candidates, history, notes, watch)?;
    let mut choice = or_fine_lobes(fitter, choice, fine, notes)?;
    watch.tick()?;
    let exponents = choice.find_exponents(fitter)?;
    Ok(Chosen { choice, exponents, candidates, tried: None })
}

/// Where lamps may be; nowhere if no light of the model is unknown. Every ray from the samples then
/// meets a photographed surface, and a lamp in between would only take the place of what these
/// send.
fn lamp_candidates(fitter: &Fitter, model: &Model) -> Result<Candidates, Error> {
    let mut candidates = lamps::candidates(fitter)?;
    let is_unknown = |light: &VirtualLight| !matches!(light.kind, LightKind::Known(_));
    if !model.set.lights.lights.iter().any(is_unknown) {
        candidates.clear();
    }
    Ok(candidates)
}

/// The lights of a room or of the open sky, whichever the photographs speak for.
fn choose_world(
    fitter: &mut Fitter,
    mut background: Model,
    candidates: &Candidates,
    history: &History,
    notes: &mut Vec<String>,
    watch: &Watch,
) -> Result<Choice, Error> {
    let environment = fitter.data.views.capture.environment;
    let room = choice::layout(fitter, World::Room, Density::Coarse, 0);
    let grows = fitter.options.model == ModelSize::Auto;
    let most_lamps = fitter.options.max_lamps;
    let mut search = Search { candidates, most_lamps, sun: None, grows };
    fitter.data.set_irradiance(&fitter.rows, &mut background, &fitter.irradiance);
    let (mut choice, mut taught) =
        choice::choose_light(fitter, &search, (room, background), history, watch)?;
    if environment != Environment::Room {
        let open = Layout { world: World::Open, ..room };
        let sky = choice::background_model(fitter, &open)?;
        let promise = held_out::mean(&choice::sky_alone(fitter, &sky, choice.found.sun)?);
        let is_given = environment == Environment::Open;
        if is_given || (sky.lights_any_row() && promise < OPEN_LIMIT * choice.error()) {
            // A sky that explains as much as a room with its lamps needs none.
            if !is_given {
                search.most_lamps = 0;
            }
            search.sun = choice.found.sun;
            // It was tried in the room, and is taken from there.
            let of_sun = choice.trials.iter().filter(|trial| trial.part == TrialPart::Sun);
            let of_sun: Vec<Trial> = of_sun.copied().collect();
            (choice, taught) = choice::choose_light(fitter, &search, (open, sky), history, watch)?;
            choice.trials.splice(0..0, of_sun);
        }
        let is_open = choice.layout.world == World::Open;
        notes.push(format!(
            "the unseen world is taken to be {}; a sky alone predicts held-out samples to {:.1} %",
            if is_open { "an open sky" } else { "a room" },
            100.0 * promise,
        ));
    }
    taught.teach(fitter);
    Ok(choice)
}

/// Fine lobes instead, where they predict held-out samples better.
fn or_fine_lobes(
    fitter: &Fitter,
    choice: Choice,
    fine: Fine,
    notes: &mut Vec<String>,
) -> Result<Choice, Error> {
    let Fine { layout, model: mut fine, fits } = fine;
    let ridge = fitter.options.ridge;
    fitter.data.set_irradiance(&fitter.rows, &mut fine, &fitter.irradiance);
    fitter.data.set_exponents(&fitter.rows, &mut fine, &fitter.exponents);
    let fits = fitter.fit(&fine, ridge, &fitter.weights, Some(&fits))?;
    let error = held_out::error(fitter, &fine, ridge, &fits)?;
    let tells = format!(
        "held-out error with {} lamps{} over {} background lobes {:.1} %, with {} fine lobes \
         {:.1} %",
        choice.found.lamps.len(),
        if choice.found.sun.is_some() { " and a sun" } else { "" },
        choice.background.columns(),
        100.0 * choice.error(),
        fine.columns(),
        100.0 * held_out::mean(&error),
    );
    let is_open = fitter.data.views.capture.environment == Environment::Open;
    if is_open || held_out::mean(&error) >= choice.error() {
        notes.push(tells);
        return Ok(choice);
    }
    notes.push(format!("{tells}: fine lobes are used"));
    Choice::fine(fitter, layout, fine, fits, error)
}

/// Steps of the progress beside the light sets: fine lobes, two worlds, the comparison, the end.
const STEPS: u64 = 6;
/// Held-out error in the open, relative to that of a room, up to which a capture is taken to be
/// in the open: a room's lobes can imitate a sky, a sky no lamp, and it has fewer unknowns.
const OPEN_LIMIT: f64 = 1.1;
/// A projected slope (a cosine) beyond which a solve has not come to its minimum.
const ACCEPTED_SLOPE: f64 = 1e-4;

fn note_gloss(fitter: &Fitter, found: &[Exponents]) -> Vec<String> {
    let note = |exponents: &Exponents| {
        format!(
            "\"{}\": exponent {:.0}; {:.0} to {:.0} explain the photographs about as well",
            fitter.data.views.capture.materials[exponents.material].name,
            fitter.exponents[exponents.material],
            exponents.range[0],
            exponents.range[1],
        )
    };
    found.iter().map(note).collect()
}

/// Materials tagged as specular that show no highlight are diffuse.
fn warn_gloss(members: &mut [Member], fitter: &Fitter, certainty: &Certainty) -> Vec<String> {
    let mut warnings = Vec::new();
    for material in (0..fitter.rows.materials).filter(|&m| fitter.is_tagged_specular(m)) {
        let Some(certainty) = certainty.materials[material] else { continue };
        let shows = !fitter.matt[material]
            && (0..CHANNELS).any(|c| {
                let mean = members.iter().map(|m| m.specular[c][material]).sum::<f64>();
                let mean = mean / members.len() as f64;
                match certainty.specular[c] {
                    Some([low, _]) => low > 0.0 && mean > NO_HIGHLIGHT,
                    // What only some light sets need is no highlight.
                    None => members.iter().all(|m| m.specular[c][material] > NO_HIGHLIGHT),
                }
            });
        if !shows {
            warnings.push(format!(
                "\"{}\" is tagged as specular, but the photographs show no highlight on it: it is \
                 taken to be diffuse",
                fitter.data.views.capture.materials[material].name
            ));
            for member in members.iter_mut() {
                for specular in &mut member.specular {
                    specular[material] = 0.0;
                }
            }
        }
    }
    warnings
}

/// A specular reflectance that nobody sees.
const NO_HIGHLIGHT: f64 = 0.01;

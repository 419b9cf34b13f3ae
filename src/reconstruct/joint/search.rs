//! The light model that a scene needs: parts are proposed by what they could explain, and come in
//! or go by one rule ([`compare`]).
//!
//! Each step adds the light that explains most of what is left and moves all others to their best
//! places (alternating descent conditional gradient: Boyd, Schiebinger, Recht 2017); parts that are
//! not needed any more are taken away at the end.

use rayon::prelude::*;

use crate::math::sampling::Frame;
use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{Density, Layout, World};
use crate::reconstruct::joint::compare::{Validated, compare, validate};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::gloss::{self, Sharpness, sharpen};
use crate::reconstruct::joint::indirect::{Indirect, Settled};
use crate::reconstruct::joint::lamps::{self, COLUMNS, Candidates};
use crate::reconstruct::joint::light_model::LightModel;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::sun::{self, Directions};
use crate::reconstruct::solution::{Trial, TrialPart};
use crate::scene::{Emitter, Environment, KnownLight};

/// What a search looks for, and where.
struct Places<'a> {
    lamps: &'a Candidates,
    suns: &'a Directions,
    report: &'a dyn Fn(&Problem, &Fitted),
}

/// The model that was chosen, on the rows that it was chosen with.
pub struct Found<'a> {
    lamps: Candidates,
    suns: Directions,
    pub problem: Problem<'a>,
    pub best: Validated,
    /// Whether fine lobes are taken in place of lamps.
    pub is_fine: bool,
    pub trials: Vec<Trial>,
    /// Lobes that were tried.
    pub candidates: usize,
    pub sharpness: Vec<Sharpness>,
}

impl Found<'_> {
    fn places(&self) -> Places<'_> {
        Places { lamps: &self.lamps, suns: &self.suns, report: &|_, _| () }
    }
}

/// A model and the comparisons that led to it.
struct Step {
    best: Validated,
    trials: Vec<Trial>,
}

impl Step {
    fn new(best: Validated) -> Self {
        Self { best, trials: Vec::new() }
    }
}

/// Times that the cells of a sky are doubled at most: to about 14° across.
const DOUBLINGS: usize = 3;

/// Chooses the light and the gloss. `fine` is a fit of many fine lobes without lamps, `surfaces`
/// whether known surfaces that no photograph shows may shine.
///
/// # Errors
/// If it is cancelled, or if the bounded least squares of a fit fails.
pub fn search<'a>(
    problem: &Problem<'a>,
    indirect: &Indirect,
    fine: Fitted,
    surfaces: bool,
    report: &dyn Fn(&Problem, &Fitted),
) -> Result<Found<'a>, Error> {
    let options = problem.options();
    let is_sun = |light: &KnownLight| {
        matches!(light, KnownLight::Shape { emitter: Emitter::Sun { .. }, .. })
    };
    let has_sun = problem.capture().lights.iter().any(is_sun);
    // Where no light is unknown every ray meets a photographed surface: a lamp in between would
    // only take the place of what these send.
    let is_open = fine.model.has_unknown_light();
    let lamps = lamps::candidates(problem, is_open)?;
    let suns = Directions::new(problem, is_open && options.find_sun && !has_sun)?;
    let places = Places { lamps: &lamps, suns: &suns, report };
    let environment = problem.capture().environment;
    let layout = |world| Layout::new(problem, world, Density::Coarse, surfaces);
    let (room, sky) = (layout(World::Room), layout(World::Open));

    let mut problem = problem.clone();
    let mut first = LightModel::new(&problem, &room)?;
    let mut chosen = lights(&problem, &places, &first, &fine, (environment, sky))?;
    if first.is_glossy() {
        // Lamps stand better where highlights have their true sharpness, and I_s its part from
        // glossy surfaces.
        let (gloss, trials) = gloss::choose(&problem, chosen.best.fitted)?;
        let Settled { problem: settled, fitted, .. } = indirect.settle(&problem, gloss.fitted)?;
        problem = settled;
        first.gloss.clone_from(&fitted.model.gloss);
        chosen = lights(&problem, &places, &first, &fine, (environment, sky))?;
        chosen.trials.extend(trials);
    }
    let of_lights = |trial: &Trial| match trial.part {
        TrialPart::Sun => 1,
        TrialPart::Lamp(_) => COLUMNS,
        _ => 0,
    };
    let lobes: usize = chosen.trials.iter().map(of_lights).sum();
    let candidates = lobes + first.columns() + fine.model.columns();
    let (step, is_fine) = choose_density(&problem, &places, chosen, fine)?;
    let Step { mut best, trials } = step;
    let mut sharpness = Vec::new();
    if best.fitted.model.is_glossy() {
        let (sharp, found) = sharpen(&problem, best.fitted)?;
        (best, sharpness) = (validate(&problem, sharp)?, found);
    }
    Ok(Found { lamps, suns, problem, best, is_fine, trials, candidates, sharpness })
}

/// The lights of a room or of the open sky. The sky, which has fewer unknowns or is photographed, is
/// left where a room with its lamps predicts better.
fn lights(
    problem: &Problem,
    places: &Places,
    room: &LightModel,
    from: &Fitted,
    (environment, sky): (Environment, Layout),
) -> Result<Step, Error> {
    // From one fit, so that where that one started has no effect.
    let start = |model: &LightModel| validate(problem, fit(problem, model, Some(from), ROUGH)?);
    let grown = |start: Step| -> Result<Step, Error> {
        prune(problem, grow(problem, places, start, problem.options().max_lamps)?)
    };
    if environment == Environment::Room || !room.has_unknown_light() {
        return grown(Step::new(start(room)?));
    }
    let mut model = LightModel::new(problem, &sky)?;
    model.gloss.clone_from(&room.gloss);
    let sky = start(&model)?;
    let of_sky = |start: Validated| -> Result<Step, Error> {
        // A sun first, which many cells would imitate; whether these leave anything to it is seen when
        // parts are taken away.
        let sky = grow(problem, places, Step::new(start), 0)?;
        if problem.sky.is_none() {
            return Ok(sky);
        }
        // Where photographs show the sky it is drawn as finely as openings need, and may shine into a
        // room with lamps.
        grown(denser(problem, sky)?)
    };
    if environment == Environment::Open {
        return if problem.sky.is_some() { of_sky(sky) } else { grown(Step::new(sky)) };
    }
    let mut room = grown(Step::new(start(room)?))?;
    // A sky that explains as much as a room with its lamps needs none.
    let sky = match room.best.fitted.model.sun() {
        Some(sun) => start(&sky.fitted.model.with(sun.clone()))?,
        None => sky,
    };
    let sky = of_sky(sky)?;
    let cv = compare(problem, &sky.best, &room.best);
    if !cv.is_better() {
        room = sky;
    }
    room.trials.push(cv.trial(TrialPart::Room));
    Ok(room)
}

/// Twice as many cells of the sky, up to [`DOUBLINGS`] times, where they predict better: four times as
/// many may, though twice as many do not.
fn denser(problem: &Problem, mut step: Step) -> Result<Step, Error> {
    let mut from = step.best.fitted.clone();
    for _ in 0..DOUBLINGS {
        let Some(next) = with_lights(problem, &from, 2.0)? else { break };
        let columns = next.fitted.model.background().map_or(0, Part::columns);
        let cv = compare(problem, &step.best, &next);
        step.trials.push(cv.trial(TrialPart::Background(columns)));
        from = next.fitted.clone();
        if cv.is_better() {
            step.best = next;
        }
    }
    Ok(step)
}

/// The model with this many times as many lights of the background; `None` without a background.
fn with_lights(
    problem: &Problem,
    fitted: &Fitted,
    factor: f64,
) -> Result<Option<Validated>, Error> {
    let model = &fitted.model;
    let Some((part, layout)) = model.background().zip(model.layout()) else { return Ok(None) };
    let background = Part::background(problem, &layout.with_lights(factor))?;
    let model = model.replacing(part.slot, background);
    Ok(Some(validate(problem, fit(problem, &model, Some(fitted), ROUGH)?)?))
}

/// Adds lamps and a sun while they are needed. Two may be needed of which neither is alone.
fn grow(problem: &Problem, places: &Places, mut step: Step, most: usize) -> Result<Step, Error> {
    (places.report)(problem, &step.best.fitted);
    let mut ahead: Option<Validated> = None;
    loop {
        let from = &ahead.as_ref().unwrap_or(&step.best).fitted;
        let Some((part, proposal)) = propose(problem, places, from, most)? else { break };
        let proposal = validate(problem, settle(problem, places, proposal)?)?;
        let cv = compare(problem, &step.best, &proposal);
        step.trials.push(cv.trial(part));
        if cv.is_better() {
            (places.report)(problem, &proposal.fitted);
            (step.best, ahead) = (proposal, None);
        } else if ahead.is_none() {
            ahead = Some(proposal);
        } else {
            break;
        }
    }
    Ok(step)
}

/// The model with the lamp or the sun that explains most; `None` where nothing explains anything.
fn propose(
    problem: &Problem,
    places: &Places,
    from: &Fitted,
    most: usize,
) -> Result<Option<(TrialPart, Fitted)>, Error> {
    let mut best: Option<(TrialPart, Fitted)> = None;
    let mut offer = |part: TrialPart, fitted: Fitted| {
        if fitted.cost() < best.as_ref().map_or(from.cost(), |(_, best)| best.cost()) {
            best = Some((part, fitted));
        }
    };
    let lamps = from.model.lamps();
    let lamp = if lamps < most { places.lamps.best(problem, from) } else { None };
    let response = lamp.map_or(0.0, |(_, response)| response);
    if let Some((lamp, _)) = lamp {
        let lamp = places.lamps.refine(problem, from, lamp, None)?;
        let model = from.model.with(Part::lamp(problem, lamp)?);
        let with = fit(problem, &model, Some(from), ROUGH)?;
        offer(TrialPart::Lamp(lamps + 1), with);
    }
    if from.model.sun().is_none()
        && let Some(towards) = places.suns.best(problem, from, response)?
    {
        // Without lamps, since those found before may stand in for it.
        let mut model = from.model.clone();
        model.parts.retain(|part| !part.is_lamp());
        let model = model.with(Part::sun(problem, towards)?);
        offer(TrialPart::Sun, fit(problem, &model, Some(from), ROUGH)?);
    }
    Ok(best)
}

/// Moves every lamp and the sun to its best place, the others given.
fn settle(problem: &Problem, places: &Places, mut fitted: Fitted) -> Result<Fitted, Error> {
    for slot in fitted.model.parts.iter().map(|part| part.slot).collect::<Vec<_>>() {
        let kind = fitted.model.parts.iter().find(|part| part.slot == slot).map(|part| part.kind);
        let moved = match kind {
            Some(PartKind::Lamp(lamp)) => {
                let moved = places.lamps.refine(problem, &fitted, lamp, Some(slot))?;
                (moved != lamp).then(|| Part::lamp(problem, moved)).transpose()?
            }
            Some(PartKind::Sun(towards)) => {
                let moved = sun::refine(problem, &fitted, towards, slot)?;
                (moved != towards).then(|| Part::sun(problem, moved)).transpose()?
            }
            _ => None,
        };
        let Some(part) = moved else { continue };
        let model = fitted.model.replacing(slot, part);
        let again = fit(problem, &model, Some(&fitted), ROUGH)?;
        if again.cost() < fitted.cost() {
            fitted = again;
        }
    }
    Ok(fitted)
}

/// Takes away every lamp, and the sun, without which blocks are not predicted worse.
fn prune(problem: &Problem, mut step: Step) -> Result<Step, Error> {
    let found = |part: &&Part| matches!(part.kind, PartKind::Lamp(_) | PartKind::Sun(_));
    let slots: Vec<usize> =
        step.best.fitted.model.parts.iter().filter(found).map(|part| part.slot).collect();
    for slot in slots {
        let model = step.best.fitted.model.without(slot);
        let without = validate(problem, fit(problem, &model, Some(&step.best.fitted), ROUGH)?)?;
        if !compare(problem, &without, &step.best).is_better() {
            step.best = without;
        }
    }
    Ok(step)
}

/// Half as many lights of the background where the other half does not predict better, and fine
/// lobes in place of lamps where they do.
fn choose_density(
    problem: &Problem,
    places: &Places,
    mut step: Step,
    fine: Fitted,
) -> Result<(Step, bool), Error> {
    let mut is_fine = false;
    if let Some(sparse) = with_lights(problem, &step.best.fitted, 0.5)? {
        let columns = step.best.fitted.model.background().map_or(0, Part::columns);
        let cv = compare(problem, &sparse, &step.best);
        step.trials.push(cv.trial(TrialPart::Background(columns)));
        if !cv.is_better() {
            step.best = sparse;
        }
    }
    if problem.capture().environment != Environment::Open && fine.model.columns() > 0 {
        let mut model = fine.model.clone();
        model.gloss.clone_from(&step.best.fitted.model.gloss);
        let fine = validate(problem, fit(problem, &model, Some(&fine), ROUGH)?)?;
        let cv = compare(problem, &step.best, &fine);
        step.trials.push(cv.trial(TrialPart::FineLobes));
        if cv.is_better() {
            (step.best, is_fine) = (fine, true);
        }
    }
    (places.report)(problem, &step.best.fitted);
    Ok((step, is_fine))
}

/// First and last step by which a sun is aimed, in radians; the last is less than a tenth of its
/// diameter.
const FIRST_AIM: f32 = 0.01;
const LAST_AIM: f32 = 0.0009;

/// The model with its sun aimed by all rows of a problem, and its fit there: the edge of a shadow is
/// known as well as samples are dense.
///
/// # Errors
/// As [`search`].
pub fn aim_sun<'a>(found: Found<'a>, all: &Problem) -> Result<(Found<'a>, Fitted), Error> {
    let chosen = &found.best.fitted;
    let mut fitted = fit(all, &chosen.model.on(all)?, Some(chosen), ROUGH)?;
    let sun = chosen.model.parts.iter().find_map(|part| match part.kind {
        PartKind::Sun(towards) => Some((part.slot, towards)),
        _ => None,
    });
    let Some((slot, towards)) = sun else { return Ok((found, fitted)) };
    // By the cost itself: linearised, the samples that are shadowed wrongly hardly count.
    let (mut aimed, mut step) = (towards, FIRST_AIM);
    while step > LAST_AIM {
        let frame = Frame::about(aimed);
        let tried = [frame.tangent, -frame.tangent, frame.bitangent, -frame.bitangent]
            .into_par_iter()
            .map(|aside| {
                let moved = (aimed + step * aside).normalize_or_zero();
                let model = fitted.model.replacing(slot, Part::sun(all, moved)?);
                Ok((moved, fit(all, &model, Some(&fitted), ROUGH)?))
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let best = tried.into_iter().min_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
        match best.filter(|(_, again)| again.cost() < fitted.cost()) {
            Some(best) => (aimed, fitted) = best,
            None => step *= 0.5,
        }
    }
    if aimed == towards {
        return Ok((found, fitted));
    }
    let problem = &found.problem;
    let model = chosen.model.replacing(slot, Part::sun(problem, aimed)?);
    let best = validate(problem, fit(problem, &model, Some(chosen), ROUGH)?)?;
    Ok((Found { best, ..found }, fitted))
}

/// A model over other backgrounds, with as many lamps, each looked for anew: which places explain
/// most depends on what the background leaves.
///
/// # Errors
/// As [`search`].
pub fn regrow(found: &Found, model: &LightModel) -> Result<Fitted, Error> {
    let (problem, from) = (&found.problem, &found.best.fitted);
    let places = found.places();
    let mut bare = model.clone();
    bare.parts.retain(|part| !part.is_lamp());
    let mut fitted = fit(problem, &bare, Some(from), ROUGH)?;
    while fitted.model.lamps() < model.lamps()
        && let Some((_, next)) = propose(problem, &places, &fitted, model.lamps())?
    {
        fitted = next;
    }
    settle(problem, &places, fitted)
}

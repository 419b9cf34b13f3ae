//! The light model that a scene needs: parts are proposed by what they could explain, and come in
//! or go by one rule ([`compare`]).
//!
//! Each step adds the light that explains most of what is left and moves all others to their best
//! places (alternating descent conditional gradient: Boyd, Schiebinger, Recht 2017); parts that are
//! not needed any more are taken away at the end.

use std::sync::Arc;

use glam::Vec3;

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{Density, Layout, World};
use crate::reconstruct::joint::compare::{PairedCv, Validated, compare, validate, validate_sun};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::gloss::{self, Sharpness, sharpen};
use crate::reconstruct::joint::indirect::{Indirect, Settled};
use crate::reconstruct::joint::lamps::{self, COLUMNS, Candidates};
use crate::reconstruct::joint::light_model::LightModel;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::seen_sky::SeenSky;
use crate::reconstruct::joint::sun::Directions;
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
    seen_sky: Option<Arc<SeenSky>>,
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
    let mut first = LightModel::new(problem, &layout(World::Room))?;
    let worlds = Worlds { environment, sky: layout(World::Open), seen_sky, from: &fine };
    let (mut chosen, mut problem) = lights(problem, &places, &first, &worlds)?;
    if first.is_glossy() {
        // Lamps stand better where highlights have their true sharpness, and I_s its part from
        // glossy surfaces.
        let (gloss, trials) = gloss::choose(&problem, chosen.best.fitted)?;
        let Settled { problem: settled, fitted, .. } = indirect.settle(&problem, gloss.fitted)?;
        first.gloss.clone_from(&fitted.model.gloss);
        (chosen, problem) = lights(&settled.with_sky(None), &places, &first, &worlds)?;
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

/// Where unknown light may come from.
struct Worlds<'a> {
    environment: Environment,
    /// The cells of a sky.
    sky: Layout,
    seen_sky: Option<Arc<SeenSky>>,
    /// All models are fitted from this one, so that where that one started has no effect.
    from: &'a Fitted,
}

/// The lights of a room, of the open sky, or of the sky that photographs show, with the problem that
/// they are for; `problem` is without that sky. A sky is left where a room with its lamps predicts
/// better.
fn lights<'a>(
    problem: &Problem<'a>,
    places: &Places,
    room: &LightModel,
    worlds: &Worlds,
) -> Result<(Step, Problem<'a>), Error> {
    let start = |problem: &Problem, model: &LightModel| -> Result<Step, Error> {
        Ok(Step::new(validate(problem, fit(problem, model, Some(worlds.from), ROUGH)?)?))
    };
    let grown = |problem: &Problem, start: Step| -> Result<Step, Error> {
        prune(problem, grow(problem, places, start, problem.options().max_lamps)?)
    };
    if worlds.environment == Environment::Room || !room.has_unknown_light() {
        return Ok((grown(problem, start(problem, room)?)?, problem.clone()));
    }
    // A sun first, which many cells would imitate; whether these leave anything to it is seen when
    // parts are taken away.
    let of_sky = |problem: &Problem, sun: Option<Part>| -> Result<Step, Error> {
        let mut model = LightModel::new(problem, &worlds.sky)?;
        model.gloss.clone_from(&room.gloss);
        let model = match sun {
            Some(sun) => model.with(sun),
            None => model,
        };
        grow(problem, places, start(problem, &model)?, 0)
    };
    let sun_of = |step: &Step| step.best.fitted.model.sun().cloned();
    let is_open = worlds.environment == Environment::Open;
    let room = if is_open { None } else { Some(grown(problem, start(problem, room)?)?) };
    // A sky that explains as much as a room with its lamps needs none.
    let mut best = of_sky(problem, room.as_ref().and_then(sun_of))?;
    if is_open {
        best = grown(problem, best)?;
    }
    let mut of = problem.clone();
    if let Some(sky) = &worlds.seen_sky {
        // It is drawn as finely as openings need, and may shine into a room with lamps.
        let seen = problem.with_sky(Some(sky.clone()));
        let sky_seen = of_sky(&seen, sun_of(&best))?;
        let sky_seen = grown(&seen, denser(&seen, sky_seen)?)?;
        let cv = compare(problem, &best.best, &sky_seen.best);
        if cv.is_better() {
            (best, of) = (sky_seen, seen);
        }
        best.trials.push(cv.trial(TrialPart::SeenSky(sky.cells.len())));
    }
    if let Some(room) = room {
        let cv = compare(problem, &best.best, &room.best);
        if cv.is_better() {
            (best, of) = (room, problem.clone());
        }
        best.trials.push(cv.trial(TrialPart::Room));
    }
    Ok((best, of))
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

/// Adds lamps and a sun while they are needed. Two lamps may be needed of which neither is alone.
fn grow(problem: &Problem, places: &Places, mut step: Step, most: usize) -> Result<Step, Error> {
    (places.report)(problem, &step.best.fitted);
    let mut ahead: Option<Validated> = None;
    'growing: loop {
        let from = ahead.as_ref().unwrap_or(&step.best).fitted.clone();
        let lamps = from.model.lamps();
        let mut lamp = if lamps < most { with_lamp(problem, places, &from)? } else { None };
        let falls_by = |fitted: &Fitted| from.cost() - fitted.cost();
        let (starts, promised) = match from.model.sun() {
            None => places.suns.first(problem, &from),
            Some(_) => (Vec::new(), 0.0),
        };
        // A sun may come first where a rough direction explains half as much as the best lamp.
        let mut sun = None;
        if promised > 0.5 * lamp.as_ref().map_or(0.0, falls_by) {
            sun = with_sun(problem, places, &from, &starts)?;
        }
        let is_sun_first = sun.as_ref().map_or(0.0, falls_by) > lamp.as_ref().map_or(0.0, falls_by);
        let mut kinds = [TrialPart::Lamp(lamps + 1), TrialPart::Sun];
        if is_sun_first {
            kinds.reverse();
        }
        let mut rejected = None;
        for part in kinds {
            let proposal = match part {
                TrialPart::Sun if sun.is_none() => with_sun(problem, places, &from, &starts)?,
                TrialPart::Sun => sun.take(),
                _ => lamp.take(),
            };
            let Some(proposal) = proposal.filter(|fitted| falls_by(fitted) > 0.0) else { continue };
            let (cv, proposal) = if part == TrialPart::Sun {
                judge_sun(problem, places, &step.best, proposal)?
            } else {
                let proposal = validate(problem, settle(problem, places, proposal)?)?;
                (compare(problem, &step.best, &proposal), proposal)
            };
            step.trials.push(cv.trial(part));
            if cv.is_better() {
                (places.report)(problem, &proposal.fitted);
                (step.best, ahead) = (proposal, None);
                continue 'growing;
            }
            if part != TrialPart::Sun {
                rejected = Some(proposal);
            }
        }
        match rejected {
            Some(lamp) if ahead.is_none() => ahead = Some(lamp),
            _ => return Ok(step),
        }
    }
}

/// Whether a sun comes in: first in the direction that all rows found, which is too well of it, then, where
/// that is better, without each fold.
fn judge_sun(
    problem: &Problem,
    places: &Places,
    best: &Validated,
    with_sun: Fitted,
) -> Result<(PairedCv, Validated), Error> {
    let rough = validate(problem, with_sun)?;
    let cv = compare(problem, best, &rough);
    if !cv.is_better() {
        return Ok((cv, rough));
    }
    let settled = settle(problem, places, rough.fitted)?;
    let judged = validate_sun(problem, settled, places.suns)?;
    Ok((compare(problem, best, &judged), judged))
}

/// The model with the sun that explains most, about some directions; `None` where it explains nothing.
fn with_sun(
    problem: &Problem,
    places: &Places,
    from: &Fitted,
    starts: &[Vec3],
) -> Result<Option<Fitted>, Error> {
    let Some(towards) = places.suns.best(problem, from, starts)? else { return Ok(None) };
    let model = from.model.with(Part::sun(problem, towards)?);
    Ok(Some(fit(problem, &model, Some(from), ROUGH)?))
}

/// The model with the lamp that explains most; `None` where nothing explains anything.
fn with_lamp(problem: &Problem, places: &Places, from: &Fitted) -> Result<Option<Fitted>, Error> {
    let Some((lamp, _)) = places.lamps.best(problem, from) else { return Ok(None) };
    let lamp = places.lamps.refine(problem, from, lamp, None)?;
    let model = from.model.with(Part::lamp(problem, lamp)?);
    Ok(Some(fit(problem, &model, Some(from), ROUGH)?))
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
                let moved = places.suns.refine(problem, &fitted, towards, slot)?;
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
        && let Some(next) = with_lamp(problem, &places, &fitted)?
        && next.cost() < fitted.cost()
    {
        fitted = next;
    }
    settle(problem, &places, fitted)
}

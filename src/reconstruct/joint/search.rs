//! The light model that a scene needs: parts are proposed by what they could explain, and come in
//! or go by one rule ([`compare`]).
//!
//! Each step adds the light that explains most of what is left and moves all others to their best
//! places (alternating descent conditional gradient: Boyd, Schiebinger, Recht 2017); parts that are
//! not needed any more are taken away at the end.

use std::cmp::Ordering;
use std::sync::Arc;

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::{Density, Layout, World};
use crate::reconstruct::joint::compare::{PairedCv, Validated, compare, validate};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::gloss::{self, Sharpness, sharpen};
use crate::reconstruct::joint::grow::{Places, Step, grow, prune, settle, with_lamp};
use crate::reconstruct::joint::indirect::{Indirect, Settled};
use crate::reconstruct::joint::lamps::{self, COLUMNS, Candidates};
use crate::reconstruct::joint::light_model::LightModel;
use crate::reconstruct::joint::part::Part;
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::seen_sky::SeenSky;
use crate::reconstruct::joint::sun::Directions;
use crate::reconstruct::solution::{Trial, TrialPart};
use crate::scene::{Emitter, Environment, Gloss, KnownLight};

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

/// Times that the cells of a sky are doubled at most: to about 14° across.
const DOUBLINGS: usize = 3;

/// Chooses the light and the gloss. `undecided` is the sky that photographs show, if it is not known
/// yet whether it lights the scene, `fine` a fit of many fine lobes without lamps, `surfaces`
/// whether known surfaces that no photograph shows may shine.
///
/// # Errors
/// If it is cancelled, or if the bounded least squares of a fit fails.
pub fn search<'a>(
    problem: &Problem<'a>,
    undecided: Option<Arc<SeenSky>>,
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
    let first = LightModel::new(problem, &layout(World::Room))?;
    let worlds = Worlds { environment, sky: layout(World::Open), undecided, from: &fine };
    let sky = problem.sky.clone();
    let lit = lights(problem, &places, &first, &worlds, None)?;
    // What is handed on as known is not tried again.
    let is_handed_on = |trial: &&Trial| {
        matches!(trial.part, TrialPart::SeenSky(_) | TrialPart::Room | TrialPart::Sun)
    };
    let handed_on: Vec<Trial> = lit.step.trials.iter().filter(is_handed_on).cloned().collect();
    let known = (lit.unknown, lit.step.best.fitted.model.sun().cloned());
    let lights_of = |settled: &Problem<'a>, gloss: &[Option<Gloss>]| -> Result<Lit<'a>, Error> {
        let first = LightModel { gloss: gloss.to_vec(), ..first.clone() };
        let settled = settled.with_sky(sky.clone());
        let mut lit = lights(&settled, &places, &first, &worlds, Some(known.clone()))?;
        lit.step.trials.extend(handed_on.clone());
        Ok(lit)
    };
    let Lit { step: chosen, mut problem, .. } = if first.is_glossy() {
        let (gloss, trials) = gloss::choose(&lit.problem, lit.step.best.fitted)?;
        let mut again = in_turn(lit.problem, gloss.fitted, None, indirect, lights_of)?;
        again.step.trials.extend(trials);
        again
    } else if indirect.has_patches() {
        let fitted = lit.step.best.fitted.clone();
        in_turn(lit.problem.clone(), fitted, Some(lit), indirect, lights_of)?
    } else {
        lit
    };
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
        let (sharp, found) = sharpen(&problem, best.fitted.clone())?;
        (best, sharpness) = (validate(&problem, sharp, Some(&best))?, found);
    }
    if indirect.has_patches() {
        // What unphotographed surfaces reflect depends on the lights and the density, which have
        // changed. The lights were chosen with the earlier value and may fit worse with the new one.
        let Settled { problem: after, fitted, .. } =
            indirect.settle(&problem, best.fitted.clone())?;
        let settled = validate(&after, fitted, None)?;
        if compare(&problem, &best, &settled).change < 0.0 {
            (best, problem) = (settled, after);
        }
    }
    Ok(Found { lamps, suns, problem, best, is_fine, trials, candidates, sharpness })
}

/// Times that I_s, the lights and the sharpness of the lobes are found one after the other. With two, the
/// search stays in a wrong minimum with two of 14 seeds of `corner-glossy`, as it does with one.
const TURNS: usize = 3;

/// Computes I_s with the lights given, looks for the lights with that I_s, and for the sharpness of the
/// lobes with these lights, in turn, until the lobes change no more. Lamps are placed better if
/// highlights have their true sharpness, and if the light that unphotographed and glossy surfaces reflect
/// was computed with the lamps. But light that is too bright, lobes that are too blunt and surfaces that
/// are too dark fit a glossy room nearly as well as the truth. And a lamp beside an unphotographed surface
/// is found too bright if what that surface reflects of it is missing in I_s. A further turn may lead into
/// such a minimum as well as out of it, so the lights with the least held-out error are taken. `found` has
/// lights that were found before, which are compared with them.
fn in_turn<'a>(
    mut problem: Problem<'a>,
    mut fitted: Fitted,
    found: Option<Lit<'a>>,
    indirect: &Indirect,
    lights_of: impl Fn(&Problem<'a>, &[Option<Gloss>]) -> Result<Lit<'a>, Error>,
) -> Result<Lit<'a>, Error> {
    let mut best = found;
    for turn in 0..TURNS {
        if turn > 0 {
            let (sharp, _) = sharpen(&problem, fitted.clone())?;
            if sharp.model.gloss == fitted.model.gloss {
                break;
            }
            fitted = sharp;
        }
        let settled = indirect.settle(&problem, fitted)?;
        let lit = lights_of(&settled.problem, &settled.fitted.model.gloss)?;
        (problem, fitted) = (lit.problem.clone(), lit.step.best.fitted.clone());
        let is_better =
            |best: &Lit| compare(&problem, &best.step.best, &lit.step.best).change < 0.0;
        if best.as_ref().is_none_or(is_better) {
            best = Some(lit);
        }
    }
    Ok(best.expect("there is at least one turn"))
}

/// Where unknown light may come from.
struct Worlds<'a> {
    environment: Environment,
    /// The cells of a sky.
    sky: Layout,
    /// The sky that photographs show, if it is not known yet whether it lights the scene.
    undecided: Option<Arc<SeenSky>>,
    /// All models are fitted from this one, so that where that one started has no effect.
    from: &'a Fitted,
}

/// What unknown light comes from.
#[derive(Clone, Copy, PartialEq)]
enum Unknown {
    Room,
    Sky,
    /// The sky that photographs show, where that was undecided.
    SeenSky,
}

/// The lights that were chosen, with the problem that they are for.
struct Lit<'a> {
    step: Step,
    problem: Problem<'a>,
    unknown: Unknown,
}

impl Lit<'_> {
    fn lamps(&self) -> usize {
        self.step.best.fitted.model.lamps()
    }
}

/// Whether one world is taken in place of another. The one with fewer lamps is the simpler, in place of
/// which the other has to predict better beyond doubt. So has a sky of what photographs show beyond the
/// geometry, which may be near, in place of a room with as many lamps.
fn is_taken(cv: &PairedCv, before: &Lit, after: &Lit) -> bool {
    match after.lamps().cmp(&before.lamps()) {
        Ordering::Less => cv.change < cv.standard_error,
        Ordering::Equal if after.unknown != Unknown::SeenSky => cv.change < 0.0,
        Ordering::Equal | Ordering::Greater => cv.is_better(),
    }
}

/// The lights of a room, of the open sky, or of the sky that photographs show, whichever predicts
/// better (see [`is_taken`]). `known` tells which of them it is, and its sun, where that was found
/// before.
fn lights<'a>(
    problem: &Problem<'a>,
    places: &Places,
    room: &LightModel,
    worlds: &Worlds,
    known: Option<(Unknown, Option<Part>)>,
) -> Result<Lit<'a>, Error> {
    let start = |problem: &Problem, model: &LightModel| -> Result<Step, Error> {
        let fitted = fit(problem, model, Some(worlds.from), ROUGH)?;
        Ok(Step::new(validate(problem, fitted, None)?))
    };
    let grown = |problem: &Problem, start: Step| -> Result<Step, Error> {
        prune(problem, grow(problem, places, start, problem.options().max_lamps)?)
    };
    let is_open = worlds.environment == Environment::Open;
    let is_room = worlds.environment == Environment::Room || !room.has_unknown_light();
    let (known, mut sun) = known.map_or((None, None), |(unknown, sun)| (Some(unknown), sun));
    let may_be = |unknown: Unknown| {
        known.is_none_or(|known| known == unknown)
            && if unknown == Unknown::Room { is_room || !is_open } else { !is_room }
    };
    // A sun first, which many cells would imitate; whether these leave anything to it is seen when
    // parts are taken away. A sky that photographs show is drawn as finely as openings need, and may
    // shine into a room with lamps.
    let of_sky = |problem: &Problem, sun: Option<Part>| -> Result<Step, Error> {
        let mut model = LightModel::new(problem, &worlds.sky)?;
        model.gloss.clone_from(&room.gloss);
        let model = match sun {
            Some(sun) => model.with(sun),
            None => model,
        };
        let sky = grow(problem, places, start(problem, &model)?, 0)?;
        if problem.sky.is_some() {
            grown(problem, denser(problem, sky)?)
        } else if is_open {
            grown(problem, sky)
        } else {
            Ok(sky)
        }
    };
    let sun_of = |step: &Step| step.best.fitted.model.sun().cloned();
    let lit =
        |step, problem: &Problem<'a>, unknown| Lit { step, problem: problem.clone(), unknown };
    let mut of_room = None;
    if may_be(Unknown::Room) {
        let room = grown(problem, start(problem, room)?)?;
        sun = sun.or_else(|| sun_of(&room));
        of_room = Some(lit(room, problem, Unknown::Room));
    }
    let mut found = Vec::new();
    if may_be(Unknown::Sky) {
        let sky = of_sky(problem, sun.clone())?;
        sun = sun.or_else(|| sun_of(&sky));
        found.push(lit(sky, problem, Unknown::Sky));
    }
    found.extend(of_room);
    if let Some(sky) = worlds.undecided.as_ref().filter(|_| may_be(Unknown::SeenSky)) {
        let seen = problem.with_sky(Some(sky.clone()));
        let shown = of_sky(&seen, sun)?;
        // Where lamps stand is seen better before a sky than among the lobes of a room, which may
        // imitate those beside them.
        let own = found.iter_mut().find(|lit| lit.unknown == Unknown::Room);
        if let Some(own) = own.filter(|_| shown.best.fitted.model.lamps() > 0) {
            let lamps = shown.best.fitted.model.parts.iter().filter(|part| part.is_lamp());
            let model = lamps.fold(room.clone(), |model, lamp| model.with(lamp.clone()));
            let again = grown(problem, start(problem, &model)?)?;
            if compare(problem, &own.step.best, &again.best).change < 0.0 {
                own.step = again;
            }
        }
        found.push(lit(shown, &seen, Unknown::SeenSky));
    }
    let mut found = found.into_iter();
    let mut best = found.next().expect("a room, a sky or either is always looked for");
    let mut trials = Vec::new();
    for next in found {
        let cv = compare(problem, &best.step.best, &next.step.best);
        let supported = is_taken(&cv, &best, &next);
        let part = match (next.unknown, &worlds.undecided) {
            (Unknown::SeenSky, Some(sky)) => TrialPart::SeenSky(sky.cells.len()),
            _ => TrialPart::Room,
        };
        trials.push(Trial { supported, ..cv.trial(part) });
        if supported {
            best = next;
        }
    }
    best.step.trials.extend(trials);
    Ok(best)
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
    let fitted = fit(problem, &model, Some(fitted), ROUGH)?;
    Ok(Some(validate(problem, fitted, None)?))
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
        let fine = validate(problem, fit(problem, &model, Some(&fine), ROUGH)?, None)?;
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
    {
        fitted = next;
    }
    settle(problem, &places, fitted)
}

//! Lamps and a sun come in one by one, by what they could explain, and go where they are not needed.

use crate::reconstruct::Error;
use crate::reconstruct::joint::compare::{PairedCv, Validated, compare, validate, validate_sun};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::lamps::Candidates;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::sun::Directions;
use crate::reconstruct::solution::{Trial, TrialPart};

/// What a search looks for, and where.
pub struct Places<'a> {
    pub lamps: &'a Candidates,
    pub suns: &'a Directions,
    pub report: &'a dyn Fn(&Problem, &Fitted),
}

/// A model and the comparisons that led to it.
pub struct Step {
    pub best: Validated,
    pub trials: Vec<Trial>,
}

impl Step {
    pub fn new(best: Validated) -> Self {
        Self { best, trials: Vec::new() }
    }
}

/// Adds lamps and a sun while they are needed. Two lamps may be needed of which neither is alone.
pub fn grow(
    problem: &Problem,
    places: &Places,
    mut step: Step,
    most: usize,
) -> Result<Step, Error> {
    (places.report)(problem, &step.best.fitted);
    let mut ahead: Option<Validated> = None;
    'growing: loop {
        let from = ahead.as_ref().unwrap_or(&step.best).fitted.clone();
        let lamps = from.model.lamps();
        let falls_by = |fitted: &Fitted| from.cost() - fitted.cost();
        let lamp = if lamps < most { with_lamp(problem, places, &from)? } else { None };
        let lamp = lamp.filter(|lamp| falls_by(lamp) > 0.0);
        let lamp_falls = lamp.as_ref().map_or(0.0, falls_by);
        let (starts, promised) = match from.model.sun() {
            None => places.suns.first(problem, &from),
            Some(_) => (Vec::new(), 0.0),
        };
        // A sun may come first where a rough direction explains half as much as the best lamp.
        let mut sun = None;
        if promised > 0.5 * lamp_falls {
            sun = places.suns.add(problem, &from, &starts)?;
        }
        let is_sun_first = sun.as_ref().map_or(0.0, falls_by) > lamp_falls;
        let settled = |lamp| validate(problem, settle(problem, places, lamp)?);
        let lamp = lamp.map(settled).transpose()?;
        let mut kinds = [TrialPart::Lamp(lamps + 1), TrialPart::Sun];
        if is_sun_first {
            kinds.reverse();
        }
        for part in kinds {
            let judged = if part == TrialPart::Sun {
                let sun = match sun.take() {
                    None => places.suns.add(problem, &from, &starts)?,
                    found => found,
                };
                let sun = sun.filter(|sun| falls_by(sun) > 0.0);
                let judge = |sun| judge_sun(problem, places, &step.best, sun);
                sun.map(judge).transpose()?
            } else {
                lamp.clone().map(|lamp| (compare(problem, &step.best, &lamp), lamp))
            };
            let Some((cv, proposal)) = judged else { continue };
            step.trials.push(cv.trial(part));
            if cv.is_better() {
                (places.report)(problem, &proposal.fitted);
                (step.best, ahead) = (proposal, None);
                continue 'growing;
            }
        }
        match lamp {
            Some(lamp) if ahead.is_none() => ahead = Some(lamp),
            _ => return Ok(step),
        }
    }
}

/// Whether a sun comes in: first in the direction that all rows found, then, where that is better, in
/// directions that were found without the blocks that judge them.
fn judge_sun(
    problem: &Problem,
    places: &Places,
    best: &Validated,
    with_sun: Fitted,
) -> Result<(PairedCv, Validated), Error> {
    let sun = validate(problem, settle(problem, places, with_sun)?)?;
    let cv = compare(problem, best, &sun);
    if !cv.is_better() {
        return Ok((cv, sun));
    }
    let blind = validate_sun(problem, sun.fitted.clone(), places.suns)?;
    Ok((compare(problem, best, &blind), sun))
}

/// The model with the lamp that explains most; `None` where nothing explains anything.
pub fn with_lamp(
    problem: &Problem,
    places: &Places,
    from: &Fitted,
) -> Result<Option<Fitted>, Error> {
    let Some((lamp, _)) = places.lamps.best(problem, from) else { return Ok(None) };
    let lamp = places.lamps.refine(problem, from, lamp, None)?;
    let model = from.model.with(Part::lamp(problem, lamp)?);
    Ok(Some(fit(problem, &model, Some(from), ROUGH)?))
}

/// Moves every lamp and the sun to its best place, the others given.
pub fn settle(problem: &Problem, places: &Places, mut fitted: Fitted) -> Result<Fitted, Error> {
    for slot in fitted.model.parts.iter().map(|part| part.slot).collect::<Vec<_>>() {
        let part = fitted.model.parts.iter().find(|part| part.slot == slot);
        let Some(PartKind::Lamp(lamp)) = part.map(|part| part.kind) else { continue };
        let moved = places.lamps.refine(problem, &fitted, lamp, Some(slot))?;
        if moved == lamp {
            continue;
        }
        let model = fitted.model.replacing(slot, Part::lamp(problem, moved)?);
        let again = fit(problem, &model, Some(&fitted), ROUGH)?;
        if again.cost() < fitted.cost() {
            fitted = again;
        }
    }
    places.suns.settle(problem, fitted)
}

/// Takes away every lamp, and the sun, without which blocks are not predicted worse.
pub fn prune(problem: &Problem, mut step: Step) -> Result<Step, Error> {
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

//! Adds lamps and a sun to a light model one by one, those first that would reduce the residuals
//! most, and removes those that are not needed.

use crate::reconstruct::Error;
use crate::reconstruct::joint::compare::{Validated, compare, validate, validate_sun};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::lamps::Candidates;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::sun::Directions;
use crate::reconstruct::solution::{Trial, TrialPart};

/// The candidates of a search: places of lamps and directions of a sun.
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

/// Adds lamps and a sun as long as they lower the held-out error. Two lamps may do so together
/// where neither does alone.
pub fn grow(
    problem: &Problem,
    places: &Places,
    mut step: Step,
    most: usize,
) -> Result<Step, Error> {
    (places.report)(problem, &step.best.fitted);
    let mut ahead: Option<Validated> = None;
    'growing: loop {
        let before = ahead.as_ref().unwrap_or(&step.best);
        let from = &before.fitted;
        let lamps = from.model.lamps();
        let falls_by = |fitted: &Fitted| from.cost() - fitted.cost();
        let mut lamp = if lamps < most { with_lamp(problem, places, from)? } else { None };
        let lamp_falls = lamp.as_ref().map_or(0.0, falls_by);
        let (starts, promised) = match from.model.sun() {
            None => places.suns.first(problem, from),
            Some(_) => (Vec::new(), 0.0),
        };
        // A sun may come first where a rough direction explains half as much as the best lamp.
        let mut sun = None;
        if promised > 0.5 * lamp_falls {
            sun = places.suns.add(problem, from, &starts)?;
        }
        let is_sun_first = sun.as_ref().map_or(0.0, falls_by) > lamp_falls;
        let mut kinds = [TrialPart::Lamp(lamps + 1), TrialPart::Sun];
        if is_sun_first {
            kinds.reverse();
        }
        let mut rejected = None;
        for part in kinds {
            let proposal = match part {
                TrialPart::Sun if sun.is_none() => places.suns.add(problem, from, &starts)?,
                TrialPart::Sun => sun.take(),
                _ => lamp.take(),
            };
            let Some(proposal) = proposal else { continue };
            let proposal = settle(problem, places, proposal)?;
            let proposal = validate(problem, proposal, Some(before))?;
            let mut cv = compare(problem, &step.best, &proposal);
            if part == TrialPart::Sun && cv.is_better() {
                // Its direction was found with the blocks that have judged it.
                let blind = validate_sun(problem, proposal.fitted.clone(), places.suns)?;
                cv = compare(problem, &step.best, &blind);
            }
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

/// The model with the lamp that lowers the squared residuals most; `None` if no lamp lowers them.
pub fn with_lamp(
    problem: &Problem,
    places: &Places,
    from: &Fitted,
) -> Result<Option<Fitted>, Error> {
    let Some((lamp, _)) = places.lamps.best(problem, from) else { return Ok(None) };
    let lamp = places.lamps.refine(problem, from, lamp, None)?;
    let model = from.model.with(Part::lamp(problem, lamp)?);
    let fitted = fit(problem, &model, Some(from), ROUGH)?;
    Ok(Some(fitted).filter(|fitted| fitted.cost() < from.cost()))
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

/// Removes lamps and the sun as long as the held-out error is not larger than with all of them by
/// more than its standard error. If each step were compared only with the one before, one part
/// after the other could be removed, each within its standard error, until little is left.
pub fn prune(problem: &Problem, mut step: Step) -> Result<Step, Error> {
    let found = |part: &&Part| matches!(part.kind, PartKind::Lamp(_) | PartKind::Sun(_));
    let slots: Vec<usize> =
        step.best.fitted.model.parts.iter().filter(found).map(|part| part.slot).collect();
    let all = step.best.clone();
    for slot in slots {
        let model = step.best.fitted.model.without(slot);
        let without = fit(problem, &model, Some(&step.best.fitted), ROUGH)?;
        let without = validate(problem, without, Some(&step.best))?;
        if !compare(problem, &without, &all).is_better() {
            step.best = without;
        }
    }
    Ok(step)
}

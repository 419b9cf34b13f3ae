//! Lamps and a sun come in one by one, by what they could explain, and go where they are not needed.

use crate::reconstruct::Error;
use crate::reconstruct::joint::compare::{Validated, compare, validate};
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::lamps::Candidates;
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::sun::{self, Directions};
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

/// Adds lamps and a sun while they are needed. Two may be needed of which neither is alone.
pub fn grow(
    problem: &Problem,
    places: &Places,
    mut step: Step,
    most: usize,
) -> Result<Step, Error> {
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
pub fn propose(
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
pub fn settle(problem: &Problem, places: &Places, mut fitted: Fitted) -> Result<Fitted, Error> {
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

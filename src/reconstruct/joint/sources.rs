//! The lights that stand out: lamps and a sun, found one by one over a coarse background.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::LightSet;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::judge::Judge;
use crate::reconstruct::joint::lamps::{COLUMNS, Candidates, Lamp};
use crate::reconstruct::joint::model::{Model, Part};
use crate::reconstruct::joint::project::Linearised;
use crate::reconstruct::joint::sun;
use crate::reconstruct::lights::{LightKind, VirtualLight};
use crate::reconstruct::solution::TrialPart;
use crate::scene::Emitter;

/// A model with the lights that were found, and its fit.
#[derive(Clone)]
pub struct Found {
    pub lamps: Vec<Lamp>,
    /// Their columns.
    pub parts: Vec<Arc<Part>>,
    /// Unit direction towards a sun that was found.
    pub sun: Option<Vec3>,
    pub model: Model,
    pub fits: Fits,
}

impl Found {
    pub fn without_lamps(model: Model, sun: Option<Vec3>, fits: Fits) -> Self {
        Self { lamps: Vec::new(), parts: Vec::new(), sun, model, fits }
    }
}

/// Half the angle that the sun subtends, in radians.
const SUN_HALF_ANGLE: f32 = 0.5 * Emitter::SUN_DIAMETER;
/// Before the others have moved, a new lamp must have this part of the gain that it needs.
const FIRST_GAIN: f64 = 0.5;

/// What is looked for over a background.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    pub candidates: &'a Candidates,
    pub most_lamps: usize,
    pub may_find_sun: bool,
    /// Hears of every fit that is kept.
    pub report: &'a dyn Fn(&Found),
    /// Says of a light that lowers the objective enough whether it is kept.
    pub judge: Option<&'a Judge>,
}

impl<'a> Wanted<'a> {
    /// Lamps, with no further word on them.
    pub fn lamps(candidates: &'a Candidates, most_lamps: usize) -> Self {
        Self { candidates, most_lamps, may_find_sun: false, report: &|_| (), judge: None }
    }

    fn keeps(
        &self,
        fitter: &Fitter,
        lambda: f64,
        part: TrialPart,
        pair: [&Found; 2],
    ) -> Result<bool, Error> {
        self.judge.map_or(Ok(true), |judge| judge.keeps(fitter, lambda, part, pair))
    }
}

/// Adds lamps, and a sun where one may be found, to a background while they lower the objective
/// by as much as the options ask for, and the judge keeps them.
pub fn find(
    fitter: &Fitter,
    background: &Model,
    lambda: f64,
    wanted: Wanted,
) -> Result<Found, Error> {
    let Wanted { candidates, most_lamps, may_find_sun, report, .. } = wanted;
    let fits = fitter.fit(background, lambda, &fitter.weights, None)?;
    let mut found = Found::without_lamps(background.clone(), None, fits);
    report(&found);
    let mut base = background.clone();
    // A sun may show itself only after the lamps that outshine it: two tries.
    let mut tries = if may_find_sun { 2 } else { 0 };
    // The last model that was kept, where a lamp after it is not: two lamps may be borne out that
    // are not one by one.
    let mut kept = None;
    while found.lamps.len() < most_lamps || tries > 0 {
        let before = Fitter::total(&found.fits);
        let lamp = if found.lamps.len() < most_lamps {
            next_lamp(fitter, &found, &base, lambda, candidates)?
        } else {
            None
        };
        if tries > 0 {
            tries -= 1;
            let rival = lamp.as_ref().map_or(before, |with| Fitter::total(&with.fits));
            if let Some((sunny_base, sunny)) = with_sun(fitter, &found, &base, lambda)?
                && Fitter::total(&sunny.fits) < rival
                && Fitter::total(&sunny.fits) < (1.0 - fitter.options.sun_gain) * before
                && wanted.keeps(
                    fitter,
                    lambda,
                    TrialPart::Sun,
                    [kept.as_ref().unwrap_or(&found), &sunny],
                )?
            {
                (base, found, kept) = (sunny_base, sunny, None);
                tries = 0;
                report(&found);
                continue;
            }
        }
        let Some(mut with) = lamp else { break };
        if Fitter::total(&with.fits) > (1.0 - FIRST_GAIN * fitter.options.lamp_gain) * before {
            break;
        }
        settle_lamps(fitter, &mut with, &base, lambda, candidates)?;
        if Fitter::total(&with.fits) > (1.0 - fitter.options.lamp_gain) * before {
            break;
        }
        let part = TrialPart::Lamp(with.lamps.len());
        let is_kept =
            wanted.keeps(fitter, lambda, part, [kept.as_ref().unwrap_or(&found), &with])?;
        if is_kept {
            kept = None;
        } else if kept.is_some() {
            break;
        } else {
            kept = Some(found);
        }
        found = with;
        report(&found);
    }
    Ok(kept.unwrap_or(found))
}

/// The lights that were found with some of the samples, fitted to all of the fitter's, over its own
/// `background`.
pub fn place(
    fitter: &Fitter,
    background: &Model,
    lambda: f64,
    found: &Found,
) -> Result<Found, Error> {
    let base = match found.sun {
        Some(towards) => sunny(fitter, background, towards)?,
        None => background.clone(),
    };
    let part = |lamp: &Lamp| -> Result<Arc<Part>, Error> {
        let mut set = LightSet::default();
        set.push_lamp(*lamp);
        Ok(Arc::new(fitter.data.part(&fitter.rows, set, &fitter.exponents)?))
    };
    let parts = found.lamps.iter().map(part).collect::<Result<Vec<_>, Error>>()?;
    let model = base.with(parts.iter().map(AsRef::as_ref));
    let fits = fitter.fit(&model, lambda, &fitter.weights, Some(&found.fits))?;
    Ok(Found { lamps: found.lamps.clone(), parts, sun: found.sun, model, fits })
}

/// The model with the lamp that explains most, in the place that explains most.
fn next_lamp(
    fitter: &Fitter,
    found: &Found,
    base: &Model,
    lambda: f64,
    candidates: &Candidates,
) -> Result<Option<Found>, Error> {
    let lamp = linearised(fitter, found, lambda, |problems| {
        let Some(lamp) = candidates.best(problems, &fitter.exponents) else { return Ok(None) };
        Ok(Some(candidates.refine(fitter, lamp, problems, 0..0)?))
    })?;
    let Some(lamp) = lamp else { return Ok(None) };
    Ok(Some(with_lamp(fitter, found, base, lambda, found.lamps.len(), lamp)?))
}

/// Moves every lamp to its best place, the others given.
fn settle_lamps(
    fitter: &Fitter,
    found: &mut Found,
    base: &Model,
    lambda: f64,
    candidates: &Candidates,
) -> Result<(), Error> {
    for index in 0..found.lamps.len() {
        let moved = linearised(fitter, found, lambda, |problems| {
            let columns = columns_of(base, index);
            Ok(candidates.refine(fitter, found.lamps[index], problems, columns)?)
        })?;
        if moved == found.lamps[index] {
            continue;
        }
        let again = with_lamp(fitter, found, base, lambda, index, moved)?;
        if Fitter::total(&again.fits) < Fitter::total(&found.fits) {
            *found = again;
        }
    }
    Ok(())
}

fn columns_of(base: &Model, lamp: usize) -> Range<usize> {
    let first = base.columns() + COLUMNS * lamp;
    first..first + COLUMNS
}

/// The model with one lamp replaced, or added after the others.
fn with_lamp(
    fitter: &Fitter,
    found: &Found,
    base: &Model,
    lambda: f64,
    index: usize,
    lamp: Lamp,
) -> Result<Found, Error> {
    let mut set = LightSet::default();
    set.push_lamp(lamp);
    let part = Arc::new(fitter.data.part(&fitter.rows, set, &fitter.exponents)?);
    let (mut lamps, mut parts) = (found.lamps.clone(), found.parts.clone());
    lamps.truncate(index);
    lamps.push(lamp);
    parts.truncate(index);
    parts.push(part);
    lamps.extend(found.lamps.iter().skip(index + 1));
    parts.extend(found.parts.iter().skip(index + 1).cloned());
    let model = base.with(parts.iter().map(AsRef::as_ref));
    let fits = fitter.fit(&model, lambda, &fitter.weights, Some(&found.fits))?;
    Ok(Found { lamps, parts, sun: found.sun, model, fits })
}

/// The model with a sun where it explains most; without lamps, which are then found anew, since
/// those found before stood in for it.
fn with_sun(
    fitter: &Fitter,
    found: &Found,
    base: &Model,
    lambda: f64,
) -> Result<Option<(Model, Found)>, Error> {
    let towards = linearised(fitter, found, lambda, |problems| Ok(sun::search(fitter, problems)?))?;
    let Some(towards) = towards else { return Ok(None) };
    let model = sunny(fitter, base, towards)?;
    let fits = fitter.fit(&model, lambda, &fitter.weights, None)?;
    Ok(Some((model.clone(), Found::without_lamps(model, Some(towards), fits))))
}

/// Looks again for a sun's direction with all that was found since, and fits that.
pub fn settle_sun(
    fitter: &Fitter,
    found: Found,
    background: &Model,
    lambda: f64,
) -> Result<Found, Error> {
    let Some(towards) = found.sun else { return Ok(found) };
    let column = background.columns();
    let moved = linearised(fitter, &found, lambda, |problems| {
        Ok(sun::refine(fitter, problems, towards, column..column + 1)?)
    })?;
    let base = sunny(fitter, background, moved)?;
    let model = base.with(found.parts.iter().map(AsRef::as_ref));
    let fits = fitter.fit(&model, lambda, &fitter.weights, Some(&found.fits))?;
    let improved = Fitter::total(&fits) < Fitter::total(&found.fits);
    Ok(if improved { Found { sun: Some(moved), model, fits, ..found } } else { found })
}

/// A model with a sun of unknown irradiance.
pub fn sunny(fitter: &Fitter, base: &Model, towards: Vec3) -> Result<Model, Error> {
    let mut set = LightSet::default();
    set.push(VirtualLight::distant(LightKind::Sun, -towards, SUN_HALF_ANGLE), &[(-towards, 0.0)]);
    let part = fitter.data.part(&fitter.rows, set, &fitter.exponents)?;
    Ok(base.with([&part]))
}

fn linearised<T>(
    fitter: &Fitter,
    found: &Found,
    lambda: f64,
    then: impl FnOnce(&[Linearised]) -> Result<T, Error>,
) -> Result<T, Error> {
    let ridge = found.model.ridge(lambda);
    let centre = vec![0.0; ridge.len()];
    let problems: Vec<Linearised> = found
        .fits
        .iter()
        .enumerate()
        .map(|(channel, fit)| Linearised {
            channel: fitter.channel(&found.model, channel),
            terms: fitter.terms(&ridge, &centre, &fitter.weights, channel),
            fit,
        })
        .collect();
    then(&problems)
}

//! A model that is grown (`joint.model = auto`): lamps, a sun, gloss and finer light are added to a
//! coarse background only where they are borne out (`judge`), and looked for on a part of the
//! samples (`thin`); what is kept is fitted to all of them.

use crate::reconstruct::Error;
use crate::reconstruct::joint::background::World;
use crate::reconstruct::joint::certainty::Member;
use crate::reconstruct::joint::choice::{self, Choice, Density, background_model};
use crate::reconstruct::joint::fit::Fitter;
use crate::reconstruct::joint::held_out::{self, Change};
use crate::reconstruct::joint::history::History;
use crate::reconstruct::joint::judge;
use crate::reconstruct::joint::lamps::{COLUMNS, Candidates};
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::prepare::Fine;
use crate::reconstruct::joint::sources::{self, Found, Wanted};
use crate::reconstruct::joint::thin::Thin;
use crate::reconstruct::joint::{Chosen, choose_world, lamp_candidates, relook};
use crate::reconstruct::solution::{Selection, Trial, TrialPart};
use crate::scene::Environment;
use crate::watch::Watch;

pub(super) fn grow(
    fitter: &mut Fitter,
    thin: &Thin,
    (room, fine): (Model, Fine),
    history: &History,
    notes: &mut Vec<String>,
    watch: &Watch,
) -> Result<Chosen, Error> {
    let mut quick = thin.fitter(fitter);
    let candidates = lamp_candidates(&quick, &fine.model)?;
    let background = thin.model(fitter, &room);
    let mut choice = choose_world(&mut quick, background, &candidates, history, notes, watch)?;
    let of_lights = |trial: &Trial| match trial.part {
        TrialPart::Sun => 1,
        TrialPart::Lamp(_) => COLUMNS,
        _ => 0,
    };
    let mut tried =
        choice.background.columns() + choice.trials.iter().map(of_lights).sum::<usize>();
    let predicted = {
        let Found { model, fits, .. } = &choice.found;
        held_out::predict(&quick, model, fitter.options.ridge, fits)?.losses
    };
    let mut trials = std::mem::take(&mut choice.trials);
    let mut instead = None;
    if choice.background.columns() > 0 {
        let (trial, sparse) = sparser(&quick, &choice, &predicted)?;
        trials.push(trial);
        instead = sparse;
    }
    if fitter.data.views.capture.environment != Environment::Open {
        tried += fine.model.columns();
        let (trial, fine) = fine_instead(fitter, &quick, thin, &predicted, &fine)?;
        trials.push(trial);
        instead = fine.or(instead);
    }
    choice = Choice { trials, ..instead.unwrap_or(choice) };
    watch.tick()?;
    let exponents = choice.find_exponents(&mut quick)?;
    fitter.exponents.clone_from(&quick.exponents);
    fitter.matt.clone_from(&quick.matt);
    fitter.known_specular.clone_from(&quick.known_specular);
    let choice = on_all(fitter, choice, room, fine)?;
    history.push(fitter, &choice.found.fits);
    Ok(Chosen { choice, exponents, candidates, tried: Some(tried) })
}

/// Half as many of the background's lights under the same lamps, where the other half is not borne
/// out; `predicted` is what the choice with all of them predicts.
fn sparser(
    quick: &Fitter,
    choice: &Choice,
    predicted: &[f64],
) -> Result<(Trial, Option<Choice>), Error> {
    let ridge = quick.options.ridge;
    let density = Density::Sparse;
    let layout = choice::layout(quick, choice.layout.world, density, 0);
    let background = background_model(quick, &layout)?;
    let mut start = choice.found.clone();
    // The columns are others.
    start.fits.iter_mut().for_each(|fit| fit.state.emission.clear());
    let mut found = sources::place(quick, &background, ridge, &start)?;
    choice::tie_colours(quick, &mut found.model, &mut found.fits, ridge)?;
    let sparse = held_out::predict(quick, &found.model, ridge, &found.fits)?;
    let part = TrialPart::Background(choice.background.columns());
    let trial = judge::trial(part, &Change::between(quick, &sparse.losses, predicted, |_| true));
    let instead = (!trial.supported).then(|| Choice {
        layout,
        density,
        most_lamps: choice.most_lamps,
        background,
        found,
        held_out: sparse.error,
        trials: Vec::new(),
    });
    Ok((trial, instead))
}

/// Fine lobes, where they are borne out. They are not, without a further look, where even the
/// samples that they are fitted to are met no better than the others predict them.
fn fine_instead(
    fitter: &Fitter,
    quick: &Fitter,
    thin: &Thin,
    coarse: &[f64],
    fine: &Fine,
) -> Result<(Trial, Option<Choice>), Error> {
    let ridge = fitter.options.ridge;
    let mut model = thin.model(fitter, &fine.model);
    quick.data.set_irradiance(&quick.rows, &mut model, &quick.irradiance);
    quick.data.set_exponents(&quick.rows, &mut model, &quick.exponents);
    let fits = quick.fit(&model, ridge, &quick.weights, Some(&fine.fits))?;
    let at_best = Change::between(quick, coarse, &held_out::losses_within(quick, &fits), |_| true);
    if !at_best.is_supported() {
        return Ok((judge::trial(TrialPart::FineLobes, &at_best), None));
    }
    let predicted = held_out::predict(quick, &model, ridge, &fits)?;
    let change = Change::between(quick, coarse, &predicted.losses, |_| true);
    let trial = judge::trial(TrialPart::FineLobes, &change);
    let instead = match trial.supported {
        true => Some(Choice::fine(quick, fine.layout, model, fits, predicted.error)?),
        false => None,
    };
    Ok((trial, instead))
}

/// A choice that was made on a part of the samples, fitted to all.
fn on_all(fitter: &mut Fitter, choice: Choice, room: Model, fine: Fine) -> Result<Choice, Error> {
    let ridge = fitter.options.ridge;
    let mut background = match (choice.density, choice.layout.world) {
        (Density::Fine, _) => fine.model,
        (Density::Coarse, World::Room) => room,
        _ => background_model(fitter, &choice.layout)?,
    };
    let data = fitter.data;
    data.set_irradiance(&fitter.rows, &mut background, &fitter.irradiance);
    data.set_exponents(&fitter.rows, &mut background, &fitter.exponents);
    let mut found = sources::place(fitter, &background, ridge, &choice.found)?;
    if (0..fitter.rows.materials).any(|material| fitter.is_specular(material)) {
        fitter.irradiance = relook::irradiance(fitter, &found.model, &found.fits)?;
        data.set_irradiance(&fitter.rows, &mut background, &fitter.irradiance);
        data.set_irradiance(&fitter.rows, &mut found.model, &fitter.irradiance);
        found.fits = fitter.fit(&found.model, ridge, &fitter.weights, Some(&found.fits))?;
    }
    found = sources::settle_sun(fitter, found, &background, ridge)?;
    choice::tie_colours(fitter, &mut found.model, &mut found.fits, ridge)?;
    Ok(Choice { background, found, ..choice })
}

/// The reflectances with another background, its lamps found on a part of the samples.
pub fn member(
    fitter: &Fitter,
    quick: &Fitter,
    candidates: &Candidates,
    choice: &Choice,
    index: usize,
) -> Result<Member, Error> {
    if choice.most_lamps == 0 {
        return choice::member(fitter, candidates, choice, index);
    }
    let (thin, lambda) = choice::member_background(quick, choice, index)?;
    let found = sources::find(quick, &thin, lambda, Wanted::lamps(candidates, choice.most_lamps))?;
    let (background, _) = choice::member_background(fitter, choice, index)?;
    let found = sources::place(fitter, &background, lambda, &found)?;
    choice::settled(fitter, (found.model, found.fits), lambda)
}

/// What was tried, for the files, and in a sentence or two.
pub fn report(
    fitter: &Fitter,
    found: &Found,
    trials: Vec<Trial>,
    candidates: usize,
    kept: usize,
) -> (Selection, Vec<String>) {
    let selection = Selection { candidates, kept, trials };
    let mut light = vec![format!("candidates {candidates}, kept {kept}")];
    let lamps = found.lamps.len();
    light.push(format!("{lamps} lamp{} supported", if lamps == 1 { "" } else { "s" }));
    let last = selection.trials.iter().rfind(|trial| matches!(trial.part, TrialPart::Lamp(_)));
    light.push(match last {
        None => "none was tried".to_owned(),
        Some(last) if !last.supported => format!("more are not ({})", told(last)),
        _ if lamps == fitter.options.max_lamps => "more are not asked for".to_owned(),
        _ => "no other place explains more".to_owned(),
    });
    let mut gloss = Vec::new();
    for trial in &selection.trials {
        let verdict = if trial.supported { "supported" } else { "not supported" };
        let told = told(trial);
        match trial.part {
            TrialPart::Sun => light.push(format!("a sun is {verdict} ({told})")),
            TrialPart::Background(lobes) => {
                light.push(format!(
                    "a background of {lobes} lobes rather than half {verdict} ({told})"
                ));
            }
            TrialPart::FineLobes => light.push(format!("fine lobes {verdict} ({told})")),
            TrialPart::Beside(lobes) => light.push(told_beside(lobes, trial)),
            TrialPart::Gloss(material) => {
                let name = &fitter.data.views.capture.materials[material].name;
                gloss.push(format!("{name}: gloss {verdict} ({told})"));
            }
            TrialPart::Lamp(_) => {}
        }
    }
    let mut notes = vec![light.join("; ")];
    if !gloss.is_empty() {
        notes.push(gloss.join("; "));
    }
    (selection, notes)
}

/// What so many fine lobes beside the other lights come to.
pub fn told_beside(lobes: usize, trial: &Trial) -> String {
    format!(
        "{lobes} fine lobes beside the lights that were found, for these reflectances, are {} \
         (held-out {})",
        if trial.supported { "used" } else { "left out" },
        told(trial),
    )
}

fn told(trial: &Trial) -> String {
    match trial.standard_error {
        Some(error) => format!("error {:+.1} % ± {:.1} %", 100.0 * trial.change, 100.0 * error)
            .replace('-', "−"),
        None => "too few samples to tell".to_owned(),
    }
}

//! Whether a part of a model is borne out: kept where the error of blocks of samples that were
//! held out falls by more than its standard error.
//!
//! The two models predict the same blocks, and what is looked at is how much better one of them
//! predicts each: blocks differ far more among each other than models do.

use std::cell::RefCell;

use crate::reconstruct::Error;
use crate::reconstruct::joint::fit::{Fits, Fitter};
use crate::reconstruct::joint::held_out::{self, Change};
use crate::reconstruct::joint::model::Model;
use crate::reconstruct::joint::sources::Found;
use crate::reconstruct::solution::{Trial, TrialPart};

/// Keeps count of what was tried in one search.
#[derive(Default)]
pub struct Judge {
    /// The losses that the last model that was kept predicts.
    kept: RefCell<Option<Vec<f64>>>,
    trials: RefCell<Vec<Trial>>,
}

impl Judge {
    /// Whether the second of two models is kept rather than the first.
    pub fn keeps(
        &self,
        fitter: &Fitter,
        lambda: f64,
        part: TrialPart,
        [before, after]: [&Found; 2],
    ) -> Result<bool, Error> {
        let losses = |found: &Found| -> Result<Vec<f64>, Error> {
            Ok(held_out::predict(fitter, &found.model, lambda, &found.fits)?.losses)
        };
        let known = self.kept.borrow_mut().take();
        let without = known.map_or_else(|| losses(before), Ok)?;
        let with = losses(after)?;
        let change = Change::between(fitter, &without, &with, |_| true);
        let trial = trial(part, &change);
        *self.kept.borrow_mut() = Some(if trial.supported { with } else { without });
        self.trials.borrow_mut().push(trial);
        Ok(trial.supported)
    }

    pub fn into_trials(self) -> Vec<Trial> {
        self.trials.into_inner()
    }
}

pub fn trial(part: TrialPart, change: &Change) -> Trial {
    Trial {
        part,
        before: change.before,
        after: change.after,
        change: change.relative,
        standard_error: Some(change.standard_error).filter(|error| error.is_finite()),
        supported: change.is_supported(),
    }
}

/// Takes every specular material whose gloss is not borne out to be diffuse; looks at the error
/// of its own samples, one material after the other.
pub fn drop_gloss(
    fitter: &mut Fitter,
    model: &Model,
    lambda: f64,
    fits: &mut Fits,
) -> Result<Vec<Trial>, Error> {
    let mut trials = Vec::new();
    let mut with = None;
    for material in 0..fitter.rows.materials {
        if !fitter.is_specular(material) {
            continue;
        }
        let glossy = match with.take() {
            Some(losses) => losses,
            None => held_out::predict(fitter, model, lambda, fits)?.losses,
        };
        let mut matt = fitter.clone();
        matt.make_matt(material);
        let matt_fits = matt.fit(model, lambda, &matt.weights, Some(fits))?;
        let plain = held_out::predict(&matt, model, lambda, &matt_fits)?.losses;
        let own = |row: usize| fitter.rows.material[row] == material;
        let trial =
            trial(TrialPart::Gloss(material), &Change::between(fitter, &plain, &glossy, own));
        trials.push(trial);
        if trial.supported {
            with = Some(glossy);
        } else {
            (*fitter, *fits) = (matt, matt_fits);
            with = Some(plain);
        }
    }
    Ok(trials)
}

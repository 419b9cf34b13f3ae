//! The lines that were detected in the photographs, and things that are fitted to them.

use std::sync::Arc;

use super::ModelPage;
use super::keeping::keep;
use crate::app::actions::ToEdges;
use crate::app::state::State;
use crate::worker::{Command, EdgesFitted, Modelling};

const NOT_FITTED: &str = "Nothing was moved";
pub(super) const CHANGED: &str = "The model has changed meanwhile: nothing was moved.";

impl ModelPage {
    /// Has the photograph that is looked at searched for lines, once it is read.
    pub(super) fn search_what_is_shown(&mut self) {
        let photograph = self.shown;
        if self.searching.is_some() || self.lines.contains_key(&photograph) {
            return;
        }
        if let Some(shown) = self.pictures.pixels(photograph) {
            let find = Modelling::FindLines { shown: shown.clone(), photograph };
            self.searching = Some(self.reader.send(Command::Model(find)));
        }
    }

    pub fn is_fitting(&self) -> bool {
        self.fitting.is_some()
    }

    /// Stops the fit to edges or to points that is running.
    pub fn cancel_fit(&self) {
        if let Some(job) = self.fitting {
            self.solver.cancel(job);
        }
    }
}

/// Has the selected thing fitted, or the edges of all things found, or says why that cannot be.
pub(super) fn begin(state: &mut State, what: ToEdges) {
    let Some(page) = &mut state.modelling else { return };
    let Some(model) = page.model() else { return };
    let thing = page.selected.thing(model).filter(|_| what == ToEdges::Selected);
    let obstacle = match (thing, &page.solved) {
        (None, _) if what == ToEdges::Selected => Some("Select a thing first."),
        _ if model.things.is_empty() => Some("There is no thing yet whose edges could be found."),
        _ if page.is_fitting() => Some("A thing is being fitted already."),
        (_, Some(solved)) if page.is_solved() && solved.outcome.is_ok() => None,
        _ if page.is_solving() => Some("The strokes are still being solved."),
        _ => Some("The strokes cannot be solved: the list Fit says why."),
    };
    if let Some(obstacle) = obstacle {
        state.messages.notice(obstacle);
        return;
    }
    if let Some(of) = page.solved.clone() {
        let (folder, lines) = (page.folder.clone(), page.lines.clone());
        let fit = Modelling::FitToEdges { folder, of, thing, lines };
        page.fitting = Some(page.solver.send(Command::Model(fit)));
    }
}

/// The model was fitted: one step of undo, unless it has changed since.
pub(super) fn fitted(state: &mut State, found: &EdgesFitted) {
    let Some(page) = &mut state.modelling else { return };
    page.lines.extend(found.lines.iter().cloned().enumerate());
    let model = &found.of.model;
    let is_same = page.model().is_some_and(|own| Arc::ptr_eq(own, model));
    match &found.outcome {
        _ if !is_same => {
            state.messages.notice(CHANGED);
        }
        Err(problem) => state.messages.error(NOT_FITTED, problem.to_string()),
        Ok(fitted) => {
            if let Some(document) = &mut page.document {
                let what = found.thing.map_or("all", |thing| model.things[thing].id.as_str());
                document.change(format!("fit {what} to edges"), fitted.model.clone(), None);
            }
            state.messages.notice(&fitted.words);
            keep(state);
        }
    }
}

/// A fit to edges or to points was cancelled, by hand or because the model has changed.
pub(super) fn cancelled(state: &mut State) {
    let Some(page) = &state.modelling else { return };
    state.messages.notice(match page.is_solved() {
        true => "The fit was cancelled: nothing was moved.",
        false => CHANGED,
    });
}

/// The job has ended without an answer.
pub(super) fn failed(state: &mut State, text: String) {
    state.messages.error(NOT_FITTED, text);
}

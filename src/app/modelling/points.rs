//! Planes and boxes that are fitted to the points inside an outline on a photograph.

use std::sync::Arc;

use glam::DVec2;

use super::edges::CHANGED;
use super::keeping::keep;
use super::tool::{Selected, Tool};
use crate::app::state::State;
use crate::model::from_points::Wanted;
use crate::worker::{Command, Modelling, PointsFitted};

const NOT_FITTED: &str = "Nothing was fitted";
/// Why the tools are of no use.
pub const NO_POINTS: &str =
    "There are no points: Find cameras… gives them, or an import from COLMAP.";

/// Has a thing fitted, or says why it cannot be.
pub(super) fn begin(state: &mut State, photograph: usize, outline: Vec<DVec2>, wanted: Wanted) {
    let Some(page) = &mut state.modelling else { return };
    let obstacle = match &page.solved {
        _ if page.is_fitting() => Some("A thing is being fitted already."),
        Some(solved) if page.is_solved() && solved.outcome.is_ok() => None,
        _ if page.is_solving() => Some("The strokes are still being solved."),
        _ => Some("The strokes cannot be solved: the list Fit says why."),
    };
    if let Some(obstacle) = obstacle {
        state.messages.notice(obstacle);
        return;
    }
    if let Some(of) = page.solved.clone() {
        let fit = Modelling::FitToPoints { of, photograph, outline, wanted };
        page.fitting = Some(page.solver.send(Command::Model(fit)));
    }
}

/// A thing was fitted: one step of undo, unless the model has changed since.
pub(super) fn fitted(state: &mut State, found: &PointsFitted) {
    let Some(page) = &mut state.modelling else { return };
    let is_same = page.model().is_some_and(|own| Arc::ptr_eq(own, &found.of.model));
    match &found.outcome {
        _ if !is_same => {
            state.messages.notice(CHANGED);
        }
        Err(problem) => state.messages.error(NOT_FITTED, problem.to_string()),
        Ok(fitted) => {
            if let Some(document) = &mut page.document {
                let id = &fitted.model.things[fitted.thing].id;
                let name = format!("fit {id} to points");
                document.change(name, Arc::new(fitted.model.clone()), None);
            }
            page.selected = Selected::Thing(fitted.thing);
            page.tool = Tool::Select;
            state.messages.notice(fitted.words());
            keep(state);
        }
    }
}

//! Carries out the actions of the Model page.

use std::sync::Arc;

use super::keeping::{forget_kept, keep, open};
use super::tool::{Selected, Target, Tool};
use super::{Placement, edges, points, searching};
use crate::app::actions::ModelAction;
use crate::app::gesture::Gesture;
use crate::app::reopening;
use crate::app::state::State;
use crate::app::workspaces::Workspace;
use crate::model::{Model, Stroke};
use crate::worker::{Command, Modelling, SolvedModel};

/// Does what was asked for.
pub fn apply(state: &mut State, what: ModelAction) {
    match what {
        ModelAction::Show => {
            if let Some(page) = &mut state.modelling {
                page.is_shown = true;
            } else if let Some(project) = &state.project {
                let folder = project.folder.clone();
                open(state, &folder);
            }
            if let Some(page) = &mut state.import {
                page.is_shown = false;
            }
        }
        ModelAction::Use => use_model(state),
        ModelAction::Find(what) => searching::apply(state, what),
        ModelAction::FitToEdges(what) => edges::begin(state, what),
        ModelAction::FitToPoints(photograph, outline, wanted) => {
            points::begin(state, photograph, outline, wanted);
        }
        ModelAction::Change(name, model) => {
            let gesture = state.hand.gesture();
            change(state, name, model, gesture);
        }
        other => on_page(state, other),
    }
}

fn change(state: &mut State, name: String, model: Arc<Model>, gesture: Option<Gesture>) {
    if let Some(page) = &mut state.modelling
        && let Some(document) = &mut page.document
    {
        document.change(name, model, gesture);
        page.tidy();
        if gesture.is_none() {
            keep(state);
        }
    }
}

fn on_page(state: &mut State, what: ModelAction) {
    let Some(page) = &mut state.modelling else { return };
    let Some(model) = page.model().cloned() else { return };
    let mut edited = Model::clone(&model);
    let name = match what {
        ModelAction::Tool(Tool::Lasso(_)) if model.found_points.is_empty() => {
            state.messages.notice(points::NO_POINTS);
            return;
        }
        ModelAction::Tool(tool) => {
            page.tool = if page.tool == tool { Tool::Select } else { tool };
            page.drag = None;
            return;
        }
        ModelAction::Next(on) => {
            let count = model.photographs.len().max(1);
            page.show((page.shown + if on { 1 } else { count - 1 }) % count);
            return;
        }
        ModelAction::Snap => {
            page.snaps = !page.snaps;
            let word = if page.snaps { "snap" } else { "do not snap" };
            state.messages.notice(format!("Lines and corners {word} to edges of the photograph"));
            return;
        }
        ModelAction::Blink => {
            page.blink.is_on = !page.blink.is_on;
            return;
        }
        ModelAction::Fit => {
            page.placement = Placement::default();
            return;
        }
        ModelAction::Add(shape) => {
            let thing = edited.add_thing(shape);
            page.selected = Selected::Thing(thing);
            format!("add {}", edited.things[thing].id)
        }
        ModelAction::Duplicate => {
            let Some(thing) = page.selected.thing(&model) else {
                state.messages.notice("Select a thing first.");
                return;
            };
            let twin = edited.duplicate_thing(thing);
            page.selected = Selected::Thing(twin);
            format!("duplicate {}", model.things[thing].id)
        }
        ModelAction::Remove => match page.selected {
            Selected::Nothing => {
                state.messages.notice("Select a stroke, a point or a thing first.");
                return;
            }
            Selected::Thing(index) => {
                edited.remove_thing(index);
                format!("remove {}", model.things[index].id)
            }
            Selected::Point(index) => {
                edited.remove_point(index);
                format!("remove {}", model.points[index].id)
            }
            Selected::Stroke(index) => {
                edited.strokes.remove(index);
                format!("remove {}", model.strokes[index].name())
            }
        },
        ModelAction::ForgetFound => {
            edited.forget_found(None);
            "remove found edges".to_owned()
        }
        ModelAction::Flip => {
            let Selected::Stroke(index) = page.selected else { return };
            let Stroke::Line { from, to, .. } = &mut edited.strokes[index] else { return };
            std::mem::swap(from, to);
            "turn line around".to_owned()
        }
        ModelAction::Show
        | ModelAction::Use
        | ModelAction::Change(..)
        | ModelAction::Find(_)
        | ModelAction::FitToEdges(_)
        | ModelAction::FitToPoints(..) => return,
    };
    let is_gone = edited.strokes.len() < model.strokes.len()
        || edited.things.len() < model.things.len()
        || edited.points.len() < model.points.len();
    if is_gone {
        page.selected = Selected::Nothing;
        page.tool = Tool::Select;
    }
    if let Some(document) = &mut page.document {
        document.change(name, Arc::new(edited), None);
    }
    page.tidy();
    if let (Selected::Thing(thing), false, Some(model)) = (page.selected, is_gone, page.model())
        && let Some(first) = Target::first(model, thing, page.shown)
    {
        page.tool = Tool::Mark(first);
    }
    keep(state);
}

pub fn undo(state: &mut State, is_undo: bool) {
    let Some(page) = &mut state.modelling else { return };
    page.drag = None;
    let step = match &mut page.document {
        Some(document) if is_undo => document.undo(),
        Some(document) => document.redo(),
        None => None,
    };
    page.tidy();
    if let Some(name) = step {
        let word = if is_undo { "Undone" } else { "Redone" };
        state.messages.notice(format!("{word}: {name}"));
        keep(state);
    }
}

fn use_model(state: &mut State) {
    let Some(page) = &mut state.modelling else { return };
    if let Some(obstacle) = page.obstacle() {
        state.messages.notice(obstacle);
        return;
    }
    let Some(of) = page.solved.clone() else { return };
    let job = Modelling::Use { folder: page.folder.clone(), of };
    page.using = Some(page.solver.send(Command::Model(job)));
}

/// Mesh and cameras stand: the capture is read anew, and tagging goes on.
pub(super) fn used(state: &mut State, of: &Arc<SolvedModel>) {
    let Some(page) = &mut state.modelling else { return };
    if let Some(document) = &mut page.document {
        document.mark_saved(of.model.clone());
    }
    let (folder, is_changed) = (page.folder.clone(), page.is_changed());
    if !is_changed {
        forget_kept(state, folder.clone());
    }
    state.messages.notice(format!("Mesh and cameras written to {}", folder.display()));
    state.layout.current = Workspace::Tag;
    reopening::reopen(state, &folder);
}

//! Sends commands to the Model page's workers when the model or the view has changed, and handles
//! their answers.

use std::sync::Arc;
use std::time::Duration;

use super::acting::used;
use super::keeping::keep;
use super::{ModelPage, edges, points, searching};
use crate::app::gesture::Gesture;
use crate::app::state::State;
use crate::model::Model;
use crate::worker::{Command, Event, JobEvent, Modelling};

use super::document::Document;

/// How often work is looked at while it goes on.
const PULSE: Duration = Duration::from_millis(100);
const NOT_USED: &str = "Mesh and cameras cannot be written";

/// Takes what the workers have found, and asks for what is wanted now.
pub fn follow(state: &mut State) {
    let Some(page) = &mut state.modelling else { return };
    let mut events: Vec<Event> = page.reader.events().try_iter().collect();
    let solver: Vec<Event> = page.solver.events().try_iter().collect();
    events.retain(|event| event.what.is_ending());
    for event in events {
        reader_event(state, event);
    }
    for event in solver.into_iter().filter(|event| event.what.is_ending()) {
        solver_event(state, event);
    }
    searching::follow(state);
    let Some(page) = &mut state.modelling else { return };
    page.cancel_outdated();
    page.solve_what_is_drawn();
    page.draw_what_is_shown();
    page.reproject_what_is_shown();
    page.read_what_is_shown();
    page.search_what_is_shown();
    if page.is_busy() {
        state.ctx.request_repaint_after(PULSE);
    }
}

/// A gesture on the page that has ended is a step of undo; Escape takes it back.
pub fn end_gesture(state: &mut State) {
    let Some(page) = &mut state.modelling else { return };
    let Some(document) = &mut page.document else { return };
    match document.gesture() {
        Some(_) if state.hand.escaped() => {
            document.cancel_gesture();
            page.drag = None;
            page.tidy();
        }
        Some(gesture @ (Gesture::Press(_) | Gesture::Typing(_))) if !state.hand.ends(gesture) => {}
        Some(_) => {
            document.commit();
            keep(state);
        }
        None => {}
    }
}

fn reader_event(state: &mut State, event: Event) {
    let Some(page) = &mut state.modelling else { return };
    if page.opening.take_if(|job| *job == event.job).is_some() {
        match event.what {
            JobEvent::ModelOpened(opened) => {
                let mut document = Document::new(opened.model);
                if let Some(unsaved) = opened.unsaved {
                    document.change("recovered strokes".to_owned(), Arc::new(unsaved), None);
                    let text = "Strokes that were not saved are here again. Undo takes them back.";
                    state.messages.notice(text);
                }
                page.document = Some(document);
                for warning in opened.warnings {
                    state.messages.warning(warning);
                }
            }
            JobEvent::Failed(text) => page.problem = Some(text),
            _ => {}
        }
        return;
    }
    if page.searching.take_if(|job| *job == event.job).is_some() {
        // What ends otherwise would end so again: such a photograph has no lines.
        let (photograph, lines) = match event.what {
            JobEvent::LinesFound(photograph, lines) => (photograph, lines),
            _ => (page.shown, Arc::default()),
        };
        page.lines.insert(photograph, lines);
        return;
    }
    let ctx = &state.ctx;
    match event.what {
        JobEvent::Shown(shown) => page.pictures.take(ctx, event.job, Ok(&shown)),
        JobEvent::Failed(text) => page.pictures.take(ctx, event.job, Err(text)),
        _ => page.pictures.take(ctx, event.job, Err("Reading was cancelled.".to_owned())),
    };
}

fn solver_event(state: &mut State, event: Event) {
    let Some(page) = &mut state.modelling else { return };
    if page.solving.take_if(|job| *job == event.job).is_some() {
        match event.what {
            JobEvent::ModelSolved(solved) => {
                page.failure = None;
                page.solved = Some(solved);
            }
            JobEvent::Failed(text) => page.failure = Some(text),
            // The same model may be wanted again.
            _ => page.tried = None,
        }
    } else if page.drawn.take_if(|job| *job == event.job).is_some() {
        if let JobEvent::ModelDrawn(drawing) = event.what {
            page.drawing = Some(drawing);
        }
    } else if page.blink.job.take_if(|job| *job == event.job).is_some() {
        if let JobEvent::ModelReprojected(picture) = event.what {
            page.blink.picture = Some(picture);
        }
    } else if page.fitting.take_if(|job| *job == event.job).is_some() {
        match event.what {
            JobEvent::FittedToEdges(found) => edges::fitted(state, &found),
            JobEvent::FittedToPoints(found) => points::fitted(state, &found),
            JobEvent::Failed(text) => edges::failed(state, text),
            _ => edges::cancelled(state),
        }
    } else if page.using.take_if(|job| *job == event.job).is_some() {
        match event.what {
            JobEvent::ModelUsed(of) => used(state, &of),
            JobEvent::Failed(text) => state.messages.error(NOT_USED, text),
            _ => {}
        }
    }
}

impl ModelPage {
    /// Cancels the solve or fit of a model that has changed since: its result would be discarded, and
    /// the next solve would wait for it. During a drag without an earlier solution to begin from, the
    /// solve is not cancelled, because every movement would cancel it and nothing would be shown.
    fn cancel_outdated(&self) {
        let Some(model) = self.model() else { return };
        let is_outdated = |of: &Arc<Model>| !Arc::ptr_eq(of, model);
        if let (Some(job), Some((of, is_preview))) = (self.solving, &self.tried)
            && is_outdated(of)
            && !is_preview
            && (self.solved.is_some() || !self.is_dragging())
        {
            self.solver.cancel(job);
        }
        if let (Some(job), Some(solved)) = (self.fitting, &self.solved)
            && is_outdated(&solved.model)
        {
            self.solver.cancel(job);
        }
    }

    /// Solves the model where it has changed; one at a time, so that the latest is never far. While
    /// something is dragged, that begins from the latest solution, and is exact only in the end.
    fn solve_what_is_drawn(&mut self) {
        let Some(model) = self.model().cloned() else { return };
        if self.solving.is_some() || self.is_solved() {
            return;
        }
        if model.strokes.is_empty() && !model.has_found() {
            (self.solved, self.drawing, self.tried) = (None, None, None);
            return;
        }
        let near = self.solved.clone().filter(|_| self.is_dragging());
        // What has stopped the solver would stop it again.
        let is_tried = |(tried, is_preview): &(Arc<Model>, bool)| {
            Arc::ptr_eq(tried, &model) && (near.is_some() || !is_preview)
        };
        if self.tried.as_ref().is_some_and(is_tried) {
            return;
        }
        self.tried = Some((model.clone(), near.is_some()));
        self.solving = Some(self.solver.send(Command::Model(Modelling::Solve { model, near })));
    }

    /// Has the edges drawn in the photograph that is looked at.
    fn draw_what_is_shown(&mut self) {
        let Some(solved) = self.solved.clone() else { return };
        let photograph = self.shown;
        let is_there = self
            .drawing
            .as_ref()
            .is_some_and(|own| Arc::ptr_eq(&own.of, &solved) && own.photograph == photograph);
        if is_there || self.drawn.is_some() {
            return;
        }
        let draw = Modelling::Draw { of: solved, photograph };
        self.drawn = Some(self.solver.send(Command::Model(draw)));
    }

    /// Reads photographs, the one that is looked at first.
    fn read_what_is_shown(&mut self) {
        let Some(model) = self.model().cloned() else { return };
        let Some(wanted) = self.pictures.wanted(self.shown, model.photographs.len()) else {
            return;
        };
        let (folder, name) =
            (self.folder.clone(), model.photographs[wanted.photograph].name.clone());
        let show = Modelling::Show { folder, name, longest: wanted.longest };
        self.pictures.asked(self.reader.send(Command::Model(show)), &wanted);
    }
}

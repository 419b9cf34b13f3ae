//! Carries out the actions on cameras that an engine finds, and handles the events of its worker.

use std::sync::Arc;

use super::ModelPage;
use super::keeping::keep;
use crate::app::actions::FindAction;
use crate::app::state::State;
use crate::io::engines::Told;
use crate::model::{FoundCameras, Model};
use crate::worker::{Event, JobEvent, Modelling};

/// Lines of the log that are kept.
const LOG_LINES: usize = 300;

/// Does what was asked for.
pub fn apply(state: &mut State, what: FindAction) {
    let ctx = state.ctx.clone();
    let Some(page) = &mut state.modelling else { return };
    let Some(model) = page.model().cloned() else { return };
    let own = &mut page.finding;
    match what {
        FindAction::Show(is_shown) => {
            own.is_shown = is_shown;
            if is_shown && own.engines.is_none() {
                own.look(&ctx);
            }
        }
        FindAction::Look => own.look(&ctx),
        FindAction::Engine(engine) => own.search.engine = Some(engine),
        FindAction::Shared(is_shared) => own.search.is_shared = is_shared,
        FindAction::Start => {
            if own.is_running() || own.obstacle(model.photographs.len()).is_some() {
                return;
            }
            (own.outcome, own.step) = (None, String::new());
            own.log.clear();
            let search = Box::new(own.search.clone());
            let job = Modelling::FindCameras { folder: page.folder.clone(), model, search };
            match own.send(job, &ctx) {
                Ok(job) => own.job = Some(job),
                Err(error) => own.outcome = Some(Err(format!("no thread can be started: {error}"))),
            }
        }
        FindAction::Cancel => {
            if let Some((job, worker)) = own.job.zip(own.worker.as_ref()) {
                worker.cancel(job);
            }
        }
        FindAction::Forget(photograph) => {
            let mut edited = Model::clone(&model);
            edited.drop_found(photograph);
            let name = match photograph {
                Some(_) => "place a photograph by hand",
                None => "forget found cameras",
            };
            change(page, name, edited);
            keep(state);
        }
    }
}

fn change(page: &mut ModelPage, name: &str, model: Model) {
    if let Some(document) = &mut page.document {
        document.change(name.to_owned(), Arc::new(model), None);
    }
}

/// Takes what the worker tells.
pub(super) fn follow(state: &mut State) {
    let Some(page) = &mut state.modelling else { return };
    let Some(worker) = &page.finding.worker else { return };
    let events: Vec<Event> = worker.events().try_iter().collect();
    for Event { job, what } in events {
        let Some(page) = &mut state.modelling else { return };
        let own = &mut page.finding;
        match what {
            JobEvent::Told(Told::Step(step)) => own.step = step,
            JobEvent::Told(Told::Line(line)) => {
                own.log.push_back(line);
                if own.log.len() > LOG_LINES {
                    own.log.pop_front();
                }
            }
            JobEvent::Engines(engines) => {
                own.looking = None;
                own.take_engines(engines);
            }
            what if what.is_ending() && own.job == Some(job) => {
                own.job = None;
                match what {
                    JobEvent::CamerasFound(found) => {
                        take(page, &found);
                        keep(state);
                    }
                    JobEvent::Failed(text) => own.outcome = Some(Err(text)),
                    _ => own.outcome = Some(Err("Cancelled. Nothing has changed.".to_owned())),
                }
            }
            what if what.is_ending() => {
                own.looking = None;
                own.engines.get_or_insert_default();
            }
            _ => {}
        }
    }
}

/// What was found becomes a step of undo.
fn take(page: &mut ModelPage, found: &FoundCameras) {
    let Some(model) = page.model().cloned() else { return };
    page.finding.outcome = Some(Ok(words(&model, found)));
    let mut edited = Model::clone(&model);
    edited.take_found(found);
    change(page, "find cameras", edited);
}

/// "18 of 20 photographs placed …"
fn words(model: &Model, found: &FoundCameras) -> String {
    let count = model.photographs.len();
    let mut text = format!("{} of {count} photographs placed by {}", found.placed(), found.engine);
    if let Some(off) = found.error_px {
        text += &format!("; its points are off by {off:.2} px");
    }
    let missed = model.photographs.iter().zip(&found.cameras).filter(|own| own.1.is_none());
    let names: Vec<&str> = missed.map(|(own, _)| own.name.trim_start_matches("images/")).collect();
    match &names[..] {
        [] => text += ".",
        [name] => text += &format!(". {name} is not: place it by lines and corners."),
        [names @ .., last] => {
            let names = names.join(", ");
            text += &format!(". {names} and {last} are not: place them by lines and corners.");
        }
    }
    text
}

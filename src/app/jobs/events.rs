//! Handles the events of the workers: what each of them changes in the project.

use std::any::Any;
use std::sync::Arc;

use super::PULSE;
use super::studies::events as studies;
use super::tasks::{Lane, Task};
use crate::app::files;
use crate::app::leaving;
use crate::app::modelling::begin;
use crate::app::opening::Opening;
use crate::app::pending::Answer;
use crate::app::products::Run;
use crate::app::project::Project;
use crate::app::state::State;
use crate::reconstruct::Update;
use crate::worker::{Event, JobEvent, Worker};

/// What an event changes.
type Handler = fn(&mut State, Event);

/// Takes all events since the last frame.
pub fn drain(state: &mut State) {
    let jobs = &state.jobs;
    let workers: [(&Worker, Handler); 4] = [
        (&jobs.loader, loader_event),
        (&jobs.runner, runner_event),
        (&jobs.render_worker, render_event),
        (&jobs.relighter, relighter_event),
    ];
    let events = workers.map(|(worker, handle)| {
        let events: Vec<Event> = worker.events().try_iter().collect();
        (events, handle)
    });
    for (events, handle) in events {
        for event in events {
            handle(state, event);
        }
    }
    studies::drain(state);
    if state.jobs.is_rendering() || state.jobs.is_suggesting() {
        state.jobs.ctx.request_repaint_after(PULSE);
    }
    stop_what_is_outdated(state);
    take_derived(state);
    if let Some(project) = &mut state.project
        && let Some(run) = &mut project.run
    {
        run.progress = state.jobs.runner.progress(run.job).filter(|_| run.stage().is_some());
        state.jobs.ctx.request_repaint_after(PULSE);
    }
}

/// Stops jobs whose answers are for a result or a project that is not shown any more.
fn stop_what_is_outdated(state: &mut State) {
    let shown = state.project.as_ref().and_then(|project| project.products.whole.as_ref());
    if state
        .jobs
        .picture
        .as_ref()
        .is_some_and(|picture| shown.is_none_or(|shown| !Arc::ptr_eq(shown, &picture.of)))
    {
        state.jobs.stop_comparing();
    }
    if state.project.is_none()
        && let Some(coverage) = state.jobs.coverage.take()
    {
        state.jobs.loader.cancel(coverage.job);
    }
}

/// Takes what was derived from a result, once it is there.
fn take_derived(state: &mut State) {
    let Some((whole, answer)) = &state.jobs.derived else { return };
    let answer = answer.answer();
    // Another project, or another run's results, may be shown by now.
    if let (Answer::Ready(derived), Some(Project { products, .. })) = (&answer, &mut state.project)
        && products.whole.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, whole))
    {
        products.derived = Some(derived.clone());
    }
    if answer.is_over() {
        state.jobs.derived = None;
    }
}

/// Hands an event that ends a task to this task; any other event is given back.
fn task_event(state: &mut State, lane: Lane, event: Event) -> Option<Event> {
    if event.what.is_ending()
        && let Some(task) = state.jobs.take_ended(lane, event.job)
    {
        ended(state, task, event.what);
        return None;
    }
    Some(event)
}

fn loader_event(state: &mut State, event: Event) {
    if studies::saved(state, &event) {
        return;
    }
    if let Some(coverage) = state.jobs.coverage.as_mut().filter(|own| own.job == event.job) {
        match event.what {
            JobEvent::Covered(masks) => coverage.masks = Some(masks),
            JobEvent::Failed(text) => {
                // No light has a mask then, and nobody waits for one.
                coverage.masks = Some(Arc::default());
                state.messages.warning(text);
            }
            _ => {}
        }
        return;
    }
    let Some(event) = task_event(state, Lane::Loader, event) else { return };
    if !event.what.is_ending() {
        return;
    }
    if state.dialogs.begin.as_ref().is_some_and(|own| own.job == Some(event.job)) {
        let made = match event.what {
            JobEvent::CaptureBegun(folder) => Ok(folder),
            JobEvent::Failed(text) => Err(text),
            _ => Err("Copying was cancelled. Nothing was left half-written.".to_owned()),
        };
        begin::ended(state, made);
        return;
    }
    // Only the latest opening counts; a project that was open stays until it has succeeded.
    if state.jobs.opening.as_ref().is_none_or(|(job, _)| *job != event.job) {
        return;
    }
    let Some((_, opening)) = state.jobs.opening.take() else { return };
    match event.what {
        JobEvent::Loaded(capture) => {
            state.jobs.loaded = Some(capture);
            read_on(state, opening);
        }
        JobEvent::StoredCharts(charts) => {
            // They are part of the capture from here on.
            state.jobs.loaded = Some(charts.capture.clone());
            read_on(state, Opening { read_charts: Some(charts), charts: None, ..opening });
        }
        JobEvent::StoredLights(lights) => {
            read_on(state, Opening { lights: Some(lights), ..opening });
        }
        JobEvent::StoredEdits(edits) => {
            read_on(state, Opening { edits: Some(edits), ..opening });
        }
        JobEvent::Begun(folder, _) => leaving::begun(state, &opening, folder),
        JobEvent::Meshless(folder, _) => state.dialogs.meshless = Some(folder),
        JobEvent::Failed(text) => state.messages.error("This cannot be opened", text),
        _ => {}
    }
}

macro_rules! tasks {
    ($($file:ident::$task:ident,)*) => {
        $(impl Task for super::$file::$task {})*

        /// A task has come to its answer, which may be that it failed or was cancelled.
        fn ended(state: &mut State, task: Box<dyn Any>, answer: JobEvent) {
            $(let task = match task.downcast::<super::$file::$task>() {
                Ok(own) => return own.ended(state, answer),
                Err(other) => other,
            };)*
            unreachable!("{:?} is not in the list of tasks", task.type_id())
        }
    };
}

tasks! {
    masks::SuggestMasks,
    reading::Read,
    results::Export,
    results::ReadResults,
    results::ReadSolved,
    results::WriteResults,
    scene_export::ExportScene,
}

/// Nobody may save a project before all that it holds has been read.
fn read_on(state: &mut State, opening: Opening) {
    let Some(capture) = state.jobs.loaded.take() else { return };
    if let Some((opening, capture)) = state.jobs.read_stored(opening, capture) {
        files::opened(state, opening, capture);
    }
}

fn relighter_event(state: &mut State, event: Event) {
    let Some(relight) = state.jobs.relight.as_mut().filter(|own| own.job == event.job) else {
        return;
    };
    match event.what {
        JobEvent::Relit(relit) => {
            let before = relight.relit.replace(relit.clone());
            // What was so from the beginning is in the hover text of the number of paths.
            if let Some(reason) = &relit.no_card
                && before.is_some_and(|before| before.no_card.as_ref() != Some(reason))
            {
                state.messages.warning(format!("The processor traces paths from now on: {reason}"));
            }
        }
        JobEvent::Failed(text) => state.messages.error("The relit picture cannot be made", text),
        _ => {}
    }
}

fn render_event(state: &mut State, event: Event) {
    let Some(event) = task_event(state, Lane::Renderer, event) else { return };
    if state.jobs.rendering.as_ref().is_some_and(|own| own.job == event.job) {
        state.jobs.pictures_event(event.what, &mut state.messages);
        return;
    }
    let Some(picture) = state.jobs.picture.as_mut().filter(|picture| picture.job == event.job)
    else {
        return;
    };
    match event.what {
        JobEvent::Picture { film, .. } => picture.film = Some(film),
        JobEvent::Judged { score, .. } => picture.score = Some(score),
        JobEvent::Failed(text) => {
            picture.is_done = true;
            state.messages.error("The picture cannot be made", text);
        }
        event => picture.is_done |= event.is_ending(),
    }
}

fn runner_event(state: &mut State, event: Event) {
    let Some(event) = task_event(state, Lane::Runner, event) else { return };
    let Some(project) = &mut state.project else { return };
    if project.run.as_ref().is_none_or(|run| run.job != event.job) {
        return;
    }
    match event.what {
        JobEvent::Update(update) => {
            if let Some(line) = line(&update) {
                state.messages.info(line);
            }
            project.update(update);
        }
        JobEvent::Reconstructed(whole) => {
            let secs = end(project).map_or(0.0, |run| run.began.elapsed().as_secs_f64());
            let brief = whole.solution.brief();
            for note in &whole.solution.notes {
                state.messages.info(note.clone());
            }
            for warning in &whole.warnings {
                state.messages.warning(warning.clone());
            }
            let capture = project.result_capture().clone();
            project.products.finish(&capture, whole);
            state.messages.info(state.probe.report().unwrap_or_default());
            state.messages.notice(format!("Done in {secs:.1} s. {brief}"));
            state.jobs.derive(project);
        }
        JobEvent::Cancelled => {
            give_back(project);
            state.jobs.derive(project);
            state.messages.notice("The run was cancelled.");
        }
        JobEvent::Failed(text) => {
            give_back(project);
            state.jobs.derive(project);
            state.messages.error("The reconstruction stopped", text);
        }
        _ => {}
    }
}

fn end(project: &mut Project) -> Option<Run> {
    let mut run = project.run.take()?;
    run.end_stage();
    Some(run)
}

/// A run that came to nothing leaves what was there before it; where there was nothing, what it
/// found so far is better than that.
fn give_back(project: &mut Project) {
    if let Some(run) = end(project)
        && run.previous.whole.is_some()
    {
        project.products = run.previous;
        project.selection.forget_products();
    }
}

fn line(update: &Update) -> Option<String> {
    Some(match update {
        Update::Stage(stage) => format!("Stage {}", stage.name()),
        Update::Reused(stage) => format!("Stage {} kept", stage.name()),
        Update::Samples(cloud) => format!("{} samples", cloud.samples.len()),
        Update::Lights(lights, lobes) => {
            format!("{} virtual lights, {} lobes", lights.lights.len(), lobes.lobes.len())
        }
        Update::Transport(_) => return None,
        Update::Iteration(iteration) => format!(
            "Iteration {}: relative RMS {} %",
            iteration.index,
            iteration.rms.relative.map(|value| format!("{:.2}", 100.0 * value)).join(" / ")
        ),
    })
}

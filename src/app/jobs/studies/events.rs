//! Handles the events of the studies' worker, and saves their results.

use std::path::PathBuf;

use super::progress::{PULSE, StudyProgress};
use super::{Kind, TruthStatus};
use crate::app::state::State;
use crate::study::Row;
use crate::worker::{Command, Event, JobEvent};

/// Writes what a study has found.
pub fn save(state: &mut State, kind: Kind, folder: PathBuf) {
    let jobs = &mut state.jobs;
    if let Some(findings) = jobs.studies.findings(kind) {
        let findings = Box::new(findings);
        let job = jobs.loader.send(Command::WriteStudy { findings, folder });
        let count = jobs.studies.progress(kind).map_or(0, StudyProgress::found);
        jobs.studies.saving = Some((job, kind, count));
    }
}

/// Takes an event of the loader, if it is the writing of a study.
pub fn saved(state: &mut State, event: &Event) -> bool {
    let studies = &mut state.jobs.studies;
    let Some((_, kind, count)) = studies.saving.take_if(|(job, ..)| *job == event.job) else {
        return false;
    };
    match &event.what {
        JobEvent::Exported(folder) => {
            if let Some(progress) = studies.progress_mut(kind) {
                progress.mark_saved(count);
            }
            state.messages.notice(format!("The study is written to {}", folder.display()));
        }
        JobEvent::Failed(text) => {
            state.messages.error("The study cannot be written", text.clone());
        }
        JobEvent::Cancelled => {}
        _ => studies.saving = Some((event.job, kind, count)),
    }
    true
}

/// Takes what the worker of the studies told since the last frame.
pub fn drain(state: &mut State) {
    let events: Vec<Event> = state.jobs.studies.study_worker.events().try_iter().collect();
    for event in events {
        if state.jobs.studies.known.job() == Some(event.job) {
            truth_event(state, event.what);
        } else {
            study_event(state, event);
        }
    }
    if state.jobs.studies.running().is_some() {
        state.ctx.request_repaint_after(PULSE);
    }
}

fn truth_event(state: &mut State, event: JobEvent) {
    match event {
        JobEvent::Truth(truth) => {
            state.jobs.studies.known = truth.map_or(TruthStatus::Nothing, TruthStatus::Truth);
        }
        JobEvent::Failed(text) => {
            state.jobs.studies.known = TruthStatus::Broken;
            state.messages.error("What is true of this capture cannot be read", text);
        }
        _ => {}
    }
}

fn study_event(state: &mut State, event: Event) {
    let studies = &mut state.jobs.studies;
    let is_own = |(kind, progress): (Kind, &StudyProgress)| {
        (progress.job == Some(event.job)).then_some(kind)
    };
    let Some(kind) = studies.running().and_then(is_own) else { return };
    let title = match kind {
        Kind::Speed => "speed and accuracy",
        Kind::Stability => "stability",
    };
    match event.what {
        JobEvent::Found(finding) => {
            let failure = match &finding.row {
                Row::Speed(row) => row.failure.as_ref(),
                Row::Stability(row) => row.failure.as_ref(),
            };
            match failure {
                Some(failure) => {
                    state.messages.warning(format!("Study, {}: {failure}", finding.name));
                }
                None => state.messages.info(format!("Study, {}", finding.name)),
            }
            studies.add(finding.number, finding.row);
            return;
        }
        JobEvent::Studied(_) => {
            let count = studies.progress(kind).map_or(0, StudyProgress::done);
            state.messages.notice(format!("The study of {title} is done: {count} runs."));
        }
        JobEvent::Cancelled => {
            let count = studies.progress(kind).map_or(0, StudyProgress::done);
            state.messages.notice(format!(
                "The study of {title} was stopped; its {count} finished runs are kept."
            ));
        }
        JobEvent::Failed(text) => {
            state.messages.error(format!("The study of {title} stopped"), text);
        }
        _ => return,
    }
    if let Some(progress) = studies.progress_mut(kind) {
        progress.end();
    }
}

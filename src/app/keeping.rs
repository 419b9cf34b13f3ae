//! Stores unsaved work for recovery: every half minute, tags, options, edits and results are
//! written into the user's folder, where the next window finds them after a crash.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::opening::{AfterPrompt, Restoring};
use super::project::Project;
use super::project_file::file_of;
use super::state::State;
use super::unsaved::Kept;
use crate::io::project::ProjectFile;
use crate::io::results::{self, Results};
use crate::io::settings;
use crate::reconstruct::Reconstruction;
use crate::watch::Watch;
use crate::worker::JobEvent;

/// Unsaved work is kept this often.
const AUTOSAVE: Duration = Duration::from_secs(30);

/// Keeps unsaved work now and then, for recovery.
pub fn autosave(state: &mut State) {
    let problems = state.writer.problems();
    if !problems.is_empty() {
        // It is tried again at the next half minute.
        state.kept = None;
    }
    for problem in problems {
        state.messages.warning(problem);
    }
    if state.autosaved.elapsed() >= AUTOSAVE {
        keep(state);
    }
    if state.project.as_ref().is_some_and(is_unsaved) {
        // An idle window draws no frames of its own.
        state.ctx.request_repaint_after(AUTOSAVE.saturating_sub(state.autosaved.elapsed()));
    }
}

/// Keeps unsaved work at once, and waits for it.
pub fn autosave_now(state: &mut State) {
    keep(state);
    state.writer.wait();
    for problem in state.writer.problems() {
        state.kept = None;
        state.messages.warning(problem);
    }
}

/// Nothing is to be recovered any more.
pub fn forget_kept(state: &mut State) {
    state.kept = None;
    if let Some(recovery) = state.recovery.clone() {
        state.writer.send(move || {
            recovery.forget();
            Ok(())
        });
    }
}

/// Whether edits or results of a project are in no file yet.
pub fn is_unsaved(project: &Project) -> bool {
    project.is_changed() || project.unsaved_results().is_some()
}

fn keep(state: &mut State) {
    state.autosaved = Instant::now();
    let (Some(recovery), Some(project)) = (&state.recovery, &state.project) else { return };
    if !is_unsaved(project) {
        // What was kept stays until its successor is on the disk.
        if state.kept.is_some() && !state.jobs.is_storing() {
            forget_kept(state);
        }
        return;
    }
    let results = project.unsaved_results().cloned();
    let same = |kept: &Kept| match (&kept.results, &results) {
        (Some(kept), Some(now)) => Arc::ptr_eq(kept, now),
        (kept, now) => kept.is_none() && now.is_none(),
    };
    let are_kept = state.kept.as_ref().is_some_and(same);
    if are_kept && state.kept.as_ref().is_some_and(|kept| Arc::ptr_eq(&kept.edit, project.edit())) {
        return;
    }
    let recovery = recovery.clone();
    let mut file = ProjectFile { original: project.file.clone(), ..file_of(state, project) };
    let mut storing = None;
    if results.is_some() {
        file.results = Some(recovery.results());
        storing = project.storing(recovery.results()).filter(|_| !are_kept);
    }
    state.kept = Some(Kept { edit: project.edit().clone(), results });
    state.writer.send(move || {
        let stored = storing.map_or(Ok(()), |storing| storing.write(&Watch::new()));
        // Tags and options are worth keeping without results, too.
        recovery.keep(&file).and(stored).map_err(|error| format!("Autosave: {error}"))
    });
}

/// This window keeps what another left, which is then no longer offered.
pub fn take_over(state: &mut State, left: &Path) {
    autosave_now(state);
    if state.kept.is_some() {
        discard(state, left);
    }
}

pub fn discard(state: &mut State, file: &Path) {
    settings::discard(file);
    not_now(state, file);
}

/// Offers unsaved work no more until the next start.
pub fn not_now(state: &mut State, file: &Path) {
    state.left_behind.retain(|other| other.file != file);
}

/// The results that a project points to were read, or cannot be.
pub fn solved(state: &mut State, folder: PathBuf, event: JobEvent) {
    match (event, &mut state.project) {
        (JobEvent::Solved(solved), Some(project)) => {
            state.messages.info(format!("Results read from {}", folder.display()));
            project.restore_solved(solved, folder);
        }
        (JobEvent::Failed(text), _) => state.messages.warning(text),
        _ => {}
    }
}

/// The results of a project were read, or cannot be.
pub fn restored(state: &mut State, restoring: Restoring, event: JobEvent) {
    let Restoring { folder, recovered } = restoring;
    match event {
        JobEvent::Results(read) => take(state, *read, &folder, recovered.as_deref()),
        // What cannot be read stays where it is, and with what it was kept for.
        JobEvent::Failed(text) => {
            state.messages.error("The results of the project cannot be read", text);
        }
        _ => {}
    }
}

fn take(state: &mut State, read: Results, folder: &Path, recovered: Option<&Path>) {
    let Some(project) = &mut state.project else { return };
    let is_of_crash = recovered.is_some_and(|left| results::folder_of(left) == folder);
    project.restore_results(read, !is_of_crash);
    state.messages.info(format!("Results read from {}", folder.display()));
    state.jobs.derive(project);
    if let Some(left) = recovered {
        take_over(state, left);
    }
}

/// Results were written beside the project's file, or cannot be; what has waited for it comes next.
pub fn stored(
    state: &mut State,
    whole: &Arc<Reconstruction>,
    event: JobEvent,
) -> Option<AfterPrompt> {
    // Of several that were asked for, the last opens the way.
    let then = state.after_storing.take_if(|_| !state.jobs.is_storing());
    match event {
        JobEvent::Exported(folder) => {
            state.messages.info(format!("Results written to {}", folder.display()));
            if state.project.as_ref().is_some_and(|project| !is_unsaved(project)) {
                forget_kept(state);
            }
            return then;
        }
        JobEvent::Failed(text) => {
            state.after_storing = None;
            if let Some(project) = &mut state.project {
                project.mark_results_unsaved(whole);
            }
            state.messages.error("The results cannot be saved with the project", text);
        }
        _ => {}
    }
    None
}

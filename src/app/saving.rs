//! Saves projects and models: on a thread, one after the other, while the window goes on.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::actions::PathRequest;
use super::asking::ask_path;
use super::files::save_settings;
use super::keeping;
use super::leaving::{leave, once_saved};
use super::modelling::keeping as model_keeping;
use super::opening::AfterPrompt;
use super::pending::{Answer, Pending};
use super::project_file::file_of;
use super::state::State;
use super::unsaved::{NotSaved, Save, SaveRequest, Saved, Saves};
use crate::io::{model as model_files, project, results};

/// Saves what is on the screen: the model, or the project to its file. Without a file it asks for one.
pub fn save(state: &mut State) {
    if state.is_modelling() {
        ask(state, SaveRequest::Model);
    } else {
        save_project(state);
    }
}

/// Saves the project to its file; says whether it has one. Without one it asks for it.
fn save_project(state: &mut State) -> bool {
    let Some(project) = &state.project else { return true };
    let own = project.file.clone();
    let is_own = own.is_some();
    // A file that is written for the first time is the project's own only afterwards.
    let Some(file) = own.or_else(|| first_file(state)) else {
        ask_path(state, PathRequest::SaveAs);
        return false;
    };
    save_to(state, &file, is_own);
    true
}

/// The file that a project without one is being written to.
fn first_file(state: &State) -> Option<PathBuf> {
    let now = state.saves.now.as_ref()?;
    matches!(now.of, Saved::Project { .. }).then(|| now.file.clone())
}

/// Saves the project to a file; one that is there already, and not the project's own, is replaced only
/// when that was agreed to.
pub fn save_to(state: &mut State, file: &Path, replace: bool) {
    let file = if project::is_project(file) {
        file.to_owned()
    } else {
        file.with_added_extension(project::EXTENSION)
    };
    ask(state, SaveRequest::Project { file, replace });
}

/// Saves the model and the project, as far as they have changed, and goes on to what was asked about.
pub fn save_and_leave(state: &mut State) {
    let is_drawn_on = state.modelling.as_ref().is_some_and(|page| page.is_changed());
    if is_drawn_on {
        ask(state, SaveRequest::Model);
    }
    let is_changed = state.project.as_ref().is_some_and(keeping::is_unsaved);
    if is_changed && !save_project(state) {
        // The question stays until there is a place to save to.
        return;
    }
    if let Some(then) = state.dialogs.unsaved.take() {
        leave_when_saved(state, then);
    }
}

/// The place that was chosen for the project; what waited for it comes once it is there.
pub fn save_where_asked(state: &mut State, file: &Path, replace: bool) {
    save_to(state, file, replace);
    if let Some(then) = state.dialogs.unsaved.take() {
        leave_when_saved(state, then);
    }
}

fn leave_when_saved(state: &mut State, then: AfterPrompt) {
    if state.saves.are_under_way() {
        state.saves.then = Some(then);
    } else {
        once_saved(state, then);
    }
}

fn ask(state: &mut State, request: SaveRequest) {
    state.saves.waiting.push_back(request);
    begin_next(state);
}

/// Begins the next save, of what is there now.
fn begin_next(state: &mut State) {
    while state.saves.now.is_none()
        && let Some(request) = state.saves.waiting.pop_front()
    {
        state.saves.now = match request {
            SaveRequest::Model => begin_model(state),
            SaveRequest::Project { file, replace } => begin_project(state, file, replace),
        };
    }
}

fn begin_model(state: &mut State) -> Option<Save> {
    let page = state.modelling.as_mut()?;
    let document = page.document.as_mut()?;
    document.commit();
    let (folder, model) = (page.folder.clone(), document.model().clone());
    let file = folder.join(model_files::NAME);
    let of = Saved::Model { folder: folder.clone(), model: model.clone() };
    let written = file.clone();
    let write = move || match model_files::save(&folder, &model) {
        Ok(()) => Ok(written),
        Err(error) => Err(NotSaved::Failed(error.to_string())),
    };
    Some(Save { of, file, answer: writing(state, write), began: Instant::now() })
}

fn begin_project(state: &mut State, file: PathBuf, replace: bool) -> Option<Save> {
    let project = state.project.as_ref()?;
    let mut stored = file_of(state, project);
    let folder = results::folder_of(&file);
    // Results that are with another file, or nowhere yet, come along.
    let storing = match project.unsaved_results() {
        None if project.results.as_ref() == Some(&folder) => None,
        _ => project.storing(folder),
    };
    if let Some(storing) = &storing {
        stored.results = Some(storing.folder.clone());
    }
    let of = Saved::Project {
        opened: project.opened.clone(),
        edit: project.edit().clone(),
        storing: storing.map(Box::new),
    };
    let (own, to) = (project.file.clone(), file.clone());
    let write = move || {
        let is_own = || dunce::canonicalize(&to).ok().as_ref() == own.as_ref();
        if !replace && to.exists() && !is_own() {
            return Err(NotSaved::IsThere);
        }
        project::write_over(&to, &stored).map_err(|error| NotSaved::Failed(error.to_string()))?;
        Ok(dunce::canonicalize(&to).unwrap_or(to))
    };
    Some(Save { of, file, answer: writing(state, write), began: Instant::now() })
}

fn writing(
    state: &State,
    write: impl FnOnce() -> Result<PathBuf, NotSaved> + Send + 'static,
) -> Pending<Result<PathBuf, NotSaved>> {
    state.ctx.request_repaint_after(Saves::TOLD_AFTER);
    Pending::start("save", &state.ctx, write)
}

/// Takes note of what has been written, begins what is to be written next, and leaves the project
/// where that has waited.
pub fn follow(state: &mut State) {
    let Some(save) = &state.saves.now else { return };
    let answer = match save.answer.answer() {
        Answer::Waiting => return,
        Answer::Ready(answer) => answer,
        Answer::Lost => Err(NotSaved::Failed("Writing it failed; the log has more.".to_owned())),
    };
    let Some(Save { of, file, .. }) = state.saves.now.take() else { return };
    let is_saved = match (answer, of) {
        (Ok(file), of) => {
            saved(state, of, file);
            true
        }
        (Err(NotSaved::IsThere), _) => {
            state.dialogs.replace = Some((PathRequest::SaveAs, file));
            false
        }
        (Err(NotSaved::Failed(text)), Saved::Model { .. }) => {
            state.messages.error("The model cannot be saved", text);
            false
        }
        (Err(NotSaved::Failed(text)), Saved::Project { .. }) => {
            state.messages.error("The project cannot be saved", text);
            false
        }
    };
    if !is_saved {
        // What was to come after it is asked about again.
        state.dialogs.unsaved = state.saves.then.take().or(state.dialogs.unsaved.take());
    }
    begin_next(state);
    if !state.saves.are_under_way()
        && let Some(then) = state.saves.then.take()
    {
        // Where something has changed while it was written, that is asked about.
        leave(state, then);
    }
}

fn saved(state: &mut State, of: Saved, file: PathBuf) {
    match of {
        Saved::Model { folder, model } => {
            let page = state.modelling.as_mut().filter(|page| page.folder == folder);
            if let Some(page) = page {
                if let Some(document) = &mut page.document {
                    document.mark_saved(model);
                }
                if !page.is_changed() {
                    model_keeping::forget_kept(state, folder);
                }
            }
        }
        Saved::Project { opened, edit, storing } => {
            let project = state.project.as_mut().filter(|own| Arc::ptr_eq(&own.opened, &opened));
            if let Some(project) = project {
                project.file = Some(file.clone());
                project.mark_saved_as(edit);
                if let Some(storing) = storing {
                    project.results = Some(storing.folder.clone());
                    project.mark_results_saved(&storing.reconstruction);
                    state.jobs.store_results(*storing);
                }
                if !project.is_changed() && !state.jobs.is_storing() {
                    keeping::forget_kept(state);
                }
            }
            state.settings.remember(&file);
            save_settings(state);
        }
    }
    state.messages.notice(format!("Saved {}", file.display()));
}

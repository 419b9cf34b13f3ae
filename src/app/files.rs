//! Opening, saving, autosaving and recovering projects. Files themselves are `io`'s.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::dialogs::{Locate, Then};
use super::edit::Edit;
use super::project::Project;
use super::state::State;
use super::view_file;
use crate::io::project::{self, ProjectFile, Tag};
use crate::io::settings;
use crate::scene::Capture;

/// Unsaved work is kept this often.
const AUTOSAVE: Duration = Duration::from_secs(30);

/// What is being opened.
pub struct Opening {
    /// What was asked for; what the list of recent projects will name.
    pub path: PathBuf,
    /// The capture to load.
    pub folder: PathBuf,
    pub project: Option<Box<ProjectFile>>,
    /// The project file to save to.
    pub file: Option<PathBuf>,
    /// It is unsaved work that a crash left.
    pub recovered: Option<PathBuf>,
    pub began: Instant,
}

/// Opens a capture's folder or a project file; asks first where work would be lost.
pub fn open(state: &mut State, path: &Path) {
    if state.project.as_ref().is_some_and(Project::is_changed) {
        state.dialogs.unsaved = Some(Then::Open(path.to_owned()));
    } else {
        open_anyway(state, path);
    }
}

pub fn open_anyway(state: &mut State, path: &Path) {
    if project::is_project(path) {
        open_project(state, path, None);
    } else {
        let folder = capture_folder(path);
        state.jobs.open(Opening {
            path: folder.clone(),
            folder,
            project: None,
            file: None,
            recovered: None,
            began: Instant::now(),
        });
    }
}

/// The folder of a capture of which a file was given.
fn capture_folder(path: &Path) -> PathBuf {
    let is_part = ["scene.obj", "transforms.json", "tags.json"]
        .iter()
        .any(|part| path.file_name().is_some_and(|name| name == *part));
    match path.parent() {
        Some(parent) if is_part && path.is_file() => parent.to_owned(),
        _ => path.to_owned(),
    }
}

fn open_project(state: &mut State, path: &Path, recovered: Option<PathBuf>) {
    let read = match project::read(path) {
        Ok(read) => read,
        Err(error) => {
            state.messages.error("This project cannot be opened", error.to_string());
            return;
        }
    };
    let file = if recovered.is_some() { read.original.clone() } else { Some(path.to_owned()) };
    let opening = Opening {
        path: path.to_owned(),
        folder: read.capture.clone(),
        project: Some(Box::new(read)),
        file,
        recovered,
        began: Instant::now(),
    };
    if opening.folder.is_dir() {
        state.jobs.open(opening);
    } else {
        let text = opening.folder.display().to_string();
        state.dialogs.locate = Some(Locate { opening, text });
    }
}

/// The capture of a project was found elsewhere.
pub fn located(state: &mut State, folder: &Path) {
    if let Some(mut locate) = state.dialogs.locate.take() {
        locate.opening.folder = folder.to_owned();
        state.jobs.open(locate.opening);
    }
}

/// Unsaved work of a window that crashed.
pub fn recover(state: &mut State, file: &Path) {
    state.left_behind.retain(|other| other != file);
    open_project(state, file, Some(file.to_owned()));
}

pub fn discard(state: &mut State, file: &Path) {
    settings::discard(file);
    state.left_behind.retain(|other| other != file);
}

/// A capture has been read: it takes the place of the open project.
pub fn opened(state: &mut State, opening: Opening, capture: Arc<Capture>) {
    close_anyway(state);
    let secs = opening.began.elapsed().as_secs_f64();
    for warning in &capture.warnings {
        state.messages.warning(warning.clone());
    }
    if !capture.warnings.is_empty() {
        let count = capture.warnings.len();
        let plural = if count == 1 { "warning" } else { "warnings" };
        state.messages.notice(format!("Opened with {count} {plural}: see the log"));
    }
    state.messages.info(format!("Opened {} in {secs:.2} s", opening.folder.display()));
    let moved = opening.project.as_ref().is_some_and(|file| file.capture != opening.folder);
    let mut project = Project::new(opening.folder, capture, secs);
    project.file = opening.file;
    if let Some(stored) = opening.project {
        let (materials, warnings) = project::materials(&stored.tags, &project.loaded);
        for warning in warnings {
            state.messages.warning(warning);
        }
        project.set_edit(Arc::new(Edit { materials, options: stored.options }));
        if opening.recovered.is_none() && !moved {
            project.mark_saved();
        }
        view_file::apply(&stored.view, &mut state.viewport.settings);
        state.layout.restore(&stored.layout);
    }
    if let Some(left) = opening.recovered {
        settings::discard(&left);
        state.messages.notice("Unsaved work was recovered. Save it to keep it.");
    } else {
        let path = opening.path.canonicalize().unwrap_or(opening.path);
        state.settings.remember(&path);
        save_settings(state);
    }
    state.viewport.frame_all();
    state.project = Some(project);
    state.panels.forget();
}

/// Leaves the project without asking.
pub fn close_anyway(state: &mut State) {
    if let Some(mut project) = state.project.take() {
        state.jobs.cancel(&mut project);
    }
    state.viewport.clear();
    if let Some(recovery) = &state.recovery {
        recovery.forget();
    }
    state.kept = None;
}

fn file_of(state: &State, project: &Project) -> ProjectFile {
    ProjectFile {
        capture: project.folder.clone(),
        original: None,
        tags: project.edit().materials.iter().map(|m| Tag::of(m, &project.loaded)).collect(),
        options: project.edit().options.clone(),
        view: view_file::value(&state.viewport.settings),
        layout: state.layout.value(),
    }
}

/// Saves to the project's file; says whether that worked. Without a file it asks for one.
pub fn save(state: &mut State) -> bool {
    match state.project.as_ref().map(|project| project.file.clone()) {
        Some(Some(file)) => save_to(state, &file),
        Some(None) => {
            super::dialogs::ask_path(state, super::dialogs::Asked::SaveAs);
            false
        }
        None => false,
    }
}

pub fn save_to(state: &mut State, file: &Path) -> bool {
    let Some(project) = &state.project else { return false };
    let file = if project::is_project(file) {
        file.to_owned()
    } else {
        file.with_added_extension(project::EXTENSION)
    };
    if let Err(error) = project::write(&file, &file_of(state, project)) {
        state.messages.error("The project cannot be saved", error.to_string());
        return false;
    }
    let file = file.canonicalize().unwrap_or(file);
    if let Some(project) = &mut state.project {
        project.file = Some(file.clone());
        project.mark_saved();
    }
    if let Some(recovery) = &state.recovery {
        recovery.forget();
    }
    state.kept = None;
    state.settings.remember(&file);
    save_settings(state);
    state.messages.notice(format!("Saved {}", file.display()));
    true
}

/// Keeps unsaved work now and then, for recovery.
pub fn autosave(state: &mut State) {
    if state.autosaved.elapsed() >= AUTOSAVE {
        autosave_now(state);
    }
    if state.project.as_ref().is_some_and(Project::is_changed) {
        // An idle window draws no frames of its own.
        state.ctx.request_repaint_after(AUTOSAVE.saturating_sub(state.autosaved.elapsed()));
    }
}

pub fn autosave_now(state: &mut State) {
    state.autosaved = Instant::now();
    let (Some(recovery), Some(project)) = (&state.recovery, &state.project) else { return };
    if !project.is_changed() {
        if state.kept.take().is_some() {
            recovery.forget();
        }
        return;
    }
    if state.kept.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, project.edit())) {
        return;
    }
    let kept = project.edit().clone();
    let file = ProjectFile { original: project.file.clone(), ..file_of(state, project) };
    match recovery.keep(&file) {
        Ok(()) => state.kept = Some(kept),
        Err(error) => state.messages.warning(format!("Autosave: {error}")),
    }
}

/// Preferences are written when they change; a failure costs only them.
pub fn save_settings(state: &mut State) {
    let Some(home) = &state.home else { return };
    if let Err(error) = state.settings.write(home) {
        state.messages.warning(error.to_string());
    }
}

//! Opens, saves and closes projects. `io` reads and writes the files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::actions::PathRequest;
use super::asking::ask_path;
use super::dialogs::Locate;
use super::edit::Edit;
use super::given::GivenLight;
use super::keeping;
use super::masking;
use super::modelling::keeping as model_keeping;
use super::opening::{AfterPrompt, Opening, ProjectOnDisk, ReadingProject};
use super::pending::{Answer, Pending};
use super::project::Project;
use super::project_file::file_of;
use super::reopening;
use super::solo::Alone;
use super::state::State;
use super::view_file;
use crate::io::edits::{StoredEdits, Unread};
use crate::io::tags::StoredLights;
use crate::io::{project, results};
use crate::scene::{Capture, Environment};

/// Opens a capture's folder or a project file.
pub fn open_unprompted(state: &mut State, path: &Path) {
    if project::is_project(path) {
        open_project(state, path, false);
    } else {
        let folder = capture_folder(path);
        state.jobs.open(Opening {
            path: folder.clone(),
            folder,
            project: None,
            edits: None,
            lights: None,
            file: None,
            recovered: None,
            is_reopened: false,
            agreed: state.unsaved_work(false),
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

/// Reads a project's file on a thread: a drive may take its time, and masks are large.
fn open_project(state: &mut State, path: &Path, is_recovered: bool) {
    state.jobs.cancel_opening();
    let asked = path.to_owned();
    let read = move || {
        // A recovered project names its file for windows that run elsewhere.
        let path = dunce::canonicalize(&asked).unwrap_or(asked);
        let file = project::read(&path).map_err(|error| error.to_string())?;
        let has_capture = file.capture.is_dir();
        Ok(ProjectOnDisk { path, file, has_capture })
    };
    state.jobs.reading_project = Some(ReadingProject {
        path: path.to_owned(),
        is_recovered,
        agreed: state.unsaved_work(false),
        began: Instant::now(),
        answer: Pending::start("project", &state.ctx, read),
    });
}

/// Goes on with a project whose file has been read.
pub fn follow_reading(state: &mut State) {
    let Some(reading) = &state.jobs.reading_project else { return };
    let answer = match reading.answer.answer() {
        Answer::Waiting => return,
        Answer::Ready(answer) => answer,
        Answer::Lost => Err("Reading it failed; the log has more.".to_owned()),
    };
    let Some(reading) = state.jobs.reading_project.take() else { return };
    let ProjectOnDisk { path, file: read, has_capture } = match answer {
        Ok(read) => read,
        Err(text) => {
            state.messages.error("This project cannot be opened", text);
            return;
        }
    };
    let file = if reading.is_recovered { read.original.clone() } else { Some(path.clone()) };
    let opening = Opening {
        folder: read.capture.clone(),
        project: Some(Box::new(read)),
        edits: None,
        lights: None,
        file,
        recovered: reading.is_recovered.then_some(reading.path),
        is_reopened: false,
        agreed: reading.agreed,
        began: reading.began,
        path,
    };
    if has_capture {
        state.jobs.open(opening);
    } else {
        let text = opening.folder.display().to_string();
        state.dialogs.locate = Some(Locate { opening, text, focused: false });
    }
}

/// The capture of a project was found elsewhere.
pub fn located(state: &mut State, folder: &Path) {
    if let Some(mut locate) = state.dialogs.locate.take() {
        locate.opening.folder = folder.to_owned();
        state.jobs.open(locate.opening);
    }
}

/// Opens unsaved work of a window that crashed.
pub fn recover_unprompted(state: &mut State, file: &Path) {
    open_project(state, file, true);
}

/// A capture has been read: it takes the place of the open project, unless work was done there
/// meanwhile that nobody agreed to lose.
pub fn opened(state: &mut State, opening: Opening, capture: Arc<Capture>) {
    let mut lost = state.unsaved_work(false);
    if opening.is_reopened {
        (lost.edit, lost.model) = (None, None);
    }
    if lost.is_within(&opening.agreed) {
        show(state, opening, capture);
    } else {
        state.dialogs.unsaved = Some(AfterPrompt::Show(Box::new(opening), capture));
    }
}

pub fn show(state: &mut State, opening: Opening, capture: Arc<Capture>) {
    // The model of the same capture stays, with its undo.
    let page = state.modelling.take_if(|page| page.folder == opening.folder);
    let before = reopening::take(state, &opening);
    close_unprompted(state);
    state.modelling = page;
    if let Some(page) = &mut state.modelling {
        page.is_shown = false;
    }
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
    let stored = opening.project.as_deref();
    let (solution, results) =
        stored.map_or((None, None), |own| (own.solution.clone(), own.results.clone()));
    let mut project = Project::new(opening.folder, capture, secs);
    project.file = opening.file;
    if let Some(before) = before {
        reopening::carry_over(&before, &mut project, &mut state.messages);
    }
    state.viewport.frame_all();
    let alone = stored.and_then(|own| Alone::of_value(own.view.get("alone")?));
    if let Some(stored) = opening.project {
        let given = given_by(opening.lights, stored.environment, &project.loaded, state);
        let resolved = project::materials(&stored.tags, &given.lit(&project.loaded));
        let edits = opening.edits.map_or_else(StoredEdits::default, |edits| *edits);
        tell_unread(state, &edits.warnings, &edits.unread, &given.unread);
        project.set_edit(Arc::new(Edit {
            materials: resolved.materials,
            options: stored.options,
            given: Arc::new(given),
            relight: Arc::new(edits.edits),
            unread: Arc::new(edits.unread),
            absent: resolved.absent,
            masks: Arc::new(stored.masks),
        }));
        // Saving would write the capture's new place.
        if opening.recovered.is_some() || moved {
            project.mark_unsaved();
        } else {
            project.mark_saved();
        }
        let mut warnings = resolved.warnings;
        warnings.extend(masking::unused(&project, &project.edit().masks));
        if !warnings.is_empty() {
            let text = warnings.join("\n") + "\nSaving keeps these tags and masks as they are.";
            state.messages.error("The capture has changed since the project was saved", text);
        }
        view_file::apply(&stored.view, &mut state.viewport.settings);
        if let Some(camera) = view_file::camera(&stored.view) {
            state.viewport.set_camera(camera);
        }
        state.layout.restore(&stored.layout);
    }
    state.project = Some(project);
    if let Some(project) = &mut state.project {
        project.solution.clone_from(&solution);
        project.results.clone_from(&results);
        match (results, solution) {
            (Some(folder), _) => {
                state.jobs.read_results(project, folder, opening.recovered.clone());
            }
            (None, Some(folder)) => state.jobs.read_solved(project, folder),
            (None, None) => {}
        }
    }
    state.panels.forget();
    state.panels.set_alone(alone);
    if let Some(left) = opening.recovered {
        if !state.jobs.is_restoring() {
            keeping::take_over(state, &left);
        }
        state.messages.notice("Unsaved work was recovered. Save it to keep it.");
    } else {
        remember(state, &opening.path);
    }
}

/// Puts a path in front of the recent ones.
pub fn remember(state: &mut State, path: &Path) {
    let path = dunce::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    state.settings.remember(&path);
    save_settings(state);
}

/// The known light of a project: its own, or that of the capture's tags.
fn given_by(
    lights: Option<Box<StoredLights>>,
    environment: Option<Environment>,
    loaded: &Capture,
    state: &mut State,
) -> GivenLight {
    let mut given = GivenLight::of(loaded);
    given.environment = environment.unwrap_or(given.environment);
    if let Some(stored) = lights {
        for warning in stored.warnings {
            state.messages.warning(warning);
        }
        (given.lights, given.unread) = (stored.lights, stored.unread);
    }
    given
}

/// Says what of a project could not be read, and what to do about it.
fn tell_unread(state: &mut State, warnings: &[String], edits: &[Unread], lights: &[Unread]) {
    for warning in warnings {
        state.messages.warning(warning.clone());
    }
    let all = edits.iter().chain(lights);
    let problems: Vec<&str> = all.filter_map(|part| part.problem.as_deref()).collect();
    if !problems.is_empty() {
        let text = format!(
            "{}\nSaving keeps them as they are. The panels Relight and Known light list them: \
             point a missing file at its new place there.",
            problems.join("\n")
        );
        state.messages.error("Parts of the project could not be read", text);
    }
}

/// Leaves the project without asking.
pub fn close_unprompted(state: &mut State) {
    if let Some(mut project) = state.project.take() {
        state.jobs.cancel(&mut project);
    }
    model_keeping::close(state);
    state.jobs.studies.forget();
    state.jobs.stop_restoring();
    state.jobs.stop_suggesting();
    state.viewport.clear();
    state.dialogs.forget_project();
    keeping::forget_kept(state);
}

/// Saves the model and the project, as far as they have changed; says whether that worked.
pub fn save_all(state: &mut State) -> bool {
    let is_changed =
        |project: &Project| project.is_changed() || project.unsaved_results().is_some();
    let is_drawn_on = state.modelling.as_ref().is_some_and(|page| page.is_changed());
    (!is_drawn_on || model_keeping::save(state))
        && (!state.project.as_ref().is_some_and(is_changed) || save(state))
}

/// Saves to the project's file; says whether that worked. Without a file it asks for one.
pub fn save(state: &mut State) -> bool {
    match state.project.as_ref().map(|project| project.file.clone()) {
        Some(Some(file)) => save_to(state, &file, true),
        Some(None) => {
            ask_path(state, PathRequest::SaveAs);
            false
        }
        None => false,
    }
}

/// Saves to a file; one that is there already, and not the project's own, is replaced only when
/// that was agreed to.
pub fn save_to(state: &mut State, file: &Path, replace: bool) -> bool {
    let Some(project) = &state.project else { return false };
    let file = if project::is_project(file) {
        file.to_owned()
    } else {
        file.with_added_extension(project::EXTENSION)
    };
    let is_own = || dunce::canonicalize(&file).ok().as_ref() == project.file.as_ref();
    if !replace && file.exists() && !is_own() {
        state.dialogs.replace = Some((PathRequest::SaveAs, file));
        return false;
    }
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
    if let Err(error) = project::write_over(&file, &stored) {
        state.messages.error("The project cannot be saved", error.to_string());
        return false;
    }
    let file = dunce::canonicalize(&file).unwrap_or(file);
    if let Some(project) = &mut state.project {
        project.file = Some(file.clone());
        project.results = stored.results;
        project.mark_saved();
        if let Some(storing) = storing {
            project.mark_results_saved();
            state.jobs.store_results(storing);
        }
    }
    if !state.jobs.is_storing() {
        keeping::forget_kept(state);
    }
    state.settings.remember(&file);
    save_settings(state);
    state.messages.notice(format!("Saved {}", file.display()));
    true
}

/// Looks for what was open recently, on a thread: a drive may take its time to answer.
pub fn look_for_recent(state: &mut State) {
    let recent = state.settings.recent.clone();
    // Where nothing comes all of them are offered; opening one tells what is wrong.
    let look = move || recent.into_iter().filter(|path| !path.exists()).collect();
    state.looking = Some(Pending::start("recent", &state.ctx, look));
}

pub fn found_recent(state: &mut State) {
    if let Some(missing) = Pending::take(&mut state.looking) {
        state.missing = missing;
    }
}

/// Preferences are written when they change; a failure costs only them.
pub fn save_settings(state: &mut State) {
    let Some(home) = state.home.clone() else { return };
    let settings = state.settings.clone();
    state.writer.send(move || settings.write(&home).map_err(|error| error.to_string()));
}

//! Opens and closes projects. `io` reads the files; `saving` has them written.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::dialogs::Locate;
use super::edit::Edit;
use super::given::GivenLight;
use super::keeping;
use super::masking;
use super::modelling::keeping as model_keeping;
use super::opening::{AfterPrompt, LookingInto, OnDisk, Opening};
use super::pending::{Answer, Pending};
use super::project::Project;
use super::reopening;
use super::solo::Alone;
use super::state::State;
use super::view_file;
use crate::io::edits::{StoredEdits, Unread};
use crate::io::project;
use crate::io::tags::StoredLights;
use crate::scene::{Capture, Environment};

/// Opens a capture's folder or a project file.
pub fn open_unprompted(state: &mut State, path: &Path) {
    if project::is_project(path) {
        open_project(state, path, false);
    } else {
        let asked = path.to_owned();
        read(state, path, false, move || Ok(OnDisk::Capture(capture_folder(&asked))));
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
    let asked = path.to_owned();
    read(state, path, is_recovered, move || {
        // A recovered project names its file for windows that run elsewhere.
        let path = dunce::canonicalize(&asked).unwrap_or(asked);
        let file = project::read(&path).map_err(|error| error.to_string())?;
        let has_capture = file.capture.is_dir();
        Ok(OnDisk::Project { path, file: Box::new(file), has_capture })
    });
}

/// Looks at what was asked for, on a thread.
fn read(
    state: &mut State,
    path: &Path,
    is_recovered: bool,
    look: impl FnOnce() -> Result<OnDisk, String> + Send + 'static,
) {
    state.jobs.cancel_opening();
    state.jobs.looking_into = Some(LookingInto {
        path: path.to_owned(),
        is_recovered,
        agreed: state.unsaved_work(false),
        began: Instant::now(),
        answer: Pending::start("open", &state.ctx, look),
    });
}

/// Goes on with what was found where something is to be opened.
pub fn follow_reading(state: &mut State) {
    let Some(looking) = &state.jobs.looking_into else { return };
    let answer = match looking.answer.answer() {
        Answer::Waiting => return,
        Answer::Ready(answer) => answer,
        Answer::Lost => Err("Reading it failed; the log has more.".to_owned()),
    };
    let Some(looking) = state.jobs.looking_into.take() else { return };
    let found = match answer {
        Ok(found) => found,
        Err(text) => {
            state.messages.error("This project cannot be opened", text);
            return;
        }
    };
    let (path, folder, project, has_capture) = match found {
        OnDisk::Capture(folder) => (folder.clone(), folder, None, true),
        OnDisk::Project { path, file, has_capture } => {
            (path, file.capture.clone(), Some(file), has_capture)
        }
    };
    let file = project.as_ref().and_then(|own| match looking.is_recovered {
        true => own.original.clone(),
        false => Some(path.clone()),
    });
    let charts = project.as_ref().and_then(|own| own.charts.clone());
    let opening = Opening {
        path,
        folder,
        project,
        edits: None,
        charts,
        read_charts: None,
        lights: None,
        file,
        recovered: looking.is_recovered.then_some(looking.path),
        is_reopened: false,
        agreed: looking.agreed,
        began: looking.began,
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
    if let Some(charts) = opening.read_charts {
        for warning in &charts.warnings {
            state.messages.warning(warning.clone());
        }
        project.opened_with(*charts);
    }
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
            charts: project.edit().charts.clone(),
            unread_charts: project.edit().unread_charts.clone(),
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
    state.jobs.charts.forget();
    state.viewport.clear();
    state.dialogs.forget_project();
    keeping::forget_kept(state);
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

//! What files and folders that are dropped onto the window are for: by their names and by where
//! they are dropped. What is of no use is told, with what would be.

use std::path::{Path, PathBuf};

use eframe::egui;

use super::actions::{Action, Field, ImportAction, NewAction, Outcome, Relight};
use super::errands;
use super::state::State;
use super::workspaces::Workspace;
use crate::io::import::{is_foreign, is_photograph};
use crate::io::{capture, mesh, project};

/// Where something is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// The start page.
    Start,
    Window,
    /// With a project open.
    Relight,
    Import,
}

/// Takes what was dropped in this frame; what it is, a thread looks up.
pub fn take(ctx: &egui::Context, state: &mut State) {
    let paths: Vec<PathBuf> = ctx
        .input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect());
    if paths.is_empty() {
        return;
    }
    let is_relit = state.project.is_some() && state.layout.current == Workspace::Relight;
    let place = match is_relit {
        _ if state.is_importing() => Place::Import,
        true => Place::Relight,
        false if state.project.is_none() && state.modelling.is_none() => Place::Start,
        false => Place::Window,
    };
    errands::start(state, move || meanings(&paths, place));
}

fn meanings(paths: &[PathBuf], place: Place) -> Vec<Outcome> {
    let mut meant: Vec<Action> = Vec::new();
    let mut outcomes = Vec::new();
    for path in paths {
        match meaning(path, place) {
            // Of many photographs one names their folder.
            Ok(more) if more.iter().all(|action| meant.contains(action)) => {}
            Ok(more) => meant.extend(more),
            Err(problem) => {
                let text = format!("{}: {problem}", path.display());
                outcomes.push(Outcome::Error("This cannot be used here", text));
            }
        }
    }
    outcomes.extend(meant.into_iter().map(Outcome::Do));
    outcomes
}

fn meaning(path: &Path, place: Place) -> Result<Vec<Action>, &'static str> {
    if !path.exists() {
        return Err("there is no such file any more.");
    }
    let import = |actions: Vec<ImportAction>| {
        Ok(actions.into_iter().map(Action::Import).collect::<Vec<_>>())
    };
    if project::is_project(path) {
        return Ok(vec![Action::Open(path.to_owned())]);
    }
    if place == Place::Relight && path.is_file() {
        let extension = path.extension().map(|own| own.to_string_lossy().to_lowercase());
        let what = match extension.as_deref() {
            _ if mesh::is_mesh(path) => Some(Relight::AddObject(path.to_owned())),
            Some("exr" | "hdr") => Some(Relight::AddDome(path.to_owned())),
            Some("json") if !is_foreign(path) => Some(Relight::Load(path.to_owned())),
            _ => None,
        };
        if let Some(what) = what {
            return Ok(vec![Action::Relight(what)]);
        }
    }
    let folder = photographs(path);
    if place == Place::Import {
        return import(vec![match folder {
            Some(folder) => ImportAction::Choose(Field::Images, folder),
            None => ImportAction::Show(Some(path.to_owned())),
        }]);
    }
    if is_foreign(path) {
        return import(vec![ImportAction::Show(Some(path.to_owned()))]);
    }
    if is_capture(path) {
        return Ok(vec![Action::Open(path.to_owned())]);
    }
    match folder {
        Some(_) if place == Place::Start => {
            Ok(vec![Action::New(NewAction::Add(vec![path.to_owned()]))])
        }
        Some(folder) => {
            import(vec![ImportAction::Show(None), ImportAction::Choose(Field::Images, folder)])
        }
        None if path.is_dir() => Err(
            "there is neither a capture nor a file with cameras nor a photograph in this folder. \
             A capture is a folder with scene.obj, transforms.json and the photographs.",
        ),
        None => {
            Err("files of this kind are not read. Drop a project, the folder of a capture, a file \
             with cameras, photographs, or in Relight a mesh, a sky (EXR or HDR) or edits (JSON).")
        }
    }
}

/// A capture's folder, or one of its files.
fn is_capture(path: &Path) -> bool {
    if path.is_dir() {
        return path.join("transforms.json").is_file() || capture::find_geometry(path).is_ok();
    }
    let name = path.file_name().unwrap_or_default();
    ["scene.obj", "transforms.json", "tags.json"].iter().any(|own| name == *own)
}

/// The folder of a photograph, or a folder of photographs that is nothing else.
fn photographs(path: &Path) -> Option<PathBuf> {
    if path.is_file() {
        return path.parent().filter(|_| is_photograph(path)).map(Path::to_owned);
    }
    if is_foreign(path) || is_capture(path) {
        return None;
    }
    let mut files = std::fs::read_dir(path).ok()?.flatten().map(|entry| entry.path());
    files.any(|file| file.is_file() && is_photograph(&file)).then(|| path.to_owned())
}

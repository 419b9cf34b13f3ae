//! Asks for files and folders.
//!
//! File dialogs are the system's, asked on a thread. Where there is none (`file_dialog::exist`), the
//! window shows a field for the path instead. Where a session bus is there and no portal, such a
//! dialog answers like Cancel within milliseconds; nobody cancels that fast, so then the field is
//! shown, too.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::actions::{Action, NewAction, Outcome, PathRequest};
use super::dialogs::PathField;
use super::errands;
use super::jobs::studies::Kind;
use super::pending::{Answer, Pending};
use super::state::State;
use crate::io::project::{EXTENSION, is_project};

const NO_SYSTEM_DIALOG: &str =
    "This system offers no file dialog here, so please type or paste the path.";
/// An answer faster than this came from no hand.
const NO_HAND: Duration = Duration::from_millis(250);
/// Who asks again after this long sees no dialog.
const NO_DIALOG: Duration = Duration::from_secs(5);

/// Asks for a path by the system's dialog, or by our own where there is none.
pub fn ask_path(state: &mut State, asked: PathRequest) {
    if let Some(picking) = &state.dialogs.picking {
        if picking.began.elapsed() >= NO_DIALOG {
            state.dialogs.picking = None;
            let notice = "The system's file dialog has not answered. Type or paste the path here.";
            show_field(state, asked, Some(notice));
        }
        return;
    }
    if state.dialogs.own_only {
        show_field(state, asked, Some(NO_SYSTEM_DIALOG));
        return;
    }
    // It needs the window that it stands before: the end of the frame has it.
    state.dialogs.wanted = Some(asked);
}

/// Takes the answer of the system's dialog, once it is there.
pub fn poll(state: &mut State, actions: &mut Vec<Action>) {
    if Pending::take(&mut state.dialogs.looking_for_system) == Some(true) {
        state.dialogs.own_only = false;
    }
    let Some(picking) = &state.dialogs.picking else { return };
    let asked = picking.asked;
    let (answer, took) = match picking.answer.answer() {
        Answer::Ready(answer) => answer,
        Answer::Waiting => return,
        Answer::Lost => (Vec::new(), Duration::ZERO),
    };
    state.dialogs.picking = None;
    match answer.as_slice() {
        paths @ [_, ..] if asked == PathRequest::NewPhotographs => {
            actions.push(Action::New(NewAction::Add(paths.to_vec())));
        }
        [path, ..] => {
            // The system has asked about a file of this very name.
            let replace = is_project(path)
                || asked == PathRequest::SaveEdits
                || matches!(asked, PathRequest::SavePlot(_, kind) if kind.is_end_of(path));
            actions.push(asked.action(path.clone(), replace));
        }
        [] if took < NO_HAND => {
            show_field(state, asked, Some(NO_SYSTEM_DIALOG));
        }
        [] => {}
    }
}

/// Goes on with a path; where something is there already, only with leave to replace it.
pub fn ask_before_replacing(state: &mut State, asked: PathRequest, path: PathBuf, there: PathBuf) {
    errands::start(state, move || {
        vec![match there.exists() {
            true => Outcome::AskToReplace(asked, path),
            false => Outcome::Do(asked.action(path, true)),
        }]
    });
}

fn show_field(state: &mut State, asked: PathRequest, notice: Option<&'static str>) {
    let text = suggestion(state, asked).display().to_string();
    state.dialogs.path = Some(PathField { asked, text, notice, focused: false });
}

/// Where to begin looking.
pub(super) fn suggestion(state: &State, asked: PathRequest) -> PathBuf {
    let recent =
        || state.settings.recent.first().and_then(|path| path.parent()).map(|path| path.join(""));
    let (project, dialogs) = (state.project.as_ref(), &state.dialogs);
    let typed = |folder: Option<&String>| folder.map(PathBuf::from).unwrap_or_default();
    if let (Some(field), Some(page)) = (asked.field(), &state.import) {
        return page.suggestion(field);
    }
    match asked {
        PathRequest::ImportCameras
        | PathRequest::ImportCameraFolder
        | PathRequest::ImportImages
        | PathRequest::ImportMesh
        | PathRequest::ImportOut => recent().unwrap_or_default(),
        PathRequest::OpenCapture | PathRequest::OpenProject | PathRequest::NewPhotographs => {
            recent().unwrap_or_default()
        }
        PathRequest::NewFolder => typed(dialogs.begin.as_ref().map(|own| &own.folder)),
        PathRequest::SaveAs => project.map_or_else(PathBuf::new, |project| match &project.file {
            Some(file) => file.clone(),
            None => beside(&project.folder, &format!("{}.{EXTENSION}", project.loaded.name)),
        }),
        PathRequest::Export => project.map_or_else(PathBuf::new, |project| {
            beside(&project.folder, &format!("{}-results", project.name()))
        }),
        PathRequest::AddObject
        | PathRequest::AddDome
        | PathRequest::AddSky
        | PathRequest::AddChartTable
        | PathRequest::LoadEdits => {
            project.map_or_else(PathBuf::new, |project| beside(&project.folder, ""))
        }
        PathRequest::SaveEdits => project.map_or_else(PathBuf::new, |project| {
            beside(&project.folder, &format!("{}-edits.json", project.name()))
        }),
        PathRequest::RenderTo => typed(dialogs.pictures.as_ref().map(|own| &own.folder)),
        PathRequest::SceneFolder => typed(dialogs.scene_export.as_ref().map(|own| &own.folder)),
        PathRequest::Find(index) => {
            project.and_then(|project| project.edit().unread.get(index)?.file()).unwrap_or_default()
        }
        PathRequest::FindLight(index) => project
            .and_then(|project| project.edit().given.unread.get(index)?.file())
            .unwrap_or_default(),
        PathRequest::SavePlot(plotted, kind) => project.map_or_else(PathBuf::new, |project| {
            let (stem, end) = (plotted.stem(), kind.end());
            beside(&project.folder, &format!("{}-{stem}.{end}", project.name()))
        }),
        PathRequest::SaveStudy(kind) => project.map_or_else(PathBuf::new, |project| {
            let what = if kind == Kind::Speed { "speed" } else { "stability" };
            beside(&project.folder, &format!("{}-{what}", project.name()))
        }),
        PathRequest::Locate => state
            .dialogs
            .locate
            .as_ref()
            .map_or_else(PathBuf::new, |locate| locate.opening.folder.clone()),
    }
}

/// A name beside a folder, as an absolute path.
pub(super) fn beside(folder: &Path, name: &str) -> PathBuf {
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    folder.parent().unwrap_or(Path::new("")).join(name)
}

//! Questions to the user: which file, what about unsaved work, where a capture went.
//!
//! File dialogs are the system's, asked on a thread. Where there is no portal and no helper
//! program, such a dialog answers like Cancel within milliseconds; nobody cancels that fast, so
//! then the window shows a field for the path instead.

use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use super::actions::{Action, Relight, Study};
use super::files::Opening;
use super::guide::GuideView;
use super::import::{Field, ImportAction};
use super::jobs::studies::Kind;
use super::leaving::AfterPrompt;
use super::lighting::Lighting;
use super::modelling::begin::{NewAction, NewCapture};
use super::picture_choices::PictureChoices;
use super::plots::{PlotFile, Plotted};
use super::scene_export::{ExportAction, ExportQuestion};
use super::state::State;
use crate::io::project::{EXTENSION, is_project};

/// An answer faster than this came from no hand.
const NO_HAND: Duration = Duration::from_millis(250);
/// Who asks again after this long sees no dialog.
const NO_DIALOG: Duration = Duration::from_secs(5);

/// What a path is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathRequest {
    OpenCapture,
    OpenProject,
    SaveAs,
    Export,
    Locate,
    AddObject,
    AddDome,
    /// A known sky.
    AddSky,
    LoadEdits,
    SaveEdits,
    RenderTo,
    /// For the recovered scene.
    SceneFolder,
    /// A file that the project names, and that is not there, by its index.
    Find(usize),
    /// The same of a known light.
    FindLight(usize),
    ImportCameras,
    ImportCameraFolder,
    ImportImages,
    ImportMesh,
    ImportOut,
    /// Photographs to begin a capture with, and the capture's folder.
    NewPhotographs,
    NewFolder,
    /// A plot as a file.
    SavePlot(Plotted, PlotFile),
    /// A folder for what a study has found.
    SaveStudy(Kind),
}

/// A project whose capture is not where it was.
pub struct Locate {
    pub opening: Opening,
    pub text: String,
    pub focused: bool,
}

/// Our own field for a path.
pub struct PathField {
    pub asked: PathRequest,
    pub text: String,
    /// Why it is shown.
    pub notice: Option<&'static str>,
    pub focused: bool,
}

pub(super) struct Picking {
    pub asked: PathRequest,
    /// What was picked, and how long that took.
    pub answer: Receiver<(Vec<PathBuf>, Duration)>,
    pub began: Instant,
}

#[derive(Default)]
pub struct Dialogs {
    pub path: Option<PathField>,
    /// What comes after the question about unsaved work.
    pub unsaved: Option<AfterPrompt>,
    /// What would be replaced, and by what.
    pub replace: Option<(PathRequest, PathBuf)>,
    pub locate: Option<Locate>,
    /// A capture that has cameras and no mesh.
    pub meshless: Option<PathBuf>,
    /// A capture that is begun of photographs.
    pub begin: Option<NewCapture>,
    /// The recovered scene for other programs.
    pub scene_export: Option<ExportQuestion>,
    /// Pictures that are to be written.
    pub pictures: Option<PictureChoices>,
    pub pictures_focused: bool,
    /// The choices of the time before.
    pub last_pictures: PictureChoices,
    /// A run that would spoil the seconds of a study; whether afresh.
    pub run_beside_study: Option<bool>,
    pub palette: Option<Palette>,
    pub shortcuts: bool,
    pub about: bool,
    /// The guide stands beside the work.
    pub guide: Option<GuideView>,
    /// The text of the report of a problem.
    pub report: Option<String>,
    /// Which material the selected surfaces go to.
    pub assign: bool,
    /// Tests have no dialogs of the system.
    pub own_only: bool,
    /// A path that the system's dialog is to be asked for in this frame.
    pub(super) wanted: Option<PathRequest>,
    pub(super) picking: Option<Picking>,
}

#[derive(Default)]
pub struct Palette {
    pub text: String,
    pub chosen: usize,
}

impl Dialogs {
    /// Whether something is open that takes the keys.
    pub fn is_open(&self) -> bool {
        self.path.is_some()
            || self.unsaved.is_some()
            || self.replace.is_some()
            || self.locate.is_some()
            || self.meshless.is_some()
            || self.begin.is_some()
            || self.scene_export.is_some()
            || self.pictures.is_some()
            || self.run_beside_study.is_some()
            || self.palette.is_some()
            || self.shortcuts
            || self.about
            || self.report.is_some()
            || self.assign
    }

    /// What was asked about a project goes with it.
    pub fn forget_project(&mut self) {
        let of_project = |asked: PathRequest| {
            !matches!(
                asked,
                PathRequest::OpenCapture
                    | PathRequest::OpenProject
                    | PathRequest::Locate
                    | PathRequest::NewPhotographs
                    | PathRequest::NewFolder
            ) && asked.field().is_none()
        };
        self.picking.take_if(|picking| of_project(picking.asked));
        self.path.take_if(|field| of_project(field.asked));
        self.unsaved = None;
        self.replace = None;
        self.assign = false;
        self.scene_export = None;
        self.pictures = None;
        self.run_beside_study = None;
    }
}

impl PathRequest {
    pub fn title(self) -> &'static str {
        match self {
            Self::OpenCapture => "Open capture",
            Self::OpenProject => "Open project",
            Self::SaveAs => "Save project as",
            Self::Export => "Export results to a folder",
            Self::Locate => "Find the capture",
            Self::AddObject => "Add a mesh (OBJ, glTF, PLY, STL)",
            Self::AddDome => "Add light from all around (EXR or HDR)",
            Self::AddSky => "Add a known sky (EXR or HDR)",
            Self::LoadEdits => "Load edits (JSON)",
            Self::SaveEdits => "Save edits (JSON)",
            Self::RenderTo => "Render pictures into a folder",
            Self::SceneFolder => "Folder for the exported scene",
            Self::Find(_) | Self::FindLight(_) => "Find the file",
            Self::ImportCameras => "File with cameras",
            Self::ImportCameraFolder => "Folder with cameras",
            Self::ImportImages => "Folder of the photographs",
            Self::ImportMesh => "Mesh (OBJ, glTF, PLY, STL)",
            Self::ImportOut => "Folder for the capture",
            Self::NewPhotographs => "Photographs, or a folder of them",
            Self::NewFolder => "Folder for the new capture",
            Self::SavePlot(_, PlotFile::Csv) => "Save the plot's numbers (CSV)",
            Self::SavePlot(_, PlotFile::Svg) => "Save the plot as a drawing (SVG)",
            Self::SaveStudy(Kind::Speed) => "Save the study of speed to a folder",
            Self::SaveStudy(Kind::Stability) => "Save the report of stability to a folder",
        }
    }

    /// Whether a name for a new file is wanted.
    pub(super) fn is_new_file(self) -> bool {
        matches!(self, Self::SaveAs | Self::SaveEdits | Self::SavePlot(..))
    }

    /// The field of the import page that it is for.
    pub fn field(self) -> Option<Field> {
        match self {
            Self::ImportCameras | Self::ImportCameraFolder => Some(Field::Cameras),
            Self::ImportImages => Some(Field::Images),
            Self::ImportMesh => Some(Field::Mesh),
            Self::ImportOut => Some(Field::Out),
            _ => None,
        }
    }

    /// What to do with the path; `replace` where a file that is there may go.
    pub fn action(self, path: PathBuf, replace: bool) -> Action {
        if let Some(field) = self.field() {
            return Action::Import(ImportAction::Choose(field, path));
        }
        match self {
            Self::ImportCameras
            | Self::ImportCameraFolder
            | Self::ImportImages
            | Self::ImportMesh
            | Self::ImportOut => Action::Import(ImportAction::Show(None)),
            Self::OpenCapture | Self::OpenProject => Action::Open(path),
            Self::SaveAs => Action::SaveTo { file: path, replace },
            Self::Export => Action::ExportTo { folder: path, replace },
            Self::Locate => Action::Locate(path),
            Self::AddObject => Action::Relight(Relight::AddObject(path)),
            Self::AddDome => Action::Relight(Relight::AddDome(path)),
            Self::AddSky => Action::Lighting(Lighting::AddSky(path)),
            Self::LoadEdits => Action::Relight(Relight::Load(path)),
            Self::SaveEdits => Action::Relight(Relight::Save(path, replace)),
            Self::RenderTo => Action::Relight(Relight::PicturesFolder(path)),
            Self::SceneFolder => Action::ExportScene(ExportAction::Folder(path)),
            Self::Find(index) => Action::Relight(Relight::Find(index, path)),
            Self::FindLight(index) => Action::Lighting(Lighting::Find(index, path)),
            Self::NewPhotographs => Action::New(NewAction::Add(vec![path])),
            Self::NewFolder => Action::New(NewAction::Folder(path)),
            Self::SavePlot(plotted, kind) => Action::SavePlot(plotted, kind, path, replace),
            Self::SaveStudy(kind) => Action::Study(Study::Save(kind, path)),
        }
    }
}

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
        show_field(state, asked, None);
        return;
    }
    // It needs the window that it stands before: the end of the frame has it.
    state.dialogs.wanted = Some(asked);
}

/// Takes the answer of the system's dialog, once it is there.
pub fn poll(state: &mut State, actions: &mut Vec<Action>) {
    let Some(picking) = &state.dialogs.picking else { return };
    let asked = picking.asked;
    let (answer, took) = match picking.answer.try_recv() {
        Ok(answer) => answer,
        Err(std::sync::mpsc::TryRecvError::Empty) => return,
        Err(std::sync::mpsc::TryRecvError::Disconnected) => (Vec::new(), Duration::ZERO),
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
            let notice =
                "This system offers no file dialog here, so please type or paste the path.";
            show_field(state, asked, Some(notice));
        }
        [] => {}
    }
}

pub(super) fn show_field(state: &mut State, asked: PathRequest, notice: Option<&'static str>) {
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

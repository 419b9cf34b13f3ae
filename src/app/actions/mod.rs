//! Everything that a user can do, as data: panels, commands and what is dropped say what was asked
//! for, and `dispatch` does it at the end of the frame. No file here knows the state of the window.

mod outcome;
mod path_request;
mod plot_file;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DVec2};

use super::change::Change;
use super::jobs::studies::{Kind, SpeedRequest, StabilityRequest};
use super::modelling::tool::Tool;
use super::panes::Pane;
use super::picture_choices::PictureChoices;
use super::relight::{Added, NewLight};
use super::viewport::MaskTool;
use super::workspaces::Workspace;
use crate::io::engines::Engine;
use crate::model::from_points::Wanted;
use crate::model::{self, Model};
use crate::render;
use crate::scene;
use crate::scene::charts::Chart;

pub use outcome::Outcome;
pub use path_request::PathRequest;
pub use plot_file::{PlotFile, Plotted};

#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Ask(PathRequest),
    Open(PathBuf),
    OpenExample,
    CancelOpening,
    /// Takes photographs for radiance by the curve of sRGB.
    TakeAsSrgb,
    Locate(PathBuf),
    Save,
    /// `replace` where another file of that name may go.
    SaveTo {
        file: PathBuf,
        replace: bool,
    },
    /// `replace` where results that are there may go.
    ExportTo {
        folder: PathBuf,
        replace: bool,
    },
    Close,
    Quit,
    /// The answer about unsaved work: save it first, or lose it.
    Unsaved {
        save: bool,
    },
    Recover(PathBuf),
    Discard(PathBuf),
    /// Offers what can be recovered at the next start again.
    NotNow(PathBuf),
    ForgetRecent(PathBuf),
    Undo,
    Redo,
    Change(Change),
    /// Moves something in the 3D view, until one of the next two ends that.
    Transform(Change),
    KeepTransform,
    LeaveTransform,
    /// Asks which material the selected surfaces shall have.
    AskMaterial,
    NewMaterialOfSelection,
    Select(Select),
    HideSelected,
    ShowAllSurfaces,
    Run,
    /// Runs although a study measures seconds; `afresh` as below.
    RunBesideStudy {
        afresh: bool,
    },
    /// Runs without taking anything over from earlier runs.
    RunAfresh,
    Cancel,
    /// Makes a photograph anew from the results.
    Compare(usize),
    /// Finds what the lights see of the photographed surfaces.
    Cover,
    Workspace(Workspace),
    ShowPane(Pane),
    ResetLayout,
    Theme(&'static str),
    /// What traces the paths of pictures.
    TraceOn(render::Engine),
    Scale(f32),
    FrameAll,
    FrameSelection,
    LookThrough(Option<usize>),
    Relight(Relight),
    /// What is done about known lights.
    Lighting(Lighting),
    /// What is done about masks.
    Masking(Masking),
    /// What is done about charts.
    Charting(Charting),
    Import(ImportAction),
    New(NewAction),
    Model(ModelAction),
    Study(Study),
    ExportScene(ExportAction),
    /// With `true` where a file of that name may go.
    SavePlot(Plotted, PlotFile, PathBuf, bool),
    ShowPalette,
    ShowShortcuts,
    ShowAbout,
    ShowGuide,
    ShowReport,
    Copy(String),
    DismissError(usize),
}

/// What is done about the relit scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Relight {
    AddLight(NewLight),
    /// An OBJ mesh.
    AddObject(PathBuf),
    /// An image of light from all around.
    AddDome(PathBuf),
    Load(PathBuf),
    /// With `true` where a file of that name may go.
    Save(PathBuf, bool),
    /// Takes the selected light or object away.
    Remove,
    Duplicate,
    /// Puts the selected one on the surface below it.
    Drop,
    /// Points what could not be read of the project, by its index, at another file.
    Find(usize, PathBuf),
    /// Takes what could not be read out of the project.
    GiveUp(usize),
    /// Asks which pictures are made, and where to.
    AskPictures,
    /// The folder for them.
    PicturesFolder(PathBuf),
    Render(Box<PictureChoices>),
    StopRendering,
}

/// What is done about the studies.
#[derive(Clone, Debug, PartialEq)]
pub enum Study {
    /// Looks whether it is known what is true of the capture.
    Look,
    Speed(SpeedRequest),
    Stability(StabilityRequest),
    Cancel(Kind),
    /// Forgets what was found.
    Clear(Kind),
    Save(Kind, PathBuf),
    /// Sets the run's options as a setting of the study has them.
    Use(String),
}

/// What becomes selected.
#[derive(Clone, Debug, PartialEq)]
pub enum Select {
    Surface {
        surface: usize,
        mode: Mode,
    },
    /// From the anchor to a surface, of those that are in sight.
    Extend {
        to: usize,
        shown: BTreeSet<usize>,
    },
    Surfaces {
        surfaces: BTreeSet<usize>,
        add: bool,
    },
    AllSurfaces,
    Nothing,
    Material(usize),
    Sample(usize),
    /// The one that the results are furthest from.
    WorstSample,
    Light(usize),
    /// The one that the selected sample gets most light from.
    StrongestLight,
    Photograph(usize),
    Added(Added),
}

/// How a click changes a selection of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Only,
    Toggle,
}

/// What is done about known lights.
#[derive(Clone, Debug, PartialEq)]
pub enum Lighting {
    /// A light of known shape; its strength is to be found.
    Add(NewLight),
    /// The selected surfaces shine.
    AddVisible,
    /// An image of the sky.
    AddSky(PathBuf),
    /// Points what could not be read of the project, by its index, at another file.
    Find(usize, PathBuf),
    /// Takes what could not be read out of the project.
    GiveUp(usize),
}

/// What is done about masks.
#[derive(Clone, Debug, PartialEq)]
pub enum Masking {
    /// Takes a tool up, or lays all down.
    Tool(Option<MaskTool>),
    Draw {
        photograph: usize,
        shape: scene::Shape,
        is_left_out: bool,
    },
    /// Nothing of the photograph is left out.
    Clear,
    Invert,
    Suggest,
    StopSuggesting,
}

/// What is done about charts.
#[derive(Clone, Debug, PartialEq)]
pub enum Charting {
    Add(NewChart),
    /// One whose reflectances a CSV file has.
    AddTable(PathBuf),
    /// Shows one, and places its corners.
    Select(usize),
    /// Takes up the tool that places the corners of the selected one, or lays it down.
    Tool(bool),
    /// The selected one has its corners there, in place of those before.
    Corners {
        photograph: usize,
        corners_px: [DVec2; 4],
    },
    /// The selected one has no corners in a photograph any more.
    RemoveCorners {
        photograph: usize,
    },
    /// The selected one becomes another; what undo calls it.
    Change {
        name: &'static str,
        chart: Box<Chart>,
    },
    /// The selected one is taken away.
    Remove,
    /// Photographs are read anew, corrected by this matrix; without one, as they are in their files.
    Matrix(Option<DMat3>),
}

/// A chart that can be added without a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewChart {
    Grey,
    White,
    ColorChecker,
}

/// What is done about the import page from elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub enum ImportAction {
    /// Shows it, with a source where one is given.
    Show(Option<PathBuf>),
    Hide,
    Choose(Field, PathBuf),
    /// Reads everything again.
    Read,
    Cancel,
    Write {
        replace: bool,
    },
}

/// A path on the import page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    Cameras,
    Images,
    Mesh,
    Out,
}

/// What is done about a capture that is begun of photographs.
#[derive(Clone, Debug, PartialEq)]
pub enum NewAction {
    /// Asks for photographs and a folder.
    Show,
    /// Adds photographs, or those of a folder.
    Add(Vec<PathBuf>),
    /// Photographs that were found, by the file or folder that was named.
    Found(Vec<(PathBuf, Vec<PathBuf>)>),
    Remove(usize),
    /// The folder for the capture.
    Folder(PathBuf),
    Create,
    /// Opens the Model page of a capture that is there.
    Model(PathBuf),
    /// Stops the copying, or leaves the question.
    Leave,
}

/// What is done about the Model page.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelAction {
    /// Shows the page of the open capture.
    Show,
    /// Another model in the place of the present one, by the name of what is done.
    Change(String, Arc<Model>),
    Tool(Tool),
    /// Adds a thing and begins to show its corners.
    Add(model::Shape),
    /// Makes a twin of the selected thing.
    Duplicate,
    /// Removes what is selected.
    Remove,
    /// Turns the selected line around.
    Flip,
    /// Shows the next photograph, or the one before.
    Next(bool),
    /// Lets lines snap to the photograph's edges, or not.
    Snap,
    /// Shows the faces of the model over the photograph, or the photograph again.
    Blink,
    /// Fits the model to the lines of the photographs.
    FitToEdges(ToEdges),
    /// Removes the lines that were found to be edges.
    ForgetFound,
    /// Fits a plane or a box to the points in an outline, in pixels of a photograph.
    FitToPoints(usize, Vec<DVec2>, Wanted),
    /// Fills the view with the photograph.
    Fit,
    /// Writes mesh and cameras, and opens the capture.
    Use,
    /// About cameras that an engine finds.
    Find(FindAction),
}

/// What is fitted to the lines of the photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToEdges {
    /// Moves the selected thing onto them.
    Selected,
    /// Finds which of them are edges of things, and solves everything with them.
    All,
}

/// What is done about cameras that an engine finds.
#[derive(Clone, Debug, PartialEq)]
pub enum FindAction {
    /// Shows the panel, or leaves it; a run goes on.
    Show(bool),
    /// Looks again which engines are installed.
    Look,
    Engine(Engine),
    /// Photographs of one size share a lens.
    Shared(bool),
    Start,
    Cancel,
    /// Takes back what was found: of one photograph, or of all.
    Forget(Option<usize>),
}

/// What is done about the recovered scene for other programs.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportAction {
    /// Asks what is wanted, and where.
    Show,
    Folder(PathBuf),
    Start,
    /// The folder can be written to.
    Write,
    /// Why it cannot.
    Refuse(String),
    Stop,
    Leave,
}

//! The purposes for which a path is asked for, and the action that follows from the answer.

use std::path::PathBuf;

use super::{
    Action, Charting, ExportAction, Field, ImportAction, Lighting, NewAction, PlotFile, Plotted,
    Relight, Study,
};
use crate::app::jobs::studies::Kind;

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
    /// The reflectances of a chart.
    AddChartTable,
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
            Self::AddChartTable => "Table of a chart's reflectances (CSV)",
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
    pub fn is_new_file(self) -> bool {
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
            Self::AddChartTable => Action::Charting(Charting::AddTable(path)),
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

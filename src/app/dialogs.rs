//! The dialogs that are open: for a path, for unsaved work, for a capture that was moved.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::actions::PathRequest;
use super::export_question::ExportQuestion;
use super::guide::GuideView;
use super::new_capture::NewCapture;
use super::opening::{AfterPrompt, Opening};
use super::pending::Pending;
use super::picture_choices::PictureChoices;

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
    pub answer: Pending<(Vec<PathBuf>, Duration)>,
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
    /// Paths are asked for in the window only: there are no dialogs of the system, as in tests, or
    /// none is known of yet.
    pub own_only: bool,
    /// Whether the system has dialogs, once that is known.
    pub(super) looking_for_system: Option<Pending<bool>>,
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

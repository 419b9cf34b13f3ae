//! The project or capture that is being opened, and what follows after the question about unsaved
//! work.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;

use super::pending::Pending;
use super::unsaved::UnsavedWork;
use crate::io::edits::StoredEdits;
use crate::io::project::ProjectFile;
use crate::io::tags::{StoredCharts, StoredLights};
use crate::scene::Capture;

/// What is being opened.
pub struct Opening {
    /// What was asked for; what the list of recent projects will name.
    pub path: PathBuf,
    /// The capture to load.
    pub folder: PathBuf,
    pub project: Option<Box<ProjectFile>>,
    /// What the project changes of the recovered scene, once it has been read.
    pub edits: Option<Box<StoredEdits>>,
    /// Charts in place of those of the capture's files, until they have been read.
    pub charts: Option<Vec<Value>>,
    /// What has been read of them.
    pub read_charts: Option<Box<StoredCharts>>,
    /// The known lights that the project has, once they have been read.
    pub lights: Option<Box<StoredLights>>,
    /// The project file to save to.
    pub file: Option<PathBuf>,
    /// It is unsaved work that a crash left.
    pub recovered: Option<PathBuf>,
    /// It takes its own place, since mesh or cameras have changed: tags and their undo stay.
    pub is_reopened: bool,
    /// What the user agreed to lose for it.
    pub agreed: UnsavedWork,
    pub began: Instant,
}

/// What is looked at before a capture is read: a file or folder that was asked for.
pub struct LookingInto {
    /// What was asked for.
    pub path: PathBuf,
    /// It is unsaved work that a crash left.
    pub is_recovered: bool,
    /// What the user agreed to lose for it.
    pub agreed: UnsavedWork,
    pub began: Instant,
    pub answer: Pending<Result<OnDisk, String>>,
}

/// What is there.
pub enum OnDisk {
    /// The folder of a capture.
    Capture(PathBuf),
    /// What a project's file holds, and whether its capture is where it was.
    Project {
        /// The file's place without links or relative parts.
        path: PathBuf,
        file: Box<ProjectFile>,
        has_capture: bool,
    },
}

/// Results of a project that are being read.
pub struct Restoring {
    pub folder: PathBuf,
    /// The unsaved work of a crash that they are part of.
    pub recovered: Option<PathBuf>,
}

/// What to do after the prompt about unsaved work.
pub enum AfterPrompt {
    Open(PathBuf),
    /// A capture that has no cameras or mesh yet.
    Model(PathBuf),
    /// Unsaved work of a window that crashed.
    Recover(PathBuf),
    /// A capture that has been read while the project before it went on changing.
    Show(Box<Opening>, Arc<Capture>),
    Close,
    Quit,
}

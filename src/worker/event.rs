//! Events: what jobs report.

use std::path::PathBuf;
use std::sync::Arc;

use crate::io::brackets::Found;
use crate::io::edits::StoredEdits;
use crate::io::engines::{Installed, Told};
use crate::io::import::{Import, ShotCheck, Shown, Survey, Written};
use crate::io::model::Opened;
use crate::io::results::Results;
use crate::io::tags::{StoredCharts, StoredLights};
use crate::io::truth::Truth;
use crate::model::FoundCameras;
use crate::model::lines::Line;
use crate::reconstruct::lobes::CoverageMask;
use crate::reconstruct::{Reconstruction, Update};
use crate::render::edits::Edits;
use crate::render::film::Film;
use crate::render::scene::Solved;
use crate::scene::Capture;
use crate::scene::clutter::Suggestion;
use crate::study::Finding;
use crate::study::pictures::PictureScore;
use crate::worker::merge::MergeReport;
use crate::worker::modelling::{EdgesFitted, ModelDrawing, PointsFitted, SolvedModel};
use crate::worker::relight::Relit;
use crate::worker::reprojection::Reprojection;

/// The number of a job; later jobs have larger ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Job(pub(super) u64);

/// An event of a job.
#[derive(Clone, Debug)]
pub struct Event {
    /// As [`crate::worker::Worker::send`] returned it.
    pub job: Job,
    /// What the job reports.
    pub what: JobEvent,
}

/// What a job reports while it runs, and how it ends.
#[derive(Clone, Debug)]
pub enum JobEvent {
    /// The job begins.
    Started,
    /// A stage, product or iteration of a running reconstruction.
    Update(Update),
    /// A capture was read.
    Loaded(Arc<Capture>),
    /// A folder's cameras or mesh are still to be made of its photographs; what is missing.
    Begun(PathBuf, String),
    /// A folder has photographs with cameras, and no mesh; what is missing.
    Meshless(PathBuf, String),
    /// The camera file of this folder was changed.
    CamerasChanged(PathBuf),
    /// A capture of photographs alone was written.
    CaptureBegun(PathBuf),
    /// The model of a capture was read.
    ModelOpened(Box<Opened>),
    /// A model's strokes were solved, or cannot be.
    ModelSolved(Arc<SolvedModel>),
    /// What was solved as a photograph shows it.
    ModelDrawn(Arc<ModelDrawing>),
    /// The faces of what was solved as a photograph shows them.
    ModelReprojected(Arc<Reprojection>),
    /// The lines of a photograph, by its index.
    LinesFound(usize, Arc<Vec<Line>>),
    /// A thing was fitted to the lines of the photographs, or cannot be.
    FittedToEdges(Arc<EdgesFitted>),
    /// A thing was fitted to points, or cannot be.
    FittedToPoints(Arc<PointsFitted>),
    /// Model, mesh and cameras were written into the capture.
    ModelUsed(Arc<SolvedModel>),
    /// Which engines find cameras, and which of them are installed.
    Engines(Vec<Installed>),
    /// What an engine tells while it looks for cameras.
    Told(Told),
    /// An engine has found cameras.
    CamerasFound(Arc<FoundCameras>),
    /// A photograph was read for the screen.
    Shown(Arc<Shown>),
    /// Cameras and mesh of other programs were read.
    Imported(Arc<Import>),
    /// An import was written as a capture into this folder.
    CaptureWritten(PathBuf, Arc<Written>),
    /// Nothing was written: a capture is in the folder already.
    Occupied(PathBuf),
    /// An import can be compared with its photographs.
    Surveyed(Arc<Survey>),
    /// How well one photograph fits an import.
    Checked(Arc<ShotCheck>),
    /// What exposure series share: response, shifts, times.
    Investigated(Arc<Found>),
    /// A reconstruction is done.
    Reconstructed(Arc<Reconstruction>),
    /// Files were written into this folder.
    Exported(PathBuf),
    /// One mask per light; `None` for those that are no disc of the sphere.
    Covered(Arc<Vec<Option<CoverageMask>>>),
    /// Masks for the photographs that are measurements.
    MasksSuggested(Arc<Vec<Suggestion>>),
    /// A picture has gained paths.
    Picture {
        /// Index into `Rendering::frames`.
        frame: usize,
        /// What has been traced so far.
        film: Arc<Film>,
    },
    /// A finer picture of a [`crate::worker::PreviewRequest`].
    Relit(Arc<Relit>),
    /// Results were read.
    Solved(Arc<Solved>),
    /// Edits were read, with what is odd about them.
    Edits(Arc<Edits>, Vec<String>),
    /// The edits of a project were read, as far as they could be.
    StoredEdits(Box<StoredEdits>),
    /// The known lights of a project were read, as far as they could be.
    StoredLights(Box<StoredLights>),
    /// The charts of a project, as far as they could be read.
    StoredCharts(Box<StoredCharts>),
    /// The results beside a project's file were read.
    Results(Box<Results>),
    /// The files of a picture are written.
    PictureWritten {
        /// Pictures whose files are written by now.
        done: usize,
    },
    /// All pictures are made; the folder that they are in, where they were to be written.
    Rendered(Option<PathBuf>),
    /// Exposure series are merged and written.
    Merged(Box<MergeReport>),
    /// How far the picture of a frame is from the photograph that was taken from there.
    Judged {
        /// Index into `Rendering::frames`.
        frame: usize,
        /// Differences between picture and photograph.
        score: Box<PictureScore>,
    },
    /// A run of a study is done.
    Found(Box<Finding>),
    /// The contents of a capture's `truth.json`; `None` where there is none.
    Truth(Option<Arc<Truth>>),
    /// A study is done, with the lines of its summary.
    Studied(Vec<String>),
    /// The job stopped with an error; the text says what, where and what to do.
    Failed(String),
    /// The job was cancelled.
    Cancelled,
}

impl JobEvent {
    /// Whether the job ends with this.
    pub fn is_ending(&self) -> bool {
        !matches!(
            self,
            Self::Started
                | Self::Update(_)
                | Self::Picture { .. }
                | Self::PictureWritten { .. }
                | Self::Judged { .. }
                | Self::Relit(_)
                | Self::Found(_)
                | Self::Told(_)
        )
    }
}

//! What the worker tells.

use std::path::PathBuf;
use std::sync::Arc;

use crate::io::brackets::Found;
use crate::io::import::{Import, ShotCheck, Survey, Written};
use crate::io::truth::Truth;
use crate::reconstruct::lobes::CoverageMask;
use crate::reconstruct::{Reconstruction, Update};
use crate::render::edits::Edits;
use crate::render::film::Film;
use crate::render::scene::Solved;
use crate::scene::Capture;
use crate::study::Finding;
use crate::study::pictures::PictureScore;
use crate::worker::merge::MergeReport;
use crate::worker::relight::Relit;

/// The number of a job; later jobs have larger ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Job(pub(super) u64);

/// Something that happened to a job.
#[derive(Clone, Debug)]
pub struct Event {
    pub job: Job,
    pub happening: Happening,
}

#[derive(Clone, Debug)]
pub enum Happening {
    Started,
    /// A running reconstruction has come to something.
    Update(Update),
    Loaded(Arc<Capture>),
    Imported(Arc<Import>),
    /// What was imported stands in its folder.
    CaptureWritten(PathBuf, Arc<Written>),
    /// Nothing was written: a capture is in the folder already.
    Occupied(PathBuf),
    Surveyed(Arc<Survey>),
    Checked(Arc<ShotCheck>),
    Investigated(Arc<Found>),
    Reconstructed(Arc<Reconstruction>),
    Exported(PathBuf),
    /// One mask per light; `None` for those that are no disc of the sphere.
    Covered(Arc<Vec<Option<CoverageMask>>>),
    /// A picture has gained paths.
    Picture {
        frame: usize,
        film: Arc<Film>,
    },
    /// A changed scene has become clearer.
    Relit(Arc<Relit>),
    /// Results were read.
    Solved(Arc<Solved>),
    /// Edits were read, with what is odd about them.
    Edits(Arc<Edits>, Vec<String>),
    /// All pictures are made; the folder that they are in, where they were to be written.
    Rendered(Option<PathBuf>),
    /// Exposure series are merged and written.
    Merged(Box<MergeReport>),
    /// The picture of a frame, beside the photograph that was taken from there.
    Judged {
        frame: usize,
        score: Box<PictureScore>,
    },
    /// A run of a study is done.
    Found(Box<Finding>),
    /// What is known to be true of a capture, where its folder has it.
    Truth(Option<Arc<Truth>>),
    /// A study is done; what is to be told of it.
    Studied(Vec<String>),
    /// The job stopped with an error; the text says what, where and what to do.
    Failed(String),
    Cancelled,
}

impl Happening {
    /// Whether the job ends with this.
    pub fn is_ending(&self) -> bool {
        !matches!(
            self,
            Self::Started
                | Self::Update(_)
                | Self::Picture { .. }
                | Self::Judged { .. }
                | Self::Relit(_)
                | Self::Found(_)
        )
    }
}

//! Writes the results of a project beside its file.

use std::path::PathBuf;
use std::sync::Arc;

use crate::io;
use crate::io::project::ProjectFile;
use crate::reconstruct::Reconstruction;
use crate::scene::Capture;
use crate::watch::Watch;

/// Results to be written beside a project's file.
#[derive(Clone, Debug)]
pub struct StoreResults {
    /// Their folder.
    pub folder: PathBuf,
    /// Tags and options of the run.
    pub inputs: ProjectFile,
    /// As it was tagged for the run.
    pub capture: Arc<Capture>,
    /// What is written.
    pub reconstruction: Arc<Reconstruction>,
    /// Seconds that loading took, for the report.
    pub load_secs: f64,
}

impl StoreResults {
    /// Writes them.
    pub fn write(&self, watch: &Watch) -> Result<(), io::Error> {
        let Self { folder, inputs, capture, reconstruction, load_secs } = self;
        io::results::write(folder, inputs, capture, reconstruction, *load_secs, watch)
    }
}

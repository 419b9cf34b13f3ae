//! What the worker can be asked to do.

use std::path::PathBuf;
use std::sync::Arc;

use crate::io;
use crate::reconstruct::{self, Options, Reconstruction};
use crate::scene::Capture;
use crate::watch::Watch;
use crate::worker::event::Happening;
use crate::worker::render::{self, Rendering};

/// A job for the worker.
#[derive(Clone, Debug)]
pub enum Command {
    /// Read a capture's folder.
    Load { path: PathBuf },
    /// Reconstruct a loaded capture.
    Reconstruct { capture: Arc<Capture>, options: Box<Options> },
    /// Write a reconstruction into a folder, each file whole or not at all.
    Export {
        capture: Arc<Capture>,
        options: Box<Options>,
        reconstruction: Arc<Reconstruction>,
        /// Seconds that loading took, for the report.
        load_secs: f64,
        folder: PathBuf,
    },
    /// Make pictures of a recovered scene.
    Render(Box<Rendering>),
    #[cfg(test)]
    Panic,
}

impl Command {
    /// Carries the command out; what happens before its end goes to `emit`.
    pub(super) fn perform(self, watch: &Watch, emit: &(dyn Fn(Happening) + Sync)) -> Happening {
        match self {
            Self::Load { path } => match io::capture::load(&path, watch) {
                Ok(capture) => Happening::Loaded(Arc::new(capture)),
                Err(io::Error::Cancelled(_)) => Happening::Cancelled,
                Err(error) => Happening::Failed(error.to_string()),
            },
            Self::Reconstruct { capture, options } => {
                let update = |update| emit(Happening::Update(update));
                match reconstruct::run(&capture, &options, watch, &update) {
                    Ok(reconstruction) => Happening::Reconstructed(Arc::new(reconstruction)),
                    Err(reconstruct::Error::Cancelled(_)) => Happening::Cancelled,
                    Err(error) => Happening::Failed(error.to_string()),
                }
            }
            Self::Export { capture, options, reconstruction, load_secs, folder } => {
                let written = io::export::write(
                    &folder,
                    &capture,
                    &options,
                    &reconstruction,
                    load_secs,
                    watch,
                );
                match written {
                    Ok(()) => Happening::Exported(folder),
                    Err(io::Error::Cancelled(_)) => Happening::Cancelled,
                    Err(error) => Happening::Failed(error.to_string()),
                }
            }
            Self::Render(rendering) => match render::perform(&rendering, watch, emit) {
                Ok(happening) => happening,
                Err(io::Error::Cancelled(_)) => Happening::Cancelled,
                Err(error) => Happening::Failed(error.to_string()),
            },
            #[cfg(test)]
            Self::Panic => panic!("on purpose"),
        }
    }
}

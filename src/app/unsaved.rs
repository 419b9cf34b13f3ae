//! Unsaved work: what would be lost by leaving the project, what is being saved of it, and what was
//! last stored for recovery.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::edit::Edit;
use super::opening::AfterPrompt;
use super::pending::Pending;
use crate::model::Model;
use crate::reconstruct::Reconstruction;
use crate::scene::Capture;
use crate::worker::{Job, StoreResults};

/// Work that is saved nowhere else, and would be lost by leaving the project.
#[derive(Clone, Default)]
pub struct UnsavedWork {
    /// Tags and options that are not saved.
    pub edit: Option<Arc<Edit>>,
    pub run: Option<Job>,
    /// Results that are not saved with the project.
    pub results: Option<Arc<Reconstruction>>,
    pub export: Option<Job>,
    /// Runs of studies that are in no folder.
    pub study: usize,
    /// What was drawn on the photographs and is not saved.
    pub model: Option<Arc<Model>>,
}

impl UnsavedWork {
    pub fn is_nothing(&self) -> bool {
        self.is_within(&Self::default())
    }

    /// Whether nothing would be lost beyond what `then` would.
    pub fn is_within(&self, then: &Self) -> bool {
        let same = self.results.as_ref().zip(then.results.as_ref());
        (self.edit.is_none() || self.edit == then.edit)
            && (self.run.is_none() || self.run == then.run)
            && (self.results.is_none() || same.is_some_and(|(a, b)| Arc::ptr_eq(a, b)))
            && (self.export.is_none() || self.export == then.export)
            && (self.study == 0 || then.study > 0)
            && (self.model.is_none() || self.model == then.model)
    }
}

/// What is kept for recovery.
pub struct Kept {
    pub edit: Arc<Edit>,
    pub results: Option<Arc<Reconstruction>>,
}

/// What is being saved: one after the other, in the order in which it was asked for.
#[derive(Default)]
pub struct Saves {
    pub now: Option<Save>,
    pub waiting: VecDeque<SaveRequest>,
    /// What comes once all is saved.
    pub then: Option<AfterPrompt>,
}

impl Saves {
    /// After this long the window tells that it saves.
    pub const TOLD_AFTER: Duration = Duration::from_millis(400);

    /// Whether it takes so long that people want to know.
    pub fn take_long(&self) -> bool {
        self.now.as_ref().is_some_and(|own| own.began.elapsed() >= Self::TOLD_AFTER)
    }

    pub fn are_under_way(&self) -> bool {
        self.now.is_some() || !self.waiting.is_empty()
    }
}

/// What is to be saved.
pub enum SaveRequest {
    /// What is drawn on the photographs.
    Model,
    /// The project, to a file; one that is there already, and not the project's own, only with leave
    /// to replace it.
    Project { file: PathBuf, replace: bool },
}

/// What is being written.
pub struct Save {
    pub of: Saved,
    pub file: PathBuf,
    pub answer: Pending<Result<PathBuf, NotSaved>>,
    pub began: Instant,
}

/// What was handed to the disk, which may have changed since.
pub enum Saved {
    Model { folder: PathBuf, model: Arc<Model> },
    Project { opened: Arc<Capture>, edit: Arc<Edit>, storing: Option<Box<StoreResults>> },
}

/// Why something was not written.
pub enum NotSaved {
    /// Another file is there.
    IsThere,
    Failed(String),
}

//! Unsaved work: what would be lost by leaving the project, and what was last stored of it.

use std::sync::Arc;

use super::edit::Edit;
use crate::model::Model;
use crate::reconstruct::Reconstruction;
use crate::worker::Job;

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

//! Leaving a project: what that would lose, the question about it, and what comes after.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;

use super::edit::Edit;
use super::files::{self, Opening};
use super::modelling;
use super::state::State;
use crate::model::Model;
use crate::reconstruct::Reconstruction;
use crate::scene::Capture;
use crate::worker::Job;

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
    pub fn of(state: &State, quitting: bool) -> Self {
        let page = state.modelling.as_ref().filter(|page| page.is_changed());
        let model = page.and_then(|page| page.model().cloned());
        let Some(project) = &state.project else { return Self { model, ..Self::default() } };
        let exporting = state.jobs.exporting.as_ref();
        Self {
            edit: project.is_changed().then(|| project.edit().clone()),
            run: project.run.as_ref().map(|run| run.job),
            results: project.unsaved_results().cloned(),
            // An export outlives its project, but not the program.
            export: exporting.map(|(job, _)| *job).filter(|_| quitting),
            study: state.jobs.studies.at_stake(),
            model,
        }
    }

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

/// Leaves the project, after asking where something would be lost.
pub fn leave(state: &mut State, then: AfterPrompt) {
    if UnsavedWork::of(state, matches!(then, AfterPrompt::Quit)).is_nothing() {
        once_saved(state, then);
    } else {
        state.dialogs.unsaved = Some(then);
    }
}

/// Leaves the project without asking, once its results are on the disk.
pub fn once_saved(state: &mut State, then: AfterPrompt) {
    if state.jobs.is_storing() {
        state.messages.notice("The results are being saved first.");
        state.after_storing = Some(then);
    } else {
        proceed(state, then);
    }
}

/// Leaves the project without asking.
pub fn proceed(state: &mut State, then: AfterPrompt) {
    match then {
        AfterPrompt::Open(path) => files::open_unprompted(state, &path),
        AfterPrompt::Model(folder) => {
            files::close_unprompted(state);
            modelling::open(state, &folder);
            files::remember(state, &folder);
        }
        AfterPrompt::Recover(file) => files::recover_unprompted(state, &file),
        AfterPrompt::Show(opening, capture) => files::show(state, *opening, capture),
        AfterPrompt::Close => {
            files::close_unprompted(state);
            files::look_for_recent(state);
        }
        AfterPrompt::Quit => {
            state.settings.layout = state.layout.value();
            state.remember_window();
            files::save_settings(state);
            files::close_unprompted(state);
            state.quitting = true;
            state.ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }
}

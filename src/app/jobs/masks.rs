//! The job that suggests masks.

use std::sync::Arc;

use super::Jobs;
use super::tasks::Lane;
use crate::app::masking;
use crate::app::project::Project;
use crate::app::state::State;
use crate::scene::{Capture, clutter};
use crate::watch::Progress;
use crate::worker::{Command, JobEvent};

/// For a capture as it was opened.
pub(super) struct SuggestMasks(Arc<Capture>);

impl SuggestMasks {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        match answer {
            JobEvent::MasksSuggested(suggestions) => {
                masking::suggested(state, &self.0, &suggestions);
            }
            JobEvent::Failed(text) => state.messages.error("Masks cannot be suggested", text),
            _ => {}
        }
    }
}

impl Jobs {
    /// Begins to suggest masks; a job that is under way is given up.
    pub fn suggest_masks(&mut self, project: &Project) {
        self.stop_suggesting();
        let capture = project.capture.clone();
        let threshold = clutter::SUGGESTED;
        let command = Command::SuggestMasks { capture, threshold };
        self.begin_task(Lane::Runner, command, SuggestMasks(project.opened.clone()));
    }

    pub fn stop_suggesting(&mut self) {
        self.cancel_tasks::<SuggestMasks>();
        self.forget_tasks::<SuggestMasks>();
    }

    pub fn is_suggesting(&self) -> bool {
        self.is_at::<SuggestMasks>()
    }

    /// How far masks are that are being suggested.
    pub fn suggesting(&self) -> Option<Progress> {
        self.progress_of::<SuggestMasks>()
    }
}

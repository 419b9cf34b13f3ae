//! The job that suggests masks.

use std::sync::Arc;

use super::{Jobs, Lane, Task};
use crate::app::masking;
use crate::app::project::Project;
use crate::app::state::State;
use crate::scene::{Capture, clutter};
use crate::watch::Progress;
use crate::worker::{Command, JobEvent};

impl Jobs {
    /// Begins to suggest masks; a job that is under way is given up.
    pub fn suggest_masks(&mut self, project: &Project) {
        self.stop_suggesting();
        let capture = project.capture.clone();
        let threshold = clutter::THRESHOLD;
        let command = Command::SuggestMasks { capture, threshold };
        self.begin_task(Lane::Runner, command, Task::SuggestMasks(project.loaded.clone()));
    }

    pub fn stop_suggesting(&mut self) {
        self.cancel_tasks(is_of_masks);
        self.forget_tasks(is_of_masks);
    }

    pub fn is_suggesting(&self) -> bool {
        self.is_at(is_of_masks)
    }

    /// How far masks are that are being suggested.
    pub fn suggesting(&self) -> Option<Progress> {
        self.progress_of(is_of_masks)
    }
}

fn is_of_masks(task: &Task) -> bool {
    matches!(task, Task::SuggestMasks(_))
}

/// Masks were suggested for a capture, or cannot be.
pub(super) fn suggested(state: &mut State, of: &Arc<Capture>, what: &JobEvent) {
    match what {
        JobEvent::MasksSuggested(suggestions) => masking::suggested(state, of, suggestions),
        JobEvent::Failed(text) => {
            state.messages.error("Masks cannot be suggested", text.clone());
        }
        _ => {}
    }
}

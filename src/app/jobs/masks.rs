//! The job that suggests masks.

use std::sync::Arc;

use super::Jobs;
use crate::app::masking;
use crate::app::project::Project;
use crate::app::state::State;
use crate::scene::clutter;
use crate::watch::Progress;
use crate::worker::{Command, Event, JobEvent};

impl Jobs {
    /// Begins to suggest masks; a job that is under way is given up.
    pub fn suggest_masks(&mut self, project: &Project) {
        self.stop_suggesting();
        let capture = project.capture.clone();
        let threshold = clutter::THRESHOLD;
        let job = self.runner.send(Command::SuggestMasks { capture, threshold });
        self.masks = Some((job, project.loaded.clone()));
    }

    pub fn stop_suggesting(&mut self) {
        if let Some((job, _)) = self.masks.take() {
            self.runner.cancel(job);
        }
    }

    pub fn is_suggesting(&self) -> bool {
        self.masks.is_some()
    }

    /// How far masks are that are being suggested.
    pub fn suggesting(&self) -> Option<Progress> {
        self.runner.progress(self.masks.as_ref()?.0)
    }
}

/// What the worker tells of masks; says whether the event was one.
pub(super) fn told(state: &mut State, event: &Event) -> bool {
    let Some((_, of)) = state.jobs.masks.take_if(|(job, _)| *job == event.job) else {
        return false;
    };
    match &event.what {
        JobEvent::MasksSuggested(suggestions) => {
            masking::suggested(state, &Arc::clone(&of), suggestions);
        }
        JobEvent::Failed(text) => {
            state.messages.error("Masks cannot be suggested", text.clone());
        }
        what if !what.is_ending() => state.jobs.masks = Some((event.job, of)),
        _ => {}
    }
    true
}

//! The jobs that read and write the results of a project, and the one that exports results.

use std::path::PathBuf;
use std::sync::Arc;

use super::Jobs;
use super::reading::Read;
use super::tasks::Lane;
use crate::app::opening::Restoring;
use crate::app::project::Project;
use crate::app::state::State;
use crate::app::{keeping, leaving};
use crate::reconstruct::Reconstruction;
use crate::worker::{Command, Job, JobEvent, StoreResults};

/// Results that a project points to are read from a folder.
pub(super) struct ReadSolved(PathBuf);

impl ReadSolved {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        keeping::solved(state, self.0, answer);
    }
}

/// Results that belong to a project's file are read.
pub(super) struct ReadResults(Restoring);

impl ReadResults {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        keeping::restored(state, self.0, answer);
    }
}

/// Results that belong to a project's file are written.
pub(super) struct WriteResults(Arc<Reconstruction>);

impl WriteResults {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        if let Some(then) = keeping::stored(state, &self.0, answer) {
            leaving::proceed(state, then);
        }
    }
}

/// Results are written where people want them.
pub(super) struct Export(Arc<Reconstruction>);

impl Export {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        match answer {
            JobEvent::Exported(folder) => {
                if let Some(Project { products, solution, .. }) = &mut state.project
                    && products.whole.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, &self.0))
                {
                    *solution = Some(folder.clone());
                }
                state.messages.notice(format!("Results written to {}", folder.display()));
            }
            JobEvent::Failed(text) => state.messages.error("The results cannot be written", text),
            _ => {}
        }
    }
}

impl Jobs {
    /// Reads the results that a project points to.
    pub fn read_solved(&mut self, project: &Project, folder: PathBuf) {
        let (capture, path) = (project.capture.clone(), folder.clone());
        let command = Command::ReadSolved { capture, folder: path };
        self.begin_task(Lane::Loader, command, ReadSolved(folder));
    }

    /// Reads the results that belong to a project's file.
    pub fn read_results(&mut self, project: &Project, folder: PathBuf, recovered: Option<PathBuf>) {
        let (capture, path) = (project.loaded.clone(), folder.clone());
        let command = Command::ReadResults { capture, folder: path };
        self.begin_task(Lane::Loader, command, ReadResults(Restoring { folder, recovered }));
    }

    pub fn is_restoring(&self) -> bool {
        self.is_at::<ReadResults>()
    }

    /// What is being read belongs to a project that is no longer open.
    pub fn stop_restoring(&mut self) {
        self.forget_tasks::<ReadSolved>();
        self.forget_tasks::<ReadResults>();
        self.forget_tasks::<Read>();
    }

    /// Writes the results that belong to a project's file.
    pub fn store_results(&mut self, storing: StoreResults) {
        let whole = storing.reconstruction.clone();
        let command = Command::StoreResults(Box::new(storing));
        self.begin_task(Lane::Loader, command, WriteResults(whole));
    }

    pub fn is_storing(&self) -> bool {
        self.is_at::<WriteResults>()
    }

    /// Writes the results; nothing is done without any.
    pub fn export(&mut self, project: &Project, folder: PathBuf) {
        let Some((whole, (edit, capture))) =
            project.products.whole.clone().zip(project.products.of.clone())
        else {
            return;
        };
        let command = Command::Export {
            capture,
            options: Box::new(edit.run_options()),
            reconstruction: whole.clone(),
            load_secs: project.load_secs,
            folder,
        };
        self.begin_task(Lane::Runner, command, Export(whole));
    }

    /// The export under way.
    pub fn exporting(&self) -> Option<Job> {
        self.job_of::<Export>()
    }
}

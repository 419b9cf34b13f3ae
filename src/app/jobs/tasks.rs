//! Jobs that come to one answer. A new one has a variant here, which holds what its answer is for,
//! and a line in `ended` of `events.rs`, which hands the answer to the file of the job; that file
//! starts it by `Jobs::begin_task`.

use std::path::PathBuf;
use std::sync::Arc;

use super::{Jobs, Reading};
use crate::app::opening::Restoring;
use crate::reconstruct::Reconstruction;
use crate::scene::Capture;
use crate::watch::Progress;
use crate::worker::{Command, Job, Worker};

/// What an answer is for.
pub enum Task {
    /// Results that a project points to are read from a folder.
    ReadSolved(PathBuf),
    /// Results that belong to a project's file are read.
    ReadResults(Restoring),
    /// They are written.
    StoreResults(Arc<Reconstruction>),
    /// Edits or known lights are read, or a camera file is changed.
    Read(Reading),
    /// Results are written where people want them.
    Export(Arc<Reconstruction>),
    /// The recovered scene is written for other programs.
    ExportScene,
    /// Masks are suggested for a capture as it was loaded.
    SuggestMasks(Arc<Capture>),
}

/// Which of the workers does it: each does one job after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    Loader,
    Runner,
    Renderer,
}

/// A task under way.
pub struct Running {
    lane: Lane,
    job: Job,
    task: Task,
}

impl Jobs {
    fn worker(&self, lane: Lane) -> &Worker {
        match lane {
            Lane::Loader => &self.loader,
            Lane::Runner => &self.runner,
            Lane::Renderer => &self.render_worker,
        }
    }

    /// Begins a job whose answer `ended` in `events.rs` is to take.
    pub(super) fn begin_task(&mut self, lane: Lane, command: Command, task: Task) {
        let worker = match lane {
            Lane::Loader => &mut self.loader,
            Lane::Runner => &mut self.runner,
            Lane::Renderer => &mut self.render_worker,
        };
        let job = worker.send(command);
        self.tasks.push(Running { lane, job, task });
    }

    /// Takes the task whose job has ended, where it is one of these.
    pub(super) fn take_ended(&mut self, lane: Lane, job: Job) -> Option<Task> {
        let index = self.tasks.iter().position(|own| (own.lane, own.job) == (lane, job))?;
        Some(self.tasks.remove(index).task)
    }

    /// Whether some task of a kind is under way.
    pub(super) fn is_at(&self, kind: impl Fn(&Task) -> bool) -> bool {
        self.job_of(kind).is_some()
    }

    pub(super) fn job_of(&self, kind: impl Fn(&Task) -> bool) -> Option<Job> {
        self.tasks.iter().find(|own| kind(&own.task)).map(|own| own.job)
    }

    /// How far the first task of a kind is.
    pub(super) fn progress_of(&self, kind: impl Fn(&Task) -> bool) -> Option<Progress> {
        let own = self.tasks.iter().find(|own| kind(&own.task))?;
        self.worker(own.lane).progress(own.job)
    }

    /// Cancels the tasks of a kind, which then end as cancelled.
    pub(super) fn cancel_tasks(&self, kind: impl Fn(&Task) -> bool) {
        for own in self.tasks.iter().filter(|own| kind(&own.task)) {
            self.worker(own.lane).cancel(own.job);
        }
    }

    /// Wants no answer of tasks of a kind any more.
    pub(super) fn forget_tasks(&mut self, kind: impl Fn(&Task) -> bool) {
        self.tasks.retain(|own| !kind(&own.task));
    }
}
